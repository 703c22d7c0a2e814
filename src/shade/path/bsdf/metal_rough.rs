//! glTF's material: metal and coated diffuse base blended, part of the base a thin sheet of tinted glass.
//!
//! Source: Khronos Group, "glTF 2.0 Specification", appendix B, and the extensions KHR_materials_ior and
//! KHR_materials_transmission; Schlick's Fresnel term, GGX with height-correlated masking. Of the couplings that
//! appendix discusses ours keeps all light: what facets throw at each other comes back (see [`super::facets`]), and the
//! base gets what they do not reflect at all, as C. Kelemen and L. Szirmay-Kalos have it (2001). Metal and coat are
//! blended as wholes, as the appendix defines it; its sample code lets the metal's reflectance dim the base besides.

use std::f64::consts::FRAC_1_PI;

use super::conductor::reflected;
use super::facets::{FacetsList, repeated};
use super::ggx::Ggx;
use super::rows::PacketRows;
use super::warp::{cosine, grazing, grazing_pdf};
use super::{Bsdf, Sampled, Value, brightness, fresnel, only, ratio};
use crate::lanes::space::{add, choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::look_lanes::LookLanes;

/// A packet of them.
pub struct MetalRough<V> {
    /// Diffuse reflectance and transmittance under a coat that reflects nothing.
    diffuse: Lanes3<V>,
    through: Lanes3<V>,
    /// Reflectance at normal incidence, and of light that many facets have thrown at each other.
    f0: Lanes3<V>,
    many: Lanes3<V>,
    /// The same of the coat alone.
    coat_f0: V,
    coat_many: V,
    /// Width of the facets.
    alpha: V,
    ggx: Ggx<V>,
    rows: PacketRows<V>,
}

/// Albedos in one direction, or their means.
struct Albedo<V> {
    /// Of facets that mirror all, what they lose.
    lost: V,
    /// What comes back from one facet, and from one of the coat.
    once: Lanes3<V>,
    coat_once: V,
    /// What facets of the coat do not reflect at all.
    under: V,
}

/// Chances of the lobes: of facets, of what they throw at each other, above and below, and of the base.
struct Chances<V> {
    facets: V,
    thrown: V,
    base: V,
    facets_below: V,
    thrown_below: V,
}

impl<V: Lanes> MetalRough<V> {
    #[inline(always)]
    fn albedo(&self, lost: V, fifth: V) -> Albedo<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let once = |f: V| f * (one - lost) + (one - f) * fifth;
        let coat_once = once(self.coat_f0);
        let under = (one - coat_once - lost * self.coat_many).fast_max(zero);
        Albedo { lost, once: self.f0.map(once), coat_once, under }
    }

    #[inline(always)]
    fn albedo_at(&self, cos: V) -> Albedo<V> {
        self.albedo(self.rows.lost(cos), self.rows.fifth(cos))
    }

    #[inline(always)]
    fn chances(&self, out: &Albedo<V>) -> Chances<V> {
        let one = V::constant(1.0);
        let facets = brightness(out.once);
        let thrown = brightness(self.many) * out.lost;
        let base = brightness(self.diffuse) * out.under;
        let through = brightness(self.through);
        let facets_below = (one - out.lost - out.coat_once).fast_max(V::constant(0.0)) * through;
        let thrown_below = (one - self.coat_many) * out.lost * through;
        let rcp = one / (facets + thrown + base + facets_below + thrown_below);
        Chances {
            facets: facets * rcp,
            thrown: thrown * rcp,
            base: base * rcp,
            facets_below: facets_below * rcp,
            thrown_below: thrown_below * rcp,
        }
    }

    #[inline(always)]
    fn value(&self, wo: Lanes3<V>, wi: Lanes3<V>, out: &Albedo<V>, chances: &Chances<V>) -> Value<V> {
        let (zero, one, four) = (V::constant(0.0), V::constant(1.0), V::constant(4.0));
        let above = zero.cmp_lt(wi[2]);
        // What passes the sheet has the shape of what it reflects, seen from behind.
        let wi = [wi[0], wi[1], wi[2].abs()];
        let h = normalize(add(wo, wi));
        let cos = dot(wo, h);
        let f = fresnel::schlick(cos, self.f0);
        let [coat, ..] = fresnel::schlick(cos, [self.coat_f0; 3]);
        let facets = self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (four * wo[2]);
        let facets_pdf = self.ggx.visible_pdf(wo, h) / (four * cos);
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let into = self.albedo_at(wi[2]);
        let means = self.albedo(self.rows.means[0], self.rows.means[1]);
        let thrown = ratio(out.lost * into.lost * lambert, means.lost);
        let base = ratio(out.under * into.under * lambert, means.under);
        let passed = facets * (one - coat) + thrown * (one - self.coat_many);
        let value = [0, 1, 2].map(|c| {
            let up = facets.mul_add(f[c], thrown.mul_add(self.many[c], base * self.diffuse[c]));
            V::select(above, up, passed * self.through[c])
        });
        let thrown_pdf = grazing_pdf(wi[2], self.alpha);
        let up_pdf = chances.facets.mul_add(facets_pdf, chances.thrown.mul_add(thrown_pdf, chances.base * lambert));
        let down_pdf = chances.facets_below.mul_add(facets_pdf, chances.thrown_below * thrown_pdf);
        only(zero.cmp_lt(wi[2]), Value { value, pdf: V::select(above, up_pdf, down_pdf) })
    }
}

impl<V: Lanes> Bsdf<'_, V> for MetalRough<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        let one = V::constant(1.0);
        let base = look.base;
        let [metallic, alpha, f0, transmission] = [0, 1, 2, 3].map(|i| look.param[i]);
        let body = one - metallic;
        let rows = PacketRows::new(alpha);
        // The mean of (1 - cos)^5 over the hemisphere, weighted by the cosine, is 1 / 21.
        let many = |f: V| repeated((one - f).mul_add(V::constant(1.0 / 21.0), f), rows.means[0]);
        let coat_many = many(f0);
        Self {
            diffuse: base.map(|c| c * body * (one - transmission)),
            through: base.map(|c| c * body * transmission),
            f0: base.map(|c| metallic.mul_add(c, body * f0)),
            many: base.map(|c| metallic.mul_add(many(c), body * coat_many)),
            coat_f0: f0,
            coat_many,
            alpha,
            ggx: Ggx::new(alpha),
            rows,
        }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let out = self.albedo_at(wo[2]);
        self.value(wo, wi, &out, &self.chances(&out))
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let zero = V::constant(0.0);
        let out = self.albedo_at(wo[2]);
        let chances = self.chances(&out);
        let (up, ..) = reflected(&self.ggx, wo, self.ggx.visible(wo, place));
        let (facets, thrown) = (chances.facets, chances.facets + chances.thrown);
        let above = thrown + chances.base;
        let is_below = above.cmp_le(choice);
        let is_facets = choice.cmp_lt(facets) | (is_below & choice.cmp_lt(above + chances.facets_below));
        let is_base = thrown.cmp_le(choice) & choice.cmp_lt(above);
        let wi = choose(is_facets, up, choose(is_base, cosine(place), grazing(place, self.alpha)));
        // A facet may mirror light into the surface: such a direction belongs to no lobe.
        let is_lost = wi[2].cmp_le(zero);
        let wi = [wi[0], wi[1], V::select(is_below, -wi[2], wi[2])];
        let found = self.value(wo, wi, &out, &chances);
        let weight = found.value.map(|c| V::select(is_lost, zero, ratio(c, found.pdf)));
        Sampled { wi, weight, pdf: found.pdf, squeeze: V::constant(1.0) }
    }
}
