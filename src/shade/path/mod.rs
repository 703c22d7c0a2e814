//! Path tracing in waves: the rays of one bounce of many paths are traced as one batch, sorted by model of
//! scattering, and shaded in packets.
//!
//! A path meets emitting surfaces in two ways, by the direction it chose and by aiming at a light, weighted by the
//! power heuristic; it ends by chance when little of its light would arrive.
//!
//! Sources: J. Kajiya, *The Rendering Equation*, 1986; E. Veach, *Robust Monte Carlo Methods for Light Transport
//! Simulation*, 1997; S. Laine, T. Karras, T. Aila, *Megakernels Considered Harmful: Wavefront Path Tracing on GPUs*,
//! 2013.
//!
//! All numbers of a path are functions of its pixel, sample and bounce, and lanes never look at each other, so a
//! picture does not depend on what else is in a wave, except for the rounding of hits by engines that trace a batch with
//! an arithmetic of its own.

mod alias;
mod arrival;
mod bsdf;
mod emitter;
mod form;
mod lights;
mod points;
mod scatter;
mod sky;
mod surfaces;
mod target;
pub(super) mod wave;

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

pub(super) use self::bsdf::facets::Rough;
pub(super) use self::bsdf::fresnel;
pub use self::surfaces::unaimed;

use self::arrival::{Arrival, Seen};
use self::bsdf::facets::FacetsList;
use self::bsdf::{
    Matte, MetalRough, RoughCoat, RoughConductor, RoughDielectric, SmoothCoat, SmoothConductor, SmoothDielectric, Thin,
};
use self::lights::Lights;
use self::points::{Places, Points};
use self::scatter::{Arrivals, Chances};
use self::wave::{Shadows, Wave};
use super::look::{Looks, Model};
use super::look_lanes::{LookNumbers, look_numbers, numbers_of_sides};
use super::meeting::{Meeting, Met, met_lanes};
use super::offset::position_error;
use super::sample::Samples;
use super::shader::{Settings, Workspace};
use super::spot::{Draw, Spots};
use super::stats::BounceStats;
use super::through::{Again, MIXTURE, Through};
use crate::lanes::chosen::{Chosen, at, lanes_of, spill};
use crate::lanes::{Column, Lanes, MAX_LANES, Real, each};
use crate::ray::{Hits, Rays};
use crate::scene::description::{Description, Material};
use crate::scene::material::Scattering;
use crate::scene::world::World;
use crate::trace::Engine;

/// Shadow rays to a place end this many roundings before it.
const SHADOW_ROUNDINGS: f64 = 256.0;

/// What all paths of a picture share.
pub(super) struct Paths<'a, S: Real> {
    world: &'a World<S>,
    engine: &'a dyn Engine<S>,
    looks: Arc<Looks<'a>>,
    lights: Lights<'a, S>,
    facets: FacetsList,
    /// Scatterings of a path at most.
    depth: u32,
    seed: u64,
    shadow_end: S,
    meeting: Meeting<S>,
    /// What the sides of materials scatter with, as [`Looks::sides`] lists them.
    sides: Vec<LookNumbers<S>>,
}

/// One thread's arrays, reused from wave to wave.
#[derive(Debug)]
pub(super) struct PathMemory<S> {
    points: [Points; Model::COUNT],
    places: Places<S>,
    /// What points of textured materials scatter with, numbered after the sides.
    looks: Vec<LookNumbers<S>>,
    draws: Vec<Draw>,
    now: Wave<S>,
    next: Wave<S>,
    shadows: Shadows<S>,
    again: Again<S>,
}

impl<S: Real> Default for PathMemory<S> {
    fn default() -> Self {
        Self {
            points: std::array::from_fn(|_| Points::default()),
            places: Places::default(),
            looks: Vec::new(),
            draws: Vec::new(),
            now: Wave::default(),
            next: Wave::default(),
            shadows: Shadows::default(),
            again: Again::default(),
        }
    }
}

