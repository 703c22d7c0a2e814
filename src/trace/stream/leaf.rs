//! Leaves: a chunk's rays against one block of primitives.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set, gathered};
use super::walk::Walk;
use super::{due, sift};
use crate::bvh::Child;
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real, map3};
use crate::ray::{Counters, HitPacket, INVALID_ID, Packet};
use crate::scene::world::{Class, Object};
use crate::shape::{BLOCK, Block, Facts, Triangle};
use crate::trace::leaf;
use crate::trace::query::Query;

/// From this many rays in a vector on triangles are tested against it.
const DENSE: u32 = 8;

/// From this many times as many vectors on as they would fill, rays that lie scattered over them are brought together.
const SCATTERED: usize = 2;

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
        // Closest hits only where two rays fit a register: else they wait for nothing.
        let may_wait = ANY || const { <<V::Scalar as Real>::Children as Lanes>::N > BLOCK };
        if may_wait && rays.count_ones() < due::FEW {
            if walk.due.add::<ANY>(child, rays) {
                due::test::<V::Scalar, ANY, COUNT>(object, inst, chunk, walk);
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

/// Runs a packet kernel on `rays`, vector by vector, or, if they lie scattered over many, side by side.
#[inline(always)]
pub fn vectors<V: Lanes, const ANY: bool, const COUNT: bool>(
    chunk: &Chunk<V::Scalar>,
    walk: &mut Walk<V::Scalar>,
    rays: Set,
    kernel: impl Fn(&Packet<V>, &mut Query<V, ANY, COUNT>, u32),
) {
    let lanes = |at: usize| (rays >> at) as u32 & V::ALL;
    let touched = (0..chunk.len).step_by(V::N).map(|at| usize::from(lanes(at) != 0)).sum::<usize>();
    if touched >= SCATTERED * (rays.count_ones() as usize).div_ceil(V::N) {
        return packed(chunk, walk, rays, kernel);
    }
    for at in (0..chunk.len).step_by(V::N) {
        let lanes = lanes(at);
        if lanes != 0 {
            vector(chunk, walk, at, lanes, &kernel);
        }
    }
}

/// Runs a packet kernel on `rays`, brought together in as few vectors as they fill.
#[inline(always)]
fn packed<V: Lanes, const ANY: bool, const COUNT: bool>(
    chunk: &Chunk<V::Scalar>,
    walk: &mut Walk<V::Scalar>,
    rays: Set,
    kernel: impl Fn(&Packet<V>, &mut Query<V, ANY, COUNT>, u32),
) {
    let mut rest = rays;
    while rest != 0 {
        let (mut of, mut count) = ([0; MAX_LANES], 0);
        while rest != 0 && count < V::N {
            of[count] = rest.trailing_zeros() as u8;
            (rest, count) = (rest & (rest - 1), count + 1);
        }
        let of = &of[..count];
        let (packet, t) = (chunk.gathered::<V>(of), gathered(&walk.best.t, of));
        let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t), walk.stack, walk.counters);
        kernel(&packet, &mut query, V::ALL >> (V::N - count));
        let (hit, mut done) = (query.hit, query.done);
        if ANY {
            while done != 0 {
                walk.best.done |= 1 << of[done.trailing_zeros() as usize];
                done &= done - 1;
            }
            continue;
        }
        for (lane, &ray) in of.iter().enumerate() {
            if hit.prim[lane] != INVALID_ID {
                let numbers = [hit.t.lane(lane), hit.u.lane(lane), hit.v.lane(lane)];
                walk.best.offer(ray.into(), numbers, hit.prim[lane], hit.inst[lane]);
            }
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

#[cfg(test)]
mod tests {
    use super::super::chunk::row;
    use super::super::sift::Sifted;
    use super::super::walk::{Pile, Room};
    use super::*;
    use crate::lanes::rows::{Row, to_rows};
    use crate::lanes::{f32x16, f64x8};
    use crate::ray::{Candidate, Rays};
    use crate::trace::query::Stack;

    /// Takes every `step`th ray of a chunk, whose numbers tell which it is, to a kernel. Returns how many vectors that gets.
    fn visit<V: Lanes, const ANY: bool>(step: usize, sheared: bool) -> usize {
        let number = |i: usize| V::Scalar::from_f64(i as f64);
        let mut all = Rays::<V::Scalar>::new(RAYS);
        for i in 0..RAYS {
            // Along no face: of those all is prepared.
            let dir = [number(1), number(2 + i % 2), number(1 + i)];
            all.set(i, [number(i), number(0), number(0)], dir, number(i), number(1000));
        }
        let (mut rows, places) = (vec![Row::ZERO; RAYS], (0..RAYS as u32).collect::<Vec<_>>());
        for at in (0..RAYS).step_by(V::N) {
            let (packet, t_max, _) = Packet::<V>::load(&all, at);
            to_rows(row(&packet, t_max), &mut rows[at..]);
        }
        let (mut chunk, mut best) = (Chunk::default(), Best::default());
        chunk.gather::<V, ANY>(&rows, &places, &mut best.t, sheared);
        best.start();
        let wanted = (0..RAYS).step_by(step).fold(0, |set, i| set | 1 << i);
        // Of two hits as far the smaller number stays, whoever comes first.
        best.offer(0, [number(0), number(0), number(0)], 0, 3);
        best.offer(step, [number(step), number(0), number(0)], 9999, 3);
        let (mut waiting, mut closer, mut sifted) = (Pile::default(), Closer::default(), Sifted::default());
        let (mut stack, mut counters) = (Stack::default(), Counters::default());
        let room = Room { waiting: &mut waiting, closer: &mut closer, sifted: &mut sifted };
        let mut walk = Walk::new(&mut best, room, &mut stack, &mut counters, true);
        let (calls, seen) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        vectors::<V, ANY, false>(&chunk, &mut walk, wanted, |packet, query, lanes| {
            calls.set(calls.get() + 1);
            for k in (0..V::N).filter(|k| lanes >> k & 1 != 0) {
                let (got, i) = (packet.single(k), packet.org[0].lane(k).to_f64() as usize);
                let ([org, dir], [t_min, _], _) = Packet::<V::Scalar>::read(&all, i);
                let want = Packet::prepared(org, dir, t_min, sheared);
                assert_eq!(format!("{got:?}"), format!("{want:?}"), "ray {i}");
                assert_eq!(seen.get() >> i & 1, 0, "ray {i} comes once");
                seen.set(seen.get() | 1 << i);
            }
            // Every other one of the rays hits where it starts.
            let hits = |k: usize| (packet.org[0].lane(k).to_f64() as usize).is_multiple_of(2 * step);
            let hit = (0..V::N).fold(0, |bits, k| bits | u32::from(hits(k)) << k);
            let found = Candidate { hit: V::Mask::from_bits(hit), t: packet.t_min, u: packet.org[0], v: packet.dir[1] };
            query.take(lanes, &found, 7, 3);
        });
        assert_eq!(seen.get(), wanted);
        for i in 0..RAYS {
            let hits = wanted >> i & 1 != 0 && i % (2 * step) == 0;
            if ANY {
                assert_eq!(best.done >> i & 1 != 0, hits, "ray {i}");
                continue;
            }
            let hit = best.packet::<V>(i / V::N * V::N).single(i % V::N);
            let want = match (i, hits) {
                (0, _) => (number(0), number(0), 0),
                (_, true) => (number(i), number(i), 7),
                _ if i == step => (number(i), number(0), 9999),
                _ => (number(1000), number(0), INVALID_ID),
            };
            assert_eq!((hit.t, hit.u, hit.prim[0]), want, "ray {i}");
        }
        calls.get()
    }

    #[test]
    fn scattered_rays_are_brought_together() {
        for sheared in [false, true] {
            assert_eq!([1, 2, 8, 16].map(|step| visit::<f32x16, false>(step, sheared)), [8, 4, 1, 1]);
            assert_eq!([1, 2, 8, 16].map(|step| visit::<f32x16, true>(step, sheared)), [8, 4, 1, 1]);
            assert_eq!([1, 2, 8, 16].map(|step| visit::<f64x8, false>(step, sheared)), [16, 8, 2, 1]);
        }
    }
}
