//! Where a line is inside a closed mesh, which may consist of several surfaces, nested or overlapping.
//!
//! Where the line enters and leaves by turns, those are the ends. Elsewhere a second entry may be that of another surface, or
//! of the other triangle of an edge: how often the surfaces go round the points between two crossings decides (A. van Oosterom
//! and J. Strackee, "The solid angle of a plane triangle", 1983).

use std::f64::consts::PI;

use glam::DVec3;

use super::super::margin::point_to_triangle;
use super::super::shapes;
use super::super::spans::Span;
use crate::scene::mesh::Mesh;

/// Crossings of a mesh closer than this relative to coordinates are one.
const SAME_EDGE: f64 = 1e-13;
/// Points closer to the surface than this relative to coordinates may be on either side of it.
const ON_SURFACE: f64 = 1e-12;

/// Parameter, whether the line enters there, triangle.
type End = (f64, bool, u32);

/// The parts of the line inside, in order.
pub(super) fn meshed(mesh: &Mesh, org: DVec3, dir: DVec3) -> Vec<Span> {
    let mut ends: Vec<End> = Vec::new();
    for i in 0..mesh.triangles.len() {
        let corners = mesh.corners(i);
        if let Some(hit) = shapes::triangle(corners, org, dir).filter(|_| shapes::is_proper(corners)) {
            ends.push((hit.t, hit.ng.dot(dir) < 0.0, i as u32));
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let size = mesh.bounds().map_or(0.0, |(lo, hi)| lo.abs().max(hi.abs()).max_element()) + org.abs().max_element();
    let apart = SAME_EDGE * size / dir.length();
    let groups: Vec<&[End]> = ends.chunk_by(|a, b| b.0 - a.0 <= apart).collect();
    let by_turns = groups.iter().enumerate().all(|(i, group)| group.iter().all(|end| end.1 == (i % 2 == 0)));
    let mut spans: Vec<Span> = Vec::new();
    let mut entered: Option<End> = None;
    for (i, group) in groups.iter().enumerate() {
        let first = |enters: bool| group.iter().find(|end| end.1 == enters);
        let walked = match (first(true), first(false)) {
            (Some(_), None) => true,
            (None, Some(_)) => false,
            _ => entered.is_some(),
        };
        let is_inside = match groups.get(i + 1) {
            None => false,
            Some(_) if by_turns => walked,
            Some(next) => is_enclosed(mesh, org + 0.5 * (group[0].0 + next[0].0) * dir, size).unwrap_or(walked),
        };
        match entered {
            None if is_inside => entered = Some(*first(true).unwrap_or(&group[0])),
            Some((t_in, _, face_in)) if !is_inside => {
                let (t, _, face) = *first(false).unwrap_or(&group[0]);
                spans.push(Span::new(t_in, t, face_in, face));
                entered = None;
            }
            _ => {}
        }
    }
    spans
}

/// Whether more surfaces go round `p` outwards than inwards; `None` if it lies on one of them. `size`: of the coordinates.
fn is_enclosed(mesh: &Mesh, p: DVec3, size: f64) -> Option<bool> {
    let mut angle = 0.0;
    for corners in (0..mesh.triangles.len()).map(|i| mesh.corners(i)).filter(|corners| shapes::is_proper(*corners)) {
        if point_to_triangle(p, corners) <= ON_SURFACE * size {
            return None;
        }
        let [a, b, c] = corners.map(|corner| corner - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        angle += 2.0 * a.dot(shapes::cross(b, c)).atan2(below);
    }
    Some(angle > 2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubes by centre and half of a side, in one mesh; one of a negative half is turned inwards.
    fn cubes(list: &[(f64, f64)]) -> Mesh {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut mesh = Mesh::default();
        for &(centre, half) in list {
            let at = mesh.positions.len() as u32;
            let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
            mesh.positions.extend((0..8).map(|i| DVec3::splat(centre) + corner(i) * half));
            mesh.triangles
                .extend(quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]].map(|t| t.map(|k| k + at))));
        }
        mesh
    }

    #[test]
    fn nested_and_overlapping_cubes_by_hand() {
        type Pairs = &'static [(f64, f64)];
        let cases: [(Pairs, Pairs); 6] = [
            (&[(0.0, 10.0)], &[(40.0, 60.0)]),
            (&[(0.0, 10.0), (0.0, 4.0)], &[(40.0, 60.0)]),
            (&[(0.0, 10.0), (0.0, -4.0)], &[(40.0, 46.0), (54.0, 60.0)]),
            (&[(0.0, 10.0), (8.0, 10.0)], &[(40.0, 68.0)]),
            (&[(0.0, 10.0), (0.0, -6.0), (0.0, 3.0)], &[(40.0, 44.0), (47.0, 53.0), (56.0, 60.0)]),
            (&[(0.0, -10.0)], &[]),
        ];
        for (list, want) in cases {
            // Through edges of triangles, and beside them.
            for (y, z) in [(1.0, 1.0), (1.0, 2.0), (-1.5, 0.5)] {
                let spans = meshed(&cubes(list), DVec3::new(-50.0, y, z), DVec3::X);
                let got: Vec<_> = spans.iter().map(|s| (s.enter.t, s.leave.t)).collect();
                let near = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12;
                assert!(got.len() == want.len() && got.iter().zip(want).all(near), "{list:?} at {y} {z}: {got:?}");
            }
        }
    }
}
