//! A group's rays in the tile's frame, and where their segments start and end there.

use super::V;
use super::bundle::{At, Bundle, Shared, Source, largest};
use super::columns::Segments;
use super::frame::Frame;
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each, map3};

/// One group's rays in the frame.
pub struct Lines {
    /// First ray coordinate.
    pub s: V,
    /// Second ray coordinate.
    pub t: V,
    /// Parameter per unit of depth (common start), or the reciprocal depth at t = 0 (common end).
    pub slowness: V,
    /// 1/z at the far end of the segment.
    pub far: V,
    /// 1/z at its near end.
    pub near: V,
    /// Lanes that the tile's arithmetic can take.
    pub fit: u32,
    /// Distance from the common end (0 for a common start).
    pub reach: V,
    /// How far the common point is behind where segments start, in the rays' parameter. Of rays of one direction: their height at
    /// parameter zero.
    pub behind: V,
    /// Where segments start, of rays without a common start.
    pub start: Lanes3<V>,
    /// Segments have both of their natural ends: 0, and infinity or the common end.
    pub whole: bool,
}

impl Lines {
    /// Those of a group of a pencil.
    #[inline(always)]
    pub fn of_pencil(frame: &Frame, bundle: &Bundle, g: usize) -> Self {
        let (zero, infinite) = (V::constant(0.0), V::splat(f32::INFINITY));
        let [s, t] = match bundle.source {
            Source::Pencil(pencil, middle) => pencil.places.around(bundle.first / V::N + g, middle).map(V::new),
            Source::Batch(_) => [zero; 2],
        };
        let (slowness, start) = (V::splat(1.0 / frame.scale), [zero; 3]);
        Self { s, t, slowness, far: zero, near: infinite, fit: V::ALL, reach: zero, behind: zero, start, whole: true }
    }

    /// Those of the lanes `tame` of a group of rays in memory.
    #[inline(always)]
    pub fn of(frame: &Frame, bundle: &Bundle, segments: &Segments, tame: u32) -> Self {
        if let Some(parallel) = &frame.parallel {
            return parallel.lines(frame, bundle, segments, tame);
        }
        let (zero, one, infinite) = (V::constant(0.0), V::constant(1.0), V::splat(f32::INFINITY));
        let Segments { org, dir, t_min, t_max } = *segments;
        // Where a segment starts or ends at zero, the depth there is infinite, not its negative.
        let [t_min, t_max] = [t_min + zero, t_max + zero];
        let apex = map3(bundle.apex, V::splat);
        let direction = match bundle.shared {
            Shared::Start | Shared::Behind | Shared::Along => dir,
            Shared::End(_) | Shared::Against => each(|a| org[a] - apex[a]),
        };
        let [x, y, speed] = frame.coordinates(direction);
        let slowness = one / speed;
        let (s, t) = (x * slowness, y * slowness);
        let mut fit = zero.cmp_lt(slowness) & slowness.cmp_lt(V::splat(f32::MAX));
        // Most segments are whole: all that a ray or the way to a light has. They need no divisions.
        let is_whole = |end: V| (zero.cmp_eq(t_min) & end.cmp_eq(t_max)).bits() & tame == tame;
        let starts = || each(|a| t_min.mul_add(dir[a], org[a]));
        let (mut behind, mut start) = (zero, org);
        let (far, near, reach, whole) = match bundle.shared {
            Shared::Start if is_whole(infinite) => (zero, infinite, zero, true),
            Shared::End(At::One) if is_whole(one) => (slowness, infinite, largest(direction), true),
            Shared::Start | Shared::Along | Shared::Against => (slowness / t_max, slowness / t_min, zero, false),
            Shared::Behind => {
                start = starts();
                let way = each(|a| start[a] - apex[a]);
                behind = dot(way, direction) / dot(direction, direction);
                // Where a segment starts is told by the start itself.
                (slowness / (t_max + behind), infinite, zero, false)
            }
            Shared::End(at) => {
                start = starts();
                let scale = match at {
                    At::One => one,
                    At::Limit => one / t_max,
                };
                // What is left of the way to the end at the segment's two ends. Subtracting from one is accurate
                // to a few ulps as long as at least a quarter is left.
                let (left, end) = (one - t_min * scale, one - t_max * scale);
                fit = fit & V::constant(0.25).cmp_le(left);
                (slowness / left, slowness / zero.fast_max(end), largest(direction), false)
            }
        };
        Self { s, t, slowness, far, near, fit: fit.bits(), reach, behind, start, whole }
    }
}
