//! Binary trees over boxes: obvhs behind guards for its weak spots.
//!
//! obvhs (parallel locally-ordered clustering, Meister and Bittner, TVCG 2018, with reinsertion, EG 2018) works in
//! f32, takes quadratic time and makes chains when many boxes share a centre, and its areas under- or overflow at
//! extreme scales. So boxes are brought into a common frame of unit size first, boxes whose centres fall into one cell
//! of a fine grid there are grouped under one representative, and each group becomes a subtree in a frame of its own.
//! A group that no frame can separate is halved by size.

use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::build::Preset;
use crate::lanes::{Real, each};
use crate::math::Aabb;

/// Marks a leaf in [`Binary::right`].
const LEAF: u32 = u32::MAX;

/// A binary node: an inner node with two children or a leaf with one primitive. Children follow their parents.
#[derive(Clone, Copy, Debug)]
pub struct Binary<S> {
    /// Exact union of the primitives' boxes.
    pub bounds: Aabb<S>,
    /// Left child, or primitive of a leaf.
    pub left: u32,
    /// Right child, or a mark.
    right: u32,
}

impl<S> Binary<S> {
    /// The two children, or `None` for a leaf.
    pub fn children(&self) -> Option<[usize; 2]> {
        (self.right != LEAF).then_some([self.left as usize, self.right as usize])
    }
}

/// Builds a binary tree over the primitives `0..boxes.len()`; `boxes` must be finite and not empty boxes.
/// The root is node 0; no nodes for no boxes.
pub fn build<S: Real>(boxes: &[Aabb<S>], preset: Preset) -> Vec<Binary<S>> {
    let mut nodes = Vec::with_capacity((2 * boxes.len()).saturating_sub(1));
    if !boxes.is_empty() {
        let prims: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut todo = vec![(prims, None)];
        while let Some((prims, slot)) = todo.pop() {
            plant(boxes, prims, slot, preset, &mut nodes, &mut todo);
        }
        // Children follow their parents, so one backward sweep sees them first.
        for i in (0..nodes.len()).rev() {
            nodes[i].bounds = match nodes[i].children() {
                Some([l, r]) => nodes[l].bounds.union(&nodes[r].bounds),
                None => boxes[nodes[i].left as usize],
            };
        }
    }
    nodes
}

/// Cells per unit of the grid that groups centres: a frame is two units wide. Fine enough that ordinary scenes have
/// one box per cell, coarse enough that what is left to obvhs has areas that f32 can tell apart.
const CELLS: f32 = (1 << 20) as f32;

/// Where a subtree's root goes: node and side.
type Slot = Option<(usize, usize)>;

fn append<S: Real>(nodes: &mut Vec<Binary<S>>, slot: Slot, left: u32) -> usize {
    let id = nodes.len();
    nodes.push(Binary { bounds: Aabb::EMPTY, left, right: LEAF });
    match slot {
        Some((parent, 0)) => nodes[parent].left = id as u32,
        Some((parent, _)) => nodes[parent].right = id as u32,
        None => {}
    }
    id
}

