//! Where the segments of a full tile to a light start. A triangle that none of them starts behind, as seen from the light, is nothing
//! to them: mostly that is the very surface they leave, if it lies along the axes, as floors and walls do. So it need not be held
//! against the groups.
//!
//! With where segments go they say where the tile's segments are at all ([`Room`]): boxes outside of that are not looked into. A tile
//! seen from its light, or from the point behind a mirror, holds all of the surface that its segments start on.

use super::bundle::{Bundle, Shared};
use super::groups::{Group, Groups};
use super::{Mask, SET, V, select};
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

    /// Those of some lanes of the groups that are `loaded`, as bits: others still hold what another tile left; `None` if there are none.
    #[inline(never)]
    fn of_lanes(groups: &[Group], lanes: &[u32], loaded: u64) -> Option<Self> {
        let (least_of_none, greatest_of_none) = (V::splat(f32::INFINITY), V::splat(f32::NEG_INFINITY));
        let (mut lo, mut hi) = ([least_of_none; 3], [greatest_of_none; 3]);
        for (g, (Group { start, .. }, lanes)) in groups.iter().zip(lanes).enumerate() {
            if *lanes == 0 || loaded >> g & 1 == 0 {
                continue;
            }
            let lanes = Mask::from_bits(*lanes);
            lo = each(|a| select(lanes, start[a], least_of_none).fast_min(lo[a]));
            hi = each(|a| select(lanes, start[a], greatest_of_none).fast_max(hi[a]));
        }
        let (lo, hi) = (each(|a| least(lo[a])), each(|a| greatest(hi[a])));
        (0..3).all(|a| lo[a] <= hi[a]).then_some(Self { lo, hi })
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

/// A box around all segments of a tile, as seen from their common point, in the space of the geometry.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Least coordinates, as far down as rays go without an end.
    pub lo: [f32; 3],
    /// Greatest.
    pub hi: [f32; 3],
}

impl Room {
    /// That of the `loaded` groups of a bundle, as bits, whose starts are loaded, too; `None` if they are not known, or start in the common point.
    #[inline(always)]
    pub fn of<const N: usize>(groups: &Groups, bundle: &Bundle, loaded: u64) -> Option<Self> {
        let starts = match (bundle.shared, &groups.starts) {
            (Shared::Start, _) => return None,
            (_, Some(starts)) => *starts,
            _ => Starts::of_lanes(&groups.of[..N * SET], &bundle.tame, loaded)?,
        };
        // A power of two.
        let scale = 1.0 / groups.frame.scale;
        let [lo, hi] = [starts.lo, starts.hi].map(|x| each(|a| x[a] * scale - bundle.apex[a]));
        // Lines pass the common point by this, and may go the other way along an axis by as little.
        let slack = bundle.slack;
        Some(match bundle.shared {
            Shared::Along | Shared::Against => {
                // As far as rays go: to one side of their starts along each axis, or to none.
                let dir = groups.frame.parallel.map_or([0.0; 3], |parallel| parallel.dir);
                Self {
                    lo: each(|a| if dir[a] < 0.0 { f32::NEG_INFINITY } else { lo[a] - slack }),
                    hi: each(|a| if dir[a] > 0.0 { f32::INFINITY } else { hi[a] + slack }),
                }
            }
            Shared::Behind => Self {
                lo: each(|a| if lo[a] > 4.0 * slack { lo[a] } else { f32::NEG_INFINITY }),
                hi: each(|a| if hi[a] < -4.0 * slack { hi[a] } else { f32::INFINITY }),
            },
            _ => Self { lo: each(|a| lo[a].min(-slack)), hi: each(|a| hi[a].max(slack)) },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::batch::Planes;
    use super::super::bundle::At;
    use super::super::groups::Groups;
    use super::super::held::{Line, Plane};
    use super::super::{GROUPS, SET, SETS};
    use super::*;
    use crate::ray::Rays;

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
    /// Segments to a light and lines from a point behind a mirror, with the mirror along an axis, sloping, or about the point.
    #[test]
    fn rooms_hold_all_segments() {
        let mut state = 29u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        let rays = Rays::new(GROUPS * 16);
        let mut groups = Box::<Groups>::default();
        let (mut floors, mut sides) = (0, 0);
        for round in 0..200 {
            groups.frame.scale = [1.0, 0.25, 8.0][round % 3];
            let apex = [(); 3].map(|()| 2.0 * next());
            let height = [1.0, -0.5, 0.0][round / 3 % 3];
            let slope = [0.0, 0.5][round / 2 % 2];
            let shared = [Shared::End(At::One), Shared::Behind][round % 2];
            let tame: [u32; GROUPS] = std::array::from_fn(|_| (next() * 1e6) as i32 as u32 & 0xffff);
            let mut bundle = Bundle { apex, slack: 1e-6, shared, tame, ..Bundle::unsorted(&rays, 0, GROUPS) };
            bundle.tame[round % GROUPS] = 0;
            let mut starts = Vec::new();
            for (g, (group, lanes)) in groups.of.iter_mut().zip(bundle.tame).enumerate() {
                if g == round % 7 {
                    // Not loaded: left by another tile.
                    group.start = [V::splat(1e9); 3];
                    continue;
                }
                let at: [[f32; 3]; 16] = std::array::from_fn(|_| {
                    let [x, y] = [4.0 * next(), 4.0 * next()];
                    [apex[0] + x, apex[1] + y, apex[2] + height + slope * x]
                });
                starts.extend((0..16).filter(|lane| lanes >> lane & 1 != 0).map(|lane| at[lane]));
                group.start = each(|a| V::new(at.map(|p| p[a] * groups.frame.scale)));
            }
            groups.starts = None;
            let room = Room::of::<SETS>(&groups, &bundle, !(1 << (round % 7))).expect("starts");
            assert!((0..3).all(|a| room.lo[a].abs() < 1e6 || room.lo[a].is_infinite()), "{room:?}");
            let inside = |p: [f32; 3]| (0..3).all(|a| room.lo[a] <= p[a] && p[a] <= room.hi[a]);
            for start in &starts {
                let way: [f32; 3] = each(|a| start[a] - apex[a]);
                let parts = if shared == Shared::Behind { [1.0, 1.5, 1e3] } else { [1.0, 0.5, 0.0] };
                assert!(parts.iter().all(|part| inside(way.map(|x| x * part))), "round {round}: {start:?} {room:?}");
            }
            floors += u32::from(slope == 0.0 && height != 0.0 && room.lo[2].max(-room.hi[2]) > 0.4);
            sides += u32::from((0..3).any(|a| room.lo[a].is_infinite() && room.hi[a].is_infinite()));
        }
        // Floors and ceilings are below and above all of the rays they throw back.
        assert!(floors > 20 && sides > 20, "{floors} {sides}");
        let none = Bundle { shared: Shared::Behind, tame: [0; GROUPS], ..Bundle::unsorted(&rays, 0, GROUPS) };
        assert!(Room::of::<SETS>(&groups, &none, u64::MAX).is_none());
    }
}
