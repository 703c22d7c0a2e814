//! Texture coordinates of shapes, by what is natural to each: u runs to the right and v up on a surface seen from
//! outside with its axis, local z, upright.
//!
//! Round sides: u is the angle about the axis from local x, as a share of a turn, 0 up to 1; v is what the shape says.
//! Flat faces: the two other coordinates, 0..1 over the box [-1, 1] of the canonical shape.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::description::Shape;
use crate::scene::mesh::Mesh;
use crate::scene::solids::Solid;

/// Coordinates of a canonical shape at `point` of the face whose outward normal (not unit) is `normal`, both local.
///
/// Sphere: v is the latitude, 0 at the south pole (local -z), 1 at the north pole. Cylinder and cone: v is z, 0 at the
/// base; ends are flat faces. Of a cone that is a mirror image they are those of the original. Half-space: x and y as
/// they are.
pub fn of_shape(shape: &Shape, point: DVec3, normal: DVec3) -> [f64; 2] {
    match shape {
        Shape::Sphere => {
            let up = point.z.atan2(point.x.hypot(point.y));
            [turn(point.x, point.y), 0.5 + up / PI]
        }
        Shape::HalfSpace => [point.x, point.y],
        Shape::Disc | Shape::Cuboid => flat(point, normal),
        Shape::Cylinder => side(point, normal, [point.x, point.y]),
        Shape::Cone { is_mirrored, .. } => tapered(point, normal, [point.x, point.y], *is_mirrored),
    }
}

/// The same of a solid.
///
/// Torus: v is the angle about the middle of its tube, 0 on the outermost circle. Other round solids: as cylinders.
/// What has flat or drawn-out faces: as boxes, by the axis their normal is closest to; meshes: their own coordinates if
/// they have any. `face` numbers the triangle of a mesh.
pub fn of_solid(solid: &Solid, point: DVec3, normal: DVec3, face: u32) -> [f64; 2] {
    match solid {
        Solid::Shape(shape) => of_shape(shape, point, normal),
        Solid::Torus { .. } | Solid::EllipticTorus { .. } => {
            let out = point.x.hypot(point.y) - 1.0;
            [turn(point.x, point.y), turn(out, point.z)]
        }
        Solid::Taper { x, y, is_mirrored } => {
            // The angle of the circle that the ellipse at this height comes from.
            let [a, b] = [x, y].map(|end| (1.0 + (end - 1.0) * point.z).max(1e-300));
            tapered(point, normal, [point.x / a, point.y / b], *is_mirrored)
        }
        Solid::Round { .. } => side(point, normal, [point.x, point.y]),
        Solid::Trough { .. } | Solid::Polyhedron(_) => flat(point, normal),
        Solid::Mesh(mesh) => on_mesh(mesh, face as usize, point).unwrap_or_else(|| flat(point, normal)),
    }
}

/// The angle of (x, y), as a share of a turn in [0, 1).
fn turn(x: f64, y: f64) -> f64 {
    let share = y.atan2(x) / TAU;
    // The least angles below a whole turn round to it.
    if share < 0.0 { (share + 1.0).min(1.0f64.next_down()) } else { share }
}

/// A round side with flat ends.
fn side(point: DVec3, normal: DVec3, [x, y]: [f64; 2]) -> [f64; 2] {
    if normal.x == 0.0 && normal.y == 0.0 { flat(point, normal) } else { [turn(x, y), point.z] }
}

/// What narrows upwards, or is the mirror image of what widens.
fn tapered(point: DVec3, normal: DVec3, circle: [f64; 2], is_mirrored: bool) -> [f64; 2] {
    if !is_mirrored {
        return side(point, normal, circle);
    }
    // Mirrored back; its round side faces outwards as before.
    side(DVec3::new(point.x, point.y, 1.0 - point.z), DVec3::new(normal.x, normal.y, -normal.z), circle)
}

/// A flat face, by the axis its normal is closest to: of equal ones the last.
fn flat(p: DVec3, normal: DVec3) -> [f64; 2] {
    let n = normal.abs();
    let signed = |x: f64, positive: bool| if positive { x } else { -x };
    let (right, up) = if n.z >= n.x && n.z >= n.y {
        (signed(p.x, normal.z >= 0.0), p.y)
    } else if n.y >= n.x {
        (signed(p.x, normal.y < 0.0), p.z)
    } else {
        (signed(p.y, normal.x >= 0.0), p.z)
    };
    [0.5 + 0.5 * right, 0.5 + 0.5 * up]
}

