//! Compiling: one tree per object, the upper tree over instances.

use std::sync::Arc;
use std::time::Instant;

use super::facets::Facets;
use super::rounding::Rounding;
use super::runs::{self, Runs};
use super::{Kinds, Object, Totals, World, instances, joined, primitives, successor};
use crate::bvh::BuildSettings;
use crate::error::Result;
use crate::lanes::Real;
use crate::scene::assembly::Assembly;
use crate::scene::description::Description;

/// A scalar type that worlds are compiled for. What compiles them is not generic: a program that calls it would otherwise
/// compile the builders of trees itself, with its own settings.
pub trait Compiles: Real {
    #[doc(hidden)]
    fn world(description: &Description, settings: BuildSettings, before: Option<&World<Self>>) -> Result<World<Self>>;
}

impl Compiles for f32 {
    #[inline(never)]
    fn world(description: &Description, settings: BuildSettings, before: Option<&World<f32>>) -> Result<World<f32>> {
        World::new(description, settings, before)
    }
}

impl Compiles for f64 {
    #[inline(never)]
    fn world(description: &Description, settings: BuildSettings, before: Option<&World<f64>>) -> Result<World<f64>> {
        World::new(description, settings, before)
    }
}

impl<S: Compiles> World<S> {
    /// Compiles `description` with trees as `settings` (or a [`Preset`](crate::bvh::Preset)) say, on the current rayon pool.
    ///
    /// # Errors
    /// Those of [`Assembly::new`], which checks all numbers by which items name groups, meshes, solids and materials, and
    /// those inside of meshes.
    pub fn compile(description: &Description, settings: impl Into<BuildSettings>) -> Result<Self> {
        Self::compile_after(description, settings, None)
    }

    /// As [`Self::compile`], but objects whose geometry `before`, compiled with the same settings, has too are copied from
    /// it. The world is the same, to the last bit.
    ///
    /// # Errors
    /// Those of [`Assembly::new`].
    pub fn compile_after(
        description: &Description,
        settings: impl Into<BuildSettings>,
        before: Option<&Self>,
    ) -> Result<Self> {
        S::world(description, settings.into(), before)
    }
}

impl<S: Real> World<S> {
    fn new(description: &Description, settings: BuildSettings, before: Option<&Self>) -> Result<Self> {
        let start = Instant::now();
        let assembly = Arc::new(Assembly::new(description)?);
        let joined = description.joins.then(|| joined::join(&assembly, S::EPSILON.to_f64())).flatten();
        let (traced, names) = match joined {
            Some((traced, names)) => (Arc::new(traced), Some(names)),
            None => (assembly.clone(), None),
        };
        let mut counts = Vec::with_capacity(traced.objects.len());
        let mut objects = Vec::with_capacity(traced.objects.len());
        for object in &traced.objects {
            let known = before.and_then(|world| Some((world, successor::find(object, &world.traced.objects)?)));
            let (built, count) = match known {
                Some((world, same)) => (world.objects[same].clone(), world.counts[same]),
                None => primitives::build(object, settings),
            };
            objects.push(built);
            counts.push(count);
        }
        let instances = instances::all(&traced.placements, &objects);
        let (top, top_leaves, unbounded_instances) = instances::upper_tree(&instances, settings.preset);
        let materials = runs::by_name(description);
        let runs: Vec<Runs> = assembly.objects.iter().map(|o| Runs::new(o, &materials)).collect();
        let facets = assembly.objects.iter().zip(&runs).map(|(o, runs)| Facets::new(o, runs)).collect();
        let rounding = Rounding::of(&traced.placements, &objects);
        let kinds = objects.iter().map(Object::kinds).fold(Kinds::default(), |a, b| Kinds {
            triangles: a.triangles || b.triangles,
            shapes: a.shapes || b.shapes,
            others: a.others || b.others,
            large: a.large || b.large,
            sorting: a.sorting || b.sorting,
        });
        let totals = Totals::of(&objects);
        let build_seconds = start.elapsed().as_secs_f64();
        Ok(Self {
            assembly,
            traced,
            names,
            objects,
            instances,
            top,
            top_leaves,
            unbounded_instances,
            rounding,
            kinds,
            totals,
            runs,
            facets,
            counts,
            build_seconds,
        })
    }
}
