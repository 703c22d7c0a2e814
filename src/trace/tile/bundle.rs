//! What the rays of a block have in common: the point they start from, or (any-hit) the point they end in.

use super::columns::{AHEAD, Columns, Segments};
use super::{GROUPS, HALF_ULP, Mask, SET, V};
use crate::lanes::words::greatest;
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, each, map3};
use crate::ray::{Packet, Pencil, Rays};

/// Directions and coordinates the tile's arithmetic is made for. Rays outside are left to the packet kernel.
pub const TAME: (f32, f32) = (1e-15, 1e15);

/// Where rays go from and to, seen from the point they share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shared {
    /// They start in it.
    Start,
    /// They pass through it at this parameter, where their segments end or a little after.
    End(At),
    /// They pass through it before they start.
    Behind,
    /// There is none: they go where the tile looks, all in one direction ([`super::parallel`]).
    Along,
    /// Any-hit: they go to where the tile is seen from, all in one direction.
    Against,
}

impl Shared {
    /// Whether rays have a direction in common instead of a point.
    #[inline(always)]
    pub fn is_direction(self) -> bool {
        matches!(self, Self::Along | Self::Against)
    }
}

/// Parameter of a common end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// `t = t_max`.
    Limit,
    /// `t = 1`: the direction is the way to the end.
    One,
}

/// Where rays come from.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a> {
    /// They are in memory.
    Batch(&'a Rays<f32>),
    /// They are made here, and their places counted from those of the ray in the middle.
    Pencil(&'a Pencil, [f64; 2]),
}

/// Rays `first..first + 16 * groups` and their common point.
#[derive(Debug)]
pub struct Bundle<'a> {
    /// The rays.
    pub source: Source<'a>,
    /// First ray.
    pub first: usize,
    /// The common point; of rays of one direction some point among their lines.
    pub apex: [f32; 3],
    /// No ray's line passes the common point at more than this distance (before the rounding of differences).
    pub slack: f32,
    /// Start or end.
    pub shared: Shared,
    /// That they are tame and of the common point is still to be seen ([`super::presumed`]).
    pub presumed: bool,
    /// Groups of 16 rays.
    pub len: usize,
    /// Per group: lanes that are traced from the apex.
    pub tame: [u32; GROUPS],
    /// Lanes that are live, but for the packet kernel.
    pub odd: [u32; GROUPS],
}

/// Rays of pencils go at most this far to the side per unit of distance, by each axis: the frame of such a tile has the
/// pencil's depth axis, and coordinates across it that follow the tile.
const MOST_SHEAR: f64 = 2.0;

/// Loads a vector of each of three arrays.
#[inline(always)]
pub fn load3(arrays: &[Column<f32>; 3], at: usize) -> Lanes3<V> {
    [V::load(&arrays[0][at..]), V::load(&arrays[1][at..]), V::load(&arrays[2][at..])]
}

/// The largest component of each vector, absolute.
#[inline(always)]
pub fn largest(v: Lanes3<V>) -> V {
    v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs())
}

/// Sum of absolute components.
#[inline(always)]
pub fn sum(v: Lanes3<V>) -> V {
    v[0].abs() + v[1].abs() + v[2].abs()
}

/// Number of groups of 16 in the `N` sets that start with ray `first`.
#[inline(always)]
pub fn groups<const N: usize>(rays: &Rays<f32>, first: usize) -> usize {
    (rays.padded_len() - first).min(N * SET * V::N) / V::N
}

impl<'a> Bundle<'a> {
    /// Looks at `N` sets of rays; `None` if they have no point in common. `any`: a common end will do.
    #[inline(always)]
    pub fn find<const N: usize>(rays: &'a Rays<f32>, first: usize, any: bool) -> Option<Self> {
        // Most rays without a common point show it within the first group.
        if Self::is_scattered(rays, first, any) {
            return None;
        }
        let mut bundle = Self::unsorted(rays, first, groups::<N>(rays, first));
        bundle.sort_lanes(rays);
        bundle.share(rays, any).then_some(bundle)
    }

    /// Whether the rays of the group that starts with ray `first` have no point in common.
    #[inline(never)]
    pub fn is_scattered(rays: &'a Rays<f32>, first: usize, any: bool) -> bool {
        let mut group = Self::unsorted(rays, first, 1);
        group.sort_group(rays, 0);
        group.tame[0] != 0 && !group.share(rays, any)
    }

    /// Groups of rays, nothing known of them.
    pub fn unsorted(rays: &'a Rays<f32>, first: usize, len: usize) -> Self {
        Self {
            source: Source::Batch(rays),
            first,
            apex: [0.0; 3],
            slack: 0.0,
            shared: Shared::Start,
            presumed: false,
            len,
            tame: [0; GROUPS],
            odd: [0; GROUPS],
        }
    }

