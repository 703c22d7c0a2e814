//! EXR pictures: every plane of a film, its windows, and how it was made.
//!
//! Source: F. Kainz, R. Bogart, "Technical Introduction to OpenEXR", and "Standard Attributes" of the OpenEXR
//! documentation. Files are single-part scanline images, which the widest range of programs opens.

mod read;
mod write;

pub use read::{parse, read};
pub use write::{Compression, write};

/// How a picture was made; becomes attributes of the file.
///
/// Matrices are `m[row][column]` and act on column vectors (`p' = M p`); the file gets Imath's row-vector form, which
/// is the transpose. `worldToCamera` and `worldToNDC` are as OpenEXR's standard attributes describe them.
///
/// What is empty or 0 is not known and becomes no attribute; neither does the seed without samples, nor the time without rays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageInfo {
    /// Program and version; attribute `software`.
    pub software: String,
    /// Source revision; `lanecast/revision`.
    pub revision: String,
    /// Hash of the scene; `lanecast/sceneHash`.
    pub scene_hash: String,
    /// Engine that traced; `lanecast/engine`.
    pub engine: String,
    /// Instruction set the engine ran on; `lanecast/isa`.
    pub isa: String,
    /// Lanes of the vectors that rays were traced in; `lanecast/lanes`, an int.
    pub lanes: u32,
    /// Rays that were traced together; `lanecast/batch`, an int.
    pub batch: u32,
    /// Samples per pixel, on average where pixels have different numbers of them; `lanecast/spp`, an int.
    pub spp: u32,
    /// Seed of the sampler; `lanecast/seed`, a string of decimal digits because EXR has no 64-bit integer.
    pub seed: u64,
    /// Wall time of the render in seconds; `lanecast/renderSeconds`, a double.
    pub render_seconds: f64,
    /// Rays traced; `lanecast/rays`, a double (exact up to 2^53).
    pub rays: u64,
    /// World space to camera space; attribute `worldToCamera`.
    pub world_to_camera: Option<[[f64; 4]; 4]>,
    /// World space to normalized device coordinates; attribute `worldToNDC`.
    pub world_to_ndc: Option<[[f64; 4]; 4]>,
}

#[cfg(test)]
mod tests;
