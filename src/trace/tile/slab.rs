//! One box against the single rays of some groups, only while it pays.
//!
//! A group's rectangle says little where its rays end at very different depths, as shadow rays do at the edges of
//! things: the rectangle is wide, the rays are few and elsewhere. A score keeps the evidence: it grows with triangle
//! tests that found nothing and shrinks with box tests that culled nothing, and carries over from tile to tile. It
//! decides about time only, never about an answer.

use super::bundle::Bundle;
use super::groups::Groups;
use super::spans::Spans;
use super::{GROUPS, HALF_ULP, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, each, map3};
use crate::math::{Aabb, Affine};

/// Most groups that are worth a test of a box, for the nearest hit and for any: more of them rarely miss it all.
const MOST: [u32; 2] = [4, 24];

/// What a group that misses a box saves, and what the test of one costs, in triangle tests; a call costs as much as one more.
const SAVED: i32 = 8;
/// See [`SAVED`].
const COST: i32 = 3;

/// The score stays within these.
const SCORES: (i32, i32) = (-50, 400);

/// Evidence, and what box tests need of the rays.
#[derive(Clone, Debug, Default)]
pub struct Slabs {
    /// In the world, and in the space of the instance that the tile is in.
    slopes: [Slopes; 2],
    score: i32,
}

/// Rays of the groups in one space.
#[derive(Clone, Debug)]
struct Slopes {
    /// Depth per unit of each axis, by group; valid where `ready` says so.
    per_axis: [Lanes3<V>; GROUPS],
    ready: u64,
}

impl Default for Slopes {
    fn default() -> Self {
        Self { per_axis: [[V::splat(0.0); 3]; GROUPS], ready: 0 }
    }
}

/// The space of the boxes.
#[derive(Clone, Copy, Debug)]
pub struct Space<'a> {
    /// The common point.
    pub apex: [f32; 3],
    /// How far outside of a box its contents may be met.
    pub margin: f32,
    /// Size of what is there, as seen from the apex.
    pub extent: f32,
    /// The way of world-space directions into it, if it is not the world's.
    pub to_local: Option<&'a Affine<f32>>,
}

impl Slabs {
    /// Nothing is known.
    pub fn forget(&mut self) {
        self.score = 0;
    }

    /// A new tile: what was learnt counts half.
    #[inline(always)]
    pub fn start(&mut self) {
        self.slopes[0].ready = 0;
        self.score = (self.score / 2).max(0);
    }

    /// The tile goes into another instance.
    #[inline(always)]
    pub fn enter(&mut self) {
        self.slopes[1].ready = 0;
    }

    /// Whether to test a box that `groups` meet.
    #[inline(always)]
    pub fn wanted<const ANY: bool>(&self, groups: u64) -> bool {
        self.score > 0 && groups.count_ones() <= MOST[usize::from(ANY)]
    }

    /// Whether tests have paid lately.
    #[inline(always)]
    pub fn pay(&self) -> bool {
        self.score > 0
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

    /// Of `groups`, those with a ray that meets the box. `spans`: the tile's directions in its space.
    #[inline(never)]
    pub fn test(
        &mut self,
        groups: &Groups,
        (bundle, space, spans): (&Bundle, &Space, &Spans),
        bounds: &Aabb<f32>,
        wanted: u64,
    ) -> u64 {
        if groups.frame.parallel.is_some() {
            return self.test_along(groups, space, bounds, wanted);
        }
        let slopes = &mut self.slopes[usize::from(space.to_local.is_some())];
        slopes.prepare(groups, bundle, space, wanted & !slopes.ready);
        let [lo, hi] = space.widened(bounds);
        let met = match spans.backwards() {
            Some(backwards) => {
                let near = each(|a| if backwards[a] { hi[a] } else { lo[a] });
                let far = each(|a| if backwards[a] { lo[a] } else { hi[a] });
                slopes.met::<true>(groups, near, far, wanted)
            }
            None => slopes.met::<false>(groups, lo, hi, wanted),
        };
        self.learn_of(wanted, met);
        met
    }

    /// The same of rays of one direction.
    #[inline(never)]
    fn test_along(&mut self, groups: &Groups, space: &Space, bounds: &Aabb<f32>, wanted: u64) -> u64 {
        let parallel = groups.frame.parallel.unwrap_or_default();
        let met = parallel.met(groups, space.apex, space.widened(bounds), wanted);
        self.learn_of(wanted, met);
        met
    }

    /// Of the `wanted` groups those that `met` a box went on.
    #[inline(always)]
    fn learn_of(&mut self, wanted: u64, met: u64) {
        let (tested, culled) = (wanted.count_ones() as i32, (wanted & !met).count_ones() as i32);
        self.add(SAVED * culled - COST * (tested + 1));
    }
}

impl Space<'_> {
    /// The corners of a box as seen from the apex, moved outwards.
    #[inline(always)]
    fn widened(&self, bounds: &Aabb<f32>) -> [[f32; 3]; 2] {
        [each(|a| bounds.lo[a] - self.apex[a] - self.margin), each(|a| bounds.hi[a] - self.apex[a] + self.margin)]
    }
}

impl Slopes {
    /// Of the `wanted` groups those with a ray that meets the box between some planes. `ORDERED`: `one` are those that all rays meet
    /// first, `other` last; else either may be.
    #[inline(always)]
    fn met<const ORDERED: bool>(&self, groups: &Groups, one: [f32; 3], other: [f32; 3], wanted: u64) -> u64 {
        let (one, other) = (one.map(V::splat), other.map(V::splat));
        let more = V::splat(1.0 + 16.0 * HALF_ULP);
        let reach = V::splat((1.0 + 16.0 * HALF_ULP) / groups.reach);
        let (mut met, mut rest) = (0, wanted);
        while rest != 0 {
            let g = rest.trailing_zeros() as usize & (GROUPS - 1);
            rest &= rest - 1;
            let [x, y, z] = each(|a| {
                let (one, other) = (one[a] * self.per_axis[g][a], other[a] * self.per_axis[g][a]);
                if ORDERED { (one, other) } else { (one.fast_min(other), one.fast_max(other)) }
            });
            let near = x.0.fast_max(y.0).fast_max(z.0.fast_max(V::constant(0.0)));
            let far = x.1.fast_min(y.1).fast_min(z.1) * more;
            let hit = near.cmp_le(far) & (near * groups.of[g].inv_lo).cmp_le(reach);
            met |= u64::from(hit.any()) << g;
        }
        met
    }

    /// Reciprocals of the directions, scaled so that the parameter is the depth.
    #[inline(always)]
    fn prepare(&mut self, groups: &Groups, bundle: &Bundle, space: &Space, mut missing: u64) {
        self.ready |= missing;
        // Far below the margin of the boxes, far above what overflows.
        let least = V::splat(1e-10 * space.extent);
        while missing != 0 {
            let g = missing.trailing_zeros() as usize & (GROUPS - 1);
            missing &= missing - 1;
            let way = bundle.ways(g);
            let direction = match space.to_local {
                Some(map) => map.vectors(way),
                None => way,
            };
            let per_depth = groups.of[g].slowness;
            self.per_axis[g] = map3(direction, |d| {
                let d = d * per_depth;
                V::constant(1.0) / select(d.abs().cmp_lt(least), least, d)
            });
        }
    }
}
