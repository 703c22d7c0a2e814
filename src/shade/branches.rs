//! Rays that leave the points of one level, with what they carry, and shadow rays with the light that they ask for.

use glam::DVec3;

use super::vertices::lanes_of;
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
        self.rays.reset(most);
        self.path.clear();
        self.weight.iter_mut().for_each(|weight| weight.resize(most.next_multiple_of(MAX_LANES), S::ZERO));
    }

    /// Adds those of the lanes `lanes`, which belong to the samples `path`: rays from `org` along `dir` up to `t_max`.
    #[inline(always)]
    pub fn push(&mut self, lanes: u32, path: &[u32], [org, dir, weight]: [Lanes3<S::Wide>; 3], t_max: S) {
        let (mut list, mut count) = ([0; MAX_LANES], 0);
        for lane in lanes_of(lanes) {
            list[count] = lane;
            count += 1;
            self.path.push(path[lane]);
        }
        let (list, first) = (&list[..count], self.path.len() - count);
        for axis in 0..3 {
            pack(org[axis], list, &mut self.rays.org[axis][first..]);
            pack(dir[axis], list, &mut self.rays.dir[axis][first..]);
            pack(weight[axis], list, &mut self.weight[axis][first..]);
        }
        self.rays.t_min[first..first + count].fill(S::ZERO);
        self.rays.t_max[first..first + count].fill(t_max);
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.truncate(self.path.len());
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

/// The lanes `list` of `from`, one after the other.
#[inline(always)]
fn pack<V: Lanes>(from: V, list: &[usize], to: &mut [V::Scalar]) {
    if list.len() == V::N {
        return from.store(to);
    }
    let mut column = [V::Scalar::ZERO; MAX_LANES];
    from.store(&mut column);
    to.iter_mut().zip(list).for_each(|(x, &lane)| *x = column[lane % MAX_LANES]);
}
