//! Rays that wait to be tested against triangles (any-hit).
//!
//! Most leaves are met by one ray of a chunk or two, and whether these hit something is a surprise every time. Rays of several
//! leaves together are one loop, whose parts do not wait for each other, and the blocks have come from memory by then. A ray goes
//! on through the tree meanwhile, in vain if it hits something; so not many wait, and none where few rays go through an object.

use super::chunk::{Chunk, RAYS, Set};
use super::leaf;
use super::walk::Walk;
use crate::bvh::Child;
use crate::lanes::Real;
use crate::scene::world::Object;
use crate::shape::Facts;

/// From this many rays on a block is tested at once.
pub const FEW: u32 = 4;

/// From this many rays of an object on some may wait.
pub const LEAST: u32 = 16;

/// Pairs of a ray and a block that are tested together.
const TOGETHER: usize = 32;

/// Most pairs that are listed.
const ROOM: usize = TOGETHER + FEW as usize;

/// Pairs of a ray and a block that wait to be tested.
#[derive(Clone, Debug)]
pub struct Due {
    ray: [u8; ROOM],
    /// Number of triangles in the block.
    count: [u8; ROOM],
    block: [u32; ROOM],
    len: usize,
}

impl Default for Due {
    fn default() -> Self {
        Self { ray: [0; ROOM], count: [0; ROOM], block: [0; ROOM], len: 0 }
    }
}

impl Due {
    /// Adds less than [`FEW`] rays with the block that `leaf` refers to; whether it is time to test them all.
    #[inline(always)]
    pub fn add(&mut self, leaf: Child, rays: Set) -> bool {
        let (at, mut rest) = (self.len.min(TOGETHER), rays);
        // As if there were as many as there may be: how many there are is a surprise.
        for at in at..at + FEW as usize - 1 {
            (self.ray[at], self.count[at], self.block[at]) = (rest.trailing_zeros() as u8, leaf.count, leaf.index);
            rest &= rest.wrapping_sub(1);
        }
        self.len = at + rays.count_ones() as usize;
        self.len >= TOGETHER
    }

    /// Whether none wait.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// Tests all pairs that wait: first one after the other against all triangles of their blocks; then a closer look by those that may
/// hit some, with what they need of the triangles computed once for rays of the same block that follow each other.
#[inline(never)]
pub fn test<S: Real, const COUNT: bool>(object: &Object<S>, inst: u32, chunk: &Chunk<S>, walk: &mut Walk<S>) {
    let Walk { due, best, closer, counters, .. } = walk;
    closer.clear();
    for pair in 0..due.len.min(ROOM) {
        let ray = usize::from(due.ray[pair]) & (RAYS - 1);
        let block = &object.triangles[due.block[pair] as usize];
        closer.add(pair, chunk, best, ray, (block, due.count[pair]));
        if COUNT {
            leaf::count(counters, due.count[pair], 1);
        }
    }
    due.len = 0;
    if closer.len() == 0 {
        return;
    }
    let mut of = due.block[closer.of(0)];
    let mut facts = Facts::of_block(&object.triangles[of as usize]);
    for at in 0..closer.len() {
        let pair = closer.of(at);
        let (ray, number) = (usize::from(due.ray[pair]) & (RAYS - 1), due.block[pair]);
        let block = &object.triangles[number as usize];
        if number != of {
            (of, facts) = (number, Facts::of_block(block));
        }
        closer.look::<true>(at, chunk, best, ray, (block, &facts), inst);
    }
}
