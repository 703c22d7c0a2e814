//! Rays that leave the points of one level, with what they carry, and shadow rays with the light that they ask for.

use glam::DVec3;

use crate::lanes::chosen::Chosen;
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real, each};
use crate::ray::Rays;

/// Rays and, parallel to them, whose they are and what of the radiance along them arrives at the eye.
#[derive(Clone, Debug, Default)]
pub(super) struct Branches<S> {
    /// World space; each with its own end.
    pub rays: Rays<S>,
    /// The sample that each belongs to.
    pub path: Vec<u32>,
    weight: [Vec<S>; 3],
}

impl<S: Real> Branches<S> {
    /// What `len` primary rays carry: sample `i` belongs to ray `i`, all of its radiance arrives. The rays stay elsewhere.
    pub fn start(&mut self, len: usize) {
        self.open(0);
        self.path.extend(0..len as u32);
        for weight in &mut self.weight {
            weight.clear();
            weight.resize(len.next_multiple_of(MAX_LANES), S::ONE);
        }
    }

    /// None, with room for `most`.
    pub fn open(&mut self, most: usize) {
        self.rays.open(most);
        self.path.clear();
        self.weight.iter_mut().for_each(|weight| weight.resize(most.next_multiple_of(MAX_LANES), S::ZERO));
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

    /// What rays `first..first + N` carry.
    #[inline(always)]
    pub fn weight(&self, first: usize) -> Lanes3<S::Wide> {
        each(|axis| S::Wide::load(&self.weight[axis][first..]))
    }

    /// What ray `i` carries.
    #[inline]
    pub fn weight_of(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.weight[axis][i].to_f64()))
    }
}
