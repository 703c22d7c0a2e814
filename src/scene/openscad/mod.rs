//! OpenSCAD's `.csg` files: what `openscad -o model.csg model.scad` writes, without variables and modules of its own.
//!
//! `syntax` reads the calls, `looks` what they inherit (colours, marks), `build` makes solids of them, inner ones
//! first: booleans become the operations of one [tree of solids](crate::scene::solids), never of meshes; curves become
//! the faces that OpenSCAD gives them. Plane figures are worked out by themselves (`flat`) and swept to closed meshes
//! (`extrude`).
//!
//! Nothing recurses over what a file says, and what it may cost is counted (`work`). Memory stays below 256 bytes per
//! byte of the file, and 512 bytes per triangle of the meshes that the file asks for: a few words may ask for 2^22, 2 GiB.

mod build;
mod cover;
mod describe;
mod exact;
mod extrude;
mod facets;
mod fields;
mod flat;
mod fragments;
mod hull;
mod leaves;
mod looks;
mod minkowski;
mod offset;
mod primitives;
mod solids;
mod sweep;
mod syntax;
#[cfg(test)]
mod tests;
mod token;
mod view;
mod work;

use std::path::Path;

use super::description::Description;
use super::kdl::meshes::MeshFile;
use super::reference::References;
use super::unpack::UnpackLimit;
use crate::error::Result;

/// Largest file that is read, unpacked.
pub const MAX_BYTES: u64 = 1 << 28;
/// A packed one is no larger than one that is not.
pub const LIMIT: UnpackLimit = UnpackLimit { floor: MAX_BYTES, ratio: 0, cap: MAX_BYTES };

/// Reads the bytes of a file as a scene called `name`, in OpenSCAD's units, z up; `file` is only for error messages.
/// `references` is where the files are that it imports, which `read` reads.
///
/// # Errors
/// At line and column: what is not in the grammar, modules that are not known or cannot be shown, arguments that make
/// no sense, files that cannot be read, models that are too large.
pub fn parse(
    file: &Path,
    name: &str,
    bytes: &[u8],
    references: &References<'_>,
    read: &dyn Fn(&Path) -> Result<MeshFile>,
) -> Result<Description> {
    describe::describe(file, name, bytes, references, read)
}
