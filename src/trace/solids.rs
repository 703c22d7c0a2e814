//! Trees of solids against a packet: the nearest boundary at or after the segment's start.

use super::query::Query;
use crate::csg::{self, Boundary, Depth, Effort};
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::slab::Interval;
use crate::ray::{Candidate, Packet};
use crate::scene::world::PlacedSolid;

/// Tests one solid.
#[inline(never)]
pub fn trace<V: Lanes, const ANY: bool, const COUNT: bool>(
    placed: &PlacedSolid<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    let bounds = &placed.solid.bounds;
    let interval = Interval::of(packet, bounds.lo, bounds.hi);
    let mut wanted = interval.meets(packet.t_min, query.hit.t).bits() & lanes;
    if ANY {
        wanted &= !query.done;
    }
    if wanted == 0 {
        return;
    }
    // Lent to the sweep, which calls back with the query.
    let mut scratch = query.stack.solids.take().unwrap_or_default();
    let limit = query.hit.t;
    let effort =
        csg::sweep(&placed.solid, packet, (wanted, &interval), limit, Depth::FrontFirst, &mut scratch, |boundary| {
            let found = candidate(packet, &interval, boundary);
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

/// A boundary as a hit, made consistent with the solid's box (see [`crate::ray::slab`]).
#[inline(always)]
fn candidate<V: Lanes>(packet: &Packet<V>, interval: &Interval<V>, boundary: &Boundary<V>) -> Candidate<V> {
    let t = packet.t_floor.fast_max(interval.clamp(boundary.t));
    // Ends at infinity are no boundaries.
    let finite = boundary.t.abs().cmp_le(V::splat(V::Scalar::MAX));
    let turned = V::Mask::from_bits(boundary.turned);
    Candidate {
        hit: packet.t_min.cmp_le(t) & finite,
        t,
        u: boundary.face,
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
