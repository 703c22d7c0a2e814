//! The rays of a tile: up to 64 groups of 16 (4x4 pixels), each ray as (s, t), its depth as 1/z between two bounds.

use super::bundle::{Bundle, Shared, Source};
use super::columns::{AHEAD, Columns};
use super::even::Even;
use super::frame::Frame;
use super::late::Late;
use super::lines::Lines;
use super::listing;
use super::parallel;
use super::presumed::Look;
use super::starts::{Room, Starts};
use super::{GROUPS, HALF_ULP, Mask, SET, SETS, V, select};
use crate::lanes::minima::{quarter_minima, quarters};
use crate::lanes::words::{greatest, least};
use crate::lanes::{LaneMask, Lanes, Lanes3, map3};
use crate::scene::world::World;

/// Widest tile: |s| and |t| below this (83 degrees off the axis).
const WIDEST: f32 = 8.0;

/// Largest relative error of depths computed from a ray's parameter.
const MOST_LOOSE: f32 = 1e-3;

/// "No triangle yet".
pub const NO_SLOT: u32 = u32::MAX;

/// The rays of one group and what they found. Depths are 1/z: 0 is infinitely far, infinite is a lane that wants nothing
/// any more. One group's numbers lie together, so that what a pair of triangle and group needs is a few lines in a row.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Group {
    /// First ray coordinate.
    pub s: V,
    /// Second ray coordinate.
    pub t: V,
    /// The best hit (or the end of the segment) is surely not farther than this. Own answers: it is there.
    pub inv_lo: V,
    /// The best hit is surely not nearer than this. Own answers: no hit may be nearer than this, the segment's start; only kept
    /// where some segment [`Groups::ends_early`].
    pub inv_hi: V,
    /// Triangle of the best hit, as [`super::batch::Batch::id`] has it, or [`NO_SLOT`].
    pub slot: [u32; 16],
    /// Own answers: weights of the second and third corner at the best hit, times 1/z there.
    pub weights: [V; 2],
    /// Rays without a common start: where their segments start, in the axes of the geometry and
    /// the scale of the frame.
    pub start: Lanes3<V>,
    /// The ray's parameter per unit of depth.
    pub slowness: V,
}

// An odd number of cache lines: the same numbers of all groups lie in different sets of the cache.
const _: () = assert!(size_of::<Group>() / 64 % 2 == 1);

impl Default for Group {
    fn default() -> Self {
        let zero = V::splat(0.0);
        Self {
            s: zero,
            t: zero,
            inv_lo: zero,
            inv_hi: zero,
            slot: [NO_SLOT; 16],
            weights: [zero; 2],
            start: [zero; 3],
            slowness: zero,
        }
    }
}

