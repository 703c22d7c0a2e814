//! Groups without a segment: rays of pixels that see nothing, of which a picture may be full. What says so is a quarter of what is
//! in memory of them.

use super::bundle::groups;
use super::{Job, SETS, V};
use crate::lanes::Lanes;
use crate::lanes::past::store_past;
use crate::ray::INVALID_ID;
use crate::trace::output::Output;

/// Writes a group's numbers from place `first` of a column on. `past`: past the caches.
#[inline(always)]
pub fn store(x: &[u32; 16], column: &mut [u32], first: usize, past: bool) {
    match column[first..].first_chunk_mut() {
        Some(to) if past => store_past(x, to),
        Some(to) => *to = *x,
        None => {}
    }
}

impl Job<'_> {
    /// Writes that no ray of a block meets anything.
    pub fn missed(&mut self, first: usize) {
        // Any-hit answers begin as misses.
        let Output::Closest(hits, _) = &mut self.output else { return };
        let [endless, zero, none] = [f32::INFINITY.to_bits(), 0.0f32.to_bits(), INVALID_ID].map(|x| [x; 16]);
        for at in (0..groups::<SETS>(self.rays, first)).map(|g| first + g * V::N) {
            for (x, column) in [(&endless, &mut hits.t), (&zero, &mut hits.u), (&zero, &mut hits.v)] {
                store(x, bytemuck::cast_slice_mut(column), at, self.past);
            }
            store(&none, &mut hits.prim, at, self.past);
            store(&none, &mut hits.inst, at, self.past);
        }
    }
}
