//! Blocks full of rays that start in the common point and have no end, as most that cameras see, or that go all the way to it, as those to
//! a light. What each of them must be is asked of many at once, as bits in which some ray is another than it is taken for.

use super::bundle::{At, Bundle, Shared, Source, TAME, largest, sum};
use super::columns::{AHEAD, Columns};
use super::groups::{Groups, NO_SLOT};
use super::late::Answers;
use super::parallel::NEAR;
use super::presumed::Look;
use super::sure::Sure;
use super::{SET, V};
use crate::lanes::minima::quarters;
use crate::lanes::words::least;
use crate::lanes::{Lanes, each, map3};
use crate::ray::{Pencil, Rays};

impl Groups {
    /// Takes in the `N` sets of a bundle if they are full of such rays; the frame is known. `ANY`: the point may be an end; what
    /// [`Self::load`] wants to know of such rays is added to `look` and `reach`. False if a ray is another or does not go ahead:
    /// nothing that was taken in may be used then.
    #[inline(always)]
    pub fn fill<const N: usize, const ANY: bool>(
        &mut self,
        bundle: &Bundle,
        look: &mut Look,
        reach: &mut V,
        late: Option<Answers>,
    ) -> bool {
        let is_full = bundle.len == N * SET;
        let ends_at = |rays: &Rays<f32>, end: f32| {
            bundle.presumed && rays.t_min[bundle.first] == 0.0 && rays.t_max[bundle.first] == end
        };
        if let (Shared::Start, Source::Batch(rays)) = (bundle.shared, bundle.source)
            && is_full
            && ends_at(rays, f32::INFINITY)
        {
            return match late {
                Some(late) => self.fill_and_write::<N>(bundle, &Columns::of(rays), late),
                None => self.fill_from_memory::<N>(bundle, &Columns::of(rays)),
            };
        }
        if let Some(late) = late {
            self.write_all(late);
        }
        if !is_full {
            return false;
        }
        match (bundle.shared, bundle.source) {
            (Shared::Start, Source::Pencil(pencil, middle)) => {
                let full = bundle.tame[..N * SET].iter().all(|lanes| *lanes == V::ALL);
                if full {
                    self.fill_from_pencil::<N>(bundle, pencil, middle);
                }
                full
            }
            (Shared::End(At::One), Source::Batch(rays)) if ANY => {
                let found = match ends_at(rays, 1.0) {
                    true => self.fill_to_end::<N>(bundle, &Columns::of(rays)),
                    false => None,
                };
                if let Some(found) = found {
                    (*look, *reach) = found;
                }
                found.is_some()
            }
            (Shared::Along | Shared::Against, Source::Batch(rays)) if bundle.presumed => {
                match self.fill_parallel::<N, ANY>(bundle, &Columns::of(rays)) {
                    Some(way) => *reach = way,
                    None => return false,
                }
                true
            }
            _ => false,
        }
    }

    /// That they are tame and of the common point is still to be seen.
    #[inline(never)]
    fn fill_from_memory<const N: usize>(&mut self, bundle: &Bundle, columns: &Columns) -> bool {
        self.fill_after::<N>(bundle, columns, |_, _| ())
    }

    /// `before`: what is to be done with a group first.
    #[inline(always)]
    pub fn fill_after<const N: usize>(
        &mut self,
        bundle: &Bundle,
        columns: &Columns,
        before: impl FnMut(&Self, usize),
    ) -> bool {
        let from = bundle.first / V::N;
        let (one, infinite) = (V::constant(1.0), V::splat(f32::INFINITY));
        let apex = bundle.apex.map(V::splat);
        let (frame, asked) = (self.frame, self.asked);
        let mut sure = Sure::new();
        self.fill_with::<N>(before, |g| {
            columns.prefetch_from(asked, from + g + AHEAD);
            let group = columns.get(from + g);
            let [x, y, z] = each(|a| group.org[a] ^ apex[a]);
            sure.other = sure.other | x | y | z | group.t_min | (group.t_max ^ infinite);
            sure.directions(group.dir);
            let [x, y, speed] = frame.coordinates(group.dir);
            sure.slowest = sure.slowest.fast_min(speed);
            let slowness = one / speed;
            [x * slowness, y * slowness, slowness]
        });
        sure.holds()
    }

    #[inline(never)]
    fn fill_from_pencil<const N: usize>(&mut self, bundle: &Bundle, pencil: &Pencil, middle: [f64; 2]) {
        let from = bundle.first / V::N;
        let slowness = V::splat(1.0 / self.frame.scale);
        self.fill_with::<N>(
            |_, _| (),
            |g| {
                let [s, t] = pencil.places.around(from + g, middle).map(V::new);
                [s, t, slowness]
            },
        );
    }

