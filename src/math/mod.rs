//! Boxes and affine maps in the engines' precision.

mod aabb;
mod affine;
#[cfg(test)]
mod random;

pub use aabb::Aabb;
pub use affine::{Affine, NormalMap, normal_to_world, transformed_bounds};

#[cfg(test)]
pub(crate) use random::Random;
