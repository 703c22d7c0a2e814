//! Which leaves matter to which lanes: a sparse walk from the leaves that are met up to the root and back.
//!
//! An operation can differ from its default only in lanes where all its strong operands can, or, without such, where
//! any operand can. This is decided lane by lane from the lane's own line, so a packet of any width sees the same
//! leaves in each lane. Only operations above a met leaf are touched: the rest of the tree, however large, costs
//! nothing. Source: Zanni, "Synchronized tracing of primitive-based implicit volumes", 2023 (bottom-up pruning).

use super::tree::{Gate, LeafPlace, Node, Tree};

/// A leaf that some lanes meet.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Leaf number.
    pub leaf: u32,
    /// Lanes that meet its box.
    pub lanes: u32,
    /// Where: a place in the search's [`super::solid::Intervals`].
    pub at: u32,
    /// Number of the operand that it has become, or one of the two below.
    pub operand: u32,
}

impl Met {
    /// Not looked at yet.
    pub const UNSEEN: u32 = u32::MAX;
    /// Its leaf is not met after all.
    pub const MISSED: u32 = u32::MAX - 1;
}

/// An operation above met leaves.
#[derive(Clone, Copy, Debug)]
struct Touched {
    node: u32,
    any: u32,
    all: u32,
    strong: u32,
    live: u32,
}

/// An operation of a [`Program`]: operands fold into `start`, the result into the slot `parent`.
#[derive(Clone, Copy, Debug)]
struct GateStep {
    gate: Gate,
    start: u32,
    parent: u32,
}

/// A leaf of a [`Program`].
#[derive(Clone, Copy, Debug)]
struct LeafStep {
    gate: Gate,
    negated: u32,
    parent: u32,
}

/// Operations over the leaves that are left, on masks of lanes. Slots of operations count from the root down.
#[derive(Debug, Default)]
pub struct Program {
    leaves: Vec<LeafStep>,
    gates: Vec<GateStep>,
    values: Vec<u32>,
}

/// Working memory.
#[derive(Debug, Default)]
pub struct Pruner {
    touched: Vec<Touched>,
    /// Slot of each touched node in `touched`, valid where `stamp` is this packet's.
    slot: Vec<u32>,
    stamp: Vec<u32>,
    now: u32,
}

impl Pruner {
    /// Cuts `met` (each leaf once) down to the leaves and lanes that matter, and writes the program over them, leaf `i`
    /// of which is `met[i]`.
    pub fn prune(&mut self, tree: &Tree, met: &mut Vec<Met>, program: &mut Program) {
        if let [only] = &tree.nodes[..] {
            return prune_one(only, tree, met, program);
        }
        self.touch(tree, met);
        self.rise(tree, met);
        let root_live = self.touched.first().map_or(0, |t| t.live);
        program.clear();
        if root_live == 0 {
            met.clear();
            return;
        }
        // Down again: a node matters where its parent does.
        for i in 1..self.touched.len() {
            let parent = self.slot[tree.nodes[self.touched[i].node as usize].parent as usize];
            self.touched[i].live &= self.touched[parent as usize].live;
        }
        met.retain_mut(|m| {
            let parent = self.slot[tree.leaves[m.leaf as usize].parent as usize];
            m.lanes &= self.touched[parent as usize].live;
            m.lanes != 0
        });
        self.write(tree, met, program);
    }

    /// Lists the operations above `met`, root first.
    fn touch(&mut self, tree: &Tree, met: &[Met]) {
        let size = tree.nodes.len();
        if self.stamp.len() < size {
            self.stamp.resize(size, 0);
            self.slot.resize(size, 0);
        }
        self.now = self.now.wrapping_add(1);
        if self.now == 0 {
            self.stamp.fill(0);
            self.now = 1;
        }
        self.touched.clear();
        for m in met {
            let mut node = tree.leaves[m.leaf as usize].parent;
            while self.stamp[node as usize] != self.now {
                self.stamp[node as usize] = self.now;
                self.touched.push(Touched { node, any: 0, all: u32::MAX, strong: 0, live: 0 });
                node = tree.nodes[node as usize].parent;
            }
        }
        self.touched.sort_unstable_by_key(|t| t.node);
        for (i, t) in self.touched.iter().enumerate() {
            self.slot[t.node as usize] = i as u32;
        }
    }

    /// Where each operation can differ from its default.
    fn rise(&mut self, tree: &Tree, met: &[Met]) {
        for m in met {
            let LeafPlace { parent, strong, .. } = tree.leaves[m.leaf as usize];
            self.add(parent, strong, m.lanes);
        }
        for i in (0..self.touched.len()).rev() {
            let t = self.touched[i];
            let node = &tree.nodes[t.node as usize];
            let live = live(node, t.any, t.all, t.strong);
            self.touched[i].live = live;
            if i > 0 {
                self.add(node.parent, node.strong, live);
            }
        }
    }

    fn add(&mut self, parent: u32, strong: bool, lanes: u32) {
        let t = &mut self.touched[self.slot[parent as usize] as usize];
        t.any |= lanes;
        if strong {
            t.all &= lanes;
            t.strong += 1;
        }
    }

