//! Building a tree: binary build, collapse, depth-first emission.

use rayon::prelude::*;

use super::binary::{self, Binary};
use super::collapse::Plan;
use super::node::{Child, LEAF_PRIMS, Node, WIDE, WIDTH};
use crate::lanes::{Lanes, Real, on_large_pages};
use crate::math::Aabb;

/// How much time a build may spend on the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Quick build, slower rays.
    Fast,
    /// The default: rays within two per cent of the best at a third of its time.
    #[default]
    Balanced,
    /// Slow build, fastest rays.
    Best,
}

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildSettings {
    /// Time it may take.
    pub preset: Preset,
    /// Most primitives in a leaf, 1 to [`LEAF_PRIMS`]. Worlds have objects of solids only with one, whatever this says.
    pub leaf: usize,
}

impl Default for BuildSettings {
    fn default() -> Self {
        Preset::default().into()
    }
}

impl From<Preset> for BuildSettings {
    fn from(preset: Preset) -> Self {
        Self { preset, leaf: LEAF_PRIMS }
    }
}

/// A flat tree over boxes. Nodes are in depth-first order, node 0 is the root; no nodes for no primitives.
#[derive(Clone, Debug)]
pub struct Tree<S> {
    /// Nodes.
    pub nodes: Vec<Node<S>>,
    /// Nodes of a second tree over the same leaves, for streams and tiles; none where [`Real::Children`] are eight.
    pub wide: Vec<Node<S, WIDE>>,
    /// Nodes on the longest path from the root.
    pub depth: u32,
    /// That of the second tree.
    pub wide_depth: u32,
    /// Box of everything.
    pub bounds: Aabb<S>,
}

/// A leaf of a new tree: which primitives go into which block of which class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Class of the primitives.
    pub class: u8,
    /// Number of the block among the blocks of this class; leaves of a class come in ascending order.
    pub block: u32,
    /// How many primitives, at most eight (or what [`BuildSettings::leaf`] says).
    pub count: u8,
    /// These, ascending, then zeros.
    pub list: [u32; LEAF_PRIMS],
}

impl Leaf {
    /// Its primitives, ascending.
    pub fn prims(&self) -> &[u32] {
        &self.list[..usize::from(self.count)]
    }
}

/// A tree seen by its nodes of `W` children.
pub trait Nodes<S, const W: usize> {
    /// The nodes in depth-first order, the root first.
    fn of_width(&self) -> &[Node<S, W>];
    /// Nodes on the longest path from the root.
    fn levels(&self) -> u32;
}

impl<S> Nodes<S, WIDTH> for Tree<S> {
    #[inline(always)]
    fn of_width(&self) -> &[Node<S>] {
        &self.nodes
    }

    fn levels(&self) -> u32 {
        self.depth
    }
}

impl<S> Nodes<S, WIDE> for Tree<S> {
    #[inline(always)]
    fn of_width(&self) -> &[Node<S, WIDE>] {
        &self.wide
    }

    fn levels(&self) -> u32 {
        self.wide_depth
    }
}

impl<S: Real> Tree<S> {
    /// A tree over nothing.
    pub fn empty() -> Self {
        Self { nodes: Vec::new(), wide: Vec::new(), depth: 0, wide_depth: 0, bounds: Aabb::EMPTY }
    }

    /// Most entries a depth-first traversal can have on its stack: every level leaves all siblings but one.
    pub fn stack_bound(&self) -> usize {
        let [eight, sixteen] =
            [(WIDTH, self.depth), (WIDE, self.wide_depth)].map(|(w, depth)| (w - 1) * depth as usize);
        eight.max(sixteen) + 1
    }
}

/// Builds a tree over primitives with finite boxes `boxes` and leaf classes `classes` (below 255).
/// Deterministic: the same input gives the same tree on any number of threads.
pub fn build<S: Real>(boxes: &[Aabb<S>], classes: &[u8], settings: impl Into<BuildSettings>) -> (Tree<S>, Vec<Leaf>) {
    build_by_cost(boxes, classes, &[], settings)
}

