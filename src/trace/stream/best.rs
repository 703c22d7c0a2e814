//! What the rays of a chunk have found.

use super::chunk::{RAYS, Set};
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::{Candidate, HitPacket, Hits, INVALID_ID};
use crate::scene::world::Names;
use crate::shape::BLOCK;

/// The best hits of a chunk so far.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Best<S> {
    /// Best `t`, or the segment's end.
    pub t: [S; RAYS],
    u: [S; RAYS],
    v: [S; RAYS],
    prim: [u32; RAYS],
    /// Instance numbers.
    pub inst: [u32; RAYS],
    /// Any-hit: rays that found something.
    pub done: Set,
}

impl<S: Real> Default for Best<S> {
    fn default() -> Self {
        let (zero, none) = ([S::ZERO; RAYS], [INVALID_ID; RAYS]);
        Self { t: zero, u: zero, v: zero, prim: none, inst: none, done: 0 }
    }
}

impl<S: Real> Best<S> {
    /// Nothing found yet, once the ends of the segments are there.
    #[inline(always)]
    pub fn start(&mut self) {
        self.clear(0, RAYS);
        self.done = 0;
    }

    /// Forgets the hits of `n` rays from `first` on.
    #[inline(always)]
    pub fn clear(&mut self, first: usize, n: usize) {
        self.u[first..first + n].fill(S::ZERO);
        self.v[first..first + n].fill(S::ZERO);
        self.prim[first..first + n].fill(INVALID_ID);
        self.inst[first..first + n].fill(INVALID_ID);
    }

    /// Rays whose segments, as far as they are still looked at, reach to `near`; of the first `len`, others are unspecified.
    #[inline(always)]
    pub fn reaching<V: Lanes<Scalar = S>>(&self, near: S, len: usize) -> Set {
        if len <= V::N {
            return Set::from(V::splat(near).cmp_le(V::load(&self.t)).bits());
        }
        let half = |half: usize| self.t[64 * half..].first_chunk().map_or(0, |of| near.reached(of));
        Set::from(half(0)) | if len > 64 { Set::from(half(1)) << 64 } else { 0 }
    }

    /// Of the first `len` rays those with a hit, closest-hit.
    #[inline(always)]
    pub fn found(&self, len: usize) -> Set {
        let some = |first: usize| {
            self.prim[first..].first_chunk().map_or(0, |of| Set::from(!positions(of, INVALID_ID) & 0xffff))
        };
        (0..len.min(RAYS)).step_by(16).fold(0, |found, first| found | some(first) << first)
    }

    /// Parameter, weights and primitive of the hit of ray `i`.
    #[inline(always)]
    pub fn numbers(&self, i: usize) -> (S, S, S, u32) {
        (self.t[i], self.u[i], self.v[i], self.prim[i])
    }

    /// The hits of rays `at..at + N`.
    #[inline(always)]
    pub fn packet<V: Lanes<Scalar = S>>(&self, at: usize) -> HitPacket<V> {
        let mut hit = HitPacket::new(V::load(&self.t[at..]));
        (hit.u, hit.v) = (V::load(&self.u[at..]), V::load(&self.v[at..]));
        hit.prim[..V::N].copy_from_slice(&self.prim[at..at + V::N]);
        hit.inst[..V::N].copy_from_slice(&self.inst[at..at + V::N]);
        hit
    }

    /// Puts back what [`Best::packet`] took out.
    #[inline(always)]
    pub fn put<V: Lanes<Scalar = S>>(&mut self, at: usize, hit: &HitPacket<V>) {
        hit.t.store(&mut self.t[at..]);
        hit.u.store(&mut self.u[at..]);
        hit.v.store(&mut self.v[at..]);
        self.prim[at..at + V::N].copy_from_slice(&hit.prim[..V::N]);
        self.inst[at..at + V::N].copy_from_slice(&hit.inst[..V::N]);
    }

    /// Takes in what a kernel found for one ray on a block of triangles, those whose bits are set in `wanted`: usually one. The tie
    /// rule is that of [`HitPacket::commit`].
    #[inline(always)]
    pub fn take(&mut self, ray: usize, wanted: u32, found: &Candidate<S::Octo>, prim: &[u32; BLOCK], inst: u32) {
        let [mut t, mut u, mut v] = [[S::ZERO; BLOCK]; 3];
        found.t.store(&mut t);
        found.u.store(&mut u);
        found.v.store(&mut v);
        let mut rest = wanted;
        while rest != 0 {
            let slot = rest.trailing_zeros() as usize & (BLOCK - 1);
            rest &= rest - 1;
            self.offer(ray, [t[slot], u[slot], v[slot]], prim[slot], inst);
        }
    }

    /// Takes a hit in, unless it is farther than the best or, as far, of a greater number: see [`HitPacket::commit`].
    #[inline(always)]
    pub fn offer(&mut self, ray: usize, [t, u, v]: [S; 3], prim: u32, inst: u32) {
        let ties = t == self.t[ray] && (inst, prim) < (self.inst[ray], self.prim[ray]);
        if t < self.t[ray] || ties {
            (self.t[ray], self.u[ray], self.v[ray]) = (t, u, v);
            (self.prim[ray], self.inst[ray]) = (prim, inst);
        }
    }

    /// Puts what ray `i` of `from` has found at `to`.
    #[inline(always)]
    pub fn copy(&mut self, to: usize, from: &Self, i: usize) {
        (self.t[to], self.u[to], self.v[to]) = (from.t[i], from.u[i], from.v[i]);
        (self.prim[to], self.inst[to]) = (from.prim[i], from.inst[i]);
    }

    /// Writes the hits, by their names, to their places in a batch.
    #[inline(always)]
    pub fn scatter(
        &mut self,
        (hits, names): (&mut Hits<S>, Option<&Names>),
        places: &[u32],
        id: impl Fn(u32) -> usize,
    ) {
        if let Some(names) = names {
            names.apply_each(&mut self.prim[..places.len()], &mut self.inst);
        }
        let n = hits.t.len();
        let (t, u, v) = (&mut hits.t[..n], &mut hits.u[..n], &mut hits.v[..n]);
        let (prim, inst) = (&mut hits.prim[..n], &mut hits.inst[..n]);
        for (i, &place) in places.iter().enumerate().take(RAYS) {
            let id = id(place).min(n - 1);
            t[id] = if self.prim[i] == INVALID_ID { S::INFINITY } else { self.t[i] };
            (u[id], v[id], prim[id], inst[id]) = (self.u[i], self.v[i], self.prim[i], self.inst[i]);
        }
    }

    /// Writes what any-hit found where it found something.
    #[inline(always)]
    pub fn scatter_done(&self, out: &mut [u8], places: &[u32], id: impl Fn(u32) -> usize) {
        let mut rest = self.done;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            out[id(places[i])] = 1;
        }
    }
}
