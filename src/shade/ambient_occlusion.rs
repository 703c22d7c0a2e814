//! Ambient occlusion.

use super::colors::Colors;
use super::sample::Rgba;
use super::shader::{Shader, Workspace};
use super::spot::{Spot, Spots};
use super::vertices::NORMAL;
use crate::camera::sampling::{PixelRandom, cosine_hemisphere};
use crate::lanes::Real;
use crate::ray::Rays;

/// Name of the occlusion directions among the random dimensions of a pixel.
const DIMENSION: u32 = 1;

impl<S: Real> Shader<'_, S> {
    /// The share of cosine-distributed directions that are free up to the occlusion length, as grey; misses black.
    /// One batch per direction number, each with one ray per first hit.
    pub(super) fn ambient_occlusion(
        &self,
        rays: &Rays<S>,
        spots: Spots<'_>,
        work: &mut Workspace<S>,
        out: &mut Colors,
    ) {
        let rounds = self.settings.ao_samples;
        let (zero, length) = (S::from_f64(0.0), S::from_f64(self.ao_length));
        let mut vertices = work.vertices.take().unwrap_or_default();
        let mut batch = std::mem::take(&mut work.batch);
        self.meet(rays, &work.hits, &mut vertices);
        let met: Vec<usize> = (0..rays.len()).filter(|i| work.hits.is_hit(*i)).collect();
        for round in 0..rounds {
            batch.reset(met.len());
            for (k, &i) in met.iter().enumerate() {
                let Spot { x, y, sample } = spots.at(i);
                let index = sample.wrapping_mul(rounds).wrapping_add(round);
                let random = PixelRandom::new(x, y, self.settings.seed).spread(index, DIMENSION);
                let dir = cosine_hemisphere(vertices.at(NORMAL, i), random).to_array().map(S::from_f64);
                batch.set(k, vertices.leave::<S>(i), dir, zero, length);
            }
            work.rays.occlusion += batch.live_count() as u64;
            self.occlude(&batch, work, false, |k, left| out.add(met[k], left));
        }
        for i in met {
            let Rgba { radiance, alpha } = out.get(i);
            out.set(i, Rgba { radiance: radiance / f64::from(rounds.max(1)), alpha });
        }
        (work.vertices, work.batch) = (Some(vertices), batch);
    }
}