/// As [`build`], where a primitive of class `c` costs rays that meet its leaf `each[c]` of what a node costs, or as much as a
/// triangle if nothing is said: costly ones are kept apart where many rays come.
pub fn build_by_cost<S: Real>(
    boxes: &[Aabb<S>],
    classes: &[u8],
    each: &[f32],
    settings: impl Into<BuildSettings>,
) -> (Tree<S>, Vec<Leaf>) {
    assert_eq!(boxes.len(), classes.len());
    let settings = settings.into();
    let binary = binary::build(boxes, classes, settings);
    if binary.nodes.is_empty() {
        return (Tree::empty(), Vec::new());
    }
    let plan = Plan::new(&binary, classes, each, settings.leaf);
    let (mut sources, mut made) = (Vec::new(), Vec::new());
    let (mut blocks, mut numbers) = ([0; 256], vec![None; binary.nodes.len()]);
    let (nodes, depth) = emit(&binary, &plan, |source| {
        let (count, class) = (plan.count(source) as u8, plan.class(source));
        let index = blocks[usize::from(class)];
        blocks[usize::from(class)] += 1;
        numbers[source] = Some(made.len() as u32);
        sources.push(source);
        made.push(Child { index, count, class });
        made[made.len() - 1]
    });
    let leaf = |(&source, child): (&usize, &Child)| Leaf {
        class: child.class,
        block: child.index,
        count: child.count,
        list: plan.prims(&binary, source),
    };
    let (leaves, (wide, wide_depth)) = rayon::join(
        || sources.par_iter().zip(&made).map(leaf).collect(),
        || if S::Children::N >= WIDE { widen(&binary, &numbers, &made) } else { (Vec::new(), 0) },
    );
    (Tree { nodes, wide, depth, wide_depth, bounds: binary.nodes[0].bounds }, leaves)
}

/// The wide nodes over leaves that are `made` and the depth: leaves of the one tree are what the other is over. `numbers`: the leaves
/// that binary nodes became.
fn widen<S: Real>(binary: &Binary<S>, numbers: &[Option<u32>], made: &[Child]) -> (Vec<Node<S, WIDE>>, u32) {
    let above = binary.above(numbers);
    let plan = Plan::new(&above, &vec![0; made.len()], &[], 1);
    emit(&above, &plan, |source| made[above.prims(source)[0] as usize])
}

/// Emits the nodes that are planned depth-first, with what `leaf` makes of the binary nodes that become leaves, and returns them and
/// the depth.
fn emit<S: Real, const W: usize>(
    binary: &Binary<S>,
    plan: &Plan<W>,
    mut leaf: impl FnMut(usize) -> Child,
) -> (Vec<Node<S, W>>, u32) {
    let (mut nodes, mut depth) = (Vec::<Node<S, W>>::new(), 0);
    // Binary node to open, where its index goes, its depth.
    let mut stack = vec![(0usize, None, 1u32)];
    let (mut children, mut by_area) = (Vec::with_capacity(W), Vec::with_capacity(W));
    while let Some((source, slot, level)) = stack.pop() {
        depth = depth.max(level);
        let id = nodes.len();
        if let Some((parent, slot)) = slot {
            let parent: &mut Node<S, W> = &mut nodes[parent];
            parent.child[slot] = id as u32;
        }
        nodes.push(Node::empty());
        if plan.is_leaf(binary, source) {
            children.clear();
            children.push(source);
        } else {
            plan.children(binary, source, &mut children);
        }
        // Large children first: the order in which any-hit rays look.
        by_area.clear();
        by_area.extend(children.iter().map(|&child| (binary.nodes[child].bounds.half_area(), child)));
        by_area.sort_by(|a, b| b.0.total_cmp(&a.0));
        let first = stack.len();
        for (slot, &(_, child)) in by_area.iter().enumerate() {
            let is_leaf = plan.is_leaf(binary, child);
            nodes[id].push(&binary.nodes[child].bounds, if is_leaf { leaf(child) } else { Child::ROOT });
            if !is_leaf {
                stack.push((child, Some((id, slot)), level + 1));
            }
        }
        stack[first..].reverse();
    }
    // Rays jump about in it: with small pages every jump looks up an address as well.
    (on_large_pages(nodes), depth)
}
