//! Which corners of a grid are inside, as the places along x where that changes: memory goes with the surface, not
//! with the volume.

use std::ops::Range;

use super::grid::Grid;
use super::lines::Crossing;

/// Bytes of a row while it is made.
const BYTES_PER_ROW: u64 = 64;

/// Changes along x of every row of corners. A row begins and ends outside.
#[derive(Debug)]
pub struct Rows {
    /// Number of rows of one plane z.
    ny: usize,
    /// First change of each row; one more entry than rows.
    starts: Vec<usize>,
    /// Corners, counted along x, that differ from the one before.
    changes: Vec<u32>,
}

/// Corners `x` of a range whose states in two rows differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Which corners.
    pub x: Range<u32>,
    /// Whether the second row is inside there.
    pub enters: bool,
}

impl Rows {
    /// Bytes of the rows of `grid` before anything is known of the surface.
    pub fn least_bytes(grid: &Grid) -> u64 {
        let [_, ny, nz] = grid.corners().map(|n| n as u64);
        ny * nz * BYTES_PER_ROW
    }

    /// From the changes of all rows, y first, then z.
    pub fn new<'a>(grid: &Grid, rows: impl Iterator<Item = &'a [u32]>) -> Self {
        let [_, ny, nz] = grid.corners();
        let mut starts = Vec::with_capacity(ny * nz + 1);
        let mut changes = Vec::new();
        starts.push(0);
        for row in rows {
            changes.extend_from_slice(row);
            starts.push(changes.len());
        }
        Self { ny, starts, changes }
    }

    /// The changes of one row.
    pub fn row(&self, y: usize, z: usize) -> &[u32] {
        let row = y + self.ny * z;
        &self.changes[self.starts[row]..self.starts[row + 1]]
    }

    /// Number of all changes.
    pub fn count(&self) -> u64 {
        self.changes.len() as u64
    }

    /// Whether a corner is inside.
    pub fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        self.row(y, z).partition_point(|&change| change as usize <= x) % 2 == 1
    }
}

/// The changes that crossings of the line of a row make, see [`super::samples`] for the line. A corner on the
/// surface counts as behind it. The outermost corners are outside.
pub fn changes(found: &[Crossing], spacing: f64, corners: usize) -> Vec<u32> {
    let mut list: Vec<u32> = Vec::new();
    for crossing in found {
        let mut at = (crossing.t / spacing).ceil().max(0.0) as usize;
        // Corner i is at (i + 1) spacing, as the corners themselves are computed.
        while at > 0 && crossing.t <= at as f64 * spacing {
            at -= 1;
        }
        while crossing.t > (at + 1) as f64 * spacing {
            at += 1;
        }
        let at = at.clamp(1, corners - 1) as u32;
        // In and out between two corners is no change.
        if list.last() == Some(&at) {
            list.pop();
        } else {
            list.push(at);
        }
    }
    list
}

/// Where two rows differ.
pub fn differences(first: &[u32], second: &[u32]) -> Vec<Difference> {
    let mut list = Vec::new();
    let (mut i, mut j, mut since) = (0, 0, 0);
    while i < first.len() || j < second.len() {
        let at = |row: &[u32], k: usize| row.get(k).copied().unwrap_or(u32::MAX);
        let next = at(first, i).min(at(second, j));
        if (i + j) % 2 == 1 && since < next {
            list.push(Difference { x: since..next, enters: j % 2 == 1 });
        }
        i += usize::from(at(first, i) == next);
        j += usize::from(at(second, j) == next);
        since = next;
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn changes_by_hand() {
        let at = |t: f64, enters| Crossing { t, normal: DVec3::X, enters };
        // Corners are at 0.5, 1.0, 1.5, 2.0, ...
        assert_eq!(changes(&[at(0.6, true), at(1.7, false)], 0.5, 8), [1, 3]);
        assert_eq!(changes(&[at(1.1, true), at(1.4, false)], 0.5, 8), [0u32; 0]);
        assert_eq!(changes(&[at(1.0, true), at(1.5, false)], 0.5, 8), [1, 2]);
        assert_eq!(changes(&[at(0.1, true), at(9.0, false)], 0.5, 8), [1, 7]);
        assert_eq!(changes(&[at(0.6, true), at(1.1, false), at(1.2, true), at(2.1, false)], 0.5, 8), [1, 4]);
    }

    #[test]
    fn differences_by_hand() {
        let difference = |x, enters| Difference { x, enters };
        assert_eq!(differences(&[], &[]), []);
        assert_eq!(differences(&[2, 5], &[2, 5]), []);
        assert_eq!(differences(&[], &[2, 5]), [difference(2..5, true)]);
        assert_eq!(differences(&[2, 5], &[3, 7]), [difference(2..3, false), difference(5..7, true)]);
        assert_eq!(differences(&[2, 9], &[4, 6]), [difference(2..4, false), difference(6..9, false)]);
    }

    /// Against flags, corner by corner.
    #[test]
    fn rows_are_flags() {
        let grid = Grid { origin: DVec3::ZERO, spacing: 1.0, cells: [9, 1, 1] };
        for (a, b) in (0..256u32).flat_map(|a| (0..256).map(move |b| (a, b))) {
            let flags = |bits: u32| (0..10).map(move |x| x > 0 && x < 9 && bits >> (x - 1) & 1 != 0);
            let row = |bits: u32| {
                let flags: Vec<bool> = flags(bits).collect();
                (1..10u32).filter(|&x| flags[x as usize] != flags[x as usize - 1]).collect::<Vec<_>>()
            };
            let (first, second) = (row(a), row(b));
            let rows = Rows::new(&grid, [&first[..], &second, &[], &[]].into_iter());
            assert!(flags(a).enumerate().all(|(x, flag)| rows.is_inside([x, 0, 0]) == flag));
            let mut want: Vec<_> = flags(a).zip(flags(b)).map(|(a, b)| (a != b, b)).collect();
            for difference in differences(&first, &second) {
                for x in difference.x {
                    assert_eq!(want[x as usize], (true, difference.enters));
                    want[x as usize].0 = false;
                }
            }
            assert!(want.iter().all(|w| !w.0));
        }
    }
}
