//! Where segments lie: a box around them all, which says what nodes' boxes none of them meets, whatever their directions.

use crate::bvh::Node;
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each};
use crate::math::Aabb;

/// How far a region reaches beyond the ends of its segments, relative to its largest coordinate, in half ulps: the box test of a ray
/// ([`crate::ray::slab`]) is off by less than five roundings, the end by two.
const SLACK: f64 = 32.0;

/// A box around segments, with what the box test of a ray may be off by: a box that a ray meets by that test meets the region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region<S>(pub Aabb<S>);

impl<S: Real> Region<S> {
    /// Children of a node that meet it, as bits. `E`: vectors of `W` children.
    #[inline(always)]
    pub fn children<E: Lanes<Scalar = S>, const W: usize>(&self, node: &Node<S, W>) -> u32 {
        let [x, y, z] = each(|a| {
            let [low, high] = &node.bounds[a];
            E::load(low).cmp_le(E::splat(self.0.hi[a])) & E::splat(self.0.lo[a]).cmp_le(E::load(high))
        });
        (x & y & z).bits() & ((1 << node.used) - 1)
    }
}

/// A region in the making, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Extent<V: Lanes> {
    lo: Lanes3<V>,
    hi: Lanes3<V>,
    /// Lanes whose segments can be told by their ends.
    plain: V::Mask,
}

impl<V: Lanes> Extent<V> {
    /// Of no segments.
    #[inline(always)]
    pub fn none() -> Self {
        let (high, low) = (V::splat(V::Scalar::INFINITY), V::splat(V::Scalar::LOWEST));
        Self { lo: [high; 3], hi: [low; 3], plain: V::Mask::from_bits(V::ALL) }
    }

    /// The square root of the smallest normal number. Numbers of rays below its reciprocal cannot hide a distance above it: not
    /// behind the least component of a direction that has a reciprocal, nor by a product that is too small.
    #[inline(always)]
    fn small() -> f64 {
        V::Scalar::MIN_POSITIVE.to_f64().sqrt()
    }

    /// Takes in the `live` rays of a packet, up to `t_max`.
    #[inline(always)]
    pub fn add(&mut self, org: Lanes3<V>, dir: Lanes3<V>, [t_min, t_max]: [V; 2], live: u32) {
        let live = V::Mask::from_bits(live);
        let most = V::constant(1.0 / Self::small());
        let mut plain = V::constant(0.0).cmp_le(t_min) & t_max.cmp_le(most);
        for a in 0..3 {
            let end = dir[a].mul_add(t_max, org[a]);
            let (lo, hi) = (end.fast_min(org[a]), end.fast_max(org[a]));
            self.lo[a] = V::select(live, lo.fast_min(self.lo[a]), self.lo[a]);
            self.hi[a] = V::select(live, hi.fast_max(self.hi[a]), self.hi[a]);
            plain = plain & dir[a].abs().cmp_le(most);
        }
        self.plain = self.plain & (plain | !live);
    }

