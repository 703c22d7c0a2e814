//! Rays of a chunk inside an instance, in its space: side by side, so that few rays take few vectors and few lines of the cache.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::region::Extent;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::scene::world::Instance;

/// Up to this many rays go through an instance together whatever their octants.
const MIXED: usize = 32;

/// Rays that go through an instance, and what they have found.
#[derive(Clone, Debug)]
pub struct Inside<S> {
    pub chunk: Chunk<S>,
    pub best: Best<S>,
    /// Where each is in the chunk that it is of.
    of: [u8; RAYS],
}

impl<S: Real> Default for Inside<S> {
    fn default() -> Self {
        Self { chunk: Chunk::default(), best: Best::default(), of: [0; RAYS] }
    }
}

impl<S: Real> Inside<S> {
    /// Takes in `rays`, which are some, of `from`, with what they have found so far. Returns those that meet the instance's box, as
    /// they are numbered here.
    #[inline(always)]
    pub fn enter<V: Lanes<Scalar = S>>(
        &mut self,
        (from, best): (&Chunk<S>, &Best<S>),
        instance: &Instance<S>,
        rays: Set,
    ) -> Set {
        let many = rays.count_ones() as usize;
        self.chunk.start(many, from.sheared);
        self.chunk.mixed = from.mixed || many <= MIXED;
        self.copy((from, best), rays);
        match many <= <S::Octo as Lanes>::N {
            true => self.enter_vectors::<S::Octo>(from, instance),
            false => self.enter_vectors::<V>(from, instance),
        }
    }

    /// Copies rays as they are, and what they have found.
    #[inline(always)]
    fn copy(&mut self, (from, best): (&Chunk<S>, &Best<S>), rays: Set) {
        let Self { chunk, best: own, of } = self;
        own.done = 0;
        let mut to = 0;
        for half in 0..2 {
            let mut rest = (rays >> (64 * half)) as u64;
            while rest != 0 {
                let i = (64 * half + rest.trailing_zeros() as usize) & (RAYS - 1);
                rest &= rest - 1;
                for a in 0..3 {
                    chunk.org[a][to] = from.org[a][i];
                    chunk.dir[a][to] = from.dir[a][i];
                    chunk.rcp[a][to] = from.rcp[a][i];
                }
                chunk.t_min[to] = from.t_min[i];
                own.copy(to, best, i);
                of[to] = i as u8;
                to = (to + 1) & (RAYS - 1);
            }
        }
    }

    #[inline(always)]
    fn enter_vectors<V: Lanes<Scalar = S>>(&mut self, from: &Chunk<S>, instance: &Instance<S>) -> Set {
        let (mut inside, mut extent) = (0, Extent::<V>::none());
        for at in (0..self.chunk.len).step_by(V::N) {
            let lanes = (Set::MAX >> (RAYS - self.chunk.len) >> at) as u32 & V::ALL;
            let (packet, t) = (self.chunk.packet::<V>(at), V::load(&self.best.t[at..]));
            let interval = Interval::of(&packet, instance.bounds.lo, instance.bounds.hi);
            let meets = interval.meets(packet.t_min, t).bits() & lanes;
            let local: Packet<V> = packet.brought_in(&instance.to_local, interval.near, from.sheared);
            self.chunk.take(at, &local, meets);
            if self.chunk.mixed {
                self.chunk.take_octants(at, &local);
            }
            if from.region.is_some() {
                extent.add(local.org, local.dir, [local.t_min, t], meets);
            }
            inside |= Set::from(meets) << at;
        }
        self.chunk.region = from.region.is_some().then(|| extent.region());
        inside
    }

    /// Tells the rays where they come from what they have found in instance `inst`, which they enter once.
    #[inline(always)]
    pub fn leave<const ANY: bool>(&self, best: &mut Best<S>, inst: u32) {
        if ANY {
            let mut rest = self.best.done;
            while rest != 0 {
                let i = rest.trailing_zeros() as usize & (RAYS - 1);
                rest &= rest - 1;
                best.done |= 1 << (self.of[i] & (RAYS - 1) as u8);
            }
            return;
        }
        for i in 0..self.chunk.len.min(RAYS) {
            if self.best.inst[i] == inst {
                best.copy(usize::from(self.of[i]) & (RAYS - 1), &self.best, i);
            }
        }
    }
}
