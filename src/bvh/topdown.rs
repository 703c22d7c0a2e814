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
        each(|a| self.0[a] - self.0[a + 4])
    }

    /// The lower corner and the upper one.
    pub fn corners(&self) -> [[f32; 3]; 2] {
        [each(|a| self.0[a]), each(|a| -self.0[a + 4])]
    }
}

/// A primitive to be put into a tree.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its box, in a frame of about unit size.
    pub bounds: Span,
    /// Its number.
    pub prim: u32,
}

/// A node of a new tree over a list of parts, which building puts in order. The left child follows its parent.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Box of all below.
    pub bounds: Span,
    /// Parts below.
    pub count: u32,
    /// Of an inner node: the right child; of a leaf: its first part.
    pub at: u32,
    /// A leaf holds one part, or a block at most that costs least as one leaf, or more than a block of such parts whose centres
    /// nothing tells apart.
    pub leaf: bool,
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

/// Builds a tree over some parts. Some nodes of the result are not in the tree: the root is the first. Deterministic on any
/// number of threads.
pub fn build(parts: &mut [Part], rules: Rules) -> Vec<Node> {
    let unused = Node { bounds: Span::EMPTY, count: 0, at: 0, leaf: true };
    let len = (2 * parts.len()).saturating_sub(1);
    let mut nodes = with_large_pages(len);
    nodes.resize(len, unused);
    if !parts.is_empty() {
        grow(parts, &mut nodes, (0, 0), rules, 0);
    }
    nodes
}

/// Builds the tree over `parts` into `nodes`, which begin at `first` of all parts and of all nodes, `level` nodes below the root.
fn grow(parts: &mut [Part], nodes: &mut [Node], first: (usize, usize), rules: Rules, level: usize) {
    let n = parts.len();
    let (bounds, centres) = extent(parts);
    nodes[0] = Node { bounds, count: n as u32, at: first.0 as u32, leaf: true };
    let [low, high] = centres.corners();
    let told_apart = (0..3).any(|a| high[a] - low[a] > rules.least);
    let is_one_leaf = n == 1 || n <= rules.block && rules.cost.is_one_leaf(bounds.area(), n as u32);
    if is_one_leaf || !told_apart && n > rules.block {
        return;
    }
    let on_left = match n {
        _ if !told_apart || level > rules.deepest => halve(parts),
        0..BINNED => split_sorted(parts, rules),
        _ => split_binned(parts, low, high, rules),
    };
    // Areas that are no numbers: left to a frame of their own.
    let Some(on_left) = on_left else { return };
    let (left, right) = parts.split_at_mut(on_left);
    let (root, below) = nodes.split_first_mut().expect("a node per part at least");
    let (left_nodes, right_nodes) = below.split_at_mut(2 * on_left - 1);
    root.leaf = false;
    root.at = (first.1 + 2 * on_left) as u32;
    let at = root.at as usize;
    let mut one = || grow(left, left_nodes, (first.0, first.1 + 1), rules, level + 1);
    let mut other = || grow(right, right_nodes, (first.0 + on_left, at), rules, level + 1);
    if n < PARALLEL {
        one();
        other();
    } else {
        rayon::join(one, other);
    }
}

/// Box of all, and box of all centres (twice).
fn extent(parts: &[Part]) -> (Span, Span) {
    let join = |a: (Span, Span), b: (Span, Span)| (a.0.union(&b.0), a.1.union(&b.1));
    let of = |parts: &[Part]| {
        parts.iter().fold((Span::EMPTY, Span::EMPTY), |all, part| {
            let centre = part.bounds.centre();
            join(all, (part.bounds, Span::new(centre, centre)))
        })
    };
    match parts.len() {
        0..=CHUNK => of(parts),
        _ => parts.par_chunks(CHUNK).map(of).reduce(|| (Span::EMPTY, Span::EMPTY), join),
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
fn halve(parts: &mut [Part]) -> Option<usize> {
    parts.sort_unstable_by(|a, b| a.bounds.area().total_cmp(&b.bounds.area()).then(a.prim.cmp(&b.prim)));
    Some(parts.len() / 2)
}

/// Sorts few parts along each axis; puts them in the order of the best and returns how many go to the left.
#[inline(never)]
fn split_sorted(parts: &mut [Part], rules: Rules) -> Option<usize> {
    let n = parts.len();
    let mut best = Split::NONE;
    let mut orders = [[0; BINNED]; 3];
    for (axis, order) in orders.iter_mut().enumerate() {
        for (i, part) in parts.iter().enumerate() {
            order[i] = u64::from(ascending(part.bounds.centre()[axis])) << 32 | i as u64;
        }
        order[..n].sort_unstable();
        let mut boxes = [Span::EMPTY; BINNED];
        (0..n).for_each(|i| boxes[i] = parts[order[i] as u32 as usize].bounds);
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
            let centre = part.bounds.centre();
            for axis in 0..3 {
                let at = places.of(&centre, axis);
                bins.boxes[axis][at] = bins.boxes[axis][at].union(&part.bounds);
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

/// Where bins begin.
struct Places {
    low: [f32; 3],
    scale: [f32; 3],
    count: usize,
}

impl Places {
    #[inline(always)]
    fn of(&self, centre: &[f32; 3], axis: usize) -> usize {
        (((centre[axis] - self.low[axis]) * self.scale[axis]) as usize).min(self.count - 1)
    }
}

/// Bins many parts along each axis; puts those of the left side first and returns how many they are.
#[inline(never)]
fn split_binned(parts: &mut [Part], low: [f32; 3], high: [f32; 3], rules: Rules) -> Option<usize> {
    let count = (parts.len() / 4).clamp(8, BINS);
    let scale = each(|a| if high[a] > low[a] { count as f32 / (high[a] - low[a]) } else { 0.0 });
    let places = Places { low, scale, count };
    let bins = match parts.len() {
        0..=CHUNK => Bins::of(parts, &places),
        _ => parts.par_chunks(CHUNK).map(|p| Bins::of(p, &places)).reduce(|| Bins::EMPTY, Bins::join),
    };
    let mut best = Split::NONE;
    for axis in (0..3).filter(|&a| scale[a] > 0.0) {
        best.look(axis, &bins.boxes[axis][..count], |i| bins.counts[axis][i], rules);
    }
    if best.cost == f32::INFINITY {
        return None;
    }
    let goes_left = |part: &Part| places.of(&part.bounds.centre(), best.axis) < best.left;
    let (mut first, mut last) = (0, parts.len());
    while first < last {
        if goes_left(&parts[first]) {
            first += 1;
        } else {
            last -= 1;
            parts.swap(first, last);
        }
    }
    Some(first)
}
