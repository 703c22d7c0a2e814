//! The canonical tapered solid: from the unit circle at z = 0 to an ellipse at z = 1 whose semi-axes change linearly.
//! With unequal tapers its side is a quartic that is not convex.

use glam::DVec3;

use super::quartic;
use super::span::{Span, nearest_to_origin};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each};

/// How much wider than the solid the interval is in which roots are looked for.
const ROOM: f64 = 1.0 / 256.0;

/// A product of two linear functions: coefficients of 1, s, s^2.
#[inline(always)]
fn product<V: Lanes>(a: [V; 2], b: [V; 2]) -> [V; 3] {
    [a[0] * b[0], a[0].mul_add(b[1], a[1] * b[0]), a[1] * b[1]]
}

/// The square of a quadratic.
#[inline(always)]
fn square<V: Lanes>(q: [V; 3]) -> [V; 5] {
    let two = V::constant(2.0);
    let twice = q.map(|x| two * x);
    [q[0] * q[0], twice[0] * q[1], twice[0].mul_add(q[2], q[1] * q[1]), twice[1] * q[2], q[2] * q[2]]
}

/// Spans of lines inside; `x`, `y`: semi-axes at z = 1. Faces: 0 side, 1 the end z = 0, 2 the end z = 1.
#[inline(always)]
pub fn taper<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, [x, y]: [V::Scalar; 2], mut emit: impl FnMut(Span<V>)) {
    let (o, shift) = nearest_to_origin(o, d);
    let mut within = Span::unit_slab(o[2], d[2]);
    for (axis, top) in [(0, x), (1, y)] {
        let wide = V::splat(S::<V>::ONE.fast_max(top)) * V::constant(1.0 + ROOM);
        within = within.intersect(&Span::slab(o[axis], d[axis], [-wide, wide], [0.0, 0.0]));
    }
    if !within.hit.any() {
        return;
    }
    let half = V::constant(0.5);
    let (middle, reach) = (half * (within.t_in + within.t_out), half * (within.t_out - within.t_in));
    let at = each(|a| d[a].mul_add(middle, o[a]));
    let d = d.map(|c| c * reach);
    let one = V::constant(1.0);
    let radius = |top: V::Scalar| {
        let change = V::splat(top) - one;
        [change.mul_add(at[2], one), change * d[2]]
    };
    let (a, b) = (radius(x), radius(y));
    // x^2 b^2 + y^2 a^2 - a^2 b^2.
    let (u, v, w) = (square(product([at[0], d[0]], b)), square(product([at[1], d[1]], a)), square(product(a, b)));
    let p = [0, 1, 2, 3, 4].map(|k| u[k] + v[k] - w[k]);
    let zero = V::constant(0.0);
    quartic::spans(&p, false, |lanes, s_in, s_out| {
        let (low, high) = (s_in.cmp_le(-one), one.cmp_le(s_out));
        let t = |s: V| reach.mul_add(s, middle);
        let (t_in, t_out) = (V::select(low, within.t_in, t(s_in)), V::select(high, within.t_out, t(s_out)));
        let (face_in, face_out) = (V::select(low, within.face_in, zero), V::select(high, within.face_out, zero));
        emit(Span { hit: lanes & within.hit, t_in: t_in + shift, t_out: t_out + shift, face_in, face_out });
    });
}

/// The scalar of a vector.
type S<V> = <V as Lanes>::Scalar;

/// Outward normal (not unit) at a point of a face.
pub fn taper_normal(p: DVec3, face: u32, tops: [f64; 2]) -> DVec3 {
    match face {
        1 => DVec3::NEG_Z,
        2 => DVec3::Z,
        _ => DVec3::from(taper_side_normal(p.to_array(), tops)),
    }
}

/// Outward normals (not unit) at points of the side.
#[inline(always)]
pub fn taper_side_normal<V: Lanes>([x, y, z]: Lanes3<V>, tops: [f64; 2]) -> Lanes3<V> {
    let (one, [kx, ky]) = (V::constant(1.0), tops.map(|top| V::constant(top - 1.0)));
    let (a, b) = (kx.mul_add(z, one), ky.mul_add(z, one));
    // Gradient of x^2 b^2 + y^2 a^2 - a^2 b^2, halved.
    let dz = (x * x * b).mul_add(ky, y * y * a * kx) - a * b * kx.mul_add(b, ky * a);
    [x * b * b, y * a * a, dz]
}
