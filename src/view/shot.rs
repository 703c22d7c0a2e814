//! A picture of a view with what it was made of, to be saved when the view and the scene may long be others.

use super::stage::{Look, Stage};
use crate::film::Film;
use crate::render::RenderOutput;

/// A picture, and how it came to be.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Its planes.
    pub film: Film,
    /// From where it was looked at what, and how.
    pub look: Look,
    /// Hash of the scene, see [`crate::scene::description::Description::hash`].
    pub scene_hash: String,
    /// Engine that traced; whatever [`Look::options`] call it.
    pub engine: String,
    /// Lanes of the engine's vectors; 0 if the scene has no such engine.
    pub lanes: u32,
    /// Rays that it traces together; likewise.
    pub batch: u32,
    /// Samples per pixel; an average if it was stopped.
    pub spp: u32,
    /// Rays traced.
    pub rays: u64,
    /// Wall clock time of the render.
    pub seconds: f64,
}

impl Shot {
    /// What came of rendering `stage` as `look` says.
    pub fn new(output: RenderOutput, look: &Look, stage: &dyn Stage) -> Self {
        let (rays, seconds) = (output.rays, output.seconds);
        // A map of work has one ray per pixel, whatever number of samples a picture would have.
        let spp = if output.is_complete() && look.heat.is_none() {
            look.options.spp
        } else {
            (rays.primary as f64 / output.film.window.area().max(1) as f64).round().max(1.0) as u32
        };
        let (engine, [lanes, batch]) = stage.engine(&look.options.engine).unwrap_or_default();
        let (engine, scene_hash) = (engine.into(), stage.description().hash.clone());
        Self {
            film: output.film,
            look: look.clone(),
            scene_hash,
            engine,
            lanes,
            batch,
            spp,
            rays: rays.total(),
            seconds,
        }
    }
}
