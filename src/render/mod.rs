//! Pictures: tiles over threads, samples into pixels, pixels into a film; at once, or block by block while one watches.

mod aov;
mod canvas;
mod enough;
mod kept;
mod mattes;
mod options;
mod patch;
mod pixels;
pub mod progressive;
mod scheduler;
mod sums;
mod tally;

pub use aov::Aov;
pub use kept::Keeper;
pub use options::{Progress, RenderOptions, Silent};
pub use scheduler::{RenderOutput, render, render_kept, render_with};