/// The state of a tile.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Groups {
    /// The groups.
    pub of: [Group; GROUPS],
    /// The world is made of instances.
    pub many: bool,
    /// In such worlds: instance of the best hit, or [`NO_SLOT`].
    pub inst: [[u32; 16]; GROUPS],
    /// All segments are whole: from 0 on without an end, or to the common end.
    pub endless: bool,
    /// Some segment ends before the common point.
    pub ends_early: bool,
    /// The common point is behind where segments start.
    pub is_behind: bool,
    /// While a set's rays are loaded: s, t, -s, -t of each group, a quarter of a vector each ([`quarters`]). Greatest values as
    /// least negatives: one kind of shuffle tree does both.
    pub ends: [V; SET],
    /// How far behind, by group and in the rays' parameter. Apart from [`Group`], as other tiles do not need it.
    pub behind: [V; GROUPS],
    /// Own answers: which part of the way from that point to the best hit is ahead of the start.
    pub ahead: [V; GROUPS],
    /// Of a full tile of segments to a common end: where they start.
    pub starts: Option<Starts>,
    /// Of segments without a common start: where they are.
    pub room: Option<Room>,
    /// Surely no segment starts nearer than at this depth.
    pub front: f32,
    /// Relative error of depths computed from a ray's parameter.
    pub loose: f32,
    /// Per group, sixteen in the lanes of a vector: least and greatest s, least and greatest t.
    pub rect: [[[V; SETS]; 2]; 2],
    /// Of a full tile the same as rectangles of one size, if they nearly are.
    pub even: Option<Even>,
    /// All rays are there, and start in the common point and have no end.
    pub full: bool,
    /// The same as fractions of the tile's rectangle.
    pub part: [[[V; SETS]; 2]; 2],
    /// Rays with a common end: factor of [`Group::inv_lo`] that makes it sure. Else 1, and it is sure by itself.
    pub reach: f32,
    /// Per group: least [`Group::inv_lo`], sure.
    pub least: [V; SETS],
    /// Farthest of all groups.
    pub farthest: f32,
    /// Least [`Groups::least`] of all: a triangle that is farther everywhere is of no interest.
    pub nearest: f32,
    /// Rectangle of the whole tile: `[axis][least, greatest]`.
    pub bounds: [[f32; 2]; 2],
    /// The same of each set, four times over: lane 4 * i + set.
    pub of_sets: [[V; 2]; 2],
    /// Largest |s|, |t| of the tile.
    pub wide: f32,
    /// Surely no hit is nearer than 1 / this (start of the segments).
    pub cap: f32,
    /// How far hits may be from where the tile's arithmetic puts them, on top of what grows with distance; scaled.
    pub slack: f32,
    /// Of a pencil: groups whose rays' directions are where other tiles have their starts ([`Group::start`]).
    pub aimed: u64,
    /// The frame.
    pub frame: Frame,
    /// From this group of the batch on the memory was not asked for rays yet.
    pub asked: usize,
}

impl Default for Groups {
    fn default() -> Self {
        let zero = [V::splat(0.0); SETS];
        Self {
            of: [Group::default(); GROUPS],
            many: false,
            inst: [[NO_SLOT; 16]; GROUPS],
            endless: false,
            ends_early: false,
            is_behind: false,
            ends: [V::splat(0.0); SET],
            behind: [V::splat(0.0); GROUPS],
            ahead: [V::splat(0.0); GROUPS],
            starts: None,
            room: None,
            front: 0.0,
            loose: 0.0,
            rect: [[zero; 2]; 2],
            even: None,
            full: false,
            part: [[zero; 2]; 2],
            reach: 1.0,
            least: zero,
            farthest: 0.0,
            nearest: 0.0,
            bounds: [[0.0; 2]; 2],
            of_sets: [[V::splat(0.0); 2]; 2],
            wide: 0.0,
            cap: 0.0,
            slack: 0.0,
            aimed: 0,
            frame: Frame::default(),
            asked: 0,
        }
    }
}

