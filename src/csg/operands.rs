//! The operands of a solid of one operation that a packet's lines meet, and where.

use super::direct::{Operation, Part};
use super::prune::Met;
use super::solid::{Search, Solid};
use super::sweep::Effort;
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::Span;

/// Most operands that a packet may meet.
pub(super) const MOST: usize = 16;

/// Where lanes are inside of operands, what they are asked for, and where they first cross a surface. In memory: whatever the
/// packet's width, it is worked out by vectors of the machine's.
#[derive(Debug, Default)]
#[repr(align(64))]
pub(super) struct Operands<S> {
    /// Entry, exit, and their faces; at infinity where the operand is not met. One more than there is room for.
    pub spans: [[[S; MAX_LANES]; 4]; MOST + 1],
    pub leaves: [u32; MOST + 1],
    /// Whether they count as their outside.
    pub outside: [bool; MOST + 1],
    pub count: usize,
    /// Boundaries before it do not count.
    pub earliest: [S; MAX_LANES],
    /// Boundaries after it do not count.
    pub limit: [S; MAX_LANES],
    /// Boundaries closer together are one.
    pub eps: [S; MAX_LANES],
    /// Ray parameter of the first boundary.
    pub t: [S; MAX_LANES],
    /// Face of the leaf.
    pub face: [S; MAX_LANES],
    /// By operand: lanes that first cross its surface.
    pub of: [u32; MOST],
    /// Lanes that are inside of all operands before that.
    pub leaving: u32,
    /// Lanes that are to be swept instead.
    pub together: u32,
    /// After a search: lanes that have left an operand that is needed before they come to a boundary. However far the search went,
    /// they meet none.
    pub through: u32,
}

impl<S: Real> Operands<S> {
    /// Lists the operands that lines meet, of all leaves; the lanes that meet all that are needed.
    #[inline(always)]
    pub fn of_all<V: Lanes<Scalar = S>>(
        &mut self,
        solid: &Solid<S>,
        operation: &Operation,
        part: &Part<'_, V>,
        eps: V,
    ) -> (Effort, u32) {
        let Part { packet, mut lanes, interval, limit, .. } = *part;
        let slack = eps + eps;
        let (start, end) = (packet.t_min - slack, limit + slack);
        let mut effort = Effort::default();
        for &leaf in &operation.order {
            let operand = operation.operands[leaf as usize];
            let clip = &solid.leaves[leaf as usize].clip;
            let within = if operand.is_bounds { *interval } else { Interval::of(packet, clip.lo, clip.hi) };
            let meets = within.near.cmp_le(within.far) & start.cmp_le(within.far) & (within.near - slack).cmp_le(end);
            let mut met = meets.bits() & lanes;
            if met != 0 {
                effort.met += 1;
                met = self.add(solid, operation, packet, (leaf, met), (&within, eps));
            }
            if operand.is_needed {
                lanes = met;
            }
            if lanes == 0 || self.is_overfull() {
                break;
            }
        }
        (effort, lanes)
    }

