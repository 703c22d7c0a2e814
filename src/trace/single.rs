//! One ray through the 8-wide tree: a stack of single numbers instead of packets of them.

use super::query::Query;
use super::traverse::Leaves;
use crate::bvh::Bundle;
use crate::bvh::{Child, Node, Tree, WIDTH};
use crate::lanes::Real;
use crate::ray::Packet;

/// What waits to be visited, and where the ray enters it.
#[derive(Clone, Copy, Debug)]
pub struct Waiting<S> {
    near: S,
    child: Child,
}

/// Traverses `tree` from `root` on.
#[inline(never)]
pub fn tree<S, L, const ANY: bool, const COUNT: bool>(
    tree: &Tree<S>,
    ray: &Packet<S>,
    query: &mut Query<S, ANY, COUNT>,
    root: Child,
    leaves: &L,
) where
    S: Real,
    L: Leaves<S, ANY, COUNT>,
{
    let base = query.stack.waiting.len();
    let mut bundle = Bundle::of(ray, 1, query.hit.t);
    let mut child = root;
    loop {
        // Down to a leaf, always into the nearest child.
        while !child.is_leaf() {
            match nearest(&tree.nodes[child.index as usize], query, &bundle, |child| leaves.fetch(&tree.nodes, child)) {
                Some(nearest) => child = nearest,
                None => break,
            }
        }
        if child.is_leaf() {
            leaves.visit(ray, query, child, 1);
            if ANY && query.done != 0 {
                query.stack.waiting.truncate(base);
                return;
            }
            bundle.shorten(query.hit.t);
        }
        child = loop {
            if query.stack.waiting.len() == base {
                return;
            }
            let Some(top) = query.stack.waiting.pop() else { return };
            if ANY || top.near <= query.hit.t {
                break top.child;
            }
        };
    }
}

/// The child to visit next; the others that the ray meets go to the stack, nearest on top.
#[inline(always)]
fn nearest<S: Real, const ANY: bool, const COUNT: bool>(
    node: &Node<S>,
    query: &mut Query<S, ANY, COUNT>,
    bundle: &Bundle<S>,
    fetch: impl Fn(Child),
) -> Option<Child> {
    query.count_node(1, node.used);
    let mut near = [S::ZERO; WIDTH];
    let mut met = bundle.children::<S>(node, &mut near) & ((1 << node.used) - 1);
    if met == 0 {
        return None;
    }
    if ANY {
        // In the node's own order, large children first.
        while met & (met - 1) != 0 {
            let slot = (31 - met.leading_zeros()) as usize & (WIDTH - 1);
            met &= !(1 << slot);
            let child = node.child(slot);
            fetch(child);
            query.stack.waiting.push(Waiting { near: near[slot], child });
        }
        return Some(node.child(met.trailing_zeros() as usize & (WIDTH - 1)));
    }
    let slot = met.trailing_zeros() as usize & (WIDTH - 1);
    met &= met - 1;
    let mut best = Waiting { near: near[slot], child: node.child(slot) };
    let first = query.stack.waiting.len();
    while met != 0 {
        let slot = met.trailing_zeros() as usize & (WIDTH - 1);
        met &= met - 1;
        let other = Waiting { near: near[slot], child: node.child(slot) };
        let nearer = other.near < best.near;
        let far = if nearer { best } else { other };
        fetch(far.child);
        best = if nearer { other } else { best };
        // The nearest so far is in hand; the others are kept sorted, farthest first.
        let stack = &mut query.stack.waiting;
        stack.push(far);
        let mut at = stack.len() - 1;
        while at > first && stack[at - 1].near < far.near {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = far;
    }
    Some(best.child)
}
