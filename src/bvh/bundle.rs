//! A packet as one bundle: intervals of origins and reciprocal directions against eight boxes at once.
//!
//! Source: the interval arithmetic frustum of Boulos, Wald, Shirley, "Geometric and Arithmetic Culling Methods for
//! Entire Ray Packets", 2006. Each bound below is the same monotone expression as the box test of
//! [`crate::ray::slab`], taken at the ends of the intervals, so a box that any lane meets is never rejected. For a
//! packet of one ray the intervals are points and this is that ray's own test.

use super::node::{Node, WIDTH};
use crate::lanes::{LaneMask, Lanes, Real, each, finite_rcp, map3};
use crate::ray::Packet;
use crate::ray::slab::{Interval, pad};

/// Bounds over some lanes of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Bundle<S> {
    /// Per axis: whether there are lanes that look up and lanes that look down.
    mixed: [bool; 3],
    /// Per axis: index of the plane that is met first (0 low, 1 high).
    near_side: [usize; 3],
    /// Origins that give the earliest entry and the latest exit.
    org_near: [S; 3],
    org_far: [S; 3],
    /// Smallest and largest reciprocal direction; on mixed axes those of the steepest lanes down and up.
    rcp: [(S, S); 3],
    /// Start of the earliest segment, end of the longest.
    t_min: S,
    reach: S,
    lanes: u32,
}

impl<S: Real> Bundle<S> {
    /// Bounds over `lanes` (not empty) of `packet`, whose segments end at `t_max`.
    #[inline(always)]
    pub fn of<V: Lanes<Scalar = S>>(packet: &Packet<V>, lanes: u32, t_max: V) -> Self {
        let rcp = each(|axis| {
            let (low, high) = packet.rcp[axis].range(lanes);
            if !is_mixed((low, high)) {
                return (low, high);
            }
            let (down, up) = packet.dir[axis].range(lanes);
            (finite_rcp(down), finite_rcp(up))
        });
        let org = map3(packet.org, |o| o.range(lanes));
        Self::new(org, rcp, packet.t_min.range(lanes).0, t_max.range(lanes).1, lanes)
    }

    /// Bounds of lines whose origins and directions lie between those of `org` and `dir`, least and largest, and whose
    /// segments lie within `t_min..=reach`.
    #[inline(always)]
    pub fn spanning(org: [(S, S); 3], dir: [(S, S); 3], t_min: S, reach: S) -> Self {
        // The reciprocal falls from the least to the largest number of one sign, also rounded; else the axis is mixed.
        let rcp = map3(dir, |(low, high)| match (finite_rcp(low), finite_rcp(high)) {
            rcp if is_mixed(rcp) => rcp,
            (of_low, of_high) => (of_high, of_low),
        });
        Self::new(org, rcp, t_min, reach, u32::MAX)
    }

    #[inline(always)]
    fn new(org: [(S, S); 3], rcp: [(S, S); 3], t_min: S, reach: S, lanes: u32) -> Self {
        let backward = map3(rcp, |(low, _)| low < S::ZERO);
        Self {
            mixed: map3(rcp, is_mixed),
            near_side: map3(backward, usize::from),
            org_near: each(|a| if backward[a] { org[a].0 } else { org[a].1 }),
            org_far: each(|a| if backward[a] { org[a].1 } else { org[a].0 }),
            rcp,
            t_min,
            reach,
            lanes,
        }
    }

    /// The same for segments that start at `t_min`.
    #[inline(always)]
    pub fn starting<V: Lanes<Scalar = S>>(mut self, t_min: V) -> Self {
        self.t_min = t_min.range(self.lanes).0;
        self
    }

    /// Whether all lanes look into one octant: only then is there [`Self::interval`].
    #[inline(always)]
    pub fn is_uniform(&self) -> bool {
        self.mixed == [false; 3]
    }

    /// Takes in that hits were found.
    #[inline(always)]
    pub fn shorten<V: Lanes<Scalar = S>>(&mut self, t: V) {
        self.reach = t.range(self.lanes).1;
    }

    /// Children that some lane may meet (a superset; exact for one ray), and where the first enters.
    #[inline(always)]
    pub fn children<V: Lanes<Scalar = S>>(&self, node: &Node<S>, near: &mut [S; WIDTH]) -> u32 {
        let one_ray = V::N == 1;
        let axis = |a: usize| {
            let (r0, r1) = (S::Octo::splat(self.rcp[a].0), S::Octo::splat(self.rcp[a].1));
            if !one_ray && self.mixed[a] {
                return (self.enter_mixed(node, a), S::Octo::splat(S::INFINITY));
            }
            let (near_plane, far_plane) = self.planes(node, a);
            let enter = S::Octo::load(near_plane) - S::Octo::splat(self.org_near[a]);
            let leave = S::Octo::load(far_plane) - S::Octo::splat(self.org_far[a]);
            if one_ray {
                (enter * r0, leave * r0)
            } else {
                ((enter * r0).fast_min(enter * r1), (leave * r0).fast_max(leave * r1))
            }
        };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let interval = Interval { near: x.0.fast_max(y.0).fast_max(z.0), far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
        interval.near.store(near);
        interval.meets(S::Octo::splat(self.t_min), S::Octo::splat(self.reach)).bits()
    }

    /// Where lanes enter the children's slabs along a mixed axis, at the earliest: a slab above all origins only those that look up
    /// meet, after their start, and not before the steepest of them.
    #[inline(always)]
    fn enter_mixed(&self, node: &Node<S>, axis: usize) -> S::Octo {
        // Before it they may come from the other side.
        if self.t_min < S::ZERO {
            return S::Octo::splat(S::LOWEST);
        }
        let [low, high] = &node.bounds[axis];
        // Backwards, as the first is below zero: the origins that are farthest up and down.
        let (up, down) = (S::Octo::splat(self.org_far[axis]), S::Octo::splat(self.org_near[axis]));
        let from_below = (S::Octo::load(low) - up) * S::Octo::splat(self.rcp[axis].1);
        let from_above = (S::Octo::load(high) - down) * S::Octo::splat(self.rcp[axis].0);
        from_below.fast_max(from_above)
    }

    /// One child's box test for every lane of a uniform packet: no minima and maxima per axis.
    #[inline(always)]
    pub fn interval<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, node: &Node<S>, slot: usize) -> Interval<V> {
        let [x, y, z] = each(|a| {
            let (near, far) = self.planes(node, a);
            let plane = |bound: S| (V::splat(bound) - packet.org[a]) * packet.rcp[a];
            (plane(near[slot]), plane(far[slot]))
        });
        Interval { near: x.0.fast_max(y.0).fast_max(z.0), far: pad(x.1.fast_min(y.1).fast_min(z.1)) }
    }

    #[inline(always)]
    fn planes<'n>(&self, node: &'n Node<S>, axis: usize) -> (&'n [S; WIDTH], &'n [S; WIDTH]) {
        let [low, high] = &node.bounds[axis];
        if self.near_side[axis] == 0 { (low, high) } else { (high, low) }
    }
}

/// Whether reciprocals from the first to the second are of both signs.
#[inline(always)]
fn is_mixed<S: Real>((low, high): (S, S)) -> bool {
    (low < S::ZERO) != (high < S::ZERO)
}
