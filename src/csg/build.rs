//! Compiling: leaves and their boxes, boxes of operations up and down the tree, unions of separate things taken apart.
//!
//! Source of the boxes: Cameron, "Efficient bounds in constructive solid geometry", IEEE CG&A 11(3), 1991 (S-bounds).

use super::direct::Operation;
use super::leaf::{Kind, Leaf, LeafInput, Stores};
use super::solid::{LINEAR, Solid};
use super::tree::{Gate, Node, Token, Tree};
use crate::bvh::{self, BuildSettings, Preset};
use crate::lanes::Real;
use crate::math::Aabb;

/// A solid to be compiled.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// Leaves by number.
    pub leaves: &'a [LeafInput<'a>],
    /// Operations over all of them.
    pub program: &'a [Token],
    /// Least distance of two boundaries, in the tree's space.
    pub tolerance: f64,
}

/// What compiling gave.
#[derive(Clone, Debug)]
pub struct Built<S> {
    /// Solids with disjoint boxes, whose union is the whole.
    pub solids: Vec<Solid<S>>,
    /// Leaves whose maps overflow `S`: they count as nothing.
    pub dropped: usize,
}

/// Compiles a solid.
pub fn build<S: Real>(input: &Input, preset: Preset) -> Built<S> {
    let tree = Tree::new(input.program, input.leaves.len());
    let mut stores = Stores::default();
    let leaves: Vec<Option<Leaf<S>>> = input.leaves.iter().map(|l| Leaf::new(l, &mut stores)).collect();
    let dropped = leaves.iter().filter(|l| l.is_none()).count();
    let boxes = Boxes::new(&tree, &leaves);
    let groups = groups(&tree, &boxes, input.tolerance);
    let whole = Whole { tree: &tree, leaves: &leaves, stores: &stores, boxes: &boxes };
    let mut number = vec![0; tree.nodes.len()];
    let parts = groups.iter().filter_map(|group| whole.part(group, groups.len() == 1, &mut number));
    let solids = parts.map(|part| part.finished(S::from_f64(input.tolerance), preset)).collect();
    Built { solids, dropped }
}

/// Boxes outside of which operations and leaves have their defaults.
struct Boxes<S> {
    nodes: Vec<Aabb<S>>,
    /// Cut by the boxes of the operations above.
    leaves: Vec<Aabb<S>>,
}

impl<S: Real> Boxes<S> {
    fn new(tree: &Tree, leaves: &[Option<Leaf<S>>]) -> Self {
        let own = leaves.iter().map(|l| l.as_ref().map_or(Aabb::EMPTY, |l| l.clip));
        let mut boxes = Self { nodes: Vec::new(), leaves: own.collect() };
        // With strong operands all of them must be able to differ, else any.
        let start = |n: &Node| if n.strong_operands > 0 { Aabb::EVERYTHING } else { Aabb::EMPTY };
        boxes.nodes = tree.nodes.iter().map(start).collect();
        for (place, own) in tree.leaves.iter().zip(&boxes.leaves) {
            take(&mut boxes.nodes, &tree.nodes, place.parent, place.strong, own);
        }
        for i in (1..tree.nodes.len()).rev() {
            let own = boxes.nodes[i];
            take(&mut boxes.nodes, &tree.nodes, tree.nodes[i].parent, tree.nodes[i].strong, &own);
        }
        for i in 1..tree.nodes.len() {
            boxes.nodes[i] = meet(&boxes.nodes[i], &boxes.nodes[tree.nodes[i].parent as usize]);
        }
        for (place, own) in tree.leaves.iter().zip(&mut boxes.leaves) {
            *own = meet(own, &boxes.nodes[place.parent as usize]);
        }
        boxes
    }
}

fn take<S: Real>(boxes: &mut [Aabb<S>], nodes: &[Node], parent: u32, strong: bool, own: &Aabb<S>) {
    let into = &mut boxes[parent as usize];
    if strong {
        *into = meet(into, own);
    } else if nodes[parent as usize].strong_operands == 0 {
        *into = into.union(own);
    }
}

