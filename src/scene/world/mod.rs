//! The world: flat arrays that engines trace, compiled once from a description.
//!
//! An object is a tree over blocks of primitives in one space; an instance places an object. A world whose only
//! instance is the identity is traced without an upper tree.

mod compile;
mod facets;
mod instances;
mod joined;
mod names;
mod primitives;
mod rounding;
mod runs;
mod solids;
mod successor;
mod surface;
mod totals;
mod uv;

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

pub use crate::bvh::{BuildSettings, Preset};
pub use compile::Compiles;
pub use facets::Met;
pub use names::Names;
pub use rounding::Rounding;
pub use runs::Place;
pub use surface::Surface;
pub use totals::Totals;

use self::facets::Facets;
use self::runs::Runs;
use super::assembly::{Assembly, Placement};
use super::description::Shape;
use crate::bvh::Tree;
use crate::csg;
use crate::lanes::Real;
use crate::math::{Aabb, Affine};
use crate::shape::{Block, Placed, Triangle, WorldSphere, sieve};

/// Leaf classes of object trees: what a block holds. [`Class::ALL`]`[i] as u8 == i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Class {
    /// Triangles ([`Object::triangles`]).
    Triangle,
    /// World-space spheres ([`Object::spheres`]).
    WorldSphere,
    /// Canonical shapes under transforms ([`Object::placed`], one list per class).
    Sphere,
    /// Discs.
    Disc,
    /// Boxes.
    Cuboid,
    /// Cylinders.
    Cylinder,
    /// Cones.
    Cone,
    /// Half-spaces: without bounds, kept in [`Object::unbounded`].
    HalfSpace,
    /// Trees of solids ([`Object::solids`]).
    Solids,
}

impl Class {
    /// All classes by number.
    pub const ALL: [Self; 9] = [
        Self::Triangle,
        Self::WorldSphere,
        Self::Sphere,
        Self::Disc,
        Self::Cuboid,
        Self::Cylinder,
        Self::Cone,
        Self::HalfSpace,
        Self::Solids,
    ];

    fn of(shape: &Shape) -> Self {
        match shape {
            Shape::Sphere => Self::Sphere,
            Shape::HalfSpace => Self::HalfSpace,
            Shape::Disc => Self::Disc,
            Shape::Cuboid => Self::Cuboid,
            // A cone that does not narrow is a cylinder.
            Shape::Cone { top, .. } if *top >= 1.0 => Self::Cylinder,
            Shape::Cylinder => Self::Cylinder,
            Shape::Cone { .. } => Self::Cone,
        }
    }
}

/// Geometry in one space with its tree.
#[derive(Clone, Debug)]
pub struct Object<S> {
    /// Tree whose leaves are blocks; the leaf class is a [`Class`].
    pub tree: Tree<S>,
    /// Blocks of triangles.
    pub triangles: Vec<Block<S, { Triangle::FIELDS }>>,
    /// Blocks of world-space spheres.
    pub spheres: Vec<Block<S, { WorldSphere::FIELDS }>>,
    /// Blocks of transformed shapes by class; the lists of triangles, spheres and half-spaces are empty.
    pub placed: [Vec<Block<S, { Placed::FIELDS }>>; Class::ALL.len()],
    /// Half-spaces: tested for every ray.
    pub unbounded: Vec<Block<S, { Placed::FIELDS }>>,
    /// Trees of solids.
    pub solids: Vec<PlacedSolid<S>>,
    /// Blocks of bounded trees of solids.
    pub solid_blocks: Vec<SolidBlock>,
    /// Trees of solids without bounds: tested for every ray.
    pub unbounded_solids: SolidBlock,
    /// Those of the blocks that are one simple solid.
    pub soles: Vec<csg::Sole<S>>,
    /// The others of the blocks: indices into [`Object::solids`].
    pub swept: Vec<u32>,
}

/// Some of an object's solids.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SolidBlock {
    /// Part of [`Object::soles`].
    pub soles: Range<u32>,
    /// Part of [`Object::swept`].
    pub swept: Range<u32>,
}

