//! Where a line meets one primitive, f64: triangles in object space, analytic shapes in their canonical space.
//!
//! Every analytic shape is convex, so a line crosses its surface at most twice. The solids are written as what they
//! are, intersections of spans: a slab, a quadric's inside. Nothing here clips to a ray segment.

use glam::{DVec2, DVec3};

pub(super) use super::spans::Crossing;
use super::spans::{Span, cuboid, quadric, slab};
use crate::scene::description::Shape;

/// A line closer than this to a triangle's plane (sine of the angle) counts as parallel to it.
const PARALLEL: f64 = 1e-12;
/// Triangles are fatter than they are by this much times the distance to the origin, so that f64 rounding here does
/// not open a crack between two of them.
const FAT: f64 = 4.0 * f64::EPSILON;

/// Where a line meets a triangle: `p = (1-u-v) p0 + u p1 + v p2`.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleCrossing {
    pub t: f64,
    pub u: f64,
    pub v: f64,
    /// Cross product of the edges from corner 0, unnormalised.
    pub ng: DVec3,
}

/// First and second crossing in order of t.
pub(super) type Crossings = [Option<Crossing>; 2];

/// `a b - c d` to within 1.5 ulp (Kahan; Jeannerod, Louvet, Muller, "Further analysis of Kahan's algorithm for the
/// accurate computation of 2x2 determinants", 2013).
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    a.mul_add(b, -cd) + (-c).mul_add(d, cd)
}

/// Cross product without cancellation: the normal of a sliver is as good as its edges.
pub(super) fn cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(
        difference_of_products(a.y, b.z, a.z, b.y),
        difference_of_products(a.z, b.x, a.x, b.z),
        difference_of_products(a.x, b.y, a.y, b.x),
    )
}

/// Whether a triangle can be hit: finite corners, an area.
pub(super) fn is_proper(corners: [DVec3; 3]) -> bool {
    let [p0, p1, p2] = corners;
    let ng = cross(p1 - p0, p2 - p0);
    corners.iter().all(|p| p.is_finite()) && ng.is_finite() && ng != DVec3::ZERO
}

/// The line's crossing with the triangle's plane, whether it lies inside the triangle or not; `None` if parallel.
///
/// Cramer's rule (Moeller, Trumbore, "Fast, minimum storage ray-triangle intersection", 1997), t from the plane.
pub(super) fn triangle_plane([p0, p1, p2]: [DVec3; 3], org: DVec3, dir: DVec3) -> Option<TriangleCrossing> {
    let (e1, e2, s) = (p1 - p0, p2 - p0, org - p0);
    let (ng, det) = (cross(e1, e2), -dir.dot(cross(e1, e2)));
    let (u, v) = (dir.dot(cross(e2, s)) / det, dir.dot(cross(s, e1)) / det);
    let hit = TriangleCrossing { t: s.dot(ng) / det, u, v, ng };
    (det.abs() > PARALLEL * dir.length() * ng.length()).then_some(hit)
}

/// How far a triangle that a line crosses is seen beyond its edges, at most: the errors of both weights add up beyond the
/// third edge, where one unit of u + v is |ng| / |third edge| long.
pub(super) fn blur([p0, p1, p2]: [DVec3; 3], org: DVec3, dir: DVec3) -> f64 {
    let (e1, e2) = (p1 - p0, p2 - p0);
    let third = (e1.length() + e2.length()) / (p2 - p1).length();
    2.0 * fatness(p0, cross(e1, e2), org, dir) * third
}

/// How far a triangle reaches beyond its edges, in its plane, for a line that crosses it.
fn fatness(p0: DVec3, ng: DVec3, org: DVec3, dir: DVec3) -> f64 {
    FAT * (org - p0).length() * (dir.length() * ng.length()) / dir.dot(ng).abs()
}

/// The line's crossing with a triangle, both sides, edges included.
pub(super) fn triangle(corners: [DVec3; 3], org: DVec3, dir: DVec3) -> Option<TriangleCrossing> {
    let hit = triangle_plane(corners, org, dir)?;
    let [p0, p1, p2] = corners;
    let fat = fatness(p0, hit.ng, org, dir) / hit.ng.length();
    let (fat_u, fat_v) = (fat * (p2 - p0).length(), fat * (p1 - p0).length());
    (hit.u >= -fat_u && hit.v >= -fat_v && hit.u + hit.v <= 1.0 + fat_u + fat_v).then_some(hit)
}

