//! The engine `stream`: whole calls.

use std::marker::PhantomData;

use super::chunk::RAYS;
use super::{Job, Output};
use crate::lanes::Lanes;
use crate::ray::{Counters, Hits, Rays};
use crate::scene::world::World;
use crate::trace::{self, ALWAYS_COUNTS, Engine, Engines, Scratch};

/// The engine; `V`: the vectors of rays.
#[derive(Clone, Copy, Debug)]
pub struct Stream<V>(pub PhantomData<fn() -> V>);

impl<V: Lanes> Engine<V::Scalar> for Stream<V>
where
    V::Scalar: Engines,
{
    fn name(&self) -> &'static str {
        "stream"
    }

    fn lanes(&self) -> usize {
        RAYS
    }

    fn width(&self) -> usize {
        V::N
    }

    fn intersect(
        &self,
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        hits: &mut Hits<V::Scalar>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        hits.prepare(rays.len());
        call::<V, false>(world, rays, Output::Closest(hits, world.names.as_ref()), scratch, counters);
    }

    fn occluded(
        &self,
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        out: &mut Vec<u8>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        out.clear();
        out.resize(rays.len(), 0);
        call::<V, true>(world, rays, Output::Any(out), scratch, counters);
    }
}

fn call<V: Lanes, const ANY: bool>(
    world: &World<V::Scalar>,
    rays: &Rays<V::Scalar>,
    output: Output<V::Scalar>,
    scratch: &mut Scratch,
    counters: Option<&mut Counters>,
) where
    V::Scalar: Engines,
{
    let trace::Memory { stack, stream: memory } = V::Scalar::memory(scratch);
    stack.reserve(world.stack_bound());
    // Hits of the padding are misses, whoever reads whole vectors of them.
    let end = if ANY { rays.len() } else { rays.padded_len() };
    let starts = (0..end).step_by(V::N);
    let (mut unread, count) = (Counters::default(), ALWAYS_COUNTS || counters.is_some());
    let counters = counters.unwrap_or(&mut unread);
    let mut job = Job { world, rays, memory, stack, counters, output, apart: false, plain: false };
    match count {
        true => job.run::<V, ANY, true>(starts),
        false => job.run::<V, ANY, false>(starts),
    }
}
