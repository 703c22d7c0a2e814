//! Boxes and affine maps in the engines' precision.

mod aabb;
mod affine;

pub use aabb::Aabb;
pub use affine::{Affine, NormalMap, normal_to_world, transformed_bounds};
