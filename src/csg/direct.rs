//! The first boundary of one operation over leaves that lines pass through at most once, straight from where they enter and
//! leave them: a block less its holes is most of what models are made of.
//!
//! A union is the outside of what is outside of all operands, so one rule does for both: inside of all operands, of which
//! some count as their outside. Where two boundaries of a lane lie together this is not enough, and the lane is swept.
//!
//! Source of the intervals: Roth, "Ray casting for modeling solids", 1982.

use super::solid::Solid;
use super::sweep::{Boundary, Effort};
use super::tree::{Gate, LeafPlace, Tree};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::Span;

/// Most operands that lines may meet.
const MOST: usize = 4;

/// A solid that is one operation.
#[derive(Clone, Debug)]
pub(super) struct Operation {
    is_union: bool,
    operands: Vec<Operand>,
}

/// One of its operands.
#[derive(Clone, Copy, Debug)]
struct Operand {
    leaf: u32,
    /// Whether the leaf's outside is meant.
    negated: bool,
    /// Whether lanes that miss it have nothing to look for: it comes before those where they do.
    is_needed: bool,
    /// Whether its box is the solid's.
    is_bounds: bool,
}

impl Operation {
    /// The one that `tree` is, if that is a union or an intersection; `is_bounds`: whether the box of a leaf is the solid's.
    pub fn of(tree: &Tree, is_bounds: impl Fn(u32) -> bool) -> Option<Self> {
        let [only] = &tree.nodes[..] else { return None };
        let is_union = match only.gate {
            Gate::And => false,
            Gate::Or => true,
            Gate::Xor => return None,
        };
        let operand = |(leaf, place): (u32, &LeafPlace)| {
            let LeafPlace { negated, strong, .. } = *place;
            Operand { leaf, negated, is_needed: strong, is_bounds: is_bounds(leaf) }
        };
        let mut operands: Vec<_> = (0..).zip(&tree.leaves).map(operand).collect();
        operands.sort_by_key(|operand| !operand.is_needed);
        // Some may have been left out.
        let needed = operands.iter().filter(|operand| operand.is_needed).count();
        (needed == only.strong_operands as usize).then_some(Self { is_union, operands })
    }
}

/// Where lanes are inside of operands, what they are asked for, and where they first cross a surface. In memory: whatever the
/// packet's width, it is worked out by vectors of the machine's.
#[derive(Debug, Default)]
#[repr(align(64))]
pub(super) struct Operands<S> {
    /// Entry, exit, and their faces; at infinity where the operand is not met.
    spans: [[[S; MAX_LANES]; 4]; MOST],
    /// Number of each in the operation.
    numbers: [usize; MOST],
    count: usize,
    /// Boundaries before it do not count.
    earliest: [S; MAX_LANES],
    /// Boundaries after it do not count.
    limit: [S; MAX_LANES],
    /// Boundaries closer together are one.
    eps: [S; MAX_LANES],
    /// Ray parameter of the first boundary.
    t: [S; MAX_LANES],
    /// Face of the leaf.
    face: [S; MAX_LANES],
    /// By operand: lanes that first cross its surface.
    of: [u32; MOST],
    /// Lanes that are inside of all operands before that.
    leaves: u32,
    /// Lanes that are to be swept instead.
    together: u32,
}

