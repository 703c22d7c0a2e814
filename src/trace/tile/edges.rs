//! Edge functions of sixteen triangles in a tile's frame, and what rounding does to them.

use super::groups::{Groups, splats};
use super::{HALF_ULP, V, select};
use crate::lanes::{Lanes, Lanes3, each, map3};

/// Movement of corners that covers the rounding of both formulas, in half ulps of the distance.
const MOVED: f32 = 16.0;

/// Relative rounding error of sums of products in the common formula.
const PRODUCTS: f32 = 8.0 * HALF_ULP;

/// The same in the tile's own, counted over all operations (the division by the volume is one): of slopes times the
/// tile's width, and of the value at the ray they are made around.
const OWN_PRODUCTS: [f32; 2] = [18.0 * HALF_ULP, 12.0 * HALF_ULP];

/// How far numbers may be from those of the common formula.
pub struct Doubt {
    /// Edge functions, absolute.
    pub eps: V,
    /// Normal times corner, absolute.
    pub shift: V,
    /// 1/z, relative.
    pub rho: V,
}

/// `length` is the longest side, `area` the size of the normal, `rcp` the reciprocal of normal times corner.
#[inline(always)]
pub fn doubt(groups: &Groups, p: &[Lanes3<V>; 3], length: V, area: V, rcp: V) -> Doubt {
    let largest = |f: &dyn Fn(Lanes3<V>) -> V| f(p[0]).fast_max(f(p[1])).fast_max(f(p[2]));
    let distance = largest(&sum);
    let moved = distance.mul_add(V::splat(MOVED * HALF_ULP), V::splat(groups.slack));
    // At the depth of a corner, a ray off the axis magnifies what is along the axis.
    let slant = 1.0 + 1.5 * groups.wide;
    let products = V::splat(PRODUCTS);
    let eps = moved * length * V::splat(2.0 * slant * slant) + rounding(groups, p);
    // Corners that move by `moved` move the plane no farther; 8 half ulps for the products of either formula, which
    // are as large as the sides, and for the dot products.
    let shift = area * products.mul_add(distance, moved) + products * length * length * length;
    let rho = (shift * rcp.abs()).mul_add(V::splat(slant), V::splat(MOVED * HALF_ULP));
    Doubt { eps, shift, rho }
}

/// The edge function of the edge that is seen longest: its slope is the largest.
#[inline(always)]
pub fn longest(edges: &[Lanes3<V>; 3]) -> Lanes3<V> {
    let [a, b, c] = map3(*edges, |e| e[0].abs() + e[1].abs());
    let (first, most) = (b.cmp_lt(a), a.fast_max(b));
    each(|x| select(c.cmp_lt(most), select(first, edges[0][x], edges[1][x]), edges[2][x]))
}

/// Rounding error of an edge function of the common formula, for the corners as they are.
#[inline(always)]
fn rounding(groups: &Groups, p: &[Lanes3<V>; 3]) -> V {
    let wide = V::splat(groups.wide);
    let spread = map3(*p, |q| wide.mul_add(q[2].abs(), q[0].abs().fast_max(q[1].abs())));
    let spread = spread[0].fast_max(spread[1]).fast_max(spread[2]);
    spread * spread * V::splat(PRODUCTS) + V::splat(f32::MIN_POSITIVE)
}

/// The tile's own edge functions, unfaced, and their rounding errors for the corners as they are. `inverse`: the corners'
/// reciprocal depths.
///
/// Each is made around the ray of the tile that is closest to the edge's first corner, so that what rounds is as large as the
/// edge, not as the triangle or its distance from the tile's axis: with x', y' seen from that ray, `y1 z2 - z1 y2` is
/// `y1' z2 - z1 y2'`.
#[inline(always)]
pub fn own_edges(groups: &Groups, p: &[Lanes3<V>; 3], inverse: &Lanes3<V>) -> ([Lanes3<V>; 3], [V; 3]) {
    let zero = V::constant(0.0);
    let [[s0, s1], [t0, t1]] = splats(&groups.bounds);
    let edge = |i: usize, j: usize| {
        let in_front = zero.cmp_lt(p[i][2]);
        let within = |lo: V, hi: V, x: V| lo.fast_max(hi.fast_min(select(in_front, x * inverse[i], zero)));
        let (s, t) = (within(s0, s1, p[i][0]), within(t0, t1, p[i][1]));
        let seen = |q: &Lanes3<V>| [(-s).mul_add(q[2], q[0]), (-t).mul_add(q[2], q[1]), q[2]];
        let (a, b) = (seen(&p[i]), seen(&p[j]));
        let [x, y, at_ray] = cross(a, b);
        let reach = |q: &Lanes3<V>| q[0].abs().fast_max(q[1].abs());
        let (of_a, of_b) = (reach(&a), reach(&b));
        let slope = of_a * b[2].abs() + of_b * a[2].abs();
        let products = of_a * of_b * V::splat(OWN_PRODUCTS[1]) + V::splat(f32::MIN_POSITIVE);
        let eps = slope.mul_add(V::splat(OWN_PRODUCTS[0] * groups.wide), products);
        ([x, y, (-x).mul_add(s, (-y).mul_add(t, at_ray))], eps)
    };
    let (a, b, c) = (edge(1, 2), edge(2, 0), edge(0, 1));
    ([a.0, b.0, c.0], [a.1, b.1, c.1])
}

#[inline(always)]
pub fn minus(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn cross(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The same to about an ulp per component, whatever cancels (Kahan's difference of products; Jeannerod, Louvet, Muller,
/// "Further analysis of Kahan's algorithm", Math. Comp. 82, 2013).
#[inline(always)]
pub fn cross_accurate(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    let minor = |i: usize, j: usize| {
        let product = a[j] * b[i];
        let error = (-a[j]).mul_add(b[i], product);
        a[i].mul_add(b[j], -product) + error
    };
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[inline(always)]
pub fn sum(a: Lanes3<V>) -> V {
    a[0].abs() + a[1].abs() + a[2].abs()
}
