//! A compiled solid: leaves, operations, bounds, and a tree over the leaves' boxes where there are many.

use super::leaf::{Leaf, PlaneList};
use super::prune::Met;
use super::sweep::Events;
use super::tree::Tree;
use crate::bvh;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::math::Aabb;
use crate::ray::Packet;
use crate::ray::slab::Interval;

/// Boundaries closer than this many roundings of the coordinates are one: 16 half ulps.
const ROUNDINGS: f64 = 16.0;
/// More bounded leaves than this are searched by a tree.
pub(super) const LINEAR: usize = 24;

/// One solid, ready to be traced.
#[derive(Clone, Debug)]
pub struct Solid<S> {
    pub(super) tree: Tree,
    pub(super) leaves: Vec<Leaf<S>>,
    /// Numbers of the leaves in the program it was compiled from.
    pub(super) numbers: Vec<u32>,
    pub(super) planes: PlaneList<S>,
    /// Outside of this box there is nothing; infinite where a complement reaches everywhere.
    pub bounds: Aabb<S>,
    /// Largest coordinate of the bounded leaves' boxes.
    pub(super) size: S,
    /// Least distance of two boundaries, in the tree's space.
    pub(super) least: S,
    /// Tree over the boxes of bounded leaves, and its blocks; empty for small solids.
    pub(super) search: Option<(bvh::Tree<S>, Vec<Vec<u32>>)>,
    /// Leaves that the tree does not hold.
    pub(super) always: Vec<u32>,
}

impl<S: Real> Solid<S> {
    /// Number of leaf `leaf` of a [`super::Boundary`] in the program that this solid was compiled from.
    #[inline(always)]
    pub fn number(&self, leaf: u32) -> u32 {
        self.numbers[leaf as usize]
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    /// Bytes of leaves, operations and trees.
    pub fn bytes(&self) -> usize {
        let (tree, blocks) = self.search.as_ref().map_or((0, 0), |(tree, blocks)| {
            (size_of_val(&tree.nodes[..]), blocks.iter().map(|b| size_of_val(&b[..])).sum())
        });
        let own = size_of_val(&self.leaves[..]) + size_of_val(&self.planes[..]) + size_of_val(&self.numbers[..]);
        own + self.tree.bytes() + tree + blocks
    }

    /// Difference of t below which two boundaries of a lane are one. It depends on the lane's line only.
    #[inline(always)]
    pub(super) fn tolerance<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>) -> V {
        let largest = |v: [V; 3]| v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs());
        let reach = largest(packet.org) + V::splat(self.size);
        let distance = (reach * V::constant(ROUNDINGS * S::EPSILON.to_f64())).fast_max(V::splat(self.least));
        distance / largest(packet.dir)
    }

    /// Lanes whose line meets a leaf's box, in front of the segment's start or near it, and the interval.
    #[inline(always)]
    fn meets<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, leaf: u32, start: V) -> u32 {
        let clip = &self.leaves[leaf as usize].clip;
        let interval = Interval::of(packet, clip.lo, clip.hi);
        (interval.near.cmp_le(interval.far) & start.cmp_le(interval.far)).bits()
    }

    /// Lists the leaves that some of `lanes` meet, each once.
    #[inline(always)]
    pub(super) fn meet<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        lanes: u32,
        eps: V,
        met: &mut Vec<Met>,
        stack: &mut Vec<(u32, u32)>,
    ) {
        met.clear();
        let start = packet.t_min - (eps + eps);
        let mut take = |leaf: u32, lanes: u32| {
            let lanes = self.meets(packet, leaf, start) & lanes;
            if lanes != 0 {
                met.push(Met { leaf, lanes });
            }
        };
        for &leaf in &self.always {
            take(leaf, lanes);
        }
        let Some((tree, blocks)) = &self.search else { return };
        if tree.nodes.is_empty() {
            return;
        }
        stack.clear();
        stack.push((0, lanes));
        while let Some((node, lanes)) = stack.pop() {
            let node = &tree.nodes[node as usize];
            for slot in 0..node.used as usize {
                let bounds = node.child_bounds(slot);
                let interval = Interval::of(packet, bounds.lo, bounds.hi);
                let meets = interval.near.cmp_le(interval.far) & start.cmp_le(interval.far);
                let lanes = meets.bits() & lanes;
                if lanes == 0 {
                    continue;
                }
                let child = node.child(slot);
                if child.is_leaf() {
                    blocks[child.index as usize].iter().for_each(|&leaf| take(leaf, lanes));
                } else {
                    stack.push((child.index, lanes));
                }
            }
        }
    }

    /// Adds the boundaries of a leaf, unless it lies beyond `limit` in all lanes.
    #[inline(always)]
    pub(super) fn boundaries<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        met: &Met,
        slot: u32,
        limit: V,
        events: &mut Events<S>,
    ) {
        let leaf = &self.leaves[met.leaf as usize];
        let within = Interval::of(packet, leaf.clip.lo, leaf.clip.hi);
        if within.near.cmp_le(limit).bits() & met.lanes != 0 {
            leaf.boundaries(packet, &within, &self.planes, (slot, met.lanes), events);
        }
    }
}
