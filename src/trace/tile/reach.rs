//! How far the groups of a tile look: to the ends of their segments, or to what they found.

use super::groups::Groups;
use super::{GROUPS, HALF_ULP, SET, SETS, V, listing};
use crate::lanes::minima::row_minima_of;
use crate::lanes::words::least;
use crate::lanes::{LaneMask, Lanes};

/// Up to so many changed groups are looked at one by one, and whole sets from there on.
const FEW: u32 = 8;

impl Groups {
    /// The ends of the segments, moved apart by what rounding may have done to them.
    #[inline(always)]
    pub fn loosen<const N: usize, const ANY: bool, const EXACT: bool>(&mut self, near: V) {
        let loose = self.loose;
        let (less, more) = (V::splat(1.0 - loose), V::splat(1.0 + loose));
        if ANY && !EXACT {
            // How far a segment goes is told by its start: only whether a box is within reach is left to its depth.
            self.reach = 1.0 - loose;
        } else {
            self.of[..N * SET].iter_mut().for_each(|group| group.inv_lo *= less);
        }
        if EXACT || self.ends_early {
            self.of[..N * SET].iter_mut().for_each(|group| group.inv_hi *= more);
        }
        self.least.iter_mut().for_each(|least| *least *= less);
        self.cap = least(near) * (1.0 - loose);
    }

    /// Which of a group's `lanes` found something (any-hit): those that want nothing any more.
    #[inline(always)]
    pub fn done(&self, g: usize, lanes: u32) -> u32 {
        V::splat(f32::INFINITY).cmp_le(self.of[g].inv_lo).bits() & lanes
    }

    /// Brings the depths of the `changed` groups up to date.
    #[inline(always)]
    pub fn refresh<const N: usize>(&mut self, changed: u64) {
        if changed.count_ones() <= FEW {
            for g in listing::groups(changed) {
                let near = least(self.of[g].inv_lo) * self.reach;
                bytemuck::cast_mut::<[V; SETS], [f32; GROUPS]>(&mut self.least)[g] = near;
            }
            return self.settle::<N>();
        }
        for q in (0..N).filter(|q| N == 1 || changed >> (q * SET) & 0xffff != 0) {
            self.look_far(q);
            self.least[q] *= V::splat(self.reach);
        }
        self.settle::<N>();
    }

    /// How far the groups of a set look, by the ends of their rays' segments or what these found.
    #[inline(always)]
    pub fn look_far(&mut self, q: usize) {
        if let Some(of) = self.of[q * SET..].first_chunk::<SET>() {
            self.least[q] = row_minima_of(|i| of[i].inv_lo);
        }
    }

    /// How far all groups look, where the least reciprocals are known.
    #[inline(always)]
    pub fn settle<const N: usize>(&mut self) {
        let near = (1..N).fold(self.least[0], |near, q| near.fast_min(self.least[q]));
        self.nearest = least(near);
        // A little farther than the reciprocal, whatever its rounding.
        self.farthest =
            if self.nearest < f32::INFINITY { (1.0 + 4.0 * HALF_ULP) / self.nearest } else { f32::NEG_INFINITY };
    }
}
