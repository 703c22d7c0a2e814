//! Bounding volume hierarchies: build, refinement (obvhs), collapse to eight and to sixteen children, flat layout, validation, cost.
//!
//! The tree knows boxes and leaf classes, not shapes: the caller brings one box and one class number per primitive
//! and stores each leaf's primitives (at most eight, of one class) as one block of that class.

mod binary;
mod build;
mod bundle;
mod collapse;
mod cost;
mod node;
mod quality;
mod refine;
mod topdown;

#[cfg(test)]
mod tests;

pub use build::{BuildSettings, Leaf, Nodes, Preset, Tree, build, build_by_cost};
pub use bundle::Bundle;
pub use cost::PRIMITIVE;
pub use node::{Child, LEAF_PRIMS, Node, WIDE, WIDTH};
pub use quality::Quality;
