//! The canonical elliptic torus: an ellipse, which may lean, swept round the z axis on the circle of radius 1.
//!
//! With u = sqrt(x^2 + y^2) - 1 the ellipse is u^2 - 2 k u z + z^2 <= q, q = (1 - k^2) w^2: it reaches w far along u
//! and along z, and k tells how it leans (scales along z make all others). Squaring the root away gives
//! (x^2 + y^2 + z^2 + 1 + 2 k z - q)^2 <= 4 (x^2 + y^2) (1 + k z)^2, a quartic along a line, as Hanrahan's torus ("A survey
//! of ray-surface intersection algorithms", 1989) is for k = 0. Where w > 1 and the ellipse crosses the axis, what is
//! swept over twice is outside.

use glam::DVec3;

use super::quartic;
use super::span::{Span, nearest_to_origin};
use super::torus::Part;
use crate::lanes::{Lanes, Lanes3, dot};

/// How much wider than the solid the interval is in which roots are looked for: its ends are outside.
const ROOM: f64 = 1.0 / 256.0;

/// Spans of lines inside; `reach`: w, `lean`: k. Face 0.
#[inline(always)]
pub fn elliptic_torus<V: Lanes>(
    o: Lanes3<V>,
    d: Lanes3<V>,
    [reach, lean]: [V::Scalar; 2],
    mut emit: impl FnMut(Span<V>),
) {
    let (o, shift) = nearest_to_origin(o, d);
    let (w, k, one) = (V::splat(reach), V::splat(lean), V::constant(1.0));
    let wide = V::constant(1.0 + ROOM);
    let (across, flat) = ((one + w) * wide, w * wide);
    let room = across.mul_add(across, flat.mul_add(flat, -dot(o, o)));
    let Some(Part { o, d, middle, reach: stretch, met }) = Part::of(o, d, room, flat) else { return };
    let round = |a: Lanes3<V>, b: Lanes3<V>| a[0].mul_add(b[0], a[1] * b[1]);
    let (two, four) = (V::constant(2.0), V::constant(4.0));
    // g0 + 2 g1 s + g2 s^2, the square of the distance to the axis r0 + 2 r1 s + r2 s^2, and the line l0 + l1 s.
    let q = (one - k) * (one + k) * (w * w);
    let (kz, kd) = (k * o[2], k * d[2]);
    let (g0, g1, g2) = (dot(o, o) + (two.mul_add(kz, one) - q), dot(o, d) + kd, dot(d, d));
    let (r0, r1, r2) = (round(o, o), round(o, d), round(d, d));
    let (l0, l1) = (one + kz, kd);
    let (m0, m1, m2) = (l0 * l0, l0 * l1, l1 * l1);
    let p = [
        g0.mul_add(g0, -(four * (r0 * m0))),
        four * g0.mul_add(g1, -(two * r0.mul_add(m1, r1 * m0))),
        (two * g0).mul_add(g2, four * (g1.mul_add(g1, -(r0.mul_add(m2, r2 * m0) + four * (r1 * m1))))),
        four * g1.mul_add(g2, -(two * r1.mul_add(m2, r2 * m1))),
        g2.mul_add(g2, -(four * (r2 * m2))),
    ];
    quartic::spans(&p, true, |lanes, s_in, s_out| {
        let at = |s: V| stretch.mul_add(s, middle) + shift;
        emit(Span::plain(lanes & met, at(s_in), at(s_out)));
    });
}

