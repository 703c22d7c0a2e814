//! Lambert reflection plus a perfect mirror.

use std::f64::consts::FRAC_1_PI;

use super::facets::FacetsList;
use super::warp::cosine;
use super::{Bsdf, Sampled, Value, brightness, mirrored, only, ratio};
use crate::lanes::space::choose;
use crate::lanes::{Lanes, Lanes3};
use crate::shade::look_lanes::LookLanes;

/// A packet of them.
pub struct Matte<V> {
    diffuse: Lanes3<V>,
    mirror: Lanes3<V>,
    /// Chance of the diffuse part.
    chance: V,
}

impl<V: Lanes> Bsdf<'_, V> for Matte<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        let (diffuse, mirror) = (look.base, look.three(0));
        let d = brightness::<V>(diffuse);
        Self { diffuse, mirror, chance: ratio(d, d + brightness(mirror)) }
    }

    #[inline(always)]
    fn eval(&self, _: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let lambert = wi[2] * V::constant(FRAC_1_PI);
        let value = Value { value: self.diffuse.map(|c| c * lambert), pdf: lambert * self.chance };
        only(V::constant(0.0).cmp_lt(wi[2]), value)
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let down = cosine(place);
        let is_diffuse = choice.cmp_lt(self.chance);
        let wi = choose(is_diffuse, down, mirrored(wo));
        let pdf = V::select(is_diffuse, down[2] * V::constant(FRAC_1_PI) * self.chance, V::splat(infinity::<V>()));
        let (diffuse, mirror) = (self.chance, one - self.chance);
        let weight = choose(is_diffuse, self.diffuse.map(|c| ratio(c, diffuse)), self.mirror.map(|c| ratio(c, mirror)));
        let alive = zero.cmp_lt(wi[2]);
        Sampled { wi, weight: weight.map(|w| V::select(alive, w, zero)), pdf, squeeze: one }
    }
}

/// Density of a direction without spread.
#[inline(always)]
pub fn infinity<V: Lanes>() -> V::Scalar {
    <V::Scalar as crate::lanes::Real>::INFINITY
}
