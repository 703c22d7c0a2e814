//! What integrators share: the first hits of a batch, compact batches of further rays, counts.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use super::classic::Classic;
use super::integrator::Integrator;
use super::look::Looks;
use super::look_lanes::{LookNumbers, numbers_of_sides};
use super::meeting::{Meeting, met_lanes};
use super::path::{PathMemory, Paths};
use super::rt::Rt;
use super::sample::{FirstHit, RayCounts, Rgba, Samples};
use super::spot::{Draw, Spot, Spots};
use super::stats::{Clock, PathStats};
use super::through::{Again, Through};
use super::vertices::Vertices;
use super::whitted;
use crate::camera::Camera;
use crate::lanes::chosen::lanes_of;
use crate::lanes::{Lanes, Real};
use crate::ray::{Counters, Hits, Rays};
use crate::scene::description::{Description, Light};
use crate::scene::light::Environment;
use crate::scene::world::World;
use crate::trace::{Engine, Scratch};

/// Fewest rays of one cost measurement: in Morton order 16 consecutive rays are a block of 4 x 4 pixels.
const COST_BLOCK: usize = 16;

/// Samples of a tile whose paths are traced together, at most: the fastest of 1, 2, 4 and 8 (results/NOTES.md).
const PASSES: u32 = 8;

/// What an integrator may vary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What is shown.
    pub integrator: Integrator,
    /// Mirror reflections followed after the primary hit; scatterings of a path.
    pub depth: u32,
    /// Occlusion rays per primary hit.
    pub ao_samples: u32,
    /// Length of occlusion rays as a fraction of the diagonal of the scene's bounds; infinite is allowed.
    pub ao_radius: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Whether node visits of primary rays are counted (see [`FirstHit::nodes`]).
    pub cost: bool,
    /// Whether more is wanted of first hits than radiance and coverage (where it is not, the work is saved).
    pub first_hits: bool,
    /// Whether all engine calls count ([`Workspace::counters`]); counting kernels are slower.
    pub count: bool,
    /// Primary rays to be expected, which may be a guess: what is worth preparing.
    pub rays: u64,
}

/// Working memory of one thread, and what was counted in it.
#[derive(Debug)]
pub struct Workspace<S> {
    /// Live rays traced.
    pub rays: RayCounts,
    /// What the engine counted, if [`Settings::count`] or [`Settings::cost`] is set.
    pub counters: Counters,
    /// Where the time went.
    pub stats: PathStats,
    pub(super) clock: Clock,
    pub(super) scratch: Scratch,
    pub(super) hits: Hits<S>,
    pub(super) whitted: Option<Box<whitted::Memory<S>>>,
    pub(super) vertices: Option<Box<Vertices<S>>>,
    pub(super) batch: Rays<S>,
    pub(super) occluded: Vec<u8>,
    again: Again<S>,
    pub(super) paths: PathMemory<S>,
    pub(super) rt: Option<Box<super::rt::Memory<S>>>,
    block: Rays<S>,
    block_hits: Hits<S>,
}

impl<S: Real> Default for Workspace<S> {
    fn default() -> Self {
        Self {
            rays: RayCounts::default(),
            counters: Counters::default(),
            stats: PathStats::default(),
            clock: Clock::default(),
            scratch: Scratch::default(),
            hits: Hits::new(0),
            whitted: None,
            vertices: None,
            batch: Rays::new(0),
            occluded: Vec::new(),
            again: Again::default(),
            paths: PathMemory::default(),
            rt: None,
            block: Rays::new(0),
            block_hits: Hits::new(0),
        }
    }
}

impl<S: Real> Workspace<S> {
    /// Ends level `level` of recursive ray tracing.
    pub(super) fn lap(&mut self, level: u32) {
        let stats = self.clock.lap(&self.rays);
        self.stats.add(level, &stats);
    }
}

/// Everything a batch of rays needs to become colours.
pub struct Shader<'a, S: Real> {
    pub(super) world: &'a World<S>,
    pub(super) engine: &'a dyn Engine<S>,
    pub(super) lights: Vec<Light>,
    /// Whether lights cast shadows: those of a scene do, the default light does not.
    pub(super) shadows: bool,
    background: DVec3,
    environment: Option<&'a Environment>,
    pub(super) ambient: DVec3,
    pub(super) settings: Settings,
    /// Length of occlusion rays, scene units.
    pub(super) ao_length: f64,
    pub(super) looks: Arc<Looks<'a>>,
    pub(super) meeting: Meeting<S>,
    /// What the sides of materials scatter with, as [`Looks::sides`] lists them.
    pub(super) sides: Vec<LookNumbers<S>>,
    pub(super) rt: Option<Rt>,
    paths: Option<Paths<'a, S>>,
}

