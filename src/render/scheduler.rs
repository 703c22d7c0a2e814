//! Tiles over the threads of the current rayon pool.

use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;

use super::canvas::{Canvas, Memory};
use super::enough::{Evidence, FIRST_ROUND, are_enough};
use super::kept::{Keeper, Kept, Names};
use super::mattes::{Coverage, Mattes};
use super::options::{Progress, RenderOptions, rect_of};
use super::patch::{Channels, empty_film};
use super::sums::{Finished, Sums};
use super::tally::Tally;
use crate::camera::Camera;
use crate::error::{Error, Result, locked};
use crate::film::Film;
use crate::film::Window;
use crate::ray::Counters;
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::shade::{Integrator, PathStats, RayCounts, Shader, Shades, headlight};
use crate::trace::{Engine, engine};

/// A picture and what it took.
#[derive(Clone, Debug)]
pub struct RenderOutput {
    /// Planes R, G, B (linear Rec.709, premultiplied), A (coverage: hits, and an environment or a background that is not black;
    /// not beside [`RenderOptions::levels`]), then the wanted AOVs. Tiles not finished are black with alpha 0.
    pub film: Film,
    /// Live rays traced, by kind.
    pub rays: RayCounts,
    /// Wall clock time.
    pub seconds: f64,
    /// What the engine counted; all zero unless counting or costs were asked for.
    pub counters: Counters,
    /// Where the time went, level by level, all threads together.
    pub paths: PathStats,
    /// Tiles finished; with a time limit or a noise level those that have samples.
    pub tiles_done: u64,
    /// Tiles of the window.
    pub tiles_total: u64,
    /// Whether it was stopped while tiles that have samples wanted more; only with a time limit or a noise level (else such tiles
    /// are not done). That the time limit is over is no stop.
    pub is_cut_short: bool,
}

impl RenderOutput {
    /// Whether all tiles are finished (not stopped before).
    pub fn is_complete(&self) -> bool {
        self.tiles_done == self.tiles_total && !self.is_cut_short
    }
}

/// Renders with the engine called [`RenderOptions::engine`].
///
/// The picture depends on the options and the scene only: not on threads, on the order of tiles or (with the
/// generic engines) on the tile size. With a time limit the number of samples depends on the machine.
///
/// # Errors
/// Options out of range; an unknown engine.
pub fn render<S: Shades>(
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
pub fn render_with<S: Shades>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    description: &Description,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
) -> Result<RenderOutput> {
    render_kept(engine, world, description, camera, options, progress, None)
}

