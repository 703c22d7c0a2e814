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

mod endless;
mod glass;
mod lamp;
mod level;
mod material;
mod meetings;
mod parameters;
mod pattern;
mod phong;
mod shadow;
mod sort;

use glam::DVec3;

use self::endless::Endless;
use self::lamp::Lamp;
use self::level::{Found, Level};
use self::material::RtMaterial;
use self::meetings::Meetings;
use self::shadow::Probes;
use super::colors::Colors;
use super::sample::{FirstHit, Rgba, Samples};
use super::shader::{Shader, Workspace};
use crate::camera::Camera;
use crate::lanes::{Lanes, Real, map3};
use crate::ray::Rays;
use crate::scene::assembly::AssemblyObject;
use crate::scene::brlcad::describe::Looks;
pub use material::unknown_shaders;
use pattern::Pattern;
use sort::Sky;

/// Surfaces nearer than this along a ray, mm, are behind it.
const TOLERANCE: f64 = 0.0005;
/// Colours with nothing above this, which is more than one and a half steps of a byte, may look like the background.
const DARK: f64 = 1.6 / 255.0;
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
    endless: Endless,
    /// The direction of all primary rays, if they have one.
    parallel: Option<DVec3>,
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
    /// The paths that go on.
    next: Level<S>,
    found: Found<S>,
    meetings: Meetings<S>,
    probes: Probes<S>,
    next_probes: Probes<S>,
    /// What shadow rays find, and rays that look back.
    shadow: Found<S>,
    /// Rays that look back.
    back: Level<S>,
    /// Of each vector of lanes: those that meet nothing, but may be inside something without end.
    lost: Vec<u32>,
    /// Those of them that are.
    inside: Vec<u32>,
    /// Primary rays that met something and may look like the background.
    dark: Vec<u32>,
}

impl Rt {
    /// Regions that look like `looks`, the parts of `object` (`None`: there is nothing), lit by their own lights, or by one
    /// over the viewer's left shoulder.
    pub fn new(looks: &Looks, object: Option<&AssemblyObject>, camera: &Camera) -> Self {
        let materials: Vec<RtMaterial> = looks.regions.iter().map(RtMaterial::of).collect();
        let surroundings = looks.surroundings.as_ref().and_then(|shader| Pattern::of(shader.layers.first()?));
        let endless = Endless::new(looks, object);
        let parallel = camera.parallel.then_some(-camera.n);
        Self { lamps: lamp::lamps(looks, &materials, camera), materials, surroundings, endless, parallel }
    }

    /// What surrounds the scene, if all primary rays see the same of it.
    pub fn surroundings<S: Real>(&self) -> Option<[S; 3]> {
        let dir = match (&self.surroundings, self.parallel) {
            (Some(_), None) => return None,
            (_, dir) => level::unit(dir.unwrap_or(DVec3::X)),
        };
        Some(map3(Sky::new(self).color::<S>(map3(dir, S::Wide::splat), 1), |x| x.lane(0)))
    }
}

impl<S: Real> Shader<'_, S> {
    /// What each primary ray of `rays`, of which `live` are, sees in `rt`'s lighting model.
    pub(super) fn rt(&self, rt: &Rt, rays: &mut Rays<S>, live: u64, work: &mut Workspace<S>, out: &mut Samples) {
        // A pointer: what it points to is large.
        let mut memory = work.rt.take().unwrap_or_default();
        memory.level.start(rays, live, rt.parallel);
        memory.dark.clear();
        let mut is_primary = true;
        while memory.level.len() > 0 {
            memory.next.open(memory.level.len());
            self.intersect_all(&memory.level.rays, work);
            memory.found.set(self.world, &memory.level, &work.hits);
            if !is_primary {
                work.rays.mirror += memory.level.len() as u64;
            } else {
                see(&memory.found, &mut out.hits);
            }
            self.rt_sort(rt, &mut memory, &work.hits, out);
            self.rt_lost(rt, &mut memory, work, out);
            self.rt_light(rt, &mut memory, work, out);
            if is_primary {
                memory.level.give_back(rays);
            }
            memory.next.close();
            std::mem::swap(&mut memory.level, &mut memory.next);
            is_primary = false;
        }
        memory.dark.iter().for_each(|&pixel| not_the_background(&mut out.colors, pixel as usize));
        work.rt = Some(memory);
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
fn not_the_background(seen: &mut Colors, pixel: usize) {
    let byte = |x: f64| (x * 255.0 + 0.5) as u8;
    let color = seen.get(pixel);
    if color.radiance.to_array().map(byte) == [0, 0, 1] {
        seen.set(pixel, Rgba { radiance: DVec3::new(0.0, 0.0, 2.0 / 255.0), ..color });
    }
}
