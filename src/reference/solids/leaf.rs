//! Where a line is inside one leaf: intervals in order of t, f64.
//!
//! Convex shapes and quadrics as in the floor's own shapes; polyhedra by clipping; tori by their distance functions; the
//! tapered solid by a quartic about the line's nearest point, its roots parted by those of the derivatives.

use glam::DVec3;

use super::super::margin::point_to_triangle;
use super::super::shapes;
use super::super::spans::{self, Crossing, Span};
use super::meshes::meshed;
use super::tori;
use crate::scene::description::Shape;
use crate::scene::mesh::Mesh;
use crate::scene::solids::{Polyhedron, Solid};

/// Entry and exit of each interval, in order; ends may be infinite.
pub(super) fn intervals(solid: &Solid, org: DVec3, dir: DVec3) -> Vec<Span> {
    match solid {
        Solid::Shape(Shape::HalfSpace) => half_space(org.z, dir.z, 0.0).into_iter().collect(),
        Solid::Shape(shape) => match shapes::crossings(*shape, org, dir) {
            [Some(enter), Some(leave)] => vec![Span { enter, leave }],
            _ => Vec::new(),
        },
        Solid::Polyhedron(polyhedron) => clipped(polyhedron, org, dir).into_iter().collect(),
        Solid::Torus { minor } => tori::torus(*minor, org, dir),
        Solid::EllipticTorus { reach, lean } => tori::elliptic_torus(*reach, *lean, org, dir),
        Solid::Taper { x, y, .. } => taper([*x, *y], org, dir),
        Solid::Round { profile } => curved(*profile, false, org, dir),
        Solid::Trough { profile } => curved(*profile, true, org, dir),
        Solid::Mesh(mesh) => meshed(mesh, org, dir),
    }
}

/// Outward normal at a point of a face, canonical space, unnormalised.
pub(super) fn normal(solid: &Solid, face: u32, p: DVec3) -> DVec3 {
    let ends = [DVec3::NEG_Z, DVec3::Z, DVec3::NEG_X, DVec3::X];
    let end = |face: u32| ends.get(face as usize - 1).copied().unwrap_or(DVec3::Z);
    match solid {
        Solid::Shape(shape) => shapes::normal(*shape, face, p),
        Solid::Polyhedron(polyhedron) => polyhedron.planes().get(face as usize).map_or(DVec3::Z, |q| q.normal),
        Solid::Torus { .. } => p - DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X),
        Solid::EllipticTorus { reach, lean } => tori::elliptic_normal(*reach, *lean, p),
        Solid::Taper { .. } | Solid::Round { .. } | Solid::Trough { .. } if face > 0 => end(face),
        Solid::Taper { x, y, .. } => {
            // Of (x / a)^2 + (y / b)^2 - 1.
            let (a, b) = (1.0 + (x - 1.0) * p.z, 1.0 + (y - 1.0) * p.z);
            let along = -(p.x * p.x * (x - 1.0) / a.powi(3) + p.y * p.y * (y - 1.0) / b.powi(3));
            DVec3::new(p.x / (a * a), p.y / (b * b), along)
        }
        Solid::Round { profile: [_, g1, g2] } => DVec3::new(2.0 * p.x, 2.0 * p.y, -(g1 + 2.0 * g2 * p.z)),
        Solid::Trough { profile: [_, g1, g2] } => DVec3::new(0.0, 2.0 * p.y, -(g1 + 2.0 * g2 * p.z)),
        Solid::Mesh(mesh) => {
            let [a, b, c] = mesh.corners(face as usize);
            shapes::cross(b - a, c - a)
        }
    }
}

