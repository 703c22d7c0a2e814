//! Lowering a tree of solids: numbered leaves with their whole transform, and the operations in postfix order.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DAffine3;

use super::{NodeId, NodeKind, Solid, SolidTree, WIDEST_TUBE};
use crate::scene::description::{MaterialId, Shape};
use crate::scene::mesh::Mesh;

/// Most leaves a tree may expand to.
pub const MAX_LEAVES: usize = 1 << 21;
/// Most operations and leaves a tree may expand to.
pub const MAX_STEPS: usize = 1 << 23;

/// A lowered tree. Leaves are numbered in the order of a depth-first walk over the operands as they are listed; a
/// shared subtree's leaves get numbers for each place it is named at.
#[derive(Clone, Debug, Default)]
pub struct FlatTree {
    /// Name of the tree.
    pub name: String,
    /// Number of the tree.
    pub id: i64,
    /// Leaves by number.
    pub leaves: Vec<FlatLeaf>,
    /// Postfix program over the leaves; it leaves one value.
    pub steps: Vec<Step>,
    /// See [`SolidTree::tolerance`].
    pub tolerance: f64,
    /// Meshes that were seen to be closed, by their address while the tree is lowered.
    closed: HashSet<usize>,
}

/// A leaf.
#[derive(Clone, Debug)]
pub struct FlatLeaf {
    /// Canonical solid.
    pub solid: Solid,
    /// Its space to the tree's; finite and invertible.
    pub to_tree: DAffine3,
    /// Material of the nodes above it, the innermost one.
    pub material: Option<MaterialId>,
}

/// One step of the postfix program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Pushes whether the point is in the leaf.
    Leaf(u32),
    /// Replaces that many values on top, the first operand lowest, by one.
    Op(Operator, u32),
}

/// Operations on any number of operands; without operands they give nothing, but for the complement, which has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// In at least one.
    Union,
    /// In all.
    Intersection,
    /// In the first and in none of the others.
    Difference,
    /// In an odd number.
    Xor,
    /// Not in the only one.
    Complement,
}

/// A node on the way of the walk.
struct Frame {
    node: NodeId,
    next: usize,
    to_tree: DAffine3,
    material: Option<MaterialId>,
}

impl NodeKind {
    fn operands(&self) -> (Option<Operator>, &[NodeId]) {
        match self {
            Self::Solid(_) => (None, &[]),
            Self::Union(list) => (Some(Operator::Union), list),
            Self::Intersection(list) => (Some(Operator::Intersection), list),
            Self::Difference(list) => (Some(Operator::Difference), list),
            Self::Xor(list) => (Some(Operator::Xor), list),
            Self::Complement(only) => (Some(Operator::Complement), std::slice::from_ref(only)),
        }
    }
}

impl FlatTree {
    /// Lowers `tree`.
    ///
    /// # Errors
    /// Nodes that do not exist or contain themselves, more than [`MAX_LEAVES`] leaves or [`MAX_STEPS`] steps,
    /// transforms that are not finite or cannot be inverted, solids whose numbers make no sense.
    pub fn new(tree: &SolidTree) -> Result<Self, String> {
        let mut flat = Self { name: tree.name.clone(), id: tree.id, tolerance: tree.tolerance, ..Self::default() };
        if !(tree.tolerance >= 0.0 && tree.tolerance.is_finite()) {
            return Err(format!("its tolerance must be finite and not negative, found {}", tree.tolerance));
        }
        flat.closed = tree.closed.iter().map(|mesh| Arc::as_ptr(mesh) as usize).collect();
        let mut on_path = vec![false; tree.nodes.len()];
        let mut path: Vec<Frame> = Vec::new();
        flat.enter(tree, tree.root, DAffine3::IDENTITY, None, &mut on_path, &mut path)?;
        while let Some(top) = path.last_mut() {
            let (operator, operands) = tree.nodes[top.node as usize].kind.operands();
            if let Some(&child) = operands.get(top.next) {
                top.next += 1;
                let (to_tree, material) = (top.to_tree, top.material);
                flat.enter(tree, child, to_tree, material, &mut on_path, &mut path)?;
                continue;
            }
            if let Some(operator) = operator {
                flat.push(Step::Op(operator, operands.len() as u32))?;
            }
            on_path[top.node as usize] = false;
            path.pop();
        }
        Ok(flat)
    }

