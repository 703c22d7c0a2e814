//! Edge functions of sixteen triangles in a tile's frame, and what rounding does to them.

use super::groups::Groups;
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

/// The tile's own edge functions, unfaced, and their rounding errors for the corners as they are.
///
/// They are made around a ray of the tile close to the triangle, so that what rounds is as large as the triangle, not
/// as its distance from the tile's axis: with x', y' seen from that ray, `y1 z2 - z1 y2` is `y1' z2 - z1 y2'`.
#[inline(always)]
pub fn own_edges(groups: &Groups, p: &[Lanes3<V>; 3]) -> ([Lanes3<V>; 3], [V; 3]) {
    let zero = V::constant(0.0);
    let z0 = p[0][2];
    let near_ray = |axis: usize| {
        let [lo, hi] = [V::splat(groups.bounds[axis][0]), V::splat(groups.bounds[axis][1])];
        lo.fast_max(hi.fast_min(select(zero.cmp_lt(z0), p[0][axis] / z0, zero)))
    };
    let (s0, t0) = (near_ray(0), near_ray(1));
    let seen = map3(*p, |q| [(-s0).mul_add(q[2], q[0]), (-t0).mul_add(q[2], q[1]), q[2]]);
    let reach = map3(seen, |q| q[0].abs().fast_max(q[1].abs()));
    let pairs = [(1, 2), (2, 0), (0, 1)];
    let edges = map3(pairs, |(i, j)| {
        let [x, y, at_ray] = cross(seen[i], seen[j]);
        [x, y, (-x).mul_add(s0, (-y).mul_add(t0, at_ray))]
    });
    let eps = map3(pairs, |(i, j)| {
        let slope = reach[i] * p[j][2].abs() + reach[j] * p[i][2].abs();
        let products = reach[i] * reach[j] * V::splat(OWN_PRODUCTS[1]) + V::splat(f32::MIN_POSITIVE);
        slope.mul_add(V::splat(OWN_PRODUCTS[0] * groups.wide), products)
    });
    (edges, eps)
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
