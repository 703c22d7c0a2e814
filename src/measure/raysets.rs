//! Ray sets: the classes of rays a bench traces, made from the primary rays of a camera.
//!
//! Every set keeps the order of the ray file (see `camera`): 32x32 pixel tiles row by row, Morton order inside, one
//! batch of [`BATCH`] rays per tile. Rays are made in f32 whatever the engines compute in, so that f32 and f64
//! engines (and other programs, through a ray file) see the same numbers. Where a primary ray misses, the secondary
//! ray is dead; rays of a further bounce start where those of the bounce before hit. One class needs no camera:
//! [`scatter`] aims at the scene's own primitives.

mod scatter;

use std::sync::Mutex;

use glam::DVec3;
use rayon::prelude::*;

use crate::camera::sampling::{PixelRandom, cosine_hemisphere};
use crate::error::{Error, Result};
use crate::lanes::Real;
use crate::ray::{Hits, Rays};
use crate::scene::description::Light;
use crate::scene::world::{Surface, World};
use crate::trace::{Engine, Scratch};

pub use scatter::scatter;

/// Rays per batch: one tile of 32x32 pixels.
pub const BATCH: usize = 1024;

/// Most batches in one call of an engine under the clock.
const MOST_BATCHES: usize = 4;
/// Calls that each thread has at least, if there are as many batches.
const CALLS_PER_THREAD: usize = 32;

/// Length of an ambient occlusion ray relative to the diagonal of the scene's bounds.
pub const AO_REACH: f64 = 0.05;

/// Diagonal of a scene below which steps off a surface shrink with it.
const SMALL: f64 = 1.0 / 16.0;

/// How far above the eye the default light of shadow rays sits, relative to the diagonal of the scene's bounds.
pub const LIGHT_RISE: f64 = 0.05;

/// Random dimensions of the ray classes start here, apart from those of cameras and integrators.
const DIMENSION: u32 = 0x100;

/// What is asked of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit in the segment.
    Closest,
    /// Whether there is any hit in the segment.
    Any,
}

impl std::str::FromStr for Query {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        [Self::Closest, Self::Any]
            .into_iter()
            .find(|query| query.name() == word)
            .ok_or_else(|| Error::Usage(format!("unknown query `{word}`; the queries are closest and any")))
    }
}

impl Query {
    /// Name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Closest => "closest",
            Self::Any => "any",
        }
    }
}

/// A class of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera through the pixels.
    Primary,
    /// The same rays, but made under the clock, a tile at a time in memory that stays in the caches: what a renderer has.
    Camera,
    /// From the primary hit to one point light (see [`light_for`]): `t` in [0, 1], the light at 1.
    Shadow,
    /// One ray per hit, cosine distributed around the geometric normal on the ray's side, [`AO_REACH`] long.
    Ao,
    /// The mirror direction about the geometric normal, without end.
    Reflect,
    /// One ray per hit, cosine distributed, without end: what a path tracer's second bounce looks like.
    Diffuse,
    /// Aimed at random primitives from all sides and distances, whatever their scale (see [`scatter`]).
    Scatter,
    /// As [`RayKind::Diffuse`], from the hits of diffuse rays: the second bounce.
    Diffuse2,
    /// From the hits of these: the third bounce.
    Diffuse3,
}

impl RayKind {
    /// All classes, in the order of tables.
    pub const ALL: [Self; 9] = [
        Self::Primary,
        Self::Camera,
        Self::Shadow,
        Self::Ao,
        Self::Reflect,
        Self::Diffuse,
        Self::Diffuse2,
        Self::Diffuse3,
        Self::Scatter,
    ];

