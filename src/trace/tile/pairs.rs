//! Set-up triangles against groups and rays.

use super::batch::{BATCH, Planes};
use super::bundle::Shared;
use super::exact::{self, Exact, certain_pair};
use super::groups::Groups;
use super::held::{Held, Line, Plane};
use super::listing::{self, triangles};
use super::own::{self, Id, may_be_inside, pair_doubtful};
use super::{GROUPS, Mask, Memory, V};
use crate::lanes::ahead::one_ahead;
use crate::lanes::{LaneMask, Lanes};
use crate::ray::Counters;

/// What is to be looked at again, as bits: of groups the triangles, or of triangles the groups.
#[derive(Clone, Debug)]
pub struct Again {
    of: [(u8, u64); GROUPS],
    len: usize,
}

impl Default for Again {
    fn default() -> Self {
        Self { of: [(0, 0); GROUPS], len: 0 }
    }
}

impl Again {
    /// Always written, counted where there are any: that is a surprise every time.
    #[inline(always)]
    fn add(&mut self, of: usize, doubts: u64) {
        self.of[self.len & (GROUPS - 1)] = (of as u8, doubts);
        self.len += usize::from(doubts != 0);
    }
}

/// What pairs came to.
#[derive(Clone, Copy, Debug, Default)]
struct Tested {
    /// Pairs that gave something.
    found: usize,
    /// Groups in which some did, as bits.
    groups: u64,
}

impl Tested {
    /// `count` pairs of group `g` gave something.
    #[inline(always)]
    fn find(&mut self, g: usize, count: u32) {
        self.found += count as usize;
        self.groups |= u64::from(count != 0) << g;
    }

    /// One pair of each of some groups gave something.
    #[inline(always)]
    fn find_all(&mut self, groups: u64) {
        self.found += groups.count_ones() as usize;
        self.groups |= groups;
    }
}

/// Sets up the waiting triangles and takes their hits; where some are left out first, when enough are left. `last`: those that
/// are left, however few.
#[inline(never)]
pub fn flush<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    counters: &mut Counters,
    last: bool,
) {
    if !ANY && !EXACT && (last || memory.trial.gaps.is_some()) && !memory.thin(last) {
        return;
    }
    let Memory { groups, batch, planes, listing, .. } = memory;
    let seen = batch.set_up::<ANY, EXACT>(groups, planes);
    listing.fill::<N, EXACT>(seen, &batch.groups, groups, planes);
    let to_end = ANY && matches!(exact.bundle.shared, Shared::End(_) | Shared::Against);
    let is_behind = !ANY && groups.is_behind;
    let Tested { found, groups: changed } = match (EXACT, is_behind) {
        (true, true) => test_exact::<ANY, true, COUNT>(memory, exact, counters),
        (true, false) => test_exact::<ANY, false, COUNT>(memory, exact, counters),
        (false, true) if groups.many => test::<ANY, true, true, false, false, COUNT>(memory, exact, counters),
        (false, true) => test::<ANY, false, true, false, false, COUNT>(memory, exact, counters),
        (false, false) => match (groups.many, to_end, groups.ends_early) {
            (true, true, true) => test::<ANY, true, false, true, true, COUNT>(memory, exact, counters),
            (true, true, false) => test::<ANY, true, false, true, false, COUNT>(memory, exact, counters),
            (true, false, true) => test::<ANY, true, false, false, true, COUNT>(memory, exact, counters),
            (true, false, false) => test::<ANY, true, false, false, false, COUNT>(memory, exact, counters),
            (false, true, true) => test::<ANY, false, false, true, true, COUNT>(memory, exact, counters),
            (false, true, false) => test::<ANY, false, false, true, false, COUNT>(memory, exact, counters),
            (false, false, true) => test::<ANY, false, false, false, true, COUNT>(memory, exact, counters),
            (false, false, false) => test::<ANY, false, false, false, false, COUNT>(memory, exact, counters),
        },
    };
    memory.batch.clear();
    memory.slabs.learn(memory.listing.pairs, found);
    if !ANY && !EXACT {
        memory.trial.learn::<N>(memory.listing.pairs, &memory.groups);
    }
    if changed != 0 {
        memory.groups.refresh::<N>(changed);
    }
}

/// Tests the listed pairs. `MANY`: triangles are of instances. `BEHIND`: the common point is behind the rays. `END`: it is
/// where they end.
#[inline(always)]
fn test<
    const ANY: bool,
    const MANY: bool,
    const BEHIND: bool,
    const END: bool,
    const EARLY: bool,
    const COUNT: bool,
