//! Edge functions of the watertight triangle test ([`super::triangle`]): their signs, and what is zero only by rounding.

use super::triangle::Triangle;
use crate::lanes::{Lanes, Lanes3, map3};
use crate::ray::slab::pad;

/// The components along an axis and the two that follow it.
#[inline(always)]
pub fn around<T: Copy>(v: [T; 3], axis: usize) -> [T; 3] {
    map3(AROUND[axis & 3], |a| v[a])
}

/// Each axis with the two that follow it; the last row fills up to a power of two.
const AROUND: [[usize; 3]; 4] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Edge functions of `N` ray-triangle pairs in the rays' sheared frames, and the corners' distances along the dominant
/// axis.
pub(super) struct Edges<V> {
    depth: [V; 3],
    /// Of the corners in their order: of the edge across from each.
    pub functions: [V; 3],
}

impl<V: Lanes> Edges<V> {
    /// For rays with this dominant axis, their origins [`around`] it; `corner(f)` gives field `f` of the triangles.
    #[inline(always)]
    pub fn new(org: Lanes3<V>, shear: Lanes3<V>, axis: usize, corner: impl Fn(usize) -> V) -> Self {
        Self::by(org, shear, axis, corner, |p, q| p[0] * q[1] - p[1] * q[0])
    }

    /// The same with `cross(p, q)` for the difference of the products.
    #[inline(always)]
    fn by(
        org: Lanes3<V>,
        shear: Lanes3<V>,
        axis: usize,
        corner: impl Fn(usize) -> V,
        cross: impl Fn([V; 2], [V; 2]) -> V,
    ) -> Self {
        let [k, kx, ky] = AROUND[axis & 3];
        let sheared = |i: usize| {
            let z = corner(3 * i + k) - org[0];
            let x = shear[0].mul_add(z, corner(3 * i + kx) - org[1]);
            let y = shear[1].mul_add(z, corner(3 * i + ky) - org[2]);
            ([x, y], z)
        };
        let ((a, a_depth), (b, b_depth), (c, c_depth)) = (sheared(0), sheared(1), sheared(2));
        Self { depth: [a_depth, b_depth, c_depth], functions: [cross(c, b), cross(a, c), cross(b, a)] }
    }

    /// The same where products that round to one number differ by what was rounded: signs are exact. Not so near the smallest numbers,
    /// where what was rounded is lost, and the corners with it; the restart decides there.
    #[cold]
    #[inline(never)]
    pub fn told([org, shear]: &[Lanes3<V>; 2], axis: usize, corners: &[V; Triangle::FIELDS]) -> Self {
        Self::by(
            *org,
            *shear,
            axis,
            |f| corners[f],
            |p, q| {
                let (one, other) = (p[0] * q[1], p[1] * q[0]);
                let rounded = p[0].mul_add(q[1], -one) - p[1].mul_add(q[0], -other);
                let difference = one - other;
                let told = V::constant(Triangle::least_det::<V::Scalar>()).cmp_le(one.abs());
                V::select(difference.cmp_eq(V::constant(0.0)) & told, rounded, difference)
            },
        )
    }

    /// Pairs with an edge function of zero.
    #[inline(always)]
    pub fn vague(&self) -> V::Mask {
        let [u, v, w] = map3(self.functions, |f| f.cmp_eq(V::constant(0.0)));
        u | v | w
    }

    /// Pairs with edge functions of both signs. A NaN (overflow) is never outside: the restart decides.
    #[inline(always)]
    pub fn outside(&self) -> V::Mask {
        let zero = V::constant(0.0);
        let [u, v, w] = self.functions;
        let (low, high) = (u.fast_min(v).fast_min(w), u.fast_max(v).fast_max(w));
        low.cmp_lt(zero) & zero.cmp_lt(high)
    }

    /// Pairs whose corners are all beyond `t_max` or all before `t_min`; `rcp`: of the directions along the dominant axis.
    #[inline(always)]
    pub fn aside(&self, rcp: V, t_min: V, t_max: V) -> V::Mask {
        // The same slab as that of the triangle's own box, which its parameter is moved into.
        let [a, b, c] = map3(self.depth, |z| z * rcp);
        let (near, far) = (a.fast_min(b).fast_min(c), a.fast_max(b).fast_max(c));
        t_max.cmp_lt(near) | pad(far).cmp_lt(t_min)
    }
}
