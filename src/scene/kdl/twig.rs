//! A twig: a thin stem along +y with leaves in the spiral of the golden angle.
//!
//! Source of the arrangement: H. Vogel, "A Better Way to Construct the Sunflower Head", Mathematical Biosciences
//! 44, 1979 (137.508 degrees between neighbours).

use glam::DVec3;

use super::expression::sin_degrees;
use super::hash::{mix3, unit};
use crate::scene::mesh::Mesh;

/// Degrees between successive leaves.
const GOLDEN_ANGLE: f64 = 137.507_764_050_037_85;
/// Sides of the stem.
const SIDES: u32 = 5;
/// Radius of the stem at its base; it ends in a point.
const STEM_RADIUS: f64 = 0.015;

/// Triangles of a twig with `leaves` leaves.
pub fn triangle_count(leaves: u32) -> u64 {
    u64::from(SIDES) + 4 * u64::from(leaves)
}

/// A twig of length 1 from the origin along +y with `leaves` leaves of four triangles, folded along their midrib.
pub fn twig(leaves: u32, seed: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..SIDES {
        let degrees = 360.0 / f64::from(SIDES) * f64::from(i);
        mesh.positions.push(around(degrees) * STEM_RADIUS);
    }
    mesh.positions.push(DVec3::Y);
    mesh.triangles.extend((0..SIDES).map(|i| [i, SIDES, (i + 1) % SIDES]));
    for i in 0..leaves {
        let random = |k| unit(mix3(i, k, seed));
        let along = 0.12 + 0.88 * (f64::from(i) + random(0)) / f64::from(leaves);
        let outward = around(GOLDEN_ANGLE * f64::from(i) + 30.0 * random(1));
        let rise = 0.25 + 0.9 * along + 0.3 * random(2);
        let length = (0.34 - 0.16 * along) * (0.8 + 0.4 * random(3));
        leaf(&mut mesh, DVec3::Y * along, (outward + DVec3::Y * rise).normalize() * length, outward);
    }
    mesh
}

/// A leaf from `foot` along `spine`, as wide as 0.4 of its length.
fn leaf(mesh: &mut Mesh, foot: DVec3, spine: DVec3, outward: DVec3) {
    let side = DVec3::Y.cross(outward).normalize() * (0.2 * spine.length());
    let lift = side.cross(spine).normalize() * (0.06 * spine.length());
    let waist = foot + spine * 0.45;
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([foot, waist + side + lift, waist - side + lift, waist, foot + spine]);
    mesh.triangles.extend([[0, 1, 3], [3, 1, 4], [0, 3, 2], [3, 4, 2]].map(|t| t.map(|v| first + v)));
}

/// The unit vector at `degrees` around +y.
fn around(degrees: f64) -> DVec3 {
    DVec3::new(sin_degrees(degrees + 90.0), 0.0, -sin_degrees(degrees))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twig_has_sound_triangles_within_its_reach() {
        let mesh = twig(50, 3);
        assert_eq!(mesh.triangles.len() as u64, triangle_count(50));
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(i);
            assert!((b - a).cross(c - a).length() > 1e-6, "triangle {i}");
        }
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.y >= 0.0 && high.y < 1.5 && low.x > -0.5 && high.x < 0.5, "{low} {high}");
    }
}