    /// The rays of a pencil, or `None` if they go too far to the side of its axes.
    pub fn of_pencil(pencil: &'a Pencil) -> Option<Self> {
        let len = pencil.live.len();
        if len == 0 || len > GROUPS {
            return None;
        }
        let (first, last) = (pencil.places.of_block(0), pencil.places.of_block(len - 1));
        let middle = [0, 1].map(|axis| 0.5 * (first[axis][0] + last[axis][15]));
        let apex = pencil.origin.map(|x| x as f32);
        let is_tame = apex.iter().all(|x| x.abs() <= TAME.1) && middle.iter().all(|x| x.abs() <= MOST_SHEAR);
        let mut tame = [0; GROUPS];
        tame.iter_mut().zip(&pencil.live).for_each(|(tame, live)| *tame = u32::from(*live));
        let source = Source::Pencil(pencil, middle);
        let shared = Shared::Start;
        let odd = [0; GROUPS];
        let bundle = Self { source, first: 0, apex, slack: 0.0, shared, presumed: false, len, tame, odd };
        is_tame.then_some(bundle)
    }

    /// Finds the common point of the groups; whether there is one.
    #[inline(always)]
    pub fn share(&mut self, rays: &Rays<f32>, any: bool) -> bool {
        let Some(leader) = (0..self.len).find(|&g| self.tame[g] != 0) else { return false };
        let leader = self.first + leader * V::N + self.tame[leader].trailing_zeros() as usize;
        self.apex = rays.org(leader);
        if self.starts_in_apex(rays) {
            return true;
        }
        let ends = if any { [At::One, At::Limit].as_slice() } else { &[] };
        let end = ends.iter().find_map(|&at| Some((self.common_end(rays, at, leader)?, at)));
        let Some(((apex, slack), at)) = end else { return false };
        (self.apex, self.slack, self.shared) = (apex, slack, Shared::End(at));
        true
    }

    /// Groups with a lane that is traced from the apex.
    pub fn groups(&self) -> u64 {
        (0..self.len).fold(0, |mask, g| mask | u64::from(self.tame[g] != 0) << g)
    }

    /// The rays of set `q` as a bundle of their own.
    pub fn set(&self, q: usize) -> Self {
        let at = q * SET;
        let (mut tame, mut odd) = ([0; GROUPS], [0; GROUPS]);
        tame[..SET].copy_from_slice(&self.tame[at..at + SET]);
        odd[..SET].copy_from_slice(&self.odd[at..at + SET]);
        let len = self.len.saturating_sub(at).min(SET);
        Self { first: self.first + at * V::N, len, tame, odd, ..*self }
    }

    /// The rays of a group and their ends.
    #[inline(always)]
    pub fn packet(&self, g: usize) -> (Packet<V>, V) {
        let Segments { org, dir, t_min, t_max } = self.segments(g);
        (Packet::new(org, dir, t_min), t_max)
    }

    /// The same as they are.
    #[inline(always)]
    pub fn segments(&self, g: usize) -> Segments {
        let i = self.first / V::N + g;
        match self.source {
            Source::Batch(rays) => Columns::of(rays).get(i),
            Source::Pencil(pencil, _) => self.aimed(pencil.directions(i).map(V::new)),
        }
    }

    /// Rays of a pencil in the directions `dir`.
    #[inline(always)]
    pub fn aimed(&self, dir: Lanes3<V>) -> Segments {
        Segments { org: map3(self.apex, V::splat), dir, t_min: V::constant(0.0), t_max: V::splat(f32::INFINITY) }
    }

    /// Parameters of the two ends of a group's segments.
    #[inline(always)]
    pub fn ends(&self, g: usize) -> [V; 2] {
        let at = self.first + g * V::N;
        match self.source {
            Source::Batch(rays) => [V::load(&rays.t_min[at..]), V::load(&rays.t_max[at..])],
            Source::Pencil(..) => [V::constant(0.0), V::splat(f32::INFINITY)],
        }
    }

    /// The way from the common point that the rays of a group go.
    #[inline(always)]
    pub fn ways(&self, g: usize) -> Lanes3<V> {
        let at = self.first + g * V::N;
        match (self.source, self.shared) {
            (Source::Batch(rays), Shared::Start | Shared::Behind | Shared::Along) => load3(&rays.dir, at),
            (Source::Batch(rays), Shared::End(_) | Shared::Against) => {
                let org = load3(&rays.org, at);
                each(|a| org[a] - V::splat(self.apex[a]))
            }
            (Source::Pencil(pencil, _), _) => {
                let [a, b] = pencil.places.around(at / V::N, [0.0; 2]);
                let (a, b) = (V::new(a), V::new(b));
                let axes = map3(pencil.axes, |axis| map3(axis, |x| V::splat(x as f32)));
                each(|x| a.mul_add(axes[0][x], b.mul_add(axes[1][x], axes[2][x])))
            }
        }
    }

