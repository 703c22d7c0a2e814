//! The order of several samples of a tile's pixels in one batch.

use std::ops::Range;

use super::tiles::Tiling;

/// Rays of one pass that follow each other. With the rays of other passes through the same pixels beside them, a batch
/// holds more rays per place than one pass does; 256 in Morton order are a square that engines can take as a tile.
const RUN: u32 = 256;

/// Several passes over the pixels of a tile, each with one ray per pixel, in turns of 256 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passes {
    rays_per_tile: u32,
    count: u32,
}

/// Rays of one pass that follow each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Number of the pass.
    pub pass: u32,
    /// Numbers of the pixels in the tile, in Morton order.
    pub pixels: Range<usize>,
    /// Numbers of their rays in the batch.
    pub rays: Range<usize>,
}

impl Passes {
    /// `count` passes over tiles of `tiling`.
    pub fn new(tiling: &Tiling, count: u32) -> Self {
        Self { rays_per_tile: tiling.rays_per_tile(), count }
    }

    /// Number of passes.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Number of rays.
    pub fn rays(&self) -> usize {
        (self.rays_per_tile * self.count) as usize
    }

    /// Pass and pixel of ray `ray`, as [`Self::runs`] lists them.
    pub fn of_ray(self, ray: usize) -> (u32, usize) {
        let len = RUN.min(self.rays_per_tile) as usize;
        let (group, place) = (ray / (len * self.count as usize), ray % (len * self.count as usize));
        ((place / len) as u32, group * len + place % len)
    }

    /// The rays in their order; those of a pixel come in the order of the passes.
    pub fn runs(self) -> impl Iterator<Item = Run> {
        let len = RUN.min(self.rays_per_tile) as usize;
        let firsts = (0..self.rays_per_tile as usize).step_by(len);
        firsts.flat_map(move |first| {
            (0..self.count).map(move |pass| {
                let ray = first * self.count as usize + pass as usize * len;
                Run { pass, pixels: first..first + len, rays: ray..ray + len }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_one_ray_in_each_pass() {
        for (edge, count) in [(32, 1), (32, 8), (16, 3), (8, 5)] {
            let passes = Passes::new(&Tiling::new(100, 50, edge).unwrap(), count);
            let mut order: Vec<Vec<u32>> = vec![Vec::new(); (edge * edge) as usize];
            let mut next = 0;
            for run in passes.runs() {
                assert_eq!((run.rays.start, run.rays.len()), (next, run.pixels.len()));
                next = run.rays.end;
                run.rays.zip(run.pixels.clone()).for_each(|(ray, at)| assert_eq!(passes.of_ray(ray), (run.pass, at)));
                run.pixels.for_each(|pixel| order[pixel].push(run.pass));
            }
            assert_eq!(next, passes.rays());
            assert!(order.into_iter().all(|order| order.into_iter().eq(0..count)));
        }
    }
}
