//! Pictures that appear as blocks: one ray colours 16 x 16 pixels, then 8, 4, 2, 1, then each pixel gets further samples.
//!
//! Source: F. S. Hill, *Computer Graphics Using OpenGL*, ray tracing chapter (pixel blocks). His framebuffer is asked
//! whether a pixel is set; ours too. Rays of one step are traced as batches of neighbouring blocks in Morton order, so that
//! packets stay as coherent as the step allows.
//!
//! # Same bits
//! With an exact engine ([`Engine::is_exact`]) a pixel's value depends on camera, pixel, sample and seed alone: the
//! finished picture is that of [`super::render_with`] bit for bit. Where it depends on the neighbours in the batch too (an
//! engine that is not exact, or costs, which are counted per block of pixels) there are no coarse blocks: whole tiles come
//! first, the batches of the plain render, and the bits are the same again.

mod framebuffer;
mod steps;

use std::mem::take;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

use rayon::prelude::*;

pub use framebuffer::Framebuffer;
pub use steps::{LARGEST_BLOCK, Step};

use super::aov::Aov;
use super::canvas::{Canvas, Memory};
use super::options::{Progress, RenderOptions, rect_of};
use super::patch::{Channels, Layout, empty_film};
use super::scheduler::RenderOutput;
use super::sums::{Finished, Sums};
use super::tally::Tally;
use crate::camera::{Camera, Tiling};
use crate::error::{Error, Result, locked};
use crate::film::Window;
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::shade::{Samples, Shader, Shades, headlight};
use crate::trace::Engine;
use steps::{Lattice, check_start, plan};

/// Who looks at a picture in the making; called from all threads.
pub trait Viewer: Sync {
    /// Pixels of `part` have changed. The framebuffer is locked meanwhile: be quick.
    fn painted(&self, frame: &Framebuffer, part: Window);
    /// All of `step` is done.
    fn step_done(&self, _frame: &Framebuffer, _step: Step) {}
}

/// Nobody looks.
impl Viewer for () {
    fn painted(&self, _: &Framebuffer, _: Window) {}
}

/// A picture in the making. It can be stopped between batches at any time, looked at, and continued.
pub struct Progressive<'a, S: Shades> {
    shader: Shader<'a, S>,
    canvas: Canvas<'a>,
    window: Window,
    start: u32,
    /// Tiles of the window, and what is known of each.
    tiles: Vec<(u32, Mutex<Tile>)>,
    channels: Channels,
    frame: Mutex<Framebuffer>,
    /// Batches of all steps.
    total: u64,
    tally: Tally,
    seconds: f64,
    /// Whether there was a run before: pixels of any step may be set.
    has_run: bool,
    memories: Mutex<Vec<Memory<S>>>,
}

/// Samples of one tile.
struct Tile {
    /// Samples of each pixel.
    samples: u32,
    /// Their sums, in Morton order.
    sums: Sums,
}

/// Arrays lent to a thread for a step. Threads come and go with each piece of work that is split off; memory that was never
/// touched before is dear.
struct Lent<'p, S: Shades> {
    all: &'p Mutex<Vec<Memory<S>>>,
    memory: Memory<S>,
}

impl<'p, S: Shades> Lent<'p, S> {
    fn from(all: &'p Mutex<Vec<Memory<S>>>) -> Self {
        let memory = locked(all).pop().unwrap_or_default();
        Self { all, memory }
    }
}

impl<S: Shades> Drop for Lent<'_, S> {
    fn drop(&mut self) {
        locked(self.all).push(take(&mut self.memory));
    }
}

/// Who is told, and asked whether to stop.
#[derive(Clone, Copy)]
struct Watch<'w> {
    progress: &'w dyn Progress,
    viewer: &'w dyn Viewer,
    total: u64,
}

