//! Tiles whose groups do not each keep to a part of it, as groups of rays in no order do not: what one meets all may meet, so
//! nothing is gained by asking for a triangle once.

use super::groups::Groups;
use super::{SET, V};
use crate::lanes::{LaneMask, Lanes};

/// Groups whose middles are looked at.
const SAMPLE: usize = 4;

/// How many groups may cover the middle of one, of a tile of one set and of a larger one: in order one to three do, in no order most
/// of sixteen or sixty-four.
const MOST: [u32; 2] = [4, 8];

impl Groups {
    /// Whether the groups of a loaded tile of `N` sets lie all over each other.
    #[inline(always)]
    pub fn are_mixed<const N: usize>(&self) -> bool {
        if self.even.is_some() {
            return false;
        }
        let (mut looked_at, mut covered) = (0, 0);
        for k in 0..SAMPLE {
            let (set, lane) = (k % N, (5 * k + 2) % SET);
            let [s, t] = [0, 1].map(|axis| {
                let [lo, hi] = &self.rect[axis];
                0.5 * (lo[set].lane(lane) + hi[set].lane(lane))
            });
            // Groups without a ray have ends that are infinite the other way round.
            if !(s.is_finite() && t.is_finite()) {
                continue;
            }
            looked_at += 1;
            let [s, t] = [s, t].map(V::splat);
            for q in 0..N {
                let [[s0, s1], [t0, t1]] = [0, 1].map(|axis| [self.rect[axis][0][q], self.rect[axis][1][q]]);
                covered += (s0.cmp_le(s) & s.cmp_le(s1) & t0.cmp_le(t) & t.cmp_le(t1)).bits().count_ones();
            }
        }
        covered > looked_at * MOST[usize::from(N > 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{GROUPS, SETS};
    use super::*;

    /// A tile of squares side by side, or of ones as large as all of it, or of both.
    fn tile<const N: usize>(large: impl Fn(usize) -> bool, dead: impl Fn(usize) -> bool) -> bool {
        let mut groups = Box::<Groups>::default();
        let along = if N == 1 { 4 } else { 8 };
        for q in 0..N {
            let ends: [[f32; 4]; SET] = std::array::from_fn(|i| {
                let g = q * SET + i;
                let (x, y) = ((g % along) as f32, (g / along) as f32);
                match (dead(g), large(g)) {
                    (true, _) => [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::NEG_INFINITY],
                    (_, true) => [0.0, along as f32, 0.1 * x, along as f32],
                    _ => [x, x + 1.0, y, y + 1.0],
                }
            });
            for axis in 0..2 {
                for end in 0..2 {
                    groups.rect[axis][end][q] = V::new(ends.map(|e| e[2 * axis + end]));
                }
            }
        }
        groups.are_mixed::<N>()
    }

    #[test]
    fn groups_in_order_are_told_from_others() {
        assert!(!tile::<1>(|_| false, |_| false) && !tile::<SETS>(|_| false, |_| false));
        assert!(tile::<1>(|_| true, |_| false) && tile::<SETS>(|_| true, |_| false));
        // A few that lie across an edge, and those that miss everything.
        assert!(!tile::<SETS>(|g| g % GROUPS == 7 || g == 30, |_| false));
        assert!(tile::<SETS>(|_| true, |g| g % 3 == 0));
        assert!(!tile::<SETS>(|_| true, |g| g >= 3) && !tile::<SETS>(|_| false, |_| true));
    }
}
