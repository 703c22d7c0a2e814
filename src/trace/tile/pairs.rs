//! Set-up triangles against groups and rays.

use super::batch::Planes;
use super::bundle::Shared;
use super::exact::{self, Exact, certain_pair};
use super::groups::Groups;
use super::own::{self, own_depth, pair, pair_to_end, pair_unsteady};
use super::{Memory, V};
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
pub fn flush<const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    counters: &mut Counters,
) {
    let Memory { groups, batch, planes, pairs, slabs, .. } = memory;
    let seen = batch.set_up::<ANY, EXACT>(groups, planes);
    let count = list::<EXACT>(seen, &batch.groups, groups, planes, pairs);
    let mut found = 0;
    let to_end = matches!(exact.bundle.shared, Shared::End(_));
    for k in 0..count {
        let (g, i) = (usize::from(pairs.group[k]) & 15, usize::from(pairs.triangle[k]) & 15);
        if EXACT {
            let (certain, doubtful) = certain_pair::<ANY>(groups, planes, g, i, batch.id[i]);
            found += usize::from(certain | doubtful != 0);
            if doubtful != 0 {
                exact::decide::<ANY>(groups, exact, g, batch.id[i], doubtful);
            }
        } else if planes.wild >> i & 1 != 0 {
            found += usize::from(own::decide::<ANY>(groups, exact, g, batch.corners(i), batch.id[i]));
        } else if planes.unsteady >> i & 1 != 0 {
            found += usize::from(pair_unsteady::<ANY>(groups, planes, g, i, batch.id[i], to_end));
        } else if ANY && to_end {
            found += usize::from(pair_to_end(groups, planes, g, i));
        } else {
            found += usize::from(pair::<ANY>(groups, planes, g, i, batch.id[i]));
        }
        if COUNT {
            counters.prims += 1;
            counters.prim_lanes_total += V::N as u64;
            counters.prim_lanes_linear += V::N as u64;
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
fn list<const EXACT: bool>(seen: u32, wanted: &[u32], groups: &Groups, planes: &Planes, pairs: &mut Pairs) -> usize {
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
        let inverse = largest(3);
        let inverse = if EXACT { inverse * V::splat(planes.most[i]) } else { own_depth(planes, i, inverse) };
        let outside = if EXACT { V::splat(planes.outside[i]) } else { V::constant(0.0) };
        let met = outside.cmp_le(edge) & groups.least.cmp_le(inverse);
        let unknown = if !EXACT && planes.wild >> i & 1 != 0 { V::ALL } else { 0 };
        let mask = (met.bits() | unknown) & wanted[i];
        let at = count.min(256);
        let Some(list) = pairs.group[at..].first_chunk_mut() else { break };
        count = at + list_bits(mask, list);
        pairs.triangle[at..at + 16].fill(i as u8);
    }
    count
}