impl SolidBlock {
    /// How many.
    pub fn len(&self) -> usize {
        self.soles.len() + self.swept.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A compiled tree of solids (or a part of one that touches no other part).
#[derive(Clone, Debug)]
pub struct PlacedSolid<S> {
    /// What is traced.
    pub solid: csg::Solid<S>,
    /// Primitive number of leaf 0.
    pub first_prim: u32,
}

/// What there is besides triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Triangles, those of solids among them: what asks for a packet's shear.
    pub triangles: bool,
    /// Shapes with bounds.
    pub shapes: bool,
    /// Half-spaces or trees of solids.
    pub others: bool,
    /// Triangles with coordinates so large (above 2^24) that all are left to the formula that engines have in common.
    pub large: bool,
    /// What repays sorting rays that part: solids of many leaves, or a tree that is large for narrow lanes.
    pub sorting: bool,
}

impl Kinds {
    /// Whether something asks for a packet's shear where streams test meshes by a test that does not.
    pub fn ask_for_shear(&self) -> bool {
        self.large || self.others
    }
}

/// Leaves of solids, on average, from which on sorted rays are traced faster (results/NOTES.md).
const MANY_LEAVES: usize = 8;
/// The same for nodes of a tree, in `f32`.
const MANY_NODES: usize = 16;

/// An object placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instance<S> {
    /// Index into [`World::objects`].
    pub object: u32,
    /// Object space is world space: the packet is used as it is.
    pub identity: bool,
    /// World to object space.
    pub to_local: Affine<S>,
    /// World box, widened by the rounding of the map; infinite if the object has no bounds.
    pub bounds: Aabb<S>,
}

/// Compiled scene in precision `S`.
#[derive(Debug)]
pub struct World<S> {
    /// What the prim and inst numbers of hits mean.
    pub assembly: Arc<Assembly>,
    /// What is traced: the assembly, or one that has some of its placements as one object.
    pub traced: Arc<Assembly>,
    /// What engines call hits before they hand them out, where that is not what the assembly calls them.
    pub names: Option<Names>,
    /// Distinct objects, parallel to those traced.
    pub objects: Vec<Object<S>>,
    /// Instances, parallel to the placements traced.
    pub instances: Vec<Instance<S>>,
    /// Tree over bounded instances, one in a leaf ([`World::top_leaves`]).
    pub top: Tree<S>,
    /// Instance numbers of the upper tree's leaves.
    pub top_leaves: Vec<u32>,
    /// Instances without bounds.
    pub unbounded_instances: Vec<u32>,
    /// What instances' maps do to rounding errors.
    pub rounding: Rounding,
    /// What objects are made of, taken together.
    pub kinds: Kinds,
    /// What objects come to.
    pub totals: Totals,
    /// Per object of the assembly: its runs.
    runs: Vec<Runs>,
    /// The same: normals of its shapes and solids.
    facets: Vec<Facets<S>>,
    /// By object traced.
    counts: Vec<Counts>,
    build_seconds: f64,
}

/// What compiling dropped of an object.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    nonfinite: u64,
    degenerate: u64,
    singular: u64,
}

impl Counts {
    fn all(&self) -> u64 {
        self.nonfinite + self.degenerate + self.singular
    }
}

/// Counts and sizes of a world, for `info` and `trace --json`.
#[derive(Clone, Debug, Default)]
pub struct WorldStats {
    /// Distinct objects.
    pub objects: u64,
    /// Instances.
    pub instances: u64,
    /// Those of them that are traced as one object.
    pub joined: u64,
    /// Primitives stored.
    pub prims: u64,
    /// Primitives counted once per instance, without those that were dropped.
    pub instanced_prims: u64,
    /// Triangles dropped because a vertex is not finite (or overflows the precision).
    pub dropped_nonfinite: u64,
    /// Triangles dropped because their area is zero.
    pub dropped_degenerate: u64,
    /// Shapes dropped because their transform cannot be inverted in this precision.
    pub dropped_singular: u64,
    /// Inner nodes over all trees.
    pub nodes: u64,
    /// Leaves over all trees.
    pub leaves: u64,
    /// Deepest tree, inner nodes on a path.
    pub depth: u32,
    /// SAH cost of the tree with most primitives (node 1, leaf block 1).
    pub sah_cost: f64,
    /// Bytes of nodes.
    pub node_bytes: u64,
    /// Bytes of primitive storage.
    pub prim_bytes: u64,
    /// Seconds spent compiling (trees and storage).
    pub build_seconds: f64,
}

impl<S: Real> World<S> {
    /// Whether the world is one object in its own space, traced without the upper tree.
    pub fn is_single_object(&self) -> bool {
        matches!(&self.instances[..], [only] if only.identity)
    }

    /// The object of the first instance; there must be one.
    #[inline(always)]
    pub fn first_object(&self) -> &Object<S> {
        &self.objects[self.instances[0].object as usize]
    }

    /// The box of what trees hold, in world space: all but what has no bounds.
    #[inline(always)]
    pub fn tree_bounds(&self) -> &Aabb<S> {
        if self.is_single_object() { &self.first_object().tree.bounds } else { &self.top.bounds }
    }

