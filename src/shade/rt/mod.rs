//! The lighting model of BRL-CAD's `rt`, so that its benchmark images come out: rays that start on the plane through
//! the eye, Phong shading with Schlick's highlight, one shadow ray to the middle of each light, mirrors and glass,
//! procedural colours. Not a model of light: what `rt -B -J0` computes.
//!
//! Source: the behaviour of BRL-CAD 7.32.6 (`rt`, `liboptical`), described in its manual and checked against its own
//! images. Departures: air has no refraction of its own, glass that touches other glass is left into air, and patterns
//! know the parameters of spheres, ellipsoids, half-spaces and regions of a single arb; elsewhere they see (0, 0).
//!
//! Like the other integrators, this one works on batches: a level of paths is one batch of rays, its shadow rays are
//! compact batches of their own; normals and lighting are computed in lanes.

mod glass;
mod lamp;
mod level;
mod material;
mod pattern;
mod phong;
mod shadow;

use glam::DVec3;

use self::lamp::Lamp;
use self::level::{Found, Level};
use self::material::RtMaterial;
use self::phong::Meetings;
use self::shadow::Probes;
use super::sample::{FirstHit, Rgba, Samples};
use super::shader::{Shader, Workspace};
use crate::camera::Camera;
use crate::lanes::{Lanes, Real};
use crate::ray::{Hits, Rays};
use crate::scene::brlcad::describe::Looks;
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

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
struct Path {
    org: DVec3,
    /// Unit.
    dir: DVec3,
    carry: Carry,
}

/// What a ray carries.
#[derive(Clone, Copy, Debug)]
struct Carry {
    /// Number of the primary ray.
    pixel: u32,
    level: u32,
    /// What of its colour reaches the pixel.
    throughput: DVec3,
    /// Refractive index of where the ray is.
    index: f64,
    /// Glass that the ray has just left.
    left: Option<u32>,
    /// Set while the ray is in glass and looks for the way out.
    within: Option<Within>,
}

impl Carry {
    /// Of a primary ray.
    fn new(pixel: u32) -> Self {
        Self { pixel, level: 0, throughput: DVec3::ONE, index: AIR, left: None, within: None }
    }
}

/// A ray inside glass.
#[derive(Clone, Copy, Debug)]
struct Within {
    region: u32,
    /// Refractive index of the glass.
    index: f64,
    /// Internal reflections so far.
    reflections: u32,
}