impl Groups {
    /// Takes in some groups of the first `N` sets of a bundle that looks at `world`. False if they spread too wide for one
    /// frame (nothing is traced then). Whatever is `late` of the tile before is written first, if any group is touched.
    #[inline(always)]
    pub fn load<const N: usize, const ANY: bool, const EXACT: bool>(
        &mut self,
        bundle: &mut Bundle,
        groups: u64,
        world: &World<f32>,
        late: &mut Late,
    ) -> bool {
        self.many = !world.is_single_object();
        let Some(frame) = Frame::of::<N>(bundle, groups, world.tree_bounds()) else { return false };
        (self.frame, self.aimed) = (frame, 0);
        if self.many {
            self.inst[..N * SET].fill([NO_SLOT; 16]);
        }
        let most = V::splat(f32::INFINITY);
        let (mut near, mut reach, mut front) = (most, V::splat(0.0), most);
        let (mut whole, mut live) = (0, 0);
        let mut look = Look::default();
        let columns = match bundle.source {
            Source::Batch(rays) => Some(Columns::of(rays)),
            Source::Pencil(..) => None,
        };
        let from = bundle.first / V::N;
        let all = u64::MAX >> (GROUPS - N * SET);
        let mut late = late.take();
        let full = !EXACT && groups == all && self.fill::<N, ANY>(bundle, &mut look, &mut reach, late.take());
        if let Some(late) = late {
            self.write_all(late);
        }
        if full {
            whole = all;
        } else if bundle.presumed && bundle.shared.is_direction() {
            return false;
        } else {
            for q in 0..N {
                for i in 0..SET {
                    let g = q * SET + i;
                    self.of[g].slot = [NO_SLOT; 16];
                    let mut tame = if groups >> g & 1 != 0 { bundle.tame[g] } else { 0 };
                    let mut segments = None;
                    if let Some(columns) = &columns
                        && tame != 0
                    {
                        let group = segments.insert(columns.get(from + g));
                        if bundle.presumed {
                            columns.prefetch_from(self.asked, from + g + AHEAD);
                            let Some(lanes) = bundle.look::<ANY>(g, group, &mut look) else { return false };
                            (tame, bundle.tame[g]) = (lanes, lanes);
                        }
                    }
                    if tame == 0 {
                        (self.of[g].inv_lo, self.of[g].inv_hi) = (most, most);
                        self.ends[i] = most;
                        whole |= 1 << g;
                        continue;
                    }
                    let lines = match &segments {
                        Some(segments) => Lines::of(&self.frame, bundle, segments, tame),
                        None => Lines::of_pencil(&self.frame, bundle, g),
                    };
                    if tame & !lines.fit != 0 {
                        return false;
                    }
                    let lanes = Mask::from_bits(tame);
                    (self.of[g].s, self.of[g].t, self.of[g].slowness) = (lines.s, lines.t, lines.slowness);
                    if bundle.shared != Shared::Start {
                        self.of[g].start = map3(lines.start, |x| x * V::splat(self.frame.scale));
                    }
                    let ends = [lines.s, lines.t, -lines.s, -lines.t];
                    self.ends[i] = quarters(ends.map(|end| select(lanes, end, most)));
                    self.of[g].inv_lo = select(lanes, bounded(lines.far), most);
                    live |= 1 << g;
                    whole |= u64::from(lines.whole) << g;
                    if EXACT || !lines.whole {
                        near = select(lanes, lines.near, most).fast_min(near);
                        self.of[g].inv_hi = select(lanes, if EXACT { lines.far } else { lines.near }, most);
                    }
                    if ANY {
                        reach = select(lanes, lines.reach, reach).fast_max(reach);
                    }
                    if matches!(bundle.shared, Shared::Behind | Shared::Along) {
                        self.behind[g] = lines.behind;
                    }
                    if bundle.shared == Shared::Behind {
                        front = select(lanes, lines.behind / lines.slowness, front).fast_min(front);
                    }
                }
                self.surround(q);
                let [whole, live] = [whole, live].map(|groups: u64| (groups >> (q * SET)) as u32 & 0xffff);
                match !EXACT && bundle.shared == Shared::Start && whole == 0xffff {
                    true => self.least[q] = select(Mask::from_bits(live), V::constant(0.0), most),
                    false => self.look_far(q),
                }
            }
        }
        if ANY && bundle.presumed && !bundle.confirm(&look) {
            return false;
        }
        let of_sets = [0, 1].map(|axis| {
            let [lo, hi] = &self.rect[axis];
            let side = |end: &dyn Fn(usize) -> f32| std::array::from_fn::<f32, SETS, _>(|q| end(q.min(N - 1)));
            [side(&|q| least(lo[q])), side(&|q| greatest(hi[q]))]
        });
        self.bounds = of_sets.map(|[lo, hi]| {
            [lo.into_iter().fold(f32::INFINITY, f32::min), hi.into_iter().fold(f32::NEG_INFINITY, f32::max)]
        });
        self.of_sets = of_sets.map(|sides| sides.map(|side| V::new(std::array::from_fn(|i| side[i % SETS]))));
        self.wide = self.bounds.iter().flatten().fold(0.0, |w, x| x.abs().max(w));
        if self.wide >= WIDEST {
            return false;
        }
        self.even = if full { Even::of::<N>(self) } else { None };
        self.full = full && bundle.shared == Shared::Start;
        for axis in 0..2 {
            let [lo, hi] = self.bounds[axis];
            let scale = V::splat(if hi > lo { 1.0 / (hi - lo) } else { 0.0 });
            for side in 0..2 {
                for q in 0..N {
                    self.part[axis][side][q] = (self.rect[axis][side][q] - V::splat(lo)) * scale;
                }
            }
        }
        let full =
            full || bundle.shared == Shared::Against && bundle.tame[..N * SET].iter().all(|lanes| *lanes == V::ALL);
        self.starts = (full && ANY && bundle.shared != Shared::Start).then(|| Starts::of(&self.of[..N * SET]));
        self.endless = whole == all;
        self.ends_early = least(near) < f32::INFINITY;
        if self.ends_early && !EXACT {
            listing::groups(whole).for_each(|g| self.of[g].inv_hi = most);
        }
        self.slack = (bundle.slack + 8.0 * HALF_ULP * greatest(reach)) * self.frame.scale;
        if bundle.shared.is_direction() && greatest(reach) > parallel::FAR * self.frame.extent {
            return false;
        }
        self.is_behind = matches!(bundle.shared, Shared::Behind | Shared::Along);
        self.room = if EXACT { None } else { Room::of::<N>(self, bundle, groups) };
        (self.front, self.loose) = (0.0, 32.0 * HALF_ULP * (1.0 + self.wide));
        if bundle.shared == Shared::Behind {
            let front = least(front);
            self.loose += 4.0 * self.slack / front;
            if !(0.0..=MOST_LOOSE).contains(&self.loose) {
                return false;
            }
            self.front = front * (1.0 - self.loose);
        }
        self.reach = 1.0;
        if EXACT || bundle.shared != Shared::Start {
            self.loosen::<N, ANY, EXACT>(near);
        }
        self.settle::<N>();
        true
    }

