//! Sums of samples, kept between steps.

use glam::DVec3;

use super::super::pixels::add;
use crate::shade::Sample;

/// Sums of the samples of a tile's pixels. A picture without further planes needs 32 bytes per pixel instead of 200: memory
/// that is written in one step and read in the next costs more than the sums themselves.
pub(super) enum Sums {
    /// Radiance and coverage.
    Color(Vec<(DVec3, f64)>),
    /// Everything.
    Whole(Vec<Sample>),
}

impl Sums {
    /// No room yet; of colours only, or of all that samples hold.
    pub fn new(only_color: bool) -> Self {
        if only_color { Self::Color(Vec::new()) } else { Self::Whole(Vec::new()) }
    }

    /// Room for `pixels` sums, empty where there were none.
    pub fn make_room(&mut self, pixels: usize) {
        match self {
            Self::Color(sums) => sums.resize(pixels, (DVec3::ZERO, 0.0)),
            Self::Whole(sums) => sums.resize(pixels, Sample::MISS),
        }
    }

    /// Adds `sample` to sum number `pixel`.
    pub fn add(&mut self, pixel: usize, sample: &Sample) {
        match self {
            Self::Color(sums) => add_color(&mut sums[pixel], sample),
            Self::Whole(sums) => add(&mut sums[pixel], sample),
        }
    }

    /// Adds a sample to each sum.
    pub fn add_all(&mut self, samples: &[Sample]) {
        match self {
            Self::Color(sums) => sums.iter_mut().zip(samples).for_each(|(sum, sample)| add_color(sum, sample)),
            Self::Whole(sums) => sums.iter_mut().zip(samples).for_each(|(sum, sample)| add(sum, sample)),
        }
    }

    /// Sum number `pixel`; what is not kept reads as of a miss.
    pub fn of(&self, pixel: usize) -> Sample {
        match self {
            Self::Color(sums) => Sample { radiance: sums[pixel].0, alpha: sums[pixel].1, ..Sample::MISS },
            Self::Whole(sums) => sums[pixel],
        }
    }

    /// Gives the memory back.
    pub fn free(&mut self) {
        match self {
            Self::Color(sums) => *sums = Vec::new(),
            Self::Whole(sums) => *sums = Vec::new(),
        }
    }
}

/// The same operations as in [`add`], so the same bits.
fn add_color(sum: &mut (DVec3, f64), sample: &Sample) {
    sum.0 += sample.radiance;
    sum.1 += sample.alpha;
}
