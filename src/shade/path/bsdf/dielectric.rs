//! The boundary of glass and liquids, smooth and rough.

use std::f64::consts::FRAC_1_PI;

use super::facets::{FacetsList, PacketFacets};
use super::ggx::Ggx;
use super::matte::infinity;
use super::warp::cosine;
use super::{Bsdf, Sampled, Value, conductor::reflected, fresnel, mirrored, none, ratio};
use crate::lanes::space::{choose, normalize};
use crate::lanes::{Lanes, Lanes3, dot};
use crate::shade::look_lanes::LookLanes;

/// A smooth boundary.
pub struct SmoothDielectric<V> {
    tint: Lanes3<V>,
    /// Index of refraction behind the boundary over that before it.
    eta: V,
}

impl<V: Lanes> Bsdf<'_, V> for SmoothDielectric<V> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn load(look: &LookLanes<V>, _: &FacetsList) -> Self {
        Self { tint: look.base, eta: look.param[0] }
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
pub struct RoughDielectric<'t, V> {
    tint: Lanes3<V>,
    eta: V,
    ggx: Ggx<V>,
    facets: PacketFacets<'t, V>,
}

impl<V: Lanes> RoughDielectric<'_, V> {
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

    /// Tint and squeeze of what goes through.
    #[inline(always)]
    fn passed(&self, through: V) -> Lanes3<V> {
        let squeezed = through / (self.eta * self.eta);
        self.tint.map(|c| c * squeezed)
    }

    /// What one facet reflects or refracts, and its density.
    #[inline(always)]
    fn single(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
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
        let value = choose(is_mirror, [shape; 3], self.passed(through));
        let pdf = V::select(is_mirror, self.ggx.visible_pdf(wo, h) * r / (four * cos), through_pdf);
        // Facets seen from behind by either side reflect or refract nothing; nor does a horizontal direction.
        let facing = zero.cmp_lt(cos) & zero.cmp_lt(V::select(is_mirror, wi_h, -wi_h)) & !wi[2].cmp_eq(zero);
        super::only(facing, Value { value, pdf })
    }

    /// What many facets do, and its density, if the share `lost` of light from `wo` is lost to one.
    #[inline(always)]
    fn multiple(&self, lost: V, wi: Lanes3<V>) -> Value<V> {
        let one = V::constant(1.0);
        let is_mirror = V::constant(0.0).cmp_lt(wi[2]);
        let lambert = wi[2].abs() * V::constant(FRAC_1_PI);
        let part = lost * lambert;
        let up = self.facets.up[0] * self.facets.lost(wi[2]) * part;
        let through = self.facets.down * self.facets.lost_behind(wi[2]) * part;
        let chance = V::select(is_mirror, self.facets.chance, one - self.facets.chance);
        Value { value: choose(is_mirror, [up; 3], self.passed(through)), pdf: chance * part }
    }

    /// Both, when a direction is looked for by many facets with the chance `lost`.
    #[inline(always)]
    fn both(lost: V, single: &Value<V>, multiple: &Value<V>) -> Value<V> {
        let value = [0, 1, 2].map(|c| single.value[c] + multiple.value[c]);
        Value { value, pdf: (V::constant(1.0) - lost).mul_add(single.pdf, multiple.pdf) }
    }
}

impl<'t, V: Lanes> Bsdf<'t, V> for RoughDielectric<'t, V> {
    const SMOOTH: bool = false;

    #[inline(always)]
    fn load(look: &LookLanes<V>, facets: &'t FacetsList) -> Self {
        let facets = PacketFacets::load(facets, look.param[2]);
        Self { tint: look.base, eta: look.param[0], ggx: Ggx::new(look.param[1]), facets }
    }

    #[inline(always)]
    fn eval(&self, wo: Lanes3<V>, wi: Lanes3<V>) -> Value<V> {
        let lost = self.facets.lost(wo[2]);
        Self::both(lost, &self.single(wo, wi), &self.multiple(lost, wi))
    }

    #[inline(always)]
    fn sample(&self, wo: Lanes3<V>, place: [V; 2], choice: V) -> Sampled<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let lost = self.facets.lost(wo[2]);
        let is_multiple = choice.cmp_lt(lost);
        let wide = cosine(place);
        let is_back = choice.cmp_lt(lost * self.facets.chance);
        let wide = [wide[0], wide[1], V::select(is_back, wide[2], -wide[2])];
        // What is left of the number is as good as a new one.
        let choice = (choice - lost) / (one - lost);
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
        // The facet is known: worked out anew from the directions it would be lost to rounding if the indices are close.
        let pdf = V::select(is_mirror, up_pdf * r, down_pdf);
        let kept = choose(is_mirror, [up_weight; 3], self.passed(down_weight));
        let found = Value { value: kept.map(|w| w * pdf), pdf };
        let wi = choose(is_mirror, up, down);
        let right_side = (is_mirror & zero.cmp_lt(wi[2])) | (!is_mirror & wi[2].cmp_lt(zero));
        let wi = choose(is_multiple, wide, wi);
        let other = self.single(wo, wi);
        let single = Value {
            value: choose(is_multiple, other.value, found.value),
            pdf: V::select(is_multiple, other.pdf, found.pdf),
        };
        let found = Self::both(lost, &single, &self.multiple(lost, wi));
        Sampled {
            wi,
            weight: found.value.map(|x| V::select(is_multiple | right_side, ratio(x, found.pdf), zero)),
            pdf: found.pdf,
            squeeze: V::select(zero.cmp_lt(wi[2]), one, self.eta * self.eta),
        }
    }
}
