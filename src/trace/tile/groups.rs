//! The rays of a tile: 16 groups of 16 (4x4 pixels), each ray as (s, t), its depth as 1/z between two bounds.

use super::bundle::{At, Bundle, Shared, load3};
use super::frame::Frame;
use super::{GROUPS, HALF_ULP, Mask, V, select};
use crate::lanes::words::{least, row_minima};
use crate::lanes::{LaneMask, Lanes, Lanes3};
use crate::math::Aabb;

/// Widest tile: |s| and |t| below this (83 degrees off the axis).
const WIDEST: f32 = 8.0;

/// "No triangle yet".
pub const NO_SLOT: u32 = u32::MAX;

/// The state of a tile. Depths are 1/z: 0 is infinitely far, infinite is a lane that wants nothing any more.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Groups {
    /// First ray coordinate by group.
    pub s: [V; GROUPS],
    /// Second ray coordinate.
    pub t: [V; GROUPS],
    /// The best hit (or the end of the segment) is surely not farther than this. Own answers: it is there.
    pub inv_lo: [V; GROUPS],
    /// The best hit is surely not nearer than this. Own answers: no hit may be nearer than this, the segment's start.
    pub inv_hi: [V; GROUPS],
    /// Triangle of the best hit, as [`super::batch::Batch::id`] has it, or [`NO_SLOT`].
    pub slot: [[u32; 16]; GROUPS],
    /// Own answers: edge functions of the best hit, those of the second and third corner and the sum of all.
    pub weights: [[V; 3]; GROUPS],
    /// Rays with a common end: where their segments start, in the axes of the geometry and
    /// the scale of the frame.
    pub start: [Lanes3<V>; GROUPS],
    /// Some segment ends before the common point.
    pub ends_early: bool,
    /// Depth per unit of the ray's parameter.
    pub speed: [V; GROUPS],
    /// Lanes that found something (any-hit).
    pub done: [u32; GROUPS],
    /// Per group, as lanes: least and greatest s, least and greatest t.
    pub rect: [[V; 2]; 2],
    /// The same as fractions of the tile's rectangle.
    pub part: [[V; 2]; 2],
    /// Per group: least [`Groups::inv_lo`].
    pub least: V,
    /// Per group: farthest depth that is still of interest; minus infinity for none.
    pub far: V,
    /// Farthest of all groups.
    pub farthest: f32,
    /// Least [`Groups::inv_lo`] of all: a triangle that is farther everywhere is of no interest.
    pub nearest: f32,
    /// Rectangle of the whole tile: `[axis][least, greatest]`.
    pub bounds: [[f32; 2]; 2],
    /// Largest |s|, |t| of the tile.
    pub wide: f32,
    /// Surely no hit is nearer than 1 / this (start of the segments).
    pub cap: f32,
    /// How far hits may be from where the tile's arithmetic puts them, on top of what grows with distance; scaled.
    pub slack: f32,
    /// The frame.
    pub frame: Frame,
}

impl Default for Groups {
    fn default() -> Self {
        let zero = [V::splat(0.0); GROUPS];
        Self {
            s: zero,
            t: zero,
            inv_lo: zero,
            inv_hi: zero,
            slot: [[NO_SLOT; 16]; GROUPS],
            weights: [[zero[0]; 3]; GROUPS],
            start: [[zero[0]; 3]; GROUPS],
            ends_early: false,
            speed: zero,
            done: [0; GROUPS],
            rect: [[zero[0]; 2]; 2],
            part: [[zero[0]; 2]; 2],
            least: zero[0],
            far: zero[0],
            farthest: 0.0,
            nearest: 0.0,
            bounds: [[0.0; 2]; 2],
            wide: 0.0,
            cap: 0.0,
            slack: 0.0,
            frame: Frame::default(),
        }
    }
}

/// One group's rays in the frame.
struct Lines {
    s: V,
    t: V,
    /// Depth per unit of t (common start) or at t = 0 (common end).
    speed: V,
    /// 1/z at the far end of the segment.
    far: V,
    /// 1/z at its near end.
    near: V,
    /// Lanes that the tile's arithmetic can take.
    fit: u32,
    /// Distance from the common end (0 for a common start).
    reach: V,
}

impl Groups {
    /// Takes in some groups of a bundle. False if they spread too wide for one frame (nothing is traced then).
    #[inline(always)]
    pub fn load<const EXACT: bool>(&mut self, bundle: &Bundle, groups: u32, scene: &Aabb<f32>) -> bool {
        let Some(frame) = Frame::of(bundle, groups, scene) else { return false };
        self.frame = frame;
        let most = V::splat(f32::INFINITY);
        let mut lows = [[most; GROUPS]; 2];
        // Greatest values as least negatives: one kind of shuffle tree does both.
        let mut highs = [[most; GROUPS]; 2];
        let (mut near, mut reach) = (most, V::splat(0.0));
        for g in 0..GROUPS {
            self.slot[g] = [NO_SLOT; 16];
            self.done[g] = 0;
            if groups >> g & 1 == 0 || bundle.tame[g] == 0 {
                (self.inv_lo[g], self.inv_hi[g]) = (most, most);
                continue;
            }
            let lines = self.lines(bundle, g);
            let tame = bundle.tame[g];
            if tame & !lines.fit != 0 {
                return false;
            }
            let lanes = Mask::from_bits(tame);
            (self.s[g], self.t[g], self.speed[g]) = (lines.s, lines.t, lines.speed);
            if bundle.shared != Shared::Start {
                self.start[g] = bundle.starts(g).map(|x| x * V::splat(self.frame.scale));
            }
            lows[0][g] = select(lanes, lines.s, most);
            lows[1][g] = select(lanes, lines.t, most);
            highs[0][g] = select(lanes, -lines.s, most);
            highs[1][g] = select(lanes, -lines.t, most);
            near = select(lanes, lines.near, most).fast_min(near);
            reach = select(lanes, lines.reach, reach).fast_max(reach);
            self.inv_lo[g] = select(lanes, bounded(lines.far), most);
            self.inv_hi[g] = select(lanes, if EXACT { lines.far } else { lines.near }, most);
        }
        self.rect = [0, 1].map(|axis| [row_minima(&lows[axis]), -row_minima(&highs[axis])]);
        self.bounds = self.rect.map(|r| [least(r[0]), greatest(r[1])]);
        self.wide = self.bounds.iter().flatten().fold(0.0, |w, x| x.abs().max(w));
        self.part = [0, 1].map(|axis| {
            let [lo, hi] = self.bounds[axis];
            let scale = V::splat(if hi > lo { 1.0 / (hi - lo) } else { 0.0 });
            self.rect[axis].map(|edge| (edge - V::splat(lo)) * scale)
        });
        self.ends_early = least(near) < f32::INFINITY;
        self.slack = (bundle.slack + 8.0 * HALF_ULP * greatest(reach)) * self.frame.scale;
        if EXACT || bundle.shared != Shared::Start {
            self.loosen(near);
        }
        self.refresh();
        true
    }

