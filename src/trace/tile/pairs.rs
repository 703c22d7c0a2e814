//! Set-up triangles against groups and rays.

use super::batch::{BATCH, Planes};
use super::bundle::Shared;
use super::exact::{self, Exact, certain_pair};
use super::groups::Groups;
use super::own::{self, Id, Verdict, may_be_inside, own_depth, pair, pair_ahead, pair_doubtful, pair_to_end};
use super::{GROUPS, Memory, SET, SETS, V};
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

impl Pairs {
    /// Group and triangle of a pair.
    #[inline(always)]
    fn get(&self, k: usize) -> (usize, usize) {
        (usize::from(self.group[k]) & (GROUPS - 1), usize::from(self.triangle[k]) & 15)
    }
}

/// What [`list`] found.
#[derive(Clone, Copy, Debug, Default)]
struct Listed {
    /// Pairs.
    pairs: usize,
    /// Sets they are of, as bits.
    sets: u32,
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
    // Triangles that are not for the plain test alone come last: which test is next is never a surprise.
    let odd = if EXACT { 0 } else { planes.wild | if ANY { 0 } else { planes.unsteady } };
    let mut listed = Listed::default();
    list::<N, EXACT, false>(seen & !odd, &batch.groups, groups, planes, pairs, &mut listed);
    let plain = listed.pairs;
    if seen & odd != 0 {
        list::<N, EXACT, true>(seen & odd, &batch.groups, groups, planes, pairs, &mut listed);
    }
    let count = listed.pairs;
    let found = match (!EXACT && groups.many, !ANY && groups.is_behind) {
        (true, _) => test::<ANY, EXACT, true, false, COUNT>(memory, exact, [plain, count], counters),
        (_, true) => test::<ANY, EXACT, false, true, COUNT>(memory, exact, [plain, count], counters),
        _ => test::<ANY, EXACT, false, false, COUNT>(memory, exact, [plain, count], counters),
    };
    memory.batch.clear();
    memory.slabs.learn(count, found);
    if count != 0 {
        memory.groups.refresh::<N>(listed.sets);
    }
}

/// Tests the listed pairs, the first `plain` of them by the plain test; returns how many gave something. `MANY`: triangles are
/// of instances. `BEHIND`: the common point is behind the rays.
#[inline(always)]
fn test<const ANY: bool, const EXACT: bool, const MANY: bool, const BEHIND: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    [plain, count]: [usize; 2],
    counters: &mut Counters,
) -> usize {
    let Memory { groups, batch, planes, pairs, .. } = memory;
    let (mut found, mut again) = (0, 0);
    let to_end = matches!(exact.bundle.shared, Shared::End(_));
    let id = |i: usize| Id { inst: batch.inst[i], prim: batch.id[i] };
    for k in 0..plain {
        let (g, i) = pairs.get(k);
        if COUNT {
            count_pair(groups, g, counters);
        }
        if EXACT {
            let (certain, doubtful) = certain_pair::<ANY, BEHIND>(groups, planes, g, i, batch.id[i]);
            found += usize::from(certain | doubtful != 0);
            if doubtful != 0 {
                exact::decide::<ANY>(groups, exact, g, batch.id[i], doubtful);
            }
            continue;
        }
        let Verdict { hit, doubt } = plain_pair::<ANY, MANY, BEHIND>(groups, planes, (g, i), id(i), to_end);
        found += usize::from(hit);
        // Always written, counted where it is wanted: a call in this loop would take the registers of all of it.
        pairs.again[again.min(MOST - 1)] = k as u16;
        again += usize::from(doubt);
    }
    for k in plain..count {
        let (g, i) = pairs.get(k);
        if COUNT {
            count_pair(groups, g, counters);
        }
        let is_flat = BEHIND && planes.flat >> i & 1 != 0;
        if planes.wild >> i & 1 != 0 || is_flat && may_be_inside(groups, planes, g, i) {
            found += usize::from(own::decide::<ANY, MANY>(groups, exact, g, batch, i));
        } else if !is_flat {
            let Verdict { hit, doubt } = plain_pair::<ANY, MANY, BEHIND>(groups, planes, (g, i), id(i), to_end);
            found += usize::from(hit);
            pairs.again[again.min(MOST - 1)] = k as u16;
            again += usize::from(hit | doubt);
        }
    }
    for &k in pairs.again.iter().take(again) {
        let (g, i) = pairs.get(usize::from(k));
        pair_doubtful::<ANY, MANY>(groups, planes, g, i, id(i), to_end);
    }
    found
}

/// The test of a pair by the kind of rays.
#[inline(always)]
fn plain_pair<const ANY: bool, const MANY: bool, const BEHIND: bool>(
    groups: &mut Groups,
    planes: &Planes,
    (g, i): (usize, usize),
    id: Id,
    to_end: bool,
) -> Verdict {
    if ANY && to_end {
        pair_to_end(groups, planes, g, i)
    } else if BEHIND {
        pair_ahead(groups, planes, g, i, id)
    } else {
        pair::<ANY, MANY>(groups, planes, g, i, id)
    }
}

fn count_pair(groups: &Groups, g: usize, counters: &mut Counters) {
    counters.prims += 1;
    counters.prim_lanes_total += V::N as u64;
    counters.prim_lanes_linear += V::N as u64;
    let waiting = groups.of[g].inv_lo.cmp_lt(V::splat(f32::INFINITY));
    counters.prim_lanes_active += u64::from(waiting.bits().count_ones());
}

/// Adds the pairs of `seen` triangles whose rectangles and depths meet. `ODD`: some may be wild, and meet all.
#[inline(always)]
fn list<const N: usize, const EXACT: bool, const ODD: bool>(
    seen: u32,
    wanted: &[u64],
    groups: &Groups,
    planes: &Planes,
    pairs: &mut Pairs,
    listed: &mut Listed,
) {
    let mut count = listed.pairs;
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
                let [s, t] = [0, 1].map(|axis| {
                    groups.rect[axis].as_flattened()[(planes.corner[k][axis][i] as usize + q) & (2 * SETS - 1)]
                });
                x.mul_add(s, y.mul_add(t, z))
            };
            let edge = largest(0).fast_min(largest(1)).fast_min(largest(2));
            let inverse = largest(3);
            let inverse = if EXACT { inverse * V::splat(planes.most[i]) } else { own_depth(planes, i, inverse) };
            let met = V::splat(planes.outside[i]).cmp_le(edge) & groups.least[q].cmp_le(inverse);
            let unknown = if ODD && planes.wild >> i & 1 != 0 { V::ALL } else { 0 };
            let mask = (met.bits() | unknown) & here(i);
            let at = count.min(MOST);
            let Some(list) = pairs.group[at..].first_chunk_mut() else { break };
            count = at + list_bits(mask, (q * SET) as u8, list);
            pairs.triangle[at..at + SET].fill(i as u8);
        }
        listed.sets |= u32::from(count != before) << q;
    }
    listed.pairs = count;
}
