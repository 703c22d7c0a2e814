//! Trees of solids in the world: lowered to what the floor below compiles, and the normals of their leaves.

use glam::DVec3;

use crate::bvh::Preset;
use crate::csg::{self, Built, Form, Input, LeafInput, Op, Token, Triangles};
use crate::lanes::{Lanes, Lanes3, Real};
use crate::scene::description::Shape;
use crate::scene::mesh::Mesh;
use crate::scene::solids::Solid;
use crate::scene::solids::flat::{FlatTree, Operator, Step};
use crate::shape::{self, Cone, Cuboid, Cylinder, Disc, HalfSpace, Solid as _, Sphere};

/// Compiles a tree whose space `to_object` takes to the object's.
pub fn compile<S: Real>(tree: &FlatTree, to_object: &glam::DAffine3, preset: Preset) -> Built<S> {
    let planes: Vec<Vec<(DVec3, f64)>> = tree.leaves.iter().map(|leaf| planes_of(&leaf.solid)).collect();
    let leaves: Vec<LeafInput> = tree
        .leaves
        .iter()
        .zip(&planes)
        .map(|(leaf, planes)| {
            let (lo, hi) = leaf.solid.bounds();
            LeafInput { form: form(&leaf.solid, planes), lo, hi, to_tree: *to_object * leaf.to_tree }
        })
        .collect();
    let program: Vec<Token> = tree.steps.iter().map(token).collect();
    // The tolerance is a length of the tree's space.
    let growth = to_object.matrix3.determinant().abs().cbrt();
    csg::build(&Input { leaves: &leaves, program: &program, tolerance: tree.tolerance * growth }, preset)
}

fn planes_of(solid: &Solid) -> Vec<(DVec3, f64)> {
    match solid {
        Solid::Polyhedron(polyhedron) => polyhedron.planes().iter().map(|p| (p.normal, p.offset)).collect(),
        _ => Vec::new(),
    }
}

fn form<'a>(solid: &'a Solid, planes: &'a [(DVec3, f64)]) -> Form<'a> {
    match *solid {
        Solid::Mesh(ref mesh) => Form::Mesh(&**mesh),
        Solid::Shape(Shape::HalfSpace) => Form::HalfSpace,
        Solid::Shape(Shape::Cuboid) => Form::Cuboid,
        Solid::Shape(Shape::Cylinder) => Form::Cylinder,
        Solid::Shape(Shape::Cone { top, .. }) => Form::Cone(top),
        // Discs are refused where trees are lowered.
        Solid::Shape(Shape::Sphere | Shape::Disc) => Form::Sphere,
        Solid::Polyhedron(_) => Form::Planes(planes),
        Solid::Torus { minor } => Form::Torus(minor),
        Solid::EllipticTorus { reach, lean } => Form::EllipticTorus([reach, lean]),
        Solid::Taper { x, y, .. } => Form::Taper([x, y]),
        Solid::Round { profile } => Form::Round(profile),
        Solid::Trough { profile } => Form::Trough(profile),
    }
}

impl Triangles for Mesh {
    fn count(&self) -> usize {
        self.triangles.len()
    }

    fn corners(&self, i: usize) -> [DVec3; 3] {
        Self::corners(self, i)
    }
}

fn token(step: &Step) -> Token {
    match *step {
        Step::Leaf(leaf) => Token::Leaf(leaf),
        Step::Op(operator, count) => Token::Op(
            match operator {
                Operator::Union => Op::Union,
                Operator::Intersection => Op::Intersection,
                Operator::Difference => Op::Difference,
                Operator::Xor => Op::Xor,
                Operator::Complement => Op::Complement,
            },
            count,
        ),
    }
}

/// Outward normal (local, not unit) of a shape at a point of one of its faces.
pub fn shape_normal(shape: &Shape, point: DVec3, face: u32) -> DVec3 {
    match *shape {
        Shape::Sphere => Sphere::normal(point, face, 0.0),
        Shape::HalfSpace => HalfSpace::normal(point, face, 0.0),
        Shape::Disc => Disc::normal(point, face, 0.0),
        Shape::Cuboid => Cuboid::normal(point, face, 0.0),
        Shape::Cylinder => Cylinder::normal(point, face, 0.0),
        Shape::Cone { top, .. } => Cone::normal(point, face, top),
    }
}

/// The same of a solid.
pub fn solid_normal(solid: &Solid, point: DVec3, face: u32) -> DVec3 {
    match solid {
        Solid::Shape(shape) => shape_normal(shape, point, face),
        Solid::Polyhedron(polyhedron) => {
            polyhedron.planes().get(face as usize).map_or(DVec3::ZERO, |plane| plane.normal)
        }
        Solid::Torus { .. } => DVec3::from(shape::torus_normal(point.to_array())),
        Solid::EllipticTorus { reach, lean } => shape::elliptic_torus_normal(point, [*reach, *lean]),
        Solid::Taper { x, y, .. } => shape::taper_normal(point, face, [*x, *y]),
        Solid::Round { profile } => shape::quadric::round_normal(point, face, *profile),
        Solid::Trough { profile } => shape::quadric::trough_normal(point, face, *profile),
        Solid::Mesh(mesh) if (face as usize) < mesh.triangles.len() => {
            let [a, b, c] = mesh.corners(face as usize);
            (b - a).cross(c - a)
        }
        Solid::Mesh(_) => DVec3::ZERO,
    }
}

/// Outward normals, not unit, at points of face `face` of those solids whose gradient is not affine there; `None` of others,
/// and of those that are rare.
#[inline]
pub fn curved_normal<V: Lanes>(solid: &Solid, point: Lanes3<V>, face: u32) -> Option<Lanes3<V>> {
    match solid {
        Solid::Torus { .. } => Some(shape::torus_normal(point)),
        Solid::Taper { x, y, .. } if face == 0 => Some(shape::taper_side_normal(point, [*x, *y])),
        _ => None,
    }
}
