//! Canonical solids under any affine transform: the ray goes to the solid's local space, `t` stays the same.

use glam::{DAffine3, DVec3};

use super::span::{Solid, Span};
use crate::lanes::{Lanes, Real};
use crate::math::{Aabb, Affine, transformed_bounds};
use crate::ray::slab::Interval;
use crate::ray::{Candidate, Packet};

/// Storage of transformed solids: twelve numbers of the map to local space, six of the box in object space, one
/// parameter.
#[derive(Clone, Copy, Debug)]
pub struct Placed;

/// Numbers of a [`Placed`] solid.
pub type PlacedRecord<S> = [S; 19];

impl Placed {
    /// Numbers per solid.
    pub const FIELDS: usize = 19;

    /// A solid of kind `K` placed by `to_object`, or `None` if the map cannot be inverted or overflows `S`.
    pub fn record<S: Real, K: Solid>(to_object: &DAffine3, param: f64) -> Option<PlacedRecord<S>> {
        if to_object.matrix3.determinant() == 0.0 {
            return None;
        }
        let to_local = Affine::<S>::from_f64(&to_object.inverse());
        let (lo, hi) = transformed_bounds(to_object, K::LO, K::HI);
        // The map's own rounding moves the surface by some ulps of the numbers that were added up.
        let (finite_lo, finite_hi) = (finite_part(lo), finite_part(hi));
        let size = finite_lo.abs().max(finite_hi.abs()).max(to_object.translation.abs()).max_element();
        let slack = DVec3::splat(size * 16.0 * S::EPSILON.to_f64());
        let bounds = Aabb::<S>::enclosing(lo - slack, hi + slack);
        let mut numbers = [S::ZERO; 19];
        numbers[..12].copy_from_slice(to_local.rows.as_flattened());
        numbers[12..15].copy_from_slice(&bounds.lo);
        numbers[15..18].copy_from_slice(&bounds.hi);
        numbers[18] = S::from_f64(param);
        numbers[..12].iter().all(|x| x.is_finite()).then_some(numbers)
    }

    /// Box in object space.
    #[inline(always)]
    pub fn bounds<S: Real>(n: &PlacedRecord<S>) -> Aabb<S> {
        Aabb { lo: [n[12], n[13], n[14]], hi: [n[15], n[16], n[17]] }
    }

    /// The map to local space.
    #[inline(always)]
    pub fn to_local<S: Real>(n: &PlacedRecord<S>) -> Affine<S> {
        Affine { rows: [[n[0], n[1], n[2], n[3]], [n[4], n[5], n[6], n[7]], [n[8], n[9], n[10], n[11]]] }
    }

    /// Where the packet's lines are inside the solid (all boundaries).
    #[inline(always)]
    pub fn span<V: Lanes, K: Solid>(packet: &Packet<V>, n: &PlacedRecord<V::Scalar>) -> Span<V> {
        let to_local = Self::to_local(n);
        K::span(to_local.points(packet.org), to_local.vectors(packet.dir), n[18])
    }
}

/// Infinite entries replaced by 0.
fn finite_part(p: DVec3) -> DVec3 {
    DVec3::from_array(p.to_array().map(|x| if x.is_finite() { x } else { 0.0 }))
}

impl<V: Lanes> Span<V> {
    /// The nearest boundary at or after `t_min`, made consistent with the solid's box (see [`crate::ray::slab`]).
    #[inline(always)]
    pub fn nearest(&self, packet: &Packet<V>, bounds: &Aabb<V::Scalar>) -> Candidate<V> {
        let interval = Interval::of(packet, bounds.lo, bounds.hi);
        let consistent = |t: V| packet.t_floor.fast_max(interval.clamp(t));
        let (t_in, t_out) = (consistent(self.t_in), consistent(self.t_out));
        // A half-space may be entered at minus infinity, which is no boundary whatever the segment.
        let entering = packet.t_min.cmp_le(t_in) & V::splat(-V::Scalar::MAX).cmp_le(t_in);
        let t = V::select(entering, t_in, t_out);
        let in_front = packet.t_min.cmp_le(t) & t.cmp_le(V::splat(V::Scalar::MAX));
        Candidate {
            hit: self.hit & in_front & interval.near.cmp_le(interval.far),
            t,
            u: V::select(entering, self.face_in, self.face_out),
            v: V::constant(0.0),
        }
    }
}
