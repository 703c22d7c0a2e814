//! The rays of one bounce of many paths, with what they carry, and the shadow rays that go with them.

use super::points::{BASE, FIELDS, Fields, PARAM, RAW_DIR, RAW_PLACE, RAW_TRIANGLE, SQUEEZE, THROUGHPUT};
use crate::lanes::chosen::{Chosen, at, spill};
use crate::lanes::{Lanes, Lanes3, Real};
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
        self.path.extend(chosen.iter().map(|lane| path[lane]));
        self.rays.put(first, chosen, [org, dir], S::Wide::splat(S::INFINITY));
        extend(&mut self.throughput, chosen, throughput);
        for (list, values) in [(&mut self.pdf, pdf), (&mut self.squeeze, squeeze)] {
            list.resize(first + chosen.count(), S::ZERO);
            chosen.pack(values, &mut list[first..]);
        }
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.truncate(self.path.len());
    }

    /// The fields of the point on a bare triangle that ray `i` met; the rest is computed in packets.
    #[inline]
    pub fn raw_fields(&self, i: usize, hits: &Hits<S>, triangle: &[S; 9], look: &Look) -> Fields<S> {
        let mut fields = [S::ZERO; FIELDS];
        fields[RAW_TRIANGLE..RAW_TRIANGLE + 9].copy_from_slice(triangle);
        fields[RAW_DIR..RAW_DIR + 3].copy_from_slice(&self.rays.dir(i));
        (0..3).for_each(|axis| fields[BASE + axis] = S::from_f64(look.base[axis]));
        (0..4).for_each(|k| fields[PARAM + k] = S::from_f64(look.param[k]));
        fields[RAW_PLACE] = hits.u[i];
        fields[RAW_PLACE + 1] = hits.v[i];
        fields[RAW_PLACE + 2] = hits.t[i];
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

    /// Adds rays: the lanes `chosen` of origins, directions, light and ends.
    #[inline(always)]
    pub fn push(&mut self, chosen: &Chosen, path: &[u32], [org, dir, light]: [Lanes3<S::Wide>; 3], t_max: S::Wide) {
        let first = self.path.len();
        self.path.extend(chosen.iter().map(|lane| path[lane]));
        self.rays.put(first, chosen, [org, dir], t_max);
        extend(&mut self.light, chosen, light);
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.truncate(self.path.len());
    }
}

/// Adds the lanes `chosen` of `vectors`.
#[inline(always)]
fn extend<S: Real>(list: &mut Vec<[S; 3]>, chosen: &Chosen, vectors: Lanes3<S::Wide>) {
    let columns = spill(vectors);
    list.extend(chosen.iter().map(|lane| at(&columns, lane)));
}
