//! Blocks full of rays that start in the common point and have no end: most that cameras see. What each of them must be is asked of
//! all at once, as bits in which some ray is another than it is taken for.

use super::bundle::{Bundle, Shared, Source, TAME};
use super::columns::{AHEAD, Columns};
use super::groups::{Groups, NO_SLOT};
use super::{SET, V};
use crate::lanes::minima::{quarter_minima, quarters};
use crate::lanes::words::least;
use crate::lanes::{Lanes, each};
use crate::ray::Pencil;

impl Groups {
    /// Takes in the `N` sets of a bundle if they are full of such rays; the frame is known. False if a ray is another or does not go
    /// ahead: nothing that was taken in may be used then.
    #[inline(always)]
    pub fn fill<const N: usize>(&mut self, bundle: &Bundle) -> bool {
        if bundle.shared != Shared::Start || bundle.len != N * SET {
            return false;
        }
        match bundle.source {
            Source::Batch(rays) => {
                let is_whole = rays.t_min[bundle.first] == 0.0 && rays.t_max[bundle.first] == f32::INFINITY;
                bundle.presumed && is_whole && self.fill_from_memory::<N>(bundle, &Columns::of(rays))
            }
            Source::Pencil(pencil, middle) => {
                let full = bundle.tame[..N * SET].iter().all(|lanes| *lanes == V::ALL);
                if full {
                    self.fill_from_pencil::<N>(bundle, pencil, middle);
                }
                full
            }
        }
    }

    /// That they are tame and of the common point is still to be seen.
    #[inline(never)]
    fn fill_from_memory<const N: usize>(&mut self, bundle: &Bundle, columns: &Columns) -> bool {
        let from = bundle.first / V::N;
        let (zero, one, infinite) = (V::constant(0.0), V::constant(1.0), V::splat(f32::INFINITY));
        let apex = bundle.apex.map(V::splat);
        let (frame, asked) = (self.frame, self.asked);
        let (mut other, mut total, mut shortest, mut slowest) = (zero, zero, infinite, infinite);
        self.fill_with::<N>(|g| {
            if from + g + AHEAD >= asked {
                columns.prefetch(from + g + AHEAD);
            }
            let group = columns.get(from + g);
            let [x, y, z] = each(|a| group.org[a] ^ apex[a]);
            other = other | x | y | z | group.t_min | (group.t_max ^ infinite);
            let [x, y, z] = group.dir.map(V::abs);
            let size = x + y + z;
            (total, shortest) = (total + size, shortest.fast_min(size));
            let [x, y, speed] = frame.coordinates(group.dir);
            slowest = slowest.fast_min(speed);
            let slowness = one / speed;
            [x * slowness, y * slowness, slowness]
        });
        let same = bytemuck::cast::<_, [u32; 16]>(other.to_array()).iter().all(|bits| *bits == 0);
        // A sum shows what is no number, and what would overflow in the frame; minima do not.
        let total: f32 = total.to_array().iter().sum();
        same && total <= TAME.1 && least(shortest) >= 3.0 * TAME.0 && least(slowest) >= f32::MIN_POSITIVE
    }

    #[inline(never)]
    fn fill_from_pencil<const N: usize>(&mut self, bundle: &Bundle, pencil: &Pencil, middle: [f64; 2]) {
        let from = bundle.first / V::N;
        let slowness = V::splat(1.0 / self.frame.scale);
        self.fill_with::<N>(|g| {
            let [s, t] = pencil.places.around(from + g, middle).map(V::new);
            [s, t, slowness]
        });
    }