    /// Lists the operands that matter, of the leaves that a search finds: those that are needed, and of the others, which may be
    /// many, those whose boxes hold the place where lanes stand, from one place to the next. The lanes that meet all that are
    /// needed.
    #[inline(never)]
    pub fn of_met<V: Lanes<Scalar = S>>(
        &mut self,
        solid: &Solid<S>,
        operation: &Operation,
        part: &Part<'_, V>,
        eps: V,
        search: &mut Search<S>,
    ) -> (Effort, u32) {
        let Part { packet, mut lanes, limit, reach, .. } = *part;
        let earliest = part.earliest();
        solid.meet(packet, lanes, eps, reach, search);
        let effort = Effort { met: search.met.len(), ..Effort::default() };
        let is_needed = |met: &Met| operation.operands[met.leaf as usize].is_needed;
        let (mut place, mut last, mut exit) = (earliest, limit, V::splat(S::INFINITY));
        self.through = 0;
        let mut needed = 0;
        for met in search.met.iter().filter(|met| is_needed(met)) {
            let within = search.intervals.get::<V>(met.at);
            lanes &= self.add(solid, operation, packet, (met.leaf, met.lanes & lanes), (&within, eps));
            if lanes == 0 || self.is_overfull() {
                return (effort, lanes);
            }
            let [begin, end, ..] = &self.spans[self.count - 1];
            let end = V::load(end);
            (place, last, exit) = (place.fast_max(V::load(begin)), last.fast_min(end), exit.fast_min(end));
            needed += 1;
        }
        if needed != operation.needed {
            return (effort, 0);
        }
        search.met.retain(|met| !is_needed(met));
        let slack = eps + eps;
        let mut moves = true;
        while moves {
            moves = false;
            for met in &mut search.met {
                let here = lanes & met.lanes & place.cmp_le(last).bits();
                if met.operand == Met::UNSEEN {
                    let within = search.intervals.get::<V>(met.at);
                    let holds = (within.near - slack).cmp_le(place) & place.cmp_le(within.far + slack);
                    if holds.bits() & here == 0 {
                        continue;
                    }
                    self.see(solid, operation, packet, met, (&within, eps));
                    if self.is_overfull() {
                        return (effort, lanes);
                    }
                }
                if met.operand < self.count as u32 {
                    let [begin, end, ..] = &self.spans[met.operand as usize];
                    let end = V::load(end);
                    let inside = V::load(begin).cmp_le(place) & place.cmp_lt(end);
                    if inside.bits() & here != 0 {
                        place = V::select(inside, end, place);
                        moves = true;
                    }
                }
            }
        }
        self.through = lanes & exit.cmp_lt(place).bits();
        // Lanes that begin inside of all meet whatever comes.
        let free = lanes & place.cmp_le(earliest).bits();
        for met in search.met.iter_mut().filter(|met| met.operand == Met::UNSEEN && met.lanes & free != 0) {
            let within = search.intervals.get::<V>(met.at);
            self.see(solid, operation, packet, met, (&within, eps));
            if self.is_overfull() {
                break;
            }
        }
        (effort, lanes)
    }

    /// Whether there are more operands than there is room for: the last one is not kept.
    #[inline(always)]
    pub fn is_overfull(&self) -> bool {
        self.count > MOST
    }

    /// Adds where lanes are inside of a leaf that a search has found, and notes its number.
    #[inline(always)]
    fn see<V: Lanes<Scalar = S>>(
        &mut self,
        solid: &Solid<S>,
        operation: &Operation,
        packet: &Packet<V>,
        met: &mut Met,
        within: (&Interval<V>, V),
    ) {
        let number = self.count as u32;
        let hit = self.add(solid, operation, packet, (met.leaf, met.lanes), within);
        met.operand = if hit == 0 { Met::MISSED } else { number };
    }

    /// Adds where `lanes` are inside of a leaf whose box they meet in `within`; those that are at all.
    #[inline(always)]
    fn add<V: Lanes<Scalar = S>>(
        &mut self,
        solid: &Solid<S>,
        operation: &Operation,
        packet: &Packet<V>,
        (leaf, lanes): (u32, u32),
        within: (&Interval<V>, V),
    ) -> u32 {
        if lanes == 0 {
            return 0;
        }
        let outside = !operation.operands[leaf as usize].is_needed;
        // Two calls: the registers of one would be those of both.
        match solid.leaves[leaf as usize].kind.is_span() {
            true => solid.span_of(packet, (leaf, outside), lanes, within, self),
            false => solid.spans_of(packet, (leaf, outside), lanes, within, self),
        }
    }

    /// Adds a span of a leaf; the lanes that have it. `outside`: whether it counts as its outside.
    #[inline(always)]
    pub fn push<V: Lanes<Scalar = S>>(&mut self, span: &Span<V>, leaf: u32, outside: bool) -> u32 {
        let hit = span.hit.bits();
        if hit != 0 {
            let at = self.count.min(MOST);
            let never = V::splat(S::INFINITY);
            let [begin, end, face_in, face_out] = &mut self.spans[at];
            V::select(span.hit, span.t_in, never).store(begin);
            V::select(span.hit, span.t_out, never).store(end);
            span.face_in.store(face_in);
            span.face_out.store(face_out);
            (self.leaves[at], self.outside[at]) = (leaf, outside);
            self.count += 1;
        }
        hit
    }
}
