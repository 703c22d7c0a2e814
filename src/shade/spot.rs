//! Which sample of a picture a primary ray is, and the random numbers that belong to it.

use crate::camera::sampling::pcg4d;
use crate::camera::sobol::PixelPoints;

/// Which sample of which pixel a primary ray is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spot {
    /// Column of the pixel.
    pub x: u32,
    /// Row of the pixel.
    pub y: u32,
    /// Number of the sample.
    pub sample: u32,
}

/// The random numbers of a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Draw {
    /// The points of its pixel.
    pub points: PixelPoints,
    /// Number of the sample.
    pub sample: u32,
}

impl Draw {
    /// Those of `spot` in a picture of seed `seed`.
    pub fn new(spot: Spot, seed: u64) -> Self {
        Self { points: PixelPoints::new(spot.x, spot.y, seed), sample: spot.sample }
    }

    /// A number in [0, 1) of a bounce, by name.
    pub fn number(self, bounce: u32, name: u32) -> f64 {
        let [bits, ..] = pcg4d([self.points.bits(0, u32::MAX)[0], self.sample, bounce, name]);
        f64::from(bits) / 4_294_967_296.0
    }
}
