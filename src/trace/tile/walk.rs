//! A tile's way through a tree: nearest child first, without sorting and without a stack of children. A level
//! keeps the keys of the children not yet visited; it is left when the nearest of them lies behind everything.

use super::batch::BATCH;
use super::exact::Exact;
use super::fine;
use super::gaps::Trial;
use super::groups::Groups;
use super::node::{self, Level, Planes, WIDTH, key, slot};
use super::pairs::flush;
use super::place::{self, Place};
use super::shapes;
use super::slab::Space;
use super::{GROUPS, HALF_ULP, Memory, SET, V};
use crate::bvh::{Child, Node, Nodes, Tree, WIDE};
use crate::lanes::Lanes;
use crate::lanes::words::{least_key, prefetch, prefetch_for_later};
use crate::ray::Counters;
use crate::scene::world::{Class, Instance, Object, World};
use crate::shape::BLOCK;

/// A tree as a tile sees it.
struct View<'a> {
    tree: &'a Tree<f32>,
    planes: Planes,
    space: Space<'a>,
    /// Level of the root: those before it belong to the tree that holds this one.
    first: usize,
}

/// What the leaves of a tree hold.
trait Leaves<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool> {
    /// Asks the memory for some leaves of a node, as bits, that will be visited before long, unless [`Leaves::visit`] does.
    fn fetch(&self, node: &Node<f32, WIDTH>, leaves: u32);
    /// Whether a leaf that `groups` met is dear enough for a test of its box against single rays; `pays`: such tests have paid
    /// lately.
    fn is_dear(&self, leaf: Child, groups: u64, pays: bool) -> bool;
    /// Visits a leaf with some groups.
    fn visit(&self, memory: &mut Memory, exact: &Exact, leaf: Child, groups: u64, counters: &mut Counters);
    /// No more leaves will come.
    fn finish(&self, memory: &mut Memory, exact: &Exact, counters: &mut Counters);
}

/// Blocks of triangles, of an instance or in the world.
struct Blocks<'a> {
    object: &'a Object<f32>,
    place: Option<&'a Place<'a>>,
}

/// Instances.
struct Instances<'a>(&'a World<f32>);

/// Triangles per ray from which on an instance is seen so small that its triangles have few rays in common: the stream kernel is
/// the faster way through it.
const FINE: f32 = 2.5;

/// Groups up to which the box of an instance is tested against their single rays in any case: to enter it costs several times as
/// much.
const FEW: u32 = GROUPS as u32 / 2;

/// Traces the `N` sets that are loaded in `memory` through the world.
#[inline(always)]
pub fn walk<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    groups: u64,
    counters: &mut Counters,
) {
    memory.batch.clear();
    memory.kept.clear();
    memory.trial = Trial::default();
    memory.slabs.start();
    let frame = &memory.groups.frame;
    let slack = memory.groups.slack / frame.scale;
    let space = |margin| Space { apex: frame.apex, margin: margin + 2.0 * slack, extent: frame.extent, to_local: None };
    if !EXACT && memory.groups.many {
        let margin = place::margin(exact.world, frame);
        let mut planes = Planes::of::<N>(&memory.groups, frame, margin);
        planes.room = memory.groups.room;
        let view = View { tree: &exact.world.top, planes, space: space(margin), first: 0 };
        descend::<N, ANY, EXACT, COUNT>(memory, exact, &view, &Instances(exact.world), groups, counters);
    } else {
        let margin = node::MARGIN * HALF_ULP * frame.extent;
        let mut planes = Planes::of::<N>(&memory.groups, frame, margin);
        planes.room = memory.groups.room;
        let view = View { tree: &exact.object.tree, planes, space: space(margin), first: 0 };
        let leaves = Blocks { object: exact.object, place: None };
        descend::<N, ANY, EXACT, COUNT>(memory, exact, &view, &leaves, groups, counters);
    }
    if memory.batch.len() > 0 {
        flush::<N, ANY, EXACT, COUNT>(memory, exact, counters, false);
    }
    if memory.kept.len() > 0 {
        flush::<N, ANY, EXACT, COUNT>(memory, exact, counters, true);
    }
}

