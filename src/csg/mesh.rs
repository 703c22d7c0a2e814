//! Closed triangle meshes as leaves: all crossings of a line, paired.
//!
//! The triangle kernel is watertight but counts a shared edge for both its triangles, so crossings are not counted by parity:
//! sorted by t they are walked with the triangles' orientation, which says what enters and what leaves. Where both happen
//! within the tolerance the line only touches. In between a second entry or exit is the other triangle of an edge.

use glam::DVec3;

use super::events::Events;
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
}

/// Working memory.
#[derive(Debug, Default)]
pub struct Crossings {
    list: Vec<Crossing>,
    stack: Vec<(u32, u32)>,
}

/// Where a lane crosses a triangle.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    lane: usize,
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
        let records: Vec<([S; 9], u32)> =
            triangles.zip(0..).filter_map(|(corners, i)| Some((Triangle::record(corners).ok()?, i))).collect();
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
        Self { tree, blocks: blocks.collect() }
    }

    /// Bytes of triangles and nodes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..]) + size_of_val(&self.blocks[..])
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
        crossings.list.sort_by(|a, b| a.lane.cmp(&b.lane).then(a.t.total_cmp(&b.t)).then(a.triangle.cmp(&b.triangle)));
        let mut rows: Vec<Row<S>> = Vec::new();
        for of_lane in crossings.list.chunk_by(|a, b| a.lane == b.lane) {
            let lane = of_lane[0].lane;
            let apart = eps.lane(lane).to_f64();
            let mut filled = 0;
            let mut entered: Option<Crossing> = None;
            let mut rest = of_lane;
            while let Some(first) = rest.first() {
                let (group, after) = rest.split_at(rest.partition_point(|c| c.t <= first.t + apart));
                rest = after;
                let enters = group.iter().find(|c| c.enters);
                let leaves = group.iter().find(|c| !c.enters);
                match (entered, enters, leaves) {
                    (None, Some(enter), None) => entered = Some(*enter),
                    (Some(enter), None, Some(leave)) => {
                        put(&mut rows, filled, lane, [enter, *leave]);
                        filled += 1;
                        entered = None;
                    }
                    _ => {}
                }
            }
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
        let Crossings { list, stack } = crossings;
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
                list.push(Crossing { lane, t: found.t.lane(lane).to_f64(), enters, triangle });
            }
        });
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
