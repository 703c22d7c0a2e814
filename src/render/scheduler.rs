//! Tiles over the threads of the current rayon pool.

use std::mem::take;
use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;

use super::aov::Channel;
use super::mattes::{Coverage, Mattes};
use super::options::{Progress, RenderOptions, rect_of};
use super::patch::{Patch, channels, empty_film};
use super::pixels::{add, add_light, alone, begin, mean, variance};
use super::tally::Tally;
use crate::camera::{Camera, PixelRect, Tiling, fill_tile, morton_decode};
use crate::error::{Result, locked};
use crate::film::Film;
use crate::film::Window;
use crate::lanes::Real;
use crate::ray::{Counters, Rays};
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::shade::{PathStats, RayCounts, Sample, Shader, Workspace, headlight};
use crate::trace::{Engine, Engines, engine};

/// Samples per pixel of the first round when the number is found while rendering; then it doubles.
const FIRST_ROUND: u32 = 4;

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
    /// Where the time went, level by level, all threads together.
    pub paths: PathStats,
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
/// generic engines) on the tile size. With a time limit the number of samples depends on the machine.
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
    let channels = channels(&options.aovs);
    let mut film = empty_film((options.width, options.height), window, &channels);
    let mattes = Mattes::new(world, description, &options.aovs, &mut film);
    let film = Mutex::new(film);
    let rect = rect_of(window);
    let job = Job { shader, camera, tiling, rect, window, channels, mattes, options, progress, start };
    let tiles = tiling.tiles_in(job.rect);
    let paint = |sums: &mut Sums, pixels: &[(u32, u32)], patch: &mut Patch| {
        job.fill(patch, sums, pixels);
        let mut film = locked(&film);
        patch.paint(&mut film);
        if let Some(mattes) = &job.mattes {
            mattes.paint(&mut film, window, pixels, &sums.coverages, sums.count);
        }
        drop(film);
        progress.tile_done(tiles.len() as u64);
    };
    let tally = if options.is_adaptive() {
        job.rounds(&tiles, paint)
    } else {
        let one_tile = |memory: &mut TileMemory<S>, &tile: &u32| {
            let mut sums = take(&mut memory.sums);
            sums.start();
            let finished = job.samples(tile, options.spp, &mut sums, memory);
            if finished {
                paint(&mut sums, &memory.pixels, &mut memory.patch);
            }
            memory.sums = sums;
            Tally::take(&mut memory.work, u64::from(finished))
        };
        tiles.par_iter().map_init(TileMemory::default, one_tile).reduce(Tally::default, Tally::plus)
    };
    let mut film = film.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(mattes) = job.mattes {
        mattes.finish(&mut film);
    }
    Ok(RenderOutput {
        film,
        rays: tally.rays,
        seconds: start.elapsed().as_secs_f64(),
        counters: tally.counters,
        paths: tally.paths,
        tiles_done: tally.done,
        tiles_total: tiles.len() as u64,
    })
}

/// What all tiles of a render share.
struct Job<'a, S: Real> {
    shader: Shader<'a, S>,
    camera: &'a Camera,
    tiling: Tiling,
    rect: PixelRect,
    window: Window,
    channels: Vec<Channel>,
    mattes: Option<Mattes<'a>>,
    options: &'a RenderOptions,
    progress: &'a dyn Progress,
    start: Instant,
}

/// The sums of a tile's samples, in the order of its rays.
#[derive(Default)]
struct Sums {
    pixels: Vec<Sample>,
    /// What they met, if it is wanted.
    coverages: Vec<Coverage>,
    /// Samples of each pixel so far.
    count: u32,
}

impl Sums {
    fn start(&mut self) {
        self.pixels.clear();
        self.coverages.iter_mut().for_each(Coverage::clear);
        self.count = 0;
    }

    /// Estimate of the relative error of the pixels' mean brightness: root of the mean variance over the mean.
    fn error(&self) -> f64 {
        let n = f64::from(self.count);
        let mean: f64 = self.pixels.iter().map(|p| p.radiance.element_sum() / (3.0 * n)).sum();
        let square: f64 = self.pixels.iter().map(|p| variance(p, self.count)).sum();
        let pixels = self.pixels.len() as f64;
        if square > 0.0 { (square / pixels).sqrt() / (mean / pixels).max(f64::MIN_POSITIVE) } else { 0.0 }
    }
}

/// One thread's arrays, reused from tile to tile.
struct TileMemory<S> {
    rays: Rays<S>,
    work: Workspace<S>,
    /// Pixel of each ray, also of dead ones.
    pixels: Vec<(u32, u32)>,
    samples: Vec<Sample>,
    sums: Sums,
    patch: Patch,
}

