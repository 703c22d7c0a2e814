//! What integrators share: the first hits of a batch, compact batches of further rays, counts.

use glam::DVec3;

use super::integrator::Integrator;
use super::offset::{offset_origin, position_error};
use super::path::{PathMemory, PathStats, Paths};
use super::rt::Rt;
use crate::camera::Camera;
use crate::lanes::Real;
use crate::ray::{Counters, Hits, INVALID_ID, Rays};
use crate::scene::description::{Description, Light, Material};
use crate::scene::world::World;
use crate::trace::{Engine, Scratch};

/// Rays of one cost measurement: in Morton order 16 consecutive rays are a block of 4 x 4 pixels.
const COST_BLOCK: usize = 16;

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
    /// Whether node visits of primary rays are counted (see [`Sample::nodes`]).
    pub cost: bool,
    /// Whether more is wanted of first hits than radiance and coverage (only paths save the work).
    pub first_hits: bool,
    /// Whether all engine calls count ([`Workspace::counters`]); counting kernels are slower.
    pub count: bool,
}

/// What one primary ray saw. For a miss: infinite distance, invalid ids, zeros, and what the integrator shows there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Radiance or the integrator's value, linear Rec.709.
    pub radiance: DVec3,
    /// Whether the radiance is opaque: 1 where something was hit or the integrator shows what lies behind, else 0.
    pub alpha: f64,
    /// Distance from the ray's origin to the hit, scene units.
    pub distance: f64,
    /// Hit point, world space.
    pub position: DVec3,
    /// Unit geometric normal, world space, turned towards the viewer.
    pub normal: DVec3,
    /// Unit shading normal on the same side.
    pub shading_normal: DVec3,
    /// Diffuse reflectance; the base colour of other materials.
    pub albedo: DVec3,
    /// Part of the radiance that came from a light without detours: seen itself, or scattered once.
    pub direct: DVec3,
    /// Material number.
    pub material: u32,
    /// Of a pixel: variance of the mean brightness, estimated from its samples.
    pub square: f64,
    /// Of a pixel: number of samples.
    pub samples: u32,
    /// Instance number.
    pub inst: u32,
    /// Primitive number.
    pub prim: u32,
    /// Node visits per ray, if counted: packets share visits, so this is the number of visits that the engine made
    /// for the 4 x 4 block of rays around this one, divided by the block's live rays. Depends on the engine.
    pub nodes: f64,
}

impl Sample {
    /// A ray that hit nothing in a black world.
    pub const MISS: Self = Self {
        radiance: DVec3::ZERO,
        alpha: 0.0,
        distance: f64::INFINITY,
        position: DVec3::ZERO,
        normal: DVec3::ZERO,
        shading_normal: DVec3::ZERO,
        albedo: DVec3::ZERO,
        direct: DVec3::ZERO,
        material: INVALID_ID,
        square: 0.0,
        samples: 0,
        inst: INVALID_ID,
        prim: INVALID_ID,
        nodes: 0.0,
    };
}

/// Live rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// Towards lights (any-hit).
    pub shadow: u64,
    /// Ambient occlusion (any-hit).
    pub occlusion: u64,
    /// Mirror reflections.
    pub mirror: u64,
    /// Scattered along paths.
    pub scattered: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.occlusion + self.mirror + self.scattered
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.primary += o.primary;
        self.shadow += o.shadow;
        self.occlusion += o.occlusion;
        self.mirror += o.mirror;
        self.scattered += o.scattered;
    }
}

/// A point on a surface that a path reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// Which sample the path belongs to.
    pub path: u32,
    pub position: DVec3,
    /// Bound of the position's error per axis.
    pub error: DVec3,
    /// Unit, turned to the side the ray came from.
    pub normal: DVec3,
    /// Unit shading normal on the same side.
    pub shading_normal: DVec3,
    /// Direction the ray came along, not unit.
    pub dir: DVec3,
    pub material: u32,
    /// What of this point's radiance reaches the eye.
    pub throughput: DVec3,
}

/// Working memory of one thread, and what was counted in it.
#[derive(Debug)]
pub struct Workspace<S> {
    /// Live rays traced.
    pub rays: RayCounts,
    /// What the engine counted, if [`Settings::count`] or [`Settings::cost`] is set.
    pub counters: Counters,
    pub(super) scratch: Scratch,
    pub(super) hits: Hits<S>,
    pub(super) vertices: Vec<Vertex>,
    pub(super) batch: Rays<S>,
    pub(super) occluded: Vec<u8>,
    pub(super) paths: PathMemory<S>,
    block: Rays<S>,
    block_hits: Hits<S>,
}

impl<S: Real> Default for Workspace<S> {
    fn default() -> Self {
        Self {
            rays: RayCounts::default(),
            counters: Counters::default(),
            scratch: Scratch::default(),
            hits: Hits::new(0),
            vertices: Vec::new(),
            batch: Rays::new(0),
            occluded: Vec::new(),
            paths: PathMemory::default(),
            block: Rays::new(0),
            block_hits: Hits::new(0),
        }
    }
}

impl<S: Real> Workspace<S> {
    /// Takes what [`Integrator::Path`] counted.
    pub fn take_path_stats(&mut self) -> PathStats {
        std::mem::take(&mut self.paths.stats)
    }
}

