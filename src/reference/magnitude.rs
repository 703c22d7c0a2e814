//! Bounds on the coordinates that arise when a point is mapped: rounding errors are in proportion to them.

use glam::{DAffine3, DMat3, DVec3};

/// `|M| a` for a vector with components of at most `a`.
pub(super) fn vector(map: &DAffine3, a: DVec3) -> DVec3 {
    let m = map.matrix3;
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs()) * a
}

/// `|M| a + |T|` for a point with components of at most `a`.
pub(super) fn point(map: &DAffine3, a: DVec3) -> DVec3 {
    vector(map, a) + map.translation.abs()
}

/// `|M^-1| (a + |T|)`: the same on the way back through `map`, whose inverse is `inverse`. The translation is
/// counted before the product, where it is rounded.
pub(super) fn point_back(map: &DAffine3, inverse: &DAffine3, a: DVec3) -> DVec3 {
    vector(inverse, a + map.translation.abs())
}

/// Largest factor by which a distance grows through `map`, in the maximum norm.
pub(super) fn norm(map: &DAffine3) -> f64 {
    vector(map, DVec3::ONE).max_element()
}
