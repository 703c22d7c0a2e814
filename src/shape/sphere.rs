//! Spheres: with centre and radius in world (object) space, and the canonical unit sphere for affine images.
//!
//! Source: the geometric solution with the discriminant taken at the point of closest approach (Haines, Günther,
//! Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019).

use glam::DVec3;

use super::span::{Solid, Span, nearest_by};
use crate::lanes::{Lanes, Lanes3, Real, dot, each};
use crate::math::Aabb;

/// The canonical sphere: unit radius at the local origin.
#[derive(Clone, Copy, Debug)]
pub struct Sphere;

/// A sphere in world space: centre x, y, z and radius. The cheap path: no transform.
#[derive(Clone, Copy, Debug)]
pub struct WorldSphere;

/// Numbers of a [`WorldSphere`].
pub type SphereRecord<S> = [S; 4];

#[inline(always)]
fn sphere_span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, radius: V) -> Span<V> {
    let rcp_square = V::constant(1.0) / dot(d, d);
    let (near, shift) = nearest_by(o, d, rcp_square);
    let room = radius.mul_add(radius, -dot(near, near));
    let half = (room * rcp_square).sqrt();
    Span::plain(V::constant(0.0).cmp_le(room), shift - half, shift + half)
}

impl Solid for Sphere {
    const LO: DVec3 = DVec3::NEG_ONE;
    const HI: DVec3 = DVec3::ONE;

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, _: V::Scalar) -> Span<V> {
        sphere_span(o, d, V::constant(1.0))
    }

    fn normal(point: DVec3, _: u32, _: f64) -> DVec3 {
        point
    }
}

impl WorldSphere {
    /// Numbers per sphere.
    pub const FIELDS: usize = 4;

    /// Box of a stored sphere, rounded outwards.
    pub fn bounds<S: Real>(n: &SphereRecord<S>) -> Aabb<S> {
        let centre = DVec3::new(n[0].to_f64(), n[1].to_f64(), n[2].to_f64());
        Aabb::enclosing(centre - n[3].to_f64(), centre + n[3].to_f64())
    }

    /// Where lines are inside.
    #[inline(always)]
    pub fn span<V: Lanes>(org: Lanes3<V>, dir: Lanes3<V>, n: &SphereRecord<V::Scalar>) -> Span<V> {
        let o = each(|a| org[a] - V::splat(n[a]));
        sphere_span(o, dir, V::splat(n[3]))
    }
}