impl<'a, S: Real> Shader<'a, S> {
    /// A shader for `world`, compiled from `description`, with rays traced by `engine`. `default_light` lights
    /// scenes that have no light, without shadows (see [`super::headlight`]).
    pub fn new(
        world: &'a World<S>,
        description: &'a Description,
        engine: &'a dyn Engine<S>,
        default_light: Light,
        settings: Settings,
    ) -> Self {
        let diagonal = world.bounds().map_or(f64::INFINITY, |(lo, hi)| (hi - lo).length());
        let ao_length = settings.ao_radius * diagonal;
        let looks = Arc::new(Looks::new(description));
        let paths = (settings.integrator == Integrator::Path)
            .then(|| Paths::new(world, description, looks.clone(), engine, &settings));
        let meeting = if settings.integrator.works_on_vertices() {
            Meeting::new(world, &looks, settings.rays)
        } else {
            Meeting::none()
        };
        let sides = numbers_of_sides(&looks);
        let lights = if description.lights.is_empty() { vec![default_light] } else { description.lights.clone() };
        Self {
            world,
            engine,
            lights,
            shadows: !description.lights.is_empty(),
            background: description.background,
            environment: description.environment.as_ref(),
            looks,
            ambient: description.ambient,
            sides,
            settings,
            ao_length: if ao_length.is_nan() { f64::INFINITY } else { ao_length },
            meeting,
            rt: None,
            paths,
        }
    }

    /// The same with the lighting model of [`Integrator::Rt`], seen by `camera`: of use for BRL-CAD databases only.
    #[must_use]
    pub fn with_rt(mut self, description: &Description, camera: &Camera) -> Self {
        let object = self.world.first_placed().map(|(_, object)| object);
        self.rt = description.looks.as_ref().map(|looks| Rt::new(looks, object, camera));
        self
    }

    /// Samples of each pixel of a tile that are best shaded as one batch, after `done` of them: paths part, and the more of
    /// them there are, the more go the same way. No more than `done`, so that batches are the same where a picture is
    /// looked at whenever its samples have doubled: with some engines hits depend on the batch.
    pub fn passes(&self, done: u32) -> u32 {
        if self.paths.is_some() { done.clamp(1, PASSES) } else { 1 }
    }

