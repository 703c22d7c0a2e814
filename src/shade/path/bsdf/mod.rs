//! Kernels of scattering: each model once, over lanes.
//!
//! Directions are unit, in the frame of the shading normal, which is on the side the light is seen from: `wo` (to the
//! viewer) has z > 0. Values carry the cosine: `value` = f(wo, wi) |wi.z|. Weights of samples are `value / pdf`.
//! All are for radiance: what is refracted is squeezed by the square of the relative index of refraction.

mod coat;
mod conductor;
mod curve;
mod dielectric;
pub(in crate::shade) mod facets;
pub(in crate::shade) mod fresnel;
mod ggx;
mod matte;
mod metal_rough;
mod rows;
mod thin;
pub(super) mod warp;

use self::facets::FacetsList;
use crate::lanes::{Lanes, Lanes3};
use crate::shade::look_lanes::LookLanes;

pub(super) use coat::{RoughCoat, SmoothCoat};
pub(super) use conductor::{RoughConductor, SmoothConductor};
pub(super) use dielectric::{RoughDielectric, SmoothDielectric};
pub(super) use matte::Matte;
pub(super) use metal_rough::MetalRough;
pub(super) use thin::Thin;

/// What goes from `wi` to `wo`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<V> {
    /// f(wo, wi) |wi.z| for red, green, blue.
    pub value: Lanes3<V>,
    /// Density with which [`Bsdf::sample`] finds `wi`, per solid angle.
    pub pdf: V,
}

/// A direction by chance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled<V> {
    /// The direction.
    pub wi: Lanes3<V>,
    /// Value over density; 0 where there is no direction.
    pub weight: Lanes3<V>,
    /// Density per solid angle; infinite for perfect mirrors and the like.
    pub pdf: V,
    /// Square of the relative index of refraction if the light was refracted, else 1.
    pub squeeze: V,
}

/// A model with the parameters of one packet of points.
pub(super) trait Bsdf<'t, V: Lanes>: Sized {
    /// Whether all directions it samples are of perfect mirrors and the like: no light can be aimed at.
    const SMOOTH: bool;
    /// The model of points that look like `look`, whose tables of rough surfaces are in `facets`.
    fn load(look: &LookLanes<V>, facets: &'t FacetsList) -> Self;
    /// Light from `wi`, without perfect mirrors and the like.
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V>;
    /// A direction from three numbers in [0, 1): two for the place, one for the choice of a lobe.
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V>;
}

/// Nothing.
#[inline(always)]
fn none<V: Lanes>() -> Value<V> {
    let zero = V::constant(0.0);
    Value { value: [zero; 3], pdf: zero }
}

/// `wo` mirrored at the surface.
#[inline(always)]
fn mirrored<V: Lanes>(wo: Lanes3<V>) -> Lanes3<V> {
    [-wo[0], -wo[1], wo[2]]
}

/// Brightness that chances go by.
#[inline(always)]
fn brightness<V: Lanes>(c: Lanes3<V>) -> V {
    (c[0] + c[1] + c[2]) * V::constant(1.0 / 3.0)
}

/// `a / b`, 0 where `b` is not positive.
#[inline(always)]
fn ratio<V: Lanes>(a: V, b: V) -> V {
    let zero = V::constant(0.0);
    V::select(zero.cmp_lt(b), a / b, zero)
}

/// `value` where the mask is set, else zeros.
#[inline(always)]
fn only<V: Lanes>(mask: V::Mask, value: Value<V>) -> Value<V> {
    let zero = V::constant(0.0);
    Value { value: value.value.map(|x| V::select(mask, x, zero)), pdf: V::select(mask, value.pdf, zero) }
}

#[cfg(test)]
mod tests;
