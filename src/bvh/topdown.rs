//! Binary trees from the root down, by the surface area heuristic.
//!
//! Sources: Goldsmith, Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", IEEE CG&A 7(5), 1987 (the
//! heuristic); Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", RT 2007 (binning).

use rayon::prelude::*;

use super::cost::Cost;
use crate::lanes::{Lanes, each, f32x8, with_large_pages};

/// Bins per axis, at most.
const BINS: usize = 32;
/// Parts from which on an axis is binned; fewer are sorted along it and every place is asked.
const BINNED: usize = 13;
/// Parts from which on both sides are built at once.
const PARALLEL: usize = 4096;
/// Parts that one thread puts into bins in one go.
const CHUNK: usize = 1 << 15;

/// A box: lower x, y, z, anything, then minus the upper ones, anything. A union is one minimum.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Span(pub [f32; 8]);

impl Span {
    /// The empty box.
    pub const EMPTY: Self = Self([f32::INFINITY; 8]);

    /// From lower and upper corner.
    pub fn new(lo: [f32; 3], hi: [f32; 3]) -> Self {
        Self([lo[0], lo[1], lo[2], 0.0, -hi[0], -hi[1], -hi[2], 0.0])
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        let mut both = Self::EMPTY;
        f32x8::load(&self.0).fast_min(f32x8::load(&other.0)).store(&mut both.0);
        both
    }

    /// Half the surface area.
    #[inline(always)]
    pub fn area(&self) -> f32 {
        let [x, y, z] = each(|a| -(self.0[a] + self.0[a + 4]));
        x * y + y * z + z * x
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> [f32; 3] {
        each(|axis| self.along(axis))
    }

    /// The same of one axis.
    #[inline(always)]
    fn along(&self, axis: usize) -> f32 {
        self.0[axis] - self.0[axis + 4]
    }

    /// The lower corner and the upper one.
    pub fn corners(&self) -> [[f32; 3]; 2] {
        [each(|a| self.0[a]), each(|a| -self.0[a + 4])]
    }
}

/// A primitive to be put into a tree: its box, in a frame of about unit size, and its number.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Part(Span);

impl Part {
    /// Primitive `prim`, which has the box `span`.
    pub fn new(mut span: Span, prim: u32) -> Self {
        // The box leaves two numbers' room. Its halves are ordinary numbers there; as bits they would be denormal, and slow.
        (span.0[3], span.0[7]) = (f32::from((prim >> 16) as u16), f32::from(prim as u16));
        Self(span)
    }

    /// Its number.
    pub fn prim(&self) -> u32 {
        (self.0.0[3] as u32) << 16 | self.0.0[7] as u32
    }
}

/// A node of a new tree over a list of parts, which building puts in order. The left child follows its parent.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Lower and upper corner of the box of all below.
    pub bounds: [[f32; 3]; 2],
    /// Parts below.
    pub count: u32,
    /// Of an inner node: how many nodes after it the right child comes; of a leaf: its first part.
    pub at: u32,
    /// A leaf holds one part, or a block at most that costs least as one leaf, or more than a block of such parts whose centres
    /// nothing tells apart.
    pub leaf: bool,
}

impl Node {
    fn leaf(extent: &Extent, count: usize, first: usize) -> Self {
        Self { bounds: extent.bounds.corners(), count: count as u32, at: first as u32, leaf: true }
    }

    /// Makes an inner node of it, whose left child has `left` nodes.
    fn divide(&mut self, left: usize) {
        (self.leaf, self.at) = (false, left as u32 + 1);
    }

    /// The children of the inner node that is the `own`th of the list.
    pub fn children(&self, own: usize) -> [usize; 2] {
        [own + 1, own + self.at as usize]
    }
}

/// How trees are built.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Primitives in a block.
    pub block: usize,
    /// Centres (twice) closer than this on every axis are not told apart.
    pub least: f32,
    /// Nodes on a path from which on subtrees are halved, as recursion has to end soon whatever the boxes are.
    pub deepest: usize,
    /// Cost in the scene that the parts make up.
    pub cost: Cost,
}

/// Builds a tree over some parts, whose root is the first node. Deterministic on any number of threads.
pub fn build(parts: &mut [Part], rules: Rules) -> Vec<Node> {
    if parts.is_empty() {
        return Vec::new();
    }
    let all = match parts.len() {
        0..=CHUNK => Extent::of(parts),
        _ => parts.par_chunks(CHUNK).map(Extent::of).reduce(|| Extent::EMPTY, Extent::join),
    };
    let lists = grow_apart(parts, 0, &all, rules, 0);
    let mut nodes = with_large_pages(lists.iter().map(Vec::len).sum());
    lists.iter().for_each(|list| nodes.extend_from_slice(list));
    nodes
}

