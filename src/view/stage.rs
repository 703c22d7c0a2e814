//! A compiled scene as a viewer sees it, whatever its precision: pictures, heat maps, what a pixel hits.

use std::time::Instant;

use glam::DVec3;

use super::heat::{self, Heat};
use crate::camera::{Camera, SubPixel, fill_pixels};
use crate::error::Result;
use crate::ray::{Counters, Hits, Rays};
use crate::render::progressive::{Progressive, Viewer};
use crate::render::{Progress, RenderOptions, RenderOutput};
use crate::scene::brlcad::view::View;
use crate::scene::description::{CameraDescription, Description};
use crate::scene::world::World;
use crate::shade::Shades;
use crate::trace::{Scratch, engine};

/// What is looked at, and how.
#[derive(Clone, Debug)]
pub struct Look {
    /// From where.
    pub camera: CameraDescription,
    /// A camera that stands for a view of BRL-CAD's `rt`, and that view: until something moves it, pixels are sampled where
    /// `rt` samples them.
    pub rt: Option<(CameraDescription, View)>,
    /// Size, integrator, engine, samples.
    pub options: RenderOptions,
    /// Edge of the first blocks, pixels.
    pub start: u32,
    /// A map of the engine's work instead of the integrator's picture.
    pub heat: Option<Heat>,
}

impl Look {
    /// The camera ready to make rays.
    ///
    /// # Errors
    /// Those of [`Camera::new`].
    pub fn camera(&self) -> Result<Camera> {
        let aspect = f64::from(self.options.width) / f64::from(self.options.height);
        match &self.rt {
            Some((camera, view)) if self.camera == *camera => Camera::of_view(view, aspect),
            _ => Camera::new(&self.camera, aspect),
        }
    }
}

/// What lies under a pixel.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Picked {
    /// Ray parameter.
    pub t: f64,
    /// Distance from the ray's origin, scene units.
    pub distance: f64,
    /// Instance number.
    pub instance: u32,
    /// Name of the object's group in the scene; empty for the scene's own items.
    pub object: String,
    /// Primitive number in the object.
    pub primitive: u32,
    /// Name of the material.
    pub material: String,
    /// Hit point, world space.
    pub position: [f64; 3],
    /// Unit geometric normal, world space, as wound or outward.
    pub normal: [f64; 3],
    /// Node visits of the single ray.
    pub nodes: u64,
    /// Leaves it visited.
    pub leaves: u64,
    /// Primitives it was tested against.
    pub tests: u64,
}

/// A scene that is ready to be seen.
pub trait Stage: Send + Sync {
    /// What a person wrote.
    fn description(&self) -> &Description;
    /// Box of all bounded geometry, lower and upper corner.
    fn bounds(&self) -> Option<(DVec3, DVec3)>;
    /// Engines that can trace it.
    fn engines(&self) -> Vec<&'static str>;
    /// The engine that is called `name`, which may stand for another one (`auto`): its name, the lanes of its vectors, and how many rays it
    /// traces together; `None` if there is none.
    fn engine(&self, name: &str) -> Option<(&'static str, [u32; 2])>;
    /// Seconds that building took.
    fn build_seconds(&self) -> f64;
    /// A picture on the current rayon pool; see [`Progressive`].
    ///
    /// # Errors
    /// Options out of range, an unknown engine, a camera that cannot be.
    fn render(&self, look: &Look, progress: &dyn Progress, viewer: &dyn Viewer) -> Result<RenderOutput>;
    /// What the ray through the middle of pixel (x, y) hits first.
    ///
    /// # Errors
    /// As [`Self::render`].
    fn pick(&self, look: &Look, x: u32, y: u32) -> Result<Option<Picked>>;
    /// The world, for who builds its successor: [`World`] of `f32` or `f64`.
    fn as_any(&self) -> &dyn std::any::Any;
}

/// A scene in precision `S`.
pub struct Scene<S> {
    /// What a person wrote.
    pub description: Description,
    /// What is traced.
    pub world: World<S>,
}

impl<S: Shades> Stage for Scene<S>
where
    World<S>: Send + Sync,
{
    fn description(&self) -> &Description {
        &self.description
    }

    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.world.bounds()
    }

    fn engines(&self) -> Vec<&'static str> {
        S::engines().iter().map(|e| e.name()).collect()
    }

    fn engine(&self, name: &str) -> Option<(&'static str, [u32; 2])> {
        engine::<S>(name).ok().map(|engine| (engine.name(), [engine.width(), engine.lanes()].map(|n| n as u32)))
    }

    fn build_seconds(&self) -> f64 {
        self.world.stats().build_seconds
    }

    fn render(&self, look: &Look, progress: &dyn Progress, viewer: &dyn Viewer) -> Result<RenderOutput> {
        let engine = engine::<S>(&look.options.engine)?;
        let camera = look.camera()?;
        if let Some(map) = look.heat {
            return heat::render(map, engine, &self.world, &camera, &look.options, progress);
        }
        let clock = Instant::now();
        let (world, options) = (&self.world, &look.options);
        let mut picture = Progressive::new(engine, world, &self.description, &camera, options, look.start)?;
        picture.run(progress, viewer);
        let output = picture.finish();
        Ok(RenderOutput { seconds: clock.elapsed().as_secs_f64(), ..output })
    }

    fn pick(&self, look: &Look, x: u32, y: u32) -> Result<Option<Picked>> {
        let (camera, options) = (look.camera()?, &look.options);
        options.check()?;
        if x >= options.width || y >= options.height {
            return Ok(None);
        }
        let mut rays = Rays::<S>::new(0);
        fill_pixels(&camera, (options.width, options.height), &[(x, y)], SubPixel::Anchor, &mut rays);
        let (mut hits, mut counters) = (Hits::new(1), Counters::default());
        let single = engine::<S>("scalar")?;
        single.intersect(&self.world, &rays, &mut hits, &mut Scratch::default(), Some(&mut counters));
        if !hits.is_hit(0) {
            return Ok(None);
        }
        let [org, dir] = [rays.org(0), rays.dir(0)].map(|v| DVec3::from(v.map(S::to_f64)));
        let (t, u, v) = (hits.t[0].to_f64(), hits.u[0].to_f64(), hits.v[0].to_f64());
        let (prim, inst) = (hits.prim[0], hits.inst[0]);
        let surface = self.world.surface(org, dir, t, u, v, prim, inst);
        let assembly = &self.world.assembly;
        let object = &assembly.objects[assembly.placements[inst as usize].object as usize];
        let material = self.description.materials.get(surface.material as usize);
        Ok(Some(Picked {
            t,
            distance: t * dir.length(),
            instance: inst,
            object: object.name.clone(),
            primitive: prim,
            material: material.map_or_else(String::new, |m| m.name.clone()),
            position: surface.position.to_array(),
            normal: surface.ng.to_array(),
            nodes: counters.nodes,
            leaves: counters.leaves,
            tests: counters.prims,
        }))
    }

    fn as_any(&self) -> &dyn std::any::Any {
        &self.world
    }
}
