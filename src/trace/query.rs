//! One packet's query on its way through the trees: best hits, finished lanes, the stack.

use super::single::Waiting;
use crate::bvh::{Child, WIDTH};
use crate::csg;
use crate::lanes::{Column, LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::{Candidate, Counters, HitPacket};

/// What waits to be visited.
#[derive(Clone, Copy, Debug)]
struct Entry {
    child: Child,
    lanes: u32,
}

/// Traversal stack: references with their lanes, and beside them where each lane enters the box.
#[derive(Debug, Default)]
pub struct Stack<S> {
    entries: Vec<Entry>,
    near: Column<S>,
    /// What waits for a single ray.
    pub waiting: Vec<Waiting<S>>,
    /// What trees of solids need: large, and lent to every sweep.
    pub solids: Option<Box<csg::Scratch<S>>>,
}

impl<S: Real> Stack<S> {
    /// Makes room for `bound` entries of any width.
    pub fn reserve(&mut self, bound: usize) {
        self.entries.clear();
        self.entries.reserve(bound);
        self.waiting.clear();
        self.waiting.reserve(bound);
        self.near.at_least(bound * MAX_LANES);
    }

    /// Entries on the stack.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Drops everything above `base`.
    #[inline(always)]
    pub fn truncate(&mut self, base: usize) {
        self.entries.truncate(base);
    }

    /// Puts a box on the stack: its `lanes` enter at `near`.
    #[inline(always)]
    pub fn push<V: Lanes<Scalar = S>>(&mut self, child: Child, lanes: u32, near: V) {
        near.store(&mut self.near[self.entries.len() * MAX_LANES..]);
        self.entries.push(Entry { child, lanes });
    }

    /// Takes the top entry if there are more than `base`.
    #[inline(always)]
    pub fn pop<V: Lanes<Scalar = S>>(&mut self, base: usize) -> Option<(Child, u32, V)> {
        if self.entries.len() <= base {
            return None;
        }
        let entry = self.entries.pop()?;
        Some((entry.child, entry.lanes, V::load(&self.near[self.entries.len() * MAX_LANES..])))
    }
}

/// The state of `N` rays' query. `ANY`: stop a lane at its first hit; `COUNT`: keep the counters.
#[derive(Debug)]
pub struct Query<'a, V: Lanes, const ANY: bool, const COUNT: bool> {
    /// Best hits so far (closest-hit).
    pub hit: HitPacket<V>,
    /// Lanes that found something (any-hit).
    pub done: u32,
    /// Stack shared by the upper and the lower tree.
    pub stack: &'a mut Stack<V::Scalar>,
    /// Counters, touched only when `COUNT`.
    pub counters: &'a mut Counters,
}

impl<'a, V: Lanes, const ANY: bool, const COUNT: bool> Query<'a, V, ANY, COUNT> {
    /// A query with nothing found.
    #[inline(always)]
    pub fn new(hit: HitPacket<V>, stack: &'a mut Stack<V::Scalar>, counters: &'a mut Counters) -> Self {
        Self { hit, done: 0, stack, counters }
    }

    /// Of `lanes`, those that still look for something in a box they enter at `near`.
    #[inline(always)]
    pub fn wanted(&self, lanes: u32, near: V) -> u32 {
        if ANY { lanes & !self.done } else { lanes & near.cmp_le(self.hit.t).bits() }
    }

    /// Takes in what a kernel found for `prim` in `lanes`.
    #[inline(always)]
    pub fn take(&mut self, lanes: u32, found: &Candidate<V>, prim: u32, inst: u32) {
        if ANY {
            self.done |= (found.hit & found.t.cmp_le(self.hit.t)).bits() & lanes;
        } else {
            self.hit.commit(lanes, found, prim, inst);
        }
    }

    /// Hands one lane to a query of width 1 and takes its result back.
    #[inline(always)]
    pub fn with_single(&mut self, lane: usize, run: impl FnOnce(&mut Query<'_, V::Scalar, ANY, COUNT>)) {
        let mut single = Query::new(self.hit.single(lane), &mut *self.stack, &mut *self.counters);
        run(&mut single);
        let (hit, done) = (single.hit, single.done);
        if ANY {
            self.done |= done << lane;
        } else {
            self.hit.replace(lane, &hit);
        }
    }

    /// Counts a visit of `lanes` to a node of `boxes`, which are tested all at once.
    #[inline(always)]
    pub fn count_node(&mut self, lanes: u32, boxes: u32) {
        if COUNT {
            self.counters.nodes += 1;
            self.counters.node_boxes += u64::from(boxes);
            self.counters.box_lanes += WIDTH as u64;
            self.counters.node_lanes_active += u64::from(lanes.count_ones());
            self.counters.node_lanes_total += V::N as u64;
        }
    }

    /// Counts a test of one box against every lane.
    #[inline(always)]
    pub fn count_box(&mut self) {
        if COUNT {
            self.counters.boxes += 1;
            self.counters.box_lanes += V::N as u64;
        }
    }

    /// Counts a leaf visit of `lanes` that tests `prims` primitives.
    #[inline(always)]
    pub fn count_leaf(&mut self, lanes: u32, prims: usize) {
        if COUNT {
            self.counters.leaves += 1;
            self.counters.prims += prims as u64;
            self.counters.prim_lanes_active += prims as u64 * u64::from(lanes.count_ones());
            self.counters.prim_lanes_total += (prims * V::N) as u64;
        }
    }
}
