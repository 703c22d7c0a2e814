//! From the numbers that databases and people give to a canonical solid and its transform.
//!
//! Every function says in words what is wrong with numbers it refuses.

use glam::{DAffine3, DMat3, DVec3};

use super::Solid;
use crate::scene::description::Shape;

/// Relative difference below which two numbers of a database count as equal: what decimal text leaves of f32.
const ALIKE: f64 = 1e-7;

/// A canonical solid with its place.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The canonical solid.
    pub solid: Solid,
    /// Its space to the parent's.
    pub transform: DAffine3,
}

impl Placed {
    fn new(solid: Solid, x: DVec3, y: DVec3, z: DVec3, origin: DVec3) -> Result<Self, String> {
        let transform = DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), origin);
        let usable = transform.is_finite() && transform.matrix3.determinant() != 0.0;
        match usable && transform.inverse().is_finite() {
            true => Ok(Self { solid, transform }),
            false => Err("it is flat, or its numbers are not finite".into()),
        }
    }
}

/// A ball.
///
/// # Errors
/// A radius that is not above zero.
pub fn ball(centre: DVec3, radius: f64) -> Result<Placed, String> {
    ellipsoid(centre, DVec3::X * radius, DVec3::Y * radius, DVec3::Z * radius)
}

/// An ellipsoid by its centre and semi-axes, which need not be perpendicular.
///
/// # Errors
/// Semi-axes that span no volume.
pub fn ellipsoid(v: DVec3, a: DVec3, b: DVec3, c: DVec3) -> Result<Placed, String> {
    Placed::new(Solid::Shape(Shape::Sphere), a, b, c, v)
}

/// The half-space `normal . p <= distance`; `normal` need not be unit.
///
/// # Errors
/// A normal without direction.
pub fn half_space(normal: DVec3, distance: f64) -> Result<Placed, String> {
    let length = normal.length();
    let n = normal / length;
    if !n.is_finite() || n == DVec3::ZERO {
        return Err("its normal has no direction".into());
    }
    let (x, y) = n.any_orthonormal_pair();
    Placed::new(Solid::Shape(Shape::HalfSpace), x, y, n, n * (distance / length))
}

/// A torus: centre, the axis of revolution, radius of the circle in the tube's middle, radius of the tube.
///
/// # Errors
/// Radii that are not above zero, an axis without direction.
pub fn torus(v: DVec3, axis: DVec3, major: f64, minor: f64) -> Result<Placed, String> {
    if !(major > 0.0 && minor > 0.0) {
        return Err(format!("its radii must be above zero, found {major} and {minor}"));
    }
    let n = axis.try_normalize().ok_or("its axis has no direction")?;
    let (x, y) = n.any_orthonormal_pair();
    Placed::new(Solid::Torus { minor: minor / major }, x * major, y * major, n * major, v)
}

/// An elliptic torus (BRL-CAD's `eto`): centre, the axis of revolution, radius of the ring, the first semi-axis of the
/// tube's ellipse as its parts away from the axis and along it, the length of the second semi-axis.
///
/// # Errors
/// Lengths that are not above zero, an axis without direction.
pub fn elliptic_torus(v: DVec3, axis: DVec3, major: f64, [out, up]: [f64; 2], second: f64) -> Result<Placed, String> {
    let first = out.hypot(up);
    if !(major > 0.0 && first > 0.0 && second > 0.0) {
        return Err(format!("its radius and semi-axes must be above zero, found {major}, {first} and {second}"));
    }
    let n = axis.try_normalize().ok_or("its axis has no direction")?;
    let (x, y) = n.any_orthonormal_pair();
    let (cos, sin) = (out / first, up / first);
    // How far the ellipse reaches from the axis of the tube and along the other one.
    let (wide, high) = (out.hypot(second * sin), up.hypot(second * cos));
    let lean = (first - second) * (first + second) * sin * cos / (wide * high);
    let reach = wide / major;
    let solid = match lean.abs() > ALIKE || reach > 1.0 {
        true => Solid::EllipticTorus { reach, lean },
        false => Solid::Torus { minor: reach },
    };
    Placed::new(solid, x * major, y * major, n * (high / reach), v)
}

/// A right circular cylinder between two points.
///
/// # Errors
/// Ends that coincide, a radius that is not above zero.
pub fn cylinder(from: DVec3, to: DVec3, radius: f64) -> Result<Placed, String> {
    cone(from, to, radius, radius)
}

