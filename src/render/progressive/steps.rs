//! The order of pixels: blocks of 16, 8, 4, 2, 1 pixels, each a ray at its upper left pixel.

use crate::camera::morton_decode;
use crate::error::{Error, Result};
use crate::film::Window;

/// Largest block, pixels.
pub const LARGEST_BLOCK: u32 = 16;

/// Samples after a pass over the picture by those before it.
const GROWTH: u32 = 4;

/// What a progressive render does at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The first ray of each block of this many pixels on a side that has none yet.
    Blocks(u32),
    /// Rays through all pixels until each has this many samples.
    Samples(u32),
}

/// All steps: blocks from `start` down to 1 (none if `start` is 1: whole tiles then give the first sample), then four times
/// the samples each time (half the noise) until there are `spp`. Each pass over the picture meets cold caches, so there are
/// few.
pub(super) fn plan(start: u32, spp: u32) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut block = start;
    while start > 1 && block >= 1 {
        steps.push(Step::Blocks(block));
        block /= 2;
    }
    let mut samples = u32::from(start > 1);
    while samples < spp {
        samples = samples.saturating_mul(GROWTH).clamp(1, spp);
        steps.push(Step::Samples(samples));
    }
    steps
}

/// Checks the size of the first blocks.
///
/// # Errors
/// A usage error unless it is 1, 2, 4, 8 or 16.
pub(super) fn check_start(start: u32) -> Result<()> {
    if start.is_power_of_two() && start <= LARGEST_BLOCK {
        return Ok(());
    }
    Err(Error::Usage(format!("blocks of {start} pixels to start with: expected 1, 2, 4, 8 or {LARGEST_BLOCK}")))
}

/// The picture's window cut into batches of neighbouring blocks: `edge` x `edge` blocks of `block` x `block` pixels,
/// from the window's upper left corner on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub window: Window,
    pub block: u32,
    pub edge: u32,
    /// Whether these are the first blocks; later ones leave out the corners that larger blocks have set.
    pub first: bool,
}

impl Lattice {
    /// Pixels on a side of a batch.
    fn side(&self) -> u32 {
        self.block * self.edge
    }

    fn columns(&self) -> u32 {
        self.window.width().div_ceil(self.side())
    }

    /// Number of batches.
    pub fn batches(&self) -> u32 {
        self.columns() * self.window.height().div_ceil(self.side())
    }

    /// Number of batches that have pixels: at the picture's edge a single corner may be all there is, and set already.
    pub fn batches_with_pixels(&self) -> u32 {
        let has_pixels = |batch: &u32| {
            let part = self.part(*batch);
            self.first || part.width() > self.block || part.height() > self.block
        };
        (0..self.batches()).filter(has_pixels).count() as u32
    }

    /// The pixels that batch number `batch` covers.
    pub fn part(&self, batch: u32) -> Window {
        let x0 = self.window.x0 + batch % self.columns() * self.side();
        let y0 = self.window.y0 + batch / self.columns() * self.side();
        let (x1, y1) = ((x0 + self.side()).min(self.window.x1), (y0 + self.side()).min(self.window.y1));
        Window { x0, y0, x1, y1 }
    }

    /// The pixels that get a ray in batch number `batch`, in Morton order of the blocks.
    pub fn pixels(&self, batch: u32) -> impl Iterator<Item = (u32, u32)> {
        let (part, block, first) = (self.part(batch), self.block, self.first);
        (0..self.edge * self.edge).filter_map(move |i| {
            let (column, row) = morton_decode(i);
            let (x, y) = (part.x0 + column * block, part.y0 + row * block);
            let is_new = first || column % 2 == 1 || row % 2 == 1;
            (is_new && x < part.x1 && y < part.y1).then_some((x, y))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plan_halves_blocks_and_halves_noise() {
        use Step::{Blocks, Samples};
        assert_eq!(plan(16, 1), [Blocks(16), Blocks(8), Blocks(4), Blocks(2), Blocks(1)]);
        assert_eq!(plan(2, 5), [Blocks(2), Blocks(1), Samples(4), Samples(5)]);
        assert_eq!(plan(1, 1), [Samples(1)]);
        assert_eq!(plan(1, 3), [Samples(1), Samples(3)]);
        assert_eq!(plan(1, u32::MAX).len(), 17);
    }

    #[test]
    fn starts_are_checked() {
        assert!([1, 2, 4, 8, 16].into_iter().all(|start| check_start(start).is_ok()));
        assert!([0, 3, 32, u32::MAX].into_iter().all(|start| check_start(start).is_err()));
    }

    /// Every pixel of a window is in exactly one batch of exactly one step.
    #[test]
    fn steps_share_the_pixels_out() {
        for window in [
            Window::full(1, 1),
            Window::full(17, 31),
            Window { x0: 5, y0: 3, x1: 70, y1: 44 },
            Window::full(1920, 1080),
        ] {
            for start in [2, 4, 8, 16] {
                let mut times = vec![0u8; window.area() as usize];
                for step in plan(start, 1) {
                    let Step::Blocks(block) = step else { continue };
                    let lattice = Lattice { window, block, edge: 32, first: block == start };
                    let has_pixels = |&batch: &u32| lattice.pixels(batch).next().is_some();
                    let counted = (0..lattice.batches()).filter(has_pixels).count();
                    assert_eq!(lattice.batches_with_pixels() as usize, counted);
                    for batch in 0..lattice.batches() {
                        for (x, y) in lattice.pixels(batch) {
                            assert!(lattice.part(batch).index(x, y).is_some());
                            times[window.index(x, y).unwrap()] += 1;
                        }
                    }
                }
                assert!(times.iter().all(|&n| n == 1), "{window:?} from {start}");
            }
        }
    }
}