    fn write(&mut self, tree: &Tree, met: &[Met], program: &mut Program) {
        // Operations that matter nowhere drop out; they stay at their defaults, which are neutral to their parents, or
        // count for an `xor`.
        for i in 0..self.touched.len() {
            let t = self.touched[i];
            let node = &tree.nodes[t.node as usize];
            if t.live == 0 {
                continue;
            }
            let parent = self.slot[node.parent as usize];
            let parent = if i == 0 { 0 } else { self.touched[parent as usize].strong };
            let start = start(node);
            // From here on `strong` holds the slot in the program.
            self.touched[i].strong = program.gates.len() as u32;
            program.gates.push(GateStep { gate: node.gate, start, parent });
            if i > 0 && program.gates[parent as usize].gate == Gate::Xor && node.default {
                program.gates[parent as usize].start ^= u32::MAX;
            }
        }
        for m in met {
            let place = &tree.leaves[m.leaf as usize];
            let parent = self.touched[self.slot[place.parent as usize] as usize].strong;
            let gate = program.gates[parent as usize].gate;
            let negated = if place.negated { u32::MAX } else { 0 };
            program.leaves.push(LeafStep { gate, negated, parent });
            if gate == Gate::Xor && place.negated {
                program.gates[parent as usize].start ^= u32::MAX;
            }
        }
        program.values.resize(program.gates.len(), 0);
    }
}

/// The same where there is one operation, as in most solids.
fn prune_one(only: &Node, tree: &Tree, met: &mut Vec<Met>, program: &mut Program) {
    program.clear();
    let (mut any, mut all, mut strong) = (0, u32::MAX, 0);
    for m in &*met {
        any |= m.lanes;
        if tree.leaves[m.leaf as usize].strong {
            all &= m.lanes;
            strong += 1;
        }
    }
    let live = live(only, any, all, strong);
    let mut start = start(only);
    met.retain_mut(|m| {
        m.lanes &= live;
        if m.lanes != 0 {
            let negated = if tree.leaves[m.leaf as usize].negated { u32::MAX } else { 0 };
            program.leaves.push(LeafStep { gate: only.gate, negated, parent: 0 });
            start ^= if only.gate == Gate::Xor { negated } else { 0 };
        }
        m.lanes != 0
    });
    if live != 0 {
        program.gates.push(GateStep { gate: only.gate, start, parent: 0 });
        program.values.push(0);
    }
}

/// Where an operation can differ from its default: where all its strong operands can, of which `strong` are met and meet in
/// `all`, or, without such, where `any` operand can.
fn live(node: &Node, any: u32, all: u32, strong: u32) -> u32 {
    match node.strong_operands {
        0 => any,
        needed if needed == strong => all,
        _ => 0,
    }
}

/// What operands fold into.
fn start(node: &Node) -> u32 {
    match node.gate {
        Gate::And => u32::MAX,
        Gate::Or => 0,
        Gate::Xor => {
            if node.default {
                u32::MAX
            } else {
                0
            }
        }
    }
}

impl Program {
    fn clear(&mut self) {
        self.leaves.clear();
        self.gates.clear();
        self.values.clear();
    }

    /// Lanes that are inside, where `inside[i]` has the lanes that are in leaf `i`.
    #[inline(always)]
    pub fn run(&mut self, inside: &[u32]) -> u32 {
        if let [GateStep { gate, start, .. }] = self.gates[..] {
            // Most solids, or what is left of them, are one operation.
            let values = self.leaves.iter().zip(inside).map(|(leaf, &inside)| inside ^ leaf.negated);
            return match gate {
                Gate::And => values.fold(start, |all, value| all & value),
                Gate::Or => values.fold(start, |all, value| all | value),
                Gate::Xor => values.fold(start, |all, value| all ^ value),
            };
        }
        for (value, gate) in self.values.iter_mut().zip(&self.gates) {
            *value = gate.start;
        }
        // Neighbours are often operands of one operation: its value stays at hand.
        let (mut parent, mut value) = (0, self.values.first().copied().unwrap_or(0));
        for (leaf, &inside) in self.leaves.iter().zip(inside) {
            if leaf.parent != parent {
                self.values[parent as usize] = value;
                (parent, value) = (leaf.parent, self.values[leaf.parent as usize]);
            }
            fold(&mut value, leaf.gate, inside ^ leaf.negated);
        }
        if let Some(last) = self.values.get_mut(parent as usize) {
            *last = value;
        }
        for i in (1..self.gates.len()).rev() {
            let GateStep { parent, .. } = self.gates[i];
            let gate = self.gates[parent as usize].gate;
            let value = self.values[i];
            fold(&mut self.values[parent as usize], gate, value);
        }
        self.values.first().copied().unwrap_or(0)
    }
}

#[inline(always)]
fn fold(into: &mut u32, gate: Gate, value: u32) {
    match gate {
        Gate::And => *into &= value,
        Gate::Or => *into |= value,
        Gate::Xor => *into ^= value,
    }
}
