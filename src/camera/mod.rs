//! Cameras, the order of pixels in tiles, primary rays and the random numbers that place samples.

mod filter;
mod framing;
mod generate;
mod lines;
mod matrices;
mod model;
mod passes;
pub mod sampling;
mod scattered;
pub mod sobol;
mod tiles;

pub use filter::Filter;
pub use framing::framing;
pub use generate::{SubPixel, aim_tile, fill_passes, fill_tile};
pub use lines::{Range, range_of_tile};
pub use model::{Camera, CameraOverrides};
pub use passes::{Passes, Run};
pub use scattered::fill_pixels;
pub use tiles::{FILE_TILE, MAX_PIXELS, PixelRect, Tiling, morton_decode, morton_encode};