impl<'a, S: Shades> Progressive<'a, S> {
    /// A picture of which nothing is traced yet, with first blocks of `start` pixels on a side (see the module for when
    /// there are none). [`RenderOptions::engine`] is not looked at.
    ///
    /// # Errors
    /// Options out of range, or a number of samples that is found while rendering; a start that is not 1, 2, 4, 8 or 16.
    pub fn new(
        engine: &'a dyn Engine<S>,
        world: &'a World<S>,
        description: &'a Description,
        camera: &'a Camera,
        options: &'a RenderOptions,
        start: u32,
    ) -> Result<Self> {
        check_start(start)?;
        let (tiling, window) = options.check()?;
        if options.is_adaptive() {
            let what = "pictures by blocks have a fixed number of samples: no time limit and no noise level";
            return Err(Error::Usage(what.into()));
        }
        if options.aovs.contains(&Aov::Cryptomatte) {
            return Err(Error::Usage("cryptomattes are not made by blocks: leave --preview and --blocks out".into()));
        }
        if options.levels.is_some() {
            return Err(Error::Usage("pictures by blocks are made of floats, not of levels".into()));
        }
        let settings = options.settings();
        let start = if settings.cost || !engine.is_exact() { 1 } else { start };
        let channels = Channels::new(options);
        let film = empty_film((options.width, options.height), window, &channels);
        let shader = Shader::new(world, description, engine, headlight(camera), settings).with_rt(description, camera);
        let rect = rect_of(window);
        let first = u32::from(start > 1);
        let with_hits = !options.aovs.is_empty();
        let tile = |number| (number, Mutex::new(Tile { samples: first, sums: Sums::new(with_hits) }));
        let tiles: Vec<_> = tiling.tiles_in(rect).into_iter().map(tile).collect();
        let batches = |step: &Step| match *step {
            Step::Blocks(block) => u64::from(lattice(window, &tiling, block, start).batches_with_pixels()),
            Step::Samples(_) => tiles.len() as u64,
        };
        let total = plan(start, options.spp).iter().map(batches).sum();
        let frame = Mutex::new(Framebuffer::new(film, start));
        Ok(Self {
            shader,
            canvas: Canvas { camera, options, tiling, rect },
            window,
            start,
            tiles,
            channels,
            frame,
            total,
            tally: Tally::default(),
            seconds: 0.0,
            has_run: false,
            memories: Mutex::default(),
        })
    }

    /// Traces on the current rayon pool until the picture is finished or `progress` says stop; returns whether it is
    /// finished. What an earlier call has traced is not traced again.
    pub fn run(&mut self, progress: &dyn Progress, viewer: &dyn Viewer) -> bool {
        let clock = Instant::now();
        let watch = Watch { progress, viewer, total: self.total };
        let mut finished = true;
        for step in plan(self.start, self.canvas.options.spp) {
            let stopped = AtomicBool::new(false);
            let tally = match step {
                Step::Blocks(block) => self.blocks(block, watch, &stopped),
                Step::Samples(samples) => self.samples(samples, watch, &stopped),
            };
            self.tally = take(&mut self.tally).plus(tally);
            if stopped.into_inner() {
                finished = false;
                break;
            }
            viewer.step_done(&locked(&self.frame), step);
        }
        self.has_run = true;
        self.seconds += clock.elapsed().as_secs_f64();
        finished
    }

    /// Looks at the picture between runs.
    pub fn look<R>(&self, eye: impl FnOnce(&Framebuffer) -> R) -> R {
        eye(&locked(&self.frame))
    }

