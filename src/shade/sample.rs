//! What primary rays see, and how many rays that took.

use glam::DVec3;

use crate::ray::INVALID_ID;

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
    /// Of a sum of samples: sum of their squared brightness. Of a pixel: variance of its mean brightness.
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

    /// Adds light that a path met after `bounce` scatterings, if it is a number.
    pub(super) fn shine(&mut self, bounce: u32, light: DVec3) {
        if light != DVec3::ZERO && light.is_finite() {
            self.radiance += light;
            if bounce <= 1 {
                self.direct += light;
            }
        }
    }
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