/// At `point` of triangle `index`, by areas.
fn on_mesh(mesh: &Mesh, index: usize, point: DVec3) -> Option<[f64; 2]> {
    let vertices = *mesh.triangles.get(index)?;
    let uvs = mesh.uvs[0].corners(index, vertices)?;
    let [a, b, c] = mesh.corners(index);
    let ng = (b - a).cross(c - a);
    let area = ng.length_squared();
    if area == 0.0 {
        return None;
    }
    let part = |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(ng) / area;
    let weights = [part(b, c), part(c, a), part(a, b)];
    let [u, down] = [0, 1].map(|k| (0..3).map(|i| weights[i] * f64::from(uvs[i][k])).sum::<f64>());
    Some([u, 1.0 - down])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::Attribute;
    use crate::scene::world::solids::{shape_normal, solid_normal};

    fn near(a: [f64; 2], b: [f64; 2]) {
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "{a:?} {b:?}");
    }

    fn shape(shape: Shape, point: [f64; 3], face: u32) -> [f64; 2] {
        let point = DVec3::from(point);
        of_shape(&shape, point, shape_normal(&shape, point, face))
    }

    #[test]
    fn spheres_have_longitude_and_latitude() {
        let half = 0.5f64.sqrt();
        near(shape(Shape::Sphere, [1.0, 0.0, 0.0], 0), [0.0, 0.5]);
        near(shape(Shape::Sphere, [0.0, 1.0, 0.0], 0), [0.25, 0.5]);
        near(shape(Shape::Sphere, [-half, 0.0, half], 0), [0.5, 0.75]);
        near(shape(Shape::Sphere, [0.0, -half, -half], 0), [0.75, 0.25]);
        assert_eq!(
            [shape(Shape::Sphere, [0.0, 0.0, 1.0], 0)[1], shape(Shape::Sphere, [0.0, 0.0, -1.0], 0)[1]],
            [1.0, 0.0]
        );
    }

    /// A picture that repeats has no seam: on both sides of it u is next to a whole number.
    #[test]
    fn seams_join() {
        for kind in [Shape::Sphere, Shape::Cylinder, Shape::cone(0.5)] {
            let at = |y: f64| shape(kind, [0.8, y, 0.5], 0);
            let ([above, v], [below, w]) = (at(1e-9), at(-1e-9));
            assert!((0.0..1e-8).contains(&above) && (1.0 - 1e-8..1.0).contains(&below), "{above} {below}");
            assert!((v - w).abs() < 1e-12);
        }
        assert!(turn(1.0, -1e-300) < 1.0);
        let torus = |z: f64| of_solid(&Solid::Torus { minor: 0.5 }, DVec3::new(1.5, 0.0, z), DVec3::X, 0)[1];
        assert!(torus(1e-9) < 1e-8 && torus(-1e-9) > 1.0 - 1e-8);
    }

    #[test]
    fn round_sides_unroll_and_their_ends_are_flat() {
        let tall = Shape::cone(0.25);
        for (kind, x) in [(Shape::Cylinder, 1.0), (tall, 0.625)] {
            let point = DVec3::new(0.0, -x, 0.5);
            near(of_shape(&kind, point, DVec3::new(0.0, -1.0, 0.1)), [0.75, 0.5]);
            near(of_shape(&kind, DVec3::new(0.2, 0.1, 1.0), DVec3::Z), [0.6, 0.55]);
            near(of_shape(&kind, DVec3::new(0.2, 0.1, 0.0), -DVec3::Z), [0.4, 0.55]);
        }
        // The mirror image of a funnel: the end at z = 0 was its upper one.
        let funnel = Shape::Cone { top: 0.25, is_mirrored: true };
        near(of_shape(&funnel, DVec3::new(0.0, -0.8125, 0.25), DVec3::new(0.0, -1.0, 0.1)), [0.75, 0.75]);
        near(of_shape(&funnel, DVec3::new(0.2, 0.1, 0.0), -DVec3::Z), [0.6, 0.55]);
        near(of_shape(&funnel, DVec3::new(0.2, 0.1, 1.0), DVec3::Z), [0.4, 0.55]);
        let taper = Solid::Taper { x: 0.5, y: 0.25, is_mirrored: false };
        let point = DVec3::new(0.5 * 0.5f64.sqrt(), 0.25 * 0.5f64.sqrt(), 1.0);
        near(of_solid(&taper, point, DVec3::X, 0), [0.125, 1.0]);
        near(of_solid(&Solid::Torus { minor: 0.5 }, DVec3::new(0.0, 1.0, 0.5), DVec3::Z, 0), [0.25, 0.25]);
        near(of_solid(&Solid::Torus { minor: 0.5 }, DVec3::new(-0.5, 0.0, 0.0), DVec3::X, 0), [0.5, 0.5]);
    }

    /// Seen from outside, z up, u goes to the right and v up: both with the normal make a right-handed system.
    #[test]
    fn faces_of_boxes_are_not_mirrored() {
        for face in 0..6 {
            let n = shape_normal(&Shape::Cuboid, DVec3::ZERO, face);
            let at = |p: DVec3| glam::DVec2::from(of_shape(&Shape::Cuboid, p, n));
            let grows = |k: usize| DVec3::from([0, 1, 2].map(|axis| at(DVec3::AXES[axis])[k] - at(DVec3::ZERO)[k]));
            assert_eq!(grows(0).cross(grows(1)) * 4.0, n, "face {face}");
            assert_eq!(at(n), glam::DVec2::splat(0.5));
        }
        near(shape(Shape::Disc, [0.5, -0.5, 0.0], 0), [0.75, 0.25]);
        near(shape(Shape::HalfSpace, [3.5, -0.5, 0.0], 0), [3.5, -0.5]);
    }

    #[test]
    fn meshes_in_solids_keep_their_own() {
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0];
        let mut mesh = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let point = DVec3::new(0.5, 1.0, 0.0);
        let of = |mesh: &Mesh| {
            let solid = Solid::Mesh(std::sync::Arc::new(mesh.clone()));
            of_solid(&solid, point, solid_normal(&solid, point, 0), 0)
        };
        near(of(&mesh), [0.75, 1.0]);
        mesh.uvs[0] = Attribute { values: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 4.0]], ..Attribute::default() };
        // Those of meshes point down.
        near(of(&mesh), [0.25, -1.0]);
    }
}
