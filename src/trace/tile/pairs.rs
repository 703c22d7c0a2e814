//! Set-up triangles against groups and rays.

use super::batch::{BATCH, Planes};
use super::bundle::Shared;
use super::exact::{self, Exact, certain_pair};
use super::groups::Groups;
use super::own::{self, Id, Verdict, may_be_inside, own_depth, pair, pair_ahead, pair_doubtful, pair_to_end};
use super::{GROUPS, Memory, SET, V};
use crate::lanes::words::list_bits;
use crate::lanes::{LaneMask, Lanes, each};
use crate::ray::Counters;

/// Most pairs of a triangle and a group.
const MOST: usize = BATCH * GROUPS;

/// Pairs of a triangle and a group, with room for whole lists at the end.
#[derive(Clone, Debug)]
pub struct Pairs {
    group: [u8; MOST + SET],
    triangle: [u8; MOST + SET],
    /// Numbers of the pairs to look at again.
    again: [u16; MOST],
}

impl Default for Pairs {
    fn default() -> Self {
        Self { group: [0; MOST + SET], triangle: [0; MOST + SET], again: [0; MOST] }
    }
}

/// Sets up the waiting triangles and takes their hits.
#[inline(never)]
pub fn flush<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    counters: &mut Counters,
) {
    let Memory { groups, batch, planes, pairs, .. } = memory;
    let seen = batch.set_up::<ANY, EXACT>(groups, planes);
    let (count, touched) = list::<N, EXACT>(seen, &batch.groups, groups, planes, pairs);
    let found = match (!EXACT && groups.many, !ANY && groups.is_behind) {
        (true, _) => test::<ANY, EXACT, true, false, COUNT>(memory, exact, count, counters),
        (_, true) => test::<ANY, EXACT, false, true, COUNT>(memory, exact, count, counters),
        _ => test::<ANY, EXACT, false, false, COUNT>(memory, exact, count, counters),
    };
    memory.batch.clear();
    memory.slabs.learn(count, found);
    if count != 0 {
        memory.groups.refresh::<N>(touched);
    }
}

/// Tests the first `count` pairs; returns how many gave something. `MANY`: triangles are of instances. `BEHIND`: the common
/// point is behind the rays.
#[inline(always)]
fn test<const ANY: bool, const EXACT: bool, const MANY: bool, const BEHIND: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    count: usize,
    counters: &mut Counters,
) -> usize {
    let Memory { groups, batch, planes, pairs, .. } = memory;
    let (mut found, mut again) = (0, 0);
    let to_end = matches!(exact.bundle.shared, Shared::End(_));
    for k in 0..count {
        let (g, i) = (usize::from(pairs.group[k]) & (GROUPS - 1), usize::from(pairs.triangle[k]) & 15);
        let id = Id { inst: batch.inst[i], prim: batch.id[i] };
        if EXACT {
            let (certain, doubtful) = certain_pair::<ANY, BEHIND>(groups, planes, g, i, batch.id[i]);
            found += usize::from(certain | doubtful != 0);
            if doubtful != 0 {
                exact::decide::<ANY>(groups, exact, g, batch.id[i], doubtful);
            }
        } else if (planes.wild | planes.unsteady) >> i & 1 != 0 {
            let flat = BEHIND && planes.flat >> i & 1 != 0;
            found += usize::from(if planes.wild >> i & 1 != 0 || flat && may_be_inside(groups, planes, g, i) {
                own::decide::<ANY, MANY>(groups, exact, g, batch, i)
            } else if flat {
                false
            } else {
                pair_doubtful::<ANY, MANY>(groups, planes, g, i, id, to_end)
            });
        } else {
            let Verdict { hit, doubt } = if ANY && to_end {
                pair_to_end(groups, planes, g, i)
            } else if BEHIND {
                pair_ahead(groups, planes, g, i, id)
            } else {
                pair::<ANY, MANY>(groups, planes, g, i, id)
            };
            found += usize::from(hit);
            // Always written, counted where it is wanted: a call in this loop would take the registers of all of it.
            pairs.again[again.min(MOST - 1)] = k as u16;
            again += usize::from(doubt);
        }
        if COUNT {
            counters.prims += 1;
            counters.prim_lanes_total += V::N as u64;
            counters.prim_lanes_linear += V::N as u64;
            let waiting = groups.of[g].inv_lo.cmp_lt(V::splat(f32::INFINITY));
            counters.prim_lanes_active += u64::from(waiting.bits().count_ones());
        }
    }
    for &k in pairs.again.iter().take(again) {
        let (g, i) = (usize::from(pairs.group[usize::from(k)]), usize::from(pairs.triangle[usize::from(k)]) & 15);
        let id = Id { inst: batch.inst[i], prim: batch.id[i] };
        pair_doubtful::<ANY, MANY>(groups, planes, g & (GROUPS - 1), i, id, to_end);
    }
    found
}

/// Lists the pairs whose rectangles and depths meet; returns how many, and the sets they are of.
#[inline(always)]
fn list<const N: usize, const EXACT: bool>(
    seen: u32,
    wanted: &[u64],
    groups: &Groups,
    planes: &Planes,
    pairs: &mut Pairs,
) -> (usize, u32) {
    let (mut count, mut touched) = (0, 0);
    for q in 0..N {
        let here = |i: usize| (wanted[i] >> (q * SET)) as u32 & 0xffff;
        // Set by set: few branches to go wrong, and the pairs of a set stay together.
        let mut rest = seen;
        if N > 1 {
            let mut some = 0;
            for i in 0..BATCH {
                some |= u32::from(here(i) != 0) << i;
            }
            rest &= some;
        }
        let before = count;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize & 15;
            rest &= rest - 1;
            // The largest value over each group's rectangle, one group per lane.
            let largest = |k: usize| {
                let [x, y, z] = each(|x| V::splat(planes.linear[k][x][i]));
                let low = |axis: usize| (planes.negative[k][axis] >> i & 1) as usize;
                let (s, t) = (groups.rect[0][1 - low(0)][q], groups.rect[1][1 - low(1)][q]);
                x.mul_add(s, y.mul_add(t, z))
            };
            let edge = largest(0).fast_min(largest(1)).fast_min(largest(2));
            let inverse = largest(3);
            let inverse = if EXACT { inverse * V::splat(planes.most[i]) } else { own_depth(planes, i, inverse) };
            let outside = if EXACT { V::splat(planes.outside[i]) } else { V::constant(0.0) };
            let met = outside.cmp_le(edge) & groups.least[q].cmp_le(inverse);
            let unknown = if !EXACT && planes.wild >> i & 1 != 0 { V::ALL } else { 0 };
            let mask = (met.bits() | unknown) & here(i);
            let at = count.min(MOST);
            let Some(list) = pairs.group[at..].first_chunk_mut() else { break };
            count = at + list_bits(mask, (q * SET) as u8, list);
            pairs.triangle[at..at + SET].fill(i as u8);
        }
        touched |= u32::from(count != before) << q;
    }
    (count, touched)
}
