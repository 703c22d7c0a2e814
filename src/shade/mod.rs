//! Materials, lights and integrators: what colour a batch of rays sees.
//!
//! Integrators work on whole batches, never ray by ray: primary hits give a compact batch of shadow rays per light,
//! then a compact batch of mirrored and refracted rays, which is the next level's batch. Shading runs in lanes; lanes never
//! look at each other, and terms are added in an order that depends on the path alone, so what becomes of a pixel's hits does not
//! depend on what else is in its batch. The hits themselves may, by rounding: those of engines that trace a batch with an
//! arithmetic of its own, as `tile` does.

mod ambient_occlusion;
mod bare;
mod branches;
mod classic;
mod colors;
mod compiled;
mod glow;
mod integrator;
mod lights;
mod look;
mod look_lanes;
mod meeting;
mod offset;
mod path;
mod place;
mod rt;
mod sample;
mod shader;
mod spot;
mod stats;
mod through;
mod vertices;
mod views;
mod void;
mod whitted;

pub use colors::Colors;
pub use compiled::Shades;
pub use integrator::Integrator;
pub use lights::headlight;
pub use offset::{offset_origin, position_error};
pub use path::unaimed;
pub use rt::unknown_shaders;
pub use sample::{FirstHit, RayCounts, Rgba, Samples};
pub use shader::{Settings, Shader, Workspace};
pub use spot::{Spot, Spots};
pub use stats::{BounceStats, PathStats};
