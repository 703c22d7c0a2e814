//! What objects come to together, worked out once: an engine's call may be for some hundreds of rays, and a world may have many
//! thousands of objects.

use super::Object;
use crate::lanes::Real;

/// What engines ask of all objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Whether shapes and solids make up more of the objects than triangles do, block by block.
    pub of_shapes: bool,
    /// Blocks of triangles of the object that has most.
    pub most_blocks: usize,
    /// Nodes on the longest path from a root.
    pub levels: usize,
    /// Entries a traversal stack needs at most in an object's tree.
    pub stack_bound: usize,
}

impl Totals {
    /// Of some objects.
    pub fn of<S: Real>(objects: &[Object<S>]) -> Self {
        let (mut totals, mut triangles, mut shapes) = (Self::default(), 0, 0);
        for o in objects {
            triangles += o.triangles.len();
            shapes += o.spheres.len() + o.solids.len() + o.unbounded.len();
            shapes += o.placed.iter().map(Vec::len).sum::<usize>();
            totals.most_blocks = totals.most_blocks.max(o.triangles.len());
            totals.levels = totals.levels.max(o.tree.depth.max(o.tree.wide_depth) as usize);
            totals.stack_bound = totals.stack_bound.max(o.tree.stack_bound());
        }
        totals.of_shapes = shapes > triangles;
        totals
    }
}
