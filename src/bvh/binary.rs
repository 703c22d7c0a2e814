//! Binary trees over boxes of any size: brought into frames of unit size, built from the root down, refined by obvhs.
//!
//! Both work in f32, where areas under- or overflow at extreme scales. So boxes are brought into a common frame first.
//! What no cell of a fine grid there tells apart becomes a subtree in a frame of its own; what no frame can separate is
//! halved by size.

use rayon::prelude::*;

use super::build::{BuildSettings, Preset};
use super::cost::Cost;
use super::node::LEAF_PRIMS;
use super::refine::{Place, Refined};
use super::topdown::{self, Part, Rules, Span};
use crate::lanes::{Real, with_large_pages};
use crate::math::Aabb;

/// A binary node: an inner node with two children or a leaf. Children follow their parents.
#[derive(Clone, Copy, Debug)]
pub struct Node<S> {
    /// Exact union of the primitives' boxes.
    pub bounds: Aabb<S>,
    /// Left child, or where a leaf's primitives begin in the tree's list.
    left: u32,
    /// Right child, or all ones but for the number of a leaf's primitives.
    right: u32,
}

impl<S> Node<S> {
    /// The two children, or `None` for a leaf.
    #[inline(always)]
    pub fn children(&self) -> Option<[usize; 2]> {
        (self.right < !(LEAF_PRIMS as u32)).then_some([self.left as usize, self.right as usize])
    }
}

/// A binary tree: node 0 is the root; no nodes for no boxes.
#[derive(Clone, Debug)]
pub struct Binary<S> {
    /// Nodes.
    pub nodes: Vec<Node<S>>,
    /// Primitives of leaves, one after the other.
    prims: Vec<u32>,
}

impl<S> Binary<S> {
    /// Primitives of a leaf: one, or some of one class that nothing can make cheaper than one leaf.
    #[inline(always)]
    pub fn prims(&self, leaf: usize) -> &[u32] {
        let Node { left, right, .. } = self.nodes[leaf];
        &self.prims[left as usize..][..!right as usize]
    }
}

impl<S: Real> Binary<S> {
    /// The tree above those nodes that have a number in `numbers`, which becomes the primitive of a leaf.
    pub fn above(&self, numbers: &[Option<u32>]) -> Self {
        let mut above = Self::empty();
        let mut waiting = vec![(0, None)];
        while let Some((node, slot)) = waiting.pop() {
            let id = match (numbers[node], self.nodes[node].children()) {
                (None, Some([left, right])) => {
                    let id = above.append(slot, 0, 0);
                    waiting.extend([(right, Some((id, 1))), (left, Some((id, 0)))]);
                    id
                }
                (number, _) => {
                    let first = above.prims.len() as u32;
                    above.prims.extend(number);
                    above.append(slot, first, !1)
                }
            };
            above.nodes[id].bounds = self.nodes[node].bounds;
        }
        above
    }

    fn empty() -> Self {
        Self { nodes: Vec::new(), prims: Vec::new() }
    }

    fn append(&mut self, slot: Slot, left: u32, right: u32) -> usize {
        let id = self.nodes.len();
        self.nodes.push(Node { bounds: Aabb::EMPTY, left, right });
        self.hang(id, slot);
        id
    }

    /// Makes a node a child.
    fn hang(&mut self, id: usize, slot: Slot) {
        match slot {
            Some((parent, 0)) => self.nodes[parent].left = id as u32,
            Some((parent, _)) => self.nodes[parent].right = id as u32,
            None => {}
        }
    }

    /// Appends a whole tree.
    fn graft(&mut self, tree: &Self, slot: Slot) {
        // Of a tree that is one leaf left for a frame of its own there is no node.
        if tree.nodes.is_empty() {
            return;
        }
        let (nodes, prims) = (self.nodes.len() as u32, self.prims.len() as u32);
        self.nodes.extend(tree.nodes.iter().map(|node| match node.children() {
            Some(_) => Node { left: node.left + nodes, right: node.right + nodes, ..*node },
            None => Node { left: node.left + prims, ..*node },
        }));
        self.prims.extend_from_slice(&tree.prims);
        self.hang(nodes as usize, slot);
    }

