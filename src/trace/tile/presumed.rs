//! Blocks that seem to have a point in common: their first group with a live ray says which, and who loads the others looks
//! at them then. So rays are read from memory once.

use super::bundle::{Bundle, Passing, Shared, Source, TAME, groups, sum};
use super::columns::Segments;
use super::{GROUPS, SETS, V};
use crate::lanes::{LaneMask, Lanes, each};
use crate::ray::{Packet, Rays};

/// What the first group with a live ray says of a block.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "made and used up at once, a few per thousand rays")]
pub enum First<'a> {
    /// Its rays have this point in common; that the others have it, too, is presumed.
    Shared(Bundle<'a>),
    /// They have none, and so neither have those of the block or of a set of it, most probably.
    Scattered,
    /// They have none, but one direction.
    Parallel,
    /// Nothing for all: some are for the packet kernel.
    Mixed,
    /// There is no such group.
    Dead,
}

/// What loading a presumed bundle tells of its rays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Look(pub Passing);

impl<'a> First<'a> {
    /// Looks at the block that starts with ray `first`. `any`: a common end will do.
    #[inline(never)]
    pub fn of(rays: &'a Rays<f32>, first: usize, any: bool) -> Self {
        let len = groups::<SETS>(rays, first);
        for g in (0..len).filter(|g| Packet::<V>::has_segment(rays, first + g * V::N)) {
            let mut group = Bundle::unsorted(rays, first + g * V::N, 1);
            group.sort_group(rays, 0);
            let [tame, odd] = [group.tame[0], group.odd[0]];
            if tame | odd == 0 {
                continue;
            }
            if tame != 0 && !group.share(rays, any) {
                return if group.is_of_one_direction(rays) { Self::Parallel } else { Self::Scattered };
            }
            if odd != 0 {
                return Self::Mixed;
            }
            let mut tame = [0; GROUPS];
            tame[..len].fill(V::ALL);
            return Self::Shared(Bundle { first, len, tame, presumed: true, ..group });
        }
        Self::Dead
    }
}

impl Bundle<'_> {
    /// Lanes of a group of a presumed bundle that are tame and, as far as one group tells, of the common point; `None` if another
    /// lane is live. `segments`: its rays. `ANY`: the point may be an end.
    #[inline(always)]
    pub fn look<const ANY: bool>(&self, g: usize, segments: &Segments, look: &mut Look) -> Option<u32> {
        let Source::Batch(rays) = self.source else { return Some(self.tame[g]) };
        let Segments { org, dir, t_min, t_max } = *segments;
        let (size, least, most) = (sum(dir), V::splat(3.0 * TAME.0), V::splat(TAME.1));
        let mut lanes = least.cmp_le(size) & size.cmp_le(most) & V::constant(0.0).cmp_le(t_min) & t_min.cmp_le(t_max);
        match self.shared {
            Shared::End(end) if ANY => {
                // A sum, as no maximum shows a NaN.
                lanes = lanes & end.is_usable(t_max) & sum(org).cmp_le(most);
                look.0.add(end, self.apex, [org, dir], t_max, lanes);
            }
            _ => {
                let [x, y, z] = each(|a| org[a].cmp_eq(V::splat(self.apex[a])));
                lanes = lanes & x & y & z;
            }
        }
        let lanes = lanes.bits();
        let is_whole = lanes == V::ALL || Packet::<V>::read(rays, self.first + g * V::N).2 & !lanes == 0;
        is_whole.then_some(lanes)
    }

    /// Lanes of a group for its mean direction: of a presumed bundle those that have a segment.
    #[inline(always)]
    pub fn live(&self, rays: &Rays<f32>, g: usize) -> u32 {
        if !self.presumed || self.tame[g] == 0 {
            return self.tame[g];
        }
        let at = self.first + g * V::N;
        V::load(&rays.t_min[at..]).cmp_le(V::load(&rays.t_max[at..])).bits() & self.tame[g]
    }

    /// Ends a [`Look`] at all groups: whether the point is a common one indeed.
    #[inline(always)]
    pub fn confirm(&mut self, look: &Look) -> bool {
        let Shared::End(_) = self.shared else { return true };
        let Some(slack) = look.0.slack(self.apex) else { return false };
        self.slack = slack;
        true
    }
}