    /// Name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Camera => "camera",
            Self::Shadow => "shadow",
            Self::Ao => "ao",
            Self::Reflect => "reflect",
            Self::Diffuse => "diffuse",
            Self::Diffuse2 => "diffuse2",
            Self::Diffuse3 => "diffuse3",
            Self::Scatter => "scatter",
        }
    }

    /// What a renderer asks of these rays, so what a bench times.
    pub fn query(self) -> Query {
        match self {
            Self::Shadow | Self::Ao => Query::Any,
            _ => Query::Closest,
        }
    }

    /// `kinds`, each once, in the order in which they come first: a class measured twice would be two rows about the same.
    pub fn each_once(kinds: &[Self]) -> Vec<Self> {
        let is_first = |(i, kind): &(usize, &Self)| !kinds[..*i].contains(kind);
        kinds.iter().enumerate().filter(is_first).map(|(_, kind)| *kind).collect()
    }

    /// The class whose hits these rays start from; `None` if they start from none.
    pub fn parent(self) -> Option<Self> {
        match self {
            Self::Primary | Self::Camera | Self::Scatter => None,
            Self::Shadow | Self::Ao | Self::Reflect | Self::Diffuse => Some(Self::Primary),
            Self::Diffuse2 => Some(Self::Diffuse),
            Self::Diffuse3 => Some(Self::Diffuse2),
        }
    }
}

impl std::str::FromStr for RayKind {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|k| k.name() == word).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let near = crate::error::nearest_name(word, names).map(|n| format!(" (did you mean `{n}`?)"));
            let near = near.unwrap_or_default();
            Error::Usage(format!("unknown ray class `{word}`{near}; the classes are {}", names.join(", ")))
        })
    }
}

/// The same rays in the precision of an engine: f32 values widen exactly, so all precisions trace the same rays.
pub fn convert<S: Real>(batches: &[Rays<f32>]) -> Vec<Rays<S>> {
    batches.iter().map(|b| convert_range(b, 0..b.len())).collect()
}

/// One long batch (a ray file) cut into what engines get in one call when `threads` threads share it, in the engine's
/// precision.
pub fn split<S: Real>(rays: &Rays<f32>, threads: usize) -> Vec<Rays<S>> {
    let call = call_len(rays.len(), threads);
    (0..rays.len()).step_by(call).map(|at| convert_range(rays, at..rays.len().min(at + call))).collect()
}

/// The same of many batches of [`BATCH`] rays, of which the last may be shorter.
pub fn calls<S: Real>(batches: &[Rays<f32>], threads: usize) -> Vec<Rays<S>> {
    let count = batches.iter().map(Rays::len).sum();
    let joined = batches.chunks(call_len(count, threads) / BATCH).map(|chunk| {
        let mut rays = Rays::new(chunk.iter().map(Rays::len).sum());
        let all = chunk.iter().flat_map(|batch| (0..batch.len()).map(move |i| (batch, i)));
        all.enumerate().for_each(|(slot, (from, i))| copy(from, i, &mut rays, slot));
        rays
    });
    joined.collect()
}

/// Rays of one call of an engine: as many as let it fetch ahead, as few as let `threads` threads share `count` rays evenly.
fn call_len(count: usize, threads: usize) -> usize {
    let fair = count / (CALLS_PER_THREAD * threads.max(1));
    (fair / BATCH).clamp(1, MOST_BATCHES) * BATCH
}

fn copy<S: Real>(from: &Rays<f32>, i: usize, to: &mut Rays<S>, slot: usize) {
    let cast = |x: f32| S::from_f64(f64::from(x));
    to.set(slot, from.org(i).map(cast), from.dir(i).map(cast), cast(from.t_min[i]), cast(from.t_max[i]));
}

fn convert_range<S: Real>(from: &Rays<f32>, range: std::ops::Range<usize>) -> Rays<S> {
    let mut to = Rays::new(range.len());
    range.enumerate().for_each(|(slot, i)| copy(from, i, &mut to, slot));
    to
}

/// A hit where further rays start.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Hit point, world space.
    pub position: DVec3,
    /// Unit geometric normal on the side the ray came from.
    pub normal: DVec3,
    /// Direction of the ray that hit, not unit.
    pub dir: DVec3,
    /// Whether it lies on an instance, whose map rounds all coordinates as much as the largest one.
    pub is_mapped: bool,
}