/// Appends the subtree over `prims`; groups that need a frame of their own are put on `todo`.
fn plant<S: Real>(
    boxes: &[Aabb<S>],
    mut prims: Vec<u32>,
    slot: Slot,
    preset: Preset,
    nodes: &mut Vec<Binary<S>>,
    todo: &mut Vec<(Vec<u32>, Slot)>,
) {
    if prims.len() == 1 {
        append(nodes, slot, prims[0]);
        return;
    }
    let (frame_boxes, mut groups) = group_by_centre(boxes, &prims);
    let tree = if groups.len() > 1 { cluster(&frame_boxes, preset) } else { None };
    let Some(tree) = tree else {
        // Nothing tells these boxes apart but their size: halve by it.
        prims.sort_by(|&a, &b| {
            let area = |p: u32| boxes[p as usize].half_area();
            area(a).total_cmp(&area(b)).then(a.cmp(&b))
        });
        let id = append(nodes, slot, 0);
        nodes[id].right = 0;
        let upper = prims.split_off(prims.len() / 2);
        todo.push((prims, Some((id, 0))));
        todo.push((upper, Some((id, 1))));
        return;
    };
    let mut stack = vec![(0usize, slot)];
    while let Some((source, slot)) = stack.pop() {
        let node = &tree.nodes[source];
        if node.prim_count > 0 {
            let group = tree.primitive_indices[node.first_index as usize] as usize;
            match &groups[group][..] {
                [prim] => drop(append(nodes, slot, *prim)),
                _ => todo.push((std::mem::take(&mut groups[group]), slot)),
            }
        } else {
            let id = append(nodes, slot, 0);
            nodes[id].right = 0;
            let first = node.first_index as usize;
            stack.push((first + 1, Some((id, 1))));
            stack.push((first, Some((id, 0))));
        }
    }
}

/// Brings the boxes of `prims` into a frame of unit size (f32, rounded outwards) and groups those whose centres share
/// a cell there: one box per group, and the groups' members in ascending order.
fn group_by_centre<S: Real>(boxes: &[Aabb<S>], prims: &[u32]) -> (Vec<obvhs::aabb::Aabb>, Vec<Vec<u32>>) {
    let all = prims.iter().fold(Aabb::EMPTY, |a, &p| a.union(&boxes[p as usize]));
    let (lo, hi) = all.to_f64();
    // Halved before the subtraction: the extent of +-1e308 is finite then.
    let centre = lo * 0.5 + hi * 0.5;
    let half = (hi * 0.5 - lo * 0.5).max_element();
    let scale = if half > 0.0 { 1.0 / half } else { 0.0 };
    let scale = if scale.is_finite() { scale } else { f64::MAX };
    let mut keyed: Vec<([i32; 3], u32, Aabb<f32>)> = prims
        .par_iter()
        .map(|&p| {
            let (lo, hi) = boxes[p as usize].to_f64();
            let b = Aabb::<f32>::enclosing((lo - centre) * scale, (hi - centre) * scale);
            let key = each(|a| ((b.lo[a] + b.hi[a]) * (0.5 * CELLS)).round() as i32);
            (key, p, b)
        })
        .collect();
    keyed.par_sort_unstable_by_key(|(key, p, _)| (*key, *p));
    let mut frame_boxes = Vec::new();
    let mut groups: Vec<Vec<u32>> = Vec::new();
    // Groups in order of their first member, so that equal input orders give equal trees.
    let mut runs: Vec<&[_]> = keyed.chunk_by(|a, b| a.0 == b.0).collect();
    runs.par_sort_unstable_by_key(|run| run[0].1);
    for run in runs {
        let b = run.iter().fold(Aabb::EMPTY, |a, (_, _, b)| a.union(b));
        frame_boxes.push(obvhs::aabb::Aabb::new(b.lo.into(), b.hi.into()));
        groups.push(run.iter().map(|(_, p, _)| *p).collect());
    }
    (frame_boxes, groups)
}

/// Clusters boxes with obvhs; `None` if it panics (its input is sanitised, but a build must not take the program
/// down).
fn cluster(boxes: &[obvhs::aabb::Aabb], preset: Preset) -> Option<Bvh2> {
    let (distance, threshold, reinsertion, precision) = match preset {
        Preset::Fast => (PlocSearchDistance::Low, 2, 0.02, SortPrecision::U64),
        Preset::Balanced => (PlocSearchDistance::Medium, 3, 0.05, SortPrecision::U64),
        Preset::Best => (PlocSearchDistance::Medium, 1, 1.0, SortPrecision::U128),
    };
    std::panic::catch_unwind(|| {
        let indices = (0..boxes.len() as u32).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(distance, boxes, indices, precision, threshold);
        ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
        tree
    })
    .ok()
    .filter(|tree| tree.nodes.len() == 2 * boxes.len() - 1)
}
