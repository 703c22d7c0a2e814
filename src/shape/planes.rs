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
        let room = V::splat(plane[3]) - dot(n, o);
        // A line along the plane is on one side of it for ever: it leaves at infinity, before or behind, or counts as inside
        // where it lies in the plane and t is no number. Zeros are made positive for that.
        let speed = dot(n, d) + zero;
        let t = room / speed;
        let face = V::splat(V::Scalar::from_f64(i as f64));
        let enters = speed.cmp_lt(zero);
        let later = enters & span.t_in.cmp_lt(t);
        let earlier = !enters & t.cmp_lt(span.t_out);
        span.t_in = V::select(later, t, span.t_in);
        span.face_in = V::select(later, face, span.face_in);
        span.t_out = V::select(earlier, t, span.t_out);
        span.face_out = V::select(earlier, face, span.face_out);
    }
    span.hit = span.t_in.cmp_le(span.t_out) & (-infinite::<V>()).cmp_lt(span.t_out);
    span
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cube from -1 to 1.
    const CUBE: [[f64; 4]; 6] = [
        [-1.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 1.0],
        [0.0, -1.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 1.0],
        [0.0, 0.0, -1.0, 1.0],
        [0.0, 0.0, 1.0, 1.0],
    ];

    #[test]
    fn lines_along_planes_are_inside_or_outside_for_ever() {
        for signs in 0..8u32 {
            let sign = |bit: u32| if signs >> bit & 1 != 0 { -1.0 } else { 1.0 };
            let d = [sign(0), 0.0 * sign(1), 0.0 * sign(2)];
            for (y, z) in [(0.0, 0.0), (0.5, -0.999), (1.0, 0.0), (-1.0, 1.0)] {
                let span = planes_span([-3.0 * d[0], y, z], d, &CUBE);
                assert!(span.hit && (span.t_in, span.t_out) == (2.0, 4.0), "{d:?} {y} {z}");
            }
            for (y, z) in [(1.001, 0.0), (0.0, -1.001), (-5.0, 5.0), (1.0, -1.5)] {
                let span: Span<f64> = planes_span([-3.0 * d[0], y, z], d, &CUBE);
                assert!(!span.hit, "{d:?} {y} {z}");
            }
        }
    }
}
