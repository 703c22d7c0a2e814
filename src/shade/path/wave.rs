//! The rays of one bounce of many paths, with what they carry, and the shadow rays that go with them.

use glam::DVec3;

use super::points::{
    BASE, FIELDS, Fields, OUT, PARAM, RAW_CORNER, RAW_EDGE1, RAW_EDGE2, RAW_PLACE, SQUEEZE, THROUGHPUT,
};
use crate::lanes::{Real, dot};
use crate::ray::{Hits, Rays};
use crate::shade::look::Look;

/// Rays and what their paths carry, in parallel.
#[derive(Clone, Debug)]
pub struct Wave<S> {
    /// The rays; directions are unit after the first bounce.
    pub rays: Rays<S>,
    /// Path of each.
    pub path: Vec<u32>,
    /// What of the radiance along the ray reaches the eye.
    pub throughput: Vec<[S; 3]>,
    /// Density with which the direction was found, per solid angle; infinite if no light could be aimed at.
    pub pdf: Vec<S>,
    /// Product of the squared relative indices of refraction that the throughput was divided by.
    pub squeeze: Vec<S>,
}

impl<S: Real> Default for Wave<S> {
    fn default() -> Self {
        Self { rays: Rays::new(0), path: Vec::new(), throughput: Vec::new(), pdf: Vec::new(), squeeze: Vec::new() }
    }
}

impl<S: Real> Wave<S> {
    /// Empty, with room for `count` rays.
    pub fn open(&mut self, count: usize) {
        self.rays.reset(count);
        self.path.clear();
        self.throughput.clear();
        self.pdf.clear();
        self.squeeze.clear();
    }

    /// Adds a ray with an open end.
    pub fn push(&mut self, path: u32, org: [S; 3], dir: [S; 3], throughput: [S; 3], pdf: S, squeeze: S) {
        self.rays.set(self.path.len(), org, dir, S::ZERO, S::INFINITY);
        self.path.push(path);
        self.throughput.push(throughput);
        self.pdf.push(pdf);
        self.squeeze.push(squeeze);
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.truncate(self.path.len());
    }

    /// The fields of the point on a bare triangle that ray `i` met; the rest is computed in packets.
    #[inline]
    pub fn raw_fields(&self, i: usize, hits: &Hits<S>, triangle: &[DVec3; 3], look: &Look) -> Fields<S> {
        let mut fields = [S::ZERO; FIELDS];
        let mut put = |at: usize, v: DVec3| (0..3).for_each(|axis| fields[at + axis] = S::from_f64(v[axis]));
        put(RAW_CORNER, triangle[0]);
        put(RAW_EDGE1, triangle[1]);
        put(RAW_EDGE2, triangle[2]);
        put(BASE, look.base);
        let dir = self.rays.dir(i);
        let length = dot(dir, dir).sqrt();
        let back = -(S::ONE / length);
        (0..3).for_each(|axis| fields[OUT + axis] = dir[axis] * back);
        (0..4).for_each(|k| fields[PARAM + k] = S::from_f64(look.param[k]));
        fields[RAW_PLACE] = hits.u[i];
        fields[RAW_PLACE + 1] = hits.v[i];
        fields[RAW_PLACE + 2] = hits.t[i] * length;
        fields[THROUGHPUT..THROUGHPUT + 3].copy_from_slice(&self.throughput[i]);
        fields[SQUEEZE] = self.squeeze[i];
        fields
    }
}

/// Shadow rays and what arrives if nothing is in between.
#[derive(Clone, Debug)]
pub struct Shadows<S> {
    /// The rays.
    pub rays: Rays<S>,
    /// Path of each.
    pub path: Vec<u32>,
    /// What arrives at the eye.
    pub light: Vec<[S; 3]>,
}

impl<S: Real> Default for Shadows<S> {
    fn default() -> Self {
        Self { rays: Rays::new(0), path: Vec::new(), light: Vec::new() }
    }
}

impl<S: Real> Shadows<S> {
    /// Empty, with room for `count` rays.
    pub fn open(&mut self, count: usize) {
        self.rays.reset(count);
        self.path.clear();
        self.light.clear();
    }

    /// Adds a ray.
    pub fn push(&mut self, path: u32, org: [S; 3], dir: [S; 3], t_max: S, light: [S; 3]) {
        self.rays.set(self.path.len(), org, dir, S::ZERO, t_max);
        self.path.push(path);
        self.light.push(light);
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.truncate(self.path.len());
    }
}