    /// Numbers of leaves are offsets of primitive numbers.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    fn push(&mut self, step: Step) -> Result<(), String> {
        if self.steps.len() >= MAX_STEPS {
            return Err(format!("it expands to more than {MAX_STEPS} operations"));
        }
        self.steps.push(step);
        Ok(())
    }

    fn enter(
        &mut self,
        tree: &SolidTree,
        id: NodeId,
        to_tree: DAffine3,
        material: Option<MaterialId>,
        on_path: &mut [bool],
        path: &mut Vec<Frame>,
    ) -> Result<(), String> {
        let Some(node) = tree.nodes.get(id as usize) else {
            return Err(format!("it names node {id} of {}", tree.nodes.len()));
        };
        if std::mem::replace(&mut on_path[id as usize], true) {
            return Err(format!("node {id} contains itself"));
        }
        let to_tree = if node.transform == DAffine3::IDENTITY { to_tree } else { to_tree * node.transform };
        let material = node.material.or(material);
        if let NodeKind::Solid(solid) = &node.kind {
            let determinant = to_tree.matrix3.determinant();
            let usable = to_tree.is_finite() && determinant != 0.0 && determinant.is_finite();
            if !usable || !to_tree.inverse().is_finite() {
                return Err(format!("the transform of node {id} cannot be inverted or is not finite"));
            }
            check(solid).map_err(|what| format!("node {id}: {what}"))?;
            if let Solid::Mesh(mesh) = solid
                && self.closed.insert(Arc::as_ptr(mesh) as usize)
            {
                closed(mesh).map_err(|what| format!("node {id}: {what}"))?;
            }
            if self.leaves.len() >= MAX_LEAVES {
                return Err(format!("it expands to more than {MAX_LEAVES} solids"));
            }
            self.push(Step::Leaf(self.leaves.len() as u32))?;
            self.leaves.push(FlatLeaf { solid: solid.clone(), to_tree, material });
        }
        path.push(Frame { node: id, next: 0, to_tree, material });
        Ok(())
    }
}

/// What a canonical solid's own numbers must be.
fn check(solid: &Solid) -> Result<(), String> {
    match solid {
        Solid::Shape(Shape::Disc) => Err("a disc has no inside".into()),
        Solid::Shape(Shape::Cone { top, .. }) if !(0.0..=1.0).contains(top) => {
            Err(format!("the top of a cone must be 0 to 1, found {top}"))
        }
        Solid::Torus { minor } if !(*minor > 0.0 && *minor <= 1.0) => {
            Err(format!("the tube of a torus must be above 0 and not wider than its ring, found {minor}"))
        }
        Solid::EllipticTorus { reach, lean }
            if !(*reach > 0.0 && *reach <= WIDEST_TUBE * (1.0 + 1e-9) && lean.abs() < 1.0) =>
        {
            Err("the tube of an elliptic torus must not be a line, nor reach far beyond the middle of its ring".into())
        }
        Solid::Taper { x, y, .. } if !(*x >= 0.0 && *y >= 0.0 && x.is_finite() && y.is_finite()) => {
            Err(format!("the top of a tapered solid must not be negative, found {x} and {y}"))
        }
        Solid::Round { profile } | Solid::Trough { profile } => {
            let [g0, g1, g2] = *profile;
            // Lowest at an end or where the parabola turns.
            let turn = if g2 > 0.0 { (-0.5 * g1 / g2).clamp(0.0, 1.0) } else { 0.0 };
            let lowest = [0.0, turn, 1.0].into_iter().map(|z| g0 + z * (g1 + z * g2)).fold(f64::INFINITY, f64::min);
            let largest = profile.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            match largest.is_finite() && g0.is_finite() && lowest >= -1e-9 * largest {
                true => Ok(()),
                false => Err(format!("the profile {profile:?} is negative between 0 and 1, or not finite")),
            }
        }
        _ => Ok(()),
    }
}

/// Refuses a mesh that has a border: every edge must be gone along as often one way as the other. Corners at one place are
/// one corner, whatever their numbers.
pub(in crate::scene) fn closed(mesh: &Mesh) -> Result<(), String> {
    if mesh.triangles.is_empty() || !mesh.positions.iter().all(|p| p.is_finite()) {
        return Err("a mesh without triangles or with corners that are not finite has no inside".into());
    }
    let corner = Mesh::first_at_place(&mesh.positions);
    let mut balance: HashMap<(u32, u32), i64> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| corner[i as usize]);
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let open = balance.iter().filter(|((a, b), way)| a != b && **way != 0).map(|(edge, _)| *edge).min();
    match open {
        None => Ok(()),
        Some((a, b)) => {
            let [a, b] = [a, b].map(|i| mesh.positions[i as usize]);
            Err(format!("the mesh is not closed: the edge from {a} to {b} has triangles on one side only"))
        }
    }
}

