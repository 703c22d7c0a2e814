//! Triangles of the leaves a tile met, sixteen at a time: corners into the frame, three edge planes through the
//! apex, one plane of 1/z, and bounds of what rounding may have done to them.
//!
//! With q the corners relative to the ray at each corner's depth, an edge function is q x q' in the picture plane.
//! Seen from the apex it is linear in (s, t), so it is set up once per triangle and costs two operations per ray.
//!
//! **Certainty.** The common formula (`shape::triangle`) is what decides hits; this arithmetic rounds elsewhere. Both
//! are exact for corners moved by at most `moved` = 16 half ulps of their distance (differences, three products of a
//! rotation, the ray's own s and t or shear), so an edge function beyond `eps` has the same sign in both, and depths
//! that differ by more than the factor 1 + `rho` have the same order. What lies between is given to the common
//! formula, ray by ray ([`super::exact`]). So a tile's answers are those of the scalar engine, bit by bit.

use super::groups::Groups;
use super::{HALF_ULP, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot};
use crate::shape::Block;

/// Triangles set up together.
pub const BATCH: usize = 16;

/// Movement of corners that covers the rounding of both formulas, in half ulps of the distance.
const MOVED: f32 = 16.0;

/// A depth interval wider than this says nothing.
const WILD: f32 = 0.25;

/// Triangles waiting to be set up, and the groups that met their leaves.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Batch {
    corners: [[f32; BATCH + 8]; 9],
    /// Block * 8 + place.
    pub slot: [u32; BATCH + 8],
    /// Groups that met the leaf.
    pub groups: [u32; BATCH + 8],
    len: usize,
}

impl Default for Batch {
    fn default() -> Self {
        Self { corners: [[0.0; BATCH + 8]; 9], slot: [0; BATCH + 8], groups: [0; BATCH + 8], len: 0 }
    }
}

/// Sixteen triangles ready for rays. Linear functions are `x * s + y * t + z`.
#[derive(Clone, Debug, Default)]
#[repr(C, align(64))]
pub struct Planes {
    /// The three edge functions and 1/z: x, y, z of each.
    pub linear: [[[f32; BATCH]; 3]; 4],
    /// Where an edge function is this much negative, the triangle is missed.
    pub outside: [f32; BATCH],
    /// Where all are this much positive, it is met.
    pub inside: [f32; BATCH],
    /// Factors that widen 1/z to what the common formula may find: at most, at least.
    pub most: [f32; BATCH],
    /// See `most`.
    pub least: [f32; BATCH],
    /// Signs of x and y of each linear function, bit by triangle.
    pub negative: [[u32; 2]; 4],
}

impl Batch {
    /// Triangles waiting.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Forgets all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds the first `count` triangles of a block; there must be room.
    #[inline(always)]
    pub fn push(&mut self, block: &Block<f32, 9>, first_slot: u32, count: usize, groups: u32) {
        let at = self.len.min(BATCH);
        for (to, from) in self.corners.iter_mut().zip(&block.fields) {
            to[at..at + 8].copy_from_slice(from);
        }
        for i in 0..8 {
            self.slot[at + i] = first_slot + i as u32;
            self.groups[at + i] = groups;
        }
        self.len = at + count;
    }

