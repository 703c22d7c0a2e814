//! The sphere flake: a sphere with nine spheres of a third of its radius on it, and so on.
//!
//! Source: E. Haines, "A Proposal for Standard Graphics Environments", IEEE CG&A 7(11), 1987 (`balls`); six
//! children stand around the equator, three above, so that none meets its parent's parent.

use glam::{DAffine3, DMat3, DVec3};

use super::expression::sin_degrees;
use super::transform::frame_along;

/// Deepest flake: 597 871 spheres.
pub const MAX_DEPTH: u32 = 6;

/// Number of spheres of a flake: 1 + 9 + ... + 9^depth.
pub fn count(depth: u32) -> u64 {
    (9_u64.pow(depth + 1) - 1) / 8
}

/// Calls `place` for each sphere of the flake around a unit sphere whose top is +y, parents before children.
pub fn spheres(depth: u32, place: &mut dyn FnMut(DAffine3)) {
    child(DVec3::ZERO, DVec3::Y, 1.0, depth, place);
}

fn child(center: DVec3, top: DVec3, radius: f64, depth: u32, place: &mut dyn FnMut(DAffine3)) {
    let size = DMat3::from_diagonal(DVec3::splat(radius));
    place(DAffine3::from_mat3_translation(size, center));
    if depth == 0 {
        return;
    }
    let frame = frame_along(top);
    for i in 0..9 {
        let (azimuth, elevation) = if i < 6 { (60.0 * f64::from(i), 0.0) } else { (120.0 * f64::from(i) + 30.0, 54.0) };
        let ring = sin_degrees(elevation + 90.0);
        let local = DVec3::new(ring * sin_degrees(azimuth + 90.0), ring * sin_degrees(azimuth), sin_degrees(elevation));
        let outward = (frame * local).normalize();
        child(center + outward * (radius * 4.0 / 3.0), outward, radius / 3.0, depth - 1, place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_touch_their_parent_and_not_each_other() {
        let mut spheres_seen = Vec::new();
        spheres(2, &mut |t| spheres_seen.push((t.translation, t.matrix3.x_axis.x)));
        assert_eq!(spheres_seen.len() as u64, count(2));
        assert_eq!(count(2), 91);
        let (first, children): (_, Vec<_>) = (spheres_seen[0], spheres_seen.iter().skip(1).step_by(10).collect());
        assert_eq!(first, (DVec3::ZERO, 1.0));
        for (i, a) in children.iter().enumerate() {
            assert!((a.0.length() - 4.0 / 3.0).abs() < 1e-12 && (a.1 - 1.0 / 3.0).abs() < 1e-15);
            for b in &children[i + 1..] {
                assert!(a.0.distance(b.0) > a.1 + b.1 - 1e-12, "{a:?} {b:?}");
            }
        }
    }
}
