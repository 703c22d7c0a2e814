//! Which rays surely miss a triangle and which surely hit it: the plain test, with bounds of what rounding may have done to it and to
//! the common formula ([`super::triangle`]). Who is sure need not ask the common formula, which takes several times as long; the few
//! that are not are decided by it.
//!
//! Source: Möller, Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997; the bounds are our own.
//!
//! **Bounds.** With `u` half an ulp of 1, sums of absolute components as sizes, `p` and `q` the sides that leave the first corner, `e`
//! the sum of their sizes, `c` the size of the way from the ray's start to that corner, `d` that of the direction: edge functions come
//! out as products of three such numbers, and
//! * the plain test is off by at most `10 u d e (c + e)`: one rounding for each of two differences, two for a cross product, three for a
//!   scalar one make 7; the third function, which is what the others leave of the volume, has their errors and the volume's;
//! * the common formula takes each corner to two coordinates across the ray, `x = s z + X`, where a rounding of `z` and `X`, two of the
//!   slope `s`, which is at most 1, and two of the result make the two coordinates of a corner together wrong by `u (8 c + 10 e)` at most;
//!   an edge function of a line that passes the triangle at `e + 16 u c` at most, as its box test demands, is a sum of two products of such
//!   coordinates, so off by `24 u d (e + 16 u c)(c + e)`.
//!
//! So beyond `40 u d (e + 64 u c)(c + e)` ([`EDGES`], [`NEAR`]), which is a sixth more than both together, both have the same sign.
//! The parameter is normal times way over normal times direction. The first is off by `8 u |p| |q| c` in the plain test and
//! `5 u |p| |q| c` in the common formula, whose normal is exact; the second by `7 u |p| |q| d` and `4 u |p| |q| d`; and the common formula
//! moves a hit into the triangle's box, by `8 u t` at most. So within `20 u |p| |q| (c + d t)` ([`DEPTHS`]) the order of two parameters is
//! in doubt, and all is where normal times direction is hardly more than its bound ([`STEEP`]). What products lose below the smallest
//! number is less than [`tiny`] where no coordinate is beyond [`MOST`].

use super::block::BLOCK;
use super::triangle::Triangle;
use crate::lanes::{Lanes, Lanes3, Real, dot, each, map3};
use crate::math::Aabb;

/// Bound of edge functions, in half ulps.
const EDGES: f64 = 40.0;

/// How far from a triangle lines are that the common formula may take for hits, in half ulps of the distance.
const NEAR: f64 = 64.0;

/// Bound of what parameters are made of, in half ulps.
const DEPTHS: f64 = 20.0;

/// How many times the bound of normal times direction that product must be, so that a parameter can be told from it.
const STEEP: f64 = 64.0;

/// Largest coordinates of rays and triangles that the bounds hold for; no object may have triangles beyond it.
pub const MOST: f64 = (1 << 24) as f64;

/// Whether the bounds hold for triangles in a box.
pub fn holds_within<S: Real>(bounds: &Aabb<S>) -> bool {
    let most = S::from_f64(MOST);
    [bounds.lo, bounds.hi].as_flattened().iter().all(|x| Lanes::abs(*x) <= most)
}

/// More than is lost below the smallest number: a product of three numbers up to some [`MOST`], one of them lost, times the terms.
fn tiny<S: Real>() -> f64 {
    S::MIN_POSITIVE.to_f64() * (1u64 << 34) as f64
}

/// A number of half ulps of 1.
#[inline(always)]
fn half_ulps<V: Lanes>(count: f64) -> V {
    V::constant(count * V::Scalar::EPSILON.to_f64())
}

/// Sum of absolute components.
#[inline(always)]
fn size<V: Lanes>(v: Lanes3<V>) -> V {
    let [x, y, z] = map3(v, V::abs);
    x + y + z
}

/// What the bounds need of rays: see [`Line::gauge`].
#[inline(always)]
pub fn gauge<V: Lanes>(org: Lanes3<V>, dir: Lanes3<V>) -> V {
    let largest = |v: Lanes3<V>| v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs());
    let huge = V::constant(MOST).cmp_lt(largest(org).fast_max(largest(dir)));
    let infinite = V::splat(V::Scalar::INFINITY);
    V::select(huge | Triangle::along_a_face(dir), infinite, size(dir) * half_ulps(EDGES))
}

/// Eight numbers of each of two blocks side by side; in vectors of eight those of the first.
#[inline(always)]
pub fn beside<P: Lanes>(first: &[P::Scalar; BLOCK], second: &[P::Scalar; BLOCK]) -> P {
    if P::N <= BLOCK {
        return P::load(first);
    }
    let mut both = [P::Scalar::ZERO; 2 * BLOCK];
    both[..BLOCK].copy_from_slice(first);
    both[BLOCK..].copy_from_slice(second);
    P::load(&both)
}

