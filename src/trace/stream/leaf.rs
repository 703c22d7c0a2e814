//! Leaves: a chunk's rays against one block of primitives.

use super::chunk::{Chunk, RAYS, Set};
use super::walk::Walk;
use crate::bvh::Child;
use crate::lanes::{Lanes, Real, each};
use crate::ray::{HitPacket, Packet};
use crate::scene::world::{Class, Object};
use crate::shape::{BLOCK, Triangle};
use crate::trace::leaf;
use crate::trace::query::Query;

/// From this many rays in a vector on triangles are tested against it.
const DENSE: u32 = 8;

/// Tests the block a leaf refers to.
#[inline(always)]
pub fn block<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    inst: u32,
    chunk: &Chunk<V::Scalar>,
    walk: &mut Walk<V::Scalar>,
    child: Child,
    rays: Set,
) {
    let kernel = |packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, lanes: u32| {
        leaf::block(object, inst, packet, query, child, lanes);
    };
    if !matches!(Class::ALL[usize::from(child.class)], Class::Triangle) {
        vectors(chunk, walk, rays, kernel);
        return;
    }
    let mut few = rays;
    if rays.count_ones() >= DENSE {
        for at in (0..chunk.len).step_by(V::N) {
            let lanes = (rays >> at) as u32 & V::ALL;
            if lanes.count_ones() < DENSE {
                continue;
            }
            // A vector tests rays of one dominant axis at once.
            for dominant in chunk.dominant {
                let lanes = lanes & (dominant >> at) as u32;
                if lanes.count_ones() >= DENSE {
                    few &= !(Set::from(lanes) << at);
                    vector(chunk, walk, at, lanes, kernel);
                }
            }
        }
    }
    if few != 0 {
        sparse::<V::Scalar, ANY, COUNT>(object, inst, chunk, walk, child, few);
    }
}

/// Runs a packet kernel on the vectors of a chunk that hold some of `rays`.
#[inline(always)]
pub fn vectors<V: Lanes, const ANY: bool, const COUNT: bool>(
    chunk: &Chunk<V::Scalar>,
    walk: &mut Walk<V::Scalar>,
    rays: Set,
    kernel: impl Fn(&Packet<V>, &mut Query<V, ANY, COUNT>, u32),
) {
    for at in (0..chunk.len).step_by(V::N) {
        let lanes = (rays >> at) as u32 & V::ALL;
        if lanes != 0 {
            vector(chunk, walk, at, lanes, &kernel);
        }
    }
}

/// Runs a packet kernel on `lanes` of the vector of rays that starts at `at`.
#[inline(always)]
fn vector<V: Lanes, const ANY: bool, const COUNT: bool>(
    chunk: &Chunk<V::Scalar>,
    walk: &mut Walk<V::Scalar>,
    at: usize,
    lanes: u32,
    kernel: impl Fn(&Packet<V>, &mut Query<V, ANY, COUNT>, u32),
) {
    let packet = chunk.packet::<V>(at);
    let hit: HitPacket<V> = if ANY { HitPacket::new(V::load(&walk.best.t[at..])) } else { walk.best.packet(at) };
    let mut query = Query::<V, ANY, COUNT>::new(hit, walk.stack, walk.counters);
    kernel(&packet, &mut query, lanes);
    let (hit, done) = (query.hit, query.done);
    if ANY {
        walk.best.done |= Set::from(done) << at;
    } else {
        walk.best.put(at, &hit);
    }
}

/// Every ray with every triangle, and what is written past the last of them.
const ROOM: usize = (RAYS + 1) * BLOCK;

/// The set bits of each byte, ascending, then zeros.
const SET_BITS: [[u8; BLOCK]; 256] = {
    let mut table = [[0; BLOCK]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < BLOCK {
            if mask >> bit & 1 != 0 {
                table[mask][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    table
};

/// Rays of a chunk with triangles of a block that are to be looked at closer.
#[derive(Clone, Debug)]
pub struct Pairs<S> {
    /// Rays by their order here.
    turn: [u8; ROOM],
    slot: [u8; ROOM],
    len: usize,
    /// The rays, and their edge functions with all triangles.
    ray: [u8; RAYS],
    edges: [[[S; BLOCK]; 3]; RAYS],
}

impl<S: Real> Default for Pairs<S> {
    fn default() -> Self {
        let edges = [[[S::ZERO; BLOCK]; 3]; RAYS];
        Self { turn: [0; ROOM], slot: [0; ROOM], len: 0, ray: [0; RAYS], edges }
    }
}

impl<S: Real> Pairs<S> {
    /// Adds a ray, the `turn`-th, with the triangles whose bits are set. Always writes eight and takes back those that are too many:
    /// how many there are is a surprise every time.
    #[inline(always)]
    fn add(&mut self, turn: usize, ray: usize, slots: u32, edges: [S::Octo; 3]) {
        let turn = turn & (RAYS - 1);
        self.ray[turn] = ray as u8;
        self.edges[turn].iter_mut().zip(edges).for_each(|(to, edge)| edge.store(to));
        let slots = slots as usize & 0xff;
        let at = self.len.min(ROOM - BLOCK);
        self.turn[at..at + BLOCK].copy_from_slice(&[turn as u8; BLOCK]);
        self.slot[at..at + BLOCK].copy_from_slice(&SET_BITS[slots]);
        self.len = at + slots.count_ones() as usize;
    }
}

/// One ray after the other against all triangles of the block; then, pair by pair, a closer look at those that it may
/// hit.
#[inline(always)]
fn sparse<S: Real, const ANY: bool, const COUNT: bool>(
    object: &Object<S>,
    inst: u32,
    chunk: &Chunk<S>,
    walk: &mut Walk<S>,
    child: Child,
    mut rays: Set,
) {
    let block = &object.triangles[child.index as usize];
    let slots = (1 << child.count) - 1;
    walk.pairs.len = 0;
    let mut turn = 0;
    while rays != 0 {
        let ray = rays.trailing_zeros() as usize & (RAYS - 1);
        rays &= rays - 1;
        let (maybe, edges) = Triangle::candidates(&chunk.turned(ray), chunk.t_min[ray], walk.best.t[ray], block);
        walk.pairs.add(turn, ray, slots & maybe, edges);
        turn += 1;
        if COUNT {
            walk.counters.leaves += 1;
            walk.counters.prims += u64::from(child.count);
            walk.counters.prim_lanes_active += u64::from(child.count);
            walk.counters.prim_lanes_total += u64::from(child.count);
        }
    }
    for at in 0..walk.pairs.len.min(ROOM) {
        let turn = usize::from(walk.pairs.turn[at]) & (RAYS - 1);
        let (ray, slot) =
            (usize::from(walk.pairs.ray[turn]) & (RAYS - 1), usize::from(walk.pairs.slot[at]) & (BLOCK - 1));
        let edges = each(|k| walk.pairs.edges[turn][k][slot]);
        let found = Triangle::look_closer(&chunk.packet::<S>(ray), &block.get(slot), edges);
        if ANY {
            walk.best.done |= Set::from(found.hit & (found.t <= walk.best.t[ray])) << ray;
        } else {
            walk.best.take(ray, &found, block.prim[slot], inst);
        }
    }
}
