//! Closed triangle meshes as leaves: all crossings of a line, paired.
//!
//! The triangle kernel is watertight but counts a shared edge for both its triangles, so crossings are not counted by parity:
//! sorted by t they are walked with the triangles' orientation, which says what enters and what leaves. Where both happen
//! within the tolerance the line only touches. In between a second entry or exit is the other triangle of an edge.
//!
//! A mesh may consist of several pieces, nested or overlapping: each is walked on its own, and the line is inside where it is in
//! more pieces than voids.

use glam::DVec3;

use super::events::Events;
use super::pieces::Pieces;
use crate::bvh::{self, Preset};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::{Block, Span, Triangle, TriangleBlock};

/// Triangles of a mesh in the tree's space, wound counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub(super) struct Mesh<S> {
    tree: bvh::Tree<S>,
    blocks: Vec<TriangleBlock<S>>,
    pieces: Pieces,
}

/// Working memory.
#[derive(Debug, Default)]
pub struct Crossings {
    list: Vec<Crossing>,
    /// Where a lane enters and leaves the pieces.
    ends: Vec<Crossing>,
    stack: Vec<(u32, u32)>,
}

/// Where a lane crosses a triangle.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    lane: usize,
    piece: u32,
    t: f64,
    enters: bool,
    triangle: u32,
}

/// The boundaries that are the n-th of their lanes.
struct Row<S> {
    t: [[S; MAX_LANES]; 2],
    face: [[S; MAX_LANES]; 2],
    lanes: u32,
}

impl<S: Real> Mesh<S> {
    /// Of the triangles' corners in the tree's space; triangles without an area are left out.
    pub fn new(triangles: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let triangles: Vec<[DVec3; 3]> = triangles.collect();
        let records: Vec<([S; 9], u32)> =
            triangles.iter().zip(0..).filter_map(|(corners, i)| Some((Triangle::record(*corners).ok()?, i))).collect();
        let boxes: Vec<_> = records.iter().map(|(numbers, _)| Triangle::bounds(numbers)).collect();
        let (tree, leaves) = bvh::build(&boxes, &vec![0; boxes.len()], Preset::Balanced);
        let blocks = leaves.iter().map(|leaf| {
            let mut block = Block::empty();
            for (slot, &p) in leaf.prims().iter().enumerate() {
                let (numbers, id) = records[p as usize];
                block.set(slot, numbers, id);
            }
            block
        });
        Self { tree, blocks: blocks.collect(), pieces: Pieces::new(&triangles) }
    }