/// A right circular cone with flat ends between two points, one of its radii perhaps 0.
///
/// # Errors
/// Ends that coincide, radii below zero or both zero.
pub fn cone(from: DVec3, to: DVec3, from_radius: f64, to_radius: f64) -> Result<Placed, String> {
    let (x, y) = (to - from).try_normalize().ok_or("its ends coincide")?.any_orthonormal_pair();
    let scaled = |r: f64| (x * r, y * r);
    let ((a, b), (c, d)) = (scaled(from_radius), scaled(to_radius));
    truncated_cone(from, to - from, a, b, c, d)
}

/// BRL-CAD's `tgc`: base centre `v`, height `h` (perhaps oblique), semi-axes `a`, `b` of the base ellipse and `c`, `d` of
/// the top ellipse, `c` along `a` and `d` along `b`; of the latter only the lengths are used.
///
/// # Errors
/// A base and a top without area, a height in the plane of the base.
pub fn truncated_cone(v: DVec3, h: DVec3, a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Result<Placed, String> {
    let (la, lb, lc, ld) = (a.length(), b.length(), c.length(), d.length());
    let alike = |p: f64, q: f64| (p - q).abs() <= ALIKE * p.max(q);
    let is_straight = alike(la, lc) && alike(lb, ld);
    // The end with area is the base: it becomes the unit circle. Where that is the top, the canonical solid is the mirror
    // image of what is wanted.
    let is_mirrored = !is_straight && la * lb < lc * ld;
    let (v, h, [a, b], [la, lb, lc, ld]) = match is_mirrored {
        false => (v, h, [a, b], [la, lb, lc, ld]),
        true => {
            let along = |own: DVec3, other: DVec3, length: f64| match own.try_normalize().or(other.try_normalize()) {
                Some(direction) => direction * length,
                None => DVec3::ZERO,
            };
            (v + h, -h, [along(c, a, lc), along(d, b, ld)], [lc, ld, la, lb])
        }
    };
    let (x, y) = (lc / la, ld / lb);
    let solid = if is_straight {
        Solid::Shape(Shape::Cylinder)
    } else if alike(x, y) {
        Solid::Shape(Shape::Cone { top: x, is_mirrored })
    } else {
        Solid::Taper { x, y, is_mirrored }
    };
    Placed::new(solid, a, b, h, v)
}

/// BRL-CAD's `epa`: base centre `v`, height `h` to the apex, the direction of the longer semi-axis, both semi-axes.
///
/// # Errors
/// Directions and lengths that span no volume.
pub fn elliptic_paraboloid(v: DVec3, h: DVec3, a: DVec3, r_1: f64, r_2: f64) -> Result<Placed, String> {
    let (x, y) = base(h, a, r_1, r_2)?;
    Placed::new(Solid::Round { profile: [1.0, -1.0, 0.0] }, x, y, h, v)
}

/// BRL-CAD's `ehy`: as [`elliptic_paraboloid`] with the distance `c` from the apex to the asymptotes' vertex.
///
/// # Errors
/// Directions and lengths that span no volume, `c` not above zero.
pub fn elliptic_hyperboloid(v: DVec3, h: DVec3, a: DVec3, r_1: f64, r_2: f64, c: f64) -> Result<Placed, String> {
    let (x, y) = base(h, a, r_1, r_2)?;
    Placed::new(Solid::Round { profile: hyperbola(h.length(), c)? }, x, y, h, v)
}

/// BRL-CAD's `rpc`: base rectangle centre `v`, height `h` to the apex line's plane end, breadth `b` (direction and depth
/// of the parabola), half-width `r`.
///
/// # Errors
/// Directions and lengths that span no volume.
pub fn parabolic_cylinder(v: DVec3, h: DVec3, b: DVec3, r: f64) -> Result<Placed, String> {
    trough(v, h, b, r, [1.0, -1.0, 0.0])
}

/// BRL-CAD's `rhc`: as [`parabolic_cylinder`] with the distance `c` from the apex to the asymptotes' vertex.
///
/// # Errors
/// Directions and lengths that span no volume, `c` not above zero.
pub fn hyperbolic_cylinder(v: DVec3, h: DVec3, b: DVec3, r: f64, c: f64) -> Result<Placed, String> {
    trough(v, h, b, r, hyperbola(b.length(), c)?)
}

/// BRL-CAD's `hyp`: a hyperboloid of one sheet: base centre `v`, height `h`, semi-axis `a` of the base, the length `b` of the
/// other one, and the waist's size relative to the base, 0 < `waist` < 1.
///
/// # Errors
/// Directions and lengths that span no volume, a waist out of range.
pub fn hyperboloid(v: DVec3, h: DVec3, a: DVec3, b: f64, waist: f64) -> Result<Placed, String> {
    if !(waist > 0.0 && waist < 1.0) {
        return Err(format!("its waist must be between 0 and 1, found {waist}"));
    }
    let (x, y) = base(h, a, a.length(), b)?;
    // g = w^2 + (1 - w^2) (2 z - 1)^2.
    let spread = 4.0 * (1.0 - waist * waist);
    Placed::new(Solid::Round { profile: [1.0, -spread, spread] }, x, y, h, v)
}

/// Two semi-axes in the base plane: `r_1` along `a`, `r_2` perpendicular to it and to `h`.
fn base(h: DVec3, a: DVec3, r_1: f64, r_2: f64) -> Result<(DVec3, DVec3), String> {
    let along = a.try_normalize().ok_or("its semi-axis has no direction")?;
    let across = h.cross(along).try_normalize().ok_or("its height lies along its semi-axis")?;
    Ok((along * r_1, across * r_2))
}

fn trough(v: DVec3, h: DVec3, b: DVec3, r: f64, profile: [f64; 3]) -> Result<Placed, String> {
    let side = h.cross(b).try_normalize().ok_or("its height lies along its breadth")?;
    // Canonical x runs over -1..1 along the height.
    Placed::new(Solid::Trough { profile }, h * 0.5, side * r, b, v + h * 0.5)
}

/// Profile of a hyperbola of depth `b` whose apex, at z = 1, is `c` before the vertex of its asymptotes: with
/// s = 1 - z the square of the half-width grows as (b s + c)^2 - c^2, scaled to 1 at s = 1.
fn hyperbola(b: f64, c: f64) -> Result<[f64; 3], String> {
    if !(c > 0.0 && b > 0.0) {
        return Err(format!("its depth and its distance to the asymptotes must be above zero, found {b} and {c}"));
    }
    let whole = b + 2.0 * c;
    // s (b s + 2 c) / (b + 2 c) with s = 1 - z.
    Ok([1.0, -2.0 * (b + c) / whole, b / whole])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mark that a cylinder does not have would turn its picture upside down.
    #[test]
    fn cones_that_are_hardly_any_are_cylinders_the_right_way_up() {
        for grown in [1.0, 1.0 + 1e-9, 1.0 - 1e-9] {
            let placed = cone(DVec3::ZERO, DVec3::Z * 2.0, 1.0, grown).unwrap();
            assert!(matches!(placed.solid, Solid::Shape(Shape::Cylinder)), "{grown}: {placed:?}");
            assert_eq!(placed.transform.transform_point3(DVec3::Z), DVec3::Z * 2.0);
        }
    }

    /// Points of the surface by its definition satisfy the canonical solid's equation.
    #[test]
    fn elliptic_tori_are_where_their_numbers_say() {
        let (v, n) = (DVec3::new(3.0, -1.0, 2.0), DVec3::new(1.0, 2.0, -0.5).normalize());
        let (x, y) = n.any_orthonormal_pair();
        for (out, up, second) in
            [(1.5, 0.5, 0.75), (0.5, -1.5, 1.0), (-0.25, 1.0, 1.25), (2.0, 0.0, 0.5), (0.0, 1.0, 3.0)]
        {
            let placed = elliptic_torus(v, 7.0 * n, 4.0, [out, up], second).unwrap();
            let (reach, lean) = match placed.solid {
                Solid::EllipticTorus { reach, lean } => (reach, lean),
                Solid::Torus { minor } => (minor, 0.0),
                other => panic!("{other:?}"),
            };
            let first = f64::hypot(out, up);
            let back = placed.transform.inverse();
            for i in 0..400 {
                let (about, within) = (0.1 * f64::from(i), 0.37 * f64::from(i));
                let (a, b) = (within.cos(), second / first * within.sin());
                let (along, height) = (4.0 + out * a - up * b, up * a + out * b);
                let p = back.transform_point3(v + (x * about.cos() + y * about.sin()) * along + n * height);
                let u = p.x.hypot(p.y) - 1.0;
                let form = u * u - 2.0 * lean * u * p.z + p.z * p.z;
                let whole = (1.0 - lean * lean) * reach * reach;
                assert!((form / whole - 1.0).abs() < 1e-12, "{out} {up} {second}: {p}");
            }
        }
        assert!(elliptic_torus(v, n, 4.0, [0.0, 0.0], 1.0).is_err());
        assert!(elliptic_torus(v, n, 4.0, [1.0, 0.0], 0.0).is_err());
        assert!(elliptic_torus(v, DVec3::ZERO, 4.0, [1.0, 0.0], 1.0).is_err());
    }
}
