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

    /// Whether all lanes look into one octant.
    #[inline(always)]
    pub fn is_uniform(&self) -> bool {
        self.mixed == [false; 3]
    }

    /// Takes in that hits were found.
    #[inline(always)]
    pub fn shorten<V: Lanes<Scalar = S>>(&mut self, t: V) {
        self.reach = t.range(self.lanes).1;
    }

    /// Children that some lane may meet (a superset; exact for one ray), and where the first enters, or some
    /// place before its start.
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

    /// One child's box test for every lane of the packet: minima and maxima only on axes where lanes look both ways.
    #[inline(always)]
    pub fn interval<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, node: &Node<S>, slot: usize) -> Interval<V> {
        let [x, y, z] = each(|a| {
            let (near, far) = self.planes(node, a);
            let plane = |bound: S| (V::splat(bound) - packet.org[a]) * packet.rcp[a];
            let (near, far) = (plane(near[slot]), plane(far[slot]));
            if self.mixed[a] { (near.fast_min(far), near.fast_max(far)) } else { (near, far) }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Child;
    use crate::lanes::{f32x8, f64x4};
    use crate::math::{Aabb, Random};

    /// Packets around one direction, most of them on both sides of an axis or two: no box that a lane meets is rejected or begins
    /// later than there, and many others are.
    fn check<V: Lanes>(seed: u64) {
        let mut r = Random(seed);
        let (mut met, mut rejected, mut mixed) = (0, 0, 0);
        for round in 0..4000 {
            let mut node = Node::<V::Scalar>::empty();
            for _ in 0..WIDTH {
                let corner = [0; 3].map(|_| 3.0 * r.signed());
                let size = [0; 3].map(|_| 0.5 * r.signed().abs());
                let [lo, hi] = [0.0, 1.0].map(|k| each(|a| V::Scalar::from_f64(corner[a] + k * size[a])));
                node.push(&Aabb { lo, hi }, Child::ROOT);
            }
            // Some exactly along an axis, some from the planes of faces.
            let middle = [0; 3].map(|_| (3.0 * r.signed()).round());
            let from = if round % 3 == 0 { node.child_bounds(0).lo } else { [V::Scalar::ZERO; 3] };
            let mut lines = [[[V::Scalar::ZERO; 32]; 3]; 2];
            for lane in 0..V::N {
                for axis in 0..3 {
                    lines[0][axis][lane] = from[axis] + V::Scalar::from_f64(0.2 * r.signed() * f64::from(round % 2));
                    lines[1][axis][lane] = V::Scalar::from_f64(middle[axis] + 0.6 * r.signed());
                }
            }
            let [org, dir] = lines.map(|line| map3(line, |x| V::load(&x)));
            let t_min = if round % 5 == 0 { -0.5 } else { 0.0 };
            let packet = Packet::<V>::unsheared(org, dir, V::constant(t_min));
            let t_max = V::constant(2.0);
            let bundles = [
                Bundle::of(&packet, V::ALL, t_max),
                Bundle::spanning(
                    map3(org, |x| x.range(V::ALL)),
                    map3(dir, |x| x.range(V::ALL)),
                    packet.t_min.lane(0),
                    t_max.lane(0),
                ),
            ];
            for bundle in bundles {
                let mut near = [V::Scalar::ZERO; WIDTH];
                let some = bundle.children::<V>(&node, &mut near);
                mixed += usize::from(!bundle.is_uniform());
                for slot in 0..WIDTH {
                    let bounds = node.child_bounds(slot);
                    let interval = Interval::of(&packet, bounds.lo, bounds.hi);
                    let lanes = interval.meets(packet.t_min, t_max).bits();
                    rejected += usize::from(some >> slot & 1 == 0);
                    for lane in (0..V::N).filter(|lane| lanes >> lane & 1 != 0) {
                        met += 1;
                        // Before its start a lane does not enter.
                        let enters = interval.near.lane(lane).fast_max(packet.t_min.lane(lane));
                        assert!(some >> slot & 1 != 0 && near[slot] <= enters, "{round}, {packet:?}");
                    }
                }
            }
        }
        assert!(met > 5000 && rejected > 30_000 && mixed > 2500, "{met} met, {rejected} rejected, {mixed} mixed");
    }

    #[test]
    fn bundles_reject_no_box_that_a_lane_meets() {
        check::<f32x8>(1);
        check::<f64x4>(2);
    }
}
