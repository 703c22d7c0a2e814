//! Quadrics cut by slabs: paraboloids and hyperboloids with flat ends, round about the z axis or drawn out along x
//! (Cychosz, Waggenspack, "Intersecting a ray with a quadric surface", Graphics Gems III, 1992, with the stable quadratic
//! of Press et al., Numerical Recipes). Up to two spans: hyperboloids have a waist.
//!
//! Faces: 0 the curved side, 1 the end z = 0, 2 the end z = 1; of the drawn-out ones 3 the end x = -1, 4 the end x = 1.

use glam::DVec3;

use super::span::{Span, infinite, nearest_to_origin};
use crate::lanes::{LaneMask, Lanes, Lanes3};

/// Spans of lines inside x^2 + y^2 <= g(z), 0 <= z <= 1; g by its coefficients of 1, z, z^2.
#[inline(always)]
pub fn round<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, g: [V::Scalar; 3], mut emit: impl FnMut(Span<V>)) {
    let (o, shift) = nearest_to_origin(o, d);
    let ends = Span::unit_slab(o[2], d[2]);
    let squares = [d[0].mul_add(d[0], d[1] * d[1]), o[0].mul_add(d[0], o[1] * d[1]), o[0].mul_add(o[0], o[1] * o[1])];
    pieces(squares, o[2], d[2], g, |side| emit(side.intersect(&ends).shifted(shift)));
}

/// Spans of lines inside y^2 <= g(z), |x| <= 1, 0 <= z <= 1.
#[inline(always)]
pub fn trough<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, g: [V::Scalar; 3], mut emit: impl FnMut(Span<V>)) {
    let (o, shift) = nearest_to_origin(o, d);
    let sides = Span::slab(o[0], d[0], [V::constant(-1.0), V::constant(1.0)], [3.0, 4.0]);
    let ends = Span::unit_slab(o[2], d[2]).intersect(&sides);
    let squares = [d[1] * d[1], o[1] * d[1], o[1] * o[1]];
    pieces(squares, o[2], d[2], g, |side| emit(side.intersect(&ends).shifted(shift)));
}

/// Spans where the square of the distance to the axis, `squares` = (d^2, o d, o^2), is at most g(z).
#[inline(always)]
fn pieces<V: Lanes>(squares: [V; 3], oz: V, dz: V, g: [V::Scalar; 3], mut emit: impl FnMut(Span<V>)) {
    let zero = V::constant(0.0);
    let [g0, g1, g2] = g.map(V::splat);
    // f(t) = a t^2 + 2 b t + c <= 0.
    let a = squares[0] - g2 * (dz * dz) + zero;
    let b = squares[1] - V::constant(0.5) * (g1 * dz) - g2 * (oz * dz);
    let c = squares[2] - g2.mul_add(oz, g1).mul_add(oz, g0);
    let disc = b.mul_add(b, -(a * c));
    let root = disc.fast_max(zero).sqrt();
    let q = V::select(b.cmp_lt(zero), root - b, -(b + root));
    // Without a square and a slope, f is c for ever.
    let level = a.cmp_eq(zero) & b.cmp_eq(zero);
    let crossed = zero.cmp_lt(disc) & !level;
    let (r0, r1) = (q / a, c / q);
    let (first, second) = (r0.fast_min(r1), r0.fast_max(r1));
    let (opens, forever) = (a.cmp_lt(zero), -infinite::<V>());
    let outside = opens & crossed;
    // Rounding aside: where nothing is crossed, all of the line is inside or nothing.
    let whole = !crossed & V::select(level, c, a).cmp_le(zero) & (opens | level);
    let t_in = V::select(whole | outside, forever, first);
    let t_out = V::select(whole, infinite(), V::select(outside, first, second));
    emit(Span::plain(crossed | whole, t_in, t_out));
    if outside.any() {
        emit(Span::plain(outside, second, infinite()));
    }
}

/// Outward normal (not unit) of the round solid at a point of a face.
pub fn round_normal(p: DVec3, face: u32, g: [f64; 3]) -> DVec3 {
    match face {
        1 => DVec3::NEG_Z,
        2 => DVec3::Z,
        _ => DVec3::new(p.x, p.y, -0.5 * g[1] - g[2] * p.z),
    }
}

/// Outward normal (not unit) of the drawn-out solid at a point of a face.
pub fn trough_normal(p: DVec3, face: u32, g: [f64; 3]) -> DVec3 {
    match face {
        1 => DVec3::NEG_Z,
        2 => DVec3::Z,
        3 => DVec3::NEG_X,
        4 => DVec3::X,
        _ => DVec3::new(0.0, p.y, -0.5 * g[1] - g[2] * p.z),
    }
}