impl<S: Real> Default for TileMemory<S> {
    fn default() -> Self {
        Self {
            rays: Rays::new(0),
            work: Workspace::default(),
            pixels: Vec::new(),
            samples: Vec::new(),
            sums: Sums::default(),
            patch: Patch::default(),
        }
    }
}

impl<S: Real> Job<'_, S> {
    /// Pixel of each ray of a tile.
    fn list_pixels(&self, tile: u32, pixels: &mut Vec<(u32, u32)>) {
        let (x0, y0) = self.tiling.origin(tile);
        pixels.clear();
        pixels.extend((0..self.tiling.rays_per_tile()).map(|i| {
            let (dx, dy) = morton_decode(i);
            (x0 + dx, y0 + dy)
        }));
    }

    /// Adds samples to `sums` until there are `spp` of each pixel; false if stopped before.
    fn samples(&self, tile: u32, spp: u32, sums: &mut Sums, memory: &mut TileMemory<S>) -> bool {
        self.list_pixels(tile, &mut memory.pixels);
        while sums.count < spp {
            if self.progress.stopped() {
                return false;
            }
            let sample = sums.count;
            let sub_pixel = self.options.sub_pixel(sample);
            fill_tile(self.camera, &self.tiling, tile, self.rect, sub_pixel, &mut memory.rays);
            self.shader.shade(&memory.rays, &memory.pixels, sample, &mut memory.work, &mut memory.samples);
            if let Some(mattes) = &self.mattes {
                mattes.count(&memory.samples, &mut sums.coverages);
            }
            if sums.count == 0 {
                std::mem::swap(&mut sums.pixels, &mut memory.samples);
                sums.pixels.iter_mut().for_each(begin);
            } else if self.options.aovs.is_empty() {
                sums.pixels.iter_mut().zip(&memory.samples).for_each(|(sum, sample)| add_light(sum, sample));
            } else {
                sums.pixels.iter_mut().zip(&memory.samples).for_each(|(sum, sample)| add(sum, sample));
            }
            sums.count += 1;
        }
        true
    }

    /// Rounds over all tiles, each doubling the samples, until all have the wanted samples or little noise, or the
    /// time is over. Then calls `paint` for each tile that has samples.
    fn rounds(&self, tiles: &[u32], paint: impl Fn(&mut Sums, &[(u32, u32)], &mut Patch) + Sync) -> Tally {
        let (spp, limit) = (self.options.spp, self.options.time_limit.unwrap_or(f64::INFINITY));
        let in_time = || self.start.elapsed().as_secs_f64() < limit;
        let mut states: Vec<(u32, Sums, bool)> = tiles.iter().map(|&tile| (tile, Sums::default(), false)).collect();
        let mut total = Tally::default();
        let mut target = FIRST_ROUND.min(spp);
        loop {
            let one_tile = |memory: &mut TileMemory<S>, (tile, sums, is_done): &mut (u32, Sums, bool)| {
                if *is_done {
                    return Tally::default();
                }
                // The first samples are made even when the time is over: every pixel has some.
                while sums.count < target && (sums.count == 0 || in_time()) {
                    let next = sums.count + 1;
                    if !self.samples(*tile, next, sums, memory) {
                        break;
                    }
                }
                *is_done = self.options.noise.is_some_and(|noise| sums.count >= FIRST_ROUND && sums.error() <= noise);
                Tally::take(&mut memory.work, 0)
            };
            let round = states.par_iter_mut().map_init(TileMemory::default, one_tile);
            total = total.plus(round.reduce(Tally::default, Tally::plus));
            if target >= spp || !in_time() || self.progress.stopped() || states.iter().all(|state| state.2) {
                break;
            }
            target = target.saturating_mul(2).min(spp);
        }
        let finished = |memory: &mut TileMemory<S>, (tile, sums, _): &mut (u32, Sums, bool)| {
            if sums.count == 0 {
                return Tally::default();
            }
            self.list_pixels(*tile, &mut memory.pixels);
            paint(sums, &memory.pixels, &mut memory.patch);
            Tally { done: 1, ..Tally::default() }
        };
        let painted = states.par_iter_mut().map_init(TileMemory::default, finished);
        total.plus(painted.reduce(Tally::default, Tally::plus))
    }

    /// Takes what the planes get from a finished tile, whose sums become means.
    fn fill(&self, patch: &mut Patch, sums: &mut Sums, pixels: &[(u32, u32)]) {
        if sums.count == 1 {
            sums.pixels.iter_mut().for_each(alone);
        } else {
            sums.pixels.iter_mut().for_each(|sum| *sum = mean(sum, sums.count));
        }
        patch.fill(&self.channels, self.window, pixels, &sums.pixels);
    }
}