>(
    memory: &mut Memory,
    exact: &Exact,
    counters: &mut Counters,
) -> Tested {
    let Memory { groups, batch, planes, listing, again, .. } = memory;
    let id = |i: usize| Id { inst: batch.inst[i], prim: batch.id[i] };
    let unsteady = if ANY { 0 } else { planes.unsteady };
    // What the plain test is not for comes last: which test is next is never a surprise.
    let odd = planes.wild | if BEHIND || END { planes.flat } else { 0 };
    let mut tested = Tested::default();
    again.len = 0;
    if listing.by_groups {
        for (g, met) in (0..listing.len()).map(|k| listing.get(k)) {
            let sure = met & !odd;
            if sure == 0 {
                continue;
            }
            let (mut held, mut hits, mut doubt) = (Held::of::<MANY>(groups, g), 0, Mask::from_bits(0));
            let plane = |i: usize| Plane::of(planes, i & (BATCH - 1));
            one_ahead(
                sure.into(),
                &mut held,
                |held, i| plane(i).values::<ANY, BEHIND, END>(&held.line),
                |held, i, values| {
                    if COUNT {
                        count_pair(held.line.best, counters);
                    }
                    let plane = plane(i);
                    let met = plane.meet::<ANY, BEHIND, END, EARLY>(&held.line, &values);
                    held.take::<ANY, MANY, BEHIND>(&plane, &met, id(i & (BATCH - 1)));
                    hits |= u32::from(met.hit()) << i;
                    doubt = doubt | met.doubt();
                },
            );
            held.put::<ANY, MANY, BEHIND>(groups, g);
            tested.find(g, hits.count_ones());
            again.add(g, if doubt.any() { sure } else { hits & unsteady }.into());
        }
    } else {
        for i in triangles(listing.seen() & !odd) {
            let (plane, id, met) = (Plane::of(planes, i), id(i), listing.groups(i));
            let (mut hits, mut doubt) = (0, Mask::from_bits(0));
            one_ahead(
                met,
                groups,
                |groups, g| plane.values::<ANY, BEHIND, END>(&Line::of(groups, g & (GROUPS - 1))),
                |groups, g, values| {
                    let g = g & (GROUPS - 1);
                    if COUNT {
                        count_pair(groups.of[g].inv_lo, counters);
                    }
                    let mut held = Held::of::<MANY>(groups, g);
                    let met = plane.meet::<ANY, BEHIND, END, EARLY>(&held.line, &values);
                    held.take::<ANY, MANY, BEHIND>(&plane, &met, id);
                    held.put::<ANY, MANY, BEHIND>(groups, g);
                    hits |= u64::from(met.hit()) << g;
                    doubt = doubt | met.doubt();
                },
            );
            tested.find_all(hits);
            let unsteady = unsteady >> i & 1 != 0;
            again.add(
                i,
                if doubt.any() {
                    met
                } else if unsteady {
                    hits
                } else {
                    0
                },
            );
        }
    }
    if odd != 0 {
        listing.each(odd, |g, i| {
            if COUNT {
                count_pair(groups.of[g].inv_lo, counters);
            }
            if planes.wild >> i & 1 != 0 || may_be_inside(groups, planes, g, i) {
                tested.find(g, own::decide::<ANY, MANY>(groups, exact, g, batch, i).into());
            }
        });
    }
    if again.len > 0 {
        batch.put_corners(groups, planes);
    }
    for &(of, doubts) in again.of.iter().take(again.len) {
        for other in listing::groups(doubts) {
            let (g, i) = if listing.by_groups { (of.into(), other) } else { (other, of.into()) };
            let (g, i) = (g & (GROUPS - 1), i & (BATCH - 1));
            if unsteady >> i & 1 != 0 || is_doubtful::<ANY, MANY, BEHIND, END, EARLY>(groups, planes, g, i, id(i)) {
                let found = pair_doubtful::<ANY, MANY>(groups, planes, g, i, id(i), END);
                tested.groups |= u64::from(found) << g;
            }
        }
    }
    tested
}

/// Whether triangle `i` may change what some ray of group `g` hits once all plain tests are done.
#[cold]
#[inline(never)]
fn is_doubtful<const ANY: bool, const MANY: bool, const BEHIND: bool, const END: bool, const EARLY: bool>(
    groups: &Groups,
    planes: &Planes,
    g: usize,
    i: usize,
    id: Id,
) -> bool {
    let (plane, line) = (Plane::of(planes, i), Line::of(groups, g));
    let values = plane.values::<ANY, BEHIND, END>(&line);
    let possible = plane.meet::<ANY, BEHIND, END, EARLY>(&line, &values).possible;
    (possible & !id.is_of::<MANY>(groups, g)).any()
}

/// Tests the listed pairs as far as the tile's arithmetic is certain, by the common formula from there on.
#[inline(always)]
fn test_exact<const ANY: bool, const BEHIND: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    counters: &mut Counters,
) -> Tested {
    let Memory { groups, batch, planes, listing, .. } = memory;
    let mut tested = Tested::default();
    listing.each(0xffff, |g, i| {
        if COUNT {
            count_pair(groups.of[g].inv_lo, counters);
        }
        let (certain, doubtful) = certain_pair::<ANY, BEHIND>(groups, planes, g, i, batch.id[i]);
        tested.find(g, (certain | doubtful != 0).into());
        if doubtful != 0 {
            exact::decide::<ANY>(groups, exact, g, batch.id[i], doubtful);
        }
    });
    tested
}

/// `best`: depths of the group's best hits.
fn count_pair(best: V, counters: &mut Counters) {
    counters.prims += 1;
    counters.prim_lanes_total += V::N as u64;
    counters.prim_lanes_linear += V::N as u64;
    let waiting = best.cmp_lt(V::splat(f32::INFINITY));
    counters.prim_lanes_active += u64::from(waiting.bits().count_ones());
}
