//! What would fit where a grid needs more memory than allowed: found on a coarse grid, before it is said.

use super::{BYTES_PER_MEETING, Fineness};
use crate::error::{Error, Result};

/// Cells along the longest side of a grid that is sampled, whatever the memory, to say what a finer one needs.
pub const COARSE: f64 = 64.0;

/// Times as many edges as a coarse grid tells may be crossed.
const MARGIN: f64 = 1.1;

/// `result`; if it is refused, then with what `hint` says would fit.
///
/// # Errors
/// Those of `result` and of `hint`.
pub fn hinted<T>(result: Result<T>, hint: impl FnOnce() -> Result<String>) -> Result<T> {
    match result {
        Err(Error::Usage(what)) => Err(Error::Usage(format!("{what}; {}", hint()?))),
        other => other,
    }
}

/// A grid that was sampled: cells along its longest side, and how many of its edges cross the surface.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// Cells along the longest side.
    pub cells: f64,
    /// Edges that cross the surface.
    pub crossed: u64,
}

impl Sampled {
    /// Edges crossed of cells of another size: of cells half as large, a surface crosses four times as many.
    pub fn crossed_of(self, cells: f64) -> u64 {
        (self.crossed as f64 * (cells / self.cells).powi(2)) as u64
    }

    /// Bytes for the edges crossed of such cells, rather too many.
    pub fn bytes_of(self, cells: f64) -> u64 {
        (MARGIN * self.crossed_of(cells) as f64) as u64 * BYTES_PER_MEETING
    }
}

/// The largest number of cells, below `refused` of them, whose bytes are allowed; 0 if there is none. `bytes` (`None` if there is no
/// such grid) must not fall.
pub fn largest(refused: u64, fineness: &Fineness, bytes: impl Fn(u64) -> Option<u64>) -> u64 {
    let (mut fits, mut too_many) = (0, refused.max(1));
    while too_many - fits > 1 {
        let middle = fits.midpoint(too_many);
        if bytes(middle).is_some_and(|bytes| bytes <= fineness.memory) {
            fits = middle;
        } else {
            too_many = middle;
        }
    }
    fits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_that_fits() {
        let fineness = Fineness { tolerance: 1.0, cells: None, memory: 1000 };
        let of = |refused| largest(refused, &fineness, |n| (n < 100).then_some(n * n));
        assert_eq!([0, 1, 2, 20, 32, 33, 1000].map(of), [0, 0, 1, 19, 31, 31, 31]);
        assert_eq!(largest(50, &fineness, |_| None), 0);
    }

    #[test]
    fn finer_grids_cross_more_edges() {
        let known = Sampled { cells: 64.0, crossed: 100 };
        assert_eq!([32.0, 64.0, 128.0].map(|cells| known.crossed_of(cells)), [25, 100, 400]);
        assert_eq!(known.bytes_of(128.0), 440 * BYTES_PER_MEETING);
    }
}
