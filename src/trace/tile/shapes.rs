//! Shapes among a tile's triangles: a leaf of spheres, boxes, cylinders or cones against the rays of some groups, sixteen
//! at a time, by the common formula. What it finds becomes a depth in the frame, and is weighed against the tile's other
//! hits as their own are.

use super::bundle::{Bundle, Source};
use super::columns::Segments;
use super::exact::Exact;
use super::groups::Groups;
use super::own::{Id, occlude};
use super::{GROUPS, Mask, V, select};
use crate::bvh::Child;
use crate::lanes::chosen::{merge, merge_lists};
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes};
use crate::ray::slab::Interval;
use crate::ray::{Counters, HitPacket, INVALID_ID, Packet};
use crate::scene::world::{Instance, Object};
use crate::trace::leaf;
use crate::trace::query::{Query, Stack};
use crate::trace::stream::bring_in;

impl Groups {
    /// The rays of a group and their ends: those of a pencil are made once, however many instances they go into.
    #[inline(always)]
    pub fn segments(&mut self, bundle: &Bundle, g: usize) -> Segments {
        match bundle.source {
            Source::Batch(_) => bundle.segments(g),
            Source::Pencil(..) if self.aimed >> g & 1 != 0 => bundle.aimed(self.of[g].start),
            Source::Pencil(..) => {
                let segments = bundle.segments(g);
                (self.of[g].start, self.aimed) = (segments.dir, self.aimed | 1 << g);
                segments
            }
        }
    }
}

/// How far the rays of a group, `segments`, go at an instance: their ends or `limit`, whichever is nearer; where they enter its box,
/// and those of `lanes` that meet it.
#[inline(always)]
pub fn reach(instance: &Instance<f32>, segments: &Segments, limit: V, lanes: u32) -> (V, V, u32) {
    let Segments { org, dir, t_min, t_max } = *segments;
    // What is no number limits nothing.
    let t_max = limit.fast_min(t_max);
    if instance.identity {
        return (t_max, V::splat(f32::MIN), lanes);
    }
    let packet = Packet::unsheared(org, dir, t_min);
    let interval = Interval::of(&packet, instance.bounds.lo, instance.bounds.hi);
    (t_max, interval.near, interval.meets(t_min, t_max).bits() & lanes)
}

/// The rays of a group, `segments`, in the space of an instance, their ends, and those of `lanes` that meet its box; `None` if none
/// does.
#[inline(always)]
pub fn enter(exact: &Exact, inst: u32, segments: &Segments, lanes: u32) -> Option<(Packet<V>, V, u32)> {
    let Segments { org, dir, t_min, .. } = *segments;
    let instance = &exact.world.instances[inst as usize];
    let (t_max, near, lanes) = reach(instance, segments, V::splat(f32::INFINITY), lanes);
    if lanes == 0 {
        return None;
    }
    let (local, inside) = bring_in([org, dir], [t_min, near], instance, true);
    let lanes = lanes & inside;
    (lanes != 0).then_some((local, t_max, lanes))
}

/// Tests a leaf of an instance's shapes against `wanted` groups of `N` sets.
#[inline(never)]
pub fn visit<const N: usize, const ANY: bool, const COUNT: bool>(
    groups: &mut Groups,
    exact: &Exact,
    (object, inst): (&Object<f32>, u32),
    leaf: Child,
    wanted: u64,
    stack: &mut Stack<f32>,
    counters: &mut Counters,
) {
    let (mut rest, mut touched) = (wanted, 0);
    while rest != 0 {
        let g = rest.trailing_zeros() as usize & (GROUPS - 1);
        rest &= rest - 1;
        let tame = exact.bundle.tame[g];
        let lanes = tame & !groups.done(g, tame);
        let segments = groups.segments(exact.bundle, g);
        let Some((packet, t_max, lanes)) = enter(exact, inst, &segments, lanes) else {
            continue;
        };
        let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t_max), stack, counters);
        leaf::block(object, inst, &packet, &mut query, leaf, lanes);
        let (hit, done) = (query.hit, query.done);
        let found = match ANY {
            true => occlude(groups, g, Mask::from_bits(done)),
            false => take(groups, g, &hit, inst),
        };
        touched |= u64::from(found) << g;
    }
    if touched != 0 {
        groups.refresh::<N>(touched);
    }
}

/// Keeps the hits of a packet where they are a group's nearest; whether any is.
pub fn take(groups: &mut Groups, g: usize, hit: &HitPacket<V>, inst: u32) -> bool {
    let found = Mask::from_bits(!positions(&hit.prim, INVALID_ID));
    let inverse = (groups.of[g].slowness / hit.t).fast_min(V::splat(f32::MAX));
    let best = groups.of[g].inv_lo;
    let mut wins = found & best.cmp_lt(inverse);
    let mut ties = (found & best.cmp_eq(inverse)).bits();
    while ties != 0 {
        let lane = ties.trailing_zeros() as usize & (V::N - 1);
        ties &= ties - 1;
        let not_after = Id { inst, prim: hit.prim[lane] }.is_not_after::<true>(groups, g);
        wins = wins | not_after & Mask::from_bits(1 << lane);
    }
    let group = &mut groups.of[g];
    group.inv_lo = select(wins, inverse, best);
    group.slot = merge_lists(wins, hit.prim, group.slot);
    for (weight, x) in group.weights.iter_mut().zip([hit.u, hit.v]) {
        *weight = select(wins, x * inverse, *weight);
    }
    groups.inst[g] = merge(wins, inst, groups.inst[g]);
    wins.any()
}
