//! From two children to eight or sixteen: the cheapest cut of the binary tree by dynamic programming.
//!
//! Source: Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", HPG
//! 2017, section 3: for every binary node and every i <= `W`, the cheapest forest of at most i wide subtrees that
//! covers its primitives.

use super::binary::Binary;
use super::cost::{Cost, PRIMITIVE};
use super::node::LEAF_PRIMS;
use crate::lanes::Real;
use crate::math::Aabb;

/// What the cheapest forests of wide trees with `W` children per node do at every binary node.
#[derive(Clone, Debug)]
pub struct Plan<const W: usize> {
    /// Per node: entry 0 says what to do with one tree: 0 a leaf, else an inner node whose left binary child gets
    /// that many of the `W` children. Entry k > 0, for up to k + 1 trees: 0 "as with one tree fewer", else the
    /// number of trees for the left child.
    decisions: Vec<[u8; W]>,
    /// Primitives below each node.
    counts: Vec<u32>,
    /// Class of all primitives below, or [`MIXED`].
    classes: Vec<u8>,
    /// Most primitives in a leaf.
    most: u32,
    /// What a primitive costs in a leaf that is met, by class.
    each: Vec<f32>,
}

/// Half the area of a box whose extents are scaled first.
fn relative_area<S: Real>(bounds: &Aabb<S>, scale: f64) -> f32 {
    let (lo, hi) = bounds.to_f64();
    let e = (hi * 0.5 - lo * 0.5) * scale;
    (e.x * e.y + e.y * e.z + e.z * e.x) as f32
}

/// Primitives of more than one class.
const MIXED: u8 = u8::MAX;

impl<const W: usize> Plan<W> {
    /// Plans the collapse of `tree`, whose primitives have the given classes, to leaves of `most` primitives
    /// (1 to [`LEAF_PRIMS`]). `each`: what a primitive of each class costs, [`PRIMITIVE`] where nothing is said.
    pub fn new<S: Real>(tree: &Binary<S>, class_of: &[u8], each: &[f32], most: usize) -> Self {
        let nodes = &tree.nodes;
        let mut plan = Self {
            decisions: vec![[0; W]; nodes.len()],
            counts: vec![1; nodes.len()],
            classes: vec![MIXED; nodes.len()],
            most: most.clamp(1, LEAF_PRIMS) as u32,
            each: each.to_vec(),
        };
        let mut costs = vec![[0f32; W]; nodes.len()];
        // Extents relative to the root's: areas of a scene of any size fit f32.
        let extent = nodes.first().map_or(0.0, |n| {
            let (lo, hi) = n.bounds.to_f64();
            (hi * 0.5 - lo * 0.5).max_element()
        });
        let scale = if extent > 0.0 { (1.0 / extent).min(f64::MAX) } else { 0.0 };
        let model = Cost::new(nodes.first().map_or(0.0, |n| relative_area(&n.bounds, scale)));
        for i in (0..nodes.len()).rev() {
            let area = relative_area(&nodes[i].bounds, scale);
            match nodes[i].children() {
                None => {
                    let prims = tree.prims(i);
                    plan.classes[i] = class_of[prims[0] as usize];
                    plan.counts[i] = prims.len() as u32;
                    costs[i] = [plan.leaf(i, area, model); W];
                }
                Some([l, r]) => {
                    plan.counts[i] = plan.counts[l] + plan.counts[r];
                    plan.classes[i] = if plan.classes[l] == plan.classes[r] { plan.classes[l] } else { MIXED };
                    costs[i] = plan.inner(i, area, model, &costs[l], &costs[r]);
                }
            }
        }
        plan
    }

    /// Cost of node `i` as a leaf. One of several classes never becomes one.
    fn leaf(&self, i: usize, area: f32, model: Cost) -> f32 {
        let each = self.each.get(usize::from(self.classes[i])).copied().unwrap_or(PRIMITIVE);
        model.leaf(area, self.counts[i], each)
    }

