//! The operations of a solid in negation normal form: complements only at leaves, `and`, `or` and `xor` of any number
//! of operands above them. Built and walked without recursion.
//!
//! Source: complements pushed to the leaves as in Goldfeather, Hultquist, Fuchs, "Fast constructive solid geometry
//! display in the Pixel-Powers graphics system", 1986.

/// One step of a postfix program over leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Token {
    /// Pushes leaf `i`. Every leaf stands in the program once.
    Leaf(u32),
    /// Takes that many operands.
    Op(Op, u32),
}

/// Operations of a program. Without operands all but the complement, which takes one, give nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// In any operand.
    Union,
    /// In all operands.
    Intersection,
    /// In the first operand only.
    Difference,
    /// In an odd number of operands.
    Xor,
    /// Outside.
    Complement,
}

/// Operation of a [`Node`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    /// All operands.
    And,
    /// Any operand.
    Or,
    /// An odd number of operands.
    Xor,
}

/// An operation. A child's number is larger than its parent's.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// What it does.
    pub gate: Gate,
    /// Number of the parent; the root, 0, is its own.
    pub parent: u32,
    /// Its value where no leaf is met.
    pub default: bool,
    /// Whether it alone, at its default, decides its parent's value.
    pub strong: bool,
    /// Number of operands that are strong.
    pub strong_operands: u32,
}

/// Place of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct LeafPlace {
    /// The operation it is an operand of.
    pub parent: u32,
    /// Whether it counts as its outside.
    pub negated: bool,
    /// As [`Node::strong`].
    pub strong: bool,
}

/// A solid's operations.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Operations, root first.
    pub nodes: Vec<Node>,
    /// Places of the leaves by number.
    pub leaves: Vec<LeafPlace>,
}

/// A program as a tree: for each token its operands' tokens.
struct Operands {
    /// First entry in `list` of each token's operands.
    first: Vec<u32>,
    list: Vec<u32>,
}

impl Operands {
    fn of(program: &[Token]) -> Self {
        let mut found = Self { first: Vec::with_capacity(program.len()), list: Vec::new() };
        let mut stack: Vec<u32> = Vec::new();
        for (i, token) in program.iter().enumerate() {
            found.first.push(found.list.len() as u32);
            if let Token::Op(_, count) = token {
                let rest = stack.len().saturating_sub(*count as usize);
                found.list.extend(stack.drain(rest..));
            }
            stack.push(i as u32);
        }
        found
    }

    fn get(&self, token: u32) -> &[u32] {
        let end = self.first.get(token as usize + 1).map_or(self.list.len(), |&e| e as usize);
        &self.list[self.first[token as usize] as usize..end]
    }
}

/// A token on its way into the tree: `parent` will hold it.
struct Open {
    token: u32,
    negated: bool,
    parent: u32,
}

impl Tree {
    /// The tree of a postfix program that leaves one value; an empty program is nothing. `leaves` is their number.
    pub fn new(program: &[Token], leaves: usize) -> Self {
        let operands = Operands::of(program);
        let root = Node { gate: Gate::Or, parent: 0, default: false, strong: false, strong_operands: 0 };
        let unplaced = LeafPlace { parent: 0, negated: false, strong: false };
        let mut tree = Self { nodes: vec![root], leaves: vec![unplaced; leaves] };
        let mut open = Vec::new();
        let mut fresh_root = true;
        if !program.is_empty() {
            open.push(Open { token: program.len() as u32 - 1, negated: false, parent: 0 });
        }
        while let Some(Open { token, negated, parent }) = open.pop() {
            let list = operands.get(token);
            let op = match program[token as usize] {
                Token::Leaf(leaf) => {
                    tree.leaves[leaf as usize] = LeafPlace { parent, negated, strong: false };
                    continue;
                }
                Token::Op(op, _) => op,
            };
            if op != Op::Complement && list.len() == 1 {
                // Groups of one: nothing but that.
                open.push(Open { token: list[0], negated, parent });
                continue;
            }
            if op == Op::Complement {
                open.extend(list.iter().map(|&token| Open { token, negated: !negated, parent }));
                continue;
            }
            let gate = match (op, negated) {
                (Op::Xor, _) => Gate::Xor,
                // Nothing is an `or` without operands, its complement an `and` without.
                (_, _) if list.is_empty() => {
                    if negated {
                        Gate::And
                    } else {
                        Gate::Or
                    }
                }
                (Op::Union, false) | (Op::Intersection | Op::Difference, true) => Gate::Or,
                _ => Gate::And,
            };
            // An operation directly below the same operation is part of it; so is the first below the bare root.
            let bare = std::mem::replace(&mut fresh_root, false);
            let merged = gate != Gate::Xor && (tree.nodes[parent as usize].gate == gate || bare);
            let node = if merged || bare {
                tree.nodes[parent as usize].gate = gate;
                parent
            } else {
                tree.nodes.push(Node { gate, parent, ..root });
                tree.nodes.len() as u32 - 1
            };
            if gate == Gate::Xor && list.is_empty() && negated {
                tree.nodes[node as usize].gate = Gate::And;
            }
            for (i, &token) in list.iter().enumerate().rev() {
                let negated = match op {
                    Op::Xor => negated && i == 0,
                    Op::Difference => negated != (i > 0),
                    _ => negated,
                };
                open.push(Open { token, negated, parent: node });
            }
        }
        tree.find_defaults();
        tree
    }

    /// Bytes of operations and places.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.leaves[..])
    }

    /// Bottom-up: what every operation gives where no leaf is met.
    fn find_defaults(&mut self) {
        // Per node: has a true operand, has a false one, odd number of true ones.
        let mut seen = vec![(false, false, false); self.nodes.len()];
        let take = |seen: &mut Vec<(bool, bool, bool)>, parent: u32, value: bool| {
            let (some_true, some_false, odd) = &mut seen[parent as usize];
            *some_true |= value;
            *some_false |= !value;
            *odd ^= value;
        };
        for leaf in &self.leaves {
            take(&mut seen, leaf.parent, leaf.negated);
        }
        for i in (0..self.nodes.len()).rev() {
            let (some_true, some_false, odd) = seen[i];
            let node = &mut self.nodes[i];
            node.default = match node.gate {
                Gate::And => !some_false,
                Gate::Or => some_true,
                Gate::Xor => odd,
            };
            if i > 0 {
                take(&mut seen, node.parent, node.default);
            }
        }
        let decides = |gate: Gate, value: bool| gate == if value { Gate::Or } else { Gate::And };
        for i in 1..self.nodes.len() {
            let Node { parent, default, .. } = self.nodes[i];
            let strong = decides(self.nodes[parent as usize].gate, default);
            self.nodes[i].strong = strong;
            self.nodes[parent as usize].strong_operands += u32::from(strong);
        }
        for leaf in &mut self.leaves {
            let parent = &mut self.nodes[leaf.parent as usize];
            leaf.strong = decides(parent.gate, leaf.negated);
            parent.strong_operands += u32::from(leaf.strong);
        }
    }
}
