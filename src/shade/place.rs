//! Where rays meet surfaces, in lanes: the point, the normal, and how far from the point a ray that leaves it must start.

use super::offset::{self, PRIMITIVE_ROUNDINGS, RAY_ROUNDINGS};
use crate::lanes::space::{choose, cross, normalize};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each, map3};
use crate::scene::world::Met;

/// Roundings of a triangle (see [`super::offset`]), with those of a hit's weights.
const TRIANGLE_ROUNDINGS: f64 = 14.0;

/// Points on surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<V> {
    /// World space.
    pub position: Lanes3<V>,
    /// Unit geometric normal, on the side that the ray came from; not a number on triangles without area.
    pub normal: Lanes3<V>,
    /// How far along the normal, on either side, a ray must start so as not to meet the surface again.
    pub offset: V,
    /// Lanes whose rays came from the side of the surface's own normal.
    pub front: u32,
}

/// Flat triangles, world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat<V> {
    /// First corner.
    pub corner: Lanes3<V>,
    /// Edges from it to the second and the third.
    pub edges: [Lanes3<V>; 2],
    /// See [`unit_normal`].
    pub normal: Lanes3<V>,
}

/// Unit normal of triangles with these edges; not a number where they have no area.
#[inline(always)]
pub(super) fn unit_normal<V: Lanes>(e1: Lanes3<V>, e2: Lanes3<V>) -> Lanes3<V> {
    // Edges of length about one: products of very small or large ones would leave the range of numbers.
    let unit = |e: Lanes3<V>| {
        let rcp = V::constant(1.0) / (e[0].abs() + e[1].abs() + e[2].abs());
        map3(e, |x| x * rcp)
    };
    normalize(cross(unit(e1), unit(e2)))
}

impl<V: Lanes> Place<V> {
    /// On triangles, where the rays along `dir` meet them with weights `u` and `v` of the second and third corner at `t`.
    #[inline(always)]
    pub fn on_triangle(triangle: &Flat<V>, [u, v, t]: [V; 3], dir: Lanes3<V>) -> Self {
        let Flat { corner, edges: [e1, e2], normal } = *triangle;
        let position: Lanes3<V> = each(|i| v.mul_add(e2[i], u.mul_add(e1[i], corner[i])));
        // The origin is no further off than the position and the distance together; two more for the position's own.
        let (of_ray, of_triangle) = (gamma::<V>(2.0 * RAY_ROUNDINGS + 2.0), gamma::<V>(TRIANGLE_ROUNDINGS));
        let error = each(|i| {
            let size = corner[i].abs() + e1[i].abs() + e2[i].abs();
            let reach = position[i].abs() + (dir[i] * t).abs();
            of_ray.mul_add(reach, of_triangle * size)
        });
        Self::turned(position, normal, error, dir)
    }

    /// On the facets `met` of shapes, where the rays from `org` along `dir` meet them at `t`.
    #[inline(always)]
    pub fn on_facet(met: &Met<V>, org: Lanes3<V>, dir: Lanes3<V>, t: V) -> Self {
        // One more for the position's own rounding.
        let (of_ray, of_shape) = (gamma::<V>(RAY_ROUNDINGS + 1.0), gamma::<V>(PRIMITIVE_ROUNDINGS));
        let error = each(|i| {
            let reach = met.position[i].abs() + org[i].abs() + (dir[i] * t).abs();
            of_ray.mul_add(reach, of_shape * met.magnitude[i])
        });
        Self::turned(met.position, met.normal, error, dir)
    }

    #[inline(always)]
    fn turned(position: Lanes3<V>, normal: Lanes3<V>, error: Lanes3<V>, dir: Lanes3<V>) -> Self {
        let behind = V::constant(0.0).cmp_lt(dot(normal, dir));
        let normal = choose(behind, map3(normal, |x| -x), normal);
        let offset = dot(map3(normal, V::abs), error);
        Self { position, normal, offset, front: !behind.bits() }
    }

    /// `self` in the lanes `mask`, `other` elsewhere.
    #[inline(always)]
    pub fn or(self, mask: u32, other: Self) -> Self {
        let lanes = V::Mask::from_bits(mask);
        Self {
            position: choose(lanes, self.position, other.position),
            normal: choose(lanes, self.normal, other.normal),
            offset: V::select(lanes, self.offset, other.offset),
            front: self.front & mask | other.front & !mask,
        }
    }
}

/// Bound of the relative error of `n` roundings.
#[inline(always)]
fn gamma<V: Lanes>(n: f64) -> V {
    V::constant(offset::gamma::<V::Scalar>(n))
}
