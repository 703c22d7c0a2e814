//! Where segments lie: a box around them all, which says what nodes' boxes none of them meets, whatever their directions.

use crate::bvh::Node;
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each};

/// How far a region reaches beyond the ends of its segments, relative to its largest coordinate, in half ulps: the box test of a ray
/// ([`crate::ray::slab`]) is off by less than five roundings, the end by two.
const SLACK: f64 = 32.0;

/// A box around segments, with what the box test of a ray may be off by: a box that a ray meets by that test meets the region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region<S> {
    lo: [S; 3],
    hi: [S; 3],
}

impl<S: Real> Region<S> {
    /// Children of a node that meet it, as bits. `E`: vectors of `W` children.
    #[inline(always)]
    pub fn children<E: Lanes<Scalar = S>, const W: usize>(&self, node: &Node<S, W>) -> u32 {
        let [x, y, z] = each(|a| {
            let [low, high] = &node.bounds[a];
            E::load(low).cmp_le(E::splat(self.hi[a])) & E::splat(self.lo[a]).cmp_le(E::load(high))
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
        Region { lo: [x[0], y[0], z[0]], hi: [x[1], y[1], z[1]] }
    }
}
