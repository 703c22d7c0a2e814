//! The box test, and why brute force, trees and every packet width agree to the last bit.
//!
//! One slab is `(bound - org) * rcp`. For a fixed ray this is a *monotone* function of the bound, also in floating
//! point, and so are min, max and the padding below. Hence if box A contains box B, the computed interval of A
//! contains the computed interval of B: a node can never be missed, or start later, than what it contains.
//! Primitives clamp the `t` they report to the interval of their own box ([`Interval::clamp`]) and miss when their
//! own box is missed, so a tree that culls only nodes that start strictly behind the best hit can never lose the
//! winner. No epsilon decides between engines; the padding only keeps hits on the border of a box from being lost
//! to rounding (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).

use super::packet::Packet;
use crate::lanes::{Lanes, Lanes3, Real, each, map3};

/// Where lines pass through a box, before the ray's segment is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Interval<V> {
    /// Parameter of entry.
    pub near: V,
    /// Parameter of exit, padded: the line meets the box iff `near <= far`.
    pub far: V,
}

/// Relative padding of the far side, in half ulps: 3 roundings on either side, doubled.
pub const PAD: f64 = 8.0;

impl<V: Lanes> Interval<V> {
    /// `N` rays against one box.
    #[inline(always)]
    pub fn of(packet: &Packet<V>, lo: [V::Scalar; 3], hi: [V::Scalar; 3]) -> Self {
        Self::of_line(packet.org, packet.rcp, lo, hi)
    }

    /// `N` lines, given by origin and [`crate::lanes::finite_rcp`] of the direction, against one box.
    #[inline(always)]
    pub fn of_line(org: Lanes3<V>, rcp: Lanes3<V>, lo: [V::Scalar; 3], hi: [V::Scalar; 3]) -> Self {
        Self::of_boxes(org, rcp, map3(lo, V::splat), map3(hi, V::splat))
    }

    /// The same with a box per lane.
    #[inline(always)]
    pub fn of_boxes(org: Lanes3<V>, rcp: Lanes3<V>, lo: Lanes3<V>, hi: Lanes3<V>) -> Self {
        let [x, y, z] = each(|a| {
            let t0 = (lo[a] - org[a]) * rcp[a];
            let t1 = (hi[a] - org[a]) * rcp[a];
            (t0.fast_min(t1), t0.fast_max(t1))
        });
        let near = x.0.fast_max(y.0).fast_max(z.0);
        let far = x.1.fast_min(y.1).fast_min(z.1);
        Self { near, far: pad(far) }
    }

    /// Lanes whose segment `t_min..=t_max` meets the box.
    #[inline(always)]
    pub fn meets(&self, t_min: V, t_max: V) -> V::Mask {
        // The far side second: a box behind everything has far = -inf, which the padding turns into NaN, and NaN
        // must come through and miss.
        self.near.fast_max(t_min).cmp_le(t_max.fast_min(self.far))
    }

    /// `t` moved into the interval: how a primitive's hit is made consistent with its own box.
    #[inline(always)]
    pub fn clamp(&self, t: V) -> V {
        self.near.fast_max(t.fast_min(self.far))
    }
}

/// The far side moved outwards by a few ulps; monotone.
#[inline(always)]
pub fn pad<V: Lanes>(far: V) -> V {
    far.abs().mul_add(V::splat(V::Scalar::from_f64(PAD * V::Scalar::EPSILON.to_f64())), far)
}