    /// See [`Shader::shade`].
    pub(super) fn batch(
        &self,
        rays: &mut Rays<S>,
        live: u64,
        spots: Spots<'_>,
        work: &mut Workspace<S>,
        out: &mut Samples,
    ) {
        let shows_hits = self.shows_hits();
        work.clock.start(&work.rays);
        work.rays.primary += live;
        if let (Integrator::Rt, Some(rt)) = (self.settings.integrator, &self.rt) {
            out.prepare(rays.len(), shows_hits);
            self.rt(rt, rays, live, work, out);
            return work.lap(0);
        }
        out.open(rays.len(), shows_hits);
        if let Some(paths) = &self.paths {
            return paths.shade(rays, spots, work, out);
        }
        let number = |i: usize, layer: u32| self.draw(spots.at(i)).number(0, layer);
        if self.settings.cost {
            let clock = Instant::now();
            self.trace_blocks(rays, work, &mut out.hits);
            // Visits behind what rays pass are nobody's.
            let Workspace { hits, scratch, again, .. } = &mut *work;
            self.through().behind(rays, hits, scratch, again, None, number);
            work.clock.tracing += clock.elapsed();
        } else {
            self.intersect(rays, work, number);
        }
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let hit = met_lanes(&work.hits, first);
            out.colors.make_lanes_opaque::<S::Wide>(first, hit);
            if shows_hits {
                lanes_of(hit).for_each(|lane| self.show(rays, &work.hits, first + lane, &mut out.hits[first + lane]));
            }
        }
        match self.settings.integrator {
            // Without regions to look at, `rt`'s model has nothing to say.
            Integrator::Whitted | Integrator::Rt | Integrator::Path => self.whitted(rays, spots, work, &mut out.colors),
            view => {
                match view {
                    Integrator::Ao => self.ambient_occlusion(rays, spots, work, &mut out.colors),
                    Integrator::Normals => super::views::normals(out),
                    Integrator::Depth => super::views::depth(out),
                    _ => super::views::cost(out),
                }
                work.lap(0);
            }
        }
    }

    /// Whether samples list first hits.
    pub(super) fn shows_hits(&self) -> bool {
        self.settings.first_hits || self.settings.cost || self.settings.integrator.shows_hits()
    }

    /// Closest hits of `rays` into `work.hits`. Where surfaces let rays pass by chance, `number` decides for ray `i` at
    /// its layer `k`.
    pub(super) fn intersect(&self, rays: &Rays<S>, work: &mut Workspace<S>, number: impl Fn(usize, u32) -> f64) {
        let clock = Instant::now();
        let counters = self.settings.count.then_some(&mut work.counters);
        let (hits, scratch, again) = (&mut work.hits, &mut work.scratch, &mut work.again);
        self.through().closest(rays, hits, scratch, again, counters, number);
        work.clock.tracing += clock.elapsed();
    }

    /// The same where every surface counts.
    pub(super) fn intersect_all(&self, rays: &Rays<S>, work: &mut Workspace<S>) {
        let clock = Instant::now();
        let counters = self.settings.count.then_some(&mut work.counters);
        self.engine.intersect(self.world, rays, &mut work.hits, &mut work.scratch, counters);
        work.clock.tracing += clock.elapsed();
    }

    /// Calls `lit` with the number of each of `rays` that is not occluded, and the share of its light that arrives; `glass`
    /// lets light pass through it.
    pub(super) fn occlude(&self, rays: &Rays<S>, work: &mut Workspace<S>, glass: bool, lit: impl FnMut(usize, DVec3)) {
        let clock = Instant::now();
        let counters = self.settings.count.then_some(&mut work.counters);
        let (hits, occluded, scratch) = (&mut work.hits, &mut work.occluded, &mut work.scratch);
        self.through().shadows(rays, hits, occluded, scratch, &mut work.again, glass, counters, lit);
        work.clock.shadowing += clock.elapsed();
    }

    /// Whether each of `rays` is occluded, into `work.occluded`; false, and nothing done, where something may let a part of the light
    /// pass.
    pub(super) fn occlude_wholly(&self, rays: &Rays<S>, work: &mut Workspace<S>) -> bool {
        if !self.through().is_opaque(true) {
            return false;
        }
        let clock = Instant::now();
        let counters = self.settings.count.then_some(&mut work.counters);
        self.engine.occluded(self.world, rays, &mut work.occluded, &mut work.scratch, counters);
        work.clock.shadowing += clock.elapsed();
        true
    }

    fn through(&self) -> Through<'_, S> {
        Through { world: self.world, engine: self.engine, looks: &self.looks }
    }

    /// The random numbers of a sample.
    pub(super) fn draw(&self, spot: Spot) -> Draw {
        Draw::new(spot, self.settings.seed)
    }

    /// Radiance of a ray that leaves the scene along `dir`.
    pub(super) fn beyond(&self, dir: DVec3) -> DVec3 {
        self.environment.map_or(self.background, |environment| environment.radiance(dir))
    }

    /// The same if it is the same in all directions.
    pub(super) fn even_beyond(&self) -> Option<DVec3> {
        self.environment.is_none().then_some(self.background)
    }

    /// What a primary ray sees that leaves the scene where the radiance is `radiance`. A background that shines is part of the picture,
    /// a black one stays transparent; an environment is a picture itself, the black in it, too.
    pub(super) fn behind(&self, radiance: DVec3) -> Rgba {
        let is_shown = self.environment.is_some() || self.background != DVec3::ZERO;
        Rgba { radiance, alpha: f64::from(u8::from(is_shown)) }
    }

    /// As [`Self::intersect`], with counting kernels and as many rays at a time as the engine traces together, 16 at least: each such
    /// block of pixels gets its own number of node visits.
    fn trace_blocks(&self, rays: &Rays<S>, work: &mut Workspace<S>, out: &mut [FirstHit]) {
        work.hits.reset(rays.len());
        // Fewer than it traces together would cost it more than they do in any picture.
        let size = self.engine.lanes().max(COST_BLOCK);
        for first in (0..rays.len()).step_by(size) {
            let count = size.min(rays.len() - first);
            work.block.reset(count);
            for i in 0..count {
                let j = first + i;
                work.block.set(i, rays.org(j), rays.dir(j), rays.t_min[j], rays.t_max[j]);
            }
            let mut counters = Counters::default();
            let (hits, scratch) = (&mut work.block_hits, &mut work.scratch);
            self.engine.intersect(self.world, &work.block, hits, scratch, Some(&mut counters));
            let nodes = counters.nodes as f64 / work.block.live_count().max(1) as f64;
            for i in 0..count {
                let j = first + i;
                out[j].nodes = nodes;
                (work.hits.t[j], work.hits.u[j], work.hits.v[j]) = (hits.t[i], hits.u[i], hits.v[i]);
                (work.hits.prim[j], work.hits.inst[j]) = (hits.prim[i], hits.inst[i]);
            }
            work.counters += counters;
        }
    }

    /// What pictures show of the first hit of ray `i`, besides radiance.
    fn show(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize, seen: &mut FirstHit) {
        let [org, dir] = [rays.org(i), rays.dir(i)].map(|v| DVec3::from(v.map(S::to_f64)));
        let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
        let surface = self.world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
        seen.distance = t * dir.length();
        seen.position = surface.position;
        [seen.normal, seen.shading_normal] = self.turned(&surface, dir);
        seen.albedo = Classic::of(&self.looks, &surface, dir).base;
        (seen.inst, seen.prim, seen.material) = (hits.inst[i], hits.prim[i], surface.material);
    }
}
