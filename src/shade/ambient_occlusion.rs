//! Ambient occlusion.

use super::sample::Sample;
use super::shader::{Shader, Workspace};
use crate::camera::sampling::{PixelRandom, cosine_hemisphere};
use crate::lanes::Real;

/// Name of the occlusion directions among the random dimensions of a pixel.
const DIMENSION: u32 = 1;

impl<S: Real> Shader<'_, S> {
    /// The share of cosine-distributed directions that are free up to the occlusion length, as grey; misses black.
    /// One batch per direction number, each with one ray per first hit.
    pub(super) fn ambient_occlusion(
        &self,
        pixels: &[(u32, u32)],
        sample: u32,
        work: &mut Workspace<S>,
        out: &mut [Sample],
    ) {
        let rounds = self.settings.ao_samples;
        let (zero, length) = (S::from_f64(0.0), S::from_f64(self.ao_length));
        let vertices = std::mem::take(&mut work.vertices);
        for round in 0..rounds {
            let index = sample.wrapping_mul(rounds).wrapping_add(round);
            work.batch.reset(vertices.len());
            for (i, vertex) in vertices.iter().enumerate() {
                let (x, y) = pixels[vertex.path as usize];
                let random = PixelRandom::new(x, y, self.settings.seed).spread(index, DIMENSION);
                let dir = cosine_hemisphere(vertex.normal, random).to_array().map(S::from_f64);
                work.batch.set(i, vertex.leave(), dir, zero, length);
            }
            work.rays.occlusion += work.batch.live_count() as u64;
            self.occlude(work, false, |i, left| out[vertices[i].path as usize].radiance += left);
        }
        for vertex in &vertices {
            out[vertex.path as usize].radiance /= f64::from(rounds.max(1));
        }
        work.vertices = vertices;
    }
}
