//! What a tree is worth: validation and cost.

use super::build::{Leaf, Tree};
use super::node::{LEAF_PRIMS, Node};
use crate::lanes::Real;
use crate::math::Aabb;

/// Figures of a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// Primitives in leaves.
    pub prims: usize,
    /// Expected cost of a random line by the surface area heuristic: 1 per node and per leaf block, weighted by
    /// area relative to the root (Goldsmith, Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing",
    /// 1987).
    pub sah_cost: f64,
}

impl<S: Real> Tree<S> {
    /// Counts and cost.
    pub fn quality(&self) -> Quality {
        let root = self.bounds.half_area();
        let mut q = Quality {
            nodes: self.nodes.len(),
            sah_cost: f64::from(u8::from(!self.nodes.is_empty())),
            ..Default::default()
        };
        for node in &self.nodes {
            for slot in 0..node.used as usize {
                // An inner child and a leaf block cost the same.
                q.sah_cost += if root > 0.0 { node.child_bounds(slot).half_area() / root } else { 0.0 };
                q.leaves += usize::from(node.child(slot).is_leaf());
                q.prims += usize::from(node.count[slot]);
            }
        }
        q
    }

    /// Bytes of all nodes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.wide[..])
    }

    /// Checks everything traversal relies on: each primitive in exactly one leaf, leaf sizes and classes, boxes that
    /// contain what is below them, the depth, every node reached once; all of it in either tree.
    ///
    /// # Errors
    /// A sentence about the first violation.
    pub fn validate(&self, boxes: &[Aabb<S>], classes: &[u8], leaves: &[Leaf]) -> Result<(), String> {
        let mut seen = vec![false; boxes.len()];
        for leaf in leaves {
            if !(1..=LEAF_PRIMS).contains(&usize::from(leaf.count)) {
                return Err(format!("a leaf holds {} primitives", leaf.count));
            }
            for &p in leaf.prims() {
                if std::mem::replace(&mut seen[p as usize], true) {
                    return Err(format!("primitive {p} is in two leaves"));
                }
                if classes[p as usize] != leaf.class {
                    return Err(format!("primitive {p} is in a leaf of class {}", leaf.class));
                }
            }
        }
        if let Some(p) = seen.iter().position(|s| !s) {
            return Err(format!("primitive {p} is in no leaf"));
        }
        self.reach_all(&self.nodes, self.depth, boxes, leaves)?;
        if self.wide.is_empty() {
            return Ok(());
        }
        self.reach_all(&self.wide, self.wide_depth, boxes, leaves).map_err(|fault| format!("wide tree: {fault}"))
    }

    fn reach_all<const W: usize>(
        &self,
        nodes: &[Node<S, W>],
        depth: u32,
        boxes: &[Aabb<S>],
        leaves: &[Leaf],
    ) -> Result<(), String> {
        let mut used = vec![false; leaves.len()];
        let by_block: std::collections::HashMap<(u8, u32), usize> =
            leaves.iter().enumerate().map(|(i, l)| ((l.class, l.block), i)).collect();
        let mut reached = 0;
        let mut stack = vec![(0u32, self.bounds, 1u32)];
        if nodes.is_empty() {
            stack.clear();
        }
        while let Some((index, bounds, level)) = stack.pop() {
            reached += 1;
            if level > depth || reached > nodes.len() {
                return Err(format!("node {index} is deeper than {depth} or reached twice"));
            }
            let Some(node) = nodes.get(index as usize) else {
                return Err(format!("there is no node {index}"));
            };
            if node.used == 0 || node.used as usize > W {
                return Err(format!("node {index} has {} children", node.used));
            }
            for slot in 0..node.used as usize {
                let (child, child_bounds) = (node.child(slot), node.child_bounds(slot));
                if !bounds.contains(&child_bounds) {
                    return Err(format!("child {slot} of node {index} sticks out of its parent"));
                }
                if !child.is_leaf() {
                    stack.push((child.index, child_bounds, level + 1));
                    continue;
                }
                let at = by_block.get(&(child.class, child.index)).copied();
                let Some(at) = at.filter(|&at| leaves[at].count == child.count) else {
                    return Err(format!("child {slot} of node {index} refers to no leaf of its size"));
                };
                if std::mem::replace(&mut used[at], true) {
                    return Err(format!("leaf {at} is referred to twice"));
                }
                if let Some(p) = leaves[at].prims().iter().find(|&&p| !child_bounds.contains(&boxes[p as usize])) {
                    return Err(format!("primitive {p} sticks out of its leaf"));
                }
            }
        }
        if reached != nodes.len() || !used.iter().all(|&u| u) {
            return Err("a node or a leaf is not reached from the root".into());
        }
        Ok(())
    }
}
