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
    /// The rays, in the instance's space.
    pub chunk: Chunk<S>,
    /// What they have found, with what they came with.
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
            // A direction may overflow on the way in.
            let meets = meets & local.finite_lanes();
            self.chunk.take(at, &local, meets);
            if self.chunk.mixed {
                self.chunk.take_octants(at, &local);
            }
            if from.region.is_some() {
                extent.add(local.org, local.dir, [local.t_min, t], meets);
            }
            inside |= Set::from(meets) << at;
        }
        self.chunk.find_common::<V>(inside);
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

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, DVec3};

    use super::super::chunk::row;
    use super::*;
    use crate::lanes::rows::{Row, to_rows};
    use crate::lanes::{each, f32x8, f32x16, f64x8};
    use crate::math::{Aabb, Affine, Random};
    use crate::ray::Rays;

    /// Some rays of a chunk enter a turned instance, some of them hit something there.
    fn check<V: Lanes>() {
        let mut r = Random(7);
        let numbers = |r: &mut Random, size: f64| each(|_| V::Scalar::from_f64(size * (2.0 * r.unit() - 1.0)));
        let (mut entered, mut kept_out) = (0, 0);
        for round in 0..400 {
            let mut rays = Rays::<V::Scalar>::new(RAYS);
            for i in 0..RAYS {
                rays.set(i, numbers(&mut r, 3.0), numbers(&mut r, 1.0), V::Scalar::ZERO, V::Scalar::from_f64(4.0));
            }
            let (mut rows, places) = (vec![Row::ZERO; RAYS], (0..RAYS as u32).collect::<Vec<_>>());
            for at in (0..RAYS).step_by(V::N) {
                let (packet, t_max, _) = Packet::<V>::load(&rays, at);
                to_rows(row(&packet, t_max), &mut rows[at..]);
            }
            let (mut chunk, mut best) = (Chunk::default(), Best::default());
            chunk.gather::<V, false>(&rows, &places, &mut best.t, round % 2 == 0);
            best.start();
            let turn = DQuat::from_scaled_axis(DVec3::new(1.0, 2.0, 0.5) * r.unit());
            let map =
                DAffine3::from_scale_rotation_translation(DVec3::new(2.0, 1.0, 0.5), turn, DVec3::splat(r.unit()));
            let (lo, hi) = ([V::Scalar::from_f64(-1.0); 3], [V::Scalar::from_f64(1.0); 3]);
            let to_local = Affine::from_f64(&map.inverse());
            let instance = Instance { object: 0, identity: false, to_local, bounds: Aabb { lo, hi } };
            let rays_wanted = match round % 5 {
                0 => 1 << (round % RAYS),
                1 => 0b1011 << (round % 100),
                2 => (Set::MAX / 0xff) << (round % 8),
                3 => Set::MAX >> (round % 100),
                _ => Set::MAX,
            };
            let mut inside = Inside::default();
            let met = inside.enter::<V>((&chunk, &best), &instance, rays_wanted);
            let (mut k, mut of) = (0, Vec::new());
            for i in (0..RAYS).filter(|i| rays_wanted >> i & 1 != 0) {
                let one = Packet::<V::Scalar>::new(rays.org(i), rays.dir(i), V::Scalar::ZERO);
                let interval = Interval::of(&one, lo, hi);
                let meets = interval.meets(one.t_min, best.t[i]);
                assert_eq!(met >> k & 1 != 0, meets, "round {round}: ray {i} meets the box or not");
                (entered, kept_out) = (entered + u32::from(meets), kept_out + u32::from(!meets));
                let local = one.into_local(&instance.to_local, interval.near);
                for a in 0..3 {
                    let found = [inside.chunk.org[a][k], inside.chunk.dir[a][k], inside.chunk.rcp[a][k]];
                    assert_eq!(found, [local.org[a], local.dir[a], local.rcp[a]], "round {round}: ray {i}");
                }
                assert_eq!((inside.chunk.t_min[k], inside.chunk.t_floor[k]), (local.t_min, local.t_floor));
                let octant = (0..3).fold(0, |o, a| o | u8::from(local.rcp[a] < V::Scalar::ZERO) << a);
                assert!(!inside.chunk.mixed || inside.chunk.octant[k] == octant, "round {round}: ray {i}");
                of.push(i);
                k += 1;
            }
            assert_eq!(met >> (k - 1) >> 1, 0, "no more rays than were sent");
            let before = best.clone();
            for (k, &i) in of.iter().enumerate().step_by(3) {
                inside.best.offer(k, [V::Scalar::from_f64(0.5), V::Scalar::ONE, V::Scalar::ZERO], i as u32, 9);
                inside.best.done |= 1 << k;
            }
            inside.leave::<true>(&mut best, 9);
            inside.leave::<false>(&mut best, 9);
            for i in 0..RAYS {
                let hit = of.iter().step_by(3).any(|&of| of == i);
                assert_eq!(best.done >> i & 1 != 0, hit, "round {round}: ray {i}");
                let want = if hit { (V::Scalar::from_f64(0.5), 9) } else { (before.t[i], before.inst[i]) };
                assert_eq!((best.t[i], best.inst[i]), want, "round {round}: ray {i}");
            }
        }
        assert!(entered > 1000 && kept_out > 1000, "{entered} {kept_out}");
    }

    #[test]
    fn rays_inside_are_those_outside() {
        check::<f32x16>();
        check::<f32x8>();
        check::<f64x8>();
    }
}