impl<'a, S: Real> Paths<'a, S> {
    /// Paths of at most `settings.depth` scatterings through `world`, compiled from `description`; a scene in which
    /// nothing shines has a white sky.
    pub fn new(
        world: &'a World<S>,
        description: &'a Description,
        looks: Arc<Looks<'a>>,
        engine: &'a dyn Engine<S>,
        settings: &Settings,
    ) -> Self {
        let lights = Lights::new(world, description, &looks);
        let is_of_all_widths = |m: &Material| matches!(m.scattering, Scattering::MetallicRoughness { .. });
        let facets = FacetsList::new(&looks.rough, description.materials.iter().any(is_of_all_widths));
        let shadow_end = S::from_f64(1.0 - SHADOW_ROUNDINGS * S::EPSILON.to_f64());
        let Settings { depth, seed, .. } = *settings;
        let meeting = Meeting::new(world, &looks, settings.rays);
        let sides = numbers_of_sides(&looks);
        Self { world, engine, looks, lights, facets, depth, seed, shadow_end, meeting, sides }
    }

    /// The radiance along each ray of the primary batch `rays` into `out`, which holds misses; see
    /// [`super::Shader::shade`].
    pub fn shade(&self, rays: &Rays<S>, spots: Spots<'_>, work: &mut Workspace<S>, out: &mut Samples) {
        let mut memory = std::mem::take(&mut work.paths);
        memory.draws.clear();
        memory.draws.extend((0..rays.len()).map(|i| Draw::new(spots.at(i), self.seed)));
        memory.start(rays);
        for bounce in 0..=self.depth {
            if memory.now.path.is_empty() {
                break;
            }
            self.bounce(bounce, &mut memory, work, out);
            std::mem::swap(&mut memory.now, &mut memory.next);
        }
        work.paths = memory;
    }

    /// Traces the wave `memory.now`, and scatters what it hits into `memory.next`.
    fn bounce(&self, bounce: u32, memory: &mut PathMemory<S>, work: &mut Workspace<S>, out: &mut Samples) {
        let live = memory.now.path.len() as u64;
        let clock = Instant::now();
        let through = Through { world: self.world, engine: self.engine, looks: &self.looks };
        let (draws, paths) = (&memory.draws, &memory.now.path);
        through.closest(&memory.now.rays, &mut work.hits, &mut work.scratch, &mut memory.again, None, |i, layer| {
            draws[paths[i] as usize].number(bounce, layer)
        });
        let traced = clock.elapsed();
        self.arrive_all(bounce, memory, &work.hits, out);
        let mut stats = BounceStats { rays: live, tracing: traced, ..BounceStats::default() };
        let count: usize = memory.points.iter().map(Points::len).sum();
        stats.points = count as u64;
        memory.next.open(count);
        memory.shadows.open(count);
        if bounce < self.depth {
            stats.lanes = self.scatter_all(bounce, memory);
        }
        memory.next.close();
        memory.shadows.close();
        stats.shading = clock.elapsed() - traced;
        let clock = Instant::now();
        stats.shadows = memory.shadows.path.len() as u64;
        work.rays.shadow += stats.shadows;
        // The primary rays are counted already.
        work.rays.scattered += if bounce == 0 { 0 } else { live };
        let shadows = &memory.shadows;
        let (hits, occluded, scratch) = (&mut work.hits, &mut work.occluded, &mut work.scratch);
        through.shadows(&shadows.rays, hits, occluded, scratch, &mut memory.again, false, None, |i, left| {
            let light = DVec3::from(each(|axis| shadows.light[axis][i].to_f64())) * left;
            out.add(shadows.path[i] as usize, bounce == 0, light);
        });
        stats.shadowing = clock.elapsed();
        work.stats.add(bounce, &stats);
    }

