//! Solids made of solids: constructive solid geometry as a description, f64, engine-free.
//!
//! A [`SolidTree`] is an arena of nodes: each has a transform, perhaps a material, and is a solid or an operation on
//! other nodes. A node may be named by several others, so subtrees are shared without being copied; the transforms on
//! the way add up. Nothing in here recurses over what a person wrote: trees may be deeper than any call stack.
//!
//! Operations are regularised (Requicha, Voelcker, "Constructive Solid Geometry", 1977): the closure of the
//! interior, so faces that touch leave no skin. [`flat`] lowers a tree to numbered leaves and a postfix program, from
//! which the engines and (independently) the oracle start.

mod canonical;
pub mod flat;
mod place;
mod polyhedron;

use std::sync::Arc;

use glam::DAffine3;

use super::description::{MaterialId, Shape};
use super::mesh::Mesh;
pub use place::{
    Placed, ball, cone, cylinder, ellipsoid, elliptic_hyperboloid, elliptic_paraboloid, elliptic_torus, half_space,
    hyperbolic_cylinder, hyperboloid, parabolic_cylinder, torus, truncated_cone,
};
pub use polyhedron::{Plane, Polyhedron};

/// Largest reach of a [`Solid::EllipticTorus`]: what neither semi-axis by itself reaches beyond the ring's axis does not,
/// leaning, reach farther than this.
pub const WIDEST_TUBE: f64 = std::f64::consts::SQRT_2;

/// Index into [`SolidTree::nodes`].
pub type NodeId = u32;

/// One solid made of others: one object of the scene, for BRL-CAD one region.
#[derive(Clone, Debug, Default)]
pub struct SolidTree {
    /// Name for listings (`r12.body`); may be empty.
    pub name: String,
    /// Number for listings (BRL-CAD's region id); 0 if there is none.
    pub id: i64,
    /// The nodes; their order means nothing.
    pub nodes: Vec<SolidNode>,
    /// The node that is the whole.
    pub root: NodeId,
    /// Surfaces closer than this along a ray count as one (units of the tree's space); where it is smaller than the
    /// rounding of the engine's arithmetic, that rounding counts.
    pub tolerance: f64,
    /// Meshes of the nodes that were seen to be closed: [`flat`] looks at the others only, as a look takes long.
    pub closed: Vec<Arc<Mesh>>,
}

/// A solid or an operation, placed in its parent's space.
#[derive(Clone, Debug)]
pub struct SolidNode {
    /// Node space to the parent's space (for the root: to the tree's).
    pub transform: DAffine3,
    /// Material of the surfaces below; `None` inherits from the parent, at the root from the item.
    pub material: Option<MaterialId>,
    /// What it is.
    pub kind: NodeKind,
}

/// What a [`SolidNode`] is.
#[derive(Clone, Debug)]
pub enum NodeKind {
    /// A leaf.
    Solid(Solid),
    /// In at least one operand; nothing without operands.
    Union(Vec<NodeId>),
    /// In all operands; nothing without operands.
    Intersection(Vec<NodeId>),
    /// In the first operand and in none of the others; nothing without operands.
    Difference(Vec<NodeId>),
    /// In an odd number of operands.
    Xor(Vec<NodeId>),
    /// Outside of the operand.
    Complement(NodeId),
}

/// A solid in its canonical space; size and place come from transforms. The functions of this module ([`torus`],
/// [`truncated_cone`], ...) take what databases store and give a [`Placed`] canonical solid.
#[derive(Clone, Debug)]
pub enum Solid {
    /// A canonical shape with an inside: all but [`Shape::Disc`].
    Shape(Shape),
    /// Where all planes' sides meet.
    Polyhedron(Arc<Polyhedron>),
    /// The torus about the z axis with the circle x^2 + y^2 = 1, z = 0 in the middle of its tube.
    Torus {
        /// Radius of the tube, above 0 and at most 1.
        minor: f64,
    },
    /// An ellipse swept round the z axis, its middle on the circle x^2 + y^2 = 1, z = 0: with u = sqrt(x^2 + y^2) - 1 it is
    /// u^2 - 2 `lean` u z + z^2 <= (1 - `lean`^2) `reach`^2. What is swept over twice, about the axis, is outside.
    EllipticTorus {
        /// How far the ellipse reaches, along z as along u: above 0 and at most [`WIDEST_TUBE`].
        reach: f64,
        /// How it leans outwards with z, above -1 and below 1; 0 is a torus.
        lean: f64,
    },
    /// A truncated cone from the unit circle at z = 0 to an ellipse at z = 1, both round the z axis; the ellipse's
    /// semi-axes change linearly with z. For x = y it is a [`Shape::Cone`].
    Taper {
        /// Semi-axis along x at z = 1, >= 0.
        x: f64,
        /// Semi-axis along y at z = 1, >= 0.
        y: f64,
        /// As of [`Shape::Cone`].
        is_mirrored: bool,
    },
    /// x^2 + y^2 <= g(z), 0 <= z <= 1 with g(z) = g0 + g1 z + g2 z^2, which must not be negative there: paraboloids
    /// and hyperboloids with flat ends.
    Round {
        /// g0, g1, g2.
        profile: [f64; 3],
    },
    /// y^2 <= g(z), |x| <= 1, 0 <= z <= 1: parabolic and hyperbolic cylinders with flat ends.
    Trough {
        /// g0, g1, g2.
        profile: [f64; 3],
    },
    /// The inside of a closed triangle mesh whose triangles wind counter-clockwise seen from outside.
    Mesh(Arc<Mesh>),
}

impl SolidTree {
    /// A tree without nodes, to be filled by [`SolidTree::add`].
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Adds a node and makes it the root, which the last one added usually is.
    pub fn add(&mut self, node: SolidNode) -> NodeId {
        self.nodes.push(node);
        self.root = self.nodes.len() as NodeId - 1;
        self.root
    }

    /// Adds a leaf.
    pub fn solid(&mut self, placed: Placed) -> NodeId {
        self.add(SolidNode { transform: placed.transform, material: None, kind: NodeKind::Solid(placed.solid) })
    }

    /// Adds an operation in its parent's space.
    pub fn op(&mut self, kind: NodeKind) -> NodeId {
        self.add(SolidNode { transform: DAffine3::IDENTITY, material: None, kind })
    }

    /// Adds the hull of two balls (BRL-CAD's particle): `v` and `v + h` are their centres.
    ///
    /// # Errors
    /// Radii that are not above zero.
    pub fn particle(&mut self, v: glam::DVec3, h: glam::DVec3, r_v: f64, r_h: f64) -> Result<NodeId, String> {
        let (first, second) = (ball(v, r_v)?, ball(v + h, r_h)?);
        let length = h.length();
        // One ball inside the other: the larger is all.
        if length <= (r_v - r_h).abs() {
            return Ok(self.solid(if r_v >= r_h { first } else { second }));
        }
        // The cone touches the balls at circles a little off their equators.
        let lean = (r_v - r_h) / length;
        let fall = (1.0 - lean * lean).sqrt();
        let axis = h / length;
        let (from, to) = (v + axis * (r_v * lean), v + h + axis * (r_h * lean));
        let side = cone(from, to, r_v * fall, r_h * fall)?;
        let parts = [first, second, side].map(|placed| self.solid(placed));
        Ok(self.op(NodeKind::Union(parts.to_vec())))
    }
}
