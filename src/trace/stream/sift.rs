//! Leaves by the sieve: rays of a chunk against a block of triangles, two at a time where a register holds as many lanes.
//!
//! Any-hit, what is certain is done and what is not is left to the common formula, so answers are its own. Closest-hit, tiles take
//! what they leave to this kernel from the plain test where that is certain of the triangle: [`Walk::plain`]. Its parameter is moved
//! into the triangle's own box, as that of the common formula is, so hits do not depend on which boxes were visited first.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::leaf;
use super::walk::Walk;
use crate::bvh::Child;
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real, each};
use crate::ray::slab::Interval;
use crate::scene::world::Object;
use crate::shape::sieve::{Sieve, Sieved, beside};
use crate::shape::{BLOCK, Block, Facts, Triangle};

/// Rays in a vector of the sieve, at most.
const BESIDE: usize = 2;

/// Most tests of a block: one for each ray where a register holds eight lanes.
const TESTS: usize = RAYS;

/// Tests that left something to do.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Sifted<S> {
    /// Way, speed and the two weights of all lanes.
    numbers: [[[S; MAX_LANES]; 4]; TESTS],
    /// What the caller knows the rays of each test by.
    of: [[u8; BESIDE]; TESTS],
    /// Lanes that may hit.
    possible: [u16; TESTS],
    /// Lanes that surely meet their triangle.
    certain: [u16; TESTS],
    len: usize,
}

impl<S: Real> Default for Sifted<S> {
    fn default() -> Self {
        Self {
            numbers: [[[S::ZERO; MAX_LANES]; 4]; TESTS],
            of: [[0; BESIDE]; TESTS],
            possible: [0; TESTS],
            certain: [0; TESTS],
            len: 0,
        }
    }
}

impl<S: Real> Sifted<S> {
    /// Nothing is left to do.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a test of `rays`, which the caller knows as `of`, and of the triangles that are set in `lanes`. Always writes it and takes
    /// it back if nothing is left: whether there is is a surprise every time.
    #[inline(always)]
    pub fn add<P: Lanes<Scalar = S>, const ANY: bool>(
        &mut self,
        of: [usize; BESIDE],
        rays: [usize; BESIDE],
        (sieved, lanes): (&Sieved<P>, u32),
        best: &mut Best<S>,
    ) {
        let at = self.len & (TESTS - 1);
        let (mut possible, certain) = (sieved.possible.bits() & lanes, sieved.certain.bits() & lanes);
        if ANY {
            let [first, second] = [certain & 0xff != 0, certain >> BLOCK != 0];
            best.done |= Set::from(first) << rays[0] | Set::from(second) << rays[1];
            possible &= if first { 0xff00 } else { 0xffff } & if second { 0xff } else { 0xffff };
        } else {
            let Sieved { way, speed, weights: [v, w], .. } = sieved;
            [way, speed, v, w].into_iter().zip(&mut self.numbers[at]).for_each(|(x, to)| x.store(to));
        }
        (self.of[at], self.possible[at], self.certain[at]) = (of.map(|of| of as u8), possible as u16, certain as u16);
        self.len = at + usize::from(possible != 0);
    }

    /// Does what is left to do; `of`: the block and the ray that the caller means.
    #[inline(always)]
    pub fn settle<'a, const ANY: bool>(
        &self,
        of: impl Fn(usize) -> (&'a Block<S, 9>, usize),
        inst: u32,
        chunk: &Chunk<S>,
        best: &mut Best<S>,
    ) {
        for test in 0..self.len.min(TESTS) {
            let possible = u32::from(self.possible[test]);
            if ANY {
                for half in 0..BESIDE {
                    let slots = possible >> (BLOCK * half) & 0xff;
                    if slots != 0 {
                        let (block, ray) = of(self.of[test][half].into());
                        doubtful::<S, ANY>(block, inst, chunk, best, ray, slots);
                    }
                }
                continue;
            }
            let mut rest = possible;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize & (MAX_LANES - 1);
                rest &= rest - 1;
                let ((block, ray), slot) = (of(self.of[test][lane / BLOCK].into()), lane % BLOCK);
                if self.certain[test] >> lane & 1 == 0 {
                    doubtful::<S, ANY>(block, inst, chunk, best, ray, 1 << slot);
                    continue;
                }
                let [way, speed, v, w] = [0, 1, 2, 3].map(|k| self.numbers[test][k][lane]);
                let inverse = S::ONE / speed;
                let t = moved(chunk, ray, (block, slot), way * inverse);
                if chunk.t_min[ray] <= t {
                    best.offer(ray, [t, v * inverse, w * inverse], block.prim[slot], inst);
                }
            }
        }
    }
}

