//! `offset`: a figure grown or shrunk by a distance.
//!
//! Every edge moves along its normal; between moved edges comes an arc, a point or a cut corner, at notches the corner
//! itself. Of what that goes around the figure is where it does so counter-clockwise (Chen, McMains, "Polygon
//! offsetting by computing winding numbers", ASME 2005). Where pieces of arcs begin is OpenSCAD's choice: at the normal
//! of the edge before.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::flat::{Contour, Flat};
use super::fragments::direction;
use super::work::Work;

/// Most corners of an outline.
const MAX_POINTS: usize = 1 << 21;

/// Corners that are nearer than this are one, as for OpenSCAD; and nearer than this, relative to the outline, so that
/// small ones stay.
const NEAR: f64 = 1.5 / 65536.0;
const NEAR_OF_SIZE: f64 = 1e-6;

/// How corners are filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Corner {
    /// By arcs, of that many pieces in a whole circle: see [`arcs`].
    Round(f64),
    /// By the point where the edges meet.
    Sharp,
    /// By a straight cut at the offset's distance from the corner.
    Cut,
}

/// Pieces of a whole circle in offsets by `distance`, where a circle of that radius has `pieces`: about as many. The
/// way from one number to the other, over how far such pieces are from the circle, is OpenSCAD's, as its roundings
/// decide how arcs of half a piece end.
pub(super) fn arcs(distance: f64, pieces: usize) -> f64 {
    let off = distance.abs() * (1.0 - direction(180.0 / pieces as f64).x);
    let share = off.min(distance.abs() * 0.25) / distance.abs();
    PI / (1.0 - share).acos()
}

/// The figure grown by `distance`, or shrunk if that is negative.
///
/// # Errors
/// Too much work.
pub(super) fn offset(figure: &Flat, distance: f64, corner: Corner, work: &mut Work) -> Result<Flat, String> {
    let contours = figure.contours().map(|contour| moved(contour, distance, corner, work));
    let contours: Vec<Contour> = contours.collect::<Result<_, _>>()?;
    Flat::positive(&contours, work)
}

fn moved(contour: &Contour, distance: f64, corner: Corner, work: &mut Work) -> Result<Contour, String> {
    let mut points: Vec<DVec2> = contour.iter().map(|&p| DVec2::from(p)).collect();
    // What rounding doubled has no edge between that says where it faces.
    let size = points.iter().map(|&p| p.distance_squared(points[0])).fold(0.0, f64::max).sqrt();
    let near = NEAR.min(size * NEAR_OF_SIZE);
    points.dedup_by(|a, b| a.distance(*b) <= near);
    while points.len() > 1 && points[0].distance(points[points.len() - 1]) <= near {
        points.pop();
    }
    if points.len() < 3 {
        return Ok(Vec::new());
    }
    let count = points.len();
    let normal = |i: usize| (points[(i + 1) % count] - points[i]).normalize_or_zero().perp() * -1.0;
    let mut out = Vec::with_capacity(2 * count);
    for (i, &p) in points.iter().enumerate() {
        let (before, after) = (normal((i + count - 1) % count), normal(i));
        let first = out.len();
        join(p, before, after, distance, corner, &mut out);
        work.steps((out.len() - first) as u64)?;
        if out.len() > MAX_POINTS {
            return Err(format!("its outline would have more than {MAX_POINTS} corners"));
        }
    }
    Ok(out.into_iter().map(|p: DVec2| p.to_array()).collect())
}

/// What comes between two moved edges with these normals, which meet at `p`.
fn join(p: DVec2, before: DVec2, after: DVec2, distance: f64, corner: Corner, out: &mut Vec<DVec2>) {
    let (sin, cos) = (before.perp_dot(after), before.dot(after));
    let (from, to) = (p + before * distance, p + after * distance);
    if sin * distance < 0.0 {
        out.extend([from, p, to]);
        return;
    }
    // As good as straight on.
    if sin.abs() < 1e-9 && cos > 0.0 {
        out.push(from);
        return;
    }
    let turn = sin.atan2(cos);
    match corner {
        // Backwards: there is no such point.
        Corner::Sharp if 1.0 + cos > 2e-12 => out.push(p + (before + after) * (distance / (1.0 + cos))),
        Corner::Sharp | Corner::Cut => {
            let reach = (turn * 0.25).tan() * distance;
            out.extend([from + before.perp() * reach, to - after.perp() * reach]);
        }
        Corner::Round(pieces) => {
            let count = (pieces / TAU * turn.abs() + 0.5).floor().max(1.0) as usize;
            for i in 0..count {
                let by = DVec2::from_angle(TAU / pieces * i as f64 * turn.signum());
                out.push(p + before.rotate(by) * distance);
            }
            out.push(to);
        }
    }
}
