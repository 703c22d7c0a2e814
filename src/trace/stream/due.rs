//! Rays that wait to be tested against triangles by the plain test.
//!
//! Most leaves are met by one ray of a chunk or two, and whether these hit something is a surprise every time. Rays of several
//! leaves together are one loop, whose parts do not wait for each other, and the blocks have come from memory by then. A ray goes
//! on through the tree meanwhile, in vain if it hits something; so not many wait.

use super::chunk::{Chunk, RAYS, Set};
use super::leaf;
use super::walk::Walk;
use crate::bvh::Child;
use crate::lanes::{Lanes, Real};
use crate::scene::world::Object;
use crate::shape::BLOCK;
use crate::shape::sieve::{Sieve, beside};

/// From this many rays on a block is tested at once.
pub const FEW: u32 = 4;

/// Pairs of a ray and a block that are tested together, any-hit.
const TOGETHER: usize = 32;

/// The same for closest hits, which cut short the way of their rays.
const CLOSEST: usize = 6;

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
    pub fn add<const ANY: bool>(&mut self, leaf: Child, rays: Set) -> bool {
        let (at, mut rest) = (self.len.min(TOGETHER), rays);
        // As if there were as many as there may be: how many there are is a surprise.
        for at in at..at + FEW as usize - 1 {
            (self.ray[at], self.count[at], self.block[at]) = (rest.trailing_zeros() as u8, leaf.count, leaf.index);
            rest &= rest.wrapping_sub(1);
        }
        self.len = at + rays.count_ones() as usize;
        self.len >= if ANY { TOGETHER } else { CLOSEST }
    }

    /// Whether none wait.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// Tests all pairs that wait, two at once where a register holds as many lanes.
#[inline(never)]
pub fn test<S: Real, const ANY: bool, const COUNT: bool>(
    object: &Object<S>,
    inst: u32,
    chunk: &Chunk<S>,
    walk: &mut Walk<S>,
) {
    let Walk { due, best, sifted, counters, .. } = walk;
    sifted.clear();
    let (len, beside_it) = (due.len.min(ROOM), usize::from(S::Children::N > BLOCK));
    let ray = |pair: usize| usize::from(due.ray[pair]) & (RAYS - 1);
    let block = |pair: usize| &object.triangles[due.block[pair] as usize];
    let lanes = |pair: usize| (1u32 << due.count[pair]) - 1;
    for pair in (0..len).step_by(1 + beside_it) {
        let other = (pair + beside_it).min(len - 1);
        let (first, second) = (block(pair), block(other));
        let sieve = Sieve::<S::Children>::new(|f| beside(&first.fields[f], &second.fields[f]));
        let rays = [ray(pair), ray(other)];
        let sieved = sieve.test::<ANY>(&chunk.beside(&best.t, rays[0], rays[1]));
        let lanes = lanes(pair) | if other > pair { lanes(other) << BLOCK } else { 0 };
        sifted.add::<_, ANY>([pair, other], rays, (&sieved, lanes), best);
    }
    if COUNT {
        (0..len).for_each(|pair| leaf::count(counters, due.count[pair], 1));
    }
    sifted.settle::<ANY>(|pair| (block(pair), ray(pair)), inst, chunk, best);
    due.len = 0;
}
