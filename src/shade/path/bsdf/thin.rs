//! A thin pane of glass: mirror and straight passage, with all reflections between its two sides.

use super::facets::FacetsList;
use super::matte::infinity;
use super::{Bsdf, Sampled, Value, fresnel, mirrored, none};
use crate::lanes::space::choose;
use crate::lanes::{Lanes, Lanes3};
use crate::shade::look_lanes::LookLanes;

/// A packet of them.
pub struct Thin<V> {
    tint: Lanes3<V>,
    ior: V,
}

impl<V: Lanes> Bsdf<'_, V> for Thin<V> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        Self { tint: look.base, ior: look.param[0] }
    }

    #[inline(always)]
    fn eval(&self, _: Lanes3<V>, _: Lanes3<V>) -> Value<V> {
        none()
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, _: [V; 2], choice: V) -> Sampled<V> {
        let one = V::constant(1.0);
        let (r, _) = fresnel::dielectric(wo[2], self.ior);
        // R + T R T + T R R R T + ... with T = 1 - R.
        let r = V::constant(2.0) * r / (one + r);
        let is_mirror = choice.cmp_lt(r);
        let wi = choose(is_mirror, mirrored(wo), wo.map(|x| -x));
        Sampled { wi, weight: choose(is_mirror, [one; 3], self.tint), pdf: V::splat(infinity::<V>()), squeeze: one }
    }
}
