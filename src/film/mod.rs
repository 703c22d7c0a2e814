//! The film: named planes of pixels over a data window, the files they live in (EXR, PNG, NPY and PIX; PFM is only read), and
//! files of meshes.
//!
//! All writers go through [`write_atomically`]: a reader sees the old file or the whole new one, never a part.
//! All readers take hostile input: what a header claims is checked against the file's length before memory is taken.

pub mod atomic;
pub mod cryptomatte;
pub mod exr;
pub mod heat;
pub mod mesh;
pub mod metrics;
pub mod npy;
pub mod pfm;
pub mod picture;
pub mod pix;
pub mod planes;
pub mod png;
pub mod srgb;

mod input;

pub use atomic::{Writer, check_apart, check_distinct, check_file, check_folder, write_atomically};
pub use planes::{Film, Plane, PlaneData, Window};

#[cfg(test)]
mod tests;
