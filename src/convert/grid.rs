//! A uniform grid over a box: corners, cells, and the lines through them.

use glam::DVec3;

use crate::error::{Error, Result};

/// Most cells along one axis: numbers of corners stay far below 2^64, lines of one batch below 2^32.
const MAX_CELLS: f64 = 65_536.0;

/// Corner (i, j, k) is at `origin + spacing (i, j, k)`; there is one corner more than cells on each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Corner (0, 0, 0), scene units.
    pub origin: DVec3,
    /// Edge of a cell, scene units.
    pub spacing: f64,
    /// Number of cells along x, y and z.
    pub cells: [usize; 3],
}

impl Grid {
    /// A grid around the box `lo..hi` with cells of `spacing`, at least half a cell wider on each side. `shift`
    /// (shares of a cell, 0..1) moves its planes against the box, whose own faces would otherwise lie in them.
    ///
    /// # Errors
    /// More than 65 536 cells along an axis.
    pub fn around(lo: DVec3, hi: DVec3, spacing: f64, shift: DVec3) -> Result<Self> {
        let origin = lo - spacing * (DVec3::splat(1.0) + shift);
        Self::new(origin, spacing, ((hi - origin) / spacing).ceil() + 1.0)
    }

    /// A grid of `counts` cells.
    ///
    /// # Errors
    /// More than 65 536 cells along an axis.
    pub fn new(origin: DVec3, spacing: f64, counts: DVec3) -> Result<Self> {
        if !counts.is_finite() || counts.max_element() > MAX_CELLS {
            let most = counts.max_element();
            return Err(Error::Usage(format!(
                "cells of {spacing:e} need {most} of them along an axis, at most {MAX_CELLS} are allowed"
            )));
        }
        Ok(Self { origin, spacing, cells: counts.to_array().map(|n| n as usize) })
    }

    /// Number of corners along each axis.
    pub fn corners(&self) -> [usize; 3] {
        self.cells.map(|n| n + 1)
    }

    /// Number of all corners.
    pub fn corner_count(&self) -> u64 {
        self.corners().iter().map(|&n| n as u64).product()
    }

    /// Number of corner `at`; x runs fastest.
    pub fn corner(&self, at: [usize; 3]) -> u64 {
        let [nx, ny, _] = self.corners().map(|n| n as u64);
        let [x, y, z] = at.map(|n| n as u64);
        x + nx * (y + ny * z)
    }

    /// The corner that has a number.
    pub fn corner_at(&self, number: u64) -> [usize; 3] {
        let [nx, ny, _] = self.corners().map(|n| n as u64);
        [number % nx, number / nx % ny, number / nx / ny].map(|n| n as usize)
    }

    /// The cell with a point in it, by its lower corner.
    pub fn cell_at(&self, point: DVec3) -> Option<[usize; 3]> {
        let at = ((point - self.origin) / self.spacing).floor().to_array();
        let is_cell = at.iter().zip(self.cells).all(|(&n, count)| n >= 0.0 && n < count as f64);
        is_cell.then(|| at.map(|n| n as usize))
    }

    /// Where corner `at` is.
    pub fn position(&self, at: [usize; 3]) -> DVec3 {
        self.origin + self.spacing * DVec3::from_array(at.map(|n| n as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_by_hand() {
        let grid = Grid::around(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0), 0.5, DVec3::splat(0.5)).unwrap();
        assert_eq!((grid.origin, grid.cells), (DVec3::splat(-0.75), [7, 5, 5]));
        assert_eq!(grid.corner_count(), 8 * 6 * 6);
        assert_eq!(grid.corner([3, 2, 1]), 3 + 8 * (2 + 6));
        assert_eq!(grid.corner_at(grid.corner([7, 5, 4])), [7, 5, 4]);
        assert_eq!(grid.position([1, 0, 2]), DVec3::new(-0.25, -0.75, 0.25));
        assert_eq!(grid.cell_at(DVec3::new(-0.2, -0.7, 0.3)), Some([1, 0, 2]));
        assert_eq!(grid.cell_at(DVec3::new(-0.8, 0.0, 0.0)), None);
        assert!(Grid::around(DVec3::ZERO, DVec3::ONE, 1e-9, DVec3::ZERO).is_err());
    }
}