/// Lowers a tree behind an [`Arc`], for who shares it.
///
/// # Errors
/// Those of [`FlatTree::new`].
pub fn flatten(tree: &SolidTree) -> Result<Arc<FlatTree>, String> {
    FlatTree::new(tree).map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::super::{SolidNode, ball};
    use glam::DVec3;

    use super::*;

    fn unit_ball(tree: &mut SolidTree) -> NodeId {
        tree.solid(ball(DVec3::ZERO, 1.0).unwrap())
    }

    #[test]
    fn operands_come_before_their_operation_and_shared_subtrees_twice() {
        let mut tree = SolidTree::new("t");
        let ball = unit_ball(&mut tree);
        let shift = DAffine3::from_translation(DVec3::X);
        let moved = |kind| SolidNode { transform: shift, material: Some(3), kind };
        let twice = tree.add(moved(NodeKind::Union(vec![ball])));
        let all = tree.op(NodeKind::Difference(vec![ball, twice]));
        tree.op(NodeKind::Complement(all));
        let flat = FlatTree::new(&tree).unwrap();
        use Operator::{Complement, Difference, Union};
        let want = [Step::Leaf(0), Step::Leaf(1), Step::Op(Union, 1), Step::Op(Difference, 2), Step::Op(Complement, 1)];
        assert_eq!(flat.steps, want);
        assert_eq!((flat.leaves[0].material, flat.leaves[1].material), (None, Some(3)));
        assert_eq!(flat.leaves[1].to_tree.translation, DVec3::X);
    }

    #[test]
    fn hostile_trees_are_errors_or_lists() {
        // Deeper than any call stack.
        let mut deep = SolidTree::new("deep");
        let mut at = unit_ball(&mut deep);
        for _ in 0..100_000 {
            at = deep.op(NodeKind::Complement(at));
        }
        assert_eq!(FlatTree::new(&deep).unwrap().steps.len(), 100_001);
        // A cycle, a node that is not there, a doubling that never ends, a flat transform, NaN.
        let mut cycle = SolidTree::new("cycle");
        cycle.op(NodeKind::Complement(1));
        cycle.op(NodeKind::Complement(0));
        assert!(FlatTree::new(&cycle).unwrap_err().contains("itself"));
        cycle.root = 7;
        assert!(FlatTree::new(&cycle).unwrap_err().contains("node 7"));
        let mut doubling = SolidTree::new("doubling");
        let mut at = unit_ball(&mut doubling);
        for _ in 0..60 {
            at = doubling.op(NodeKind::Union(vec![at, at]));
        }
        assert!(FlatTree::new(&doubling).unwrap_err().contains("more than"));
        for scale in [DVec3::new(1.0, 1.0, 0.0), DVec3::splat(f64::NAN), DVec3::splat(1e300)] {
            let mut flat = SolidTree::new("flat");
            let ball = unit_ball(&mut flat);
            flat.nodes[ball as usize].transform = DAffine3::from_scale(scale);
            assert!(FlatTree::new(&flat).unwrap_err().contains("inverted"), "{scale}");
        }
        assert!(FlatTree::new(&SolidTree::new("empty")).is_err());
    }

    #[test]
    fn meshes_must_be_closed() {
        let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut mesh = Mesh { positions: vec![o, x, y, z], ..Mesh::default() };
        mesh.triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]];
        assert!(closed(&mesh).unwrap_err().contains("not closed"));
        mesh.triangles.push([1, 2, 3]);
        assert!(closed(&mesh).is_ok());
        mesh.triangles[3] = [1, 3, 2];
        assert!(closed(&mesh).is_err(), "one triangle the wrong way round");
        assert!(closed(&Mesh::default()).is_err());
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused() {
        let bad = [
            Solid::Shape(Shape::Disc),
            Solid::Shape(Shape::cone(1.5)),
            Solid::Torus { minor: 0.0 },
            Solid::Torus { minor: f64::NAN },
            Solid::EllipticTorus { reach: 1.5, lean: 0.0 },
            Solid::EllipticTorus { reach: 0.5, lean: -1.0 },
            Solid::EllipticTorus { reach: 0.5, lean: f64::NAN },
            Solid::Taper { x: -1.0, y: 1.0, is_mirrored: false },
            Solid::Round { profile: [1.0, -3.0, 1.0] },
            Solid::Trough { profile: [f64::NAN, 0.0, 0.0] },
        ];
        for solid in bad {
            assert!(check(&solid).is_err(), "{solid:?}");
        }
        assert!(check(&Solid::Round { profile: [1.0, -1.0, 0.0] }).is_ok());
    }
}
