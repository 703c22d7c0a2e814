//! Constructive solid geometry: solids made of solids, traced by packets.
//!
//! [`build`] compiles a program over leaves to [`Solid`]s, each a flat list of leaves, a `tree` of operations and
//! bounds. A packet collects the leaves its lanes meet, `prune`s the operations to those that matter, and [`sweep`]s
//! the leaves' boundaries. All of it is decided lane by lane, so the bits are the same at every width.

mod build;
mod direct;
mod events;
mod leaf;
mod mesh;
mod nearest;
mod operands;
mod pieces;
mod prune;
mod sole;
mod solid;
mod sweep;
mod together;
mod tree;

pub use build::{Built, Input, build};
pub use leaf::{Form, LeafInput, Triangles};
pub use sole::Sole;
pub use solid::Solid;
pub use sweep::{Boundary, Depth, Effort, Scratch, sweep};
pub use tree::{Op, Token};

#[cfg(test)]
mod tests;
