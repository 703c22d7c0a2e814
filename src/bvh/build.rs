//! Building a tree: binary build, collapse, depth-first emission.

use super::binary::{self, Binary};
use super::collapse::Plan;
use super::node::{Child, LEAF_PRIMS, Node, WIDTH};
use crate::lanes::Real;
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
    /// Nodes on the longest path from the root.
    pub depth: u32,
    /// Box of everything.
    pub bounds: Aabb<S>,
}

/// A leaf of a new tree: which primitives go into which block of which class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Class of the primitives.
    pub class: u8,
    /// Number of the block among the blocks of this class; leaves of a class come in ascending order.
    pub block: u32,
    /// Primitives, ascending, at most eight (or what [`BuildSettings::leaf`] says).
    pub prims: Vec<u32>,
}

impl<S: Real> Tree<S> {
    /// A tree over nothing.
    pub fn empty() -> Self {
        Self { nodes: Vec::new(), depth: 0, bounds: Aabb::EMPTY }
    }

    /// Most entries a depth-first traversal can have on its stack: every level leaves up to seven siblings.
    pub fn stack_bound(&self) -> usize {
        (WIDTH - 1) * self.depth as usize + 1
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
    let mut emission =
        Emission { binary: &binary, plan: &plan, nodes: Vec::new(), leaves: Vec::new(), blocks: [0; 256] };
    let depth = emission.run();
    let tree = Tree { nodes: emission.nodes, depth, bounds: binary.nodes[0].bounds };
    (tree, emission.leaves)
}

struct Emission<'a, S> {
    binary: &'a Binary<S>,
    plan: &'a Plan,
    nodes: Vec<Node<S>>,
    leaves: Vec<Leaf>,
    blocks: [u32; 256],
}

impl<S: Real> Emission<'_, S> {
    /// Emits everything depth-first and returns the depth.
    fn run(&mut self) -> u32 {
        let mut depth = 0;
        // Binary node to open, where its index goes, its depth.
        let mut stack = vec![(0usize, None, 1u32)];
        let (mut children, mut by_area) = (Vec::with_capacity(WIDTH), Vec::with_capacity(WIDTH));
        while let Some((source, slot, level)) = stack.pop() {
            depth = depth.max(level);
            let id = self.nodes.len();
            if let Some((parent, slot)) = slot {
                let parent: &mut Node<S> = &mut self.nodes[parent];
                parent.child[slot] = id as u32;
            }
            self.nodes.push(Node::empty());
            if self.plan.is_leaf(self.binary, source) {
                children.clear();
                children.push(source);
            } else {
                self.plan.children(self.binary, source, &mut children);
            }
            // Large children first: the order in which any-hit rays look.
            by_area.clear();
            by_area.extend(children.iter().map(|&child| (self.binary.nodes[child].bounds.half_area(), child)));
            by_area.sort_by(|a, b| b.0.total_cmp(&a.0));
            let first = stack.len();
            for (slot, &(_, child)) in by_area.iter().enumerate() {
                let leaf = self.plan.is_leaf(self.binary, child);
                let reference = if leaf { self.leaf(child) } else { Child::ROOT };
                self.nodes[id].push(&self.binary.nodes[child].bounds, reference);
                if !leaf {
                    stack.push((child, Some((id, slot)), level + 1));
                }
            }
            stack[first..].reverse();
        }
        depth
    }

    fn leaf(&mut self, source: usize) -> Child {
        let prims = self.plan.prims(self.binary, source);
        let class = self.plan.class(source);
        let block = self.blocks[usize::from(class)];
        self.blocks[usize::from(class)] += 1;
        let child = Child { index: block, count: prims.len() as u8, class };
        self.leaves.push(Leaf { class, block, prims });
        child
    }
}