/// What two boxes have in common.
fn meet<S: Real>(a: &Aabb<S>, b: &Aabb<S>) -> Aabb<S> {
    let common = Aabb { lo: pick(a.lo, b.lo, S::fast_max), hi: pick(a.hi, b.hi, S::fast_min) };
    if common.is_empty() { Aabb::EMPTY } else { common }
}

fn pick<S: Real>(a: [S; 3], b: [S; 3], f: fn(S, S) -> S) -> [S; 3] {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

/// Operations (without the root) and leaves of one solid, ascending.
#[derive(Clone, Debug, Default)]
struct Group {
    nodes: Vec<u32>,
    leaves: Vec<u32>,
}

/// Operands of a union at the root whose boxes are `gap` apart go to solids of their own.
fn groups<S: Real>(tree: &Tree, boxes: &Boxes<S>, gap: f64) -> Vec<Group> {
    let root = &tree.nodes[0];
    let (nodes, leaves) = (1..tree.nodes.len() as u32, 0..tree.leaves.len() as u32);
    let whole = || vec![Group { nodes: nodes.clone().collect(), leaves: leaves.clone().collect() }];
    if root.gate != Gate::Or || root.default {
        return whole();
    }
    let own_nodes: Vec<u32> = nodes.clone().filter(|&i| tree.nodes[i as usize].parent == 0).collect();
    let own_leaves: Vec<u32> = leaves.clone().filter(|&i| tree.leaves[i as usize].parent == 0).collect();
    let node_boxes = own_nodes.iter().map(|&i| boxes.nodes[i as usize]);
    let operands: Vec<Aabb<S>> = node_boxes.chain(own_leaves.iter().map(|&i| boxes.leaves[i as usize])).collect();
    let (count, of_operand) = separate(&operands, gap);
    if count < 2 {
        return whole();
    }
    let mut groups = vec![Group::default(); count];
    let mut of_node = vec![u32::MAX; tree.nodes.len()];
    for (&i, &g) in own_nodes.iter().zip(&of_operand) {
        of_node[i as usize] = g;
    }
    for i in nodes {
        let parent = tree.nodes[i as usize].parent;
        if parent != 0 {
            of_node[i as usize] = of_node[parent as usize];
        }
        groups[of_node[i as usize] as usize].nodes.push(i);
    }
    let mut of_own = of_operand[own_nodes.len()..].iter();
    for i in leaves {
        let parent = tree.leaves[i as usize].parent;
        let group = if parent == 0 { of_own.next().copied().unwrap_or(0) } else { of_node[parent as usize] };
        groups[group as usize].leaves.push(i);
    }
    groups
}

/// Splits boxes by planes that none of them comes near, as long as there are any (and the work stays in proportion to
/// their number): number of groups, group of each.
fn separate<S: Real>(boxes: &[Aabb<S>], gap: f64) -> (usize, Vec<u32>) {
    let mut of = vec![0; boxes.len()];
    let mut count = 0;
    let mut budget = 64 * boxes.len();
    let mut open = vec![((0..boxes.len() as u32).collect::<Vec<_>>(), 0, 0)];
    while let Some((mut list, axis, failed)) = open.pop() {
        if failed == 3 || list.len() < 2 || budget < list.len() {
            list.iter().for_each(|&i| of[i as usize] = count as u32);
            count += usize::from(!list.is_empty());
            continue;
        }
        budget -= list.len();
        let low = |i: u32| boxes[i as usize].lo[axis].to_f64();
        list.sort_by(|&i, &j| low(i).total_cmp(&low(j)));
        let mut end = f64::NEG_INFINITY;
        let mut runs: Vec<Vec<u32>> = Vec::new();
        for i in list {
            match runs.last_mut() {
                Some(run) if low(i) <= end + 2.0 * gap => run.push(i),
                _ => runs.push(vec![i]),
            }
            end = end.max(boxes[i as usize].hi[axis].to_f64());
        }
        let failed = if runs.len() == 1 { failed + 1 } else { 1 };
        open.extend(runs.into_iter().map(|run| (run, (axis + 1) % 3, failed)));
    }
    (count, of)
}

/// Everything there is, before it is taken apart.
struct Whole<'a, S> {
    tree: &'a Tree,
    leaves: &'a [Option<Leaf<S>>],
    stores: &'a Stores<S>,
    boxes: &'a Boxes<S>,
}