    /// The region; everything if some segment is not to be told by its ends.
    #[inline(always)]
    pub fn region(self) -> Region<V::Scalar> {
        let everywhere = [V::Scalar::LOWEST, V::Scalar::INFINITY];
        let plain = self.plain.bits() & V::ALL == V::ALL;
        let [x, y, z] = each(|a| {
            let (lo, hi) = (self.lo[a].range(V::ALL).0, self.hi[a].range(V::ALL).1);
            let [low, high] = [lo, hi].map(|x| if x < V::Scalar::ZERO { V::Scalar::ZERO - x } else { x });
            let largest = low.fast_max(high);
            let slack = largest * V::Scalar::from_f64(SLACK / 2.0) * V::Scalar::EPSILON
                + V::Scalar::from_f64(2.0 * Self::small());
            if plain && slack.is_finite() { [lo - slack, hi + slack] } else { everywhere }
        });
        Region(Aabb { lo: [x[0], y[0], z[0]], hi: [x[1], y[1], z[1]] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{Child, WIDE, WIDTH};
    use crate::lanes::{f32x8, f32x16, f64x8};
    use crate::ray::slab::Interval;
    use crate::ray::{Packet, Rays};

    /// Short rays near each other among boxes, some far from the origin, some nearly along an axis, some of odd lengths.
    fn check<V: Lanes, E: Lanes<Scalar = V::Scalar>, const W: usize>() {
        let mut state = 5u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let (mut met, mut left, mut told) = (0, 0, 0);
        for round in 0..600 {
            let far = [0.0, 1e2, 1e6, 1e-6][round % 4];
            let mut rays = Rays::<V::Scalar>::new(2 * V::N);
            for i in 0..rays.len() {
                let org = each(|_| V::Scalar::from_f64(far + 0.5 * next()));
                let thin = [1.0, 1e-9, 1e-37, 0.0][if i % 8 == 7 { round / 4 % 4 } else { 0 }];
                // The same segment by a long direction or a short one.
                let scale = [1.0, 1e-25, 1e17, 1e30][if round % 3 == 0 { i % 4 } else { 0 }];
                let dir =
                    each(|a| V::Scalar::from_f64(scale * (2.0 * next() - 1.0) * if a == i % 3 { thin } else { 1.0 }));
                let t_min = if i % 5 == 0 && round % 7 == 0 { -2.0 } else { 0.0 };
                let t_max = if i % 6 == 0 && round % 11 == 0 { f64::INFINITY } else { 0.3 * next() };
                rays.set(i, org, dir, V::Scalar::from_f64(t_min / scale), V::Scalar::from_f64(t_max / scale));
            }
            let mut node = Node::<V::Scalar, W>::empty();
            for _ in 0..W - 2 {
                let lo = each(|_| V::Scalar::from_f64(far + 2.0 * next() - 1.0));
                node.push(&Aabb { lo, hi: each(|a| lo[a] + V::Scalar::from_f64(next())) }, Child::ROOT);
            }
            let (mut extent, mut meets) = (Extent::<V>::none(), 0);
            for at in (0..rays.len()).step_by(V::N) {
                let (packet, t_max, live) = Packet::<V>::load(&rays, at);
                extent.add(packet.org, packet.dir, [packet.t_min, t_max], live);
                for slot in 0..node.used as usize {
                    let bounds = node.child_bounds(slot);
                    let interval = Interval::of(&packet, bounds.lo, bounds.hi);
                    meets |= u32::from(interval.meets(packet.t_min, t_max).bits() & live != 0) << slot;
                }
            }
            let region = extent.region();
            let children = region.children::<E, W>(&node);
            assert_eq!(meets & !children, 0, "round {round}: a ray meets a box that the region does not");
            met += meets.count_ones();
            left += children.count_ones();
            told += u32::from(region.0.is_bounded());
        }
        assert!(met > 200 && left > met && left < 600 * (W as u32 - 2) * 7 / 8, "{met} boxes met, {left} left");
        assert!((250..600).contains(&told), "{told} regions are bounded");
    }

    #[test]
    fn no_box_that_a_ray_meets_is_outside_the_region() {
        check::<f32x16, f32x8, WIDTH>();
        check::<f32x16, f32x16, WIDE>();
        check::<f64x8, f64x8, WIDTH>();
    }

    #[test]
    fn a_region_is_around_its_segments() {
        let mut rays = Rays::<f32>::new(16);
        for i in 0..16 {
            rays.set(i, [i as f32, 2.0, 0.0], [0.0, if i % 2 == 0 { 1.0 } else { -1.0 }, 0.0], 0.0, 0.5);
        }
        // Dead, and far away.
        rays.set(15, [1e9, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0, 0.0);
        let (packet, t_max, live) = Packet::<f32x16>::load(&rays, 0);
        let mut extent = Extent::none();
        extent.add(packet.org, packet.dir, [packet.t_min, t_max], live);
        let Aabb { lo, hi } = extent.region().0;
        for (got, want) in lo.into_iter().chain(hi).zip([0.0, 1.5, 0.0, 14.0, 2.5, 0.0]) {
            assert!((got - want).abs() <= 1e-4, "{lo:?} {hi:?}");
        }
        assert!(lo[0] < 0.0 && hi[0] > 14.0 && lo[1] < 1.5 && hi[1] > 2.5);
    }
}
