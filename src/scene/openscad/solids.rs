//! The solids of a file as they are put together: a tree, and what is known of its leaves.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::extrude::Prisms;
use super::facets;
use crate::scene::description::{MaterialId, Shape};
use crate::scene::mesh::Mesh;
use crate::scene::solids::{NodeId, NodeKind, Solid, SolidNode, SolidTree};

/// Most corners and boxes that are compared.
const MAX_PAIRS: usize = 1 << 24;

/// Why something cannot be done: byte of what is in the way, and what that is.
pub(super) type Trouble = (u32, String);

/// A tree on its way. Every node has one parent at most.
pub(super) struct Solids {
    /// The tree.
    pub tree: SolidTree,
    /// Byte of the file where each node comes from.
    places: Vec<u32>,
    /// How many nodes and corners each node and those below it have.
    weights: Vec<u64>,
    /// Convex parts of leaves that are not convex.
    prisms: HashMap<NodeId, Prisms>,
}

/// The smallest box, by its lower and upper corner.
pub(super) type Bounds = (DVec3, DVec3);

impl Solids {
    /// Without nodes.
    pub fn new(tree: SolidTree) -> Self {
        Self { tree, places: Vec::new(), weights: Vec::new(), prisms: HashMap::new() }
    }

    fn add(&mut self, at: u32, transform: DAffine3, material: Option<MaterialId>, kind: NodeKind) -> NodeId {
        let weight = match &kind {
            NodeKind::Solid(Solid::Mesh(mesh)) => mesh.positions.len() as u64,
            NodeKind::Union(list) | NodeKind::Difference(list) | NodeKind::Intersection(list) => {
                list.iter().map(|&child| self.weights[child as usize]).sum()
            }
            _ => 8,
        };
        self.places.push(at);
        self.weights.push(weight + 1);
        self.tree.add(SolidNode { transform, material, kind })
    }

    /// Adds a box.
    pub fn cuboid(&mut self, at: u32, (lo, hi): Bounds, material: Option<MaterialId>) -> NodeId {
        let matrix = glam::DMat3::from_diagonal((hi - lo) * 0.5);
        let transform = DAffine3 { matrix3: matrix, translation: (lo + hi) * 0.5 };
        self.add(at, transform, material, NodeKind::Solid(Solid::Shape(Shape::Cuboid)))
    }

    /// Adds a closed mesh.
    pub fn mesh(&mut self, at: u32, mesh: Arc<Mesh>, prisms: Option<Prisms>, material: Option<MaterialId>) -> NodeId {
        let node = self.add(at, DAffine3::IDENTITY, material, NodeKind::Solid(Solid::Mesh(mesh)));
        self.prisms.extend(prisms.map(|prisms| (node, prisms)));
        node
    }

    /// Adds an operation; a union of one is that one.
    pub fn op(&mut self, at: u32, kind: NodeKind) -> NodeId {
        match kind {
            NodeKind::Union(list) | NodeKind::Difference(list) | NodeKind::Intersection(list) if list.len() == 1 => {
                list[0]
            }
            kind => self.add(at, DAffine3::IDENTITY, None, kind),
        }
    }

    /// Nodes and corners of `node`: what a walk over it costs.
    pub fn weight(&self, node: NodeId) -> u64 {
        self.weights[node as usize]
    }

    /// Moves `node`.
    pub fn place(&mut self, node: NodeId, map: &DAffine3) {
        let transform = &mut self.tree.nodes[node as usize].transform;
        *transform = *map * *transform;
    }

    /// The leaves of `node` and where they are, if it is nothing but a union.
    fn leaves(&self, node: NodeId, wanted: &str) -> Result<Vec<(NodeId, DAffine3)>, Trouble> {
        let mut found = Vec::new();
        let mut stack = vec![(node, DAffine3::IDENTITY)];
        while let Some((id, above)) = stack.pop() {
            let node = &self.tree.nodes[id as usize];
            let map = above * node.transform;
            match &node.kind {
                NodeKind::Solid(_) => found.push((id, map)),
                NodeKind::Union(list) => stack.extend(list.iter().rev().map(|&child| (child, map))),
                _ => {
                    let what = format!("what is cut here has {wanted} that are not known");
                    return Err((self.places[id as usize], what));
                }
            }
        }
        Ok(found)
    }