/// The part of the line inside a solid whose canonical form lies in [-1, 1]^3.
fn solid(shape: Shape, org: DVec3, dir: DVec3) -> Option<Span> {
    // From far away the quadratics would cancel: start in the middle of the line's way through a box around it.
    let near = cuboid(org, dir, 2.0)?;
    let shift = 0.5 * near.enter.t + 0.5 * near.leave.t;
    let org = org + shift * dir;
    let (org_xy, dir_xy) = (DVec2::new(org.x, org.y), DVec2::new(dir.x, dir.y));
    let caps = || slab(org.z, dir.z, 0.0, 1.0, 1, 2);
    let span = match shape {
        Shape::HalfSpace | Shape::Disc => None,
        Shape::Cuboid => cuboid(org, dir, 1.0),
        Shape::Sphere => quadric(dir.dot(dir), org.dot(dir), org.dot(org) - 1.0)[0],
        Shape::Cylinder => {
            let side = quadric(dir_xy.dot(dir_xy), org_xy.dot(dir_xy), org_xy.dot(org_xy) - 1.0)[0];
            side?.and(caps()?)
        }
        Shape::Cone { top, .. } => {
            // Inside: |xy| <= radius(z) = 1 - k z. Within the caps the mirrored cone beyond the apex plays no part
            // but for the apex itself, so the longer piece is the solid's.
            let k = 1.0 - top;
            let (radius, slope) = (1.0 - k * org.z, -k * dir.z);
            let a = dir_xy.dot(dir_xy) - slope * slope;
            let b = org_xy.dot(dir_xy) - radius * slope;
            let c = org_xy.dot(org_xy) - radius * radius;
            let caps = caps()?;
            let pieces = quadric(a, b, c).into_iter().flatten().filter_map(|side| side.and(caps));
            pieces.max_by(|p, q| p.length().total_cmp(&q.length()))
        }
    }?;
    Some(span.moved(shift))
}

/// The line's crossings with the surface of `shape`, in order of t, both in the shape's canonical space.
pub(super) fn crossings(shape: Shape, org: DVec3, dir: DVec3) -> Crossings {
    match shape {
        Shape::HalfSpace | Shape::Disc => {
            let t = -org.z / dir.z;
            let (x, y) = (org.x + t * dir.x, org.y + t * dir.y);
            let inside = shape == Shape::HalfSpace || x * x + y * y <= 1.0;
            [(t.is_finite() && inside).then_some(Crossing { t, face: 0 }), None]
        }
        _ => solid(shape, org, dir).map_or([None; 2], |span| [Some(span.enter), Some(span.leave)]),
    }
}

/// Outward normal of `shape` at the point `p` of its face `face`, canonical space, unnormalised, never zero.
pub(super) fn normal(shape: Shape, face: u32, p: DVec3) -> DVec3 {
    let cap = if face == 1 { DVec3::NEG_Z } else { DVec3::Z };
    let side = DVec3::new(p.x, p.y, 0.0);
    let n = match shape {
        Shape::HalfSpace | Shape::Disc => DVec3::Z,
        Shape::Sphere => p,
        Shape::Cuboid => DVec3::AXES[face as usize / 2] * if face.is_multiple_of(2) { -1.0 } else { 1.0 },
        Shape::Cylinder if face == 0 => side,
        Shape::Cone { top, .. } if face == 0 => side + DVec3::Z * ((1.0 - top) * side.length()),
        Shape::Cylinder | Shape::Cone { .. } => cap,
    };
    if n == DVec3::ZERO { DVec3::Z } else { n }
}

