//! `minkowski`: all sums of a point of one operand and a point of the other.
//!
//! Of unions of convex parts it is the union of the sums of the parts, and the sum of two convex parts is the hull of
//! the sums of their corners. In the plane it is around what edges sweep along each other, and the operands themselves,
//! moved to points of each other.

use glam::{DVec2, DVec3};

use super::flat::{self, Contour, Flat};
use super::hull::hull;
use super::work::Work;
use crate::scene::mesh::Mesh;

/// Most corners whose hull is taken at once, and most parts.
const MAX_PRODUCT: usize = 1 << 20;

/// The sum of two unions of convex parts, by the corners of those, as meshes whose union it is. A part without volume
/// gives none.
///
/// # Errors
/// Too many parts or corners, too much work.
pub(super) fn sum(left: &[Vec<DVec3>], right: &[Vec<DVec3>], work: &mut Work) -> Result<Vec<Mesh>, String> {
    if left.len().saturating_mul(right.len()) > MAX_PRODUCT {
        return Err(format!("{} times {} convex parts are too many", left.len(), right.len()));
    }
    let mut meshes = Vec::new();
    for a in left {
        for b in right {
            if a.len().saturating_mul(b.len()) > MAX_PRODUCT {
                return Err(format!("{} times {} corners are too many", a.len(), b.len()));
            }
            let points: Vec<DVec3> = a.iter().flat_map(|&p| b.iter().map(move |&q| p + q)).collect();
            work.steps(points.len() as u64)?;
            if let Some(mesh) = hull(&points, work)? {
                work.triangles(mesh.triangles.len())?;
                meshes.push(mesh);
            }
        }
    }
    Ok(meshes)
}

/// The sum of two figures.
///
/// # Errors
/// Too much work.
pub(super) fn flat_sum(left: &Flat, right: &Flat, work: &mut Work) -> Result<Flat, String> {
    let edges = |figure: &Flat| figure.points().count();
    if edges(left).saturating_mul(edges(right)) > MAX_PRODUCT {
        return Err(format!("{} times {} edges are too many", edges(left), edges(right)));
    }
    let mut pieces: Vec<Flat> = Vec::new();
    for a in left.contours() {
        for b in right.contours() {
            swept(a, b, &mut pieces);
        }
    }
    for (inner, outer) in [(left, right), (right, left)] {
        for shape in &outer.shapes {
            let Some(&to) = shape.first().and_then(|contour| contour.first()) else { continue };
            let map = glam::DMat3::from_translation(DVec2::from(to));
            pieces.push(inner.clone().mapped(&map));
        }
    }
    flat::union(pieces, work)
}

/// What the edges of one contour sweep along those of the other, counter-clockwise.
fn swept(a: &Contour, b: &Contour, pieces: &mut Vec<Flat>) {
    let edge = |contour: &Contour, i: usize| {
        let from = DVec2::from(contour[i]);
        (from, DVec2::from(contour[(i + 1) % contour.len()]) - from)
    };
    for i in 0..a.len() {
        for k in 0..b.len() {
            let ((p, u), (q, v)) = (edge(a, i), edge(b, k));
            let corner = p + q;
            let turn = u.perp_dot(v);
            if turn != 0.0 {
                let (u, v) = if turn > 0.0 { (u, v) } else { (v, u) };
                pieces.push(Flat::simple([corner, corner + u, corner + u + v, corner + v].into_iter()));
            }
        }
    }
}
