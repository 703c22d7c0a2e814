//! A tile's way through the tree: nearest child first, without sorting and without a stack of children. A level
//! keeps the keys of the children not yet visited; it is left when the nearest of them lies behind everything.

use super::exact::Exact;
use super::node::{Level, Planes, key};
use super::pairs::flush;
use super::{Memory, SET, V};
use crate::bvh::{Child, Node, WIDTH};
use crate::lanes::Lanes;
use crate::lanes::words::{least_key, prefetch};
use crate::ray::Counters;
use crate::scene::world::Object;

use super::batch::BATCH;

/// Traces the `N` sets that are loaded in `memory` through the object.
#[inline(always)]
pub fn walk<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    groups: u64,
    counters: &mut Counters,
) {
    let tree = &exact.object.tree;
    let Some(root) = tree.nodes.first() else { return };
    memory.batch.clear();
    memory.slabs.start();
    let planes = Planes::of(&memory.groups);
    let mut limit = limit(memory);
    let mut depth = 0;
    if !open::<N, COUNT>(exact.object, &planes, root, 0, groups, &mut memory.levels[0], counters) {
        return;
    }
    loop {
        let level = &mut memory.levels[depth];
        let (nearest, slot) = least_key(&level.keys);
        if u32::from(nearest) >= limit {
            if depth == 0 {
                break;
            }
            depth -= 1;
            continue;
        }
        level.remove(slot);
        let mut met = level.groups_at::<N>(slot, &memory.groups);
        let node = &tree.nodes[level.node as usize];
        if met != 0 && memory.slabs.wanted::<ANY>(met) {
            met = memory.slabs.test(&memory.groups, exact.bundle, &node.child_bounds(slot), met);
        }
        if met == 0 {
            continue;
        }
        let child = node.child(slot);
        if child.is_leaf() {
            leaf::<N, ANY, EXACT, COUNT>(memory, exact, child, met, counters);
            limit = self::limit(memory);
        } else {
            let node = &tree.nodes[child.index as usize];
            let below = &mut memory.levels[depth + 1];
            if open::<N, COUNT>(exact.object, &planes, node, child.index, met, below, counters) {
                depth += 1;
            }
        }
    }
    if memory.batch.len() > 0 {
        flush::<N, ANY, EXACT, COUNT>(memory, exact, counters);
    }
}

/// Children with keys from here on lie behind everything.
#[inline(always)]
fn limit(memory: &Memory) -> u32 {
    let farthest = memory.groups.farthest;
    if farthest == f32::NEG_INFINITY { 0 } else { (u32::from(key(farthest)) + 1).min(0xffff) }
}

#[inline(always)]
fn open<const N: usize, const COUNT: bool>(
    object: &Object<f32>,
    planes: &Planes,
    node: &Node<f32>,
    index: u32,
    groups: u64,
    level: &mut Level,
    counters: &mut Counters,
) -> bool {
    if COUNT {
        counters.nodes += 1;
        counters.boxes += u64::from(node.used);
        counters.box_lanes += WIDTH as u64;
        counters.node_lanes_active += u64::from(groups.count_ones()) * V::N as u64;
        counters.node_lanes_total += (N * SET * V::N) as u64;
    }
    let mut met = planes.open(node, level);
    if met == 0 {
        return false;
    }
    (level.node, level.groups) = (index, groups);
    // Most of them are visited, one after the other: their way from memory starts now.
    while met != 0 {
        let child = node.child(met.trailing_zeros() as usize & 7);
        met &= met - 1;
        if child.is_leaf() {
            prefetch(&object.triangles, child.index as usize);
        } else {
            prefetch(&object.tree.nodes, child.index as usize);
        }
    }
    true
}

#[inline(always)]
fn leaf<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
    memory: &mut Memory,
    exact: &Exact,
    child: Child,
    groups: u64,
    counters: &mut Counters,
) {
    let count = usize::from(child.count);
    if COUNT {
        counters.leaves += 1;
    }
    if memory.batch.len() + count > BATCH {
        flush::<N, ANY, EXACT, COUNT>(memory, exact, counters);
    }
    memory.batch.push::<EXACT>(&exact.object.triangles[child.index as usize], child.index * 8, count, groups);
}