impl Start {
    /// Where rays start that leave the surface on the side of `normal`.
    fn origin(&self, normal: DVec3, setting: &Setting) -> [f32; 3] {
        match self.is_mapped {
            true => offset_mapped(self.position, normal, setting.size()),
            false => offset_in(self.position, normal, setting.size()),
        }
    }
}

/// Hits of some rays (a camera's, or those of a bounce), per batch and slot; `None` where the ray misses or is dead.
#[derive(Debug)]
pub struct Starts {
    batches: Vec<Vec<Option<Start>>>,
}

impl Starts {
    /// Traces `rays` with `engine` on the current rayon pool.
    pub fn trace<S: Real>(world: &World<S>, engine: &dyn Engine<S>, rays: &[Rays<f32>]) -> Self {
        let scratches: Mutex<Vec<Scratch>> = Mutex::default();
        let batch_starts = |batch: &Rays<f32>| {
            let rays = convert_range(batch, 0..batch.len());
            let mut hits = Hits::new(rays.len());
            let mut scratch = scratches.lock().ok().and_then(|mut free| free.pop()).unwrap_or_default();
            engine.intersect(world, &rays, &mut hits, &mut scratch, None);
            if let Ok(mut free) = scratches.lock() {
                free.push(scratch);
            }
            (0..rays.len()).map(|i| start(world, &rays, &hits, i)).collect()
        };
        Self { batches: rays.par_iter().map(batch_starts).collect() }
    }

    /// Number of hits.
    pub fn count(&self) -> usize {
        self.batches.iter().flatten().flatten().count()
    }

    /// The secondary rays of `kind`; [`RayKind::Primary`], [`RayKind::Camera`] and [`RayKind::Scatter`] are not made from hits: for
    /// them all rays are dead.
    pub fn rays(&self, kind: RayKind, setting: &Setting) -> Vec<Rays<f32>> {
        let batch_rays = |(b, starts): (usize, &Vec<Option<Start>>)| {
            let mut rays = Rays::new(starts.len());
            for (i, start) in starts.iter().enumerate() {
                let Some(start) = start else { continue };
                let random = PixelRandom::new(i as u32, b as u32, setting.seed).pair(0, DIMENSION + kind as u32);
                if let Some((org, dir, t_max)) = secondary(kind, start, setting, random) {
                    rays.set(i, org, dir, 0.0, t_max);
                }
            }
            rays
        };
        self.batches.par_iter().enumerate().map(batch_rays).collect()
    }
}

fn start<S: Real>(world: &World<S>, rays: &Rays<S>, hits: &Hits<S>, i: usize) -> Option<Start> {
    if !hits.is_hit(i) {
        return None;
    }
    let wide = |v: [S; 3]| DVec3::from_array(v.map(S::to_f64));
    let (org, dir) = (wide(rays.org(i)), wide(rays.dir(i)));
    let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
    let Surface { position, ng, .. } = world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
    let usable = position.is_finite() && ng.is_finite() && ng != DVec3::ZERO;
    let (normal, is_mapped) = (if ng.dot(dir) > 0.0 { -ng } else { ng }, !world.is_single_object());
    usable.then_some(Start { position, normal, dir, is_mapped })
}

/// What secondary rays depend on besides the hit.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Position of the light that shadow rays end in.
    pub light: DVec3,
    /// Diagonal of the scene's bounds, scene units.
    pub diagonal: f64,
    /// Seed of the random directions: the same seed gives the same rays on every machine.
    pub seed: u64,
}

impl Setting {
    /// By how much steps off a surface that are fixed near 0 are smaller than in scenes of usual size: 1 but for small scenes, whose
    /// rays would step over all of them. (Not for others: rays of theirs that were measured must stay what they are.)
    fn size(&self) -> f64 {
        (self.diagonal / SMALL).min(1.0)
    }
}

/// The light of shadow rays: the scene's first point light. A scene without one gets a light near the eye:
/// [`LIGHT_RISE`] diagonals above it, or half way to what is above it where that is nearer, so that the light is
/// not buried in a ceiling.
///
/// `up`: the camera's unit up vector; `clearance`: distance from the eye along `up` to the first surface.
pub fn light_for(lights: &[Light], eye: DVec3, up: DVec3, diagonal: f64, clearance: f64) -> DVec3 {
    let point = lights.iter().find_map(|light| match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Some(*position),
        Light::Directional { .. } | Light::Sun { .. } => None,
    });
    point.unwrap_or_else(|| eye + up * (LIGHT_RISE * diagonal).min(0.5 * clearance))
}

