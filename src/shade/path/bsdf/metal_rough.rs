//! glTF's material: metal and coated diffuse base blended, part of the base a thin sheet of tinted glass.
//!
//! Source: Khronos Group, "glTF 2.0 Specification", appendix B, and the extensions KHR_materials_ior and
//! KHR_materials_transmission; Schlick's Fresnel term, GGX with height-correlated masking.

use std::f64::consts::FRAC_1_PI;

use super::conductor::reflected;
use super::ggx::Ggx;
use super::warp::cosine;
use super::{Bsdf, Sampled, Value, brightness, fresnel, only, ratio};
use crate::lanes::space::{add, choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::path::points::{BASE, PARAM, Points};

/// A packet of them.
pub struct MetalRough<V> {
    /// Diffuse reflectance and transmittance under a coat that reflects nothing.
    diffuse: Lanes3<V>,
    through: Lanes3<V>,
    /// Reflectance at normal incidence.
    f0: Lanes3<V>,
    ggx: Ggx<V>,
}

/// Chances of the three lobes.
struct Chances<V> {
    facets: V,
    diffuse: V,
    through: V,
}

impl<V: Lanes> MetalRough<V> {
    #[inline(always)]
    fn chances(&self, wo: Lanes3<V>) -> Chances<V> {
        let one = V::constant(1.0);
        let f = brightness(fresnel::schlick(wo[2], self.f0));
        let rest = one - f;
        let (diffuse, through) = (rest * brightness(self.diffuse), rest * brightness(self.through));
        let all = f + diffuse + through;
        Chances { facets: f / all, diffuse: diffuse / all, through: through / all }
    }
}

impl<V: Lanes> Bsdf<V> for MetalRough<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        let one = V::constant(1.0);
        let base = points.vector::<V>(BASE, first);
        let [metallic, alpha, f0, transmission] = [0, 1, 2, 3].map(|i| points.scalar::<V>(PARAM + i, first));
        let body = one - metallic;
        Self {
            diffuse: base.map(|c| c * body * (one - transmission)),
            through: base.map(|c| c * body * transmission),
            f0: base.map(|c| metallic.mul_add(c, body * f0)),
            ggx: Ggx::new(alpha),
        }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let (zero, one, four) = (V::constant(0.0), V::constant(1.0), V::constant(4.0));
        let above = zero.cmp_lt(wi[2]);
        // What passes the sheet has the shape of what it reflects, seen from behind.
        let wi = [wi[0], wi[1], wi[2].abs()];
        let h = normalize(add(wo, wi));
        let cos = dot(wo, h);
        let f = fresnel::schlick(cos, self.f0);
        let facets = self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (four * wo[2]);
        let facets_pdf = self.ggx.visible_pdf(wo, h) / (four * cos);
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let chances = self.chances(wo);
        let value = [0, 1, 2].map(|c| {
            let pass = one - f[c];
            let up = facets.mul_add(f[c], lambert * pass * self.diffuse[c]);
            V::select(above, up, facets * pass * self.through[c])
        });
        let up_pdf = chances.facets.mul_add(facets_pdf, chances.diffuse * lambert);
        let pdf = V::select(above, up_pdf, chances.through * facets_pdf);
        only(zero.cmp_lt(wi[2]), Value { value, pdf })
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let chances = self.chances(wo);
        let (up, ..) = reflected(&self.ggx, wo, self.ggx.visible(wo, place));
        let is_facets = choice.cmp_lt(chances.facets);
        let is_through = (chances.facets + chances.diffuse).cmp_le(choice);
        let wi = choose(is_facets, up, cosine(place));
        let wi = choose(is_through, [up[0], up[1], -up[2]], wi);
        let found = self.eval(wo, wi);
        // A facet may mirror light into the surface: such a direction belongs to no lobe.
        let lost = !is_through_or(is_facets, is_through, up);
        let weight = found.value.map(|c| V::select(lost, V::constant(0.0), ratio(c, found.pdf)));
        Sampled { wi, weight, pdf: found.pdf, squeeze: V::constant(1.0) }
    }
}

/// Whether the lobe that was chosen has the direction: the diffuse one always, the others if `up` points up.
#[inline(always)]
fn is_through_or<M: crate::lanes::LaneMask, V: Lanes<Mask = M>>(facets: M, through: M, up: Lanes3<V>) -> M {
    !(facets | through) | V::constant(0.0).cmp_lt(up[2])
}