    /// `line`: both coordinates of a group's rays, and their parameter per unit of depth.
    #[inline(always)]
    fn fill_with<const N: usize>(&mut self, mut line: impl FnMut(usize) -> [V; 3]) {
        let zero = V::constant(0.0);
        for q in 0..N {
            for i in 0..SET {
                let g = q * SET + i;
                let [s, t, slowness] = line(g);
                let group = &mut self.of[g];
                (group.s, group.t, group.slowness, group.inv_lo) = (s, t, slowness, zero);
                group.slot = [NO_SLOT; 16];
                self.ends[i] = quarters([s, t, -s, -t]);
            }
            let [low_s, low_t, high_s, high_t] = quarter_minima(&self.ends);
            [self.rect[0][0][q], self.rect[0][1][q]] = [low_s, -high_s];
            [self.rect[1][0][q], self.rect[1][1][q]] = [low_t, -high_t];
            self.least[q] = zero;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::super::presumed::First;
    use super::*;
    use crate::math::Aabb;
    use crate::ray::Rays;

    const POINT: [f32; 3] = [1.5, -2.0, 0.25];

    /// A block of 32 x 32 pixels, row by row.
    fn block() -> Rays<f32> {
        let mut rays = Rays::new(1024);
        for i in 0..1024 {
            let (x, y) = ((i % 32) as f32 / 64.0 - 0.2, (i / 32) as f32 / 64.0 - 0.3);
            rays.set(i, POINT, [x, y, 0.5 + 0.25 * x], 0.0, f32::INFINITY);
        }
        rays
    }

    /// The block in a tile if all of it was taken in at once.
    fn filled(rays: &Rays<f32>) -> Option<Box<Groups>> {
        let First::Shared(bundle) = First::of(rays, 0, false) else { return None };
        let mut groups = Box::<Groups>::default();
        groups.frame = Frame::of::<4>(&bundle, u64::MAX, &Aabb { lo: [-3.0; 3], hi: [3.0; 3] })?;
        groups.fill::<4>(&bundle).then_some(groups)
    }

    #[test]
    fn rays_are_where_they_go() {
        let rays = block();
        let groups = filled(&rays).expect("a full block");
        for (g, group) in groups.of.iter().enumerate() {
            let mut ends = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
            for lane in 0..16 {
                let along = groups.frame.axes.map(|axis| {
                    axis.iter().zip(rays.dir(16 * g + lane)).map(|(a, d)| f64::from(*a) * f64::from(d)).sum::<f64>()
                });
                let want = [along[0] / along[2], along[1] / along[2], 1.0 / along[2]];
                let have = [group.s, group.t, group.slowness].map(|x| x.to_array()[lane]);
                let near = |(have, want): (f32, f64)| (f64::from(have) - want).abs() <= 1e-6 * want.abs().max(1.0);
                assert!(have.into_iter().zip(want).all(near), "{have:?} {want:?}");
                (0..2).for_each(|k| ends[k] = [ends[k][0].min(have[k]), ends[k][1].max(have[k])]);
            }
            assert_eq!((group.slot, group.inv_lo.to_array()), ([NO_SLOT; 16], [0.0; 16]));
            let rect = [0, 1].map(|k| [0, 1].map(|end| groups.rect[k][end][g / SET].to_array()[g % SET]));
            assert_eq!(rect, ends);
        }
    }

    #[test]
    fn one_other_ray_is_enough() {
        type Change = fn(&mut Rays<f32>, usize);
        let changes: [Change; 13] = [
            |rays, i| rays.org[0][i] = POINT[0].next_up(),
            |rays, i| rays.org[1][i] = POINT[1].next_down(),
            |rays, i| rays.org[2][i] = -POINT[2],
            |rays, i| rays.t_min[i] = f32::MIN_POSITIVE,
            |rays, i| rays.t_min[i] = -1.0,
            |rays, i| rays.t_max[i] = f32::MAX,
            |rays, i| rays.kill(i),
            |rays, i| rays.dir[1][i] = f32::NAN,
            |rays, i| rays.dir[0][i] = f32::NEG_INFINITY,
            |rays, i| (0..3).for_each(|axis| rays.dir[axis][i] = 0.0),
            |rays, i| (0..3).for_each(|axis| rays.dir[axis][i] *= -1.0),
            |rays, i| (0..3).for_each(|axis| rays.dir[axis][i] *= 1e-17),
            |rays, i| (0..3).for_each(|axis| rays.dir[axis][i] *= 1e16),
        ];
        for (k, change) in changes.into_iter().enumerate() {
            // Not those that the frame is made of, so that it is there.
            for i in [1, 17, 500, 777, 1023] {
                let mut rays = block();
                change(&mut rays, i);
                assert!(filled(&rays).is_none(), "change {k} of ray {i}");
            }
        }
        // Longer and shorter ones are none.
        let mut rays = block();
        (0..1024).for_each(|i| (0..3).for_each(|axis| rays.dir[axis][i] *= [1e-9, 3.0, 1e9][i % 3]));
        assert!(filled(&rays).is_some());
    }
}
