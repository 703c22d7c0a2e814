//! Where the segments of a full tile to a light start. A triangle that none of them starts behind, as seen from the light, is nothing
//! to them: mostly that is the very surface they leave, if it lies along the axes, as floors and walls do. So it need not be held
//! against the groups.

use super::groups::Group;
use super::{V, select};
use crate::lanes::words::{greatest, least};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each};

/// A box around starts.
#[derive(Clone, Copy, Debug)]
pub struct Starts {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Starts {
    /// Those of all rays of some groups.
    #[inline(never)]
    pub fn of(groups: &[Group]) -> Self {
        let (mut lo, mut hi) = ([V::splat(f32::INFINITY); 3], [V::splat(f32::NEG_INFINITY); 3]);
        for Group { start, .. } in groups {
            lo = each(|a| start[a].fast_min(lo[a]));
            hi = each(|a| start[a].fast_max(hi[a]));
        }
        Self { lo: each(|a| least(lo[a])), hi: each(|a| greatest(hi[a])) }
    }

    /// Of triangles with a `corner` and a `normal` that points away from the light those that some segment may start behind, as bits.
    ///
    /// The operations are those of [`super::held::Plane::behind`], and rounding keeps their order: no start in the box comes to more.
    #[inline(always)]
    pub fn some_behind(&self, corner: Lanes3<V>, normal: Lanes3<V>) -> u32 {
        let zero = V::constant(0.0);
        let farthest = each(|a| {
            let (lo, hi) = (V::splat(self.lo[a]), V::splat(self.hi[a]));
            select(normal[a].cmp_lt(zero), lo, hi) - corner[a]
        });
        !dot(normal, farthest).cmp_lt(zero).bits()
    }
}

#[cfg(test)]
mod tests {
    use super::super::batch::Planes;
    use super::super::groups::Groups;
    use super::super::held::{Line, Plane};
    use super::super::{GROUPS, SET};
    use super::*;

    /// Starts on a floor or a slope and triangles near it, many of which lie in the same plane.
    #[test]
    fn what_is_left_out_has_no_start_behind_it() {
        let mut state = 23u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        let (mut groups, mut planes) = (Box::<Groups>::default(), Box::<Planes>::default());
        let (mut left_out, mut alone) = (0, 0);
        for round in 0..400 {
            let slope = [0.0, 0.0, 0.3, 1e-6][round % 4];
            let height = next();
            let count = [GROUPS, SET][round / 4 % 2];
            for group in &mut groups.of[..count] {
                let [x, y] = [(); 2].map(|()| V::new(std::array::from_fn(|_| next())));
                let above = V::new(std::array::from_fn(|_| 1e-7 * next().abs()));
                group.start = [x, y, x.mul_add(V::splat(slope), V::splat(height)) + above];
            }
            // One ray that alone starts behind the others' floor, in any group.
            if round % 8 < 2 {
                let mut low = [0.0; 16];
                low[round % 16] = -0.25;
                groups.of[round * 7 % count].start[2] += V::new(low);
            }
            let near = |size: f32, next: &mut dyn FnMut() -> f32| V::new(std::array::from_fn(|_| size * next()));
            let [x, y] = [(); 2].map(|()| near(1.0, &mut next));
            let off = near([0.0, 1e-6, 0.5][round % 3], &mut next);
            let corner = [x, y, x.mul_add(V::splat(slope), V::splat(height)) + off];
            let tilt = [0.0, 0.0, 1e-3, 1.0][round / 2 % 4];
            let down = V::new(std::array::from_fn(|_| if next() < 0.2 { 1.0 } else { -1.0 }));
            let normal = [V::splat(slope) + near(tilt, &mut next), near(tilt, &mut next), down];
            for (to, x) in planes.side.iter_mut().zip(corner.into_iter().chain(normal)) {
                x.store(to);
            }
            let starts = Starts::of(&groups.of[..count]);
            let kept = starts.some_behind(corner, normal);
            for i in 0..16 {
                let plane = Plane::of(&planes, i);
                let some = (0..count).any(|g| V::constant(0.0).cmp_le(plane.behind(&Line::of(&groups, g))).any());
                assert!(!some || kept >> i & 1 != 0, "round {round}: triangle {i}");
                left_out += u32::from(kept >> i & 1 == 0);
                alone += u32::from(!some);
            }
        }
        // Some that no segment starts behind are kept, as the box is larger than what it holds.
        assert!(left_out > 500 && alone > left_out, "{left_out} {alone}");
    }
}
