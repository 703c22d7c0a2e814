//! The default camera of files that bring none.

use glam::DVec3;

use super::model::unit;
use crate::scene::description::{CameraDescription, Projection};

/// Vertical field of view, radians (40 degrees).
const THETA: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Space left around the scene.
const MARGIN: f64 = 1.05;
/// Largest coordinate worked with, so that no sum overflows.
const LARGEST: f64 = 1e300;
/// A scene smaller than this fraction of its distance from the origin is framed as if it had that size: nearer,
/// eye and look-at would round to the same point in f32.
const LEAST_EXTENT: f64 = 1e-5;

/// A perspective camera with y up that looks at the box `bounds` (lower and upper corner) from the front, right and
/// above, as near as all eight corners are visible in a picture of `aspect` = width / height.
///
/// Works for any input: no bounds or non-finite ones frame the unit box, flat and empty boxes get a size.
pub fn framing(bounds: Option<(DVec3, DVec3)>, aspect: f64) -> CameraDescription {
    let (lo, hi) = match bounds {
        Some((lo, hi)) if lo.is_finite() && hi.is_finite() => {
            let (limit_lo, limit_hi) = (DVec3::splat(-LARGEST), DVec3::splat(LARGEST));
            (lo.min(hi).clamp(limit_lo, limit_hi), hi.max(lo).clamp(limit_lo, limit_hi))
        }
        _ => (DVec3::splat(-0.5), DVec3::splat(0.5)),
    };
    let centre = lo * 0.5 + hi * 0.5;
    let half = hi * 0.5 - lo * 0.5;
    let mut size = half.max_element().max(centre.abs().max_element() * LEAST_EXTENT);
    if size == 0.0 {
        size = 1.0;
    }
    let n = DVec3::new(0.45, 0.4, 0.8).normalize();
    let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
    let distance = distance_to_see(half / size, n, aspect).max(1.0) * MARGIN;
    CameraDescription {
        name: "default".into(),
        eye: centre + n * distance * size,
        look_at: centre,
        up: DVec3::Y,
        projection: Projection::Perspective { theta: THETA },
    }
}

/// How far from the centre of a box with half size `half` the eye must be, along `n`, to see all its corners.
fn distance_to_see(half: DVec3, n: DVec3, aspect: f64) -> f64 {
    let u = unit(DVec3::Y.cross(n)).unwrap_or(DVec3::X);
    let v = n.cross(u);
    let half_height = (THETA * 0.5).tan();
    let half_width = half_height * aspect;
    (0..8)
        .map(|corner| {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let p = half * DVec3::new(sign(0), sign(1), sign(2));
            // Visible iff |p.u| <= half_width * (distance - p.n), and the same for v.
            p.dot(n) + (p.dot(u).abs() / half_width).max(p.dot(v).abs() / half_height)
        })
        .fold(0.0, f64::max)
}
