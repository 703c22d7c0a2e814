//! The lighting model of BRL-CAD's `rt`, so that its benchmark images come out: rays that start on the plane through
//! the eye, Phong shading with Schlick's highlight, one shadow ray to the middle of each light, mirrors and glass,
//! procedural colours. Not a model of light: what `rt -B -J0` computes.
//!
//! Source: the behaviour of BRL-CAD 7.32.6 (`rt`, `liboptical`), described in its manual and checked against its own
//! images. Departures: air has no refraction of its own, glass that touches other glass is left into air, and patterns
//! know the parameters of spheres, ellipsoids, half-spaces and regions of a single arb; elsewhere they see (0, 0).
//!
//! Like the other integrators, this one works on batches: a level of paths is one batch of rays, its shadow rays are
//! compact batches of their own.

mod glass;
mod lamp;
mod material;
mod pattern;
mod phong;
mod shadow;

use glam::DVec3;

use super::sample::Sample;
use super::shader::{Shader, Workspace};
use crate::camera::Camera;
use crate::lanes::Real;
use crate::ray::Rays;
use crate::scene::brlcad::describe::Looks;
use lamp::Lamp;
use material::RtMaterial;
pub use material::unknown_shaders;
use pattern::Pattern;

/// Surfaces nearer than this along a ray, mm, are behind it.
const TOLERANCE: f64 = 0.0005;
/// What leaves the scene: as dark as a byte of blue can be without being black.
const BACKGROUND: DVec3 = DVec3::new(0.0, 0.0, 1.0 / 255.0);
/// Light everywhere, as seen from the eye.
const AMBIENT: f64 = 0.4;
/// Deepest mirror or glass.
const MAX_BOUNCES: u32 = 5;
/// What the inside of a solid looks like, and what is left of it for each further push through it.
const INSIDE: (f64, f64) = (0.18, 0.8);
/// Refractive index of air.
const AIR: f64 = 1.0;
/// Partitions thinner than this, mm, are passed over by rays that leave the same glass.
const THIN: f64 = 0.05;

/// A database's regions and lights, ready to shade.
pub(super) struct Rt {
    materials: Vec<RtMaterial>,
    lamps: Vec<Lamp>,
    surroundings: Option<Pattern>,
    /// Whether each region has no bounds: a ray may start inside and never leave it.
    unbounded: Vec<bool>,
}

/// A ray on its way, with what of its colour reaches the pixel.
#[derive(Clone, Copy)]
struct Path {
    /// Number of the primary ray.
    pixel: u32,
    org: DVec3,
    /// Unit.
    dir: DVec3,
    level: u32,
    throughput: DVec3,
    /// Refractive index of where the ray is.
    index: f64,
    /// Glass that the ray has just left.
    left: Option<u32>,
    /// Set while the ray is in glass and looks for the way out.
    within: Option<Within>,
}

/// A ray inside glass.
#[derive(Clone, Copy)]
struct Within {
    region: u32,
    /// Refractive index of the glass.
    index: f64,
    /// Internal reflections so far.
    reflections: u32,
}

/// Where a path meets a region from outside.
#[derive(Clone, Copy)]
struct Meeting {
    path: Path,
    t: f64,
    position: DVec3,
    /// Unit, towards the viewer.
    normal: DVec3,
    region: u32,
    /// The region's colour there.
    base: DVec3,
}

/// What a ray found.
enum Found {
    /// Nothing.
    Nothing,
    /// The surface of region so-and-so, from outside.
    Entering { t: f64, region: u32, prim: u32, position: DVec3, normal: DVec3 },
    /// As above, from inside; the normal points out.
    Leaving { t: f64, region: u32, position: DVec3, normal: DVec3 },
}

impl Rt {
    /// Regions that look like `looks`, lit by their own lights, or by one over the viewer's left shoulder.
    pub fn new(looks: &Looks, camera: &Camera) -> Self {
        let materials: Vec<RtMaterial> = looks.regions.iter().map(RtMaterial::of).collect();
        let surroundings = looks.surroundings.as_ref().and_then(|shader| Pattern::of(shader.layers.first()?));
        let unbounded = looks.regions.iter().map(|look| look.bounds.is_none()).collect();
        Self { lamps: lamp::lamps(looks, &materials, camera), materials, surroundings, unbounded }
    }
}

