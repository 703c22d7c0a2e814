//! Batches of primary rays that meet nothing: where they all show the same, nobody need make them.

use glam::DVec3;

use super::integrator::Integrator;
use super::sample::{Rgba, Samples};
use super::shader::{Shader, Workspace};
use crate::bvh::Bundle;
use crate::camera::Range;
use crate::lanes::Real;
use crate::trace::is_void;

impl<S: Real> Shader<'_, S> {
    /// See [`Shader::shade_void`].
    pub(super) fn nothing(&self, range: &Range<S>, count: u64, work: &mut Workspace<S>, out: &mut Samples) -> bool {
        let Some(seen) = self.beyond_everywhere() else { return false };
        let [org, dir] = *range;
        work.clock.start(&work.rays);
        if !is_void(self.world, &Bundle::spanning(org, dir, S::ZERO, S::INFINITY)) {
            return false;
        }
        out.open(count as usize, self.shows_hits());
        out.colors.fill(seen);
        work.rays.primary += count;
        work.lap(0);
        true
    }

    /// What primary rays see that meet nothing, if that is the same for all.
    fn beyond_everywhere(&self) -> Option<Rgba> {
        // Who counts counts what each ray took.
        if self.settings.count || self.settings.cost {
            return None;
        }
        match (self.settings.integrator, &self.rt) {
            (Integrator::Rt, Some(rt)) => {
                let radiance = DVec3::from(rt.surroundings::<S>()?.map(S::to_f64));
                Some(Rgba { radiance: radiance + DVec3::ZERO, alpha: 1.0 })
            }
            (Integrator::Whitted | Integrator::Rt, _) => self.even_beyond().map(|radiance| self.behind(radiance)),
            (Integrator::Ao | Integrator::Normals | Integrator::Depth, _) => Some(Rgba::default()),
            (Integrator::Path | Integrator::Cost, _) => None,
        }
    }
}
