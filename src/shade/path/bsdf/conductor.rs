//! Metals, smooth and rough.

use super::ggx::Ggx;
use super::matte::infinity;
use super::{Bsdf, Sampled, Value, fresnel, mirrored, none, only, ratio};
use crate::lanes::space::{add, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::path::points::{PARAM, Points};

/// A packet of complex indices of refraction.
struct Metal<V> {
    eta: Lanes3<V>,
    k: Lanes3<V>,
}

impl<V: Lanes> Metal<V> {
    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        Self { eta: points.vector(PARAM, first), k: points.vector(PARAM + 3, first) }
    }

    #[inline(always)]
    fn reflectance(&self, cos: V) -> Lanes3<V> {
        [0, 1, 2].map(|c| fresnel::conductor(cos, self.eta[c], self.k[c]))
    }
}

/// A perfect mirror of metal.
pub struct SmoothConductor<V>(Metal<V>);

impl<V: Lanes> Bsdf<V> for SmoothConductor<V> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        Self(Metal::load(points, first))
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
pub struct RoughConductor<V> {
    metal: Metal<V>,
    ggx: Ggx<V>,
}

impl<V: Lanes> Bsdf<V> for RoughConductor<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        Self { metal: Metal::load(points, first), ggx: Ggx::new(points.scalar(PARAM + 6, first)) }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let h = normalize(add(wo, wi));
        let cos = dot(wo, h);
        let shape = self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (V::constant(4.0) * wo[2]);
        let value = self.metal.reflectance(cos).map(|f| f * shape);
        let pdf = self.ggx.visible_pdf(wo, h) / (V::constant(4.0) * cos);
        only(V::constant(0.0).cmp_lt(wi[2]), Value { value, pdf })
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], _: V) -> Sampled<V> {
        let h = self.ggx.visible(wo, place);
        let (wi, weight, pdf) = reflected(&self.ggx, wo, h);
        let alive = V::constant(0.0).cmp_lt(wi[2]);
        let share = V::select(alive, weight, V::constant(0.0));
        let weight = self.metal.reflectance(dot(wo, h)).map(|f| f * share);
        Sampled { wi, weight, pdf, squeeze: V::constant(1.0) }
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