/// One thread's arrays, reused from batch to batch.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory<S> {
    level: Level<S>,
    found: Found<S>,
    meetings: Meetings<S>,
    probes: Probes<S>,
    next_probes: Probes<S>,
    /// What shadow rays find, and rays that look back.
    shadow: Found<S>,
    /// Rays that look back.
    back: Level<S>,
    /// Of each vector of lanes: the primary rays that met something.
    first: Vec<u32>,
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
    pub(super) fn rt(&self, rt: &Rt, rays: &Rays<S>, work: &mut Workspace<S>, out: &mut Samples) {
        let mut memory = std::mem::take(&mut work.rt);
        memory.level.start(rays);
        let (mut next, mut lost) = (Vec::new(), Vec::new());
        let mut is_primary = true;
        while memory.level.len() > 0 {
            self.intersect_all(&memory.level.rays, work);
            memory.found.set(self.world, &memory.level.rays, &work.hits);
            if !is_primary {
                work.rays.mirror += memory.level.len() as u64;
            } else {
                memory.first.clone_from(&memory.found.hit);
                see(&memory.found, &mut out.hits);
            }
            self.rt_sort(rt, &mut memory, &work.hits, &mut next, &mut lost, out);
            self.rt_lost(rt, &lost, &mut memory, work, out);
            self.rt_light(rt, &mut memory, &mut next, work, out);
            memory.level.open(&next);
            next.clear();
            lost.clear();
            is_primary = false;
        }
        for (first, hit) in (0..rays.len()).step_by(S::Wide::N).zip(&memory.first) {
            let colors = out.colors[first..].iter_mut().take(S::Wide::N).enumerate();
            colors.filter(|(lane, _)| hit >> lane & 1 != 0).for_each(|(_, color)| not_the_background(color));
        }
        work.rt = memory;
    }

    /// Tells the hits of a level apart: paths that meet nothing go to `lost`, those that go on as they are to `next`,
    /// those that enter regions to the meetings.
    fn rt_sort(
        &self,
        rt: &Rt,
        memory: &mut Memory<S>,
        hits: &Hits<S>,
        next: &mut Vec<Path>,
        lost: &mut Vec<u32>,
        out: &mut Samples,
    ) {
        let Memory { level, found, meetings, .. } = memory;
        meetings.open(level.rays.padded_len());
        for i in 0..level.len() {
            if !level.is_live(i) {
                continue;
            }
            let carry = level.carry(i);
            out.colors[carry.pixel as usize].alpha = 1.0;
            if carry.within.is_some() {
                glass::step(level, i, found, next);
            } else if !found.is_hit(i) {
                lost.push(i as u32);
            } else if found.is_leaving(i) {
                if carry.left == Some(found.region[i]) && found.t[i].to_f64() < THIN {
                    let path = level.path(i);
                    next.push(Path { org: found.position(i), carry: Carry { left: None, ..carry }, ..path });
                } else {
                    let color = INSIDE.0 * INSIDE.1.powi((MAX_BOUNCES + 1).saturating_sub(carry.level) as i32);
                    out.colors[carry.pixel as usize].radiance += carry.throughput * color;
                }
            } else {
                let region = found.region[i];
                let material = &rt.materials[region as usize];
                let base = material.color(|| {
                    let (position, normal) = (found.position(i), found.normal(i));
                    let of_arb = || pattern::uv_of_arb(material.faces(), position, normal);
                    pattern::uv(self.world, region, hits.prim[i], position, normal).or_else(of_arb)
                });
                meetings.add(i, base);
            }
        }
    }

    /// Rays that nothing stops: the surroundings, or the inside of a solid without end.
    fn rt_lost(&self, rt: &Rt, lost: &[u32], memory: &mut Memory<S>, work: &mut Workspace<S>, out: &mut Samples) {
        let Memory { level, back, shadow, .. } = memory;
        let looks_back = rt.unbounded.contains(&true) && !lost.is_empty();
        if looks_back {
            // A ray that starts inside a region without bounds leaves it when it looks back.
            let turned = |path: Path| Path { dir: -path.dir, ..path };
            back.open(&lost.iter().map(|&i| turned(level.path(i as usize))).collect::<Vec<_>>());
            self.intersect_all(&back.rays, work);
            shadow.set(self.world, &back.rays, &work.hits);
        }
        // Rays of parallel projection all have one direction.
        let mut last = (DVec3::ZERO, DVec3::ZERO);
        for (k, &i) in lost.iter().enumerate() {
            let inside = looks_back && shadow.is_leaving(k) && rt.unbounded[shadow.region[k] as usize];
            let color = match &rt.surroundings {
                _ if inside => DVec3::splat(INSIDE.0),
                Some(pattern) => {
                    let dir = level.path(i as usize).dir;
                    if dir != last.0 {
                        last = (dir, pattern.color(pattern::uv_of_direction(dir)));
                    }
                    last.1
                }
                None => BACKGROUND,
            };
            let carry = level.carry(i as usize);
            out.colors[carry.pixel as usize].radiance += carry.throughput * color;
        }
    }
}

/// What the pixels' other planes show of the primary rays.
fn see<S: Real>(found: &Found<S>, out: &mut [FirstHit]) {
    for (i, sample) in out.iter_mut().enumerate().filter(|(i, _)| found.is_hit(*i)) {
        sample.distance = found.t[i].to_f64();
        sample.normal = found.normal(i);
        (sample.inst, sample.prim) = (0, found.region[i]);
    }
}

/// `rt` keeps the background's colour for the background: a hit of that very colour becomes one step bluer.
fn not_the_background(seen: &mut Rgba) {
    let color = seen.radiance;
    // Most are brighter.
    if color.max_element() * 255.0 < 1.5 {
        let byte = |x: f64| (x * 255.0 + 0.5) as u8;
        if [color.x, color.y, color.z].map(byte) == [0, 0, 1] {
            seen.radiance = DVec3::new(0.0, 0.0, 2.0 / 255.0);
        }
    }
}
