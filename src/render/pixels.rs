//! What a pixel of a picture shows.

use glam::DVec3;

use crate::shade::{FirstHit, Rgba};

/// A pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Mean colour of its samples.
    pub color: Rgba,
    /// Means of what else they saw; distance, position and ids of the nearest.
    pub hit: FirstHit,
    /// Of the mean brightness, estimated from the samples; 0 for one sample.
    pub variance: f64,
    /// Number of samples.
    pub samples: u32,
}

impl Pixel {
    /// Without a sample.
    pub const EMPTY: Self =
        Self { color: Rgba { radiance: DVec3::ZERO, alpha: 0.0 }, hit: FirstHit::NONE, variance: 0.0, samples: 0 };
}

/// What samples of a pixel are compared by.
pub(super) fn brightness(radiance: DVec3) -> f64 {
    radiance.element_sum() / 3.0
}
