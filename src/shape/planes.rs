//! Convex polyhedra by their planes (Cyrus, Beck, "Generalized two- and three-dimensional clipping", 1978; Kay, Kajiya,
//! "Ray Tracing Complex Scenes", 1986).

use super::span::{Span, infinite};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, dot};

/// Where lines are inside all half-spaces `n . p <= offset`, given as `[n.x, n.y, n.z, offset]`. Faces are indices of
/// planes; of planes crossed at the same t the first counts.
#[inline(always)]
pub fn planes_span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, planes: &[[V::Scalar; 4]]) -> Span<V> {
    let zero = V::constant(0.0);
    let mut span = Span::plain(V::Mask::from_bits(V::ALL), -infinite::<V>(), infinite());
    for (i, plane) in planes.iter().enumerate() {
        let n = [plane[0], plane[1], plane[2]].map(V::splat);
        let (speed, room) = (dot(n, d), V::splat(plane[3]) - dot(n, o));
        let t = room / speed;
        let face = V::splat(V::Scalar::from_f64(i as f64));
        let (enters, leaves) = (speed.cmp_lt(zero), zero.cmp_lt(speed));
        let later = enters & span.t_in.cmp_lt(t);
        let earlier = leaves & t.cmp_lt(span.t_out);
        span.t_in = V::select(later, t, span.t_in);
        span.face_in = V::select(later, face, span.face_in);
        span.t_out = V::select(earlier, t, span.t_out);
        span.face_out = V::select(earlier, face, span.face_out);
        // A line along the plane is on one side of it for ever.
        span.hit = span.hit & (enters | leaves | zero.cmp_le(room));
    }
    span.hit = span.hit & span.t_in.cmp_le(span.t_out);
    span
}
