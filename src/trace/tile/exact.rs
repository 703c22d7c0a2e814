//! Where the common formula has the word: doubtful pairs while a tile is traced, and the numbers of its final hits.

use super::batch::Planes;
use super::bundle::Bundle;
use super::columns::Next;
use super::groups::{Groups, NO_SLOT, bounded};
use super::{HALF_ULP, Mask, V, select};
use crate::lanes::chosen::merge;
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes, dot, each, map3};
use crate::ray::{Candidate, HitPacket, INVALID_ID, Packet};
use crate::scene::world::{Object, World};
use crate::shape::Triangle;

/// Rounding of [`start_beyond`] and of what the common formula makes of the same numbers, relative.
const START: f32 = 32.0 * HALF_ULP;

/// What the common formula needs: the rays as they came and the triangles as they are stored.
#[derive(Debug)]
pub struct Exact<'a> {
    /// The rays.
    pub bundle: &'a Bundle<'a>,
    /// What is traced.
    pub world: &'a World<f32>,
    /// The triangles, if the world is one object.
    pub object: &'a Object<f32>,
    /// The rays that come next.
    pub next: Next<'a>,
}

/// A group's final hits.
#[derive(Debug)]
pub struct Final {
    /// The hits.
    pub hit: HitPacket<V>,
    /// Lanes where the common formula denies what the tile found: none, if the error bounds of the tile's arithmetic
    /// hold.
    pub denied: u32,
}

impl Exact<'_> {
    fn prim(&self, slot: u32) -> u32 {
        self.object.triangles[(slot >> 3) as usize].prim[(slot & 7) as usize]
    }

    /// The lanes of `lanes` that hit a triangle at all, and where.
    #[inline(always)]
    fn meet(&self, packet: &Packet<V>, slot: u32, lanes: u32, mut found: impl FnMut(&Candidate<V>, u32, u32)) {
        let block = &self.object.triangles[(slot >> 3) as usize];
        Triangle::intersect(packet, V::splat(f32::INFINITY), block, 1 << (slot & 7), lanes, &mut found);
    }

    /// The final hits of a group: what the common formula says of its winners.
    #[inline(always)]
    pub fn finish(&self, groups: &Groups, g: usize, packet: &Packet<V>, t_max: V) -> Final {
        let slots = &groups.of[g].slot;
        let none = V::splat(f32::from_bits(INVALID_ID));
        let zero = V::constant(0.0);
        let (mut t, mut u, mut v, mut prims) = (t_max, zero, zero, none);
        let mut rest = !positions(slots, NO_SLOT) & V::ALL;
        let mut denied = rest;
        while rest != 0 {
            let slot = slots[rest.trailing_zeros() as usize & 15];
            let same = positions(slots, slot);
            rest &= !same;
            self.meet(packet, slot, same, |found, lanes, prim| {
                let taken = found.hit & found.t.cmp_le(t_max) & Mask::from_bits(lanes);
                t = select(taken, found.t, t);
                u = select(taken, found.u, u);
                v = select(taken, found.v, v);
                // Numbers are moved as floats: selection copies bits.
                prims = select(taken, V::splat(f32::from_bits(prim)), prims);
                denied &= !taken.bits();
            });
        }
        let mut hit = HitPacket::new(t);
        (hit.u, hit.v) = (u, v);
        hit.prim = bytemuck::cast(prims.to_array());
        for lane in 0..V::N {
            hit.inst[lane] = if hit.prim[lane] == INVALID_ID { INVALID_ID } else { 0 };
        }
        Final { hit, denied }
    }
}