/// Reports the first boundary of `solid`, which is `operation`, to `found`; see [`super::sweep`]. Returns the lanes for which that is
/// not enough.
#[inline(always)]
pub(super) fn first<V: Lanes>(
    solid: &Solid<V::Scalar>,
    operation: &Operation,
    packet: &Packet<V>,
    (lanes, interval): (u32, &Interval<V>),
    limit: V,
    operands: &mut Operands<V::Scalar>,
    found: &mut impl FnMut(&Boundary<V>) -> u32,
) -> (Effort, u32) {
    let eps = solid.tolerance(packet);
    let slack = eps + eps;
    let limit = limit.fast_min(V::splat(V::Scalar::MAX));
    let (start, end) = (packet.t_min - slack, limit + slack);
    let mut effort = Effort::default();
    let mut lanes = lanes;
    operands.count = 0;
    for (number, operand) in operation.operands.iter().enumerate() {
        let clip = &solid.leaves[operand.leaf as usize].clip;
        let within = if operand.is_bounds { *interval } else { Interval::of(packet, clip.lo, clip.hi) };
        let meets = within.near.cmp_le(within.far) & start.cmp_le(within.far) & (within.near - slack).cmp_le(end);
        let mut met = meets.bits() & lanes;
        if met != 0 {
            effort.met += 1;
            if operands.count == MOST {
                return (Effort::default(), lanes);
            }
            met = solid.operand(packet, operand.leaf, (met, number), (&within, eps), operands);
        }
        if operand.is_needed {
            lanes = met;
            if lanes == 0 {
                return (effort, 0);
            }
        }
    }
    let count = operands.count;
    effort = Effort { kept: count, events: 2 * count, steps: 1, ..effort };
    // Boundaries before the solid's box count as there.
    let all_count = packet.t_min.cmp_le(packet.t_floor.fast_max(interval.near));
    V::select(all_count, V::splat(-V::Scalar::MAX), packet.t_min).store(&mut operands.earliest);
    limit.store(&mut operands.limit);
    eps.store(&mut operands.eps);
    // A union is the outside of what is outside of all.
    let outside = |i: usize| !operation.operands[operands.numbers[i]].is_needed;
    match count {
        0 => return (effort, 0),
        1 => operands.find([outside(0)], lanes),
        2 => operands.find([outside(0), outside(1)], lanes),
        3 => operands.find([outside(0), outside(1), outside(2)], lanes),
        _ => operands.find([outside(0), outside(1), outside(2), outside(3)], lanes),
    }
    let (t, face) = (V::load(&operands.t), V::load(&operands.face));
    let enters = if operation.is_union { operands.leaves } else { !operands.leaves };
    for i in 0..count {
        let lanes = operands.of[i];
        if lanes != 0 {
            let operand = &operation.operands[operands.numbers[i]];
            let turned = if operand.negated { lanes } else { 0 };
            found(&Boundary { lanes, t, face, enters: enters & lanes, turned, leaf: operand.leaf });
        }
    }
    (effort, operands.together)
}

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
    /// Adds where lines are inside of operand `number`: the lanes that are at all.
    #[inline(always)]
    pub fn push<V: Lanes<Scalar = S>>(&mut self, number: usize, span: &Span<V>) -> u32 {
        let hit = span.hit.bits();
        if hit != 0 {
            let never = V::splat(S::INFINITY);
            let [begin, end, face_in, face_out] = &mut self.spans[self.count % MOST];
            V::select(span.hit, span.t_in, never).store(begin);
            V::select(span.hit, span.t_out, never).store(end);
            span.face_in.store(face_in);
            span.face_out.store(face_out);
            self.numbers[self.count % MOST] = number;
            self.count += 1;
        }
        hit
    }

    /// Finds the first boundary in each of `lanes` of what is inside of all `N` operands, some of which count as their `outside`.
    #[inline(never)]
    fn find<const N: usize>(&mut self, outside: [bool; N], lanes: u32) {
        (self.of, self.leaves, self.together) = ([0; MOST], 0, 0);
        for first in (0..MAX_LANES).step_by(S::Wide::N) {
            let here = lanes >> first & S::Wide::ALL;
            if here != 0 {
                self.find_from(outside, first, here);
            }
        }
    }

    /// The same for the vector of lanes from `first` on.
    #[inline(always)]
    fn find_from<const N: usize>(&mut self, outside: [bool; N], first: usize, lanes: u32) {
        type Mask<S> = <<S as Real>::Wide as Lanes>::Mask;
        let load = |from: &[S; MAX_LANES]| S::Wide::load(&from[first..]);
        let (earliest, limit, eps) = (load(&self.earliest), load(&self.limit), load(&self.eps));
        let ends: [[Place<S::Wide>; 2]; N] = std::array::from_fn(|i| {
            let [begin, end, face_in, face_out] = &self.spans[i];
            let operand = S::Wide::constant(i as f64);
            [
                Place { t: load(begin), face: load(face_in), operand },
                Place { t: load(end), face: load(face_out), operand },
            ]
        });
        // Nothing is close to infinity, also not infinity.
        let apart = eps + eps;
        let close = |a: Place<S::Wide>, b: Place<S::Wide>| (a.t - b.t).abs().cmp_le(apart);
        let mut together = Mask::<S>::from_bits(0);
        for i in 0..N {
            let [begin, end] = ends[i];
            together = together | close(begin, end);
            for [a, b] in &ends[..i] {
                together = together | close(begin, *a) | close(begin, *b) | close(end, *a) | close(end, *b);
            }
        }
        // Inside of all that do not count as their outside.
        let always = S::Wide::splat(S::INFINITY);
        let nothing = S::Wide::constant(0.0);
        let mut start = Place { t: -always, face: nothing, operand: nothing };
        let mut last = Place { t: always, ..start };
        for i in 0..N {
            if !outside[i] {
                let [begin, end] = ends[i];
                start = start.moved(start.t.cmp_lt(begin.t), begin);
                last = last.moved(end.t.cmp_lt(last.t), end);
            }
        }
        let counts = |t: S::Wide| earliest.cmp_le(t);
        let within = !counts(start.t) & counts(last.t);
        let mut leaves = Mask::<S>::from_bits(0);
        let mut leaving = last;
        if within.bits() & lanes != 0 {
            // Lanes that begin there: behind the last of what they are in, or, in none, free until they leave or meet one.
            let mut covered = Mask::<S>::from_bits(0);
            for i in 0..N {
                if outside[i] {
                    let [begin, end] = ends[i];
                    let covers = within & !counts(begin.t) & counts(end.t);
                    covered = covered | covers;
                    start = start.moved(covers & start.t.cmp_lt(end.t), end);
                    leaving = leaving.moved(counts(begin.t) & begin.t.cmp_lt(leaving.t), begin);
                }
            }
            leaves = within & !covered;
        }
        // What begins inside of an operand that counts as its outside begins behind it.
        for _ in outside.iter().filter(|&&outside| outside) {
            for i in 0..N {
                if outside[i] {
                    let [begin, end] = ends[i];
                    start = start.moved(begin.t.cmp_le(start.t) & start.t.cmp_lt(end.t), end);
                }
            }
        }
        let found = start.moved(leaves, leaving);
        let crosses = leaves | (counts(start.t) & start.t.cmp_lt(last.t));
        let together = together.bits() & lanes;
        let lanes = (crosses & found.t.cmp_le(limit)).bits() & lanes & !together;
        found.t.store(&mut self.t[first..]);
        found.face.store(&mut self.face[first..]);
        for i in 0..N {
            self.of[i] |= (found.operand.cmp_eq(S::Wide::constant(i as f64)).bits() & lanes) << first;
        }
        self.leaves |= (leaves.bits() & lanes) << first;
        self.together |= together << first;
    }
}
