//! Primitives: storage in blocks of eight (structure of arrays), bounds, kernels.
//!
//! One kind of primitive is one file. Triangles and world spheres keep their numbers in world (object) space; the
//! other shapes are canonical solids in a local space, intersected by the inverse-transformed ray.
//!
//! Analytic shapes and the leaves of trees of solids report the number of the face that was hit as `u`, and as `v` 0, or 1 where a
//! leaf's outside is inside the whole, as where it was subtracted:
//! sphere, half-space and disc 0; cuboid 0..=5 for -x, +x, -y, +y, -z, +z; cylinder and cone 0 for the side, 1 for
//! the cap at z = 0, 2 for the cap at z = 1. The files of the solids that only trees of solids hold (polyhedra, tori,
//! quadrics between slabs, tapered solids) number their own.

mod block;
mod cone;
mod cuboid;
mod cylinder;
mod disc;
mod edges;
mod elliptic_torus;
mod facts;
mod half_space;
mod placed;
mod planes;
pub mod quadric;
pub mod quartic;
pub(crate) mod sieve;
mod span;
mod sphere;
mod taper;
mod torus;
mod triangle;

pub use block::{BLOCK, Block};
pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use disc::Disc;
pub use edges::around;
pub use elliptic_torus::{elliptic_torus, elliptic_torus_normal};
pub use facts::Facts;
pub use half_space::HalfSpace;
pub use placed::{Placed, PlacedRecord};
pub use planes::planes_span;
pub use span::{Solid, Span};
pub use sphere::{Sphere, SphereRecord, WorldSphere};
pub use taper::{taper, taper_normal, taper_side_normal};
pub use torus::{torus, torus_normal};
pub use triangle::{Degenerate, Triangle, TriangleBlock, Turned};

#[cfg(test)]
mod tests;
