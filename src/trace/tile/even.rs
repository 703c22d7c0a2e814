//! Groups of about one size, as pixels of a camera are: which of them a triangle meets costs half as much to ask.

use super::groups::Groups;
use super::{HALF_ULP, SETS, V};
use crate::lanes::words::greatest;
use crate::lanes::{Lanes, Lanes3};

/// How much larger than a fair share of its tile's rectangle the largest group may be.
const MOST: f32 = 1.25;

/// Groups along either side of a tile of four sets, or of one.
const ALONG: [f32; 2] = [8.0, 4.0];

/// Rectangles of one size around the groups of a tile.
#[derive(Clone, Debug)]
pub struct Even {
    /// Their middles, s and t, sixteen groups in the lanes of a vector.
    pub middle: [[V; SETS]; 2],
    /// Half their size.
    half: [f32; 2],
    /// Largest |s|, |t|.
    wide: f32,
}

impl Even {
    /// Those of the `N` sets of a full tile, if its groups are not of too different sizes.
    #[inline(always)]
    pub fn of<const N: usize>(groups: &Groups) -> Option<Self> {
        let along = ALONG[usize::from(N == 1)];
        let mut even = Self { middle: [[V::splat(0.0); SETS]; 2], half: [0.0; 2], wide: groups.wide };
        for axis in 0..2 {
            let mut size = V::constant(0.0);
            for q in 0..N {
                let [low, high] = [groups.rect[axis][0][q], groups.rect[axis][1][q]];
                even.middle[axis][q] = (low + high) * V::splat(0.5);
                size = size.fast_max(high - low);
            }
            let size = greatest(size);
            let [low, high] = groups.bounds[axis];
            if along * size > MOST * (high - low) {
                return None;
            }
            even.half[axis] = 0.5 * size;
        }
        Some(even)
    }

    /// Linear functions that are, in the middle of a group, at least what some others are anywhere in it, however either is rounded:
    /// what rounds are nine operations here, two in the value of a ray, and the middle and half of a rectangle, each by half an ulp of
    /// the sum of the function's terms at most, so 13 of these.
    #[inline(always)]
    pub fn raised(&self, [x, y, z]: Lanes3<V>) -> Lanes3<V> {
        let [half_s, half_t, wide] = [self.half[0], self.half[1], self.wide].map(V::splat);
        let (slope_s, slope_t) = (x.abs(), y.abs());
        let off = V::splat(16.0 * HALF_ULP) * (slope_s + slope_t).mul_add(wide, z.abs());
        [x, y, z + slope_s.mul_add(half_s, slope_t.mul_add(half_t, off))]
    }
}

#[cfg(test)]
mod tests {
    use super::super::GROUPS;
    use super::*;

    /// Numbers between -0.5 and 0.5.
    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 11u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        }
    }

    /// Eight by eight groups within 0.3, each of its own size between `least` and 1.2 fair shares.
    fn tile(next: &mut impl FnMut() -> f32, least: f32) -> Box<Groups> {
        let mut groups = Box::<Groups>::default();
        let share = 0.3 / 8.0;
        groups.bounds = [[0.1, 0.4]; 2];
        groups.wide = 0.4;
        for g in 0..GROUPS {
            for (axis, at) in [g % 8, g / 8].into_iter().enumerate() {
                let size = share * (least + (1.2 - least) * (next() + 0.5));
                let low = 0.1 + share * at as f32;
                for (end, x) in [low, low + size].into_iter().enumerate() {
                    bytemuck::cast_mut::<[V; SETS], [f32; GROUPS]>(&mut groups.rect[axis][end])[g] = x;
                }
            }
        }
        groups
    }

    #[test]
    fn nowhere_in_a_group_is_a_function_greater() {
        let mut next = numbers();
        let (mut nearest, mut tested) = (f32::INFINITY, 0);
        for _ in 0..60 {
            let groups = tile(&mut next, 1.1);
            let even = Even::of::<4>(&groups).expect("groups of about one size");
            let ends = groups.rect.map(|axis| axis.map(bytemuck::cast::<[V; SETS], [f32; GROUPS]>));
            let middle = even.middle.map(bytemuck::cast::<[V; SETS], [f32; GROUPS]>);
            for _ in 0..40 {
                // As edges have them: a sum near zero of terms that are not.
                let (x, y) = (next() * 10.0, next() * 10.0);
                let z = -(x * (0.25 + 0.3 * next()) + y * (0.25 + 0.3 * next()));
                let [u, v, w] = even.raised([x, y, z].map(V::splat)).map(|f| f.to_array()[0]);
                for g in 0..GROUPS {
                    let bound = u.mul_add(middle[0][g], v.mul_add(middle[1][g], w));
                    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let value = x.mul_add(ends[0][i][g], y.mul_add(ends[1][j][g], z));
                        assert!(value <= bound, "{value} {bound}");
                        nearest = nearest.min((bound - value) / (x.abs() * 0.4 + y.abs() * 0.4 + z.abs()));
                        tested += 1;
                    }
                }
            }
        }
        // Corners of the largest groups come as near as what may be rounded; nothing like a pixel is added.
        assert!(tested > 500_000 && nearest < 40.0 * HALF_ULP, "{tested} {nearest}");
    }

    #[test]
    fn a_group_twice_as_large_is_not_even() {
        let mut next = numbers();
        let mut groups = tile(&mut next, 0.2);
        assert!(Even::of::<4>(&groups).is_some());
        let high = groups.rect[1][1][2].to_array();
        groups.rect[1][1][2] = V::new(std::array::from_fn(|i| high[i] + if i == 7 { 0.3 / 8.0 } else { 0.0 }));
        assert!(Even::of::<4>(&groups).is_none());
    }
}