    /// Every model's points in packets; lanes in all packets.
    fn scatter_all(&self, bounce: u32, memory: &mut PathMemory<S>) -> u64 {
        let chances = Chances { draws: &memory.draws, bounce };
        let (next, shadows) = (&mut memory.next, &mut memory.shadows);
        let looks = [&self.sides[..], &memory.looks];
        let arrivals = Arrivals { wave: &memory.now, places: &memory.places, looks };
        let mut lanes = 0;
        for (model, points) in memory.points.iter().enumerate() {
            if points.len() == 0 {
                continue;
            }
            let width = <S::Wide as Lanes>::N;
            lanes += points.len().next_multiple_of(width) as u64;
            match Model::ALL[model] {
                Model::Matte => self.scatter::<Matte<S::Wide>>(points, &arrivals, &chances, next, shadows),
                Model::SmoothConductor => {
                    self.scatter::<SmoothConductor<S::Wide>>(points, &arrivals, &chances, next, shadows)
                }
                Model::RoughConductor => {
                    self.scatter::<RoughConductor<S::Wide>>(points, &arrivals, &chances, next, shadows)
                }
                Model::SmoothDielectric => {
                    self.scatter::<SmoothDielectric<S::Wide>>(points, &arrivals, &chances, next, shadows)
                }
                Model::RoughDielectric => {
                    self.scatter::<RoughDielectric<S::Wide>>(points, &arrivals, &chances, next, shadows)
                }
                Model::Thin => self.scatter::<Thin<S::Wide>>(points, &arrivals, &chances, next, shadows),
                Model::SmoothCoat => self.scatter::<SmoothCoat<S::Wide>>(points, &arrivals, &chances, next, shadows),
                Model::RoughCoat => self.scatter::<RoughCoat<S::Wide>>(points, &arrivals, &chances, next, shadows),
                Model::MetalRough => self.scatter::<MetalRough<S::Wide>>(points, &arrivals, &chances, next, shadows),
            }
        }
        lanes
    }

    /// The rays of the wave have arrived: adds what shines there, and the points to those that scatter.
    fn arrive_all(&self, bounce: u32, memory: &mut PathMemory<S>, hits: &Hits<S>, out: &mut Samples) {
        memory.points.iter_mut().for_each(Points::clear);
        memory.looks.clear();
        memory.places.open(memory.now.rays.padded_len());
        let count = memory.now.path.len();
        for first in (0..count).step_by(S::Wide::N) {
            let hit = met_lanes(hits, first);
            let there = S::Wide::N.min(count - first);
            let gone = !hit & (u32::MAX >> (32 - there));
            if gone != 0 {
                self.leave(first, gone, bounce, &memory.now, out);
            }
            if hit == 0 {
                continue;
            }
            let Met { place, material, known } =
                self.meeting.places(self.world, &self.looks, &memory.now.rays, hits, first, hit);
            memory.places.put_lanes(first, &place);
            for lane in lanes_of(hit) {
                let even = self.looks.even_side(material[lane], place.front >> lane & 1 != 0);
                let Some((look, model)) = even.filter(|_| known >> lane & 1 != 0) else {
                    self.arrive(first + lane, bounce, memory, hits, out);
                    continue;
                };
                if bounce == 0 {
                    let path = memory.now.path[first + lane] as usize;
                    out.colors.make_opaque(path);
                    if let Some(seen) = out.hits.get_mut(path) {
                        let (org, dir) = memory.now.line(first + lane);
                        let arrival = self.met(first + lane, org, dir, hits).resolved(self, material[lane], dir);
                        arrival.show(first + lane, dir, hits, seen);
                    }
                }
                if bounce < self.depth {
                    memory.points[model as usize].push(first + lane, look);
                }
            }
        }
    }

