//! NumPy `.npy` files: rays, hits, occlusion, planes.
//!
//! Source: NumPy Enhancement Proposal 1, R. Kern, "A Simple File Format for NumPy Arrays", 2007, versions 1.0 and 2.0
//! (version 3.0 differs only in non-ASCII field names, which no file here has). All data is little-endian, C order.
//!
//! | file | dtype | shape |
//! |---|---|---|
//! | rays | `<f4` (reading also `<f8`) | (N, 8): ox oy oz t_min dx dy dz t_max |
//! | hits | `t <f4, u <f4, v <f4, prim <u4, inst <u4` | (N) |
//! | occlusion | `\|u1` (reading also `\|b1`) | (N), 1 is occluded |
//! | voxels | `\|u1` | (nz, ny, nx), 1 is inside (only written) |
//! | plane | `<f4` or `<u4` | (height, width) |
//!
//! Readers check the shape against the file's length before they take memory, and stream; writers stream too.

mod arrays;
mod header;
mod kind;
mod literal;
mod planes;

pub use arrays::{
    parse_hits, parse_occlusion, parse_rays, read_hits, read_occlusion, read_rays, stretch_record, write_hits,
    write_occlusion, write_rays, write_stretches, write_voxels,
};
pub use kind::{Kind, kind};
pub use planes::{parse_film, parse_plane, read_film, read_plane, write_plane, write_stack};

#[cfg(test)]
mod tests;