    /// `line`: both coordinates of a group's rays, and their parameter per unit of depth. `before`: what is to be done first.
    #[inline(always)]
    fn fill_with<const N: usize>(
        &mut self,
        mut before: impl FnMut(&Self, usize),
        mut line: impl FnMut(usize) -> [V; 3],
    ) {
        let zero = V::constant(0.0);
        for q in 0..N {
            for i in 0..SET {
                let of_group = line(q * SET + i);
                before(self, q * SET + i);
                self.put(q * SET + i, of_group, zero);
            }
            self.surround(q);
            self.least[q] = zero;
        }
    }

    /// Rays that go all the way to the common point. What they pass it by, and the longest; `None` as soon as a set has another one.
    #[inline(never)]
    fn fill_to_end<const N: usize>(&mut self, bundle: &Bundle, columns: &Columns) -> Option<(Look, V)> {
        let from = bundle.first / V::N;
        let one = V::constant(1.0);
        let apex = bundle.apex.map(V::splat);
        let (frame, asked, scale) = (self.frame, self.asked, V::splat(self.frame.scale));
        let (mut sure, mut look, mut reach) = (Sure::new(), Look::default(), V::constant(0.0));
        for q in 0..N {
            for i in 0..SET {
                let g = q * SET + i;
                columns.prefetch_from(asked, from + g + AHEAD);
                let group = columns.get(from + g);
                sure.other = sure.other | group.t_min | (group.t_max ^ one);
                sure.directions(group.dir);
                sure.total += sum(group.org);
                // From the light, as the tile looks.
                let way = each(|a| group.org[a] - apex[a]);
                look.0.take(sum(each(|a| group.dir[a] + way[a])), largest(group.org));
                reach = largest(way).fast_max(reach);
                let [x, y, speed] = frame.coordinates(way);
                sure.slowest = sure.slowest.fast_min(speed);
                let slowness = one / speed;
                self.put(g, [x * slowness, y * slowness, slowness], slowness);
                self.of[g].start = map3(group.org, |x| x * scale);
            }
            if !sure.same() {
                return None;
            }
            self.surround(q);
            self.look_far(q);
        }
        sure.holds().then_some((look, reach))
    }

    /// Whole rays of one direction, and how far from the apex they start at most.
    #[inline(never)]
    fn fill_parallel<const N: usize, const ANY: bool>(&mut self, bundle: &Bundle, columns: &Columns) -> Option<V> {
        let from = bundle.first / V::N;
        let infinite = V::splat(f32::INFINITY);
        let (frame, asked, scale) = (self.frame, self.asked, V::splat(self.frame.scale));
        let parallel = frame.parallel?;
        let (dir, apex) = (parallel.dir.map(V::splat), bundle.apex.map(V::splat));
        let (mut sure, mut reach, mut nearest) = (Sure::new(), V::constant(0.0), infinite);
        for q in 0..N {
            for i in 0..SET {
                let g = q * SET + i;
                columns.prefetch_from(asked, from + g + AHEAD);
                let group = columns.get(from + g);
                let [x, y, z] = each(|a| group.dir[a] ^ dir[a]);
                sure.other = sure.other | x | y | z | group.t_min | (group.t_max ^ infinite);
                sure.total += sum(group.org);
                nearest = nearest.fast_min(largest(group.org));
                let way = each(|a| group.org[a] - apex[a]);
                reach = largest(way).fast_max(reach);
                let [s, t, above] = frame.coordinates(way);
                let height = above + V::splat(parallel.height);
                let far = if ANY { parallel.far(above, height) } else { V::constant(0.0) };
                self.put(g, [s, t, V::constant(1.0)], far);
                self.of[g].start = map3(group.org, |x| x * scale);
                self.behind[g] = height;
            }
            if !sure.same() {
                return None;
            }
            self.surround(q);
            self.look_far(q);
        }
        let total: f32 = sure.total.to_array().iter().sum();
        (total <= TAME.1 && NEAR * frame.extent <= least(nearest)).then_some(reach)
    }

