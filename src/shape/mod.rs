//! Primitives: storage in blocks of eight (structure of arrays), bounds, kernels.
//!
//! One kind of primitive is one file. Triangles and world spheres keep their numbers in world (object) space; the
//! other shapes are canonical solids in a local space, intersected by the inverse-transformed ray.
//!
//! Analytic shapes report the number of the face that was hit as `u` (and 0 as `v`):
//! sphere, half-space and disc 0; cuboid 0..=5 for -x, +x, -y, +y, -z, +z; cylinder and cone 0 for the side, 1 for
//! the cap at z = 0, 2 for the cap at z = 1.

mod block;
mod cone;
mod cuboid;
mod cylinder;
mod disc;
mod half_space;
mod placed;
mod span;
mod sphere;
mod triangle;

pub use block::{BLOCK, Block};
pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use disc::Disc;
pub use half_space::HalfSpace;
pub use placed::{Placed, PlacedRecord};
pub use span::{Solid, Span};
pub use sphere::{Sphere, SphereRecord, WorldSphere};
pub use triangle::{Degenerate, Triangle, TriangleBlock, Turned, around};

#[cfg(test)]
mod tests;
