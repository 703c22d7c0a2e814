//! Rays that leave the points of one level, with what they carry, and shadow rays with the light that they ask for.

use glam::DVec3;

use super::colors::Colors;
use crate::lanes::chosen::{Chosen, at, is_run, lanes_of, spill, zeros};
use crate::lanes::{Column, Lanes, Lanes3, MAX_LANES, Real, each};
use crate::ray::Rays;

/// Rays and, parallel to them, whose they are and what of the radiance along them arrives at the eye.
#[derive(Clone, Debug, Default)]
pub(super) struct Branches<S> {
    /// World space; each with its own end.
    pub rays: Rays<S>,
    /// The sample that each belongs to.
    pub path: Vec<u32>,
    weight: [Column<S>; 3],
    /// Whether all of the radiance along all of them arrives: there are no weights.
    is_whole: bool,
}

impl<S: Real> Branches<S> {
    /// What `len` primary rays carry: sample `i` belongs to ray `i`, all of its radiance arrives. The rays stay elsewhere.
    pub fn start(&mut self, len: usize) {
        self.open(0);
        self.path.extend(0..len as u32);
        self.is_whole = true;
    }

    /// None, with room for `most`.
    pub fn open(&mut self, most: usize) {
        self.rays.open(most);
        self.path.clear();
        self.is_whole = false;
        let padded = most.next_multiple_of(MAX_LANES);
        self.weight.iter_mut().for_each(|weight| weight.at_least(padded));
    }

    /// Adds those of the lanes `lanes`, which belong to the samples `path`: rays from `org` along `dir` up to `t_max`.
    #[inline(always)]
    pub fn push(&mut self, lanes: u32, path: &[u32], [org, dir, weight]: [Lanes3<S::Wide>; 3], t_max: S) {
        let (chosen, first) = (Chosen::of(lanes), self.path.len());
        chosen.extend(path, &mut self.path);
        self.rays.put(first, &chosen, [org, dir], [S::ZERO, t_max].map(S::Wide::splat));
        for axis in 0..3 {
            chosen.pack(weight[axis], &mut self.weight[axis][first..]);
        }
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.path.len());
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.path.len()
    }

    /// What arrives of the radiance `color` along rays `first..first + N`.
    #[inline(always)]
    pub fn weighed(&self, first: usize, color: Lanes3<S::Wide>) -> Lanes3<S::Wide> {
        if self.is_whole { color } else { each(|axis| S::Wide::load(&self.weight[axis][first..]) * color[axis]) }
    }

    /// Adds `light` of rays `first + lane` of `lanes` to their samples in `out`.
    #[inline(always)]
    pub fn shine(&self, first: usize, lanes: u32, light: Lanes3<S::Wide>, out: &mut Colors) {
        if self.is_whole {
            return out.add_lanes(first, lanes, light);
        }
        let light = spill(light);
        for lane in lanes_of(lanes) {
            out.add(self.path[first + lane] as usize, DVec3::from(at(&light, lane).map(S::to_f64)));
        }
    }

    /// Adds what the rays carry, each with a weight of its own, that are not `occluded` to their samples in `out`.
    pub fn arrive(&self, occluded: &[u8], out: &mut Colors) {
        for first in (0..self.len()).step_by(S::Wide::N) {
            let path = &self.path[first..self.len().min(first + S::Wide::N)];
            let lanes = zeros(&occluded[first..]) & (u32::MAX >> (32 - path.len()));
            if path.len() == S::Wide::N && is_run(path) {
                let light: Lanes3<S::Wide> = each(|axis| S::Wide::load(&self.weight[axis][first..]));
                out.add_lanes(path[0] as usize, lanes, light);
                continue;
            }
            for lane in lanes_of(lanes) {
                out.add(path[lane] as usize, self.weight_of(first + lane));
            }
        }
    }

    /// What ray `i` carries, which has a weight of its own.
    #[inline]
    pub fn weight_of(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.weight[axis][i].to_f64()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;

    /// Light arrives at the sample of each ray that is not occluded, wherever samples follow each other and where they do not.
    fn light_arrives_as_ray_by_ray<S: Real>() {
        let mut random = Random(3);
        let samples = 8 * MAX_LANES;
        let path: Vec<u32> = (0..2 * samples as u32).collect();
        let (mut branches, mut out, mut expected) = (Branches::<S>::default(), Colors::default(), Colors::default());
        branches.open(samples);
        [&mut out, &mut expected].into_iter().for_each(|colors| colors.open(samples));
        let mut whole = 0;
        for first in (0..samples).step_by(S::Wide::N) {
            let lanes =
                if random.unit() < 0.5 { S::Wide::ALL } else { (random.unit() * 65536.0) as u32 & S::Wide::ALL };
            whole += usize::from(lanes == S::Wide::ALL);
            let weight = each(|_| S::Wide::constant(random.unit()));
            branches.push(lanes, &path[first..], [weight; 3], S::INFINITY);
        }
        branches.close();
        let occluded: Vec<u8> = (0..branches.len()).map(|_| u8::from(random.unit() < 0.3)).collect();
        branches.arrive(&occluded, &mut out);
        for i in (0..branches.len()).filter(|i| occluded[*i] == 0) {
            expected.add(branches.path[i] as usize, branches.weight_of(i));
        }
        assert!(whole > 0 && out.channels() == expected.channels());
    }

    #[test]
    fn light_arrives_as_ray_by_ray_in_either_precision() {
        light_arrives_as_ray_by_ray::<f32>();
        light_arrives_as_ray_by_ray::<f64>();
    }
}