/// Everything a batch of rays needs to become colours.
pub struct Shader<'a, S: Real> {
    pub(super) world: &'a World<S>,
    pub(super) engine: &'a dyn Engine<S>,
    pub(super) lights: Vec<Light>,
    /// Whether lights cast shadows: those of a scene do, the default light does not.
    pub(super) shadows: bool,
    pub(super) background: DVec3,
    pub(super) ambient: DVec3,
    pub(super) settings: Settings,
    /// Length of occlusion rays, scene units.
    pub(super) ao_length: f64,
    materials: &'a [Material],
    default_material: Material,
    rt: Option<Rt>,
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
        let paths = (settings.integrator == Integrator::Path)
            .then(|| Paths::new(world, description, engine, default_light, &settings));
        let lights = if description.lights.is_empty() { vec![default_light] } else { description.lights.clone() };
        Self {
            world,
            engine,
            lights,
            shadows: !description.lights.is_empty(),
            background: description.background,
            ambient: description.ambient,
            settings,
            ao_length: if ao_length.is_nan() { f64::INFINITY } else { ao_length },
            materials: &description.materials,
            default_material: Material::default(),
            rt: None,
            paths,
        }
    }

    /// The same with the lighting model of [`Integrator::Rt`], seen by `camera`: of use for BRL-CAD databases only.
    #[must_use]
    pub fn with_rt(mut self, description: &Description, camera: &Camera) -> Self {
        self.rt = description.looks.as_ref().map(|looks| Rt::new(looks, camera));
        self
    }

    /// What each ray of the primary batch `rays` sees, into `out` (made as long as the batch). Ray `i` belongs to
    /// pixel `pixels[i]` and is that pixel's sample number `sample`. Dead rays give [`Sample::MISS`].
    pub fn shade(
        &self,
        rays: &Rays<S>,
        pixels: &[(u32, u32)],
        sample: u32,
        work: &mut Workspace<S>,
        out: &mut Vec<Sample>,
    ) {
        out.clear();
        out.resize(rays.len(), Sample::MISS);
        work.rays.primary += rays.live_count() as u64;
        if let (Integrator::Rt, Some(rt)) = (self.settings.integrator, &self.rt) {
            return self.rt(rt, rays, work, out);
        }
        if let Some(paths) = &self.paths {
            return paths.shade(rays, pixels, sample, work, out);
        }
        if self.settings.cost {
            self.trace_blocks(rays, work, out);
        } else {
            self.intersect(rays, work);
        }
        work.vertices.clear();
        for i in 0..rays.len() {
            if !work.hits.is_hit(i) {
                continue;
            }
            let vertex = self.vertex(rays, &work.hits, i, i as u32, DVec3::ONE);
            work.vertices.push(vertex);
            let seen = &mut out[i];
            seen.alpha = 1.0;
            seen.distance = work.hits.t[i].to_f64() * vertex.dir.length();
            seen.position = vertex.position;
            seen.normal = vertex.normal;
            seen.shading_normal = vertex.shading_normal;
            seen.material = vertex.material;
            seen.albedo = self.material(vertex.material).diffuse;
            (seen.inst, seen.prim) = (work.hits.inst[i], work.hits.prim[i]);
        }
        match self.settings.integrator {
            // Without regions to look at, `rt`'s model has nothing to say.
            Integrator::Whitted | Integrator::Rt | Integrator::Path => self.whitted(rays, work, out),
            Integrator::Ao => self.ambient_occlusion(pixels, sample, work, out),
            Integrator::Normals => super::views::normals(out),
            Integrator::Depth => super::views::depth(out),
            Integrator::Cost => super::views::cost(out),
        }
    }

    /// Closest hits of `rays` into `work.hits`.
    pub(super) fn intersect(&self, rays: &Rays<S>, work: &mut Workspace<S>) {
        let counters = self.settings.count.then_some(&mut work.counters);
        self.engine.intersect(self.world, rays, &mut work.hits, &mut work.scratch, counters);
    }

    /// Whether each ray of `work.batch` is occluded, into `work.occluded`.
    pub(super) fn occlude(&self, work: &mut Workspace<S>) {
        let counters = self.settings.count.then_some(&mut work.counters);
        self.engine.occluded(self.world, &work.batch, &mut work.occluded, &mut work.scratch, counters);
    }

    /// As [`Self::intersect`], 16 rays at a time with counting kernels, which gives each block of 4 x 4 pixels its
    /// own number of node visits.
    fn trace_blocks(&self, rays: &Rays<S>, work: &mut Workspace<S>, out: &mut [Sample]) {
        work.hits.reset(rays.len());
        for first in (0..rays.len()).step_by(COST_BLOCK) {
            let count = COST_BLOCK.min(rays.len() - first);
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

    /// The surface point that ray `i` hit.
    pub(super) fn vertex(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize, path: u32, throughput: DVec3) -> Vertex {
        let org = DVec3::from(rays.org(i).map(S::to_f64));
        let dir = DVec3::from(rays.dir(i).map(S::to_f64));
        let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
        let surface = self.world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
        let facing = if surface.ng.dot(dir) > 0.0 { -surface.ng } else { surface.ng };
        // A triangle too thin for a normal is seen face on.
        let normal = if facing.is_finite() { facing } else { -dir.normalize_or_zero() };
        let shading_normal = if surface.ng.dot(dir) > 0.0 { -surface.ns } else { surface.ns };
        let shading_normal = if surface.ng == normal || surface.ng == -normal { shading_normal } else { normal };
        let error = position_error::<S>(org, dir, t, surface.position, surface.magnitude);
        let (position, material) = (surface.position, surface.material);
        Vertex { path, position, error, normal, shading_normal, dir, material, throughput }
    }

    /// Material number `id` of the description.
    pub(super) fn material(&self, id: u32) -> &Material {
        self.materials.get(id as usize).unwrap_or(&self.default_material)
    }
}

impl Vertex {
    /// Origin of a ray that leaves the point to the side of its normal.
    pub fn leave<S: Real>(&self) -> [S; 3] {
        offset_origin(self.position, self.error, self.normal)
    }
}
