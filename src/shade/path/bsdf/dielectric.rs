//! The boundary of glass and liquids, smooth and rough.

use super::ggx::Ggx;
use super::matte::infinity;
use super::{Bsdf, Sampled, Value, conductor::reflected, fresnel, mirrored, none, ratio};
use crate::lanes::space::{choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::path::points::{BASE, PARAM, Points};

/// A smooth boundary.
pub struct SmoothDielectric<V> {
    tint: Lanes3<V>,
    /// Index of refraction behind the boundary over that before it.
    eta: V,
}

impl<V: Lanes> Bsdf<V> for SmoothDielectric<V> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        Self { tint: points.vector(BASE, first), eta: points.scalar(PARAM, first) }
    }

    #[inline(always)]
    fn eval(&self, _: Lanes3<V>, _: Lanes3<V>) -> Value<V> {
        none()
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, _: [V; 2], choice: V) -> Sampled<V> {
        let one = V::constant(1.0);
        let (r, cos_t) = fresnel::dielectric(wo[2], self.eta);
        let is_mirror = choice.cmp_lt(r);
        let rcp = one / self.eta;
        let through = [-(wo[0] * rcp), -(wo[1] * rcp), -cos_t];
        let squeeze = V::select(is_mirror, one, self.eta * self.eta);
        let weight = choose(is_mirror, [one; 3], self.tint.map(|c| c * rcp * rcp));
        Sampled { wi: choose(is_mirror, mirrored(wo), through), weight, pdf: V::splat(infinity::<V>()), squeeze }
    }
}

/// Facets of glass.
/// Source: B. Walter and others, *Microfacet Models for Refraction through Rough Surfaces*, 2007; in the notation of
/// M. Pharr, W. Jakob, G. Humphreys, *Physically Based Rendering*, 4th edition, section 9.7.
pub struct RoughDielectric<V> {
    tint: Lanes3<V>,
    eta: V,
    ggx: Ggx<V>,
}

impl<V: Lanes> RoughDielectric<V> {
    /// What a refraction at facet `h` gives, before tint and squeeze, and its density; `cos` is wo . h > 0,
    /// `wi_h` is wi . h < 0.
    #[inline(always)]
    fn refraction(&self, wo: Lanes3<V>, wi: Lanes3<V>, h: Lanes3<V>, cos: V, wi_h: V, r: V) -> (V, V) {
        let mixed = wi_h + cos / self.eta;
        let jacobian = wi_h.abs() / (mixed * mixed);
        let pass = V::constant(1.0) - r;
        let masking = self.ggx.masking_both(wo, wi.map(|x| -x));
        let value = ratio(pass * self.ggx.density(h) * masking * cos * jacobian, wo[2]);
        (value, self.ggx.visible_pdf(wo, h) * jacobian * pass)
    }
}

impl<V: Lanes> Bsdf<V> for RoughDielectric<V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        Self {
            tint: points.vector(BASE, first),
            eta: points.scalar(PARAM, first),
            ggx: Ggx::new(points.scalar(PARAM + 1, first)),
        }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let (zero, one, four) = (V::constant(0.0), V::constant(1.0), V::constant(4.0));
        let is_mirror = zero.cmp_lt(wi[2]);
        let stretch = V::select(is_mirror, one, self.eta);
        let h = normalize([0, 1, 2].map(|i| wi[i].mul_add(stretch, wo[i])));
        let up = h[2].cmp_lt(zero);
        let h = h.map(|x| V::select(up, -x, x));
        let (cos, wi_h) = (dot(wo, h), dot(wi, h));
        let (r, _) = fresnel::dielectric(cos.abs(), self.eta);
        let shape = r * self.ggx.density(h) * self.ggx.masking_both(wo, wi) / (four * wo[2]);
        let (through, through_pdf) = self.refraction(wo, wi, h, cos, wi_h, r);
        let rcp2 = one / (self.eta * self.eta);
        let value = choose(is_mirror, [shape; 3], self.tint.map(|c| c * through * rcp2));
        let pdf = V::select(is_mirror, self.ggx.visible_pdf(wo, h) * r / (four * cos), through_pdf);
        // Facets seen from behind by either side reflect or refract nothing; nor does a horizontal direction.
        let facing = zero.cmp_lt(cos) & zero.cmp_lt(V::select(is_mirror, wi_h, -wi_h)) & !wi[2].cmp_eq(zero);
        super::only(facing, Value { value, pdf })
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let h = self.ggx.visible(wo, place);
        let cos = dot(wo, h);
        let (r, cos_t) = fresnel::dielectric(cos, self.eta);
        let is_mirror = choice.cmp_lt(r);
        let (up, up_weight, up_pdf) = reflected(&self.ggx, wo, h);
        let rcp = one / self.eta;
        let along = cos * rcp - cos_t;
        let down = [0, 1, 2].map(|i| h[i].mul_add(along, -(wo[i] * rcp)));
        let (_, down_pdf) = self.refraction(wo, down, h, cos, -cos_t, r);
        let down_weight = ratio(self.ggx.masking_both(wo, down.map(|x| -x)), self.ggx.masking(wo));
        let wi = choose(is_mirror, up, down);
        let weight = choose(is_mirror, [up_weight; 3], self.tint.map(|c| c * down_weight * rcp * rcp));
        let right_side = (is_mirror & zero.cmp_lt(wi[2])) | (!is_mirror & wi[2].cmp_lt(zero));
        Sampled {
            wi,
            weight: weight.map(|w| V::select(right_side, w, zero)),
            pdf: V::select(is_mirror, up_pdf * r, down_pdf),
            squeeze: V::select(is_mirror, one, self.eta * self.eta),
        }
    }
}