/// Takes some groups through a tree.
#[inline(never)]
fn descend<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    view: &View,
    leaves: &impl Leaves<N, ANY, EXACT, COUNT>,
    groups: u64,
    counters: &mut Counters,
) {
    let nodes: &[Node<f32, WIDTH>] = view.tree.of_width();
    let Some(root) = nodes.first() else { return };
    let mut limit = limit(memory);
    let mut depth = view.first;
    if !open::<N, ANY, EXACT, COUNT>(
        view,
        leaves,
        (root, 0),
        (&memory.groups, groups),
        &mut memory.levels[depth],
        counters,
    ) {
        return;
    }
    loop {
        let level = &mut memory.levels[depth];
        let (nearest, slot) = least_key(&level.keys);
        if u32::from(nearest) >= limit {
            if depth == view.first {
                return leaves.finish(memory, exact, counters);
            }
            depth -= 1;
            continue;
        }
        level.remove(slot);
        exact.next.ask();
        let mut met = level.groups_at::<N>(slot, &memory.groups);
        let node = &nodes[level.node as usize];
        let child = node.child(slot);
        if met != 0 && (memory.slabs.wanted::<ANY>(met) || leaves.is_dear(child, met, memory.slabs.pay())) {
            let rays = (exact.bundle, &view.space, &view.planes.spans);
            met = memory.slabs.test(&memory.groups, rays, &node.child_bounds(slot), met);
        }
        if met == 0 {
            continue;
        }
        if child.is_leaf() {
            leaves.visit(memory, exact, child, met, counters);
            limit = self::limit(memory);
        } else {
            let node = &nodes[child.index as usize];
            let below = &mut memory.levels[depth + 1];
            if open::<N, ANY, EXACT, COUNT>(view, leaves, (node, child.index), (&memory.groups, met), below, counters) {
                depth += 1;
            }
        }
    }
}

/// Children with keys from here on lie behind everything.
#[inline(always)]
fn limit(memory: &Memory) -> u32 {
    let farthest = memory.groups.farthest;
    if farthest == f32::NEG_INFINITY { 0 } else { (u32::from(key(farthest)) + 1).min(0xffff) }
}

/// Whether a leaf of an object's tree holds something else than triangles.
#[inline(always)]
fn is_of_shapes(leaf: Child) -> bool {
    leaf.class != Class::Triangle as u8
}

#[inline(always)]
fn open<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    view: &View,
    leaves: &impl Leaves<N, ANY, EXACT, COUNT>,
    (node, index): (&Node<f32, WIDTH>, u32),
    (tile, groups): (&Groups, u64),
    level: &mut Level,
    counters: &mut Counters,
) -> bool {
    if COUNT {
        counters.nodes += 1;
        counters.node_boxes += u64::from(node.used);
        counters.boxes += u64::from(node.used);
        counters.box_lanes += WIDTH as u64;
        counters.wide_nodes += u64::from(WIDTH == WIDE);
        counters.node_lanes_active += u64::from(groups.count_ones()) * V::N as u64;
        counters.node_lanes_total += (N * SET * V::N) as u64;
    }
    let met = view.planes.open::<N>(node, (tile, groups), level);
    if met == 0 {
        return false;
    }
    level.node = index;
    // Most of them are visited, one after the other: their way from memory starts now. As far as the second cache, as there may be more
    // lines than can be under way at once.
    let nodes = Nodes::<f32, WIDTH>::of_width(view.tree);
    let mut inner = met & node.inner();
    leaves.fetch(node, met & !inner);
    while inner != 0 {
        prefetch_for_later(nodes, node.child(slot(inner.trailing_zeros())).index as usize);
        inner &= inner - 1;
    }
    true
}