    /// The way of one of the `rays` in memory.
    #[inline(always)]
    pub fn way(&self, rays: &Rays<f32>, g: usize, lane: usize) -> [f32; 3] {
        let ray = self.first + g * V::N + lane;
        match self.shared {
            Shared::Start | Shared::Behind => rays.dir(ray),
            Shared::End(_) | Shared::Along | Shared::Against => each(|a| rays.org[a][ray] - self.apex[a]),
        }
    }

    #[inline(always)]
    pub fn sort_lanes(&mut self, rays: &Rays<f32>) {
        let columns = Columns::of(rays);
        for g in 0..self.len {
            columns.prefetch(self.first / V::N + g + AHEAD);
            self.sort_group(rays, g);
        }
    }

    /// Tells the tame and odd lanes of a group.
    #[inline(always)]
    pub fn sort_group(&mut self, rays: &Rays<f32>, g: usize) {
        let (least, most) = (V::splat(TAME.0), V::splat(TAME.1));
        let finite = |v: Lanes3<V>| v[0].abs().cmp_le(most) & v[1].abs().cmp_le(most) & v[2].abs().cmp_le(most);
        let at = self.first + g * V::N;
        let (org, dir) = (load3(&rays.org, at), load3(&rays.dir, at));
        let (t_min, t_max) = (V::load(&rays.t_min[at..]), V::load(&rays.t_max[at..]));
        let tame = finite(org)
            & finite(dir)
            & least.cmp_le(largest(dir))
            & V::constant(0.0).cmp_le(t_min)
            & t_min.cmp_le(t_max);
        self.tame[g] = tame.bits();
        if self.tame[g] != V::ALL {
            self.odd[g] = Packet::<V>::load(rays, at).2 & !self.tame[g];
        }
    }

    #[inline(always)]
    fn starts_in_apex(&self, rays: &Rays<f32>) -> bool {
        let apex = map3(self.apex, V::splat);
        (0..self.len).all(|g| {
            let org = load3(&rays.org, self.first + g * V::N);
            let same = org[0].cmp_eq(apex[0]) & org[1].cmp_eq(apex[1]) & org[2].cmp_eq(apex[2]);
            self.tame[g] & !same.bits() == 0
        })
    }

    /// Where ray `leader` ends, and how far the others pass it, if that can be rounding.
    fn common_end(&self, rays: &Rays<f32>, at: At, leader: usize) -> Option<([f32; 3], f32)> {
        let parameter = match at {
            At::One => 1.0,
            At::Limit => rays.t_max[leader],
        };
        let (org, dir) = (rays.org(leader), rays.dir(leader));
        let apex = each(|a| dir[a] * parameter + org[a]);
        let (mut passing, mut fits) = (Passing::default(), true);
        for g in 0..self.len {
            let first = self.first + g * V::N;
            let t_max = V::load(&rays.t_max[first..]);
            fits &= self.tame[g] & !at.is_usable(t_max).bits() == 0;
            let lines = [load3(&rays.org, first), load3(&rays.dir, first)];
            passing.add(at, apex, lines, t_max, Mask::from_bits(self.tame[g]));
        }
        passing.slack(apex).filter(|_| fits).map(|slack| (apex, slack))
    }
}

impl At {
    /// Rays whose end, by their `t_max`, may be a common one.
    #[inline(always)]
    pub fn is_usable(self, t_max: V) -> Mask {
        match self {
            Self::One => t_max.cmp_le(V::constant(1.0)),
            Self::Limit => t_max.cmp_le(V::splat(TAME.1)) & V::splat(TAME.0).cmp_le(t_max),
        }
    }
}

/// How far rays pass a common end.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// Sums over the axes, the largest by lane.
    apart: V,
    /// Largest coordinates of their origins.
    size: V,
}

impl Default for Passing {
    fn default() -> Self {
        Self { apart: V::constant(0.0), size: V::constant(0.0) }
    }
}

impl Passing {
    /// Adds some lanes of a vector of rays.
    #[inline(always)]
    pub fn add(&mut self, at: At, apex: [f32; 3], [org, dir]: [Lanes3<V>; 2], t_max: V, lanes: Mask) {
        let t = match at {
            At::One => V::constant(1.0),
            At::Limit => t_max,
        };
        // Differences first: the sum would hide what it rounds away.
        let miss = each(|a| dir[a].mul_add(t, org[a] - V::splat(apex[a])));
        self.take(sum(miss).kept(lanes), largest(org).kept(lanes));
    }

    /// Adds what vectors of rays miss the end by, and the largest coordinates of their origins.
    #[inline(always)]
    pub fn take(&mut self, miss: V, size: V) {
        (self.apart, self.size) = (miss.fast_max(self.apart), size.fast_max(self.size));
    }

    /// How far all pass at most, if that can be rounding: at most 64 half ulps of the largest coordinate.
    #[inline(always)]
    pub fn slack(&self, apex: [f32; 3]) -> Option<f32> {
        let size = apex.iter().fold(greatest(self.size), |m, x| x.abs().max(m));
        let apart = greatest(self.apart);
        (apart <= 64.0 * HALF_ULP * size).then_some(apart)
    }
}
