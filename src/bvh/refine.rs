//! Subtrees that are in the wrong place are moved: obvhs' reinsertion.
//!
//! Source: Meister, Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", EG 2018.

use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};

use super::topdown::Node;

/// What there is at a place of a refined tree.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// Two places.
    Inner(usize, usize),
    /// A node of the tree as it was, with all below it.
    Kept(usize),
}

/// A refined tree; place 0 is the root.
pub struct Refined {
    tree: Bvh2,
}

impl Refined {
    /// Moves subtrees of `nodes` about, all of those with at most `whole` parts as they are. `rounds`: how many of the nodes
    /// each looks at, 0 to 1. `None` without rounds, and if obvhs panics (its input is sound, but a build must not take the
    /// program down).
    pub fn new(nodes: &[Node], whole: u32, rounds: &[f32]) -> Option<Self> {
        if rounds.is_empty() {
            return None;
        }
        // obvhs looks at what comes first, so the tree goes level by level.
        let mut sources = vec![0];
        let mut list = vec![node(&nodes[0].bounds)];
        let mut kept = Vec::new();
        let mut at = 0;
        while at < sources.len() {
            let source: usize = sources[at];
            if nodes[source].leaf || nodes[source].count <= whole {
                list[at].first_index = kept.len() as u32;
                kept.push(source as u32);
            } else {
                let children = nodes[source].children(source);
                list[at].prim_count = 0;
                list[at].first_index = sources.len() as u32;
                sources.extend(children);
                list.extend(children.map(|child| node(&nodes[child].bounds)));
            }
            at += 1;
        }
        let (count, leaves) = (list.len(), kept.len());
        let rounds = rounds.to_vec();
        let tree = std::panic::catch_unwind(move || {
            let mut tree = Bvh2 { nodes: list, primitive_indices: kept, ..Default::default() };
            ReinsertionOptimizer::default().run(&mut tree, 1.0, Some(rounds));
            tree
        });
        tree.ok().filter(|t| t.nodes.len() == count && t.primitive_indices.len() == leaves).map(|tree| Self { tree })
    }

    /// What there is at a place.
    pub fn place(&self, at: usize) -> Place {
        let (node, first) = (&self.tree.nodes[at], self.tree.nodes[at].first_index as usize);
        match node.prim_count {
            0 => Place::Inner(first, first + 1),
            _ => Place::Kept(self.tree.primitive_indices[first] as usize),
        }
    }
}

fn node(&[lo, hi]: &[[f32; 3]; 2]) -> Bvh2Node {
    Bvh2Node::new(Aabb::new(lo.into(), hi.into()), 1, 0)
}