/// Tests the block a leaf refers to.
#[inline(always)]
pub fn block<S: Real, const ANY: bool, const COUNT: bool>(
    object: &Object<S>,
    inst: u32,
    chunk: &Chunk<S>,
    walk: &mut Walk<S>,
    child: Child,
    rays: Set,
) {
    let block = &object.triangles[child.index as usize];
    let Walk { best, sifted, .. } = walk;
    sifted.clear();
    let lanes = (1u32 << child.count) - 1;
    let sieve = Sieve::<S::Children>::new(|f| beside(&block.fields[f], &block.fields[f]));
    for half in 0..2 {
        let mut rest = (rays >> (64 * half)) as u64;
        while rest != 0 {
            let next = |rest: &mut u64| {
                let ray = (64 * half + rest.trailing_zeros() as usize) & (RAYS - 1);
                *rest &= rest.wrapping_sub(1);
                ray
            };
            let first = next(&mut rest);
            let two = S::Children::N > BLOCK && rest != 0;
            let second = if two { next(&mut rest) } else { first };
            let sieved = sieve.test::<ANY>(&chunk.beside(&best.t, first, second));
            let lanes = if two { lanes | lanes << BLOCK } else { lanes };
            sifted.add::<_, ANY>([first, second], [first, second], (&sieved, lanes), best);
        }
    }
    if COUNT {
        leaf::count(walk.counters, child.count, rays.count_ones());
    }
    sifted.settle::<ANY>(|ray| (block, ray & (RAYS - 1)), inst, chunk, best);
}

/// A parameter moved into the box of a triangle, as the common formula does.
#[inline(always)]
fn moved<S: Real>(chunk: &Chunk<S>, ray: usize, (block, slot): (&Block<S, 9>, usize), t: S) -> S {
    let own = Triangle::bounds(&block.get(slot));
    let column = |of: &[[S; RAYS]; 3]| each(|a| of[a][ray]);
    let interval = Interval::<S>::of_line(column(&chunk.org), column(&chunk.rcp), own.lo, own.hi);
    chunk.t_floor[ray].fast_max(interval.clamp(t))
}

/// One ray against some triangles of a block, by the common formula.
#[cold]
#[inline(never)]
pub fn doubtful<S: Real, const ANY: bool>(
    block: &Block<S, 9>,
    inst: u32,
    chunk: &Chunk<S>,
    best: &mut Best<S>,
    ray: usize,
    slots: u32,
) {
    let (turned, packet) = chunk.whole(ray);
    let (maybe, edges) = Triangle::candidates(&turned, chunk.t_min[ray], best.t[ray], block);
    let facts = Facts::of_block(block);
    let found = Triangle::look_closer(&packet, block, &facts, maybe & slots, edges, chunk.flat);
    let wanted = (found.hit & found.t.cmp_le(S::Octo::splat(best.t[ray]))).bits();
    if ANY {
        best.done |= Set::from(wanted != 0) << ray;
    } else if wanted != 0 {
        best.take(ray, wanted, &found, &block.prim, inst);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Job, Memory};
    use crate::lanes::{Lanes, Real, f32x16, f64x8};
    use crate::math::Random;
    use crate::ray::{Counters, Hits, Rays};
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::{Preset, World};
    use crate::trace::output::Output;
    use crate::trace::{Engines, Scratch, engine};

    /// Rays along axes among others, with the plain test: those have the hits of the common formula, and the sieve is not asked.
    fn along_axes<V: Lanes>()
    where
        V::Scalar: Engines,
    {
        let scene = load("builtin:terrain", &LoadOptions::default()).unwrap();
        let world = World::<V::Scalar>::compile(&scene, Preset::Balanced).unwrap();
        let (number, zero) = (V::Scalar::from_f64, V::Scalar::ZERO);
        let (mut r, mut rays) = (Random(5), Rays::<V::Scalar>::new(3000));
        for i in 0..rays.len() {
            let mut unit = || 2.0 * r.unit() - 1.0;
            let (org, mut dir) = ([5.0 * unit(), 3.0 * unit(), 5.0 * unit()], [unit(), unit(), unit()]);
            if i % 3 != 0 {
                dir[i % 2] = 0.0;
            }
            if i % 3 == 2 {
                dir[2] = 0.0;
            }
            rays.set(i, org.map(number), dir.map(number), zero, V::Scalar::INFINITY);
        }
        let flat = |i: usize| rays.dir(i).contains(&zero);
        let (mut want, mut hits, mut scratch) = (Hits::default(), Hits::default(), Scratch::default());
        engine::<V::Scalar>("scalar").unwrap().intersect(&world, &rays, &mut want, &mut scratch, None);
        hits.prepare(rays.len());
        let crate::trace::Memory { stack, .. } = V::Scalar::memory(&mut scratch);
        stack.reserve(world.stack_bound());
        let (mut memory, mut counters) = (Memory::default(), Counters::default());
        let output = Output::Closest(&mut hits, world.names.as_ref());
        let (world, rays, memory) = (&world, &rays, &mut memory);
        let mut job = Job { world, rays, memory, stack, counters: &mut counters, output, apart: true, plain: true };
        job.run::<V, false, false>((0..rays.padded_len()).step_by(V::N));
        let chunk = &job.memory.chunk;
        for i in 0..chunk.len {
            let dir = [0, 1, 2].map(|a| chunk.dir[a][i]);
            assert_eq!(chunk.common >> i & 1 != 0, dir.contains(&zero), "{dir:?}");
        }
        let of = |hits: &Hits<V::Scalar>, i: usize| (hits.t[i], hits.u[i], hits.v[i], hits.prim[i], hits.inst[i]);
        let mut met = 0;
        for i in (0..rays.len()).filter(|&i| flat(i)) {
            assert_eq!(of(&hits, i), of(&want, i), "ray {i}");
            met += usize::from(want.t[i] < V::Scalar::INFINITY);
        }
        assert!(met > 200, "{met} rays along faces hit something");
    }

    #[test]
    fn rays_along_axes_have_the_common_formula() {
        along_axes::<f32x16>();
        along_axes::<f64x8>();
    }
}
