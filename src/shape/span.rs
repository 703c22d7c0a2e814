//! Convex solids: the piece of a line inside them. One kernel gives the nearest hit and all boundaries.

use glam::DVec3;

use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each};

/// Entry and exit of `N` lines through a convex solid, before the segment is looked at. A tangent line gives an
/// empty span (`t_in == t_out`) or none, never a single boundary: parity is preserved for CSG. Bounds at infinity
/// (half-spaces) are infinite.
#[derive(Clone, Copy, Debug)]
pub struct Span<V: Lanes> {
    /// Lanes whose line meets the solid.
    pub hit: V::Mask,
    /// Parameter of entry.
    pub t_in: V,
    /// Parameter of exit, `>= t_in`.
    pub t_out: V,
    /// Number of the face entered through.
    pub face_in: V,
    /// Number of the face left through.
    pub face_out: V,
}

/// A canonical convex shape in its local space.
pub trait Solid {
    /// Local bounds; infinite for unbounded shapes.
    const LO: DVec3;
    /// Upper local bounds.
    const HI: DVec3;

    /// Where lines `o + t d` (local space, `d` not unit) are inside. `param`: the shape's one parameter, if any.
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, param: V::Scalar) -> Span<V>;

    /// Outward normal (local, not unit) at a surface point of face `face`.
    fn normal(point: DVec3, face: u32, param: f64) -> DVec3;
}

impl<V: Lanes> Span<V> {
    /// A span between two parameters with the face numbers 0.
    #[inline(always)]
    pub fn plain(hit: V::Mask, t_in: V, t_out: V) -> Self {
        Self { hit, t_in, t_out, face_in: V::constant(0.0), face_out: V::constant(0.0) }
    }

    /// The part of this span inside a second one.
    #[inline(always)]
    pub fn intersect(&self, other: &Self) -> Self {
        let later = self.t_in.cmp_lt(other.t_in);
        let earlier = other.t_out.cmp_lt(self.t_out);
        let t_in = V::select(later, other.t_in, self.t_in);
        let t_out = V::select(earlier, other.t_out, self.t_out);
        Self {
            hit: self.hit & other.hit & t_in.cmp_le(t_out),
            t_in,
            t_out,
            face_in: V::select(later, other.face_in, self.face_in),
            face_out: V::select(earlier, other.face_out, self.face_out),
        }
    }

    /// The same span with a number added to its parameters.
    #[inline(always)]
    pub fn shifted(&self, by: V) -> Self {
        Self { t_in: self.t_in + by, t_out: self.t_out + by, ..*self }
    }

    /// Where a line is between two parallel planes: `lo <= o + t d <= hi`, with the faces there. A line along them is
    /// between them for ever or never; also one within a plane, which the reciprocal alone would cut in two.
    #[inline(always)]
    pub fn slab(o: V, d: V, [lo, hi]: [V; 2], [low, high]: [f64; 2]) -> Self {
        let rcp = crate::lanes::finite_rcp(d);
        let level = d.abs().cmp_lt(V::splat(V::Scalar::MIN_POSITIVE));
        let first = V::select(level, -infinite::<V>(), (lo - o) * rcp);
        let second = V::select(level, infinite(), (hi - o) * rcp);
        let up = first.cmp_le(second);
        let (low, high) = (V::constant(low), V::constant(high));
        Self {
            hit: (!level | (lo.cmp_le(o) & o.cmp_le(hi))) & V::Mask::from_bits(V::ALL),
            t_in: V::select(up, first, second),
            t_out: V::select(up, second, first),
            face_in: V::select(up, low, high),
            face_out: V::select(up, high, low),
        }
    }

    /// The slab `0 <= z <= 1`; faces 1 (z = 0) and 2 (z = 1).
    #[inline(always)]
    pub fn unit_slab(oz: V, dz: V) -> Self {
        Self::slab(oz, dz, [V::constant(0.0), V::constant(1.0)], [1.0, 2.0])
    }
}

/// The line's origin moved to its point nearest to the local origin, and the parameter of that point. Quadratics
/// solved from there lose no digits to the distance of the eye (Haines, Günther, Akenine-Möller, "Precision
/// Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019). The first step is off by an ulp of its length,
/// which is the size of the shape where a flat one is seen from 10^6 local units away; the second makes up for it.
#[inline(always)]
pub fn nearest_to_origin<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>) -> (Lanes3<V>, V) {
    nearest_by(o, d, V::constant(1.0) / crate::lanes::dot(d, d))
}

/// The same with one over the square of `d`'s length.
#[inline(always)]
pub fn nearest_by<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, rcp_square: V) -> (Lanes3<V>, V) {
    let step = |o: Lanes3<V>| {
        let shift = -(crate::lanes::dot(o, d) * rcp_square);
        (each(|a| d[a].mul_add(shift, o[a])), shift)
    };
    let (rough, first) = step(o);
    let (near, second) = step(rough);
    (near, first + second)
}

/// Like [`nearest_to_origin`], but to where f(t) = a t^2 + 2 b t + c has its least or largest value, if that is near and both
/// roots are near it: from there they are as far apart as they are exact, also where they meet (a cone's tip, the line in
/// which a trough ends). A root far from it would suffer from the digits that a loses. `at`: b and c of a point of the line.
#[inline(always)]
pub fn nearest_to_vertex<V: Lanes>(
    o: Lanes3<V>,
    d: Lanes3<V>,
    a: V,
    at: impl Fn(Lanes3<V>) -> [V; 2],
) -> (Lanes3<V>, V) {
    let square = crate::lanes::dot(d, d);
    let first = -(crate::lanes::dot(o, d) / square);
    let rough = [d[0].mul_add(first, o[0]), d[1].mul_add(first, o[1]), d[2].mul_add(first, o[2])];
    let [b, c] = at(rough);
    let longest = d[0].abs().fast_max(d[1].abs()).fast_max(d[2].abs());
    let together = (V::constant(16.0) * b.mul_add(b, -(a * c))).cmp_lt(b * b);
    let close = (b.abs() * longest).cmp_lt(V::constant(4.0) * a.abs()) & together;
    let second = -(V::select(close, b, crate::lanes::dot(rough, d)) / V::select(close, a, square));
    let near = [d[0].mul_add(second, rough[0]), d[1].mul_add(second, rough[1]), d[2].mul_add(second, rough[2])];
    (near, first + second)
}

/// Positive infinity in every lane.
#[inline(always)]
pub fn infinite<V: Lanes>() -> V {
    V::splat(V::Scalar::INFINITY)
}