/// Lower and upper corner of `shape` in its canonical space; infinite for the half-space.
pub(super) fn canonical_bounds(shape: Shape) -> (DVec3, DVec3) {
    match shape {
        Shape::HalfSpace => (DVec3::NEG_INFINITY, DVec3::INFINITY),
        Shape::Sphere | Shape::Cuboid => (DVec3::NEG_ONE, DVec3::ONE),
        Shape::Disc => (DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0)),
        Shape::Cylinder | Shape::Cone { .. } => (DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE),
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::super::nearest::to_face;
    use super::*;

    fn ts(shape: Shape, org: [f64; 3], dir: [f64; 3]) -> Vec<(f64, u32)> {
        let found = crossings(shape, DVec3::from(org), DVec3::from(dir));
        found.into_iter().flatten().map(|c| (c.t, c.face)).collect()
    }

    fn close(got: &[(f64, u32)], want: &[(f64, u32)]) {
        assert_eq!(got.len(), want.len(), "{got:?} {want:?}");
        for (g, w) in got.iter().zip(want) {
            assert!((g.0 - w.0).abs() <= 1e-14 * w.0.abs().max(1.0) && g.1 == w.1, "{got:?} {want:?}");
        }
    }

    #[test]
    fn sphere() {
        close(&ts(Shape::Sphere, [-3.0, 0.0, 0.0], [2.0, 0.0, 0.0]), &[(1.0, 0), (2.0, 0)]);
        // 0.6, 0.8 is on the circle.
        close(&ts(Shape::Sphere, [0.6, 5.0, 0.0], [0.0, -1.0, 0.0]), &[(4.2, 0), (5.8, 0)]);
        close(&ts(Shape::Sphere, [0.0; 3], [0.0, 0.0, 4.0]), &[(-0.25, 0), (0.25, 0)]);
        close(&ts(Shape::Sphere, [1.0, 5.0, 0.0], [0.0, -1.0, 0.0]), &[(5.0, 0), (5.0, 0)]);
        close(&ts(Shape::Sphere, [1.0 + 1e-15, 5.0, 0.0], [0.0, -1.0, 0.0]), &[]);
        // From far away the roots keep their distance of 2.
        let far = ts(Shape::Sphere, [0.0, 0.0, 1e12], [0.0, 0.0, -1.0]);
        close(&far, &[(1e12 - 1.0, 0), (1e12 + 1.0, 0)]);
        close(&ts(Shape::Sphere, [0.0, 1.1, 1e12], [0.0, 0.0, -1.0]), &[]);
    }

    #[test]
    fn cuboid_faces() {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let (mut org, mut dir) = ([0.25; 3], [0.0; 3]);
                (org[axis], dir[axis]) = (3.0 * sign, -2.0 * sign);
                let (first, second) = if sign < 0.0 { (0, 1) } else { (1, 0) };
                let face = 2 * axis as u32;
                close(&ts(Shape::Cuboid, org, dir), &[(1.0, face + first), (2.0, face + second)]);
            }
        }
        // Diagonal over the edge x = 1, y = -1 ... enters at x = -1 (t = 2), leaves at y = 1 (t = 2.5).
        close(&ts(Shape::Cuboid, [-3.0, -1.5, 0.0], [1.0, 1.0, 0.0]), &[(2.0, 0), (2.5, 3)]);
        close(&ts(Shape::Cuboid, [-3.0, -5.1, 0.0], [1.0, 1.0, 0.0]), &[]);
        close(&ts(Shape::Cuboid, [-3.0, 1.0, 0.0], [1.0, 0.0, 0.0]), &[(2.0, 0), (4.0, 1)]);
    }

    #[test]
    fn planes() {
        close(&ts(Shape::HalfSpace, [1e9, 7.0, 6.0], [0.0, 0.0, -2.0]), &[(3.0, 0)]);
        close(&ts(Shape::HalfSpace, [0.0, 0.0, 6.0], [1.0, 0.0, 0.0]), &[]);
        close(&ts(Shape::Disc, [0.6, 0.8, -1.0], [0.0, 0.0, 1.0]), &[(1.0, 0)]);
        close(&ts(Shape::Disc, [0.6, 0.8001, -1.0], [0.0, 0.0, 1.0]), &[]);
        close(&ts(Shape::Disc, [-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[]);
    }

    #[test]
    fn cylinder() {
        close(&ts(Shape::Cylinder, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.0, 0), (4.0, 0)]);
        close(&ts(Shape::Cylinder, [0.3, 0.3, 4.0], [0.0, 0.0, -1.0]), &[(3.0, 2), (4.0, 1)]);
        close(&ts(Shape::Cylinder, [0.3, 0.3, -4.0], [0.0, 0.0, 1.0]), &[(4.0, 1), (5.0, 2)]);
        // Down through the top cap, out through the side: x = t, z = 2 - t.
        close(&ts(Shape::Cylinder, [-0.5, 0.0, 1.5], [1.0, 0.0, -1.0]), &[(0.5, 2), (1.5, 0)]);
        close(&ts(Shape::Cylinder, [1.1, 0.0, 4.0], [0.0, 0.0, -1.0]), &[]);
        close(&ts(Shape::Cylinder, [-3.0, 0.0, 1.1], [1.0, 0.0, 0.0]), &[]);
    }

    #[test]
    fn cone() {
        let (pointed, blunt) = (Shape::cone(0.0), Shape::cone(0.5));
        // Radius 0.5 at half height, 0.75 for the blunt one.
        close(&ts(pointed, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.5, 0), (3.5, 0)]);
        close(&ts(blunt, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.25, 0), (3.75, 0)]);
        close(&ts(Shape::cone(1.0), [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.0, 0), (4.0, 0)]);
        // Parallel to the axis at x = 0.25: the side is at z = 0.75.
        close(&ts(pointed, [0.25, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.25, 0), (3.0, 1)]);
        close(&ts(blunt, [0.25, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.0, 2), (3.0, 1)]);
        // Parallel to the side's line x = 1 - z: in through the base at x = 0.5, out where -x = 1 - z.
        close(&ts(pointed, [1.5, 0.0, -1.0], [-1.0, 0.0, 1.0]), &[(1.0, 1), (1.75, 0)]);
        // Touches the rim of the base, misses it.
        close(&ts(pointed, [0.0, 0.0, -1.0], [-1.0, 0.0, 1.0]), &[(1.0, 1), (1.0, 0)]);
        close(&ts(pointed, [-0.1, 0.0, -1.0], [-1.0, 0.0, 1.0]), &[]);
        // The mirrored cone above the apex is not there.
        close(&ts(pointed, [-3.0, 0.0, 1.5], [1.0, 0.0, 0.0]), &[]);
        // The apex belongs to the side: there is no cap.
        close(&ts(pointed, [0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.0, 0), (3.0, 1)]);
    }

    #[test]
    fn crossings_lie_on_the_surface_and_normals_point_outwards() {
        let shapes = [Shape::Sphere, Shape::Cuboid, Shape::Cylinder, Shape::cone(0.0), Shape::cone(0.7)];
        let mut hits = 0;
        for i in 0..20_000u32 {
            let f = |k: u32| f64::from((i.wrapping_mul(k) >> 8) % 2001) / 1000.0 - 1.0;
            let (org, dir) = (
                3.0 * DVec3::new(f(2654435761), f(40503), f(2246822519)),
                DVec3::new(f(97), f(3266489917), f(668265263)),
            );
            if dir == DVec3::ZERO {
                continue;
            }
            for shape in shapes {
                let [Some(a), Some(b)] = crossings(shape, org, dir) else { continue };
                hits += 1;
                let (p, q) = (org + a.t * dir, org + b.t * dir);
                let (np, nq) = (normal(shape, a.face, p), normal(shape, b.face, q));
                assert!(a.t <= b.t && np.dot(dir) <= 1e-7 && nq.dot(dir) >= -1e-7, "{shape:?} {org} {dir}");
                for (p, face) in [(p, a.face), (q, b.face)] {
                    assert!(to_face(shape, face, &DMat3::IDENTITY, p) < 1e-7, "{shape:?} {face} {p}");
                    let off = match (shape, face) {
                        (Shape::Sphere, _) => p.length() - 1.0,
                        (Shape::Cuboid, _) => p.abs().max_element() - 1.0,
                        (_, 1) => p.z,
                        (_, 2) => p.z - 1.0,
                        (Shape::Cylinder, _) => p.x.hypot(p.y) - 1.0,
                        (Shape::Cone { top, .. }, _) => p.x.hypot(p.y) - (1.0 - (1.0 - top) * p.z),
                        _ => unreachable!("solids only"),
                    };
                    assert!(off.abs() < 1e-7, "{shape:?} {face} {p} {off}");
                }
            }
        }
        assert!(hits > 10_000, "{hits}");
    }

    #[test]
    fn triangles() {
        let corners = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0];
        let hit = triangle(corners, DVec3::new(1.0, 2.0, 6.0), DVec3::new(0.0, 0.0, -2.0)).unwrap();
        assert_eq!((hit.t, hit.u, hit.v, hit.ng), (3.0, 0.25, 0.5, DVec3::new(0.0, 0.0, 16.0)));
        let back = triangle(corners, DVec3::new(1.0, 2.0, -6.0), DVec3::new(0.0, 0.0, 2.0)).unwrap();
        assert_eq!((back.t, back.u, back.v), (3.0, 0.25, 0.5));
        assert!(triangle(corners, DVec3::new(2.1, 2.0, 1.0), DVec3::NEG_Z).is_none());
        assert!(triangle(corners, DVec3::new(-0.1, 2.0, 1.0), DVec3::NEG_Z).is_none());
        assert!(triangle(corners, DVec3::new(-1.0, 1.0, 0.0), DVec3::X).is_none(), "in the plane");
        for on_the_rim in [DVec3::ZERO, DVec3::X * 4.0, DVec3::new(2.0, 2.0, 0.0), DVec3::new(0.0, 1.0, 0.0)] {
            assert!(triangle(corners, on_the_rim + DVec3::Z, DVec3::NEG_Z).is_some());
        }
        assert!(!is_proper([DVec3::ZERO, DVec3::X, DVec3::X * 3.0]));
        assert!(!is_proper([DVec3::ZERO, DVec3::X, DVec3::NAN]));
        assert!(is_proper([DVec3::ZERO, DVec3::X * 1e-41, DVec3::Y * 1e-41]));
        assert!(is_proper([DVec3::ZERO, DVec3::X * 3.4e38, DVec3::Y * 3.4e38]));
    }

    #[test]
    fn a_sliver_keeps_its_plane() {
        // Normal by hand: e1 = (1, 1, 0), e2 = (1 + h, 1, 0) have the cross product (0, 0, -h).
        let h = 2f64.powi(-50);
        assert_eq!(cross(DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0 + h, 1.0, 0.0)), DVec3::new(0.0, 0.0, -h));
        let (a, b) = (1.0 + 2f64.powi(-30), 1.0 - 2f64.powi(-30));
        assert_eq!(difference_of_products(a, b, 1.0, 1.0), -(2f64.powi(-60)));
    }
}
