//! Depth-first traversal of the 8-wide tree by a packet: one node against `N` rays, near child first, lanes masked
//! out as they fail; a lone lane, and so every ray of a packet of width 1, goes by [`super::single`].
//!
//! Source: Wald, Slusallek, Benthin, Wagner, "Interactive Rendering with Coherent Ray Tracing", 2001; the switch to
//! single rays after Benthin, Wald, Woop, Ernst, Mark, "Combining Single and Packet-Ray Tracing for Arbitrary Ray
//! Distributions on the Intel MIC Architecture", 2012.

use super::leaf;
use super::query::Query;
use super::single;
use crate::bvh::Bundle;
use crate::bvh::{Child, Node, Tree, WIDTH};
use crate::lanes::words::prefetch_either;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::Packet;
use crate::scene::world::{Object, World};

/// What the leaves of a tree hold.
pub trait Leaves<V: Lanes, const ANY: bool, const COUNT: bool> {
    /// Visits a leaf with some lanes.
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32);
    /// Asks the memory for one of `nodes` or for what a leaf refers to.
    fn fetch(&self, nodes: &[Node<V::Scalar>], child: Child);
}

/// Leaves of an object's tree: blocks of primitives.
pub struct ObjectLeaves<'a, S> {
    /// The object.
    pub object: &'a Object<S>,
    /// Number of the instance.
    pub inst: u32,
}

impl<V: Lanes, const ANY: bool, const COUNT: bool> Leaves<V, ANY, COUNT> for ObjectLeaves<'_, V::Scalar> {
    #[inline(always)]
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32) {
        leaf::block(self.object, self.inst, packet, query, leaf, lanes);
    }

    #[inline(always)]
    fn fetch(&self, nodes: &[Node<V::Scalar>], child: Child) {
        prefetch_either(nodes, &self.object.triangles, child.is_leaf(), child.index as usize);
    }
}

/// Leaves of the upper tree: instances.
pub struct TopLeaves<'a, S>(pub &'a World<S>);

impl<V: Lanes, const ANY: bool, const COUNT: bool> Leaves<V, ANY, COUNT> for TopLeaves<'_, V::Scalar> {
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32) {
        instance(self.0, self.0.top_leaves[leaf.index as usize], packet, query, lanes);
    }

    fn fetch(&self, nodes: &[Node<V::Scalar>], child: Child) {
        let at = child.index as usize;
        let inst = self.0.top_leaves[if child.is_leaf() { at } else { 0 }] as usize;
        prefetch_either(nodes, &self.0.instances, child.is_leaf(), if child.is_leaf() { inst } else { at });
    }
}

/// Traces a packet through the whole world.
#[inline(always)]
pub fn world<V: Lanes, const ANY: bool, const COUNT: bool>(
    world: &World<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    if world.is_single_object() {
        object(&world.objects[world.instances[0].object as usize], 0, packet, query, lanes);
        return;
    }
    tree(&world.top, packet, query, lanes, &TopLeaves(world));
    for &inst in &world.unbounded_instances {
        instance(world, inst, packet, query, lanes);
    }
}

/// Traces a packet through an instance.
#[inline(always)]
pub fn instance<V: Lanes, const ANY: bool, const COUNT: bool>(
    world: &World<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    let (local, inside) = leaf::enter(world, inst, packet, query, lanes);
    if inside != 0 {
        object(&world.objects[world.instances[inst as usize].object as usize], inst, &local, query, inside);
    }
}

/// Traces a packet through an object, in the object's space.
pub fn object<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    leaf::unbounded(object, inst, packet, query, lanes);
    tree(&object.tree, packet, query, lanes, &ObjectLeaves { object, inst });
}

