//! The engines behind one trait. (being built)

use crate::lanes::Real;
use crate::ray::{Counters, Hits, Rays};
use crate::scene::world::World;

/// Per-thread working memory of engines; grows on use, reusable for any world.
#[derive(Debug, Default)]
pub struct Scratch {
    _private: (),
}

/// A complete path from rays to hits.
pub trait Engine<S: Real>: Sync {
    /// Name for `--engine` and tables.
    fn name(&self) -> &'static str;
    /// Rays traced together.
    fn lanes(&self) -> usize;
    /// Closest hit of each ray of `rays` into `hits` (reset to the batch's length). With `counters`, the counting
    /// build of the same kernels runs and adds to them.
    fn intersect(
        &self,
        world: &World<S>,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    );
    /// Whether anything lies in each ray's segment: `out` is resized to the batch's length, 1 is occluded.
    fn occluded(
        &self,
        world: &World<S>,
        rays: &Rays<S>,
        out: &mut Vec<u8>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    );
}

/// A scalar type with its list of engines.
pub trait Engines: Real {
    /// All engines of this precision, baselines first.
    fn engines() -> &'static [&'static dyn Engine<Self>];
    /// `f32` or `f64`.
    const PRECISION: &'static str;
}

impl Engines for f32 {
    fn engines() -> &'static [&'static dyn Engine<Self>] {
        unimplemented!()
    }
    const PRECISION: &'static str = "f32";
}
impl Engines for f64 {
    fn engines() -> &'static [&'static dyn Engine<Self>] {
        unimplemented!()
    }
    const PRECISION: &'static str = "f64";
}

/// The engine called `name`.
///
/// # Errors
/// A usage error that lists the names and the nearest one.
pub fn engine<S: Engines>(name: &str) -> crate::error::Result<&'static dyn Engine<S>> {
    let _ = name;
    unimplemented!()
}
