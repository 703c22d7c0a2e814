//! Microfacets with the distribution GGX, isotropic, sampled by what is visible of them.
//!
//! Sources: B. Walter, S. Marschner, H. Li, K. Torrance, *Microfacet Models for Refraction through Rough Surfaces*,
//! 2007; E. Heitz, *Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs*, JCGT 3(2), 2014;
//! J. Dupuy, A. Benyoub, *Sampling Visible GGX Normals with Spherical Caps*, 2023.

use std::f64::consts::PI;

use super::ratio;
use super::warp::polar;
use crate::lanes::space::normalize;
use crate::lanes::{Lanes, Lanes3, dot};

/// The distribution of a width.
#[derive(Clone, Copy, Debug)]
pub struct Ggx<V> {
    alpha: V,
}

impl<V: Lanes> Ggx<V> {
    /// Width `alpha`: the square of the roughness, above 0.
    #[inline(always)]
    pub fn new(alpha: V) -> Self {
        Self { alpha }
    }

    /// Density of facets with unit normal `h`, z >= 0.
    #[inline(always)]
    pub fn density(&self, h: Lanes3<V>) -> V {
        let a2 = self.alpha * self.alpha;
        // z^2 + (x^2 + y^2) / alpha^2, without the cancellation of 1 - z^2.
        let e = (h[0] * h[0] + h[1] * h[1]) / a2 + h[2] * h[2];
        V::constant(1.0) / (V::constant(PI) * a2 * e * e)
    }

    /// Smith's Lambda of direction `w`.
    #[inline(always)]
    fn lambda(&self, w: Lanes3<V>) -> V {
        let one = V::constant(1.0);
        let tan2 = (w[0] * w[0] + w[1] * w[1]) / (w[2] * w[2]);
        V::constant(0.5) * ((self.alpha * self.alpha).mul_add(tan2, one).sqrt() - one)
    }

    /// Share of facets that are visible from `w`.
    #[inline(always)]
    pub fn masking(&self, w: Lanes3<V>) -> V {
        V::constant(1.0) / (V::constant(1.0) + self.lambda(w))
    }

    /// Share visible from both (height-correlated for directions on the same side).
    #[inline(always)]
    pub fn masking_both(&self, a: Lanes3<V>, b: Lanes3<V>) -> V {
        V::constant(1.0) / (V::constant(1.0) + self.lambda(a) + self.lambda(b))
    }

    /// Density with which [`Self::visible`] finds `h` from `wo`.
    #[inline(always)]
    pub fn visible_pdf(&self, wo: Lanes3<V>, h: Lanes3<V>) -> V {
        ratio(self.masking(wo) * dot(wo, h).fast_max(V::constant(0.0)) * self.density(h), wo[2])
    }

    /// A facet's normal as seen from `wo`.
    #[inline(always)]
    pub fn visible(&self, wo: Lanes3<V>, u: [V; 2]) -> Lanes3<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let i = normalize([wo[0] * self.alpha, wo[1] * self.alpha, wo[2]]);
        let (square, cos, sin) = polar(u);
        let z = (one - square) * (one + i[2]) - i[2];
        let s = (one - z * z).fast_max(zero).sqrt();
        let c = [s * cos + i[0], s * sin + i[1], z + i[2]];
        normalize([c[0] * self.alpha, c[1] * self.alpha, c[2].fast_max(V::constant(1e-20))])
    }
}
