//! The tiles of a picture: their rays, made and shaded.

use std::ops::Range;

use super::options::RenderOptions;
use super::patch::{Layout, Patch};
use crate::camera::{
    Camera, Passes, PixelRect, SubPixel, Tiling, fill_passes, fill_pixels, morton_decode, range_of_tile,
};
use crate::lanes::Real;
use crate::ray::Rays;
use crate::shade::{Samples, Shader, Shades, Spots, Workspace};

/// What is seen, and how it is cut into tiles.
pub(super) struct Canvas<'a> {
    pub camera: &'a Camera,
    pub options: &'a RenderOptions,
    pub tiling: Tiling,
    /// Pixels that are wanted.
    pub rect: PixelRect,
}

/// One thread's arrays, reused from tile to tile.
pub(super) struct Memory<S> {
    pub work: Workspace<S>,
    /// Pixels of a batch, also those of dead rays.
    pub pixels: Vec<(u32, u32)>,
    /// What the rays of the batch saw.
    pub samples: Samples,
    pub patch: Patch,
    rays: Rays<S>,
}

impl<S: Real> Default for Memory<S> {
    fn default() -> Self {
        Self {
            work: Workspace::default(),
            pixels: Vec::new(),
            samples: Samples::default(),
            patch: Patch::default(),
            rays: Rays::new(0),
        }
    }
}

impl Canvas<'_> {
    /// Makes the pixels of `memory` those of a tile, in Morton order.
    pub fn list_pixels<S>(&self, tile: u32, memory: &mut Memory<S>) {
        let (x0, y0) = self.tiling.origin(tile);
        memory.pixels.clear();
        let places = (0..self.tiling.rays_per_tile()).map(morton_decode);
        memory.pixels.extend(places.map(|(dx, dy)| (x0 + dx, y0 + dy)));
    }

    /// The pixels that [`Self::list_pixels`] lists.
    pub fn layout(&self, tile: u32) -> Layout<'static> {
        Layout::Square(self.tiling.origin(tile), self.tiling.edge())
    }

    /// Traces the samples `numbers` of the pixels of a tile as one batch into `memory.samples`.
    pub fn shade<S: Shades>(
        &self,
        shader: &Shader<'_, S>,
        tile: u32,
        numbers: Range<u32>,
        memory: &mut Memory<S>,
    ) -> Passes {
        let sub_pixels: Vec<_> = numbers.clone().map(|sample| self.options.sub_pixel(sample)).collect();
        let passes = Passes::new(&self.tiling, sub_pixels.len() as u32);
        let Memory { rays, samples, work, .. } = memory;
        if self.is_whole(tile) && sub_pixels.iter().all(SubPixel::is_in_pixel) {
            let range = range_of_tile(self.camera, &self.tiling, tile);
            if shader.shade_void(&range, passes.rays() as u64, work, samples) {
                return passes;
            }
        }
        let live = fill_passes(self.camera, &self.tiling, tile, self.rect, &sub_pixels, rays);
        let spots = Spots::Tile { corner: self.tiling.origin(tile), passes, first: numbers.start };
        shader.shade(rays, live, spots, work, samples);
        passes
    }

    /// Whether all pixels of a tile are wanted.
    fn is_whole(&self, tile: u32) -> bool {
        let ((x, y), last) = (self.tiling.origin(tile), self.tiling.edge() - 1);
        let is_there = x + last < self.tiling.width() && y + last < self.tiling.height();
        is_there && self.rect.contains(x, y) && self.rect.contains(x + last, y + last)
    }

    /// Traces the first sample of each of the pixels of `memory`.
    pub fn shade_pixels<S: Shades>(&self, shader: &Shader<'_, S>, memory: &mut Memory<S>) {
        let Memory { rays, pixels, samples, work, .. } = memory;
        let size = (self.tiling.width(), self.tiling.height());
        fill_pixels(self.camera, size, pixels, self.options.sub_pixel(0), rays);
        let live = rays.live_count() as u64;
        shader.shade(rays, live, Spots::Listed(pixels), work, samples);
    }
}
