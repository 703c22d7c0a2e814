//! Pictures: tiles over threads, samples into pixels, pixels into a film.

mod aov;
mod options;
mod pixels;
mod scheduler;

pub use aov::Aov;
pub use options::{Progress, RenderOptions, Silent};
pub use scheduler::{RenderOutput, render, render_with};
