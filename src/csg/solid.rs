//! A compiled solid: leaves, operations, bounds, and a tree over the leaves' boxes where there are many.

use super::direct::Operation;
use super::events::{Events, settled};
use super::leaf::{Leaf, Stores};
use super::mesh::Crossings;
use super::operands::Operands;
use super::prune::Met;
use super::tree::Tree;
use crate::bvh::{self, Bundle};
use crate::lanes::{LaneMask, Lanes, Real};
use crate::math::Aabb;
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::Span;

/// Boundaries closer than this many roundings of the coordinates are one: 16 half ulps.
pub(super) const ROUNDINGS: f64 = 16.0;
/// What two leaves make of one place differs by so many: what an answer may be off by, too.
const OF_ONE_PLACE: f64 = 4.0;
/// Layers of leaves, were they spread evenly, in the first part of a line (tried: 0.5 to 3).
const LAYERS: f64 = 2.0;
/// More bounded leaves than this are searched by a tree.
pub(super) const LINEAR: usize = 24;

/// Where the lines of a packet meet boxes.
#[derive(Debug, Default)]
pub struct Intervals<S> {
    /// As long as it ever was: filling it anew costs as much as the boxes.
    numbers: Vec<S>,
    len: usize,
}

impl<S: Real> Intervals<S> {
    /// Forgets them.
    fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds one; its place.
    #[inline(always)]
    fn push<V: Lanes<Scalar = S>>(&mut self, interval: &Interval<V>) -> u32 {
        let at = self.len;
        self.len += 2 * V::N;
        if self.numbers.len() < self.len {
            self.numbers.resize(self.len, S::ZERO);
        }
        interval.near.store(&mut self.numbers[at..]);
        interval.far.store(&mut self.numbers[at + V::N..]);
        at as u32
    }

    /// The one in a place.
    #[inline(always)]
    pub(super) fn get<V: Lanes<Scalar = S>>(&self, at: u32) -> Interval<V> {
        let of_box = &self.numbers[at as usize..];
        Interval { near: V::load(of_box), far: V::load(&of_box[V::N..]) }
    }
}

/// Which leaves a packet's lines meet.
#[derive(Debug, Default)]
pub struct Search<S> {
    pub(super) met: Vec<Met>,
    pub(super) intervals: Intervals<S>,
    stack: Vec<(u32, u32)>,
}

/// One solid, ready to be traced.
#[derive(Clone, Debug)]
pub struct Solid<S> {
    pub(super) tree: Tree,
    pub(super) leaves: Vec<Leaf<S>>,
    /// Numbers of the leaves in the program it was compiled from.
    pub(super) numbers: Vec<u32>,
    pub(super) stores: Stores<S>,
    /// Outside of this box there is nothing; infinite where a complement reaches everywhere.
    pub bounds: Aabb<S>,
    /// Largest coordinate of the bounded leaves' boxes.
    pub(super) size: S,
    /// Least distance of two boundaries, in the tree's space.
    pub(super) least: S,
    /// Tree over the boxes of bounded leaves, and which leaf is in each of its own; `None` for small solids.
    pub(super) search: Option<(bvh::Tree<S>, Vec<u32>)>,
    /// Leaves that the tree does not hold.
    pub(super) always: Vec<u32>,
    /// Whether it is its only leaf, box and all.
    pub(super) is_sole: bool,
    /// Share of a line's way through it that is looked at first.
    pub(super) front: f64,
    /// If it is one operation, whose first boundary needs no sweep.
    pub(super) operation: Option<Box<Operation>>,
}

impl<S: Real> Solid<S> {
    /// Number of leaf `leaf` of a [`super::Boundary`] in the program that this solid was compiled from.
    #[inline(always)]
    pub fn number(&self, leaf: u32) -> u32 {
        self.numbers[leaf as usize]
    }

    /// Whether it is everything but a part of space: inside where no leaf is met.
    pub fn reaches_everywhere(&self) -> bool {
        self.tree.nodes[0].default
    }