    /// Puts the rays of group `g` in their place, which look as far as `inv_lo`.
    #[inline(always)]
    fn put(&mut self, g: usize, [s, t, slowness]: [V; 3], inv_lo: V) {
        let group = &mut self.of[g];
        (group.s, group.t, group.slowness, group.inv_lo) = (s, t, slowness, inv_lo);
        group.slot = [NO_SLOT; 16];
        self.ends[g % SET] = quarters([s, t, -s, -t]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::super::presumed::First;
    use super::*;
    use crate::lanes::words::greatest;
    use crate::math::Aabb;

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

    /// Rays from a floor to the point, in the same order.
    fn lit_block() -> Rays<f32> {
        let mut rays = Rays::new(1024);
        for i in 0..1024 {
            let org = [(i % 32) as f32 / 20.0 - 1.0, (i / 32) as f32 / 15.0 - 3.0, -1.0 + (i % 7) as f32 / 8.0];
            rays.set(i, org, each(|a| POINT[a] - org[a]), 0.0, 1.0);
        }
        rays
    }

    /// The block in a tile if all of it was taken in at once, and how long the longest ray is.
    fn filled(rays: &Rays<f32>) -> Option<(Box<Groups>, f32)> {
        let First::Shared(mut bundle) = First::of(rays, 0, true) else { return None };
        let mut groups = Box::<Groups>::default();
        groups.frame = Frame::of::<4>(&bundle, u64::MAX, &Aabb { lo: [-3.0; 3], hi: [3.0; 3] })?;
        let (mut look, mut reach) = (Look::default(), V::splat(0.0));
        let full = groups.fill::<4, true>(&bundle, &mut look, &mut reach, None) && bundle.confirm(&look);
        full.then(|| (groups, greatest(reach)))
    }

    /// Whether what a full tile holds is made of the ways of the rays: `way` of each from the common point.
    fn check(groups: &Groups, way: impl Fn(usize) -> [f32; 3], inv_lo: impl Fn([f64; 3]) -> f64) {
        for (g, group) in groups.of.iter().enumerate() {
            let mut ends = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
            for lane in 0..16 {
                let way = way(16 * g + lane);
                let along = groups
                    .frame
                    .axes
                    .map(|axis| axis.iter().zip(way).map(|(a, d)| f64::from(*a) * f64::from(d)).sum::<f64>());
                let want = [along[0] / along[2], along[1] / along[2], 1.0 / along[2], inv_lo(along)];
                let have = [group.s, group.t, group.slowness, group.inv_lo].map(|x| x.to_array()[lane]);
                let near = |(have, want): (f32, f64)| (f64::from(have) - want).abs() <= 1e-6 * want.abs().max(1.0);
                assert!(have.into_iter().zip(want).all(near), "{have:?} {want:?}");
                (0..2).for_each(|k| ends[k] = [ends[k][0].min(have[k]), ends[k][1].max(have[k])]);
            }
            assert_eq!(group.slot, [NO_SLOT; 16]);
            let rect = [0, 1].map(|k| [0, 1].map(|end| groups.rect[k][end][g / SET].to_array()[g % SET]));
            assert_eq!(rect, ends);
            let farthest = group.inv_lo.to_array().into_iter().fold(f32::INFINITY, f32::min);
            assert_eq!(groups.least[g / SET].to_array()[g % SET], farthest);
        }
    }

    #[test]
    fn rays_are_where_they_go() {
        let rays = block();
        let (groups, _) = filled(&rays).expect("a full block");
        check(&groups, |i| rays.dir(i), |_| 0.0);
    }

    #[test]
    fn rays_to_a_light_are_seen_from_there() {
        let rays = lit_block();
        let (groups, reach) = filled(&rays).expect("a full block");
        check(&groups, |i| each(|a| rays.org(i)[a] - POINT[a]), |along| 1.0 / along[2]);
        for (i, group) in groups.of.iter().enumerate() {
            let start = group.start.map(|x| x.to_array()[3]);
            assert_eq!(start, rays.org(16 * i + 3).map(|x| x * groups.frame.scale));
        }
        let longest = (0..1024).flat_map(|i| rays.dir(i)).fold(0.0, |most: f32, x| most.max(x.abs()));
        assert_eq!(reach, longest);
    }

    #[test]
    fn one_other_ray_to_a_light_is_enough() {
        type Change = fn(&mut Rays<f32>, usize);
        let changes: [Change; 12] = [
            |rays, i| rays.t_min[i] = f32::MIN_POSITIVE,
            |rays, i| rays.t_min[i] = -1.0,
            |rays, i| rays.t_max[i] = 1.0f32.next_down(),
            |rays, i| rays.t_max[i] = f32::INFINITY,
            |rays, i| rays.kill(i),
            |rays, i| rays.org[1][i] = f32::NAN,
            |rays, i| rays.dir[2][i] = f32::NAN,
            |rays, i| rays.org[0][i] = f32::INFINITY,
            |rays, i| rays.org[2][i] = 1e16,
            |rays, i| rays.set(i, POINT, [0.0; 3], 0.0, 1.0),
            // Past the light.
            |rays, i| rays.dir[1][i] += 0.01,
            // From behind the light, as the others see it.
            |rays, i| rays.set(i, each(|a| 2.0 * POINT[a] - rays.org(i)[a]), each(|a| -rays.dir(i)[a]), 0.0, 1.0),
        ];
        for (k, change) in changes.into_iter().enumerate() {
            for i in [1, 17, 500, 777, 1023] {
                let mut rays = lit_block();
                change(&mut rays, i);
                assert!(filled(&rays).is_none(), "change {k} of ray {i}");
            }
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