impl<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool> Leaves<N, ANY, EXACT, COUNT>
    for Blocks<'_>
{
    #[inline(always)]
    fn fetch(&self, _node: &Node<f32, WIDTH>, _leaves: u32) {}

    #[inline(always)]
    fn is_dear(&self, leaf: Child, _groups: u64, _pays: bool) -> bool {
        !EXACT && is_of_shapes(leaf)
    }

    #[inline(always)]
    fn visit(&self, memory: &mut Memory, exact: &Exact, leaf: Child, groups: u64, counters: &mut Counters) {
        if let Some(place) = self.place
            && !EXACT
            && is_of_shapes(leaf)
        {
            let Memory { groups: state, stack, .. } = memory;
            let shapes = (self.object, place.inst);
            shapes::visit::<N, ANY, COUNT>(state, exact, shapes, leaf, groups, stack, counters);
            return;
        }
        prefetch(&self.object.triangles, leaf.index as usize);
        if let Some((leaf, groups)) = memory.due.put(leaf, groups, memory.trial.gaps.is_some()) {
            self.read::<N, ANY, EXACT, COUNT>(memory, exact, leaf, groups, counters);
        }
    }

    #[inline(always)]
    fn finish(&self, memory: &mut Memory, exact: &Exact, counters: &mut Counters) {
        while let Some((leaf, groups)) = memory.due.take() {
            self.read::<N, ANY, EXACT, COUNT>(memory, exact, leaf, groups, counters);
        }
    }
}

impl Blocks<'_> {
    /// Puts the triangles of a leaf to those that wait to be set up.
    #[inline(always)]
    fn read<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
        &self,
        memory: &mut Memory,
        exact: &Exact,
        leaf: Child,
        groups: u64,
        counters: &mut Counters,
    ) {
        let count = usize::from(leaf.count);
        if COUNT {
            counters.leaves += 1;
        }
        if memory.batch.len() + count > BATCH {
            flush::<N, ANY, EXACT, COUNT>(memory, exact, counters, false);
        }
        let block = &self.object.triangles[leaf.index as usize];
        match self.place {
            Some(place) if !EXACT => memory.batch.push_placed::<ANY>(block, leaf.index * 8, count, groups, place),
            _ => memory.batch.push::<EXACT>(block, leaf.index * 8, count, groups),
        }
    }
}

impl<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool> Leaves<N, ANY, EXACT, COUNT>
    for Instances<'_>
{
    #[inline(always)]
    fn fetch(&self, node: &Node<f32, WIDTH>, mut leaves: u32) {
        while leaves != 0 {
            let inst = self.0.top_leaves[node.child(slot(leaves.trailing_zeros())).index as usize] as usize;
            leaves &= leaves - 1;
            prefetch(&self.0.instances, inst);
            prefetch(&self.0.traced.placements, inst);
        }
    }

    #[inline(always)]
    fn is_dear(&self, leaf: Child, groups: u64, pays: bool) -> bool {
        leaf.is_leaf() && (groups.count_ones() <= FEW || pays)
    }

    #[inline(always)]
    fn visit(&self, memory: &mut Memory, exact: &Exact, leaf: Child, groups: u64, counters: &mut Counters) {
        let world = self.0;
        let inst = world.top_leaves[leaf.index as usize];
        let Instance { object, bounds, .. } = &world.instances[inst as usize];
        let triangles = (world.objects[*object as usize].triangles.len() * BLOCK) as f32;
        // What the tile and the instance alone say: answers must not depend on what was learnt or found before.
        if triangles > FINE * memory.groups.rays_on::<N>(bounds) {
            let Memory { groups: state, stack, visitors, .. } = memory;
            return fine::visit::<N, ANY, COUNT>(state, exact, inst, groups, (visitors, stack), counters);
        }
        let state = &memory.groups;
        let place = Place::new(world, inst, &state.frame);
        let planes = Planes::of::<N>(state, &place.frame, node::MARGIN * HALF_ULP * place.frame.extent);
        let space = place.space(world, state.slack / state.frame.scale);
        let view = View { tree: &place.object.tree, planes, space, first: node::levels(&world.top) };
        let leaves = Blocks { object: place.object, place: Some(&place) };
        memory.slabs.enter();
        descend::<N, ANY, EXACT, COUNT>(memory, exact, &view, &leaves, groups, counters);
    }

    #[inline(always)]
    fn finish(&self, _memory: &mut Memory, _exact: &Exact, _counters: &mut Counters) {}
}
