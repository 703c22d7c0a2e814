//! Rays in memory as tiles read them: a group at a time, asked for long before.
//!
//! A group is a line of the cache in each of eight columns, and a core waits for a few dozen lines at most at once. So a block's
//! rays would be waited for if they were asked for while they are read; they are asked for while the tile before them goes through
//! the tree, which itself asks for little: not while its answers are written, since these wait for the memory, too.

use std::cell::Cell;

use super::{GROUPS, SET, SETS, V};
use crate::lanes::words::prefetch_for_later;
use crate::lanes::{Column, Lanes, Lanes3};
use crate::ray::{Packet, Rays};

/// Groups between the one that is read and the one the memory is asked for.
pub const AHEAD: usize = 16;

/// Groups of the next block that the memory is asked for at each step of a tile's way.
const AT_ONCE: usize = 4;

/// The rays of a group and their ends.
#[derive(Clone, Copy, Debug)]
pub struct Segments {
    /// Origins.
    pub org: Lanes3<V>,
    /// Directions.
    pub dir: Lanes3<V>,
    /// Parameters of their starts.
    pub t_min: V,
    /// Parameters of their ends.
    pub t_max: V,
}

/// Rays in memory, by groups: as many of all eight columns, so that one look at a group's number does for all.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    org: Lanes3<&'a [V]>,
    dir: Lanes3<&'a [V]>,
    t_min: &'a [V],
    t_max: &'a [V],
}

impl<'a> Columns<'a> {
    /// Of a batch.
    #[inline(always)]
    pub fn of(rays: &'a Rays<f32>) -> Self {
        let count = rays.padded_len() / V::N;
        let groups = |column: &'a Column<f32>| &column.vectors()[..count];
        let ([x, y, z], [dx, dy, dz]) = (&rays.org, &rays.dir);
        Self {
            org: [groups(x), groups(y), groups(z)],
            dir: [groups(dx), groups(dy), groups(dz)],
            t_min: groups(&rays.t_min),
            t_max: groups(&rays.t_max),
        }
    }

    /// Group `i` of the batch.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Segments {
        let Self { org: [x, y, z], dir: [dx, dy, dz], t_min, t_max } = *self;
        Segments { org: [x[i], y[i], z[i]], dir: [dx[i], dy[i], dz[i]], t_min: t_min[i], t_max: t_max[i] }
    }

    /// Asks the memory for group `i`.
    #[inline(always)]
    pub fn prefetch(&self, i: usize) {
        let Self { org: [x, y, z], dir: [dx, dy, dz], t_min, t_max } = *self;
        for column in [x, y, z, dx, dy, dz, t_min, t_max] {
            prefetch_for_later(column, i);
        }
    }

    /// The same unless it was asked for already, as all groups before `asked` were.
    #[inline(always)]
    pub fn prefetch_from(&self, asked: usize, i: usize) {
        if i >= asked {
            self.prefetch(i);
        }
    }
}

/// The rays that come after those of a tile: the memory is asked for them while the tile is traced, a few groups at a time.
#[derive(Debug)]
pub struct Next<'a> {
    columns: Columns<'a>,
    /// The group that is asked for next.
    group: Cell<usize>,
    /// Those from here on are for later tiles to ask for.
    end: usize,
}

impl<'a> Next<'a> {
    /// A block of `rays` from ray `first` on.
    #[inline(always)]
    pub fn of(rays: &'a Rays<f32>, first: usize) -> Self {
        let group = first / V::N;
        Self { columns: Columns::of(rays), group: Cell::new(group), end: group + GROUPS }
    }

    /// How far the memory was asked: the number of the next group.
    #[inline(always)]
    pub fn asked(&self) -> usize {
        self.group.get()
    }

    /// Asks for those of the sample that the block's frame is made of and that were not asked for yet.
    #[inline(always)]
    pub fn ask_sample(&self) {
        let (asked, first) = (self.group.get(), self.end - GROUPS);
        if asked < self.end && asked < self.columns.t_min.len() {
            let not_yet = (asked - first).div_ceil(SETS);
            (not_yet..SET).for_each(|k| self.columns.prefetch(first + SETS * k));
        }
    }

    /// Asks for the next few.
    #[inline(always)]
    pub fn ask(&self) {
        let group = self.group.get();
        if group < self.end {
            (group..group + AT_ONCE).for_each(|i| self.columns.prefetch(i));
            self.group.set(group + AT_ONCE);
        }
    }
}

/// Asks the memory for what is looked at first: the first groups, and the sample that the first block's frame is made of. Not where
/// the first rays have no segment: so have most that follow them, then, and of such only the ends are read.
pub fn prefetch_first(rays: &Rays<f32>) {
    if rays.is_empty() || !Packet::<V>::has_segment(rays, 0) {
        return;
    }
    let columns = Columns::of(rays);
    (0..AHEAD).for_each(|g| columns.prefetch(g));
    (0..SET).for_each(|k| columns.prefetch(SETS * k));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(count: usize) -> Rays<f32> {
        let mut rays = Rays::new(count);
        for i in 0..count {
            let x = 8.0 * i as f32;
            rays.set(i, [x, x + 1.0, x + 2.0], [x + 3.0, x + 4.0, x + 5.0], x + 6.0, x + 7.0);
        }
        rays
    }

    #[test]
    fn groups_are_the_rays_of_a_batch() {
        let rays = rays(40);
        for i in 0..3 {
            let Segments { org: [x, y, z], dir: [dx, dy, dz], t_min, t_max } = Columns::of(&rays).get(i);
            let columns = [x, y, z, dx, dy, dz, t_min, t_max].map(V::to_array);
            for (lane, ray) in (16 * i..16 * i + 16).enumerate() {
                let (org, dir) = (rays.org(ray), rays.dir(ray));
                let want = [org[0], org[1], org[2], dir[0], dir[1], dir[2], rays.t_min[ray], rays.t_max[ray]];
                assert_eq!(columns.map(|column| column[lane]), want, "ray {ray}");
            }
        }
        // Dead rays of an earlier use of the memory are none of the batch.
        let mut shorter = rays;
        shorter.reset(20);
        assert!(std::panic::catch_unwind(|| Columns::of(&shorter).get(2)).is_err());
    }

    #[test]
    fn one_block_is_asked_for_and_no_more() {
        let rays = rays(100);
        for first in [0, 64, 96, 4096] {
            let next = Next::of(&rays, first);
            (0..2 * GROUPS).for_each(|_| next.ask());
            assert_eq!(next.group.get(), first / V::N + GROUPS);
        }
    }
}