/// The tree over `parts`, which begin at `first` of all parts and have the extent `all`, `level` nodes below the root, as lists of
/// nodes to be put together.
fn grow_apart(parts: &mut [Part], first: usize, all: &Extent, rules: Rules, level: usize) -> Vec<Vec<Node>> {
    if parts.len() < PARALLEL {
        let mut nodes = Vec::new();
        grow(parts, first, all, rules, level, &mut nodes);
        return vec![nodes];
    }
    let mut root = Node::leaf(all, parts.len(), first);
    let Some((on_left, sides)) = split(parts, all, rules, level) else { return vec![vec![root]] };
    let (left, right) = parts.split_at_mut(on_left);
    let (mut left, mut right) = rayon::join(
        || grow_apart(left, first, &sides[0], rules, level + 1),
        || grow_apart(right, first + on_left, &sides[1], rules, level + 1),
    );
    root.divide(left.iter().map(Vec::len).sum());
    let mut lists = vec![vec![root]];
    lists.append(&mut left);
    lists.append(&mut right);
    lists
}

/// Appends that tree to `nodes`.
fn grow(parts: &mut [Part], first: usize, all: &Extent, rules: Rules, level: usize, nodes: &mut Vec<Node>) {
    let root = nodes.len();
    nodes.push(Node::leaf(all, parts.len(), first));
    let Some((on_left, sides)) = split(parts, all, rules, level) else { return };
    let (left, right) = parts.split_at_mut(on_left);
    grow(left, first, &sides[0], rules, level + 1, nodes);
    let on_left_side = nodes.len() - root - 1;
    nodes[root].divide(on_left_side);
    grow(right, first + on_left, &sides[1], rules, level + 1, nodes);
}

/// A split: how many parts go to the left, and the extents of both sides.
type Sides = (usize, [Extent; 2]);

/// Puts the parts of the left side first, or finds that all are one leaf.
fn split(parts: &mut [Part], all: &Extent, rules: Rules, level: usize) -> Option<Sides> {
    let n = parts.len();
    let [low, high] = all.centres.corners();
    let told_apart = (0..3).any(|a| high[a] - low[a] > rules.least);
    let is_one_leaf = n == 1 || n <= rules.block && rules.cost.is_one_leaf(all.bounds.area(), n as u32);
    if is_one_leaf || !told_apart && n > rules.block {
        return None;
    }
    // Areas that are no numbers are not split: left to a frame of their own.
    let on_left = match n {
        _ if !told_apart || level > rules.deepest => halve(parts),
        0..BINNED => split_sorted(parts, rules)?,
        _ => return split_binned(parts, low, high, rules),
    };
    let (left, right) = parts.split_at(on_left);
    Some((on_left, [left, right].map(Extent::of)))
}

/// Box of some parts, and box of their centres (twice).
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Span,
    centres: Span,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Span::EMPTY, centres: Span::EMPTY };

    fn of(parts: &[Part]) -> Self {
        parts.iter().fold(Self::EMPTY, |all, part| all.join(Self::one(part)))
    }

    #[inline(always)]
    fn one(part: &Part) -> Self {
        let centre = part.0.centre();
        Self { bounds: part.0, centres: Span::new(centre, centre) }
    }

    #[inline(always)]
    fn join(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(&other.bounds), centres: self.centres.union(&other.centres) }
    }
}

/// The cheapest split found so far.
#[derive(Clone, Copy, Debug)]
struct Split {
    cost: f32,
    /// Parts that one side has more than the other: what decides where areas vanish.
    uneven: u32,
    axis: usize,
    /// Bins or parts on the left.
    left: usize,
}

impl Split {
    const NONE: Self = Self { cost: f32::INFINITY, uneven: 0, axis: 0, left: 0 };

    /// Takes the cheapest place between the `boxes` of one axis, of which each holds `counts` parts.
    #[inline(always)]
    fn look(&mut self, axis: usize, boxes: &[Span], counts: impl Fn(usize) -> u32, rules: Rules) {
        let cost = |span: &Span, count: u32| rules.cost.guess(span.area(), count, rules.block);
        let mut right = [(f32::INFINITY, 0); BINS];
        let (mut span, mut count) = (Span::EMPTY, 0);
        for i in (1..boxes.len()).rev() {
            (span, count) = (span.union(&boxes[i]), count + counts(i));
            if count != 0 {
                right[i] = (cost(&span, count), count);
            }
        }
        let (mut span, mut count) = (Span::EMPTY, 0);
        for i in 1..boxes.len() {
            (span, count) = (span.union(&boxes[i - 1]), count + counts(i - 1));
            if count == 0 {
                continue;
            }
            let (cost, uneven) = (cost(&span, count) + right[i].0, count.abs_diff(right[i].1));
            if cost < self.cost || cost == self.cost && uneven < self.uneven {
                *self = Self { cost, uneven, axis, left: i };
            }
        }
    }
}

/// Where nothing but size tells apart, or trees would become too deep: the smaller half goes to the left.
fn halve(parts: &mut [Part]) -> usize {
    parts.sort_unstable_by(|a, b| a.0.area().total_cmp(&b.0.area()).then(a.prim().cmp(&b.prim())));
    parts.len() / 2
}

