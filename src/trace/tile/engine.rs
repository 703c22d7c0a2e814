//! The engine as others see it.

use super::bundle::Bundle;
use super::{GROUPS, Job, SET, SETS, Tile, node, suits};
use crate::lanes::past::arrived;
use crate::lanes::{Lanes, f32x16};
use crate::ray::{Counters, Hits, Pencil, Rays};
use crate::scene::world::World;
use crate::trace::output::Output;
use crate::trace::{ALWAYS_COUNTS, Engine, Scratch};

impl<const EXACT: bool> Engine<f32> for Tile<EXACT> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn lanes(&self) -> usize {
        self.most * f32x16::N
    }

    fn width(&self) -> usize {
        f32x16::N
    }

    fn is_exact(&self) -> bool {
        EXACT
    }

    fn intersect(
        &self,
        world: &World<f32>,
        rays: &Rays<f32>,
        hits: &mut Hits<f32>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        hits.prepare(rays.len());
        call::<false, EXACT>(world, rays, Output::Closest(hits, world.names.as_ref()), scratch, counters, self.most);
    }

    fn intersect_pencil(
        &self,
        world: &World<f32>,
        pencil: &Pencil,
        hits: &mut Hits<f32>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) -> bool {
        hits.prepare(pencil.len());
        let (none, output) = (&Rays::default(), Output::Closest(hits, world.names.as_ref()));
        let (mut unread, count) = (Counters::default(), ALWAYS_COUNTS || counters.is_some());
        let counters = counters.unwrap_or(&mut unread);
        let mut job = Job::new(world, none, scratch, counters, output, self.most);
        match count {
            true => job.pencil::<EXACT, true>(pencil),
            false => job.pencil::<EXACT, false>(pencil),
        }
    }

    fn occluded(
        &self,
        world: &World<f32>,
        rays: &Rays<f32>,
        out: &mut Vec<u8>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        out.clear();
        out.resize(rays.len(), 0);
        call::<true, EXACT>(world, rays, Output::Any(out), scratch, counters, self.most);
    }
}

impl Job<'_> {
    /// Waits until all answers are where others find them.
    pub fn end(&self) {
        if self.past {
            arrived();
        }
    }

    /// Room for the levels of every way through the world.
    pub fn make_levels(&mut self) {
        let depth = node::levels(&self.world.top) + self.world.totals.levels + 1;
        if self.memory.levels.len() < depth {
            self.memory.levels.resize(depth, node::Level::default());
        }
    }

    /// Traces a pencil as one tile; false if that cannot be.
    fn pencil<const EXACT: bool, const COUNT: bool>(&mut self, pencil: &Pencil) -> bool {
        if EXACT || self.most != GROUPS || !suits(self.world, EXACT) {
            return false;
        }
        let Some(mut bundle) = Bundle::of_pencil(pencil) else { return false };
        self.make_levels();
        self.memory.slabs.forget();
        // Those without a live ray too: their misses are written.
        let groups = u64::MAX >> (GROUPS - bundle.len);
        let traced = match bundle.len <= SET {
            true => self.tile::<1, false, EXACT, COUNT>(&mut bundle, groups),
            false => self.tile::<SETS, false, EXACT, COUNT>(&mut bundle, groups),
        };
        let is_done = traced && self.memory.apart.is_empty();
        self.memory.apart.clear();
        self.end();
        is_done
    }
}

fn call<const ANY: bool, const EXACT: bool>(
    world: &World<f32>,
    rays: &Rays<f32>,
    output: Output<f32>,
    scratch: &mut Scratch,
    counters: Option<&mut Counters>,
    most: usize,
) {
    let (mut unread, count) = (Counters::default(), ALWAYS_COUNTS || counters.is_some());
    let counters = counters.unwrap_or(&mut unread);
    let mut job = Job::new(world, rays, scratch, counters, output, most);
    match count {
        true => job.run::<ANY, EXACT, true>(),
        false => job.run::<ANY, EXACT, false>(),
    }
}
