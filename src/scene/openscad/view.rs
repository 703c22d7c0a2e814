//! From where OpenSCAD looks: z up, from the front, a little right and above.

use glam::DVec3;

use super::fragments::direction;
use super::solids::Bounds;
use crate::math::transformed_bounds;
use crate::scene::description::{CameraDescription, Projection};
use crate::scene::solids::Solid;
use crate::scene::solids::flat::{FlatTree, Operator, Step};

/// Full vertical angle of OpenSCAD's view, degrees.
const ANGLE: f64 = 22.5;
/// How its view is turned about z and how high it looks from, degrees.
const TURN: f64 = 25.0;
const HEIGHT: f64 = 35.0;
/// Space left around the model.
const MARGIN: f64 = 1.05;

/// A box around a tree; none if nothing is in it.
pub(super) fn bounds(tree: &FlatTree) -> Option<Bounds> {
    let mut stack: Vec<Option<Bounds>> = Vec::new();
    for step in &tree.steps {
        let top = match *step {
            Step::Leaf(leaf) => {
                let leaf = &tree.leaves[leaf as usize];
                match &leaf.solid {
                    Solid::Mesh(mesh) => {
                        let points = mesh.positions.iter().map(|&p| leaf.to_tree.transform_point3(p));
                        points.map(|p| (p, p)).reduce(joined)
                    }
                    solid => {
                        let (lo, hi) = solid.bounds();
                        Some(transformed_bounds(&leaf.to_tree, lo, hi))
                    }
                }
            }
            Step::Op(operator, count) => {
                let operands = stack.split_off(stack.len().saturating_sub(count as usize));
                match operator {
                    Operator::Difference => operands.into_iter().next().flatten(),
                    Operator::Intersection => operands.into_iter().reduce(|a, b| common(a?, b?)).flatten(),
                    _ => operands.into_iter().flatten().reduce(joined),
                }
            }
        };
        stack.push(top);
    }
    stack.pop().flatten()
}

fn joined(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

fn common(a: Bounds, b: Bounds) -> Option<Bounds> {
    let (lo, hi) = (a.0.max(b.0), a.1.min(b.1));
    lo.cmple(hi).all().then_some((lo, hi))
}

/// A camera that sees the box in a picture that is at least as wide as high.
pub(super) fn camera(bounds: Option<Bounds>) -> CameraDescription {
    let (lo, hi) = bounds.filter(|(lo, hi)| lo.is_finite() && hi.is_finite()).unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    let (turn, height) = (direction(TURN), direction(HEIGHT));
    let towards = DVec3::new(turn.y * height.x, -turn.x * height.x, height.y);
    let right = DVec3::new(turn.x, turn.y, 0.0);
    let up = towards.cross(right);
    let (centre, half) = ((lo + hi) * 0.5, (hi - lo) * 0.5);
    let reach = (ANGLE * 0.5).to_radians().tan();
    let distance = (0..8).map(|i: u32| {
        let sign = |axis: u32| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
        let p = half * DVec3::new(sign(0), sign(1), sign(2));
        p.dot(towards) + p.dot(right).abs().max(p.dot(up).abs()) / reach
    });
    let distance = distance.fold(0.0, f64::max) * MARGIN;
    let distance = if distance > 0.0 { distance } else { 1.0 };
    CameraDescription {
        name: "default".into(),
        eye: centre + towards * distance,
        look_at: centre,
        up: DVec3::Z,
        projection: Projection::Perspective { theta: ANGLE.to_radians() },
    }
}