    /// Rectangles around the groups of a set by their [`Self::ends`].
    #[inline(always)]
    pub fn surround(&mut self, q: usize) {
        let [low_s, low_t, high_s, high_t] = quarter_minima(&self.ends);
        [self.rect[0][0][q], self.rect[0][1][q]] = [low_s, -high_s];
        [self.rect[1][0][q], self.rect[1][1][q]] = [low_t, -high_t];
    }

    /// How far a group's rays have gone from the common point, in their parameter, where that is `t`. Never minus zero, which a
    /// corner at the common point gives, and whose reciprocal would lie behind all.
    #[inline(always)]
    pub fn way(&self, g: usize, t: V) -> V {
        let from = if self.is_behind { self.behind[g] } else { V::constant(0.0) };
        t + from
    }

    /// What weights of hits at 1/z = `inverse` are kept in units of: where rays have a point in common they are linear only times 1/z.
    #[inline(always)]
    pub fn unit(&self, inverse: V) -> V {
        if self.frame.parallel.is_some() { V::constant(1.0) } else { inverse }
    }

    /// The smallest values of some linear functions over the tile's rectangle.
    #[inline(always)]
    pub fn smallest(&self, f: &Lanes3<V>) -> V {
        let zero = V::constant(0.0);
        let [[s0, s1], [t0, t1]] = splats(&self.bounds);
        let (s, t) = (select(f[0].cmp_lt(zero), s1, s0), select(f[1].cmp_lt(zero), t1, t0));
        f[0].mul_add(s, f[1].mul_add(t, f[2]))
    }
}

/// The ends of two intervals in all lanes.
#[inline(always)]
pub fn splats(bounds: &[[f32; 2]; 2]) -> [[V; 2]; 2] {
    let [[s0, s1], [t0, t1]] = *bounds;
    [[V::splat(s0), V::splat(s1)], [V::splat(t0), V::splat(t1)]]
}

/// Infinite bounds become the largest number: the lane still wants to hear of hits at zero distance.
#[inline(always)]
pub fn bounded(inv_lo: V) -> V {
    let infinite = V::splat(f32::INFINITY).cmp_le(inv_lo);
    select(infinite, V::splat(f32::MAX), inv_lo)
}
