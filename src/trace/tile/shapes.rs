//! Shapes among a tile's triangles: a leaf of spheres, boxes, cylinders or cones against the rays of some groups, sixteen
//! at a time, by the common formula. What it finds becomes a depth in the frame, and is weighed against the tile's other
//! hits as their own are.

use super::exact::Exact;
use super::groups::Groups;
use super::own::{Id, occlude};
use super::{GROUPS, Mask, SET, V, select};
use crate::bvh::Child;
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes};
use crate::ray::slab::Interval;
use crate::ray::{Counters, HitPacket, INVALID_ID, Packet};
use crate::scene::world::Object;
use crate::trace::leaf;
use crate::trace::query::{Query, Stack};

/// The rays of a group in the space of an instance, their ends or `limit`, whichever is nearer, and the lanes that are traced
/// and meet its box.
#[inline(always)]
pub fn enter(exact: &Exact, inst: u32, g: usize, limit: V) -> (Packet<V>, V, u32) {
    let (packet, t_max) = exact.bundle.packet(g);
    // What is no number limits nothing.
    let t_max = limit.fast_min(t_max);
    let (instance, tame) = (&exact.world.instances[inst as usize], exact.bundle.tame[g]);
    if instance.identity {
        return (packet, t_max, tame);
    }
    let interval = Interval::of(&packet, instance.bounds.lo, instance.bounds.hi);
    let meets = interval.meets(packet.t_min, t_max).bits();
    (packet.into_local(&instance.to_local, interval.near), t_max, tame & meets)
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
        let (packet, t_max, lanes) = enter(exact, inst, g, V::splat(f32::INFINITY));
        let lanes = lanes & !groups.done(g, lanes);
        let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t_max), stack, counters);
        leaf::block(object, inst, &packet, &mut query, leaf, lanes);
        let (hit, done) = (query.hit, query.done);
        let found = match ANY {
            true => occlude(groups, g, Mask::from_bits(done)),
            false => take(groups, g, &hit, inst),
        };
        touched |= u32::from(found) << (g / SET);
    }
    if touched != 0 {
        groups.refresh::<N>(touched);
    }
}

/// Keeps the hits of a packet where they are a group's nearest; whether any is.
pub fn take(groups: &mut Groups, g: usize, hit: &HitPacket<V>, inst: u32) -> bool {
    let inverse = (groups.of[g].slowness / hit.t).fast_min(V::splat(f32::MAX));
    let mut rest = !positions(&hit.prim, INVALID_ID) & V::ALL;
    let mut any = false;
    while rest != 0 {
        let id = Id { inst, prim: hit.prim[rest.trailing_zeros() as usize & 15] };
        let same = positions(&hit.prim, id.prim) & rest;
        rest &= !same;
        let best = groups.of[g].inv_lo;
        let tie = best.cmp_eq(inverse) & id.is_not_after::<true>(groups, g);
        let wins = Mask::from_bits(same) & (best.cmp_lt(inverse) | tie);
        groups.of[g].inv_lo = select(wins, inverse, best);
        id.name::<true>(groups, g, wins);
        for (weight, x) in groups.of[g].weights.iter_mut().zip([hit.u, hit.v]) {
            *weight = select(wins, x * inverse, *weight);
        }
        any |= wins.any();
    }
    any
}
