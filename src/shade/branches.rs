//! Rays that leave the points of one level, with what they carry, and shadow rays with the light that they ask for.

use glam::DVec3;

use super::colors::Colors;
use crate::lanes::chosen::{Chosen, at, lanes_of, spill};
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

    /// What ray `i` carries, which has a weight of its own.
    #[inline]
    pub fn weight_of(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.weight[axis][i].to_f64()))
    }
}
