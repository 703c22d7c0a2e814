//! Quadrics cut by slabs: paraboloids and hyperboloids with flat ends, round about the z axis or drawn out along x
//! (Cychosz, Waggenspack, "Intersecting a ray with a quadric surface", Graphics Gems III, 1992, with the stable quadratic
//! of Press et al., Numerical Recipes). Up to two spans: hyperboloids have a waist.
//!
//! Faces: 0 the curved side, 1 the end z = 0, 2 the end z = 1; of the drawn-out ones 3 the end x = -1, 4 the end x = 1.

use glam::DVec3;

use super::span::{Span, infinite, nearest_to_vertex};
use crate::lanes::{LaneMask, Lanes, Lanes3};

/// Spans of lines inside x^2 + y^2 <= g(z), 0 <= z <= 1; g by its coefficients of 1, z, z^2.
#[inline(always)]
pub fn round<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, g: [V::Scalar; 3], emit: impl FnMut(Span<V>)) {
    let product = |p: Lanes3<V>, q: Lanes3<V>| p[0].mul_add(q[0], p[1] * q[1]);
    pieces(o, d, g, product, |o| Span::unit_slab(o[2], d[2]), emit);
}

/// Spans of lines inside y^2 <= g(z), |x| <= 1, 0 <= z <= 1.
#[inline(always)]
pub fn trough<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, g: [V::Scalar; 3], emit: impl FnMut(Span<V>)) {
    let ends = |o: Lanes3<V>| {
        let sides = Span::slab(o[0], d[0], [V::constant(-1.0), V::constant(1.0)], [3.0, 4.0]);
        Span::unit_slab(o[2], d[2]).intersect(&sides)
    };
    pieces(o, d, g, |p, q| p[1] * q[1], ends, emit);
}

/// Spans between the ends where the square of the distance to the axis is at most g(z). `product`: of two vectors' parts
/// across the axis; `ends`: the piece of a line from a point of it that is between them.
#[inline(always)]
fn pieces<V: Lanes>(
    o: Lanes3<V>,
    d: Lanes3<V>,
    g: [V::Scalar; 3],
    product: impl Fn(Lanes3<V>, Lanes3<V>) -> V,
    ends: impl Fn(Lanes3<V>) -> Span<V>,
    mut emit: impl FnMut(Span<V>),
) {
    let zero = V::constant(0.0);
    let [g0, g1, g2] = g.map(V::splat);
    // f(t) = a t^2 + 2 b t + c <= 0.
    let a = product(d, d) - g2 * (d[2] * d[2]) + zero;
    let at = |o: Lanes3<V>| {
        let b = product(o, d) - V::constant(0.5) * (g1 * d[2]) - g2 * (o[2] * d[2]);
        [b, product(o, o) - g2.mul_add(o[2], g1).mul_add(o[2], g0)]
    };
    let (o, shift) = nearest_to_vertex(o, d, a, at);
    let ends = ends(o);
    let [b, c] = at(o);
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
    let mut between = |side: Span<V>| emit(side.intersect(&ends).shifted(shift));
    between(Span::plain(crossed | whole, t_in, t_out));
    if outside.any() {
        between(Span::plain(outside, second, infinite()));
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
