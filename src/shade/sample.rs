//! What primary rays see, and how many rays that took.

use glam::DVec3;

use super::colors::Colors;
use crate::ray::INVALID_ID;

/// The colour that one primary ray saw; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgba {
    /// Radiance or the integrator's value, linear Rec.709.
    pub radiance: DVec3,
    /// Whether the radiance is opaque: 1 where something was hit or the integrator shows what lies behind, else 0.
    pub alpha: f64,
}

/// What else one primary ray saw. For a miss: infinite distance, invalid ids, zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
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
    /// Instance number.
    pub inst: u32,
    /// Primitive number.
    pub prim: u32,
    /// Node visits per ray, if counted: packets share visits, so this is the number of visits that the engine made
    /// for the block of rays around this one, divided by the block's live rays. A block is as many rays as the engine traces
    /// together ([`crate::trace::Engine::lanes`]), 4 x 4 at least and a tile of the picture at most.
    pub nodes: f64,
}

impl FirstHit {
    /// Of a ray that hit nothing.
    pub const NONE: Self = Self {
        distance: f64::INFINITY,
        position: DVec3::ZERO,
        normal: DVec3::ZERO,
        shading_normal: DVec3::ZERO,
        albedo: DVec3::ZERO,
        direct: DVec3::ZERO,
        material: INVALID_ID,
        inst: INVALID_ID,
        prim: INVALID_ID,
        nodes: 0.0,
    };
}

/// What the rays of a primary batch saw, ray by ray. Two lists, as most pictures show colours only.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Colours.
    pub colors: Colors,
    /// What else; empty if nothing else was wanted.
    pub hits: Vec<FirstHit>,
}

impl Samples {
    /// Those of `count` rays that saw nothing yet, with or without first hits.
    pub(super) fn open(&mut self, count: usize, with_hits: bool) {
        self.colors.open(count);
        self.open_hits(count, with_hits);
    }

    /// The same with colours that are unspecified, see [`Colors::prepare`].
    pub(super) fn prepare(&mut self, count: usize, with_hits: bool) {
        self.colors.prepare(count);
        self.open_hits(count, with_hits);
    }

    fn open_hits(&mut self, count: usize, with_hits: bool) {
        self.hits.clear();
        self.hits.resize(if with_hits { count } else { 0 }, FirstHit::NONE);
    }

    /// Adds light that the path of ray `i` met after `bounce` scatterings, if it is a number.
    pub(super) fn shine(&mut self, i: usize, bounce: u32, light: DVec3) {
        if light != DVec3::ZERO && light.is_finite() {
            self.add(i, bounce <= 1, light);
        }
    }

    /// Adds light to what ray `i` sees, with or without detours.
    #[inline]
    pub(super) fn add(&mut self, i: usize, is_direct: bool, light: DVec3) {
        self.colors.add(i, light);
        if is_direct && let Some(hit) = self.hits.get_mut(i) {
            hit.direct += light;
        }
    }
}

/// Live rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// Towards lights (any-hit).
    pub shadow: u64,
    /// Ambient occlusion (any-hit).
    pub occlusion: u64,
    /// Mirror reflections.
    pub mirror: u64,
    /// Refractions.
    pub refracted: u64,
    /// Scattered along paths.
    pub scattered: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.occlusion + self.mirror + self.refracted + self.scattered
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.primary += o.primary;
        self.shadow += o.shadow;
        self.occlusion += o.occlusion;
        self.mirror += o.mirror;
        self.refracted += o.refracted;
        self.scattered += o.scattered;
    }
}
