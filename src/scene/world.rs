//! The world: flat arrays that engines trace. (being built)

use glam::DVec3;

use super::assembly::Assembly;
use super::description::Description;
use crate::error::Result;
use crate::lanes::Real;

/// How much time a build may spend on the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Quick build, slower rays.
    Fast,
    /// The default.
    #[default]
    Balanced,
    /// Slow build, fastest rays.
    Best,
}

/// Compiled scene in precision `S`.
#[derive(Debug)]
pub struct World<S> {
    /// What prim and inst numbers mean.
    pub assembly: Assembly,
    marker: std::marker::PhantomData<S>,
}

/// Counts and sizes of a world, for `info` and `trace --json`.
#[derive(Clone, Debug, Default)]
pub struct WorldStats {
    /// Distinct objects.
    pub objects: u64,
    /// Instances.
    pub instances: u64,
    /// Primitives stored.
    pub prims: u64,
    /// Primitives counted once per instance.
    pub instanced_prims: u64,
    /// Triangles dropped because a vertex is not finite (or overflows the precision).
    pub dropped_nonfinite: u64,
    /// Triangles dropped because their area is zero.
    pub dropped_degenerate: u64,
    /// Inner nodes over all trees.
    pub nodes: u64,
    /// Leaves over all trees.
    pub leaves: u64,
    /// Deepest tree, inner nodes on a path.
    pub depth: u32,
    /// SAH cost of the largest object's tree (node 1, leaf ceil(n/8)).
    pub sah_cost: f64,
    /// Bytes of nodes.
    pub node_bytes: u64,
    /// Bytes of primitive storage.
    pub prim_bytes: u64,
    /// Seconds spent compiling (trees and storage).
    pub build_seconds: f64,
}

/// A hit point with what shading needs, f64, world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Hit point.
    pub position: DVec3,
    /// Geometric normal, unit, as wound or outward; not turned towards the ray.
    pub ng: DVec3,
    /// Index into the description's materials.
    pub material: u32,
}

impl<S: Real> World<S> {
    /// Compiles `description` with tree quality `preset`, on the current rayon pool.
    ///
    /// # Errors
    /// Those of [`Assembly::new`].
    pub fn compile(description: &Description, preset: Preset) -> Result<Self> {
        let _ = preset;
        Ok(Self { assembly: Assembly::new(description)?, marker: std::marker::PhantomData })
    }

    /// Finite world bounds (lower and upper corner) of all bounded geometry; `None` if there is none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        unimplemented!()
    }

    /// Counts and sizes.
    pub fn stats(&self) -> WorldStats {
        unimplemented!()
    }

    /// Position, geometric normal and material of a hit (all f64).
    ///
    /// `org`, `dir`: the ray in world space; `t`, `u`, `v`, `prim`, `inst`: a hit of an engine of this world.
    pub fn surface(&self, org: DVec3, dir: DVec3, t: f64, u: f64, v: f64, prim: u32, inst: u32) -> Surface {
        let _ = (org, dir, t, u, v, prim, inst);
        unimplemented!()
    }
}