/// As [`render_with`], but finished tiles are kept in a file from which the same picture goes on when it was stopped, with the same
/// bits; what its file holds counts as rendered, with the rays and the time that it took.
///
/// # Errors
/// Options out of range; tiles to be kept of a picture whose number of samples is found while it is rendered; a file that cannot be
/// used or holds tiles of another picture.
pub fn render_kept<S: Shades>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    description: &Description,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
    keeper: Option<&Keeper>,
) -> Result<RenderOutput> {
    let (tiling, window) = options.check()?;
    if keeper.is_some() && options.is_adaptive() {
        let what = "tiles are kept of pictures with a fixed number of samples only: neither noise nor a time limit";
        return Err(Error::Usage(what.into()));
    }
    let start = Instant::now();
    let shader =
        Shader::new(world, description, engine, headlight(camera), options.settings()).with_rt(description, camera);
    let channels = Channels::new(options);
    let mut film = empty_film((options.width, options.height), window, &channels);
    let mattes = Mattes::new(world, description, &options.aovs, &mut film);
    let canvas = Canvas { camera, options, tiling, rect: rect_of(window) };
    let mut tiles = tiling.tiles_in(canvas.rect);
    let total = tiles.len() as u64;
    let mut kept = keeper.map(|keeper| keeper.open(&mut film, &tiling, &tiles)).transpose()?;
    let (seconds, before, names) = kept.as_mut().map(Kept::before).unwrap_or_default();
    if let Some(kept) = &kept {
        tiles.retain(|number| !kept.done.contains(number));
        kept.done.iter().for_each(|_| progress.tile_done(total));
    }
    if let Some(mattes) = &mattes {
        mattes.note(&names);
    }
    let film = Mutex::new(film);
    let job = Job { shader, canvas, window, channels, mattes, progress, start };
    let paint = |tile: &Tile, memory: &mut Memory<S>| {
        job.fill(tile, memory);
        let mut film = locked(&film);
        memory.patch.paint(&mut film);
        let mut names = Names::default();
        if let Some(mattes) = &job.mattes {
            job.canvas.list_pixels(tile.number, memory);
            names = mattes.paint(&mut film, window, &memory.pixels, &tile.coverages, tile.count);
        }
        drop(film);
        progress.tile_done(total);
        names
    };
    let (tally, is_cut_short) = if options.is_adaptive() {
        job.rounds(&tiles, paint)
    } else {
        let one_tile = |(memory, tile): &mut (Memory<S>, Tile), &number: &u32| {
            tile.start(number);
            let finished = job.samples(tile, options.spp, memory);
            let tally = Tally::take(&mut memory.work, u64::from(finished));
            if finished {
                let names = paint(tile, memory);
                if let Some(kept) = &kept {
                    let so_far = seconds + start.elapsed().as_secs_f64();
                    kept.keep((number, &tiling), &film, (so_far, &tally, names));
                }
            }
            tally
        };
        let memory = || (Memory::default(), job.tile());
        (tiles.par_iter().map_init(memory, one_tile).reduce(Tally::default, Tally::plus), false)
    };
    let tally = tally.plus(before);
    let mut film = film.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(mattes) = job.mattes {
        mattes.finish(&mut film);
    }
    Ok(RenderOutput {
        film,
        rays: tally.rays,
        seconds: seconds + start.elapsed().as_secs_f64(),
        counters: tally.counters,
        paths: tally.paths,
        tiles_done: tally.done,
        tiles_total: total,
        is_cut_short,
    })
}

/// What all tiles of a render share.
struct Job<'a, S: Shades> {
    shader: Shader<'a, S>,
    canvas: Canvas<'a>,
    window: Window,
    channels: Channels,
    mattes: Option<Mattes<'a>>,
    progress: &'a dyn Progress,
    start: Instant,
}

/// A tile in the making.
struct Tile {
    number: u32,
    /// Samples of each pixel so far.
    count: u32,
    /// Their sums, in the order of the pixels.
    sums: Sums,
    /// What they met, if it is wanted.
    coverages: Vec<Coverage>,
}

/// A tile between rounds.
struct State {
    tile: Tile,
    /// What its samples tell; unknown unless a noise level is asked for.
    evidence: Evidence,
    is_done: bool,
}

impl Tile {
    /// Makes it tile number `number`, without samples.
    fn start(&mut self, number: u32) {
        (self.number, self.count) = (number, 0);
        self.sums.clear();
        self.coverages.iter_mut().for_each(Coverage::clear);
    }
}