    fn append_leaf(&mut self, slot: Slot, parts: &[Part]) {
        self.append(slot, self.prims.len() as u32, !(parts.len() as u32));
        self.prims.extend(parts.iter().map(Part::prim));
    }
}

/// Where a subtree's root goes: node and side.
type Slot = Option<(usize, usize)>;

/// Builds a binary tree over the primitives `0..boxes.len()`; `boxes` must be finite and not empty boxes, `classes` are those of
/// the primitives.
pub fn build<S: Real>(boxes: &[Aabb<S>], classes: &[u8], settings: BuildSettings) -> Binary<S> {
    let mut tree = Binary { nodes: Vec::new(), prims: Vec::with_capacity(boxes.len()) };
    if !boxes.is_empty() {
        let prims: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut todo = vec![(prims, None)];
        while let Some((prims, slot)) = todo.pop() {
            plant((boxes, classes), prims, slot, settings, &mut tree, &mut todo);
        }
        // Children follow their parents, so one backward sweep sees them first.
        for i in (0..tree.nodes.len()).rev() {
            tree.nodes[i].bounds = match tree.nodes[i].children() {
                Some([l, r]) => tree.nodes[l].bounds.union(&tree.nodes[r].bounds),
                None => tree.prims(i).iter().fold(Aabb::EMPTY, |all, &p| all.union(&boxes[p as usize])),
            };
        }
    }
    tree
}

/// Centres (twice) that differ less than this in a frame, which is two units wide, are left to a frame of their own: what is
/// left has areas that f32 can tell apart.
const LEAST: f32 = 1.0 / (1 << 20) as f32;

/// Rounds of refinement: how many of the nodes each looks at, from the root.
fn rounds(preset: Preset) -> Vec<f32> {
    match preset {
        Preset::Fast => Vec::new(),
        // Falling as 1, a third, a fifth and so on: what is near the root is looked at most.
        Preset::Balanced => (0..16).map(|i| 0.4 / (2 * i + 1) as f32).collect(),
        Preset::Best => vec![1.0; 24],
    }
}

/// Nodes on a path before subtrees are halved; no scene that was measured has such paths.
const DEEPEST: usize = 64;

/// Boxes that one thread brings into a frame in one go.
const FRAMED: usize = 4096;

/// Appends the subtree over `prims`; what needs a frame of its own is put on `todo`.
fn plant<S: Real>(
    (boxes, classes): (&[Aabb<S>], &[u8]),
    mut prims: Vec<u32>,
    slot: Slot,
    settings: BuildSettings,
    tree: &mut Binary<S>,
    todo: &mut Vec<(Vec<u32>, Slot)>,
) {
    let (mut parts, area) = frame(boxes, &prims);
    let rules = Rules { block: settings.leaf, least: LEAST, deepest: DEEPEST, cost: Cost::new(area) };
    let grown = topdown::build(&mut parts, rules);
    if prims.len() > 1 && grown[0].leaf {
        // Nothing tells these boxes apart but their size: halve by it.
        prims.sort_by(|&a, &b| {
            let area = |p: u32| boxes[p as usize].half_area();
            area(a).total_cmp(&area(b)).then(a.cmp(&b))
        });
        let id = tree.append(slot, 0, 0);
        let upper = prims.split_off(prims.len() / 2);
        todo.push((prims, Some((id, 0))));
        todo.push((upper, Some((id, 1))));
        return;
    }
    let refined = Refined::new(&grown, settings.leaf as u32, &rounds(settings.preset));
    let order = Order { grown: &grown, parts: &parts, refined: refined.as_ref(), classes, leaf: settings.leaf };
    order.append((order.place(0), slot), tree, todo);
}

/// Levels of a tree that are put in order before what is below them is, piece by piece.
const UPPER: u32 = 7;

/// What puts the nodes of a tree in order, children after their parents.
struct Order<'a> {
    grown: &'a [topdown::Node],
    parts: &'a [Part],
    refined: Option<&'a Refined>,
    classes: &'a [u8],
    /// Most primitives in a leaf.
    leaf: usize,
}