/// One triangle against the rays of one group: takes certain hits. Returns their lanes, and the lanes where only the
/// common formula can tell.
#[inline(always)]
pub fn certain_pair<const ANY: bool, const BEHIND: bool>(
    groups: &mut Groups,
    planes: &Planes,
    g: usize,
    i: usize,
    slot: u32,
) -> (u32, u32) {
    let (s, t) = (groups.of[g].s, groups.of[g].t);
    let (inv_lo, inv_hi) = (groups.of[g].inv_lo, groups.of[g].inv_hi);
    let value = |k: usize| {
        let [x, y, z] = each(|x| V::splat(planes.linear[k][x][i]));
        x.mul_add(s, y.mul_add(t, z))
    };
    let edge = value(0).fast_min(value(1)).fast_min(value(2));
    let inv_z = value(3);
    let (hi, lo) = (inv_z * V::splat(planes.most[i]), inv_z * V::splat(planes.least[i]));
    let mut possible = V::splat(planes.outside[i]).cmp_le(edge) & inv_lo.cmp_le(hi);
    let mut ahead = hi.cmp_lt(V::splat(groups.cap));
    if BEHIND {
        let (beyond, doubt) = start_beyond(groups, planes, g, i);
        possible = possible & beyond.cmp_le(doubt);
        ahead = ahead & beyond.cmp_lt(-doubt);
    }
    let certain = possible & V::splat(planes.inside[i]).cmp_le(edge) & inv_hi.cmp_lt(lo) & ahead;
    if ANY {
        groups.of[g].inv_lo = select(certain, V::splat(f32::INFINITY), inv_lo);
    } else {
        groups.of[g].inv_lo = select(certain, lo, inv_lo);
        groups.of[g].inv_hi = select(certain, hi, inv_hi);
        groups.of[g].slot = merge(certain, slot, groups.of[g].slot);
    }
    (certain.bits(), possible.bits() & !certain.bits())
}

/// How far segments start beyond a triangle's plane as seen from their common point, in some unit, and its rounding error
/// together with that of the common formula: both are sums of three products with differences of coordinates.
#[inline(always)]
fn start_beyond(groups: &Groups, planes: &Planes, g: usize, i: usize) -> (V, V) {
    let (normal, way) = planes.to_starts(i, &groups.of[g].start);
    let beyond = dot(normal, way);
    let size = dot(map3(normal, V::abs), map3(way, V::abs));
    (beyond, size.mul_add(V::splat(START), V::splat(planes.facing[i])))
}

/// Decides by the common formula whether a triangle is hit by `lanes` of a group, and whether it is nearer than what
/// they hit so far, by the tie rule if need be.
#[cold]
#[inline(never)]
pub fn decide<const ANY: bool>(groups: &mut Groups, exact: &Exact, g: usize, slot: u32, lanes: u32) {
    let (packet, t_max) = exact.bundle.packet(g);
    let mut hits = 0;
    let mut t = t_max;
    exact.meet(&packet, slot, lanes, |found, lanes, _| {
        let hit = (found.hit & found.t.cmp_le(t_max)).bits() & lanes;
        t = select(Mask::from_bits(hit), found.t, t);
        hits |= hit;
    });
    if ANY {
        let done = Mask::from_bits(hits);
        groups.of[g].inv_lo = select(done, V::splat(f32::INFINITY), groups.of[g].inv_lo);
        return;
    }
    if hits == 0 {
        return;
    }
    let prim = exact.prim(slot);
    let mut wins = hits;
    let mut rest = hits & !positions(&groups.of[g].slot, NO_SLOT);
    while rest != 0 {
        let old = groups.of[g].slot[rest.trailing_zeros() as usize & 15];
        let same = rest & positions(&groups.of[g].slot, old);
        rest &= !same;
        exact.meet(&packet, old, same, |found, lanes, old_prim| {
            let nearer = t.cmp_lt(found.t).bits();
            let tie = if prim < old_prim { t.cmp_eq(found.t).bits() } else { 0 };
            wins &= nearer | tie | !(lanes & found.hit.bits());
        });
    }
    // From here on the depth is known as well as the common formula knows it.
    let inverse = groups.of[g].slowness / groups.way(g, t);
    let loose = groups.loose;
    let mask = Mask::from_bits(wins);
    groups.of[g].inv_lo = select(mask, bounded(inverse) * V::splat(1.0 - loose), groups.of[g].inv_lo);
    groups.of[g].inv_hi = select(mask, inverse * V::splat(1.0 + loose), groups.of[g].inv_hi);
    for lane in 0..V::N {
        if wins >> lane & 1 != 0 {
            groups.of[g].slot[lane] = slot;
        }
    }
}