    /// Sets up what waits. Returns the triangles that may be seen from the tile.
    #[inline(always)]
    pub fn set_up(&self, groups: &Groups, planes: &mut Planes) -> u32 {
        let apex = groups.frame.apex.map(V::splat);
        let p: [Lanes3<V>; 3] = [0, 1, 2].map(|i| {
            let corner = [0, 1, 2].map(|a| V::load(&self.corners[3 * i + a]) - apex[a]);
            groups.frame.coordinates(corner)
        });
        let (d1, d2) = (minus(p[1], p[0]), minus(p[2], p[0]));
        let normal = cross(d1, d2);
        let volume = dot(normal, p[0]);
        let rcp = V::constant(1.0) / volume;
        let length = sum(d1).fast_max(sum(d2)).fast_max(sum(minus(d2, d1)));
        let (eps, rho) = doubt(groups, &p, length, sum(normal), rcp);

        // Triangles seen (nearly) edge-on have no side and no depth: met everywhere, certain nowhere.
        let tame = rho.cmp_lt(V::splat(WILD));
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let back = volume.cmp_lt(zero);
        let pick = |x: V, wild: V| select(tame, x, wild);
        let faced = |x: V| pick(select(back, -x, x), zero);
        let [x, y, z] = normal.map(|n| n * rcp);
        let inverse = [pick(x, zero), pick(y, zero), pick(z, V::splat(f32::MAX))];
        let edges = [cross(p[1], p[2]), cross(p[2], p[0]), cross(p[0], p[1])];
        let linear = [edges[0].map(faced), edges[1].map(faced), edges[2].map(faced), inverse];
        let most = pick(one + rho, one);
        (-eps).store(&mut planes.outside);
        pick(eps, V::splat(f32::INFINITY)).store(&mut planes.inside);
        most.store(&mut planes.most);
        pick(one - rho, zero).store(&mut planes.least);
        planes.store(groups, &linear, eps, most) & ((1u32 << self.len) - 1)
    }
}

impl Planes {
    /// Keeps the linear functions; returns the triangles whose largest values over the tile do not rule them out.
    #[inline(always)]
    fn store(&mut self, groups: &Groups, linear: &[Lanes3<V>; 4], eps: V, most: V) -> u32 {
        let zero = V::constant(0.0);
        let [[s0, s1], [t0, t1]] = groups.bounds.map(|b| b.map(V::splat));
        let mut seen = V::splat(f32::INFINITY);
        for (k, f) in linear.iter().enumerate() {
            let negative = [f[0].cmp_lt(zero), f[1].cmp_lt(zero)];
            self.negative[k] = negative.map(LaneMask::bits);
            let (s, t) = (select(negative[0], s0, s1), select(negative[1], t0, t1));
            let value = f[0].mul_add(s, f[1].mul_add(t, f[2]));
            let margin = if k < 3 { value + eps } else { value * most - V::splat(groups.nearest) };
            seen = seen.fast_min(margin);
            for (to, x) in self.linear[k].iter_mut().zip(f) {
                x.store(to);
            }
        }
        zero.cmp_le(seen).bits()
    }
}

/// How far edge functions (absolute) and 1/z (relative) may be from those of the common formula. `length` is the
/// longest side, `area` the size of the normal, `rcp` the reciprocal of normal times corner.
#[inline(always)]
fn doubt(groups: &Groups, p: &[Lanes3<V>; 3], length: V, area: V, rcp: V) -> (V, V) {
    let largest = |f: &dyn Fn(Lanes3<V>) -> V| f(p[0]).fast_max(f(p[1])).fast_max(f(p[2]));
    let distance = largest(&sum);
    let wide = V::splat(groups.wide);
    let spread = largest(&|q: Lanes3<V>| wide.mul_add(q[2].abs(), q[0].abs().fast_max(q[1].abs())));
    let moved = distance.mul_add(V::splat(MOVED * HALF_ULP), V::splat(groups.slack));
    // At the depth of a corner, a ray off the axis magnifies what is along the axis.
    let slant = 1.0 + 1.5 * groups.wide;
    let products = V::splat(8.0 * HALF_ULP);
    let eps = moved * length * V::splat(2.0 * slant * slant) + spread * spread * products + V::splat(f32::MIN_POSITIVE);
    // Corners that move by `moved` move the plane no farther; 8 half ulps for the products of either formula, which
    // are as large as the sides, and for the dot products.
    let shift = area * products.mul_add(distance, moved) + products * length * length * length;
    (eps, (shift * rcp.abs()).mul_add(V::splat(slant), V::splat(MOVED * HALF_ULP)))
}

#[inline(always)]
fn minus(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn sum(a: Lanes3<V>) -> V {
    a[0].abs() + a[1].abs() + a[2].abs()
}
