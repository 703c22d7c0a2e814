//! Set-up triangles against groups and rays.

use super::batch::Planes;
use super::exact::{Exact, decide};
use super::groups::Groups;
use super::{Memory, V, select};
use crate::lanes::words::list_bits;
use crate::lanes::{LaneMask, Lanes};
use crate::ray::Counters;

/// Pairs of a triangle and a group: at most sixteen by sixteen, with room for whole lists at the end.
#[derive(Clone, Debug)]
pub struct Pairs {
    group: [u8; 272],
    triangle: [u8; 272],
}

impl Default for Pairs {
    fn default() -> Self {
        Self { group: [0; 272], triangle: [0; 272] }
    }
}

/// Sets up the waiting triangles and takes their hits.
#[inline(never)]
pub fn flush<const ANY: bool, const COUNT: bool>(memory: &mut Memory, exact: &Exact, counters: &mut Counters) {
    let Memory { groups, batch, planes, pairs, slabs, .. } = memory;
    let seen = batch.set_up(groups, planes);
    let count = list(seen, &batch.groups, groups, planes, pairs);
    let mut found = 0;
    for k in 0..count {
        let (g, i) = (usize::from(pairs.group[k]) & 15, usize::from(pairs.triangle[k]) & 15);
        let (certain, doubtful) = pair::<ANY>(groups, planes, g, i, batch.slot[i]);
        found += usize::from(certain | doubtful != 0);
        if doubtful != 0 {
            decide::<ANY>(groups, exact, g, batch.slot[i], doubtful);
        }
        if COUNT {
            counters.prims += 1;
            counters.prim_lanes_total += V::N as u64;
            let waiting = groups.inv_lo[g].cmp_lt(V::splat(f32::INFINITY));
            counters.prim_lanes_active += u64::from(waiting.bits().count_ones());
        }
    }
    batch.clear();
    slabs.learn(count, found);
    if count != 0 {
        groups.refresh();
    }
}

/// Lists the pairs whose rectangles and depths meet; returns how many.
#[inline(always)]
fn list(seen: u32, wanted: &[u32], groups: &Groups, planes: &Planes, pairs: &mut Pairs) -> usize {
    let mut count = 0;
    let mut rest = seen;
    while rest != 0 {
        let i = rest.trailing_zeros() as usize & 15;
        rest &= rest - 1;
        // The largest value over each group's rectangle, one group per lane.
        let largest = |k: usize| {
            let [x, y, z] = [0, 1, 2].map(|x| V::splat(planes.linear[k][x][i]));
            let low = |axis: usize| (planes.negative[k][axis] >> i & 1) as usize;
            let (s, t) = (groups.rect[0][1 - low(0)], groups.rect[1][1 - low(1)]);
            x.mul_add(s, y.mul_add(t, z))
        };
        let edge = largest(0).fast_min(largest(1)).fast_min(largest(2));
        let met = V::splat(planes.outside[i]).cmp_le(edge) & groups.least.cmp_le(largest(3) * V::splat(planes.most[i]));
        let mask = met.bits() & wanted[i];
        let at = count.min(256);
        let Some(list) = pairs.group[at..].first_chunk_mut() else { break };
        count = at + list_bits(mask, list);
        pairs.triangle[at..at + 16].fill(i as u8);
    }
    count
}

/// One triangle against the rays of one group: takes certain hits. Returns their lanes, and the lanes where only the
/// common formula can tell.
#[inline(always)]
fn pair<const ANY: bool>(groups: &mut Groups, planes: &Planes, g: usize, i: usize, slot: u32) -> (u32, u32) {
    let (s, t) = (groups.s[g], groups.t[g]);
    let (inv_lo, inv_hi) = (groups.inv_lo[g], groups.inv_hi[g]);
    let value = |k: usize| {
        let [x, y, z] = [0, 1, 2].map(|x| V::splat(planes.linear[k][x][i]));
        x.mul_add(s, y.mul_add(t, z))
    };
    let edge = value(0).fast_min(value(1)).fast_min(value(2));
    let inv_z = value(3);
    let (hi, lo) = (inv_z * V::splat(planes.most[i]), inv_z * V::splat(planes.least[i]));
    let possible = V::splat(planes.outside[i]).cmp_le(edge) & inv_lo.cmp_le(hi);
    let certain =
        possible & V::splat(planes.inside[i]).cmp_le(edge) & inv_hi.cmp_lt(lo) & hi.cmp_lt(V::splat(groups.cap));
    if ANY {
        groups.inv_lo[g] = select(certain, V::splat(f32::INFINITY), inv_lo);
        groups.done[g] |= certain.bits();
    } else {
        groups.inv_lo[g] = select(certain, lo, inv_lo);
        groups.inv_hi[g] = select(certain, hi, inv_hi);
        // Triangle numbers are moved as floats: selection copies bits.
        let old = V::new(bytemuck::cast(groups.slot[g]));
        groups.slot[g] = bytemuck::cast(select(certain, V::splat(f32::from_bits(slot)), old).to_array());
    }
    (certain.bits(), possible.bits() & !certain.bits())
}
