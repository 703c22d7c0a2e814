//! Options that say nothing of the picture that is asked for.

use super::RenderArgs;
use crate::shade::Integrator;

impl RenderArgs {
    /// Says what would change nothing of the pictures of `integrator`, and which integrators know it. No error: who draws one scene in
    /// several ways gives them all the same options.
    pub(super) fn warn_of_effect(&self, integrator: Integrator) {
        let name = integrator.name();
        let is_deep = matches!(integrator, Integrator::Whitted | Integrator::Path);
        let depth = self.depth.filter(|_| !is_deep);
        let depth = depth
            .map(|depth| format!("--depth {depth}: {name} has no depth that can be chosen, only whitted and path"));
        let is_other = integrator != Integrator::Ao;
        let samples = self.ao_samples.filter(|_| is_other);
        let samples = samples.map(|n| format!("--ao-samples {n}: {name} has no occlusion rays, only ao"));
        let radius = self.ao_radius.filter(|_| is_other);
        let radius = radius.map(|part| format!("--ao-radius {part}: {name} has no occlusion rays, only ao"));
        self.output.warn([depth, samples, radius].iter().flatten());
    }
}
