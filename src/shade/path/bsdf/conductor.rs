//! Metals, smooth and rough.

use std::f64::consts::FRAC_1_PI;

use super::facets::{FacetsList, PacketFacets};
use super::ggx::Ggx;
use super::matte::infinity;
use super::warp::{grazing, grazing_pdf};
use super::{Bsdf, Sampled, Value, fresnel, mirrored, none, only, ratio};
use crate::lanes::space::{add, choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::look_lanes::LookLanes;

/// A packet of complex indices of refraction.
struct Metal<V> {
    eta: Lanes3<V>,
    k: Lanes3<V>,
}

impl<V: Lanes> Metal<V> {
    #[inline(always)]
    fn load(look: &LookLanes<V>) -> Self {
        Self { eta: look.three(0), k: look.three(3) }
    }

    #[inline(always)]
    fn reflectance(&self, cos: V) -> Lanes3<V> {
        [0, 1, 2].map(|c| fresnel::conductor(cos, self.eta[c], self.k[c]))
    }
}

/// A perfect mirror of metal.
pub struct SmoothConductor<V>(Metal<V>);

impl<V: Lanes> Bsdf<'_, V> for SmoothConductor<V> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        Self(Metal::load(look))
    }

    #[inline(always)]
    fn eval(&self, _: Lanes3<V>, _: Lanes3<V>) -> Value<V> {
        none()
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, _: [V; 2], _: V) -> Sampled<V> {
        let pdf = V::splat(infinity::<V>());
        Sampled { wi: mirrored(wo), weight: self.0.reflectance(wo[2]), pdf, squeeze: V::constant(1.0) }
    }
}

/// Facets of metal.
pub struct RoughConductor<'t, V> {
    metal: Metal<V>,
    ggx: Ggx<V>,
    facets: PacketFacets<'t, V>,
}

impl<'t, V: Lanes> Bsdf<'t, V> for RoughConductor<'t, V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, facets: &'t FacetsList) -> Self {
        let facets = PacketFacets::load(facets, look.param[6]);
        Self { metal: Metal::load(look), ggx: Ggx::new(facets.alpha), facets }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let h = normalize(add(wo, wi));
        let cos = dot(wo, h);
        let shape = self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (V::constant(4.0) * wo[2]);
        let single = self.ggx.visible_pdf(wo, h) / (V::constant(4.0) * cos);
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let chance = self.facets.lost(wo[2]);
        let wide = chance * self.facets.lost(wi[2]) * lambert;
        let reflectance = self.metal.reflectance(cos);
        let value = [0, 1, 2].map(|c| reflectance[c].mul_add(shape, self.facets.up[c] * wide));
        let pdf = chance.mul_add(grazing_pdf(wi[2], self.facets.alpha) - single, single);
        only(V::constant(0.0).cmp_lt(wi[2]), Value { value, pdf })
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let (up, ..) = reflected(&self.ggx, wo, self.ggx.visible(wo, place));
        let wi = choose(choice.cmp_lt(self.facets.lost(wo[2])), grazing(place, self.facets.alpha), up);
        let found = self.eval(wo, wi);
        Sampled { wi, weight: found.value.map(|c| ratio(c, found.pdf)), pdf: found.pdf, squeeze: V::constant(1.0) }
    }
}

/// The direction mirrored at a visible facet `h`, what masking leaves of it, and its density.
#[inline(always)]
pub fn reflected<V: Lanes>(ggx: &Ggx<V>, wo: Lanes3<V>, h: Lanes3<V>) -> (Lanes3<V>, V, V) {
    let cos = dot(wo, h);
    let twice = V::constant(2.0) * cos;
    let wi = [0, 1, 2].map(|i| twice.mul_add(h[i], -wo[i]));
    let weight = ratio(ggx.masking_both(wo, wi), ggx.masking(wo));
    (wi, weight, ggx.visible_pdf(wo, h) / (V::constant(4.0) * cos))
}
