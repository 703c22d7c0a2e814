//! Depth-first traversal of the 8-wide tree by a packet: one node against `N` rays, near child first, lanes masked
//! out as they fail; a lone lane finishes at width 1.
//!
//! Source: Wald, Slusallek, Benthin, Wagner, "Interactive Rendering with Coherent Ray Tracing", 2001; the switch to
//! single rays after Benthin, Wald, Woop, Ernst, Mark, "Combining Single and Packet-Ray Tracing for Arbitrary Ray
//! Distributions on the Intel MIC Architecture", 2012.

use super::leaf;
use super::query::Query;
use crate::bvh::{Child, Node, Tree, WIDTH};
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::Packet;
use crate::ray::slab::{Interval, pad};
use crate::scene::world::{Object, World};

/// What the leaves of a tree hold.
trait Leaves<V: Lanes, const ANY: bool, const COUNT: bool> {
    /// Visits a leaf with some lanes.
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32);
}

/// Leaves of an object's tree: blocks of primitives.
struct ObjectLeaves<'a, S> {
    object: &'a Object<S>,
    inst: u32,
}

impl<V: Lanes, const ANY: bool, const COUNT: bool> Leaves<V, ANY, COUNT> for ObjectLeaves<'_, V::Scalar> {
    #[inline(always)]
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32) {
        leaf::block(self.object, self.inst, packet, query, leaf, lanes);
    }
}

/// Leaves of the upper tree: instances.
struct TopLeaves<'a, S>(&'a World<S>);

impl<V: Lanes, const ANY: bool, const COUNT: bool> Leaves<V, ANY, COUNT> for TopLeaves<'_, V::Scalar> {
    fn visit(&self, packet: &Packet<V>, query: &mut Query<V, ANY, COUNT>, leaf: Child, lanes: u32) {
        for &inst in &self.0.top_blocks[leaf.index as usize][..usize::from(leaf.count)] {
            instance(self.0, inst, packet, query, lanes);
        }
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
    tree(&world.top, packet, query, Child::ROOT, lanes, &TopLeaves(world));
    for &inst in &world.unbounded_instances {
        instance(world, inst, packet, query, lanes);
    }
}

#[inline(always)]
fn instance<V: Lanes, const ANY: bool, const COUNT: bool>(
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

fn object<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    leaf::unbounded(object, inst, packet, query, lanes);
    tree(&object.tree, packet, query, Child::ROOT, lanes, &ObjectLeaves { object, inst });
}

/// Traverses `tree` from `root` on.
#[inline(always)]
fn tree<V, L, const ANY: bool, const COUNT: bool>(
    tree: &Tree<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    root: Child,
    lanes: u32,
    leaves: &L,
) where
    V: Lanes,
    L: Leaves<V, ANY, COUNT> + Leaves<V::Scalar, ANY, COUNT>,
{
    if tree.nodes.is_empty() {
        return;
    }
    let order = Order::of(packet, lanes);
    let base = query.stack.len();
    query.stack.push(root, lanes, V::splat(V::Scalar::LOWEST));
    while let Some((mut child, waiting, near)) = query.stack.pop::<V>(base) {
        let mut lanes = query.wanted(waiting, near);
        // Down to a leaf, always into the nearest child.
        while lanes != 0 {
            if V::N > 1 && lanes.is_power_of_two() {
                let lane = lanes.trailing_zeros() as usize;
                let ray = packet.single(lane);
                query.with_single(lane, |query| single(tree, &ray, query, child, leaves));
                break;
            }
            if child.is_leaf() {
                leaves.visit(packet, query, child, lanes);
                break;
            }
            let node = &tree.nodes[child.index as usize];
            query.count_node(lanes, node.used);
            (child, lanes) = match order.uniform {
                true => children::<V, ANY, COUNT, true>(node, packet, query, &order, lanes),
                false => children::<V, ANY, COUNT, false>(node, packet, query, &order, lanes),
            };
        }
    }
}

/// The rest of a lone lane's way.
#[inline(never)]
fn single<S, L, const ANY: bool, const COUNT: bool>(
    subtree: &Tree<S>,
    ray: &Packet<S>,
    query: &mut Query<S, ANY, COUNT>,
    root: Child,
    leaves: &L,
) where
    S: Real,
    L: Leaves<S, ANY, COUNT>,
{
    tree(subtree, ray, query, root, 1, leaves);
}

/// Which of a box's two planes a packet meets first, where all its lanes agree.
struct Order {
    uniform: bool,
    /// Per axis: index of the near plane (0 low, 1 high).
    near: [usize; 3],
}

impl Order {
    #[inline(always)]
    fn of<V: Lanes>(packet: &Packet<V>, lanes: u32) -> Self {
        let negative = packet.rcp.map(|r| r.cmp_lt(V::constant(0.0)).bits() & lanes);
        Self { uniform: negative.iter().all(|&n| n == 0 || n == lanes), near: negative.map(|n| usize::from(n != 0)) }
    }
}

/// Tests a node's children, puts all but the nearest on the stack, returns the nearest with its lanes.
#[inline(always)]
fn children<V: Lanes, const ANY: bool, const COUNT: bool, const UNIFORM: bool>(
    node: &Node<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    order: &Order,
    lanes: u32,
) -> (Child, u32) {
    let mut nears = [V::constant(0.0); WIDTH];
    let mut found = [(V::Scalar::ZERO, 0u32, 0usize); WIDTH];
    let mut count = 0;
    for slot in 0..(node.used as usize).min(WIDTH) {
        let interval = if UNIFORM { ordered(node, packet, order, slot) } else { unordered(node, packet, slot) };
        let meets = interval.meets(packet.t_min, query.hit.t).bits() & lanes;
        if meets == 0 {
            continue;
        }
        nears[slot] = interval.near;
        let key = if ANY { V::Scalar::ZERO } else { interval.near.lane(meets.trailing_zeros() as usize) };
        // Insertion by distance, farthest first; any-hit keeps the node's own order, last slot first.
        let mut at = count;
        while at > 0 && (ANY || found[at - 1].0 < key) {
            found[at] = found[at - 1];
            at -= 1;
        }
        found[at] = (key, meets, slot);
        count += 1;
    }
    if count == 0 {
        return (Child::ROOT, 0);
    }
    for &(_, meets, slot) in &found[..count - 1] {
        query.stack.push(node.child(slot), meets, nears[slot]);
    }
    let (_, meets, slot) = found[count - 1];
    (node.child(slot), meets)
}

/// The box test where every lane meets the same planes first: no minima and maxima per axis.
#[inline(always)]
fn ordered<V: Lanes>(node: &Node<V::Scalar>, packet: &Packet<V>, order: &Order, slot: usize) -> Interval<V> {
    let [x, y, z] = [0, 1, 2].map(|a| {
        let plane = |side: usize| (V::splat(node.bounds[a][side][slot]) - packet.org[a]) * packet.rcp[a];
        (plane(order.near[a]), plane(1 - order.near[a]))
    });
    Interval { near: x.0.fast_max(y.0).fast_max(z.0), far: pad(x.1.fast_min(y.1).fast_min(z.1)) }
}

#[inline(always)]
fn unordered<V: Lanes>(node: &Node<V::Scalar>, packet: &Packet<V>, slot: usize) -> Interval<V> {
    let bounds = node.child_bounds(slot);
    Interval::of(packet, bounds.lo, bounds.hi)
}
