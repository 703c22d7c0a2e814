//! The first boundary of one operation in lanes whose boundaries lie together: faces in a plane, edges, lines that only touch.
//!
//! It is a sweep over few operands, in vectors of the machine's: what lies together counts as one event, and whether a lane is
//! inside is asked after all of it.

use super::nearest::MaskOf;
use super::operands::{MOST, Operands};
use crate::lanes::{LaneMask, Lanes, Real};

impl<S: Real> Operands<S> {
    /// Finds the first boundary in those of the lanes of the vector from `first` on that are still to be swept, if all operands that
    /// they meet are listed. Those remain for which the sweep is to choose the surface, as several cross there. Uses up the spans.
    #[inline(never)]
    pub fn tell(&mut self, first: usize) {
        let load = |from: &[S]| S::Wide::load(&from[first..]);
        let (earliest, limit, eps) = (load(&self.earliest), load(&self.limit), load(&self.eps));
        let (mut found, mut faces) = (load(&self.t), load(&self.face));
        let count = self.count.min(MOST);
        let none = MaskOf::<S>::from_bits(0);
        let never = S::Wide::splat(S::INFINITY);
        let mut inside = [none; MOST];
        let mut of = [none; MOST];
        let mut state = self.holds(&inside);
        let mut pending = MaskOf::<S>::from_bits(self.together >> first & S::Wide::ALL);
        let (mut leaves, mut rest) = (none, none);
        self.together &= !(S::Wide::ALL << first);
        let mut next = never;
        for [begin, ..] in &self.spans[..count] {
            next = next.fast_min(load(begin));
        }
        loop {
            pending = pending & next.cmp_le(limit);
            if !pending.any() {
                break;
            }
            let (t, until) = (next, next + eps);
            let (mut once, mut twice) = (none, none);
            let mut face = t;
            let mut crossed = [none; MOST];
            next = never;
            for i in 0..count {
                for end in 0..2 {
                    let at = load(&self.spans[i][end]);
                    let now = at.cmp_le(until);
                    next = S::Wide::select(now, never, at).fast_min(next);
                    let now = now & pending;
                    inside[i] = (inside[i] & !now) | (now & !inside[i]);
                    (once, twice) = (once | now, twice | (once & now));
                    crossed[i] = crossed[i] | now;
                    face = S::Wide::select(now, load(&self.spans[i][2 + end]), face);
                    S::Wide::select(now, never, at).store(&mut self.spans[i][end][first..]);
                }
            }
            let value = self.holds(&inside);
            let changed = pending & ((value & !state) | (state & !value));
            let crosses = changed & !twice & earliest.cmp_le(t);
            found = S::Wide::select(crosses, t, found);
            faces = S::Wide::select(crosses, face, faces);
            for (of, crossed) in of.iter_mut().zip(crossed).take(count) {
                *of = *of | (crossed & crosses);
            }
            leaves = leaves | (crosses & state);
            rest = rest | (changed & twice);
            pending = pending & !(crosses | (changed & twice));
            state = value;
        }
        found.store(&mut self.t[first..]);
        faces.store(&mut self.face[first..]);
        for (to, of) in self.of.iter_mut().zip(of).take(count) {
            *to |= of.bits() << first;
        }
        self.leaving |= leaves.bits() << first;
        self.together |= rest.bits() << first;
    }

    /// Lanes that are inside of all operands, where `inside[i]` are in operand `i`.
    #[inline(always)]
    fn holds(&self, inside: &[MaskOf<S>; MOST]) -> MaskOf<S> {
        let mut all = MaskOf::<S>::from_bits(S::Wide::ALL);
        for (inside, outside) in inside.iter().zip(self.outside).take(self.count) {
            all = all & if outside { !*inside } else { *inside };
        }
        all
    }
}
