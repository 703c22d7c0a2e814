//! From a camera to primary rays and to the place of the default light: where this floor touches `camera`.

use glam::DVec3;
use rayon::prelude::*;

use crate::camera::{Camera, FILE_TILE, MAX_PIXELS, PixelRect, SubPixel, Tiling, aim_tile, fill_tile};
use crate::error::{Error, Result};
use crate::lanes::Real;
use crate::measure::raysets::{RayKind, Setting, Starts, light_for, scatter};
use crate::measure::timing::Made;
use crate::ray::{Hits, Pencil, Rays};
use crate::scene::description::{CameraDescription, Description};
use crate::scene::world::World;
use crate::trace::{Engine, Engines, Scratch, engine};

/// Picks the camera once the bounds of the scene (lower and upper corner, `None` if nothing is bounded) and the width and
/// height of the picture are known.
pub type Framing<'a> = &'a (dyn Fn(Option<(DVec3, DVec3)>, (u32, u32)) -> Result<Eye> + Sync);

/// A camera ready to make rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// What makes them.
    pub camera: Camera,
    /// What its owner calls up, of any length: the default light is there. The camera's own is at right angles to where it looks.
    pub up: DVec3,
}

impl Eye {
    /// The camera that `camera` means, for pictures of `size` (width, height).
    ///
    /// # Errors
    /// Those of [`Camera::new`].
    pub fn new(camera: &CameraDescription, size: (u32, u32)) -> Result<Self> {
        let aspect = f64::from(size.0) / f64::from(size.1);
        Ok(Self { camera: Camera::new(camera, aspect)?, up: camera.up })
    }
}

/// A scene seen by a camera: primary rays, where they hit, and what secondary rays need to know.
pub struct View {
    /// Primary rays in ray-file order, one batch per tile.
    pub primary: Vec<Rays<f32>>,
    /// Primary hits.
    pub starts: Starts,
    /// Light, diagonal and seed.
    pub setting: Setting,
    /// Pixels of the picture.
    pub pixels: u64,
    camera: Camera,
    tiling: Tiling,
}

impl View {
    /// Looks at `world` (compiled from `description`) through `camera` with `size` (width, height) pixels; the
    /// primary rays are traced by the `scalar` engine on the current rayon pool.
    ///
    /// # Errors
    /// Those of `camera`; sizes that no picture has, and more than [`MAX_PIXELS`] pixels: all their rays are held at once.
    pub fn new<S: Engines>(
        world: &World<S>,
        description: &Description,
        camera: Framing<'_>,
        size: (u32, u32),
        seed: u64,
    ) -> Result<Self> {
        let tiling = Tiling::new(size.0, size.1, FILE_TILE)?;
        let pixels = u64::from(size.0) * u64::from(size.1);
        if pixels > MAX_PIXELS {
            return Err(Error::Usage(format!("more than {MAX_PIXELS} pixels in one film")));
        }
        let bounds = world.bounds();
        let Eye { camera, up } = camera(bounds, size)?;
        let primary = primary_rays(&camera, &tiling);
        let scalar = engine::<S>("scalar")?;
        let starts = Starts::trace(world, scalar, &primary);
        // A scene of nothing but half-spaces has no diagonal; its lengths are then taken as unit length.
        let diagonal = bounds.map_or(1.0, |(lo, hi)| (hi - lo).length());
        let up = up.normalize_or_zero();
        let clearance = clearance(world, scalar, camera.eye, up);
        let light = light_for(&description.lights, camera.eye, up, diagonal, clearance);
        let setting = Setting { light, diagonal, seed };
        Ok(Self { primary, starts, setting, pixels, camera, tiling })
    }

    /// Makes the primary rays of tile `tile`, batch `tile` of [`Self::primary`]: of a camera with an eye point only where
    /// they go, else `rays` themselves.
    pub fn make<S: Real>(&self, tile: usize, pencil: &mut Pencil, rays: &mut Rays<S>) -> Made {
        let whole = whole(&self.tiling);
        if aim_tile(&self.camera, &self.tiling, tile as u32, whole, SubPixel::Anchor, pencil) {
            return Made::Pencil;
        }
        make(&self.camera, &self.tiling, tile as u32, rays);
        Made::Rays
    }

    /// All that [`Self::make`] makes, one batch per tile, on the current rayon pool. In f64 these are not those of [`Self::primary`],
    /// which are as a file of rays has them.
    pub fn made<S: Real>(&self) -> Vec<Rays<S>> {
        primary_rays(&self.camera, &self.tiling)
    }

    /// The rays of class `kind` in `world`, on the current rayon pool: a tile per batch, or as many scattered rays
    /// as the picture has pixels. Hits on the way are those of the `scalar` engine.
    pub fn rays<S: Engines>(&self, world: &World<S>, kind: RayKind) -> Result<Vec<Rays<f32>>> {
        Ok(match (kind, kind.parent()) {
            (RayKind::Scatter, _) => scatter(&world.assembly, self.pixels, self.setting.seed),
            (_, None) => self.primary.clone(),
            (_, Some(RayKind::Primary)) => self.starts.rays(kind, &self.setting),
            (_, Some(bounce)) => {
                let before = self.rays(world, bounce)?;
                Starts::trace(world, engine::<S>("scalar")?, &before).rays(kind, &self.setting)
            }
        })
    }
}

/// The rays of `camera` through the picture's pixels, each where the camera samples it, in ray-file order.
fn primary_rays<S: Real>(camera: &Camera, tiling: &Tiling) -> Vec<Rays<S>> {
    let tile = |tile| {
        let mut rays = Rays::new(0);
        make(camera, tiling, tile, &mut rays);
        rays
    };
    (0..tiling.tiles()).into_par_iter().map(tile).collect()
}

fn make<S: Real>(camera: &Camera, tiling: &Tiling, tile: u32, rays: &mut Rays<S>) {
    fill_tile(camera, tiling, tile, whole(tiling), SubPixel::Anchor, rays);
}

fn whole(tiling: &Tiling) -> PixelRect {
    PixelRect { x0: 0, y0: 0, x1: tiling.width(), y1: tiling.height() }
}

/// Distance from `org` along unit `dir` to the first surface; infinite if there is none.
fn clearance<S: Real>(world: &World<S>, engine: &dyn Engine<S>, org: DVec3, dir: DVec3) -> f64 {
    let mut rays = Rays::new(1);
    let (zero, end) = (S::from_f64(0.0), S::from_f64(f64::INFINITY));
    rays.set(0, org.to_array().map(S::from_f64), dir.to_array().map(S::from_f64), zero, end);
    let mut hits = Hits::new(1);
    engine.intersect(world, &rays, &mut hits, &mut Scratch::default(), None);
    hits.t[0].to_f64()
}