impl<S: Real> Shader<'_, S> {
    /// What each primary ray of `rays` sees in `rt`'s lighting model.
    pub(super) fn rt(&self, rt: &Rt, rays: &Rays<S>, work: &mut Workspace<S>, out: &mut [Sample]) {
        let mut paths: Vec<Path> = (0..rays.len())
            .filter(|&i| rays.is_live(i))
            .map(|i| {
                let org = DVec3::from(rays.org(i).map(S::to_f64));
                let dir = DVec3::from(rays.dir(i).map(S::to_f64)).normalize();
                let (pixel, throughput) = (i as u32, DVec3::ONE);
                Path { pixel, org, dir, level: 0, throughput, index: AIR, left: None, within: None }
            })
            .collect();
        let mut next = Vec::new();
        let mut is_primary = true;
        while !paths.is_empty() {
            let found = self.rt_trace(&paths, work);
            if !is_primary {
                work.rays.mirror += paths.len() as u64;
            }
            let mut meetings = Vec::new();
            let mut lost = Vec::new();
            for (path, found) in paths.iter().zip(found) {
                if is_primary {
                    see(&mut out[path.pixel as usize], &found);
                }
                if path.within.is_some() {
                    glass::step(path, &found, &mut next);
                    continue;
                }
                match found {
                    Found::Nothing => lost.push(*path),
                    Found::Leaving { t, region, position, .. } if path.left == Some(region) && t < THIN => {
                        next.push(Path { org: position, left: None, ..*path });
                    }
                    Found::Leaving { .. } => {
                        let color = INSIDE.0 * INSIDE.1.powi((MAX_BOUNCES + 1).saturating_sub(path.level) as i32);
                        out[path.pixel as usize].radiance += path.throughput * color;
                    }
                    Found::Entering { t, region, prim, position, normal } => {
                        let material = &rt.materials[region as usize];
                        let of_arb = || pattern::uv_of_arb(material.arb()?, position, normal);
                        let part = &self.world.assembly.objects[0].parts[region as usize];
                        let base = material.color(|| pattern::uv(part, prim, position, normal).or_else(of_arb));
                        meetings.push(Meeting { path: *path, t, position, normal, region, base });
                    }
                }
            }
            self.rt_lost(rt, &lost, work, out);
            self.rt_light(rt, &meetings, &mut next, work, out);
            paths = std::mem::take(&mut next);
            is_primary = false;
        }
        for sample in out.iter_mut().filter(|sample| sample.alpha > 0.0 && sample.prim != crate::ray::INVALID_ID) {
            sample.radiance = not_the_background(sample.radiance);
        }
    }

    /// Rays that nothing stops: the surroundings, or the inside of a solid without end.
    fn rt_lost(&self, rt: &Rt, lost: &[Path], work: &mut Workspace<S>, out: &mut [Sample]) {
        let inside = self.rt_inside(rt, lost, work);
        for (path, inside) in lost.iter().zip(inside) {
            let color = match &rt.surroundings {
                _ if inside => DVec3::splat(INSIDE.0),
                Some(pattern) => pattern.color(pattern::uv_of_direction(path.dir)),
                None => BACKGROUND,
            };
            let sample = &mut out[path.pixel as usize];
            sample.radiance += path.throughput * color;
            sample.alpha = 1.0;
        }
    }

    /// Whether each ray starts inside a region without bounds: one that looks back leaves it.
    fn rt_inside(&self, rt: &Rt, paths: &[Path], work: &mut Workspace<S>) -> Vec<bool> {
        if !rt.unbounded.contains(&true) {
            return vec![false; paths.len()];
        }
        let back: Vec<Path> = paths.iter().map(|path| Path { dir: -path.dir, ..*path }).collect();
        let is_inside =
            |found: &Found| matches!(found, Found::Leaving { region, .. } if rt.unbounded[*region as usize]);
        self.rt_trace(&back, work).iter().map(is_inside).collect()
    }

    /// The first surface on each path.
    fn rt_trace(&self, paths: &[Path], work: &mut Workspace<S>) -> Vec<Found> {
        let mut batch = std::mem::take(&mut work.batch);
        batch.reset(paths.len());
        let (start, end) = (S::from_f64(TOLERANCE), S::from_f64(f64::INFINITY));
        for (i, path) in paths.iter().enumerate() {
            batch.set(i, path.org.to_array().map(S::from_f64), path.dir.to_array().map(S::from_f64), start, end);
        }
        self.intersect_all(&batch, work);
        let found = (0..paths.len()).map(|i| self.rt_found(i, paths[i].org, paths[i].dir, work)).collect();
        work.batch = batch;
        found
    }

    /// Hit `i` of the last batch, whose ray was `org`, `dir`.
    fn rt_found(&self, i: usize, org: DVec3, dir: DVec3, work: &Workspace<S>) -> Found {
        let hits = &work.hits;
        if !hits.is_hit(i) {
            return Found::Nothing;
        }
        let (t, prim, inst) = (hits.t[i].to_f64(), hits.prim[i], hits.inst[i]);
        let (u, v) = (hits.u[i].to_f64(), hits.v[i].to_f64());
        let surface = self.world.surface(org, dir, t, u, v, prim, inst);
        let region = self.world.part(self.world.assembly.placements[inst as usize].object, prim);
        let (position, normal) = (surface.position, surface.ng);
        if normal.dot(dir) > 0.0 {
            return Found::Leaving { t, region, position, normal };
        }
        Found::Entering { t, region, prim, position, normal }
    }
}

/// What the pixel's other planes show of a primary ray.
fn see(sample: &mut Sample, found: &Found) {
    let (Found::Entering { t, region, normal, .. } | Found::Leaving { t, region, normal, .. }) = found else { return };
    sample.alpha = 1.0;
    sample.distance = *t;
    sample.normal = *normal;
    (sample.inst, sample.prim) = (0, *region);
}

/// `rt` keeps the background's colour for the background: a hit of that very colour becomes one step bluer.
fn not_the_background(color: DVec3) -> DVec3 {
    let byte = |x: f64| (x * 255.0 + 0.5) as u8;
    if [color.x, color.y, color.z].map(byte) == [0, 0, 1] { DVec3::new(0.0, 0.0, 2.0 / 255.0) } else { color }
}
