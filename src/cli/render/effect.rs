//! Options that say nothing of the picture that is asked for.

use super::RenderArgs;
use crate::error::{Error, Result};
use crate::shade::Integrator;

impl RenderArgs {
    /// Refuses what would change nothing of the pictures of `integrator`: who writes it expects that it does.
    ///
    /// # Errors
    /// [`Error::Usage`], with the integrators that know the option.
    pub(super) fn check_effect(&self, integrator: Integrator) -> Result<()> {
        let fail = |what: String| Err(Error::Usage(what));
        let name = integrator.name();
        if let (Some(depth), false) = (self.depth, matches!(integrator, Integrator::Whitted | Integrator::Path)) {
            return fail(format!("--depth {depth}: {name} has no depth that can be chosen, only whitted and path"));
        }
        if integrator == Integrator::Ao {
            return Ok(());
        }
        match (self.ao_samples, self.ao_radius) {
            (Some(samples), _) => fail(format!("--ao-samples {samples}: {name} has no occlusion rays, only ao")),
            (_, Some(radius)) => fail(format!("--ao-radius {radius}: {name} has no occlusion rays, only ao")),
            (None, None) => Ok(()),
        }
    }
}