    /// Whether some of its leaves are made of triangles.
    pub fn has_meshes(&self) -> bool {
        !self.stores.meshes.is_empty()
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    /// Bytes of leaves, operations and trees.
    pub fn bytes(&self) -> usize {
        let search = self.search.as_ref();
        let search = search.map_or(0, |(tree, numbers)| size_of_val(&tree.nodes[..]) + size_of_val(&numbers[..]));
        let own = size_of_val(&self.leaves[..]) + size_of_val(&self.stores.planes[..]) + size_of_val(&self.numbers[..]);
        own + self.stores.meshes.iter().map(|m| m.bytes()).sum::<usize>() + self.tree.bytes() + search
    }

    /// Difference of t below which two boundaries of a lane are one. It depends on the lane's line only.
    #[inline(always)]
    pub fn tolerance<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>) -> V {
        tolerance(packet, self.size, self.least, ROUNDINGS)
    }

    /// Difference of t below which rounding does not tell which of two leaves' surfaces comes first. Far less than the tolerance if
    /// they are small parts of a large solid.
    pub(super) fn untold<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, leaves: [u32; 2]) -> V {
        let sizes = leaves.map(|leaf| largest_coordinate(&self.leaves[leaf as usize].clip));
        let size = sizes[0].fast_max(sizes[1]);
        tolerance(packet, if size.is_finite() { size } else { self.size }, self.least, OF_ONE_PLACE)
    }

    /// Share of a line's way through the solid that is looked at first: a few layers of leaves, were they spread evenly.
    pub(super) fn front_share(&self) -> f64 {
        if self.search.is_none() || !self.bounds.is_bounded() {
            1.0
        } else {
            LAYERS / (self.leaves.len() as f64).cbrt()
        }
    }

    /// Lists the leaves that some of `lanes` meet between the segment's start and `reach`, give or take, each once.
    #[inline(always)]
    pub(super) fn meet<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        lanes: u32,
        eps: V,
        reach: V,
        search: &mut Search<S>,
    ) {
        let Search { met, intervals, stack } = search;
        met.clear();
        intervals.clear();
        let (start, end) = (packet.t_min - (eps + eps), reach + (eps + eps));
        let meets = |interval: &Interval<V>| {
            let Interval { near, far } = *interval;
            (near.cmp_le(far) & start.cmp_le(far) & near.cmp_le(end)).bits()
        };
        for &leaf in &self.always {
            let clip = &self.leaves[leaf as usize].clip;
            let interval = Interval::of(packet, clip.lo, clip.hi);
            let lanes = meets(&interval) & lanes;
            if lanes != 0 {
                met.push(Met { leaf, lanes, at: intervals.push(&interval), operand: Met::UNSEEN });
            }
        }
        let Some((tree, numbers)) = &self.search else { return };
        if tree.nodes.is_empty() {
            return;
        }
        // All lanes against eight boxes at once first.
        let bundle = Bundle::of(packet, lanes, end).starting(start);
        let mut near = [S::ZERO; bvh::WIDTH];
        stack.clear();
        stack.push((0, lanes));
        while let Some((node, lanes)) = stack.pop() {
            let node = &tree.nodes[node as usize];
            let mut slots = bundle.children::<V>(node, &mut near) & ((1 << node.used) - 1);
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                let interval = bundle.interval(packet, node, slot);
                let lanes = meets(&interval) & lanes;
                if lanes == 0 {
                    continue;
                }
                let child = node.child(slot);
                if child.is_leaf() {
                    let leaf = numbers[child.index as usize];
                    met.push(Met { leaf, lanes, at: intervals.push(&interval), operand: Met::UNSEEN });
                } else {
                    stack.push((child.index, lanes));
                }
            }
        }
    }

    /// Adds the boundaries of a leaf, unless it lies beyond `limit` in all lanes. `eps`: the tolerance.
    #[inline(always)]
    pub(super) fn boundaries<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        (met, intervals): (&Met, &Intervals<S>),
        slot: u32,
        limit: V,
        eps: V,
        events: &mut Events<S>,
        crossings: &mut Crossings,
    ) {
        let slack = eps + eps;
        let within = intervals.get::<V>(met.at);
        // Groups of boundaries that begin before the limit end less than `slack` after it.
        if (within.near - slack).cmp_le(limit + slack).bits() & met.lanes != 0 {
            self.boundaries_within(packet, met, slot, (&within, eps), events, crossings);
        }
    }

    /// Adds where lines `lanes`, which meet a leaf's box in `interval`, are inside of it to `operands`, if it is of a kind that
    /// lines pass through at most once. The lanes that are at all. `eps`: the tolerance; `outside`: whether its outside is meant.
    #[inline(never)]
    pub(super) fn span_of<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        (leaf, outside): (u32, bool),
        lanes: u32,
        (interval, eps): (&Interval<V>, V),
        operands: &mut Operands<S>,
    ) -> u32 {
        let span = self.leaves[leaf as usize].span(packet, &self.stores);
        span.map_or(0, |span| operands.push(&settled(&span, lanes, &widened(interval, eps)), leaf, outside))
    }

    /// The same if it is of a kind that lines may pass through more than once, and no mesh. It is then outside of each of its
    /// spans; or inside from the first to the last one, and outside of what is between them.
    #[inline(never)]
    pub(super) fn spans_of<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        (leaf, outside): (u32, bool),
        lanes: u32,
        (interval, eps): (&Interval<V>, V),
        operands: &mut Operands<S>,
    ) -> u32 {
        let within = widened(interval, eps);
        let mut hit = 0;
        let zero = V::constant(0.0);
        let mut whole = Span { hit: V::Mask::from_bits(0), t_in: zero, t_out: zero, face_in: zero, face_out: zero };
        self.leaves[leaf as usize].spans(packet, |span| {
            let span = settled(&span, lanes, &within);
            if outside {
                hit |= operands.push(&span, leaf, true);
                return;
            }
            let (before, after) = (whole, span);
            let gap = Span {
                hit: before.hit & after.hit,
                t_in: before.t_out,
                t_out: after.t_in,
                face_in: before.face_out,
                face_out: after.face_in,
            };
            operands.push(&gap, leaf, true);
            let (first, last) = (|a: V, b: V| V::select(before.hit, a, b), |a: V, b: V| V::select(after.hit, b, a));
            whole = Span {
                hit: before.hit | after.hit,
                t_in: first(before.t_in, after.t_in),
                face_in: first(before.face_in, after.face_in),
                t_out: last(before.t_out, after.t_out),
                face_out: last(before.face_out, after.face_out),
            };
        });
        hit | operands.push(&whole, leaf, false)
    }

    /// Adds the boundaries of a leaf whose box the lines meet in `interval`. `eps`: the tolerance.
    #[inline(never)]
    pub(super) fn boundaries_within<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        met: &Met,
        slot: u32,
        (interval, eps): (&Interval<V>, V),
        events: &mut Events<S>,
        crossings: &mut Crossings,
    ) {
        let within = widened(interval, eps);
        let leaf = &self.leaves[met.leaf as usize];
        leaf.boundaries(packet, &within, (&self.stores, eps), (slot, met.lanes), (events, crossings));
    }
}