/// Outward normal (not unit) at a surface point.
pub fn elliptic_torus_normal(point: DVec3, [reach, lean]: [f64; 2]) -> DVec3 {
    let out = DVec3::new(point.x, point.y, 0.0).normalize_or(DVec3::X);
    let rho = point.x.hypot(point.y);
    let q = (1.0 - lean) * (1.0 + lean) * reach * reach;
    let z = point.z;
    // The two factors of the quartic, for the ellipse and for its mirror image beyond the axis, and their gradients.
    let factor = |u: f64| u * u - 2.0 * lean * u * z + z * z - q;
    let gradient = |u: f64, side: f64| out * (side * (u - lean * z)) + DVec3::Z * (z - lean * u);
    let (near, far) = (rho - 1.0, -rho - 1.0);
    gradient(near, 1.0) * factor(far) + gradient(far, -1.0) * factor(near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LaneMask, Real, f32x8, f64x4};
    use crate::math::Random;

    /// A point of the surface by the angles about the axis and in the ellipse, whose semi-axes lie on the diagonals.
    fn surface([reach, lean]: [f64; 2], about: f64, within: f64) -> DVec3 {
        let half = 0.5f64.sqrt();
        let (long, short) = (reach * (1.0 + lean).sqrt() * within.cos(), reach * (1.0 - lean).sqrt() * within.sin());
        let (out, up) = (1.0 + half * (long - short), half * (long + short));
        DVec3::new(about.cos() * out, about.sin() * out, up)
    }

    /// Negative inside, by the definition.
    fn form([reach, lean]: [f64; 2], p: DVec3) -> f64 {
        let u = p.x.hypot(p.y) - 1.0;
        u * u - 2.0 * lean * u * p.z + p.z * p.z - (1.0 - lean * lean) * reach * reach
    }

    fn spans<V: Lanes>(numbers: [f64; 2], o: DVec3, d: DVec3) -> Vec<[f64; 2]> {
        let mut found = Vec::new();
        let lanes = |v: DVec3| v.to_array().map(V::constant);
        elliptic_torus::<V>(lanes(o), lanes(d), numbers.map(V::Scalar::from_f64), |span| {
            assert!(span.hit.bits() & V::ALL == V::ALL, "all lanes hold the same line");
            found.push([span.t_in.lane(0).to_f64(), span.t_out.lane(0).to_f64()]);
        });
        found
    }

    #[test]
    fn lines_through_surface_points_end_spans_there() {
        let mut r = Random(1);
        let mut met = 0;
        for _ in 0..20_000 {
            let numbers = [0.05 + 0.9 * r.signed().abs(), 0.95 * r.signed()];
            let (p, d) = (surface(numbers, 4.0 * r.signed(), 4.0 * r.signed()), r.cube());
            let at = 10.0 * r.signed();
            let found = spans::<f64>(numbers, p - at * d, d);
            let n = elliptic_torus_normal(p, numbers).normalize();
            assert!(form(numbers, p + 1e-6 * n) > 0.0 && form(numbers, p - 1e-6 * n) < 0.0, "{numbers:?} {p} {n}");
            assert!(found.iter().flatten().is_sorted() && found.len() <= 2);
            for [a, b] in &found {
                assert!(form(numbers, p + (0.5 * (a + b) - at) * d) < 1e-10, "{numbers:?} {p} {d} {found:?}");
            }
            if n.dot(d).abs() > 0.1 * d.length() && d.length() > 0.1 {
                let off = found.iter().flatten().map(|t| (t - at).abs()).fold(f64::INFINITY, f64::min);
                assert!(off < 1e-8, "{numbers:?} {p} {d} {found:?} {at}");
                met += 1;
                assert_eq!(spans::<f64x4>(numbers, p - at * d, d).len(), found.len(), "{numbers:?} {p} {d}");
            }
        }
        assert!(met > 10_000, "{met}");
    }

    #[test]
    fn tangents_give_pairs_or_nothing() {
        let mut r = Random(2);
        let mut counts = [0; 3];
        for _ in 0..20_000 {
            let numbers = [0.1 + 0.9 * r.signed().abs(), 0.9 * r.signed()];
            let p = surface(numbers, 4.0 * r.signed(), 4.0 * r.signed());
            let n = elliptic_torus_normal(p, numbers).normalize();
            let d = n.cross(r.cube());
            if d.length() < 0.1 {
                continue;
            }
            for found in [spans::<f64>(numbers, p - d, d), spans::<f32x8>(numbers, p - d, d)] {
                assert!(found.iter().all(|[a, b]| a <= b), "{numbers:?} {p} {d} {found:?}");
                counts[found.len()] += 1;
            }
        }
        println!("tangents with no, one, two spans: {counts:?}");
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    }
}
