//! What a block's rays must all be, asked of many at once: as bits in which some ray is another, sums and minima.

use super::V;
use super::bundle::{TAME, sum};
use crate::lanes::words::least;
use crate::lanes::{Lanes, Lanes3};

/// What is asked of all rays of a block together.
pub struct Sure {
    /// Bits in which numbers are others than they must be.
    pub other: V,
    /// Sum of the numbers that must not be too large.
    pub total: V,
    /// Least size of a direction.
    pub shortest: V,
    /// Least speed along the frame's third axis.
    pub slowest: V,
}

impl Sure {
    /// Nothing was asked.
    pub fn new() -> Self {
        let (zero, infinite) = (V::constant(0.0), V::splat(f32::INFINITY));
        Self { other: zero, total: zero, shortest: infinite, slowest: infinite }
    }

    /// Takes in some directions.
    #[inline(always)]
    pub fn directions(&mut self, dir: Lanes3<V>) {
        let size = sum(dir);
        (self.total, self.shortest) = (self.total + size, self.shortest.fast_min(size));
    }

    /// Whether no number is another than it must be.
    #[inline(always)]
    pub fn same(&self) -> bool {
        bytemuck::cast::<_, [u32; 16]>(self.other.to_array()).iter().all(|bits| *bits == 0)
    }

    /// Whether all rays are what they were taken for.
    #[inline(always)]
    pub fn holds(&self) -> bool {
        // A sum shows what is no number, and what would overflow in the frame; minima do not.
        let total: f32 = self.total.to_array().iter().sum();
        let far = total <= TAME.1 && least(self.shortest) >= 3.0 * TAME.0;
        self.same() && far && least(self.slowest) >= f32::MIN_POSITIVE
    }
}
