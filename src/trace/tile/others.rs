//! What tiles leave to other kernels: groups to the stream kernel, single odd rays and groups to the packet kernel.

use super::bundle::{self, Bundle, Source};
use super::{Job, V, listing, place};
use crate::lanes::Lanes;
use crate::ray::{HitPacket, Packet};
use crate::scene::world::World;
use crate::trace::query::Query;
use crate::trace::{Generic, stream, traverse};

/// Whether tiles can trace a world: one object in world space, of triangles only; or (not for `exact` tiles) instances
/// of more triangles than shapes, that no map makes too flat.
pub fn suits(world: &World<f32>, exact: bool) -> bool {
    let shape = match world.is_single_object() {
        true => !world.kinds.shapes,
        false => {
            let steep = world.rounding.growth <= place::MOST_GROWTH;
            let of_shapes = world.kinds.shapes && world.totals.of_shapes;
            steep && !(exact || of_shapes || world.top.nodes.is_empty())
        }
    };
    // Triangles are numbered by block and place in 32 bits.
    shape && !world.kinds.others && world.totals.most_blocks < (u32::MAX / 8) as usize
}

impl Job<'_> {
    /// Traces the groups that start at `starts` by the stream kernel; returns the list, empty. `apart`: see [`stream::Job`].
    pub(super) fn streamed<const ANY: bool, const EXACT: bool, const COUNT: bool>(
        &mut self,
        mut starts: Vec<usize>,
        apart: bool,
    ) -> Vec<usize> {
        if !starts.is_empty() {
            let Self { world, rays, stream: memory, stack, counters, output, .. } = self;
            let plain = !EXACT;
            let mut job = stream::Job { world, rays, memory, stack, counters, output: output.reborrow(), apart, plain };
            job.run::<V, ANY, COUNT>(starts.drain(..));
        }
        starts
    }

    /// Leaves `N` sets to the stream kernel.
    pub(super) fn leave<const N: usize>(&mut self, first: usize) {
        self.memory.rest.extend((0..bundle::groups::<N>(self.rays, first)).map(|g| first + g * V::N));
    }

    /// Leaves some groups to the stream kernel.
    #[cold]
    #[inline(never)]
    pub(super) fn leave_some(&mut self, bundle: &Bundle, groups: u64) {
        if let Source::Batch(_) = bundle.source {
            self.memory.rest.extend(listing::groups(groups).map(|g| bundle.first + g * V::N));
        }
    }

    /// The packet kernel for some lanes, on top of hits that other lanes have.
    #[cold]
    #[inline(never)]
    pub(super) fn rest<const ANY: bool, const COUNT: bool>(
        &mut self,
        first: usize,
        lanes: u32,
        so_far: Option<HitPacket<V>>,
    ) -> (HitPacket<V>, u32) {
        let (packet, t_max, _) = Packet::<V>::load(self.rays, first);
        let hit = so_far.unwrap_or(HitPacket::new(t_max));
        let mut query = Query::<V, ANY, COUNT>::new(hit, self.stack, self.counters);
        traverse::world(self.world, &packet, &mut query, lanes);
        (query.hit, query.done)
    }

    /// A group as a packet.
    pub(super) fn packet<const ANY: bool, const COUNT: bool>(&mut self, first: usize) {
        let (hit, done) =
            Generic::<V, true>::packet::<ANY, COUNT>(self.world, self.rays, first, self.stack, self.counters);
        self.output.put(first, &hit, done);
    }
}
