//! The picture that a bench leaves beside its rows.

use std::path::PathBuf;

use super::RenderArgs;
use crate::camera::Filter;
use crate::cli::common::{CameraArgs, EngineArgs, OutputArgs, SceneArgs, ThreadArgs};
use crate::cli::picture::{Format, Target};
use crate::cli::preview::PreviewArgs;

impl RenderArgs {
    /// The arguments of a plain EXR picture of a scene: what a bench leaves beside its rows.
    pub(in crate::cli) fn plain(scene: SceneArgs, camera: CameraArgs, threads: ThreadArgs, path: PathBuf) -> Self {
        Self {
            scene,
            files: vec![Target { path, format: Format::Exr }],
            camera,
            crop: None,
            integrator: None,
            rt_compat: false,
            spp: Some(1),
            time_limit: None,
            noise: None,
            filter: Filter::Box,
            seed: 0,
            depth: None,
            stats: false,
            ao_samples: None,
            ao_radius: None,
            aov: "all".into(),
            exposure: 0.0,
            engine: EngineArgs::default(),
            tile: 32,
            frames: None,
            resume: false,
            preview: PreviewArgs::default(),
            threads,
            output: OutputArgs::default(),
        }
    }
}