/// Distance of a point of the surface from a flat face, canonical space; `None` for other faces.
pub(super) fn to_face(solid: &Solid, face: u32, p: DVec3) -> Option<f64> {
    let slab = |axis: usize, at: f64| Some((p[axis] - at).abs());
    match (solid, face) {
        (Solid::Shape(Shape::Cuboid), 0..6) => slab(face as usize / 2, f64::from(face % 2) * 2.0 - 1.0),
        (Solid::Shape(Shape::Cone { .. } | Shape::Cylinder), 1 | 2)
        | (Solid::Taper { .. } | Solid::Round { .. } | Solid::Trough { .. }, 1 | 2) => slab(2, f64::from(face - 1)),
        (Solid::Trough { .. }, 3 | 4) => slab(0, f64::from(face) * 2.0 - 7.0),
        (Solid::Polyhedron(polyhedron), _) => {
            let plane = polyhedron.planes().get(face as usize)?;
            Some((plane.normal.dot(p) - plane.offset).abs())
        }
        (Solid::Mesh(mesh), _) if (face as usize) < mesh.triangles.len() => {
            Some(point_to_triangle(p, mesh.corners(face as usize)))
        }
        _ => None,
    }
}

/// How far the triangles that a line crosses reach beyond their edges.
pub(super) fn blur(mesh: &Mesh, org: DVec3, dir: DVec3) -> f64 {
    let crossed = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).filter(|c| shapes::is_proper(*c));
    crossed
        .filter(|corners| shapes::triangle(*corners, org, dir).is_some())
        .map(|corners| shapes::blur(corners, org, dir))
        .fold(0.0, f64::max)
}

/// Where `n . p <= d` with `at` = n . org - d and `speed` = n . dir.
fn half_space(at: f64, speed: f64, face: f64) -> Option<Span> {
    let face = face as u32;
    let t = -at / speed;
    match speed {
        s if s > 0.0 => Some(Span::new(f64::NEG_INFINITY, t, face, face)),
        s if s < 0.0 => Some(Span::new(t, f64::INFINITY, face, face)),
        _ => (at <= 0.0).then(Span::all),
    }
}

fn clipped(polyhedron: &Polyhedron, org: DVec3, dir: DVec3) -> Option<Span> {
    let mut span = Span::all();
    for (i, plane) in polyhedron.planes().iter().enumerate() {
        let at = plane.normal.dot(org) - plane.offset;
        span = span.and(half_space(at, plane.normal.dot(dir), i as f64)?)?;
    }
    Some(span)
}

/// Quadrics between slabs; `drawn`: along x.
fn curved([g0, g1, g2]: [f64; 3], drawn: bool, org: DVec3, dir: DVec3) -> Vec<Span> {
    // From the middle of the slab or of the line's way near the axis: far away the quadratic would cancel.
    let flat = |v: DVec3| if drawn { DVec3::new(0.0, v.y, v.z) } else { v };
    let shift = -flat(org).dot(flat(dir)) / flat(dir).dot(flat(dir));
    let shift = if shift.is_finite() { shift } else { 0.0 };
    let org = org + shift * dir;
    let squares = |p: DVec3, q: DVec3| if drawn { p.y * q.y } else { p.x * q.x + p.y * q.y };
    let a = squares(dir, dir) - g2 * dir.z * dir.z;
    let b = squares(org, dir) - 0.5 * (g1 + 2.0 * g2 * org.z) * dir.z;
    let c = squares(org, org) - (g0 + g1 * org.z + g2 * org.z * org.z);
    let mut ends = spans::slab(org.z, dir.z, 0.0, 1.0, 1, 2);
    if drawn {
        ends = ends.and_then(|ends| spans::slab(org.x, dir.x, -1.0, 1.0, 3, 4)?.and(ends));
    }
    let Some(ends) = ends else { return Vec::new() };
    let pieces = spans::quadric(a, b, c).into_iter().flatten();
    pieces.filter_map(|side| side.and(ends)).map(|s| s.moved(shift)).collect()
}

