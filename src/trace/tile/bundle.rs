//! What the rays of a block have in common: the point they start from, or (any-hit) the point they end in.

use super::{GROUPS, HALF_ULP, Mask, SET, V, select};
use crate::lanes::words::prefetch;
use crate::lanes::{LaneMask, Lanes, Lanes3, each, map3};
use crate::ray::{Packet, Rays};

/// Directions and coordinates the tile's arithmetic is made for. Rays outside are left to the packet kernel.
const TAME: (f32, f32) = (1e-15, 1e15);

/// Groups between the one that is read (or written) and the one the memory is asked for.
pub const AHEAD: usize = 8;

/// Where rays go from and to, seen from the point they share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shared {
    /// They start in it.
    Start,
    /// They pass through it at this parameter, where their segments end or a little after.
    End(At),
}

/// Parameter of a common end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// `t = t_max`.
    Limit,
    /// `t = 1`: the direction is the way to the end.
    One,
}

/// Rays `first..first + 16 * groups` of a batch and their common point.
#[derive(Debug)]
pub struct Bundle<'a> {
    /// The batch.
    pub rays: &'a Rays<f32>,
    /// First ray.
    pub first: usize,
    /// The common point.
    pub apex: [f32; 3],
    /// No ray's line passes the common point at more than this distance (before the rounding of differences).
    pub slack: f32,
    /// Start or end.
    pub shared: Shared,
    /// Groups of 16 rays.
    pub len: usize,
    /// Per group: lanes that are traced from the apex.
    pub tame: [u32; GROUPS],
    /// Lanes that are live, but for the packet kernel.
    pub odd: [u32; GROUPS],
}

/// Loads a vector of each of three arrays.
#[inline(always)]
pub fn load3(arrays: &[Vec<f32>; 3], at: usize) -> Lanes3<V> {
    [V::load(&arrays[0][at..]), V::load(&arrays[1][at..]), V::load(&arrays[2][at..])]
}

/// Number of groups of 16 in the `N` sets that start with ray `first`.
#[inline(always)]
pub fn groups<const N: usize>(rays: &Rays<f32>, first: usize) -> usize {
    (rays.padded_len() - first).min(N * SET * V::N) / V::N
}

/// Asks the memory for the group of rays that starts with ray `first`.
#[inline(always)]
pub fn prefetch_rays(rays: &Rays<f32>, first: usize) {
    let [x, y, z] = &rays.org;
    let [dx, dy, dz] = &rays.dir;
    for array in [x, y, z, dx, dy, dz, &rays.t_min, &rays.t_max] {
        prefetch(array, first);
    }
}

impl<'a> Bundle<'a> {
    /// Looks at `N` sets of rays; `None` if they have no point in common. `any`: a common end will do.
    #[inline(always)]
    pub fn find<const N: usize>(rays: &'a Rays<f32>, first: usize, any: bool) -> Option<Self> {
        let mut bundle = Self {
            rays,
            first,
            apex: [0.0; 3],
            slack: 0.0,
            shared: Shared::Start,
            len: groups::<N>(rays, first),
            tame: [0; GROUPS],
            odd: [0; GROUPS],
        };
        // Most rays without a common point show it within the first group.
        let len = std::mem::replace(&mut bundle.len, 1);
        bundle.sort_lanes(0);
        if bundle.tame[0] != 0 && !bundle.share(any) {
            return None;
        }
        bundle.len = len;
        bundle.sort_lanes(1);
        bundle.share(any).then_some(bundle)
    }

