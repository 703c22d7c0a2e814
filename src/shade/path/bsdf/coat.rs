//! Plastic: a dielectric coat over a diffuse base, with all light that goes to and fro between them.
//!
//! Source: W. Jakob's *Mitsuba* describes the model as `plastic` with `nonlinear`: what enters, (1 - F), is reflected
//! by the base, and of what reaches the coat from inside a mean share F_i comes back to the base, which gives
//! base / (1 - base F_i). With a rough coat the albedo E of its facets stands for F, and the base is weighted by 1 - E of
//! both directions over the mean of it, as C. Kelemen and L. Szirmay-Kalos do (*A Microfacet Based Coupled
//! Specular-Matte BRDF Model with Importance Sampling*, 2001).

use std::f64::consts::FRAC_1_PI;

use super::conductor::reflected;
use super::facets::{FacetsList, PacketFacets};
use super::ggx::Ggx;
use super::matte::infinity;
use super::warp::cosine;
use super::{Bsdf, Sampled, Value, brightness, fresnel, mirrored, only, ratio};
use crate::lanes::space::{add, choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::look_lanes::LookLanes;

/// The base under its coat.
struct Base<V> {
    /// Base / (1 - base F_i) / eta^2.
    color: Lanes3<V>,
    eta: V,
}

impl<V: Lanes> Base<V> {
    #[inline(always)]
    fn load(look: &LookLanes<V>) -> Self {
        let (one, base) = (V::constant(1.0), look.base);
        let (eta, inside): (V, V) = (look.param[0], look.param[1]);
        Self { color: base.map(|c| c / ((one - c * inside) * eta * eta)), eta }
    }

    /// Value over Lambert's cosine / pi, for light that the coat lets in at `wi` and out at `wo`.
    #[inline(always)]
    fn value(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Lanes3<V> {
        let one = V::constant(1.0);
        let (out, _) = fresnel::dielectric(wo[2], self.eta);
        let (into, _) = fresnel::dielectric(wi[2].abs(), self.eta);
        let pass = (one - out) * (one - into);
        self.color.map(|c| c * pass)
    }

    /// Chance of the coat's reflection `f` against the base's.
    #[inline(always)]
    fn coat_chance(&self, f: V) -> V {
        let base = (V::constant(1.0) - f) * brightness(self.color) * self.eta * self.eta;
        ratio(f, f + base)
    }
}

/// With a smooth coat.
pub struct SmoothCoat<V>(Base<V>);

impl<V: Lanes> Bsdf<'_, V> for SmoothCoat<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        Self(Base::load(look))
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let chance = V::constant(1.0) - self.0.coat_chance(fresnel::dielectric(wo[2], self.0.eta).0);
        let value = Value { value: self.0.value(wo, wi).map(|c| c * lambert), pdf: lambert * chance };
        only(V::constant(0.0).cmp_lt(wi[2]), value)
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let (f, _) = fresnel::dielectric(wo[2], self.0.eta);
        let chance = self.0.coat_chance(f);
        let is_coat = choice.cmp_lt(chance);
        let down = cosine(place);
        let wi = choose(is_coat, mirrored(wo), down);
        let rest = one - chance;
        let pdf = V::select(is_coat, V::splat(infinity::<V>()), down[2] * V::constant(FRAC_1_PI) * rest);
        let base = self.0.value(wo, down).map(|c| ratio(c, rest));
        let alive = zero.cmp_lt(wi[2]);
        let weight = choose(is_coat, [ratio(f, chance); 3], base).map(|w| V::select(alive, w, zero));
        Sampled { wi, weight, pdf, squeeze: one }
    }
}

/// With a coat of facets: what it does not mirror at once the base gets, so nothing is lost.
pub struct RoughCoat<'t, V> {
    /// Share of what the base gets that comes back, over the mean of what it gets.
    color: Lanes3<V>,
    /// Brightness of that share.
    share: V,
    eta: V,
    ggx: Ggx<V>,
    facets: PacketFacets<'t, V>,
}

impl<V: Lanes> RoughCoat<'_, V> {
    /// Chance of the coat's reflection when the base gets the share `under`.
    #[inline(always)]
    fn coat_chance(&self, under: V) -> V {
        let coat = V::constant(1.0) - under;
        ratio(coat, self.share.mul_add(under, coat))
    }
}

impl<'t, V: Lanes> Bsdf<'t, V> for RoughCoat<'t, V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, facets: &'t FacetsList) -> Self {
        let one = V::constant(1.0);
        let facets = PacketFacets::<V>::load(facets, look.param[3]);
        let inside = facets.chance;
        let share = look.base.map(|c| c * (one - inside) / (one - c * inside));
        Self {
            color: share.map(|c| c * facets.down),
            share: brightness(share),
            eta: look.param[0],
            ggx: Ggx::new(look.param[2]),
            facets,
        }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let (one, four) = (V::constant(1.0), V::constant(4.0));
        let h = normalize(add(wo, wi));
        let cos = dot(wo, h);
        let (f, _) = fresnel::dielectric(cos, self.eta);
        let coat = f * self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (four * wo[2]);
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let under = self.facets.lost(wo[2]);
        let passed = under * self.facets.lost(wi[2]) * lambert;
        let value = self.color.map(|c| c.mul_add(passed, coat));
        let chance = self.coat_chance(under);
        let coat_pdf = self.ggx.visible_pdf(wo, h) / (four * cos);
        let pdf = chance * coat_pdf + (one - chance) * lambert;
        only(V::constant(0.0).cmp_lt(wi[2]), Value { value, pdf })
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let chance = self.coat_chance(self.facets.lost(wo[2]));
        let (up, ..) = reflected(&self.ggx, wo, self.ggx.visible(wo, place));
        let wi = choose(choice.cmp_lt(chance), up, cosine(place));
        let found = self.eval(wo, wi);
        Sampled { wi, weight: found.value.map(|c| ratio(c, found.pdf)), pdf: found.pdf, squeeze: V::constant(1.0) }
    }
}