/// Triangles prepared for the test, one per lane.
#[derive(Clone, Copy, Debug)]
pub struct Sieve<P> {
    corner: Lanes3<P>,
    /// Sides that leave the first corner.
    sides: [Lanes3<P>; 2],
    normal: Lanes3<P>,
    /// Sum of the sizes of the sides.
    reach: P,
    /// Product of them.
    area: P,
}

/// Rays, one per lane.
#[derive(Clone, Copy, Debug)]
pub struct Line<P> {
    /// Origins.
    pub org: Lanes3<P>,
    /// Directions.
    pub dir: Lanes3<P>,
    /// Size of the direction times the bound of edge functions; infinite for rays that the common formula is to decide: beyond [`MOST`],
    /// or [`Triangle::along_a_face`].
    pub gauge: P,
    /// Start of the segment.
    pub t_min: P,
    /// What is farther behind is no hit: the start of the segment, or minus infinity where it lies before the instance's box.
    pub t_low: P,
    /// End of the segment.
    pub t_max: P,
}

/// What rays and triangles came to.
#[derive(Clone, Copy, Debug)]
pub struct Sieved<P: Lanes> {
    /// Lanes that do not surely miss.
    pub possible: P::Mask,
    /// Any-hit: lanes that surely hit in their segment. Else: lanes whose line surely meets the triangle, and tells where.
    pub certain: P::Mask,
    /// Where: normal times way, and times direction. Their ratio is the parameter.
    pub way: P,
    /// See `way`; not negative.
    pub speed: P,
    /// Weights of the second and third corner, times `speed`.
    pub weights: [P; 2],
    /// What `way` may be off by.
    #[cfg(test)]
    pub off: P,
    /// What `speed` may be off by.
    #[cfg(test)]
    pub slant: P,
}

impl<P: Lanes> Sieve<P> {
    /// Triangles whose number `f` is `field(f)`.
    #[inline(always)]
    pub fn new(field: impl Fn(usize) -> P) -> Self {
        let corner = each(&field);
        let [p, q]: [Lanes3<P>; 2] = [3, 6].map(|first| each(|a| field(first + a) - corner[a]));
        // With the product's rounding error: of needles no digit is left otherwise.
        let minor = |a: usize, b: usize| {
            let product = p[b] * q[a];
            let error = (-p[b]).mul_add(q[a], product);
            p[a].mul_add(q[b], -product) + error
        };
        let sizes = [size(p), size(q)];
        Self {
            corner,
            sides: [p, q],
            normal: [minor(1, 2), minor(2, 0), minor(0, 1)],
            reach: sizes[0] + sizes[1],
            area: sizes[0] * sizes[1],
        }
    }

    /// Tests rays, each against the triangle in its lane.
    #[inline(always)]
    pub fn test<const ANY: bool>(&self, ray: &Line<P>) -> Sieved<P> {
        let tiny = P::constant(tiny::<P::Scalar>());
        let to_corner: Lanes3<P> = each(|a| self.corner[a] - ray.org[a]);
        let minor = |a: usize, b: usize| to_corner[a].mul_add(ray.dir[b], -(to_corner[b] * ray.dir[a]));
        let across = [minor(1, 2), minor(2, 0), minor(0, 1)];
        let speed = dot(self.normal, ray.dir);
        let faced = |x: P| x.turned_as(speed);
        let (v, way) = (faced(dot(across, self.sides[1])), faced(dot(self.normal, to_corner)));
        let (w, speed) = (-faced(dot(across, self.sides[0])), speed.abs());
        let least = v.fast_min(w).fast_min(speed - v - w);

        let away = size(to_corner);
        let near = away.mul_add(half_ulps(NEAR), self.reach) * ray.gauge;
        let edges = near.mul_add(away + self.reach, tiny);
        let off = (self.area * half_ulps(DEPTHS)).mul_add(away, tiny);
        let slant = self.area * P::constant(DEPTHS / EDGES) * ray.gauge;
        let steep = (slant * P::constant(STEEP)).cmp_lt(speed);
        let (to_end, from_low) = (way - ray.t_max * speed, way - ray.t_low * speed);
        let end_off = slant.mul_add(ray.t_max.abs(), off);
        let aside = end_off.cmp_lt(to_end) | from_low.cmp_lt(-slant.mul_add(ray.t_low.abs(), off));
        let possible = !(least.cmp_lt(-edges) | (aside & steep));
        let mut certain = edges.cmp_lt(least) & steep;
        if ANY {
            let endless = P::splat(P::Scalar::MAX).cmp_lt(ray.t_max);
            let from_start = way - ray.t_min * speed;
            let ahead = slant.mul_add(ray.t_min.abs(), off).cmp_lt(from_start);
            certain = certain & ahead & (endless | to_end.cmp_lt(-end_off));
        }
        Sieved {
            possible,
            certain,
            way,
            speed,
            weights: [v, w],
            #[cfg(test)]
            off,
            #[cfg(test)]
            slant,
        }
    }
}