    /// Finds the common point of the groups; whether there is one.
    #[inline(always)]
    fn share(&mut self, any: bool) -> bool {
        let Some(leader) = (0..self.len).find(|&g| self.tame[g] != 0) else { return false };
        let leader = self.first + leader * V::N + self.tame[leader].trailing_zeros() as usize;
        self.apex = self.rays.org(leader);
        if self.starts_in_apex() {
            return true;
        }
        let ends = if any { [At::One, At::Limit].as_slice() } else { &[] };
        let end = ends.iter().find_map(|&at| Some((self.common_end(at, leader)?, at)));
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

    /// Where the segments of a group start.
    #[inline(always)]
    pub fn starts(&self, g: usize) -> Lanes3<V> {
        let at = self.first + g * V::N;
        let (org, dir) = (load3(&self.rays.org, at), load3(&self.rays.dir, at));
        let t_min = V::load(&self.rays.t_min[at..]);
        each(|a| t_min.mul_add(dir[a], org[a]))
    }

    #[inline(always)]
    fn sort_lanes(&mut self, from: usize) {
        let (least, most) = (V::splat(TAME.0), V::splat(TAME.1));
        let size = |v: Lanes3<V>| v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs());
        let finite = |v: Lanes3<V>| v[0].abs().cmp_le(most) & v[1].abs().cmp_le(most) & v[2].abs().cmp_le(most);
        for g in from..self.len {
            let at = self.first + g * V::N;
            prefetch_rays(self.rays, at + AHEAD * V::N);
            let (org, dir) = (load3(&self.rays.org, at), load3(&self.rays.dir, at));
            let (t_min, t_max) = (V::load(&self.rays.t_min[at..]), V::load(&self.rays.t_max[at..]));
            let tame = finite(org)
                & finite(dir)
                & least.cmp_le(size(dir))
                & V::constant(0.0).cmp_le(t_min)
                & t_min.cmp_le(t_max);
            self.tame[g] = tame.bits();
            if self.tame[g] != V::ALL {
                self.odd[g] = Packet::<V>::load(self.rays, at).2 & !self.tame[g];
            }
        }
    }

    #[inline(always)]
    fn starts_in_apex(&self) -> bool {
        let apex = map3(self.apex, V::splat);
        (0..self.len).all(|g| {
            let org = load3(&self.rays.org, self.first + g * V::N);
            let same = org[0].cmp_eq(apex[0]) & org[1].cmp_eq(apex[1]) & org[2].cmp_eq(apex[2]);
            self.tame[g] & !same.bits() == 0
        })
    }

    /// Where ray `leader` ends, and how far the others pass it, if that can be rounding: at most 64 half ulps of the
    /// largest coordinate.
    fn common_end(&self, at: At, leader: usize) -> Option<([f32; 3], f32)> {
        let parameter = match at {
            At::One => 1.0,
            At::Limit => self.rays.t_max[leader],
        };
        let (org, dir) = (self.rays.org(leader), self.rays.dir(leader));
        let apex = each(|a| dir[a] * parameter + org[a]);
        let (mut apart, mut size, mut fits) = (V::constant(0.0), V::constant(0.0), true);
        for g in 0..self.len {
            let first = self.first + g * V::N;
            let (org, dir) = (load3(&self.rays.org, first), load3(&self.rays.dir, first));
            let t_max = V::load(&self.rays.t_max[first..]);
            let (t, usable) = match at {
                At::One => (V::constant(1.0), t_max.cmp_le(V::constant(1.0))),
                At::Limit => (t_max, t_max.cmp_le(V::splat(TAME.1)) & V::splat(TAME.0).cmp_le(t_max)),
            };
            fits &= self.tame[g] & !usable.bits() == 0;
            let lanes = Mask::from_bits(self.tame[g]);
            // Differences first: the sum would hide what it rounds away.
            let miss = each(|a| dir[a].mul_add(t, org[a] - V::splat(apex[a])).abs());
            let largest = org[0].abs().fast_max(org[1].abs()).fast_max(org[2].abs());
            apart = select(lanes, miss[0] + miss[1] + miss[2], apart).fast_max(apart);
            size = select(lanes, largest, size).fast_max(size);
        }
        let largest = |v: V| v.to_array().into_iter().fold(0.0, f32::max);
        let size = apex.iter().fold(largest(size), |m, x| x.abs().max(m));
        (fits && largest(apart) <= 64.0 * HALF_ULP * size).then_some((apex, largest(apart)))
    }
}
