//! Which sample of a picture a primary ray is, and the random numbers that belong to it.

use crate::camera::sampling::pcg4d;
use crate::camera::sobol::PixelPoints;
use crate::camera::{Passes, morton_decode};

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

/// Which samples the rays of a batch are.
#[derive(Clone, Copy, Debug)]
pub enum Spots<'a> {
    /// Sample 0 of each of these pixels.
    Listed(&'a [(u32, u32)]),
    /// Passes over a tile.
    Tile {
        /// The tile's upper left pixel.
        corner: (u32, u32),
        /// The passes.
        passes: Passes,
        /// Sample of the first pass.
        first: u32,
    },
}

impl Spots<'_> {
    /// That of ray `i`.
    pub fn at(self, i: usize) -> Spot {
        match self {
            Self::Listed(pixels) => Spot { x: pixels[i].0, y: pixels[i].1, sample: 0 },
            Self::Tile { corner: (x, y), passes, first } => {
                let (pass, pixel) = passes.of_ray(i);
                let (dx, dy) = morton_decode(pixel as u32);
                Spot { x: x + dx, y: y + dy, sample: first + pass }
            }
        }
    }
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