/// Traverses `tree`.
#[inline(always)]
fn tree<V, L, const ANY: bool, const COUNT: bool>(
    tree: &Tree<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
    leaves: &L,
) where
    V: Lanes,
    L: Leaves<V, ANY, COUNT> + Leaves<V::Scalar, ANY, COUNT>,
{
    if tree.nodes.is_empty() {
        return;
    }
    if lanes.is_power_of_two() {
        lone(tree, packet, query, Child::ROOT, lanes, leaves);
        return;
    }
    let mut bundle = Bundle::of(packet, lanes, query.hit.t);
    let all = lanes;
    let base = query.stack.len();
    query.stack.push(Child::ROOT, lanes, V::splat(V::Scalar::LOWEST));
    while let Some((mut child, waiting, near)) = query.stack.pop::<V>(base) {
        let mut lanes = query.wanted(waiting, near);
        // Down to a leaf, always into the nearest child.
        while lanes != 0 {
            if lanes.is_power_of_two() {
                lone(tree, packet, query, child, lanes, leaves);
                break;
            }
            if child.is_leaf() {
                leaves.visit(packet, query, child, lanes);
                if ANY && query.done & all == all {
                    query.stack.truncate(base);
                    return;
                }
                bundle.shorten(query.hit.t);
                break;
            }
            let node = &tree.nodes[child.index as usize];
            query.count_node(lanes, node.used);
            (child, lanes) = children(node, packet, query, &bundle, lanes, |child| {
                Leaves::<V, ANY, COUNT>::fetch(leaves, &tree.nodes, child)
            });
        }
    }
}

/// The way of a lone lane from `root` on.
#[inline(always)]
fn lone<V, L, const ANY: bool, const COUNT: bool>(
    tree: &Tree<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    root: Child,
    lanes: u32,
    leaves: &L,
) where
    V: Lanes,
    L: Leaves<V::Scalar, ANY, COUNT>,
{
    let lane = lanes.trailing_zeros() as usize;
    let ray = packet.single(lane);
    query.with_single(lane, |query| single::tree(tree, &ray, query, root, leaves));
}

/// Tests a node's children, puts all but the nearest on the stack, returns the nearest with its lanes.
#[inline(always)]
fn children<V: Lanes, const ANY: bool, const COUNT: bool>(
    node: &Node<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    bundle: &Bundle<V::Scalar>,
    lanes: u32,
    fetch: impl Fn(Child),
) -> (Child, u32) {
    // First the packet as a whole against all eight boxes. Where the first lane enters is near enough to go by.
    let mut keys = [V::Scalar::ZERO; WIDTH];
    let mut hit = bundle.children::<V>(node, &mut keys) & ((1 << node.used) - 1);
    let mut nears = [V::constant(0.0); WIDTH];
    let mut meets = [lanes; WIDTH];
    // Slots by distance, nearest last; any-hit keeps the node's own order (large children first), slot 0 last.
    let mut order = [0u8; WIDTH];
    let mut count = 0;
    while hit != 0 {
        let slot = if ANY { 31 - hit.leading_zeros() } else { hit.trailing_zeros() } as usize & (WIDTH - 1);
        hit &= !(1 << slot);
        let interval = bundle.interval(packet, node, slot);
        query.count_box();
        meets[slot] &= interval.meets(packet.t_min, query.hit.t).bits();
        if meets[slot] == 0 {
            continue;
        }
        nears[slot] = interval.near;
        if !bundle.is_uniform() {
            keys[slot] = interval.near.lane(meets[slot].trailing_zeros() as usize);
        }
        let mut at = count;
        while !ANY && at > 0 && keys[usize::from(order[at - 1])] < keys[slot] {
            order[at] = order[at - 1];
            at -= 1;
        }
        order[at] = slot as u8;
        count += 1;
    }
    if count == 0 {
        return (Child::ROOT, 0);
    }
    for &slot in &order[..count - 1] {
        let slot = usize::from(slot);
        fetch(node.child(slot));
        query.stack.push(node.child(slot), meets[slot], nears[slot]);
    }
    let slot = usize::from(order[count - 1]);
    fetch(node.child(slot));
    (node.child(slot), meets[slot])
}
