//! The rays of one bounce of many paths, with what they carry, and the shadow rays that go with them.

use glam::DVec3;

use crate::lanes::chosen::Chosen;
use crate::lanes::{Column, Lanes, Lanes3, Real, each};
use crate::ray::{PAD, Rays};

/// Rays and what their paths carry, in parallel.
#[derive(Clone, Debug, Default)]
pub struct Wave<S> {
    /// The rays; directions are unit after the first bounce.
    pub rays: Rays<S>,
    /// Path of each.
    pub path: Vec<u32>,
    /// What of the radiance along the ray reaches the eye. This and the next two may be longer than there are rays.
    pub throughput: [Column<S>; 3],
    /// Density with which the direction was found, per solid angle; infinite if no light could be aimed at.
    pub pdf: Column<S>,
    /// Product of the squared relative indices of refraction that the throughput was divided by.
    pub squeeze: Column<S>,
}

impl<S: Real> Wave<S> {
    /// Empty, with room for `count` rays.
    pub fn open(&mut self, count: usize) {
        self.rays.open(count);
        self.path.clear();
        self.columns().into_iter().for_each(|column| column.at_least(count.next_multiple_of(PAD)));
    }

    fn columns(&mut self) -> [&mut Column<S>; 5] {
        let [r, g, b] = &mut self.throughput;
        [r, g, b, &mut self.pdf, &mut self.squeeze]
    }

    /// Adds rays with open ends: the lanes `chosen` of origins, directions and throughputs, densities and squeezes.
    #[inline(always)]
    pub fn push_some(
        &mut self,
        chosen: &Chosen,
        path: &[u32],
        [org, dir, throughput]: [Lanes3<S::Wide>; 3],
        [pdf, squeeze]: [S::Wide; 2],
    ) {
        let first = self.path.len();
        chosen.extend(path, &mut self.path);
        self.rays.put(first, chosen, [org, dir], [S::ZERO, S::INFINITY].map(S::Wide::splat));
        let [r, g, b] = throughput;
        let numbers = [r, g, b, pdf, squeeze];
        self.columns().into_iter().zip(numbers).for_each(|(column, x)| chosen.pack(x, &mut column[first..]));
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.path.len());
    }

    /// Origin and direction of ray `i`.
    #[inline]
    pub fn line(&self, i: usize) -> (DVec3, DVec3) {
        (DVec3::from(self.rays.org(i).map(S::to_f64)), DVec3::from(self.rays.dir(i).map(S::to_f64)))
    }

    /// What of the radiance along ray `i` reaches the eye.
    #[inline]
    pub fn throughput(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.throughput[axis][i].to_f64()))
    }

    /// Weight of what ray `i` found by itself, by the power heuristic, against aiming at it with density `light`.
    #[inline]
    pub fn weight(&self, i: usize, light: f64) -> f64 {
        let odds = light / self.pdf[i].to_f64();
        1.0 / odds.mul_add(odds, 1.0)
    }
}

/// Shadow rays and what arrives if nothing is in between.
#[derive(Clone, Debug, Default)]
pub struct Shadows<S> {
    /// The rays.
    pub rays: Rays<S>,
    /// Path of each.
    pub path: Vec<u32>,
    /// What arrives at the eye.
    pub light: [Column<S>; 3],
}

impl<S: Real> Shadows<S> {
    /// Empty, with room for `count` rays.
    pub fn open(&mut self, count: usize) {
        self.rays.open(count);
        self.path.clear();
        self.light.iter_mut().for_each(|column| column.at_least(count.next_multiple_of(PAD)));
    }

    /// Adds rays: the lanes `chosen` of origins, directions, light and ends.
    #[inline(always)]
    pub fn push(&mut self, chosen: &Chosen, path: &[u32], [org, dir, light]: [Lanes3<S::Wide>; 3], t_max: S::Wide) {
        let first = self.path.len();
        chosen.extend(path, &mut self.path);
        self.rays.put(first, chosen, [org, dir], [S::Wide::splat(S::ZERO), t_max]);
        self.light.iter_mut().zip(light).for_each(|(column, x)| chosen.pack(x, &mut column[first..]));
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.path.len());
    }
}