    /// Bytes of triangles and nodes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..]) + size_of_val(&self.blocks[..]) + self.pieces.bytes()
    }

    /// Adds the boundaries in `lanes`; the faces are the triangles' numbers.
    pub fn boundaries<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        within: &Interval<V>,
        eps: V,
        (slot, lanes): (u32, u32),
        crossings: &mut Crossings,
        events: &mut Events<S>,
    ) {
        self.cross(packet, lanes, crossings);
        let Crossings { list, ends, .. } = crossings;
        let by_t = |a: &Crossing, b: &Crossing| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle));
        list.sort_by(|a, b| a.lane.cmp(&b.lane).then(a.piece.cmp(&b.piece)).then(by_t(a, b)));
        let mut rows: Vec<Row<S>> = Vec::new();
        for of_lane in list.chunk_by(|a, b| a.lane == b.lane) {
            let lane = of_lane[0].lane;
            let apart = eps.lane(lane).to_f64();
            ends.clear();
            for of_piece in of_lane.chunk_by(|a, b| a.piece == b.piece) {
                walk(of_piece, self.pieces.is_void(of_piece[0].piece), apart, ends);
            }
            ends.sort_by(by_t);
            let mut filled = 0;
            unite(ends, apart, |span| {
                put(&mut rows, filled, lane, span);
                filled += 1;
            });
        }
        for row in &rows {
            let [t_in, t_out] = [0, 1].map(|k| V::load(&row.t[k]));
            let [face_in, face_out] = [0, 1].map(|k| V::load(&row.face[k]));
            let span = Span { hit: V::Mask::from_bits(row.lanes), t_in, t_out, face_in, face_out };
            events.push_span(slot, lanes, &span, within);
        }
    }

    /// Lists all crossings of the lines in `lanes`.
    fn cross<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, lanes: u32, crossings: &mut Crossings) {
        let Crossings { list, stack, .. } = crossings;
        list.clear();
        stack.clear();
        if self.tree.nodes.is_empty() {
            return;
        }
        let mut line = *packet;
        (line.t_min, line.t_floor) = (V::splat(S::LOWEST), V::splat(S::LOWEST));
        stack.push((0, lanes));
        while let Some((node, lanes)) = stack.pop() {
            let node = &self.tree.nodes[node as usize];
            for slot in 0..node.used as usize {
                let bounds = node.child_bounds(slot);
                let interval = Interval::of(&line, bounds.lo, bounds.hi);
                let lanes = interval.near.cmp_le(interval.far).bits() & lanes;
                let child = node.child(slot);
                if lanes != 0 && child.is_leaf() {
                    self.block(&line, child, lanes, list);
                } else if lanes != 0 {
                    stack.push((child.index, lanes));
                }
            }
        }
    }

    fn block<V: Lanes<Scalar = S>>(&self, line: &Packet<V>, leaf: bvh::Child, lanes: u32, list: &mut Vec<Crossing>) {
        let block = &self.blocks[leaf.index as usize];
        let every = V::splat(V::Scalar::INFINITY);
        Triangle::intersect(line, every, block, (1 << leaf.count) - 1, lanes, |found, tested, triangle| {
            let mut hit = found.hit.bits() & tested & lanes;
            if hit == 0 {
                return;
            }
            let slot = block.prim.iter().position(|&p| p == triangle).unwrap_or(0);
            let normal = Triangle::normal(&block.get(slot));
            while hit != 0 {
                let lane = hit.trailing_zeros() as usize;
                hit &= hit - 1;
                let dir = DVec3::from_array(line.dir.map(|x| x.lane(lane).to_f64()));
                let enters = normal.dot(dir) < 0.0;
                let (piece, t) = (self.pieces.of(triangle), found.t.lane(lane).to_f64());
                list.push(Crossing { lane, piece, t, enters, triangle });
            }
        });
    }
}

/// Crossings that are no farther apart than that, in turn.
fn groups(mut rest: &[Crossing], apart: f64) -> impl Iterator<Item = &[Crossing]> {
    std::iter::from_fn(move || {
        let first = rest.first()?;
        let (group, after) = rest.split_at(rest.partition_point(|c| c.t <= first.t + apart));
        rest = after;
        Some(group)
    })
}

/// Adds where a line passes through one piece to `ends`, pair by pair; a void is entered where its surface is left.
fn walk(of_piece: &[Crossing], is_void: bool, apart: f64, ends: &mut Vec<Crossing>) {
    let mut entered: Option<Crossing> = None;
    for group in groups(of_piece, apart) {
        let enters = group.iter().find(|c| c.enters != is_void);
        let leaves = group.iter().find(|c| c.enters == is_void);
        match (entered, enters, leaves) {
            (None, Some(enter), None) => entered = Some(*enter),
            (Some(enter), None, Some(leave)) => {
                ends.extend([enter, *leave]);
                entered = None;
            }
            _ => {}
        }
    }
}

/// Where a line is in more pieces than voids; `ends` by t. Pieces that touch within the tolerance are not left in between.
fn unite(ends: &[Crossing], apart: f64, mut found: impl FnMut([Crossing; 2])) {
    let mut depth = 0;
    let mut entered: Option<Crossing> = None;
    for group in groups(ends, apart) {
        depth += group.iter().map(|c| if c.enters { 1 } else { -1 }).sum::<i32>();
        match (entered, depth > 0) {
            (None, true) => entered = group.iter().find(|c| c.enters).copied(),
            (Some(enter), false) => {
                // The depth has fallen, so one of these leaves.
                group.iter().filter(|c| !c.enters).take(1).for_each(|leave| found([enter, *leave]));
                entered = None;
            }
            _ => {}
        }
    }
}

fn put<S: Real>(rows: &mut Vec<Row<S>>, at: usize, lane: usize, ends: [Crossing; 2]) {
    if rows.len() <= at {
        rows.push(Row { t: [[S::ZERO; MAX_LANES]; 2], face: [[S::ZERO; MAX_LANES]; 2], lanes: 0 });
    }
    let row = &mut rows[at];
    row.lanes |= 1 << lane;
    for (k, end) in ends.iter().enumerate() {
        row.t[k][lane] = S::from_f64(end.t);
        row.face[k][lane] = S::from_f64(f64::from(end.triangle));
    }
}
