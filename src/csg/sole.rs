//! Solids that are one leaf which lines pass through at most once: all that it takes to trace one in one place
//! (sphere flakes: results/NOTES.md).

use super::events::settled;
use super::leaf::Leaf;
use super::solid::{ROUNDINGS, Solid, tolerance, widened};
use crate::lanes::{Lanes, Real};
use crate::math::Aabb;
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::Span;

/// One of them. What is needed first comes first: two lines of a cache for a ball.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Sole<S> {
    /// Number of the solid, for who holds it.
    pub solid: u32,
    /// Number of its primitive, for who holds it.
    pub prim: u32,
    size: S,
    least: S,
    /// Its box is the solid's.
    leaf: Leaf<S>,
}

impl<S: Real> Solid<S> {
    /// As number `solid` of a list, if it is one leaf, box and all, which lines pass through at most once. `first_prim`: number of
    /// the primitive that leaf 0 of its program is.
    pub fn sole(&self, solid: u32, first_prim: u32) -> Option<Sole<S>> {
        let only = self.leaves.first().filter(|leaf| self.is_sole && leaf.kind.is_span());
        only.map(|leaf| Sole {
            solid,
            prim: first_prim + self.number(0),
            size: self.size,
            least: self.least,
            leaf: *leaf,
        })
    }
}

impl<S: Real> Sole<S> {
    /// Box of the solid.
    #[inline(always)]
    pub fn bounds(&self) -> &Aabb<S> {
        &self.leaf.clip
    }

    /// Where lines `lanes`, which meet its box in `interval`, are inside of it; lines that only touch it are not, as for the sweep.
    /// `solid`: what it was made of.
    #[inline(always)]
    pub fn span<V: Lanes<Scalar = S>>(
        &self,
        solid: &Solid<S>,
        packet: &Packet<V>,
        lanes: u32,
        interval: &Interval<V>,
    ) -> Option<Span<V>> {
        let span = self.leaf.span(packet, &solid.stores)?;
        let eps = tolerance(packet, self.size, self.least, ROUNDINGS);
        let span = settled(&span, lanes, &widened(interval, eps));
        Some(Span { hit: span.hit & (span.t_in + eps).cmp_lt(span.t_out), ..span })
    }
}
