//! Where rays that leave a surface start, so that they do not hit that surface again, and where rays to one end.
//!
//! Source: the error-bound offset of M. Pharr, W. Jakob, G. Humphreys, *Physically Based Rendering*, 4th edition,
//! section 6.8 ("Managing Rounding Error", `OffsetRayOrigin`). It was chosen over the integer offset of C. Wächter
//! and N. Binder (*Ray Tracing Gems*, chapter 6) because it holds for f64 as for f32 and scales with what was
//! really rounded: the ray, the hit point and the primitive's own coordinates.

use glam::DVec3;

use crate::lanes::{Lanes, Lanes3, Real};

/// Roundings of the ray (origin, direction, t) between the true hit and ours, in units of S::EPSILON.
pub(super) const RAY_ROUNDINGS: f64 = 16.0;
/// Roundings of the primitive: its vertices, and their differences to the origin. A triangle that is large against
/// its distance from the eye puts its rounding errors next to the eye. (tests/render/offsets.rs: 2 leave one hit in
/// 100 behind a surface, 4 one in 10^5.)
pub(super) const PRIMITIVE_ROUNDINGS: f64 = 8.0;
/// The same with those of a point that is chosen on it.
const CHOSEN_ROUNDINGS: f64 = 14.0;

/// Bound of the error of a hit point, per axis, scene units: `position` = `org + t dir` was found in precision `S`
/// from a primitive whose coordinates reach `magnitude` (not negative). (gamma_n of Higham's analysis times what was
/// added.)
pub fn position_error<S: Real>(org: DVec3, dir: DVec3, t: f64, position: DVec3, magnitude: DVec3) -> DVec3 {
    let of_ray = gamma::<S>(RAY_ROUNDINGS);
    of_ray * (position.abs() + org.abs() + (dir * t).abs()) + gamma::<S>(PRIMITIVE_ROUNDINGS) * magnitude
}

/// Bound of the relative error of `n` roundings in precision `S`.
pub fn gamma<S: Real>(n: f64) -> f64 {
    let n_eps = n * S::EPSILON.to_f64();
    n_eps / (1.0 - n_eps)
}

/// The part of [`end_error`] that only depends on the primitive, whose coordinates are a vector of length `magnitude`
/// at most.
pub fn chosen_error<S: Real>(magnitude: f64) -> f64 {
    gamma::<S>(CHOSEN_ROUNDINGS) * magnitude
}

/// How far off a surface, along its unit normal `normal`, rays in precision `S` from near `from` to the point `to` of it
/// must end so as not to meet it. A bound that knows the distance only would not do: what is rounded are the
/// coordinates, which may be large against it. `chosen`: see [`chosen_error`].
#[inline(always)]
pub fn end_error<S: Real, V: Lanes>(from: Lanes3<V>, to: Lanes3<V>, normal: Lanes3<V>, chosen: V) -> V {
    // The distance is no longer than both positions together; two more for these themselves.
    let of_ray = V::constant(gamma::<S>(2.0 * RAY_ROUNDINGS + 2.0));
    let along = |i: usize| normal[i].abs() * (from[i].abs() + to[i].abs());
    of_ray.mul_add(along(0) + along(1) + along(2), chosen)
}

/// Origin in precision `S` of a ray that leaves `position` to the side that the unit normal `normal` points to:
/// moved along the normal out of the box of half size `error` around `position`, and rounded away from the surface.
pub fn offset_origin<S: Real>(position: DVec3, error: DVec3, normal: DVec3) -> [S; 3] {
    let offset = normal * normal.abs().dot(error);
    let moved = position + offset;
    [0, 1, 2].map(|axis| {
        let rounded = S::from_f64(moved[axis]);
        if offset[axis] > 0.0 && rounded.to_f64() < moved[axis] {
            rounded.next_up()
        } else if offset[axis] < 0.0 && rounded.to_f64() > moved[axis] {
            rounded.next_down()
        } else {
            rounded
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::sampling::PixelRandom;

    /// A point anywhere within the error box, and the plane through the true point: the origin must be in front.
    fn origins_lie_in_front<S: Real>() {
        for k in 0..2000 {
            let random = PixelRandom::new(k, 0, 1);
            let point = |d: u32| {
                let ([a, b], [c, e]) = (random.pair(0, d), random.pair(1, d));
                (DVec3::new(a, b, c) * 2.0 - 1.0) * 10f64.powf(e * 8.0 - 4.0)
            };
            let (position, normal) = (point(0), point(1).normalize());
            let error = position_error::<S>(point(2), position, 1.0, position, point(4).abs());
            let signs = DVec3::new(1.0, 1.0, 1.0).copysign(point(3));
            let found = position + error * signs * 0.9;
            let org = offset_origin::<S>(found, error, normal);
            let height = (DVec3::from(org.map(S::to_f64)) - position).dot(normal);
            assert!(height >= 0.0, "{position} {normal}: {height}");
            let reach = (DVec3::from(org.map(S::to_f64)) - found).length();
            assert!(reach <= 2.0 * error.length() + 4.0 * S::EPSILON.to_f64() * found.length());
        }
    }

    #[test]
    fn origins_are_in_front_of_the_true_surface_and_near_it() {
        origins_lie_in_front::<f32>();
        origins_lie_in_front::<f64>();
    }

    #[test]
    fn the_error_bound_grows_with_position_and_distance_and_shrinks_with_precision() {
        let x = DVec3::X;
        let near = position_error::<f32>(DVec3::ZERO, x, 1.0, x, x * 3.0);
        // 16 roundings of 2^-24 on |p| + |t d| = 2, 8 on 3.
        assert!((near.x - 56.0 * 2f64.powi(-24)).abs() < 1e-11 && near.y == 0.0);
        let far = position_error::<f32>(DVec3::ZERO, x, 1e3, x * 1e3, x * 3e3);
        assert!((far.x / near.x - 1e3).abs() < 1e-9);
        assert!(position_error::<f64>(DVec3::ZERO, x, 1.0, x, x).x < near.x * 1e-8);
    }
}
