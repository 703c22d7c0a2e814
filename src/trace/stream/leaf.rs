//! Leaves: a chunk's rays against one block of primitives.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::walk::Walk;
use super::{due, sift};
use crate::bvh::Child;
use crate::lanes::{LaneMask, Lanes, Real, map3};
use crate::ray::{Counters, HitPacket, Packet};
use crate::scene::world::{Class, Object};
use crate::shape::{BLOCK, Block, Facts, Triangle};
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
    if walk.sieve {
        if ANY && rays.count_ones() < due::FEW {
            if walk.due.add(child, rays) {
                due::test::<V::Scalar, COUNT>(object, inst, chunk, walk);
            }
        } else {
            sift::block::<V::Scalar, ANY, COUNT>(object, inst, chunk, walk, child, rays);
        }
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
    sparse::<V::Scalar, ANY, COUNT>(object, inst, chunk, walk, child, few);
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

/// Rays that are to be looked at closer, with which triangles of a block.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Closer<S> {
    /// Their edge functions with all triangles.
    edges: [[[S; BLOCK]; 3]; RAYS],
    /// Whatever the caller knows them by.
    of: [u8; RAYS],
    slots: [u8; RAYS],
    len: usize,
}

impl<S: Real> Default for Closer<S> {
    fn default() -> Self {
        Self { edges: [[[S::ZERO; BLOCK]; 3]; RAYS], of: [0; RAYS], slots: [0; RAYS], len: 0 }
    }
}

impl<S: Real> Closer<S> {
    /// Nothing is to be looked at.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len.min(RAYS)
    }

    /// What the caller knows number `at` by.
    #[inline(always)]
    pub fn of(&self, at: usize) -> usize {
        self.of[at].into()
    }

    /// Tests a ray against the first `count` triangles of a block and adds it, as `of`, if it may hit some. Always writes it and
    /// takes it back if there are none: whether there are is a surprise every time.
    #[inline(always)]
    pub fn add(&mut self, of: usize, chunk: &Chunk<S>, best: &Best<S>, ray: usize, (block, count): (&Block<S, 9>, u8)) {
        let (maybe, edges) = Triangle::candidates(&chunk.turned(ray), chunk.t_min[ray], best.t[ray], block);
        let slots = maybe & ((1 << count) - 1);
        let at = self.len & (RAYS - 1);
        (self.of[at], self.slots[at]) = (of as u8, slots as u8);
        self.edges[at].iter_mut().zip(edges).for_each(|(to, edge)| edge.store(to));
        self.len = at + usize::from(slots != 0);
    }

    /// Looks at number `at`, which is `ray`, and keeps what it hits.
    #[inline(always)]
    pub fn look<const ANY: bool>(
        &self,
        at: usize,
        chunk: &Chunk<S>,
        best: &mut Best<S>,
        ray: usize,
        (block, facts): (&Block<S, 9>, &Facts<S::Octo>),
        inst: u32,
    ) {
        let edges = map3(self.edges[at], |edge| S::Octo::load(&edge));
        let slots = self.slots[at].into();
        let found = Triangle::look_closer(&chunk.splat(ray), block, facts, slots, edges, chunk.flat);
        let wanted = (found.hit & found.t.cmp_le(S::Octo::splat(best.t[ray]))).bits();
        if ANY {
            best.done |= Set::from(wanted != 0) << ray;
        } else if wanted != 0 {
            best.take(ray, wanted, &found, &block.prim, inst);
        }
    }
}

/// One ray after the other against all triangles of the block; then a closer look by those that may hit some, with what
/// they need of the triangles computed once.
#[inline(always)]
fn sparse<S: Real, const ANY: bool, const COUNT: bool>(
    object: &Object<S>,
    inst: u32,
    chunk: &Chunk<S>,
    walk: &mut Walk<S>,
    child: Child,
    rays: Set,
) {
    let block = &object.triangles[child.index as usize];
    let Walk { best, closer, .. } = walk;
    closer.clear();
    for half in 0..2 {
        let mut rest = (rays >> (64 * half)) as u64;
        while rest != 0 {
            let ray = (64 * half + rest.trailing_zeros() as usize) & (RAYS - 1);
            rest &= rest - 1;
            closer.add(ray, chunk, best, ray, (block, child.count));
        }
    }
    if COUNT {
        count(walk.counters, child.count, rays.count_ones());
    }
    if closer.len() == 0 {
        return;
    }
    let facts = Facts::of_block(block);
    for at in 0..closer.len() {
        let ray = closer.of(at) & (RAYS - 1);
        closer.look::<ANY>(at, chunk, best, ray, (block, &facts), inst);
    }
}

/// Counts tests of single rays against all triangles of a block.
pub fn count(counters: &mut Counters, triangles: u8, rays: u32) {
    let tests = u64::from(triangles) * u64::from(rays);
    counters.leaves += u64::from(rays);
    counters.prims += tests;
    counters.prim_lanes_active += tests;
    counters.prim_lanes_total += tests;
}