impl<S: Shades> Job<'_, S> {
    /// Whether there is nothing to sum up: a tile is painted from its only samples.
    fn is_of_one_sample(&self) -> bool {
        self.canvas.options.spp == 1 && !self.canvas.options.is_adaptive()
    }

    /// Some tile.
    fn tile(&self) -> Tile {
        let sums = Sums::new(!self.canvas.options.aovs.is_empty());
        Tile { number: 0, count: 0, sums, coverages: Vec::new() }
    }

    /// Adds samples to `tile` until there are `spp` of each pixel; false if stopped before.
    fn samples(&self, tile: &mut Tile, spp: u32, memory: &mut Memory<S>) -> bool {
        let pixels = self.canvas.tiling.rays_per_tile() as usize;
        if !self.is_of_one_sample() {
            tile.sums.make_room(pixels);
        }
        while tile.count < spp {
            if self.progress.stopped() {
                return false;
            }
            let numbers = tile.count..spp.min(tile.count + self.shader.passes(tile.count));
            let passes = self.canvas.shade(&self.shader, tile.number, numbers, memory);
            if let Some(mattes) = &self.mattes {
                mattes.count(passes, pixels, &memory.samples.hits, &mut tile.coverages);
            }
            if !self.is_of_one_sample() {
                tile.sums.add_passes(passes, &memory.samples);
            }
            tile.count += passes.count();
        }
        true
    }

    /// Rounds over all tiles, each doubling the samples, until all have the wanted samples or little noise, or the
    /// time is over. Then calls `paint` for each tile that has samples. Also says whether it was stopped before.
    fn rounds(&self, tiles: &[u32], paint: impl Fn(&Tile, &mut Memory<S>) -> Names + Sync) -> (Tally, bool) {
        let options = self.canvas.options;
        let (spp, limit) = (options.spp, options.time_limit.unwrap_or(f64::INFINITY));
        let in_time = || self.start.elapsed().as_secs_f64() < limit;
        let state =
            |&number| State { tile: Tile { number, ..self.tile() }, evidence: Evidence::default(), is_done: false };
        let mut states: Vec<State> = tiles.iter().map(state).collect();
        let mut total = Tally::default();
        let mut target = FIRST_ROUND.min(spp);
        let is_cut_short = loop {
            let one_tile = |memory: &mut Memory<S>, state: &mut State| {
                if state.is_done {
                    return Tally::default();
                }
                let tile = &mut state.tile;
                // The first samples are made even when the time is over: every pixel has some.
                while tile.count < target && (tile.count == 0 || in_time()) {
                    let next = target.min(tile.count + self.shader.passes(tile.count));
                    if !self.samples(tile, next, memory) {
                        break;
                    }
                }
                let tally = Tally::take(&mut memory.work, 0);
                if options.noise.is_some() {
                    let RayCounts { shadow, scattered, .. } = tally.rays;
                    let scatters = options.integrator == Integrator::Path && shadow + scattered > 0;
                    state.evidence = Evidence {
                        count: tile.count,
                        error: tile.sums.error(tile.count),
                        scatters: state.evidence.scatters || scatters,
                    };
                }
                tally
            };
            let round = states.par_iter_mut().map_init(Memory::default, one_tile);
            total = total.plus(round.reduce(Tally::default, Tally::plus));
            if let Some(noise) = options.noise {
                self.judge(&mut states, noise);
            }
            // Where the time is over, no tile wants more; a stop in the last round leaves some that do.
            let wants_more = in_time() && states.iter().any(|state| !state.is_done && state.tile.count < spp);
            let is_stopped = self.progress.stopped();
            if target >= spp || !wants_more || is_stopped {
                break wants_more && is_stopped;
            }
            target = target.saturating_mul(2).min(spp);
        };
        let finished = |memory: &mut Memory<S>, State { tile, .. }: &mut State| {
            if tile.count == 0 {
                return Tally::default();
            }
            paint(tile, memory);
            Tally { done: 1, ..Tally::default() }
        };
        let painted = states.par_iter_mut().map_init(Memory::default, finished);
        (total.plus(painted.reduce(Tally::default, Tally::plus)), is_cut_short)
    }

    /// Says which tiles are done, for now: what a tile finds may open the tiles around it again.
    fn judge(&self, states: &mut [State], noise: f64) {
        let known: Vec<_> = states.iter().map(|state| (state.tile.number, state.evidence)).collect();
        let enough = are_enough(&known, &self.canvas.tiling, noise);
        states.iter_mut().zip(enough).for_each(|(state, enough)| state.is_done = enough);
    }

    /// Takes what the planes get from a finished tile.
    fn fill(&self, tile: &Tile, memory: &mut Memory<S>) {
        let finished = if self.is_of_one_sample() {
            Finished::Samples(&memory.samples)
        } else {
            Finished::Sums(&tile.sums, tile.count)
        };
        memory.patch.fill(&self.channels, self.window, self.canvas.layout(tile.number), finished);
    }
}
