//! Where an engine's answers go.

use crate::lanes::words::prefetch;
use crate::lanes::{Lanes, Real};
use crate::ray::{HitPacket, Hits};
use crate::scene::world::Names;

/// The answers of one call. Shape: one per ray of the batch.
pub enum Output<'a, S> {
    /// Closest hits, and what they are called if not what engines call them.
    Closest(&'a mut Hits<S>, Option<&'a Names>),
    /// Any-hit: 1 is occluded.
    Any(&'a mut [u8]),
}

impl<S: Real> Output<'_, S> {
    /// The same for a callee.
    pub fn reborrow(&mut self) -> Output<'_, S> {
        match self {
            Self::Closest(hits, names) => Output::Closest(hits, *names),
            Self::Any(out) => Output::Any(out),
        }
    }

    /// Writes what rays `first..first + N` found: their hits or (any-hit) `done`.
    #[inline(always)]
    pub fn put<V: Lanes<Scalar = S>>(&mut self, first: usize, hit: &HitPacket<V>, done: u32) {
        match self {
            Self::Closest(hits, names) => {
                let Some(names) = names else { return hit.store(hits, first) };
                let mut hit = *hit;
                names.apply(&mut hit.prim, &mut hit.inst);
                hit.store(hits, first);
            }
            Self::Any(_) => self.put_any(first, V::N, done),
        }
    }

    /// Asks the memory for the place of the answer of ray `first` and its neighbours.
    #[inline(always)]
    pub fn prefetch(&self, first: usize) {
        if let Self::Closest(hits, _) = self {
            [&hits.t, &hits.u, &hits.v].into_iter().for_each(|array| prefetch(array, first));
            [&hits.prim, &hits.inst].into_iter().for_each(|array| prefetch(array, first));
        }
    }

    /// Writes what `n` rays from `first` on found.
    #[inline(always)]
    pub fn put_any(&mut self, first: usize, n: usize, done: u32) {
        if let Self::Any(out) = self {
            if n == 16
                && let Some(out) = out[first..].first_chunk_mut::<16>()
            {
                // A whole vector at once.
                *out = std::array::from_fn(|lane| (done >> lane & 1) as u8);
                return;
            }
            for (lane, out) in out[first..].iter_mut().take(n).enumerate() {
                *out = (done >> lane & 1) as u8;
            }
        }
    }
}