impl Order<'_> {
    fn place(&self, at: usize) -> Place {
        self.refined.map_or(Place::Kept(at), |refined| refined.place(at))
    }

    /// Appends the tree below a place to `tree`, in pieces on all threads; what needs a frame of its own is put on `todo`.
    fn append<S: Real>(&self, root: (Place, Slot), tree: &mut Binary<S>, todo: &mut Vec<(Vec<u32>, Slot)>) {
        let mut below = Vec::new();
        self.walk((root.0, None), UPPER, &mut Binary::<S>::empty(), &mut Vec::new(), |place, _, _, _| {
            below.push(place);
        });
        let piece = |place| {
            let mut piece = (Binary::<S>::empty(), Vec::new());
            self.walk((place, None), u32::MAX, &mut piece.0, &mut piece.1, |_, _, _, _| {});
            piece
        };
        let mut pieces = below.into_par_iter().map(piece).collect::<Vec<_>>().into_iter();
        self.walk(root, UPPER, tree, todo, |_, slot, tree, todo| {
            let (piece, left) = pieces.next().expect("places in the order of the first walk");
            let first = tree.nodes.len();
            tree.graft(&piece, slot);
            let moved = |own: Slot| own.map_or(slot, |(parent, side)| Some((first + parent, side)));
            todo.extend(left.into_iter().map(|(prims, own)| (prims, moved(own))));
        });
    }

    /// Appends what is less than `levels` below a place to `tree`; the rest goes to `deeper`.
    fn walk<S: Real>(
        &self,
        (root, slot): (Place, Slot),
        levels: u32,
        tree: &mut Binary<S>,
        todo: &mut Vec<(Vec<u32>, Slot)>,
        mut deeper: impl FnMut(Place, Slot, &mut Binary<S>, &mut Vec<(Vec<u32>, Slot)>),
    ) {
        let mut stack = vec![(root, slot, 0)];
        while let Some((here, slot, level)) = stack.pop() {
            if level == levels {
                deeper(here, slot, tree, todo);
                continue;
            }
            let children = match here {
                Place::Inner(one, other) => [self.place(one), self.place(other)],
                Place::Kept(at) if self.grown[at].leaf => {
                    let topdown::Node { at: first, count, .. } = self.grown[at];
                    let parts = &self.parts[first as usize..][..count as usize];
                    let class = |part: &Part| self.classes[part.prim() as usize];
                    if parts.len() <= self.leaf && parts.iter().all(|part| class(part) == class(&parts[0])) {
                        tree.append_leaf(slot, parts);
                    } else {
                        todo.push((parts.iter().map(Part::prim).collect(), slot));
                    }
                    continue;
                }
                Place::Kept(at) => self.grown[at].children(at).map(Place::Kept),
            };
            let id = tree.append(slot, 0, 0);
            stack.push((children[1], Some((id, 1)), level + 1));
            stack.push((children[0], Some((id, 0)), level + 1));
        }
    }
}

/// The boxes of `prims` in a frame of unit size (f32, rounded outwards), and half the surface area of the box of all there.
fn frame<S: Real>(boxes: &[Aabb<S>], prims: &[u32]) -> (Vec<Part>, f32) {
    let join = |a: Aabb<S>, b: Aabb<S>| a.union(&b);
    let all = prims.par_iter().with_min_len(FRAMED).map(|&p| boxes[p as usize]).reduce(|| Aabb::EMPTY, join);
    let (lo, hi) = all.to_f64();
    // Halved before the subtraction: the extent of +-1e308 is finite then.
    let centre = lo * 0.5 + hi * 0.5;
    let half = (hi * 0.5 - lo * 0.5).max_element();
    let scale = if half > 0.0 { 1.0 / half } else { 0.0 };
    let scale = if scale.is_finite() { scale } else { f64::MAX };
    let framed = |bounds: &Aabb<S>| {
        let (lo, hi) = bounds.to_f64();
        let b = Aabb::<f32>::enclosing((lo - centre) * scale, (hi - centre) * scale);
        Span::new(b.lo, b.hi)
    };
    let part = |&prim: &u32| Part::new(framed(&boxes[prim as usize]), prim);
    let mut parts = with_large_pages(prims.len());
    prims.par_iter().with_min_len(FRAMED).map(part).collect_into_vec(&mut parts);
    (parts, framed(&all).area())
}
