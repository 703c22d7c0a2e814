//! Where lines first cross the surface of one operation over operands that they are inside of once.

use super::operands::{MOST, Operands};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};

/// Of the machine's vectors.
pub(super) type MaskOf<S> = <<S as Real>::Wide as Lanes>::Mask;

/// A place on the lines: ray parameter, face, number of the operand.
#[derive(Clone, Copy)]
struct Place<V> {
    t: V,
    face: V,
    operand: V,
}

impl<V: Lanes> Place<V> {
    /// `to` in the lanes of `mask`.
    #[inline(always)]
    fn moved(self, mask: V::Mask, to: Self) -> Self {
        Self {
            t: V::select(mask, to.t, self.t),
            face: V::select(mask, to.face, self.face),
            operand: V::select(mask, to.operand, self.operand),
        }
    }
}

impl<S: Real> Operands<S> {
    /// Finds the first boundary in each of `lanes` of what is inside of all operands, some of which count as their outside.
    /// `is_complete`: whether all operands are listed that the lines meet.
    #[inline(never)]
    pub fn find(&mut self, lanes: u32, is_complete: bool) {
        (self.of, self.leaving, self.together) = ([0; MOST], 0, 0);
        for first in (0..MAX_LANES).step_by(S::Wide::N) {
            let here = lanes >> first & S::Wide::ALL;
            if here == 0 {
                continue;
            }
            // Few operands are kept in registers, all pairs of their events are compared.
            match self.count {
                1 => self.find_from::<1>(first, here, is_complete),
                2 => self.find_from::<2>(first, here, is_complete),
                3 => self.find_from::<3>(first, here, is_complete),
                _ => self.find_from::<0>(first, here, is_complete),
            }
            if is_complete && self.together >> first & here != 0 {
                self.tell(first);
            }
        }
    }

    /// The same for the vector of lanes from `first` on. `N`: how many operands there are, or 0 for any number.
    #[inline(always)]
    fn find_from<const N: usize>(&mut self, first: usize, lanes: u32, is_complete: bool) {
        let load = |from: &[S; MAX_LANES]| S::Wide::load(&from[first..]);
        let (earliest, limit, eps) = (load(&self.earliest), load(&self.limit), load(&self.eps));
        let place = |i: usize, end: usize| {
            let [t, face] = [&self.spans[i][end], &self.spans[i][2 + end]].map(load);
            Place { t, face, operand: S::Wide::constant(i as f64) }
        };
        let count = if N > 0 { N } else { self.count.min(MOST) };
        // Inside of all that do not count as their outside.
        let none = MaskOf::<S>::from_bits(0);
        let always = S::Wide::splat(S::INFINITY);
        let nothing = S::Wide::constant(0.0);
        let mut start = Place { t: -always, face: nothing, operand: nothing };
        let mut last = Place { t: always, ..start };
        let mut others = 0;
        for i in 0..count {
            if self.outside[i] {
                others += 1;
                continue;
            }
            let (begin, end) = (place(i, 0), place(i, 1));
            start = start.moved(start.t.cmp_lt(begin.t), begin);
            last = last.moved(end.t.cmp_lt(last.t), end);
        }
        let counts = |t: S::Wide| earliest.cmp_le(t);
        let within = !counts(start.t) & counts(last.t);
        let mut leaves = none;
        let mut leaving = last;
        if within.bits() & lanes != 0 {
            // Lanes that begin there: behind the last of what they are in, or, in none, free until they leave or meet one.
            let mut covered = none;
            for i in 0..count {
                if !self.outside[i] {
                    continue;
                }
                let (begin, end) = (place(i, 0), place(i, 1));
                let covers = within & !counts(begin.t) & counts(end.t);
                covered = covered | covers;
                start = start.moved(covers & start.t.cmp_lt(end.t), end);
                leaving = leaving.moved(counts(begin.t) & begin.t.cmp_lt(leaving.t), begin);
            }
            leaves = within & !covered;
        }
        // What begins inside of an operand that counts as its outside begins behind it.
        for _ in 0..others {
            let mut moves = false;
            for i in 0..count {
                if !self.outside[i] {
                    continue;
                }
                let (begin, end) = (place(i, 0), place(i, 1));
                let inside = begin.t.cmp_le(start.t) & start.t.cmp_lt(end.t);
                moves |= N > 0 || inside.bits() & lanes != 0;
                start = start.moved(inside, end);
            }
            if !moves {
                break;
            }
        }
        let found = start.moved(leaves, leaving);
        let crosses = leaves | (counts(start.t) & start.t.cmp_lt(last.t));
        let crosses = crosses & found.t.cmp_le(limit);
        let apart = eps + eps;
        // Alone where the lane begins is one event only if all operands are listed.
        let alone = N > 0 && is_complete;
        let mut together = if alone { self.has_neighbours::<N>(first, apart) } else { !none };
        if together.bits() & lanes != 0 {
            let matters = (crosses & self.is_crowded(first, found.t, apart)) | self.begins_at(first, earliest, apart);
            together = together & matters;
        }
        let together = together.bits() & lanes;
        let lanes = crosses.bits() & lanes & !together;
        found.t.store(&mut self.t[first..]);
        found.face.store(&mut self.face[first..]);
        for i in 0..count {
            self.of[i] |= (found.operand.cmp_eq(S::Wide::constant(i as f64)).bits() & lanes) << first;
        }
        self.leaving |= (leaves.bits() & lanes) << first;
        self.together |= together << first;
    }

    /// Event `end` of operand `i` for the vector of lanes from `first` on.
    #[inline(always)]
    fn time(&self, i: usize, end: usize, first: usize) -> S::Wide {
        S::Wide::load(&self.spans[i][end][first..])
    }

    /// Lanes with two of the events of the first `N` operands together. Nothing is close to infinity, also not infinity.
    #[inline(always)]
    fn has_neighbours<const N: usize>(&self, first: usize, apart: S::Wide) -> MaskOf<S> {
        let mut found = MaskOf::<S>::from_bits(0);
        for i in 0..2 * N {
            for j in 0..i {
                let gap = self.time(i / 2, i % 2, first) - self.time(j / 2, j % 2, first);
                found = found | gap.abs().cmp_le(apart);
            }
        }
        found
    }

    /// Lanes with more events than one at `t`.
    #[inline(always)]
    fn is_crowded(&self, first: usize, t: S::Wide, apart: S::Wide) -> MaskOf<S> {
        let none = MaskOf::<S>::from_bits(0);
        let (mut once, mut twice) = (none, none);
        for i in 0..2 * self.count.min(MOST) {
            let close = (self.time(i / 2, i % 2, first) - t).abs().cmp_le(apart);
            twice = twice | (once & close);
            once = once | close;
        }
        twice
    }

    /// Lanes with an event at `t`: it may belong together with one on the other side of it.
    #[inline(always)]
    fn begins_at(&self, first: usize, t: S::Wide, apart: S::Wide) -> MaskOf<S> {
        let mut found = MaskOf::<S>::from_bits(0);
        for i in 0..2 * self.count.min(MOST) {
            found = found | (self.time(i / 2, i % 2, first) - t).abs().cmp_le(apart);
        }
        found
    }
}
