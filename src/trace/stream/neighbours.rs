//! Neighbours: any-hit rays that are so short that those of neighbouring pixels, whatever their directions, have most of the upper
//! nodes in common, such as those of ambient occlusion. They go down the tree as they come; to sort them would take a third of the
//! time of all.

use super::patience::Patience;
use super::region::Extent;
use super::{Job, Memory, walk};
use crate::lanes::{Lanes, Real};
use crate::ray::Packet;

/// Tests of nodes' boxes per ray from which on it repays to sort them.
const MOST: u64 = 2;

/// For how many rays whose tests are all saved a chunk may take more.
const SAVED: u64 = 1024;

/// How many times the surface of a region must fit into that of all there is.
const SMALL: f64 = 4.0;

/// Fewest and most vectors of rays that are sorted after a chunk that it did not repay to leave as it was.
const PATIENCE: [u32; 2] = [8, 512];

/// Whether to sort the next rays or not: what those before have shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Savings {
    /// Tests that the last ones needed less than sorting them is worth.
    saved: u64,
    patience: Patience<{ PATIENCE[0] }, { PATIENCE[1] }>,
}

impl Savings {
    /// Whether to leave the next rays as they are.
    #[inline(always)]
    pub fn are_worth_trying(&mut self) -> bool {
        self.patience.is_over()
    }

    /// Remembers what a chunk of `rays` took.
    fn remember(&mut self, tests: u64, rays: u32) {
        let (left, full) = ((self.saved + MOST * u64::from(rays)).checked_sub(tests), MOST * SAVED);
        self.saved = left.unwrap_or(0).min(full);
        // One chunk that does well says little.
        if left.is_none_or(|left| left >= full) {
            self.patience.remember(left.is_some());
        }
    }
}

impl<S: Real> Job<'_, S> {
    /// Traces the vectors of rays that start at `starts`, at most [`RAYS`](super::chunk::RAYS), any-hit, or sorts them. Returns how
    /// many were sorted.
    #[inline(never)]
    pub fn neighbours<V: Lanes<Scalar = S>, const COUNT: bool>(&mut self, starts: &[usize]) -> usize {
        match starts.is_empty() || self.together::<V, COUNT>(starts) {
            true => 0,
            false => starts.iter().map(|&at| self.alike::<V, true, COUNT>(at)).sum(),
        }
    }

    /// Traces vectors of rays as they come; false if they reach too far for that.
    fn together<V: Lanes<Scalar = S>, const COUNT: bool>(&mut self, starts: &[usize]) -> bool {
        let Memory { chunk, inside, best, waiting, closer, sifted, savings, .. } = &mut *self.memory;
        let sheared = self.world.kinds.ask_for_shear();
        chunk.start(starts.len() * V::N, sheared);
        let (mut extent, mut dead) = (Extent::<V>::none(), 0);
        for (k, &at) in starts.iter().enumerate() {
            let ([org, dir], [t_min, t_max], live) = Packet::<V>::read(self.rays, at);
            let packet = Packet::prepared(org, dir, t_min, sheared);
            t_max.store(&mut best.t[k * V::N..]);
            chunk.take(k * V::N, &packet, V::ALL);
            chunk.take_octants(k * V::N, &packet);
            extent.add(packet.org, packet.dir, [packet.t_min, t_max], live);
            dead |= u128::from(!live & V::ALL) << (k * V::N);
        }
        let (region, world) = (extent.region(), self.world);
        let all = if world.is_single_object() { world.first_object().tree.bounds } else { world.top.bounds };
        if region.0.half_area() * SMALL > all.half_area() {
            savings.patience.remember(false);
            return false;
        }
        (chunk.mixed, chunk.region) = (true, Some(region));
        best.done = dead;
        chunk.find_common::<V>(!dead);
        let rays = chunk.len as u32 - dead.count_ones();
        if COUNT {
            self.counters.rays += u64::from(rays);
        }
        let room = walk::Room { waiting, closer, sifted };
        let mut walk = walk::Walk::new(best, room, self.stack, self.counters, !world.kinds.large);
        walk.world::<V, true, COUNT>(world, chunk, inside, 0);
        savings.remember(walk.tests, rays);
        let done = best.done & !dead;
        for (k, &at) in starts.iter().enumerate() {
            self.output.put_any(at, V::N, (done >> (k * V::N)) as u32 & V::ALL);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::Stream;
    use crate::camera::morton_decode;
    use crate::lanes::f32x16;
    use crate::ray::{Hits, Rays};
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::{Preset, World};
    use crate::trace::{Engine, Scratch, engine};
    use std::marker::PhantomData;

    /// Rays of a length in all directions from where a camera above a terrain sees it: how many meet something, and what the engine
    /// has saved then.
    fn from_the_ground(length: f32) -> (usize, u64) {
        let scene = load("builtin:terrain", &LoadOptions::default()).unwrap();
        let world = World::<f32>::compile(&scene, Preset::Balanced).unwrap();
        let mut rays = Rays::<f32>::new(64 * 64);
        let place = |i: usize| {
            let (x, y) = morton_decode(i as u32);
            [x as f32 * 0.01 - 0.3, 9.0, y as f32 * 0.01 - 0.3]
        };
        for i in 0..rays.len() {
            rays.set(i, place(i), [0.0, -1.0, 0.0], 0.0, f32::INFINITY);
        }
        let (mut scratch, mut hits) = (Scratch::default(), Hits::default());
        let (scalar, stream) = (engine::<f32>("scalar").unwrap(), Stream::<f32x16>(PhantomData));
        scalar.intersect(&world, &rays, &mut hits, &mut scratch, None);
        for i in 0..rays.len() {
            let ([x, y, z], turn) = (place(i), i as f32 * 2.4);
            let up = (i * 7 % 64) as f32 / 64.0;
            let dir = [turn.cos() * length, up * length, turn.sin() * length];
            rays.set(i, [x, y - hits.t[i] + 1e-3, z], dir, 0.0, 1.0);
        }
        let (mut got, mut want) = (Vec::new(), Vec::new());
        stream.occluded(&world, &rays, &mut got, &mut scratch, None);
        scalar.occluded(&world, &rays, &mut want, &mut scratch, None);
        assert_eq!(got, want);
        (got.iter().filter(|&&met| met == 1).count(), scratch.single.stream.savings.saved)
    }

    #[test]
    fn short_rays_repay_it_and_long_ones_do_not() {
        let (short, long) = (from_the_ground(0.03), from_the_ground(100.0));
        assert!(short.0 > 500 && long.0 > 500, "{short:?} {long:?}: some rays meet something");
        assert!(short.1 > 0 && long.1 == 0, "{short:?} {long:?}: chunks of short rays are left as they are");
    }
}
