//! Closest hits and shadow rays in scenes where surfaces let rays pass by their opacity.

use super::{PathMemory, Paths};
use crate::camera::sampling::pcg4d;
use crate::camera::sobol::PixelPoints;
use crate::lanes::Real;
use crate::ray::{Hits, INVALID_ID, Rays};
use crate::shade::shader::Workspace;
use glam::DVec3;

/// Surfaces that a ray may pass; what lies behind more of them is not seen.
const MOST_LAYERS: u32 = 1024;
/// Name of the number that chooses in mixtures; layers that a ray meets are named by their number.
pub(super) const MIXTURE: u32 = u32::MAX;

/// A number in [0, 1) of a pixel's sample and bounce, by name.
pub(super) fn number(pixel: PixelPoints, sample: u32, bounce: u32, name: u32) -> f64 {
    let [bits, ..] = pcg4d([pixel.bits(0, u32::MAX)[0], sample, bounce, name]);
    f64::from(bits) / 4_294_967_296.0
}

/// Rays on their way through layers.
#[derive(Debug)]
pub(super) struct Again<S> {
    rays: Rays<S>,
    hits: Hits<S>,
    /// Which ray of the batch each is.
    index: Vec<u32>,
}

impl<S: Real> Default for Again<S> {
    fn default() -> Self {
        Self { rays: Rays::new(0), hits: Hits::new(0), index: Vec::new() }
    }
}

impl<S: Real> Paths<'_, S> {
    /// Closest hits of the wave into `work.hits`; what opacity lets pass is no hit.
    pub(super) fn closest(&self, bounce: u32, sample: u32, memory: &mut PathMemory<S>, work: &mut Workspace<S>) {
        let rays = &memory.now.rays;
        self.engine.intersect(self.world, rays, &mut work.hits, &mut work.scratch, None);
        if !self.looks.has_holes {
            return;
        }
        let Again { rays: again, hits: found, index } = &mut memory.again;
        index.clear();
        index.extend(0..rays.len() as u32);
        for layer in 0..MOST_LAYERS {
            index.retain(|&i| {
                let opacity = self.opacity(rays, &work.hits, i as usize);
                let pixel = memory.pixels[memory.now.path[i as usize] as usize];
                opacity < 1.0 && number(pixel, sample, bounce, layer) >= opacity
            });
            if index.is_empty() {
                return;
            }
            behind(rays, &work.hits, index, again);
            self.engine.intersect(self.world, again, found, &mut work.scratch, None);
            for (k, &i) in index.iter().enumerate() {
                copy(found, k, &mut work.hits, i as usize);
            }
        }
    }

    /// Calls `arrive` with the path and the light of each shadow ray that something is left of.
    pub(super) fn shadows(
        &self,
        memory: &mut PathMemory<S>,
        work: &mut Workspace<S>,
        mut arrive: impl FnMut(u32, DVec3),
    ) {
        let shadows = &memory.shadows;
        let light = |i: usize| DVec3::from(shadows.light[i].map(S::to_f64));
        if !self.looks.has_holes {
            self.engine.occluded(self.world, &shadows.rays, &mut work.occluded, &mut work.scratch, None);
            for (i, &path) in shadows.path.iter().enumerate() {
                if work.occluded[i] == 0 {
                    arrive(path, light(i));
                }
            }
            return;
        }
        let Again { rays: again, hits: found, index } = &mut memory.again;
        self.engine.intersect(self.world, &shadows.rays, &mut work.hits, &mut work.scratch, None);
        let mut passed = vec![1.0; shadows.path.len()];
        index.clear();
        index.extend(0..shadows.path.len() as u32);
        for _ in 0..MOST_LAYERS {
            index.retain(|&i| {
                let i = i as usize;
                if work.hits.is_hit(i) {
                    passed[i] *= 1.0 - self.opacity(&shadows.rays, &work.hits, i);
                }
                work.hits.is_hit(i) && passed[i] > 0.0
            });
            if index.is_empty() {
                break;
            }
            behind(&shadows.rays, &work.hits, index, again);
            self.engine.intersect(self.world, again, found, &mut work.scratch, None);
            for (k, &i) in index.iter().enumerate() {
                copy(found, k, &mut work.hits, i as usize);
            }
        }
        for (i, &path) in shadows.path.iter().enumerate() {
            if passed[i] > 0.0 {
                arrive(path, light(i) * passed[i]);
            }
        }
    }

    /// Share of light that the surface hit by ray `i` stops; 1 for a miss.
    fn opacity(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize) -> f64 {
        if !hits.is_hit(i) {
            return 1.0;
        }
        let (prim, inst) = (hits.prim[i], hits.inst[i]);
        let material = self.world.material(self.world.assembly.placements[inst as usize].object, prim);
        if !self.looks.is_holed(material) {
            return 1.0;
        }
        let [org, dir] = [rays.org(i), rays.dir(i)].map(|v| DVec3::from(v.map(S::to_f64)));
        let [t, u, v] = [hits.t[i], hits.u[i], hits.v[i]].map(S::to_f64);
        self.looks.opacity(material, &self.world.surface(org, dir, t, u, v, prim, inst))
    }
}

/// The rays `index` of `rays` from behind their hits, into `again`.
fn behind<S: Real>(rays: &Rays<S>, hits: &Hits<S>, index: &[u32], again: &mut Rays<S>) {
    again.reset(index.len());
    for (k, &i) in index.iter().enumerate() {
        let i = i as usize;
        again.set(k, rays.org(i), rays.dir(i), hits.t[i].next_up(), rays.t_max[i]);
    }
}

fn copy<S: Real>(from: &Hits<S>, k: usize, to: &mut Hits<S>, i: usize) {
    (to.t[i], to.u[i], to.v[i]) = (from.t[k], from.u[k], from.v[k]);
    (to.prim[i], to.inst[i]) = (from.prim[k], from.inst[k]);
    debug_assert!(from.is_hit(k) || to.prim[i] == INVALID_ID);
}