/// Sorts few parts along each axis; puts them in the order of the best and returns how many go to the left.
#[inline(never)]
fn split_sorted(parts: &mut [Part], rules: Rules) -> Option<usize> {
    let n = parts.len();
    let mut best = Split::NONE;
    let mut orders = [[0; BINNED]; 3];
    for (axis, order) in orders.iter_mut().enumerate() {
        for (i, part) in parts.iter().enumerate() {
            order[i] = u64::from(ascending(part.0.along(axis))) << 32 | i as u64;
        }
        order[..n].sort_unstable();
        let mut boxes = [Span::EMPTY; BINNED];
        (0..n).for_each(|i| boxes[i] = parts[order[i] as u32 as usize].0);
        best.look(axis, &boxes[..n], |_| 1, rules);
    }
    if best.cost == f32::INFINITY {
        return None;
    }
    let mut sorted = [parts[0]; BINNED];
    (0..n).for_each(|i| sorted[i] = parts[orders[best.axis][i] as u32 as usize]);
    parts.copy_from_slice(&sorted[..n]);
    Some(best.left)
}

/// Bits that are in order where numbers are.
#[inline(always)]
fn ascending(x: f32) -> u32 {
    let bits = x.to_bits();
    bits ^ if x.is_sign_negative() { u32::MAX } else { 1 << 31 }
}

/// Boxes of what falls into the bins of three axes, and how much that is.
#[derive(Clone)]
struct Bins {
    boxes: [[Span; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    const EMPTY: Self = Self { boxes: [[Span::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };

    fn of(parts: &[Part], places: &Places) -> Self {
        let mut bins = Self::EMPTY;
        for part in parts {
            let at = each(|axis| places.of(&part.0, axis));
            for (axis, at) in at.into_iter().enumerate() {
                bins.boxes[axis][at] = bins.boxes[axis][at].union(&part.0);
                bins.counts[axis][at] += 1;
            }
        }
        bins
    }

    fn join(mut self, other: Self) -> Self {
        for axis in 0..3 {
            for i in 0..BINS {
                self.boxes[axis][i] = self.boxes[axis][i].union(&other.boxes[axis][i]);
                self.counts[axis][i] += other.counts[axis][i];
            }
        }
        self
    }
}

/// Where the middles of the first bins are, how many there are to a unit, and the last.
struct Places {
    first: [f32; 3],
    scale: [f32; 3],
    last: f32,
}

/// What is added to small numbers to have their nearest whole number in the lowest bits.
const WHOLE: f32 = (3 << 22) as f32;

impl Places {
    fn new(low: [f32; 3], high: [f32; 3], count: usize) -> Self {
        let scale = each(|a| if high[a] > low[a] { count as f32 / (high[a] - low[a]) } else { 0.0 });
        let first = each(|a| if scale[a] > 0.0 { low[a] + 0.5 / scale[a] } else { low[a] });
        Self { first, scale, last: (count - 1) as f32 }
    }

    #[inline(always)]
    fn of(&self, bounds: &Span, axis: usize) -> usize {
        let place = (bounds.along(axis) - self.first[axis]) * self.scale[axis];
        // In two comparisons, of which one is true of what is not a number.
        let place = if place > 0.0 { place } else { 0.0 };
        let place = if place < self.last { place } else { self.last };
        (place + WHOLE).to_bits() as usize % BINS
    }
}

/// Bins many parts along each axis; puts those of the left side first.
#[inline(never)]
fn split_binned(parts: &mut [Part], low: [f32; 3], high: [f32; 3], rules: Rules) -> Option<Sides> {
    let count = (parts.len() / 4).clamp(8, BINS);
    let places = Places::new(low, high, count);
    let bins = match parts.len() {
        0..=CHUNK => Bins::of(parts, &places),
        _ => parts.par_chunks(CHUNK).map(|p| Bins::of(p, &places)).reduce(|| Bins::EMPTY, Bins::join),
    };
    let mut best = Split::NONE;
    for axis in (0..3).filter(|&a| places.scale[a] > 0.0) {
        best.look(axis, &bins.boxes[axis][..count], |i| bins.counts[axis][i], rules);
    }
    if best.cost == f32::INFINITY {
        return None;
    }
    let goes_left = |part: &Part| places.of(&part.0, best.axis) < best.left;
    let (mut on_left, mut left, mut right) = (0, Extent::EMPTY, Extent::EMPTY);
    // Every part changes places with the first of the right side. The extents are taken on the way, as parts of large trees come
    // from memory.
    for at in 0..parts.len() {
        let part = parts[at];
        parts.swap(at, on_left);
        if goes_left(&part) {
            on_left += 1;
            left = left.join(Extent::one(&part));
        } else {
            right = right.join(Extent::one(&part));
        }
    }
    Some((on_left, [left, right]))
}
