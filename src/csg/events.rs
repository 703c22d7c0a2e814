//! Boundaries of leaves on a packet's lines, before they are put in order.

use crate::lanes::{Column, LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::slab::Interval;
use crate::shape::Span;

/// Boundaries of leaves: `MAX_LANES` numbers each.
#[derive(Debug, Default)]
pub struct Events<S> {
    pub(super) t: Column<S>,
    pub(super) face: Column<S>,
    /// Place in the program of the leaf each belongs to.
    pub(super) leaf: Vec<u32>,
    /// How many.
    pub(super) count: usize,
}

impl<S: Real> Events<S> {
    pub(super) fn clear(&mut self) {
        self.leaf.clear();
        self.count = 0;
    }

    /// Adds one boundary of `leaf` in `lanes`.
    #[inline(always)]
    pub fn push<V: Lanes<Scalar = S>>(&mut self, leaf: u32, lanes: V::Mask, t: V, face: V) {
        let at = self.count * MAX_LANES;
        self.count += 1;
        if self.t.len() < at + MAX_LANES {
            self.t.resize(at + MAX_LANES);
            self.face.resize(at + MAX_LANES);
        }
        V::select(lanes, t, V::splat(S::INFINITY)).store(&mut self.t[at..]);
        face.store(&mut self.face[at..]);
        self.leaf.push(leaf);
    }

    /// Adds both boundaries of a span in the lanes of `lanes`. Those that lie outside of the leaf's box, by more than rounding,
    /// go to infinity: there the leaf makes no difference, and a boundary must not count where it is not.
    #[inline(always)]
    pub fn push_span<V: Lanes<Scalar = S>>(&mut self, leaf: u32, lanes: u32, span: &Span<V>, within: &Interval<V>) {
        let Span { hit, t_in, t_out, face_in, face_out } = settled(span, lanes, within);
        if hit.any() {
            self.push(leaf, hit, t_in, face_in);
            self.push(leaf, hit, t_out, face_out);
        }
    }

    #[inline(always)]
    pub(super) fn time<V: Lanes<Scalar = S>>(&self, event: usize) -> V {
        V::load(&self.t[event * MAX_LANES..])
    }
}

/// `span` in the lanes of `lanes`, with boundaries outside of the leaf's box at infinity.
#[inline(always)]
pub(super) fn settled<V: Lanes>(span: &Span<V>, lanes: u32, within: &Interval<V>) -> Span<V> {
    let infinity = V::splat(V::Scalar::INFINITY);
    let settle = |t: V| {
        let t = V::select(t.cmp_lt(within.near), -infinity, t);
        V::select(within.far.cmp_lt(t), infinity, t)
    };
    let (t_in, t_out) = (settle(span.t_in), settle(span.t_out));
    // Both or none; NaN is none.
    let hit = span.hit & t_in.cmp_le(t_out) & V::Mask::from_bits(lanes);
    Span { hit, t_in, t_out, ..*span }
}