/// The sign change of `f` between `a` and `b`.
pub(super) fn bisected(f: &impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let below = f(a) <= 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (a + b);
        if middle <= a || middle >= b {
            break;
        }
        if (f(middle) <= 0.0) == below { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

/// Between the ends the solid is where x^2 b(z)^2 + y^2 a(z)^2 <= a(z)^2 b(z)^2.
fn taper([x, y]: [f64; 2], org: DVec3, dir: DVec3) -> Vec<Span> {
    let ends = spans::slab(org.z, dir.z, 0.0, 1.0, 1, 2);
    let wide = |top: f64| 1.01 * top.max(1.0);
    let x_slab = spans::slab(org.x, dir.x, -wide(x), wide(x), 9, 9);
    let y_slab = spans::slab(org.y, dir.y, -wide(y), wide(y), 9, 9);
    let within = ends.zip(x_slab).zip(y_slab).and_then(|((e, x), y)| e.and(x)?.and(y));
    let Some(within) = within else { return Vec::new() };
    let (from, length) = (within.enter.t, within.leave.t - within.enter.t);
    if !(length > 0.0 && length.is_finite()) {
        return Vec::new();
    }
    let (o, d) = (org + from * dir, dir * length);
    let linear = |c0: f64, c1: f64| vec![c0, c1];
    let (a, b) = (linear(1.0 + (x - 1.0) * o.z, (x - 1.0) * d.z), linear(1.0 + (y - 1.0) * o.z, (y - 1.0) * d.z));
    let (px, py) = (linear(o.x, d.x), linear(o.y, d.y));
    let square = |p: &[f64], q: &[f64]| {
        let product = times(p, q);
        times(&product, &product)
    };
    let (u, v, w) = (square(&px, &b), square(&py, &a), square(&a, &b));
    let p: Vec<f64> = (0..5).map(|k| u[k] + v[k] - w[k]).collect();
    let inside = |s: f64| value(&p, s) <= 0.0;
    let mut cuts = roots(&p);
    cuts.insert(0, 0.0);
    cuts.push(1.0);
    let end = |s: f64, there: Crossing| match s {
        0.0 | 1.0 => there,
        _ => Crossing { t: from + s * length, face: 0 },
    };
    let mut found: Vec<Span> = Vec::new();
    for pair in cuts.windows(2).filter(|p| p[1] > p[0] && inside(0.5 * (p[0] + p[1]))) {
        let span = Span { enter: end(pair[0], within.enter), leave: end(pair[1], within.leave) };
        match found.last_mut() {
            Some(last) if last.leave.t == span.enter.t => last.leave = span.leave,
            _ => found.push(span),
        }
    }
    found
}

fn times(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

fn value(p: &[f64], s: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// Sign changes of a polynomial in 0..1, ascending.
fn roots(p: &[f64]) -> Vec<f64> {
    let mut derivatives = vec![p.to_vec()];
    while let Some(last) = derivatives.last().filter(|p| p.len() > 2) {
        let next = last.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect();
        derivatives.push(next);
    }
    let mut found: Vec<f64> = Vec::new();
    for p in derivatives.iter().rev() {
        let mut cuts = vec![0.0];
        cuts.append(&mut found);
        cuts.push(1.0);
        let f = |s: f64| value(p, s);
        found = cuts
            .windows(2)
            .filter(|c| (f(c[0]) <= 0.0) != (f(c[1]) <= 0.0))
            .map(|c| bisected(&f, c[0], c[1]))
            .collect();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solids::torus as placed_torus;

    fn ts(solid: &Solid, org: [f64; 3], dir: [f64; 3]) -> Vec<(f64, f64)> {
        intervals(solid, org.into(), dir.into()).iter().map(|s| (s.enter.t, s.leave.t)).collect()
    }

    fn close(got: &[(f64, f64)], want: &[(f64, f64)]) {
        let near = |g: f64, w: f64| g == w || (g - w).abs() < 1e-12;
        let all = got.len() == want.len() && got.iter().zip(want).all(|(g, w)| near(g.0, w.0) && near(g.1, w.1));
        assert!(all, "{got:?} {want:?}");
    }

    #[test]
    fn torus_by_hand() {
        let torus = Solid::Torus { minor: 0.25 };
        close(&ts(&torus, [-3.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[(1.75, 2.25), (3.75, 4.25)]);
        close(&ts(&torus, [1.0, 0.0, 2.0], [0.0, 0.0, -4.0]), &[(0.4375, 0.5625)]);
        close(&ts(&torus, [0.0, 0.0, 2.0], [0.0, 0.0, -1.0]), &[]);
        // Along the inner equator's tangent: enters where x^2 + 0.75^2 = 1.25^2.
        close(
            &ts(&torus, [-3.0, 0.76, 0.0], [1.0, 0.0, 0.0]).into_iter().take(1).map(|s| (s.0, 0.0)).collect::<Vec<_>>(),
            &[(3.0 - (1.25f64 * 1.25 - 0.76 * 0.76).sqrt(), 0.0)],
        );
        let placed = placed_torus(DVec3::ZERO, DVec3::Z, 2.0, 0.5).unwrap();
        assert!(matches!(placed.solid, Solid::Torus { minor } if minor == 0.25));
    }

    #[test]
    fn elliptic_torus_by_hand() {
        // Without lean, a torus.
        for (org, dir) in [([-3.0, 0.1, 0.05], [1.0, 0.02, 0.01]), ([1.1, 0.0, 2.0], [0.0, 0.1, -1.0])] {
            let round = ts(&Solid::Torus { minor: 0.25 }, org, dir);
            close(&ts(&Solid::EllipticTorus { reach: 0.25, lean: 0.0 }, org, dir), &round);
        }
        // Semi-axes 0.4 and 0.2 on the diagonals: w^2 = 0.1, k = 0.6. At z = 0 the square of u is (1 - k^2) w^2.
        let solid = Solid::EllipticTorus { reach: 0.1f64.sqrt(), lean: 0.6 };
        let u = 0.064f64.sqrt();
        close(&ts(&solid, [-3.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[(2.0 - u, 2.0 + u), (4.0 - u, 4.0 + u)]);
        // Through an end of the longer one, out along the diagonal.
        let (half, end) = (0.5f64.sqrt(), 0.4 * 0.5f64.sqrt());
        close(&ts(&solid, [1.0 - half, 0.0, -half], [half, 0.0, half]), &[(0.6, 1.4)]);
        let n = normal(&solid, 0, DVec3::new(0.0, 1.0 + end, end)).normalize();
        assert!((n - DVec3::new(0.0, half, half)).length() < 1e-12, "{n}");
        // Reaching beyond the axis: hollow where it overlaps itself, turned inwards there.
        let wide = Solid::EllipticTorus { reach: 1.25, lean: 0.0 };
        close(&ts(&wide, [-3.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[(0.75, 2.75), (3.25, 5.25)]);
        assert!(normal(&wide, 0, DVec3::new(0.25, 0.0, 0.0)).x < 0.0);
        assert!(normal(&wide, 0, DVec3::new(2.25, 0.0, 0.0)).x > 0.0);
    }

    #[test]
    fn taper_by_hand() {
        // At z = 0.5 the semi-axes are 0.75 and 0.5.
        let solid = Solid::Taper { x: 0.5, y: 0.0, is_mirrored: false };
        close(&ts(&solid, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.25, 3.75)]);
        close(&ts(&solid, [0.0, -3.0, 0.5], [0.0, 1.0, 0.0]), &[(2.5, 3.5)]);
        close(&ts(&solid, [0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.0, 3.0)]);
        close(&ts(&solid, [0.0, 0.25, 3.0], [0.0, 0.0, -1.0]), &[(2.25, 3.0)]);
    }

    #[test]
    fn curved_by_hand() {
        // Radius 1/sqrt 2 half-way up the paraboloid; a waist of radius 1/2.
        let bowl = Solid::Round { profile: [1.0, -1.0, 0.0] };
        let r = 0.5f64.sqrt();
        close(&ts(&bowl, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(3.0 - r, 3.0 + r)]);
        close(&ts(&bowl, [0.5, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.25, 3.0)]);
        let waist = Solid::Round { profile: [1.0, -3.0, 3.0] };
        close(&ts(&waist, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.5, 3.5)]);
        // g = 0.81 at (1 -+ sqrt(1 - 4 * 0.19 / 3)) / 2.
        let root = (1.0f64 - 4.0 * 0.19 / 3.0).sqrt();
        close(&ts(&waist, [0.9, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.0, 2.5 - root / 2.0), (2.5 + root / 2.0, 3.0)]);
        let gutter = Solid::Trough { profile: [1.0, -1.0, 0.0] };
        close(&ts(&gutter, [-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), &[(2.0, 4.0)]);
        close(&ts(&gutter, [0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), &[(2.0, 3.0)]);
    }
}
