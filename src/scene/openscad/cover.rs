//! Polygons with holes as triangles that cover them.
//!
//! Holes are joined to the outer contour by bridges, from the right to the left (D. Eberly, "Triangulation by Ear
//! Clipping", 2002), and the one contour that comes of it is cut into ears. Whatever the numbers are, every edge of a
//! contour is in one triangle, and every other edge in two that go along it both ways: what is swept stays closed.

use glam::DVec2;

use super::flat::{Contour, Point};
use super::work::Work;
use crate::scene::polygon::ears;

/// Triangles of a polygon by the numbers of its points, counted through its contours: the outer one, counter-clockwise,
/// then those of holes, clockwise.
///
/// # Errors
/// Too much work.
pub(super) fn covered(shape: &[Contour], work: &mut Work) -> Result<Vec<[u32; 3]>, String> {
    if let [only] = shape
        && is_convex(only)
    {
        return Ok((1..only.len() as u32 - 1).map(|i| [0, i, i + 1]).collect());
    }
    let points: Vec<DVec2> = shape.iter().flatten().map(|&p| DVec2::from(p)).collect();
    let at = |i: u32| points[i as usize];
    let mut first = 0;
    let mut contours = shape.iter().map(|contour| {
        let numbers = first..first + contour.len() as u32;
        first = numbers.end;
        numbers.collect::<Vec<u32>>()
    });
    let mut ring = contours.next().unwrap_or_default();
    // Holes begin at their rightmost corner.
    let mut holes: Vec<Vec<u32>> = contours.filter(|hole| !hole.is_empty()).collect();
    for hole in &mut holes {
        let rightmost = (0..hole.len()).max_by(|&a, &b| at(hole[a]).x.total_cmp(&at(hole[b]).x));
        hole.rotate_left(rightmost.unwrap_or(0));
    }
    holes.sort_by(|a, b| at(b[0]).x.total_cmp(&at(a[0]).x));
    for hole in holes {
        work.steps(2 * ring.len() as u64)?;
        let bridge = bridge(&points, &ring, at(hole[0]));
        let back = [hole[0], ring[bridge]];
        let after = ring.split_off(bridge + 1);
        ring.extend(hole.into_iter().chain(back).chain(after));
    }
    let corners: Vec<DVec2> = ring.iter().map(|&i| at(i)).collect();
    let corner = |i: usize| corners[i % corners.len()];
    let is_notch = |&i: &usize| (corner(i + 1) - corner(i)).perp_dot(corner(i + 2) - corner(i + 1)) <= 0.0;
    let notches = (0..corners.len()).filter(is_notch).count();
    // To see that a notch is far from a corner takes less than a step.
    work.steps((corners.len() * notches / 8) as u64)?;
    Ok(ears(&corners).into_iter().map(|triangle| triangle.map(|i| ring[i as usize])).collect())
}

/// Place in `ring` of a corner that is seen from `from`, which is inside of it, looking to the right.
fn bridge(points: &[DVec2], ring: &[u32], from: DVec2) -> usize {
    let corner = |i: usize| points[ring[i % ring.len()] as usize];
    // The nearest edge that goes up on the right.
    let mut nearest: Option<(f64, usize)> = None;
    for i in 0..ring.len() {
        let (a, b) = (corner(i), corner(i + 1));
        if a.y <= from.y && from.y <= b.y && a.y < b.y {
            let x = a.x + (b.x - a.x) * ((from.y - a.y) / (b.y - a.y));
            if x >= from.x && nearest.is_none_or(|(best, _)| x < best) {
                nearest = Some((x, i));
            }
        }
    }
    let Some((x, edge)) = nearest else { return 0 };
    let end = if corner(edge).x > corner(edge + 1).x { edge } else { (edge + 1) % ring.len() };
    // Notches in the triangle between may hide its end; the one nearest to the line of sight is seen.
    let (eye, tip) = (DVec2::new(x, from.y), corner(end));
    let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    let sense = turn(from, eye, tip).signum();
    let is_between = |p: DVec2| {
        [(from, eye), (eye, tip), (tip, from)].iter().all(|&(a, b)| turn(a, b, p) * sense >= 0.0) && p.x >= from.x
    };
    let mut best = (f64::INFINITY, f64::INFINITY, end);
    for i in 0..ring.len() {
        let (before, p, after) = (corner(i + ring.len() - 1), corner(i), corner(i + 1));
        let is_notch = turn(before, p, after) <= 0.0;
        // Where bridges end already there are several corners, each with a view of its own.
        let [left_of_both, left_of_any] = {
            let [first, second] = [turn(before, p, from) >= 0.0, turn(p, after, from) >= 0.0];
            [first && second, first || second]
        };
        let is_seen = if is_notch { left_of_any } else { left_of_both };
        if i == end || is_notch && is_seen && p != from && is_between(p) {
            let slope = (p.y - from.y).abs() / (p.x - from.x);
            let found = (if slope.is_nan() { 0.0 } else { slope }, p.distance_squared(from), i);
            if (found.0, found.1) < (best.0, best.1) {
                best = found;
            }
        }
    }
    best.2
}

/// Whether a contour, counter-clockwise, has no notch and goes round once.
pub(super) fn is_convex(contour: &[Point]) -> bool {
    let count = contour.len();
    let p = |i: usize| DVec2::from(contour[i % count]);
    let turns = (0..count).all(|i| (p(i + 1) - p(i)).perp_dot(p(i + 2) - p(i + 1)) >= 0.0);
    // Once round, the way goes from left to right and back.
    let to_right = |i: usize| p(i + 1).x > p(i).x;
    let changes = (0..count).filter(|&i| to_right(i) != to_right(i + 1)).count();
    count > 2 && turns && changes <= 2
}