    /// The ends of the segments, moved apart by what rounding may have done to them.
    #[inline(always)]
    fn loosen(&mut self, near: V) {
        let loose = self.loose();
        for g in 0..GROUPS {
            self.inv_lo[g] *= V::splat(1.0 - loose);
            self.inv_hi[g] *= V::splat(1.0 + loose);
        }
        self.cap = least(near) * (1.0 - loose);
    }

    /// Relative error of depths computed from a ray's parameter.
    #[inline(always)]
    pub fn loose(&self) -> f32 {
        32.0 * HALF_ULP * (1.0 + self.wide)
    }

    #[inline(always)]
    fn lines(&self, bundle: &Bundle, g: usize) -> Lines {
        let at = bundle.first + g * V::N;
        let (t_min, t_max) = (V::load(&bundle.rays.t_min[at..]), V::load(&bundle.rays.t_max[at..]));
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let direction: Lanes3<V> = match bundle.shared {
            Shared::Start => load3(&bundle.rays.dir, at),
            Shared::End(_) => {
                let org = load3(&bundle.rays.org, at);
                [0, 1, 2].map(|a| org[a] - V::splat(bundle.apex[a]))
            }
        };
        let [x, y, speed] = self.frame.coordinates(direction);
        let slowness = one / speed;
        let (s, t) = (x * slowness, y * slowness);
        let (widest, most) = (V::splat(WIDEST), V::splat(f32::MAX));
        let mut fit = s.abs().cmp_lt(widest) & t.abs().cmp_lt(widest);
        fit = fit & zero.cmp_lt(speed) & zero.cmp_lt(slowness) & slowness.cmp_lt(most);
        let (far, near, reach) = match bundle.shared {
            Shared::Start => (slowness / t_max, slowness / t_min, zero),
            Shared::End(at) => {
                let scale = match at {
                    At::One => one,
                    At::Limit => one / t_max,
                };
                // What is left of the way to the end at the segment's two ends. Subtracting from one is accurate
                // to a few ulps as long as at least a quarter is left.
                let (start, end) = (one - t_min * scale, one - t_max * scale);
                fit = fit & V::constant(0.25).cmp_le(start);
                let size = direction[0].abs().fast_max(direction[1].abs()).fast_max(direction[2].abs());
                (slowness / start, slowness / zero.fast_max(end), size)
            }
        };
        Lines { s, t, speed, far, near, fit: fit.bits(), reach }
    }

    /// The smallest values of some linear functions over the tile's rectangle.
    #[inline(always)]
    pub fn smallest(&self, f: &Lanes3<V>) -> V {
        let zero = V::constant(0.0);
        let [[s0, s1], [t0, t1]] = self.bounds.map(|b| b.map(V::splat));
        let (s, t) = (select(f[0].cmp_lt(zero), s1, s0), select(f[1].cmp_lt(zero), t1, t0));
        f[0].mul_add(s, f[1].mul_add(t, f[2]))
    }

    /// Brings the per-group depths up to date.
    #[inline(always)]
    pub fn refresh(&mut self) {
        let none = V::splat(f32::NEG_INFINITY);
        self.least = row_minima(&self.inv_lo);
        let waiting = self.least.cmp_lt(V::splat(f32::INFINITY));
        // A little farther than the reciprocal, whatever its rounding.
        let far = V::splat(1.0 + 4.0 * HALF_ULP) / self.least;
        self.far = select(waiting, far, none);
        self.farthest = greatest(self.far);
        self.nearest = least(self.least);
    }
}

/// `new` where the mask is set. Numbers are moved as floats: selection copies bits.
#[inline(always)]
pub fn merge(mask: Mask, new: u32, old: [u32; 16]) -> [u32; 16] {
    bytemuck::cast(select(mask, V::splat(f32::from_bits(new)), V::new(bytemuck::cast(old))).to_array())
}

/// Infinite bounds become the largest number: the lane still wants to hear of hits at zero distance.
#[inline(always)]
pub fn bounded(inv_lo: V) -> V {
    let infinite = V::splat(f32::INFINITY).cmp_le(inv_lo);
    select(infinite, V::splat(f32::MAX), inv_lo)
}

#[inline(always)]
fn greatest(v: V) -> f32 {
    -least(-v)
}