    /// The `lanes` of rays `first..first + N` of the wave have left the scene.
    fn leave(&self, first: usize, lanes: u32, bounce: u32, wave: &Wave<S>, out: &mut Samples) {
        if bounce == 0 && self.lights.are_behind() {
            lanes_of(lanes).for_each(|lane| out.colors.make_opaque(wave.path[first + lane] as usize));
        }
        let mut shine = |i: usize, light: DVec3| {
            let path = wave.path[i] as usize;
            out.shine(path, bounce, light);
            // A sun before nothing is seen all the same.
            if bounce == 0 && light != DVec3::ZERO {
                out.colors.make_opaque(path);
            }
        };
        let Some((radiance, pdf)) = self.lights.even() else {
            for i in lanes_of(lanes).map(|lane| first + lane) {
                let light = self.lights.beyond(wave.line(i).1, |light| wave.weight(i, light));
                shine(i, wave.throughput(i) * light);
            }
            return;
        };
        if radiance == DVec3::ZERO {
            return;
        }
        let odds = S::Wide::constant(pdf) / S::Wide::load(&wave.pdf[first..]);
        let weight = S::Wide::constant(1.0) / odds.mul_add(odds, S::Wide::constant(1.0));
        let light = each(|c| S::Wide::load(&wave.throughput[c][first..]) * S::Wide::constant(radiance[c]) * weight);
        let light = spill(light);
        lanes_of(lanes).for_each(|lane| shine(first + lane, DVec3::from(at(&light, lane).map(S::to_f64))));
    }

    /// Ray `i` of the wave has arrived where lanes do not know what there is.
    fn arrive(&self, i: usize, bounce: u32, memory: &mut PathMemory<S>, hits: &Hits<S>, out: &mut Samples) {
        let wave = &memory.now;
        let (path, (org, dir)) = (wave.path[i] as usize, wave.line(i));
        let met = self.met(i, org, dir, hits);
        let surface = &met.surface;
        let emitted = self.looks.emission(surface.material, surface, met.from_front);
        if emitted != DVec3::ZERO {
            let (prim, inst) = (hits.prim[i], hits.inst[i]);
            let pdf = || self.lights.pdf_of_hit(org, surface.position, surface.ng, prim, inst, self.world);
            let pdf = if wave.pdf[i].is_finite() { pdf() } else { 0.0 };
            out.shine(path, bounce, wave.throughput(i) * emitted * wave.weight(i, pdf));
        }
        if bounce > 0 && bounce == self.depth {
            return;
        }
        let choice = || memory.draws[path].number(bounce, MIXTURE);
        let material =
            if self.looks.has_mixtures { self.looks.resolve(surface.material, choice()) } else { surface.material };
        let arrival = met.resolved(self, material, dir);
        if bounce == 0 {
            out.colors.make_opaque(path);
            if let Some(seen) = out.hits.get_mut(path) {
                arrival.show(i, dir, hits, seen);
            }
            if self.depth == 0 {
                return;
            }
        }
        let Arrival { surface, ng, ns, look } = arrival;
        // A triangle too thin for a normal scatters nothing.
        if ng == DVec3::ZERO || !ng.is_finite() {
            return;
        }
        let t = hits.t[i].to_f64();
        let error = position_error::<S>(org, dir, t, surface.position, surface.magnitude)
            + surface.position.abs() * (2.0 * S::EPSILON.to_f64());
        memory.places.put(i, [surface.position, ng, ns], ng.abs().dot(error));
        memory.points[look.model as usize].push(i, (self.sides.len() + memory.looks.len()) as u32);
        memory.looks.push(look_numbers(look.base, &look.param));
    }

    /// What ray `i`, in f64 `org` and `dir`, has hit.
    fn met(&self, i: usize, org: DVec3, dir: DVec3, hits: &Hits<S>) -> Seen<'_> {
        let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
        let surface = self.world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
        Seen { surface, from_front: surface.ng.dot(dir) <= 0.0 }
    }
}

impl<S: Real> PathMemory<S> {
    /// The primary rays as the first wave.
    fn start(&mut self, rays: &Rays<S>) {
        self.now.open(rays.len());
        let (one, certain) = (S::Wide::constant(1.0), S::Wide::splat(S::INFINITY));
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let vector = |from: &[Column<S>; 3]| each(|axis| S::Wide::load(&from[axis][first..]));
            let path: [u32; MAX_LANES] = std::array::from_fn(|lane| (first + lane) as u32);
            let chosen = Chosen::of(rays.live_lanes(first));
            self.now.push_some(&chosen, &path, [vector(&rays.org), vector(&rays.dir), [one; 3]], [certain, one]);
        }
        self.now.close();
    }
}