    /// Whether something has no bounds, so that no tree holds it.
    pub fn has_unbounded(&self) -> bool {
        if !self.is_single_object() {
            return !self.unbounded_instances.is_empty();
        }
        let Object { unbounded, unbounded_solids, .. } = self.first_object();
        !unbounded.is_empty() || !unbounded_solids.is_empty()
    }

    /// Finite world bounds (lower and upper corner) of all bounded geometry; `None` if there is none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut all = Aabb::<S>::EMPTY;
        for instance in &self.instances {
            if instance.bounds.is_bounded() {
                all = all.union(&instance.bounds);
            } else if instance.identity {
                // The root group often holds a ground plane: frame what stands on it.
                all = all.union(&self.objects[instance.object as usize].tree.bounds);
            }
        }
        (!all.is_empty()).then(|| all.to_f64())
    }

    /// Entries a traversal stack needs at most, upper tree and object tree together.
    pub fn stack_bound(&self) -> usize {
        self.top.stack_bound() + self.totals.stack_bound
    }

    /// Counts and sizes.
    pub fn stats(&self) -> WorldStats {
        let dropped = |placement: &Placement| self.counts[placement.object as usize].all();
        let dropped: u64 = self.traced.placements.iter().map(dropped).sum();
        let mut stats = WorldStats {
            objects: self.assembly.objects.len() as u64,
            instances: self.assembly.placements.len() as u64,
            joined: self.names.as_ref().map_or(0, Names::joined) as u64,
            instanced_prims: self.assembly.instanced_prims() - dropped,
            dropped_nonfinite: self.counts.iter().map(|c| c.nonfinite).sum(),
            dropped_degenerate: self.counts.iter().map(|c| c.degenerate).sum(),
            dropped_singular: self.counts.iter().map(|c| c.singular).sum(),
            build_seconds: self.build_seconds,
            ..Default::default()
        };
        let mut most = 0;
        for object in &self.objects {
            let q = object.tree.quality();
            let unbounded: usize = object.unbounded.iter().map(Block::len).sum();
            // The tree holds each solid once, which stands for its leaves.
            let held: usize = object.solid_blocks.iter().map(SolidBlock::len).sum();
            let leaves: usize = object.solids.iter().map(|s| s.solid.leaf_count()).sum();
            stats.prims += (q.prims + unbounded + leaves - held) as u64;
            stats.nodes += q.nodes as u64;
            stats.leaves += q.leaves as u64;
            stats.depth = stats.depth.max(object.tree.depth);
            stats.node_bytes += object.tree.node_bytes() as u64;
            stats.prim_bytes += object.prim_bytes() as u64;
            if q.prims > most {
                (most, stats.sah_cost) = (q.prims, q.sah_cost);
            }
        }
        let q = self.top.quality();
        stats.nodes += q.nodes as u64;
        stats.leaves += q.leaves as u64;
        stats.depth = stats.depth.max(self.top.depth);
        stats.node_bytes += self.top.node_bytes() as u64;
        stats.prim_bytes += (size_of_val(&self.instances[..]) + size_of_val(&self.top_leaves[..])) as u64;
        stats
    }
}

impl<S: Real> Object<S> {
    fn prim_bytes(&self) -> usize {
        let placed: usize = self.placed.iter().map(|list| size_of_val(&list[..])).sum();
        size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + placed
            + size_of_val(&self.unbounded[..])
            + self.solids.iter().map(|s| s.solid.bytes()).sum::<usize>()
            + size_of_val(&self.soles[..])
    }

    /// What it is made of.
    pub fn kinds(&self) -> Kinds {
        let shapes = !self.spheres.is_empty() || self.placed.iter().any(|list| !list.is_empty());
        let leaves: usize = self.solids.iter().map(|s| s.solid.leaf_count()).sum();
        let is_large = size_of::<S>() == size_of::<f32>() && self.tree.nodes.len() >= MANY_NODES;
        Kinds {
            triangles: !self.triangles.is_empty() || self.solids.iter().any(|s| s.solid.has_meshes()),
            shapes,
            others: !self.unbounded.is_empty() || !self.solids.is_empty(),
            large: !self.triangles.is_empty() && !sieve::holds_within(&self.tree.bounds),
            sorting: is_large || leaves > MANY_LEAVES * self.solids.len(),
        }
    }

    /// Whether something in it has no bounds, and so no place in the tree.
    #[inline(always)]
    pub fn has_unbounded(&self) -> bool {
        !self.unbounded.is_empty() || !self.unbounded_solids.is_empty()
    }

    /// Box of everything, infinite with half-spaces.
    pub fn bounds(&self) -> Aabb<S> {
        if self.has_unbounded() { Aabb::EVERYTHING } else { self.tree.bounds }
    }
}
