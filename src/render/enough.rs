//! When the tiles of a picture have samples enough, where that is found while rendering.
//!
//! A few samples alone do not tell: where light is found by chance they may all be black. Stopping there would make
//! pictures too dark. So paths need more samples to be believed, many more where all of them are alike, and tiles look
//! at the tiles around them. What is decided depends on samples only, not on threads or time.

use crate::camera::Tiling;

/// Samples per pixel of the first round; then it doubles.
pub(super) const FIRST_ROUND: u32 = 4;
/// Samples per pixel from which on what differs between paths tells how noisy they are.
const LEAST: u32 = 16;
/// The same where nothing differs, mostly since no path found light.
const LEAST_ALIKE: u32 = 64;

/// What the samples of a tile tell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// Samples of each pixel.
    pub count: u32,
    /// Estimate of the relative error of the pixels' means.
    pub error: f64,
    /// Whether paths were scattered, so that chance decides what they find.
    pub scatters: bool,
}

impl Evidence {
    /// The error, if there are samples enough to believe it.
    fn known(&self) -> Option<f64> {
        let least = match (self.scatters, self.error == 0.0) {
            (false, _) => FIRST_ROUND,
            (true, false) => LEAST,
            (true, true) => LEAST_ALIKE,
        };
        (self.count >= least).then_some(self.error)
    }
}

/// Whether each of `tiles` (numbers in rising order, with what is known of them) has samples enough for a relative error
/// of `noise`. Where paths are scattered, none of the eight tiles around may be known to have more: light that one tile
/// found and the next one not yet is the commonest reason for both.
pub(super) fn are_enough(tiles: &[(u32, Evidence)], tiling: &Tiling, noise: f64) -> Vec<bool> {
    let is_noisy = |number: u32| {
        let found = tiles.binary_search_by_key(&number, |tile| tile.0).ok().map(|i| &tiles[i].1);
        found.is_some_and(|tile| tile.scatters && tile.known().is_some_and(|error| error > noise))
    };
    let is_enough = |(number, tile): &(u32, Evidence)| {
        let is_even = tile.known().is_some_and(|error| error <= noise);
        is_even && !(tile.scatters && around(*number, tiling).any(is_noisy))
    };
    tiles.iter().map(is_enough).collect()
}

/// Numbers of the tiles around tile `number`, and its own.
fn around(number: u32, tiling: &Tiling) -> impl Iterator<Item = u32> {
    let (columns, rows) = (tiling.columns(), tiling.rows());
    let (column, row) = (number % columns, number / columns);
    let near = |i: u32, count: u32| i.saturating_sub(1)..(i + 2).min(count);
    near(row, rows).flat_map(move |row| near(column, columns).map(move |column| row * columns + column))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(count: u32, error: f64) -> Evidence {
        Evidence { count, error, scatters: true }
    }

    #[test]
    fn samples_that_are_alike_are_believed_late() {
        let enough = |tile: Evidence| are_enough(&[(0, tile)], &Tiling::new(8, 8, 8).unwrap(), 0.1)[0];
        assert_eq!([8, 16].map(|count| enough(paths(count, 0.05))), [false, true]);
        assert_eq!([32, 64].map(|count| enough(paths(count, 0.0))), [false, true]);
        assert!(!enough(paths(1 << 20, 0.2)) && !enough(paths(1 << 20, f64::NAN)));
        // Where nothing is left to chance, four samples tell.
        for error in [0.0, 0.1] {
            assert!(enough(Evidence { count: 4, error, scatters: false }));
        }
        assert!(!enough(Evidence { count: 2, error: 0.0, scatters: false }));
    }

    #[test]
    fn tiles_look_at_those_around_them() {
        // Five tiles in a row, three rows; the middle row is cropped to tiles 5 to 8, of which 6 is noisy.
        let tiling = Tiling::new(40, 24, 8).unwrap();
        let judged = |noisy: Evidence| {
            let empty = Evidence { count: 4, error: 0.0, scatters: false };
            let tiles = [(1, empty), (5, paths(64, 0.01)), (6, noisy), (7, paths(64, 0.0)), (8, paths(64, 0.01))];
            are_enough(&tiles, &tiling, 0.1)
        };
        assert_eq!(judged(paths(64, 0.2)), [true, false, false, false, true]);
        assert_eq!(judged(paths(64, 0.1)), [true; 5]);
        // It found nothing yet and tells nothing.
        assert_eq!(judged(paths(32, 0.0)), [true, true, false, true, true]);
        // An edge of something that scatters nothing is no sign of chance.
        assert_eq!(judged(Evidence { scatters: false, ..paths(64, 0.2) }), [true, true, false, true, true]);
        // Rows do not go on at the other side: 9 and 10 are not neighbours.
        let ends = [(9, paths(64, 0.01)), (10, paths(64, 0.2))];
        assert_eq!(are_enough(&ends, &tiling, 0.1), [true, false]);
    }
}