    /// Corners of a leaf in its own space.
    fn corners(&self, leaf: NodeId) -> Vec<DVec3> {
        match &self.tree.nodes[leaf as usize].kind {
            NodeKind::Solid(Solid::Mesh(mesh)) => mesh.positions.clone(),
            _ => {
                let sign = |i: u32, axis: u32| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
                (0..8).map(|i| DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
            }
        }
    }

    /// The corners of `node`.
    ///
    /// # Errors
    /// Where something is cut out of it, which may have others.
    pub fn points(&self, node: NodeId) -> Result<Vec<DVec3>, Trouble> {
        let mut points = Vec::new();
        for (leaf, map) in self.leaves(node, "corners")? {
            points.extend(self.corners(leaf).into_iter().map(|p| map.transform_point3(p)));
        }
        Ok(points)
    }

    /// The corners of convex parts whose union `node` is.
    ///
    /// # Errors
    /// Where something is cut out of it, or a mesh is not convex.
    pub fn parts(&self, node: NodeId) -> Result<Vec<Vec<DVec3>>, Trouble> {
        let mut parts = Vec::new();
        for (leaf, map) in self.leaves(node, "convex parts")? {
            let points: Vec<DVec3> = self.corners(leaf).into_iter().map(|p| map.transform_point3(p)).collect();
            if let Some(Prisms { count, cover }) = self.prisms.get(&leaf) {
                let corner = |i: u32| points[i as usize];
                parts.extend(
                    cover.iter().map(|triangle| {
                        triangle.iter().flat_map(|&i| [corner(i), corner(i + count)]).collect::<Vec<_>>()
                    }),
                );
                continue;
            }
            if let NodeKind::Solid(Solid::Mesh(mesh)) = &self.tree.nodes[leaf as usize].kind
                && !facets::is_convex(mesh)
            {
                return Err((
                    self.places[leaf as usize],
                    "this is not convex, and its convex parts are not known".into(),
                ));
            }
            parts.push(points);
        }
        Ok(parts)
    }

    /// The smallest box around `node`.
    ///
    /// # Errors
    /// Where something is cut out of it that may make it smaller.
    pub fn bounds(&self, node: NodeId) -> Result<Option<Bounds>, Trouble> {
        let (mut all, mut stack) = (None, vec![(node, DAffine3::IDENTITY)]);
        while let Some((id, above)) = stack.pop() {
            let node = &self.tree.nodes[id as usize];
            let map = above * node.transform;
            match &node.kind {
                NodeKind::Union(list) => stack.extend(list.iter().map(|&child| (child, map))),
                NodeKind::Difference(list) if self.keeps_its_box(list, &map) => stack.push((list[0], map)),
                NodeKind::Solid(_) => {
                    for p in self.corners(id) {
                        let p = map.transform_point3(p);
                        all = Some(all.map_or((p, p), |(lo, hi): Bounds| (lo.min(p), hi.max(p))));
                    }
                }
                _ => return Err((self.places[id as usize], "what is cut here has a size that is not known".into())),
            }
        }
        Ok(all)
    }

    /// Whether a difference is as large as its first operand: in each direction a farthest corner of that is out of the
    /// boxes of all others.
    fn keeps_its_box(&self, operands: &[NodeId], map: &DAffine3) -> bool {
        let placed = |node: NodeId| {
            let points = self.points(node).ok()?;
            Some(points.into_iter().map(|p| map.transform_point3(p)).collect::<Vec<_>>())
        };
        let boxes: Option<Vec<Option<Bounds>>> =
            operands[1..].iter().map(|&node| Some(around(&placed(node)?))).collect();
        let (Some(first), Some(boxes)) = (placed(operands[0]), boxes) else { return false };
        let Some((lo, hi)) = around(&first) else { return false };
        if first.len().saturating_mul(boxes.len()) > MAX_PAIRS {
            return false;
        }
        let is_out = |p: &DVec3| boxes.iter().flatten().all(|(lo, hi)| p.cmplt(*lo).any() || p.cmpgt(*hi).any());
        (0..3).all(|axis| [lo, hi].iter().all(|end| first.iter().any(|p| p[axis] == end[axis] && is_out(p))))
    }
}

fn around(points: &[DVec3]) -> Option<Bounds> {
    points.iter().map(|&p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