    /// The picture as it is.
    pub fn finish(self) -> RenderOutput {
        RenderOutput {
            film: self.frame.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()).into_film(),
            rays: self.tally.rays,
            seconds: self.seconds,
            counters: self.tally.counters,
            paths: self.tally.paths,
            tiles_done: self.tally.done,
            tiles_total: self.total,
            is_cut_short: false,
        }
    }

    /// One ray for each block that has none.
    fn blocks(&self, block: u32, watch: Watch<'_>, stopped: &AtomicBool) -> Tally {
        let lattice = lattice(self.window, &self.canvas.tiling, block, self.start);
        let one = |lent: &mut Lent<'_, S>, batch: u32| {
            let memory = &mut lent.memory;
            memory.pixels.clear();
            memory.pixels.extend(lattice.pixels(batch));
            if self.has_run {
                let frame = locked(&self.frame);
                memory.pixels.retain(|&(x, y)| !frame.is_set(x, y));
            }
            if memory.pixels.is_empty() || stop(watch, stopped) {
                return Tally::default();
            }
            self.canvas.shade_pixels(&self.shader, memory);
            if self.canvas.options.spp > 1 {
                self.keep_first(&memory.pixels, &memory.samples);
            }
            let (pixels, seen) = (Layout::Listed(&memory.pixels), Finished::Samples(&memory.samples));
            memory.patch.fill(&self.channels, self.window, pixels, seen);
            let frame = &mut *locked(&self.frame);
            frame.paint(&memory.patch);
            self.told(watch, frame, lattice.part(batch), memory)
        };
        let batches = (0..lattice.batches()).into_par_iter();
        batches.map_init(|| Lent::from(&self.memories), one).reduce(Tally::default, Tally::plus)
    }

    /// Keeps the first samples of pixels for those to come.
    fn keep_first(&self, pixels: &[(u32, u32)], samples: &Samples) {
        let per_tile = self.canvas.tiling.rays_per_tile();
        // The lock of a tile is kept while its pixels come: with small blocks they come together.
        let mut held: Option<(u32, MutexGuard<'_, Tile>)> = None;
        for (ray, &(x, y)) in pixels.iter().enumerate() {
            let index = self.canvas.tiling.index(x, y);
            let number = (index / u64::from(per_tile)) as u32;
            if held.as_ref().is_none_or(|(held, _)| *held != number) {
                drop(held.take());
                let Ok(place) = self.tiles.binary_search_by_key(&number, |(number, _)| *number) else { continue };
                held = Some((number, locked(&self.tiles[place].1)));
            }
            if let Some((_, tile)) = &mut held {
                tile.sums.make_room(per_tile as usize);
                tile.sums.add((index % u64::from(per_tile)) as usize, samples, ray);
            }
        }
    }

    /// Whole tiles until each pixel has `samples` samples.
    fn samples(&self, samples: u32, watch: Watch<'_>, stopped: &AtomicBool) -> Tally {
        let one = |lent: &mut Lent<'_, S>, (number, tile): &(u32, Mutex<Tile>)| {
            let memory = &mut lent.memory;
            let tile = &mut *locked(tile);
            if tile.samples >= samples {
                return Tally::default();
            }
            tile.sums.make_room(self.canvas.tiling.rays_per_tile() as usize);
            while tile.samples < samples {
                if stop(watch, stopped) {
                    return Tally::take(&mut memory.work, 0);
                }
                let numbers = tile.samples..samples.min(tile.samples + self.shader.passes(tile.samples));
                let passes = self.canvas.shade(&self.shader, *number, numbers, memory);
                tile.sums.add_passes(passes, &memory.samples);
                tile.samples += passes.count();
            }
            let (pixels, sums) = (self.canvas.layout(*number), Finished::Sums(&tile.sums, samples));
            memory.patch.fill(&self.channels, self.window, pixels, sums);
            let frame = &mut *locked(&self.frame);
            frame.paint(&memory.patch);
            if samples == self.canvas.options.spp {
                tile.sums.free();
            }
            let (edge, (x0, y0)) = (self.canvas.tiling.edge(), self.canvas.tiling.origin(*number));
            let (x1, y1) = ((x0 + edge).min(self.window.x1), (y0 + edge).min(self.window.y1));
            let part = Window { x0: x0.max(self.window.x0), y0: y0.max(self.window.y0), x1, y1 };
            self.told(watch, frame, part, memory)
        };
        self.tiles.par_iter().map_init(|| Lent::from(&self.memories), one).reduce(Tally::default, Tally::plus)
    }

    /// Tells who watches of a batch that is painted, and sums it up.
    fn told(&self, watch: Watch<'_>, frame: &Framebuffer, part: Window, memory: &mut Memory<S>) -> Tally {
        watch.viewer.painted(frame, part);
        watch.progress.tile_done(watch.total);
        Tally::take(&mut memory.work, 1)
    }
}

fn lattice(window: Window, tiling: &Tiling, block: u32, start: u32) -> Lattice {
    Lattice { window, block, edge: tiling.edge(), first: block == start }
}

/// Whether to stop; remembered in `stopped`.
fn stop(watch: Watch<'_>, stopped: &AtomicBool) -> bool {
    let stop = watch.progress.stopped();
    stopped.fetch_or(stop, Ordering::Relaxed);
    stop
}