impl<S: Real> Whole<'_, S> {
    /// The solid of one group; `None` if nothing can be in it. `number`: new numbers of its operations are left there.
    fn part(&self, group: &Group, only: bool, number: &mut [u32]) -> Option<Solid<S>> {
        let root = self.tree.nodes[0];
        let mut nodes = vec![root];
        let mut bounds = Aabb::EMPTY;
        number[0] = 0;
        for &i in &group.nodes {
            let node = self.tree.nodes[i as usize];
            number[i as usize] = nodes.len() as u32;
            nodes.push(Node { parent: number[node.parent as usize], ..node });
            if node.parent == 0 {
                bounds = bounds.union(&self.boxes.nodes[i as usize]);
            }
        }
        let mut solid = Solid::empty(Tree { nodes, leaves: Vec::new() });
        for &i in &group.leaves {
            let mut place = self.tree.leaves[i as usize];
            let clip = self.boxes.leaves[i as usize];
            if place.parent == 0 {
                bounds = bounds.union(&clip);
            }
            place.parent = number[place.parent as usize];
            // Where it makes no difference it is left out: it stays at its default.
            if let Some(leaf) = &self.leaves[i as usize]
                && !clip.is_empty()
            {
                solid.numbers.push(i);
                solid.tree.leaves.push(place);
                let leaf = leaf.moved(self.stores, &mut solid.stores);
                solid.leaves.push(Leaf { clip, ..leaf });
            }
        }
        solid.bounds = match (root.default, only) {
            (true, _) => Aabb::EVERYTHING,
            (false, true) => self.boxes.nodes[0],
            (false, false) => bounds,
        };
        (!solid.bounds.is_empty()).then_some(solid)
    }
}

impl<S: Real> Solid<S> {
    /// Without leaves.
    fn empty(tree: Tree) -> Self {
        Self {
            tree,
            leaves: Vec::new(),
            numbers: Vec::new(),
            stores: Stores::default(),
            bounds: Aabb::EVERYTHING,
            size: S::ZERO,
            least: S::ZERO,
            search: None,
            always: Vec::new(),
            is_sole: false,
            front: 1.0,
            operation: None,
        }
    }

    /// With its tolerance, its size and its search tree.
    fn finished(mut self, least: S, preset: Preset) -> Self {
        self.least = least;
        for leaf in &self.leaves {
            for x in leaf.clip.lo.iter().chain(&leaf.clip.hi).filter(|x| x.is_finite()) {
                self.size = self.size.fast_max(x.abs());
            }
        }
        self.index(preset);
        let leaf_is_all = self.tree.nodes.len() == 1 && self.leaves.len() == 1 && !self.tree.leaves[0].negated;
        self.is_sole = leaf_is_all && self.leaves[0].clip == self.bounds;
        self.front = self.front_share();
        // In trees places are looked at one by one, so lines must pass through leaves at most once.
        let listed = |kind: Kind| kind.is_span() || self.search.is_none() && !matches!(kind, Kind::Mesh(_));
        if self.leaves.iter().all(|leaf| listed(leaf.kind)) {
            let operation = Operation::of(&self.tree, |leaf| self.leaves[leaf].clip == self.bounds);
            self.operation = operation.map(Box::new);
        }
        self
    }

    /// Builds the tree over the leaves' boxes, if there are many.
    fn index(&mut self, preset: Preset) {
        let bounded = |i: &u32| self.leaves[*i as usize].clip.is_bounded();
        let all = 0..self.leaves.len() as u32;
        if self.leaves.len() <= LINEAR {
            self.always = all.collect();
            return;
        }
        let (held, always): (Vec<u32>, Vec<u32>) = all.partition(bounded);
        let boxes: Vec<_> = held.iter().map(|&i| self.leaves[i as usize].clip).collect();
        // One leaf of the solid in each leaf of the tree, whose box is then all that is asked of it.
        let (tree, leaves) = bvh::build(&boxes, &vec![0; boxes.len()], BuildSettings { preset, leaf: 1 });
        let numbers = leaves.iter().flat_map(|leaf| leaf.prims().iter().map(|&p| held[p as usize])).collect();
        self.search = Some((tree, numbers));
        self.always = always;
    }
}