/// Origin, direction and end of a secondary ray; `None` if it would not be finite in f32.
fn secondary(kind: RayKind, at: &Start, setting: &Setting, random: [f64; 2]) -> Option<([f32; 3], [f32; 3], f32)> {
    if !at.position.as_vec3().is_finite() {
        return None;
    }
    let cosine = || cosine_hemisphere(at.normal, random);
    let (dir, t_max) = match kind {
        RayKind::Primary | RayKind::Camera | RayKind::Scatter => return None,
        RayKind::Shadow => {
            // A surface that faces away from the light is left on its far side, as a shader would leave it.
            let normal = if (setting.light - at.position).dot(at.normal) < 0.0 { -at.normal } else { at.normal };
            let org = at.origin(normal, setting);
            let dir = setting.light - DVec3::from_array(org.map(f64::from));
            return finite(org, dir, 1.0);
        }
        RayKind::Ao => (cosine(), (AO_REACH * setting.diagonal) as f32),
        RayKind::Reflect => (reflect(at.dir, at.normal).normalize_or_zero(), f32::INFINITY),
        RayKind::Diffuse | RayKind::Diffuse2 | RayKind::Diffuse3 => (cosine(), f32::INFINITY),
    };
    finite(at.origin(at.normal, setting), dir, t_max)
}

fn finite(org: [f32; 3], dir: DVec3, t_max: f32) -> Option<([f32; 3], [f32; 3], f32)> {
    let dir = dir.as_vec3().to_array();
    org.iter().chain(&dir).all(|x| x.is_finite()).then_some((org, dir, t_max))
}

/// `dir` mirrored about the plane with unit normal `normal`.
fn reflect(dir: DVec3, normal: DVec3) -> DVec3 {
    dir - normal * (2.0 * dir.dot(normal))
}

/// As [`offset_in`], by 256 roundings of the largest coordinate along the whole normal.
fn offset_mapped(position: DVec3, normal: DVec3, size: f64) -> [f32; 3] {
    let largest = position.abs().max_element().max(size / 32.0);
    (position + normal * (256.0 * f64::from(f32::EPSILON) * largest)).as_vec3().to_array()
}

/// The point moved off its surface towards `normal`, far enough that the f32 rounding of a hit cannot put it on the
/// other side: 256 ulps per axis where the coordinate is large, and a fixed 1/65536 near 0 where ulps are too fine.
///
/// Source: C. Waechter and N. Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems,
/// 2019, chapter 6, with its constants: the step is tuned for scenes of about unit size or larger.
pub fn offset_origin(position: DVec3, normal: DVec3) -> [f32; 3] {
    offset_in(position, normal, 1.0)
}

/// The same with a step near 0 that is `size` times as large, but no smaller than the roundings of what is far from there.
fn offset_in(position: DVec3, normal: DVec3, size: f64) -> [f32; 3] {
    const STEP: f32 = 1.0 / 65536.0;
    const NEAR_ZERO: f32 = 1.0 / 32.0;
    const ULPS: f32 = 256.0;
    let (point, normal) = (position.as_vec3().to_array(), normal.as_vec3().to_array());
    let largest = point.iter().fold(0.0f32, |most, p| most.max(p.abs()));
    let step = (STEP * size as f32).max(8.0 * f32::EPSILON * largest).min(STEP);
    std::array::from_fn(|axis| {
        let (p, n) = (point[axis], normal[axis]);
        if p.abs() < NEAR_ZERO / STEP * step {
            return p + step * n;
        }
        let ulps = (ULPS * n) as i32;
        let outward = if p < 0.0 { -ulps } else { ulps };
        f32::from_bits(p.to_bits().wrapping_add_signed(outward))
    })
}

#[cfg(test)]
mod tests;
