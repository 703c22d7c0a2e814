//! The canonical torus about the z axis, major radius 1 (Hanrahan, "A survey of ray-surface intersection algorithms",
//! in Glassner, An Introduction to Ray Tracing, 1989, for the quartic).

use super::quartic;
use super::span::{Span, nearest_to_origin};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each};

/// How much wider than the solid the interval is in which roots are looked for: its ends are outside.
const ROOM: f64 = 1.0 / 256.0;

/// Spans of lines inside the torus whose tube has the radius `minor` <= 1. Face 0.
#[inline(always)]
pub fn torus<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, minor: V::Scalar, mut emit: impl FnMut(Span<V>)) {
    let (o, shift) = nearest_to_origin(o, d);
    let minor = V::splat(minor);
    let wide = V::constant(1.0 + ROOM);
    let ball = (V::constant(1.0) + minor) * wide;
    let room = ball.mul_add(ball, -dot(o, o));
    let Some(Part { o, d, middle, reach, met }) = Part::of(o, d, room, minor * wide) else { return };
    // p = (|x|^2 + 1 - minor^2)^2 - 4 (x^2 + y^2), with the square of g0 + 2 g1 s + g2 s^2.
    let (g0, g1, g2) = (dot(o, o) + (V::constant(1.0) - minor * minor), dot(o, d), dot(d, d));
    let round = |a: Lanes3<V>, b: Lanes3<V>| a[0].mul_add(b[0], a[1] * b[1]);
    let (two, four) = (V::constant(2.0), V::constant(4.0));
    let p = [
        g0.mul_add(g0, -(four * round(o, o))),
        four * g0.mul_add(g1, -(two * round(o, d))),
        (two * g0).mul_add(g2, four * (g1.mul_add(g1, -round(d, d)))),
        four * (g1 * g2),
        g2 * g2,
    ];
    quartic::spans(&p, true, |lanes, s_in, s_out| {
        let at = |s: V| reach.mul_add(s, middle) + shift;
        emit(Span::plain(lanes & met, at(s_in), at(s_out)));
    });
}

/// A line's way through a ball, cut by a slab, as `o + s d` for s from -1 to 1; the line's own parameter is
/// `middle + reach s`.
pub(super) struct Part<V: Lanes> {
    pub o: Lanes3<V>,
    pub d: Lanes3<V>,
    pub middle: V,
    pub reach: V,
    /// Lanes that have one.
    pub met: V::Mask,
}

impl<V: Lanes> Part<V> {
    /// Of the line `o + t d`, whose `o` is nearest to the centre. `room` is the square of the ball's radius less that of
    /// `o`'s distance, the slab is |z| <= `flat`. `None` if no lane has any.
    #[inline(always)]
    pub fn of(o: Lanes3<V>, d: Lanes3<V>, room: V, flat: V) -> Option<Self> {
        let chord = (room / dot(d, d)).sqrt();
        let slab = Span::slab(o[2], d[2], [-flat, flat], [0.0, 0.0]);
        let (from, to) = (slab.t_in.fast_max(-chord), slab.t_out.fast_min(chord));
        let met = slab.hit & V::constant(0.0).cmp_lt(room) & from.cmp_lt(to);
        if !met.any() {
            return None;
        }
        let half = V::constant(0.5);
        let (middle, reach) = (half * (from + to), half * (to - from));
        let o = each(|a| d[a].mul_add(middle, o[a]));
        Some(Self { o, d: d.map(|x| x * reach), middle, reach, met })
    }
}

/// Outward normals (not unit) at surface points.
#[inline(always)]
pub fn torus_normal<V: Lanes>(p: Lanes3<V>) -> Lanes3<V> {
    let (zero, one) = (V::constant(0.0), V::constant(1.0));
    let round = p[1].mul_add(p[1], p[0] * p[0]).sqrt();
    let on_axis = round.cmp_eq(zero);
    let less = one / V::select(on_axis, one, round);
    [p[0] - V::select(on_axis, one, p[0] * less), p[1] - p[1] * less, p[2]]
}
