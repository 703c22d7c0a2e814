//! What an engine did: tests and lanes, counted by kernels compiled with counting on.

/// Counts of one traversal run. "Lane" counts are sums over tests of (active, total) lanes, so lane use is
/// `active / total`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Counters {
    /// Rays traced (live ones).
    pub rays: u64,
    /// Inner nodes visited by packets (or single rays); each visit tests all boxes against the packet's bounds.
    pub nodes: u64,
    /// Of these, nodes of sixteen boxes instead of eight.
    pub wide_nodes: u64,
    /// Boxes in the nodes visited: places of a node without a child hold none.
    #[serde(default)]
    pub node_boxes: u64,
    /// Tests of one box against all lanes of a packet, after the packet's bounds met it.
    pub boxes: u64,
    /// Tests of a box against one ray, or against the bounds of several: as many per node visit of a packet or tile as a node
    /// has, as many per ray and node visit of a stream, and one per lane where a box is tested against all lanes.
    pub box_lanes: u64,
    /// Leaves visited.
    pub leaves: u64,
    /// Primitive tests (one primitive against one packet).
    pub prims: u64,
    /// Lanes wanted in node visits.
    pub node_lanes_active: u64,
    /// Lanes paid for in node visits.
    pub node_lanes_total: u64,
    /// Lanes wanted in primitive tests.
    pub prim_lanes_active: u64,
    /// Lanes paid for in primitive tests.
    pub prim_lanes_total: u64,
    /// Of these, lanes tested by the linear functions of a tile.
    pub prim_lanes_linear: u64,
    /// Trees of solids tested (one tree against one packet).
    pub solids: u64,
    /// Leaves of trees of solids whose boxes the packets met.
    pub solid_leaves_met: u64,
    /// Of these, leaves that could make a difference.
    pub solid_leaves_kept: u64,
    /// Boundaries of leaves, vectors of lanes.
    pub solid_events: u64,
    /// Steps of the sweeps over them.
    pub solid_steps: u64,
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, o: Self) {
        self.rays += o.rays;
        self.nodes += o.nodes;
        self.wide_nodes += o.wide_nodes;
        self.node_boxes += o.node_boxes;
        self.boxes += o.boxes;
        self.box_lanes += o.box_lanes;
        self.leaves += o.leaves;
        self.prims += o.prims;
        self.node_lanes_active += o.node_lanes_active;
        self.node_lanes_total += o.node_lanes_total;
        self.prim_lanes_active += o.prim_lanes_active;
        self.prim_lanes_total += o.prim_lanes_total;
        self.prim_lanes_linear += o.prim_lanes_linear;
        self.solids += o.solids;
        self.solid_leaves_met += o.solid_leaves_met;
        self.solid_leaves_kept += o.solid_leaves_kept;
        self.solid_events += o.solid_events;
        self.solid_steps += o.solid_steps;
    }
}
