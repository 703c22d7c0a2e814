//! One box against the single rays of some groups, only while it pays.
//!
//! A group's rectangle says little where its rays end at very different depths, as shadow rays do at the edges of
//! things: the rectangle is wide, the rays are few and elsewhere. A score keeps the evidence: it grows with triangle
//! tests that found nothing and shrinks with box tests that culled nothing, and carries over from tile to tile. It
//! decides about time only, never about an answer.

use super::bundle::{Bundle, Shared, load3};
use super::groups::Groups;
use super::node::MARGIN;
use super::{GROUPS, HALF_ULP, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, each, map3};
use crate::math::Aabb;

/// The score stays within these.
const SCORES: (i32, i32) = (-50, 400);

/// Evidence, and what box tests need of the rays.
#[derive(Clone, Debug)]
pub struct Slabs {
    /// Depth per unit of each world axis, by group; valid where `ready` says so.
    per_axis: [Lanes3<V>; GROUPS],
    ready: u64,
    score: i32,
}

impl Default for Slabs {
    fn default() -> Self {
        Self { per_axis: [[V::splat(0.0); 3]; GROUPS], ready: 0, score: 0 }
    }
}

impl Slabs {
    /// Nothing is known.
    pub fn forget(&mut self) {
        self.score = 0;
    }

    /// A new tile: what was learnt counts half.
    #[inline(always)]
    pub fn start(&mut self) {
        self.ready = 0;
        self.score = (self.score / 2).max(0);
    }

    /// Whether to test a box that `groups` meet.
    #[inline(always)]
    pub fn wanted<const ANY: bool>(&self, groups: u64) -> bool {
        self.score > 0 && (ANY || groups.count_ones() <= 4)
    }

    /// `pairs` of triangles and groups were tested, `found` of them gave something.
    #[inline(always)]
    pub fn learn(&mut self, pairs: usize, found: usize) {
        self.add(pairs as i32 - 3 * found as i32);
    }

    #[inline(always)]
    fn add(&mut self, evidence: i32) {
        self.score = (self.score + evidence).clamp(SCORES.0, SCORES.1);
    }

    /// Of `groups`, those with a ray that meets the box.
    #[inline(never)]
    pub fn test(&mut self, groups: &Groups, bundle: &Bundle, bounds: &Aabb<f32>, wanted: u64) -> u64 {
        self.prepare(groups, bundle, wanted & !self.ready);
        let frame = &groups.frame;
        let margin = MARGIN * HALF_ULP * frame.extent + 2.0 * groups.slack / frame.scale;
        let lo = each(|a| V::splat(bounds.lo[a] - frame.apex[a] - margin));
        let hi = each(|a| V::splat(bounds.hi[a] - frame.apex[a] + margin));
        let more = V::splat(1.0 + 16.0 * HALF_ULP);
        let (mut met, mut rest) = (0, wanted);
        while rest != 0 {
            let g = rest.trailing_zeros() as usize & (GROUPS - 1);
            rest &= rest - 1;
            let [x, y, z] = each(|a| {
                let (one, other) = (lo[a] * self.per_axis[g][a], hi[a] * self.per_axis[g][a]);
                (one.fast_min(other), one.fast_max(other))
            });
            let near = x.0.fast_max(y.0).fast_max(z.0.fast_max(V::splat(0.0)));
            let far = x.1.fast_min(y.1).fast_min(z.1) * more;
            let hit = near.cmp_le(far) & (near * groups.of[g].inv_lo).cmp_le(more);
            met |= u64::from(hit.any()) << g;
        }
        let (tested, culled) = (wanted.count_ones() as i32, (wanted & !met).count_ones() as i32);
        self.add(8 * culled - 2 * tested);
        met
    }

    /// Reciprocals of the directions, scaled so that the parameter is the depth.
    #[inline(always)]
    fn prepare(&mut self, groups: &Groups, bundle: &Bundle, mut missing: u64) {
        self.ready |= missing;
        // Far below the margin of the boxes, far above what overflows.
        let least = V::splat(1e-10 / groups.frame.scale);
        while missing != 0 {
            let g = missing.trailing_zeros() as usize & (GROUPS - 1);
            missing &= missing - 1;
            let at = bundle.first + g * V::N;
            let direction = match bundle.shared {
                Shared::Start => load3(&bundle.rays.dir, at),
                Shared::End(_) => {
                    let org = load3(&bundle.rays.org, at);
                    each(|a| org[a] - V::splat(groups.frame.apex[a]))
                }
            };
            let per_depth = V::constant(1.0) / groups.of[g].speed;
            self.per_axis[g] = map3(direction, |d| {
                let d = d * per_depth;
                V::constant(1.0) / select(d.abs().cmp_lt(least), least, d)
            });
        }
    }
}