    fn inner(&mut self, i: usize, area: f32, model: Cost, left: &[f32; W], right: &[f32; W]) -> [f32; W] {
        // Best split into k + 1 trees, at least one on either side, and how many are on the left then. Whole rows at once: what
        // there is right of so many trees on the left, with nothing where there are too few.
        let (mut forests, mut on_lefts) = ([f32::INFINITY; W], [0u32; W]);
        let mut right_of = [[f32::INFINITY; W]; 2];
        right_of[1] = *right;
        let right_of = right_of.as_flattened();
        for on_left in 1..W {
            let (cost_left, right) = (left[on_left - 1], &right_of[W - on_left..][..W]);
            for k in 0..W {
                let cost = cost_left + right[k];
                let better = cost < forests[k];
                forests[k] = if better { cost } else { forests[k] };
                on_lefts[k] = if better { on_left as u32 } else { on_lefts[k] };
            }
        }
        let fits = self.counts[i] <= self.most && self.classes[i] != MIXED;
        let (best_forest, on_left) = (forests[W - 1], on_lefts[W - 1] as u8);
        let (as_node, as_leaf) = (model.node(area) + best_forest, self.leaf(i, area, model));
        let leaf = fits && as_leaf <= as_node;
        self.decisions[i][0] = if leaf { 0 } else { on_left };
        let mut costs = [if leaf { as_leaf } else { as_node }; W];
        for k in 1..W {
            let (cost, on_left) = (forests[k], on_lefts[k] as u8);
            // Where areas vanish and everything costs the same, a wide node is flatter than a chain.
            if cost < costs[k - 1] || (cost == costs[k - 1] && !leaf) {
                (costs[k], self.decisions[i][k]) = (cost, on_left);
            } else {
                costs[k] = costs[k - 1];
            }
        }
        costs
    }

    /// Whether `node`, as one tree, is a leaf.
    pub fn is_leaf<S>(&self, tree: &Binary<S>, node: usize) -> bool {
        tree.nodes[node].children().is_none() || self.decisions[node][0] == 0
    }

    /// Primitives below `node`.
    pub fn count(&self, node: usize) -> u32 {
        self.counts[node]
    }

    /// Class of a leaf.
    pub fn class(&self, node: usize) -> u8 {
        self.classes[node]
    }

    /// Puts the binary nodes that become the children of the inner wide node made from `node` into `found`.
    pub fn children<S>(&self, tree: &Binary<S>, node: usize, found: &mut Vec<usize>) {
        found.clear();
        let on_left = usize::from(self.decisions[node][0]);
        let [l, r] = tree.nodes[node].children().expect("an inner node");
        let mut stack = vec![(r, W - on_left), (l, on_left)];
        while let Some((node, mut trees)) = stack.pop() {
            while trees > 1 && self.decisions[node][trees - 1] == 0 {
                trees -= 1;
            }
            match tree.nodes[node].children() {
                Some([l, r]) if trees > 1 => {
                    let on_left = usize::from(self.decisions[node][trees - 1]);
                    stack.push((r, trees - on_left));
                    stack.push((l, on_left));
                }
                _ => found.push(node),
            }
        }
    }

    /// Primitives below `node`, which becomes a leaf: as many as there are, ascending, then zeros.
    pub fn prims<S>(&self, tree: &Binary<S>, node: usize) -> [u32; LEAF_PRIMS] {
        let (mut prims, mut count) = ([0; LEAF_PRIMS], 0);
        let mut stack = vec![node];
        while let Some(i) = stack.pop() {
            match tree.nodes[i].children() {
                Some([l, r]) => stack.extend([r, l]),
                None => {
                    let some = tree.prims(i);
                    prims[count..][..some.len()].copy_from_slice(some);
                    count += some.len();
                }
            }
        }
        prims[..count].sort_unstable();
        prims
    }
}