/// Difference of t below which two boundaries of a lane are one, for a solid of this `size` and `least` distance: `roundings` of the
/// coordinates.
#[inline(always)]
pub(super) fn tolerance<V: Lanes>(packet: &Packet<V>, size: V::Scalar, least: V::Scalar, roundings: f64) -> V {
    let largest = |v: [V; 3]| v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs());
    let reach = largest(packet.org) + V::splat(size);
    let distance = (reach * V::constant(roundings * V::Scalar::EPSILON.to_f64())).fast_max(V::splat(least));
    // One over the largest component of the direction.
    let [x, y, z] = packet.rcp.map(V::abs);
    // Infinite, nothing would be told apart, and an end at minus infinity would come to no number.
    (distance * x.fast_min(y).fast_min(z)).fast_min(V::splat(V::Scalar::MAX))
}

/// The largest coordinate of a box, without its sign.
pub(super) fn largest_coordinate<S: Real>(bounds: &Aabb<S>) -> S {
    bounds.lo.iter().chain(&bounds.hi).fold(S::ZERO, |most, x| most.fast_max(x.abs()))
}

/// Where boundaries of a leaf may lie whose box is met in `interval`.
#[inline(always)]
pub(super) fn widened<V: Lanes>(interval: &Interval<V>, eps: V) -> Interval<V> {
    let slack = eps + eps;
    Interval { near: interval.near - slack, far: interval.far + slack }
}
