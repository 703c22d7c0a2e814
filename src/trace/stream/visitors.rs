//! Rays of another engine, as they come: a chunk in an object's space that is filled vector by vector.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::leaf::Closer;
use super::sift::Sifted;
use super::walk::{Pile, Room, Walk};
use crate::lanes::{Lanes, Real};
use crate::ray::{Counters, HitPacket, Packet};
use crate::scene::world::World;
use crate::trace::query::Stack;

/// Most rays that are traced together.
pub const MOST: usize = RAYS;

/// Vectors of rays that another engine takes through an object, some at a time.
#[derive(Clone, Debug)]
pub struct Visitors<S> {
    chunk: Chunk<S>,
    best: Best<S>,
    waiting: Pile<S>,
    closer: Closer<S>,
    sifted: Sifted<S>,
    rays: Set,
}

impl<S: Real> Default for Visitors<S> {
    fn default() -> Self {
        let (waiting, closer, sifted) = (Pile::default(), Closer::default(), Sifted::default());
        Self { chunk: Chunk::default(), best: Best::default(), waiting, closer, sifted, rays: 0 }
    }
}

impl<S: Real> Visitors<S> {
    /// Makes room for a world whose [`World::stack_bound`](crate::scene::world::World::stack_bound) is `bound`.
    pub fn reserve(&mut self, bound: usize) {
        self.waiting.reserve(bound);
    }

    /// Puts vector `k` of those that [`Visitors::trace`] is for; rays of `lanes` are traced up to `t_max`.
    #[inline(always)]
    pub fn put<V: Lanes<Scalar = S>>(&mut self, k: usize, (packet, sheared): (&Packet<V>, bool), t_max: V, lanes: u32) {
        if k == 0 {
            self.chunk.start(RAYS, sheared);
            self.rays = 0;
            self.best.done = 0;
        }
        self.best.clear(k * V::N, V::N);
        self.chunk.take(k * V::N, packet, V::ALL);
        t_max.store(&mut self.best.t[k * V::N..]);
        self.rays |= Set::from(lanes) << (k * V::N);
    }

    /// Traces the first `vectors` of them through the object of instance `inst`, in its space.
    pub fn trace<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        vectors: usize,
        (world, inst): (&World<S>, u32),
        stack: &mut Stack<S>,
        counters: &mut Counters,
    ) {
        let Self { chunk, best, waiting, closer, sifted, rays } = self;
        chunk.len = vectors * V::N;
        chunk.find_common::<V>(*rays);
        let object = &world.objects[world.instances[inst as usize].object as usize];
        let room = Room { waiting, closer, sifted };
        let mut walk = Walk::new(best, room, stack, counters, !world.kinds.large);
        walk.octants::<V, ANY, COUNT>(object, inst, chunk, *rays);
    }

    /// What the rays of vector `k` hit.
    #[inline(always)]
    pub fn hits<V: Lanes<Scalar = S>>(&self, k: usize) -> HitPacket<V> {
        self.best.packet(k * V::N)
    }

    /// Any-hit: the rays of vector `k` that hit something.
    #[inline(always)]
    pub fn done<V: Lanes<Scalar = S>>(&self, k: usize) -> u32 {
        (self.best.done >> (k * V::N)) as u32 & V::ALL
    }
}
