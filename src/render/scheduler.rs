//! Tiles over the threads of the current rayon pool.

use std::mem::take;
use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;

use super::options::{Progress, RenderOptions, rect_of};
use super::pixels::{Painter, add, mean};
use crate::camera::{Camera, PixelRect, SubPixel, Tiling, fill_tile, morton_decode};
use crate::error::Result;
use crate::film::Film;
use crate::lanes::Real;
use crate::ray::{Counters, Rays};
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::shade::{RayCounts, Sample, Shader, Workspace, headlight};
use crate::trace::{Engine, Engines, engine};

/// A picture and what it took.
#[derive(Clone, Debug)]
pub struct RenderOutput {
    /// Planes R, G, B (linear Rec.709, premultiplied), A (coverage: hits, and a background that is not black), then
    /// the wanted AOVs. Tiles not finished are black with alpha 0.
    pub film: Film,
    /// Live rays traced, by kind.
    pub rays: RayCounts,
    /// Wall clock time.
    pub seconds: f64,
    /// What the engine counted; all zero unless counting or costs were asked for.
    pub counters: Counters,
    /// Tiles finished.
    pub tiles_done: u64,
    /// Tiles of the window.
    pub tiles_total: u64,
}

impl RenderOutput {
    /// Whether all tiles are finished (not stopped before).
    pub fn is_complete(&self) -> bool {
        self.tiles_done == self.tiles_total
    }
}

/// Renders with the engine called [`RenderOptions::engine`].
///
/// The picture depends on the options and the scene only: not on threads, on the order of tiles or (with the
/// generic engines) on the tile size.
///
/// # Errors
/// Options out of range; an unknown engine.
pub fn render<S: Engines>(
    world: &World<S>,
    description: &Description,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
) -> Result<RenderOutput> {
    render_with(engine::<S>(&options.engine)?, world, description, camera, options, progress)
}

/// As [`render`] with any engine; [`RenderOptions::engine`] is not looked at.
///
/// # Errors
/// Options out of range.
pub fn render_with<S: Real>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    description: &Description,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
) -> Result<RenderOutput> {
    let (tiling, window) = options.check()?;
    let start = Instant::now();
    let shader =
        Shader::new(world, description, engine, headlight(camera), options.settings()).with_rt(description, camera);
    let job = Job { shader, camera, tiling, rect: rect_of(window), options, progress };
    let tiles = tiling.tiles_in(job.rect);
    let painter = Mutex::new(Painter::new(options.width, options.height, window, &options.aovs));
    let one_tile = |memory: &mut TileMemory<S>, &tile: &u32| {
        let finished = job.tile(tile, memory);
        if finished {
            job.paint(memory, &mut painter.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
            progress.tile_done(tiles.len() as u64);
        }
        let work = &mut memory.work;
        Tally { done: u64::from(finished), rays: take(&mut work.rays), counters: take(&mut work.counters) }
    };
    let tally = tiles.par_iter().map_init(TileMemory::default, one_tile).reduce(Tally::default, Tally::plus);
    Ok(RenderOutput {
        film: painter.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()).film,
        rays: tally.rays,
        seconds: start.elapsed().as_secs_f64(),
        counters: tally.counters,
        tiles_done: tally.done,
        tiles_total: tiles.len() as u64,
    })
}

/// What tiles add up to.
#[derive(Default)]
struct Tally {
    done: u64,
    rays: RayCounts,
    counters: Counters,
}

impl Tally {
    fn plus(mut self, other: Self) -> Self {
        self.done += other.done;
        self.rays += other.rays;
        self.counters += other.counters;
        self
    }
}

/// What all tiles of a render share.
struct Job<'a, S: Real> {
    shader: Shader<'a, S>,
    camera: &'a Camera,
    tiling: Tiling,
    rect: PixelRect,
    options: &'a RenderOptions,
    progress: &'a dyn Progress,
}

/// One thread's arrays, reused from tile to tile.
struct TileMemory<S> {
    rays: Rays<S>,
    work: Workspace<S>,
    /// Pixel of each ray, also of dead ones.
    pixels: Vec<(u32, u32)>,
    samples: Vec<Sample>,
    sums: Vec<Sample>,
}

impl<S: Real> Default for TileMemory<S> {
    fn default() -> Self {
        Self {
            rays: Rays::new(0),
            work: Workspace::default(),
            pixels: Vec::new(),
            samples: Vec::new(),
            sums: Vec::new(),
        }
    }
}

impl<S: Real> Job<'_, S> {
    /// All samples of a tile into `memory.sums`; false if stopped before the last one.
    fn tile(&self, tile: u32, memory: &mut TileMemory<S>) -> bool {
        let (x0, y0) = self.tiling.origin(tile);
        let count = self.tiling.rays_per_tile();
        memory.pixels.clear();
        memory.pixels.extend((0..count).map(|i| {
            let (dx, dy) = morton_decode(i);
            (x0 + dx, y0 + dy)
        }));
        memory.sums.clear();
        memory.sums.resize(count as usize, Sample::MISS);
        for sample in 0..self.options.spp {
            if self.progress.stopped() {
                return false;
            }
            let sub_pixel = match self.options.spp {
                1 => SubPixel::Anchor,
                _ => SubPixel::Sample { sample, seed: self.options.seed },
            };
            fill_tile(self.camera, &self.tiling, tile, self.rect, sub_pixel, &mut memory.rays);
            self.shader.shade(&memory.rays, &memory.pixels, sample, &mut memory.work, &mut memory.samples);
            for (sum, sample) in memory.sums.iter_mut().zip(&memory.samples) {
                add(sum, sample);
            }
        }
        true
    }

    /// Puts the finished tile's pixels into the film.
    fn paint(&self, memory: &TileMemory<S>, painter: &mut Painter) {
        for (i, &(x, y)) in memory.pixels.iter().enumerate() {
            painter.put(x, y, &mean(&memory.sums[i], self.options.spp));
        }
    }
}
