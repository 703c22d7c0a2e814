//! Trees of solids against a packet: the nearest boundary at or after the segment's start.

use std::ops::Range;

use super::query::Query;
use crate::csg::{self, Depth, Effort, Sole, Solid};
use crate::lanes::{LaneMask, Lanes, Real};
use crate::math::Aabb;
use crate::ray::slab::Interval;
use crate::ray::{Candidate, Packet};
use crate::scene::world::{Object, PlacedSolid, SolidBlock};

/// Tests the solids of a block.
#[inline(always)]
pub fn block<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    block: &SolidBlock,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    let range = |of: &Range<u32>| of.start as usize..of.end as usize;
    // Two calls: the registers of one would be those of both.
    for sole in &object.soles[range(&block.soles)] {
        span(sole, &object.solids[sole.solid as usize].solid, inst, packet, query, lanes);
    }
    for &solid in &object.swept[range(&block.swept)] {
        sweep(&object.solids[solid as usize], inst, packet, query, lanes);
    }
}

/// Where the lines meet the solid's box, and the lanes that look for something there.
#[inline(always)]
fn enter<V: Lanes, const ANY: bool, const COUNT: bool>(
    bounds: &Aabb<V::Scalar>,
    packet: &Packet<V>,
    query: &Query<V, ANY, COUNT>,
    lanes: u32,
) -> (Interval<V>, u32) {
    let interval = Interval::of(packet, bounds.lo, bounds.hi);
    let wanted = interval.meets(packet.t_min, query.hit.t).bits() & lanes;
    (interval, if ANY { wanted & !query.done } else { wanted })
}

/// Tests a solid of any number of leaves.
#[inline(never)]
fn sweep<V: Lanes, const ANY: bool, const COUNT: bool>(
    placed: &PlacedSolid<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    let (interval, wanted) = enter(&placed.solid.bounds, packet, query, lanes);
    if wanted == 0 {
        return;
    }
    // Lent to the sweep, which calls back with the query.
    let mut scratch = query.stack.solids.take().unwrap_or_default();
    // Boundaries are moved into the box before they count, by no more than the tolerance: what is looked at reaches beyond the
    // limit, so that the hit at which a segment ends, or that of another solid in the same place, is seen by every order of tests.
    let limit = placed.solid.tolerance(packet).mul_add(V::constant(4.0), query.hit.t);
    let effort =
        csg::sweep(&placed.solid, packet, (wanted, &interval), limit, Depth::FrontFirst, &mut scratch, |boundary| {
            let found = candidate(packet, &interval, boundary.t, boundary.face, boundary.turned);
            let prim = placed.first_prim + placed.solid.number(boundary.leaf);
            query.take(boundary.lanes, &found, prim, inst);
            // What lies beyond the end of a segment ends the lane too.
            found.hit.bits() & boundary.lanes
        });
    query.stack.solids = Some(scratch);
    if COUNT {
        count(query, wanted, &effort);
    }
}

/// Tests a solid that lines pass through at most once. Takes in where they enter, or, if that does not count, where they leave:
/// the same as a sweep over both.
#[inline(never)]
fn span<V: Lanes, const ANY: bool, const COUNT: bool>(
    sole: &Sole<V::Scalar>,
    solid: &Solid<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    let (interval, wanted) = enter(sole.bounds(), packet, query, lanes);
    if wanted == 0 {
        return;
    }
    let Some(span) = sole.span(solid, packet, wanted, &interval) else { return };
    let boundary = |t: V, face: V| {
        let found = candidate(packet, &interval, t, face, 0);
        Candidate { hit: found.hit & found.t.cmp_le(query.hit.t), ..found }
    };
    let (enters, leaves) = (boundary(span.t_in, span.face_in), boundary(span.t_out, span.face_out));
    let nearest = |of_enters: V, of_leaves: V| V::select(enters.hit, of_enters, of_leaves);
    let found = Candidate {
        hit: span.hit & (enters.hit | leaves.hit),
        t: nearest(enters.t, leaves.t),
        u: nearest(enters.u, leaves.u),
        v: enters.v,
    };
    query.take(wanted, &found, sole.prim, inst);
    if COUNT {
        let (events, steps) = if span.hit.any() { (2, 2) } else { (0, 0) };
        count(query, wanted, &Effort { met: 1, kept: 1, events, steps });
    }
}

/// A boundary as a hit, made consistent with the solid's box (see [`crate::ray::slab`]).
#[inline(always)]
fn candidate<V: Lanes>(packet: &Packet<V>, interval: &Interval<V>, at: V, face: V, turned: u32) -> Candidate<V> {
    let t = packet.t_floor.fast_max(interval.clamp(at));
    // Ends at infinity are no boundaries.
    let finite = at.abs().cmp_le(V::splat(V::Scalar::MAX));
    let turned = V::Mask::from_bits(turned);
    Candidate {
        hit: packet.t_min.cmp_le(t) & finite,
        t,
        u: face,
        v: V::select(turned, V::constant(1.0), V::constant(0.0)),
    }
}

fn count<V: Lanes, const ANY: bool, const COUNT: bool>(query: &mut Query<V, ANY, COUNT>, lanes: u32, effort: &Effort) {
    query.count_leaf(lanes, effort.kept);
    let counters = &mut query.counters;
    counters.solids += 1;
    counters.solid_leaves_met += effort.met as u64;
    counters.solid_leaves_kept += effort.kept as u64;
    counters.solid_events += effort.events as u64;
    counters.solid_steps += effort.steps as u64;
}
