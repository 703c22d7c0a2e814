//! Triangles of the leaves a tile met, sixteen at a time: corners into the frame, three edge planes through the
//! apex, one plane of 1/z, and bounds of what rounding may have done to them.
//!
//! With q the corners relative to the ray at each corner's depth, an edge function is q x q' in the picture plane.
//! Seen from the apex it is linear in (s, t), so it is set up once per triangle and costs two operations per ray.
//!
//! **Watertight.** Rounding may show a ray outside of two neighbours, or of every triangle around a corner, or inside
//! beyond the corner of two nearly parallel edges. So where one of the tile's own edge functions is as small as its
//! rounding error, on either side, the ray is looked at again in f64: no ray passes between triangles, none hits what
//! it passes beside.
//!
//! **Accuracy** of the tile's own answers: they are exact for corners moved by a few half ulps of their distance. Edges
//! that f32 cannot place so well (slivers) are looked at again in f64; the normal is taken without cancellation, and
//! depths are moved into the triangle's own, so that needles and triangles seen edge-on keep theirs. That also makes
//! answers independent of the order of triangles: the nearest wins, then the smallest primitive number.
//!
//! **Certainty** (`EXACT`). The common formula (`shape::triangle`) is what decides hits; this arithmetic rounds elsewhere. Both
//! are exact for corners moved by at most `moved` = 16 half ulps of their distance (differences, three products of a
//! rotation, the ray's own s and t or shear), so an edge function beyond `eps` has the same sign in both, and depths
//! that differ by more than the factor 1 + `rho` have the same order. What lies between is given to the common
//! formula, ray by ray ([`super::exact`]). So a tile's answers are those of the scalar engine, bit by bit.

use super::edges::{Doubt, cross, cross_accurate, doubt, longest, minus, own_edges, sum};
use super::groups::{Groups, splats};
use super::parallel::Parallel;
use super::place::Place;
use super::{HALF_ULP, Mask, SETS, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each, f32x8, map3};
use crate::shape::Block;

/// Triangles set up together.
pub const BATCH: usize = 16;

/// Triangles that may wait: as many again.
pub const ROOM: usize = 2 * BATCH;

/// Spanned volume (of a scene of unit size) from which on products of coordinates keep their digits.
pub const LEAST_VOLUME: f32 = 1e-30;

/// The same volume as a part of the lengths it is the product of: well above what f64 rounds to, in which weights are told. Not more, as
/// blocks on a grid have many sides that are seen from their own plane but for the rounding of f32, which moves them like corners.
pub const LEAST_PART: f32 = 1e-9;

/// Edge functions that change sign within the tile may be wrong by what moves an edge this far, in half ulps of the
/// distance.
const MOST_SHIFT: f32 = 10.0 * HALF_ULP;

/// Weights add up to one: that must be this many times their error.
const LEAST_SUM: f32 = 8.0;

/// A distance between the apex and a plane is certain beyond this part of the products it is made of.
const LEAST_DISTANCE: f32 = 32.0 * HALF_ULP;

/// A triangle that is seen edge-on tells no depth near a corner that is closer than this part of its farthest one.
const NEAR_CORNER: f32 = 1e-3;

/// A depth interval wider than this says nothing.
const WILD: f32 = 0.25;

/// Triangles waiting to be set up, and the groups that met their leaves.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Batch {
    /// In the space of the geometry; of instances: in the frame.
    pub corners: [[f32; ROOM]; 9],
    /// Of instances, any-hit: the first corner and the two sides that leave it, in the world and the scale of the frame.
    side: [[f32; ROOM]; 9],
    /// Primitive number; `EXACT`: block * 8 + place.
    pub id: [u32; ROOM],
    /// Of instances: the instance.
    pub inst: [u32; ROOM],
    /// Of instances: block * 8 + place.
    pub slot: [u32; ROOM],
    /// Groups that met the leaf.
    pub groups: [u64; ROOM],
    pub len: usize,
}

impl Default for Batch {
    fn default() -> Self {
        let numbers = [0; ROOM];
        let reals = [[0.0; ROOM]; 9];
        Self { corners: reals, side: reals, id: numbers, inst: numbers, slot: numbers, groups: [0; ROOM], len: 0 }
    }
}

/// Sixteen triangles ready for rays. Linear functions are `x * s + y * t + z`.
#[derive(Clone, Debug, Default)]
#[repr(C, align(64))]
pub struct Planes {
    /// The three edge functions and 1/z: x, y, z of each.
    pub linear: [[[f32; BATCH]; 3]; 4],
    /// Where an edge function is below this, the triangle is missed.
    pub outside: [f32; BATCH],
    /// Where all are at least this, it is met.
    pub inside: [f32; BATCH],
    /// Factors that widen 1/z to what the common formula may find: at most, at least.
    pub most: [f32; BATCH],
    /// See `most`.
    pub least: [f32; BATCH],
    /// 1/z at the triangle's nearest and farthest corner.
    pub nearest: [f32; BATCH],
    /// See `nearest`.
    pub farthest: [f32; BATCH],
    /// Rays without a common start: the first corner and the normal that points away from the apex, in the axes of the
    /// geometry and the scale of the frame.
    pub side: [[f32; BATCH]; 6],
    /// Rays with a common point behind them: infinite where the direction of `side` is not certain, else 0.
    pub facing: [f32; BATCH],
    /// Own answers: the reciprocal of the distance between the apex and the plane, in the unit of the normal in `side`.
    pub rcp: [f32; BATCH],
    /// Own answers: triangles too small for this arithmetic or seen edge-on, bit by triangle.
    pub wild: u32,
    /// Own answers: triangles whose plane passes the apex within rounding, so that it tells no depth: where a ray meets such a one
    /// is where its weights say.
    pub edge_on: u32,
    /// Own answers: triangles whose weights need more digits, bit by triangle.
    pub unsteady: u32,
    /// Own answers, rays with a common point behind them: triangles whose `rcp` is not certain, bit by triangle.
    pub flat: u32,
    /// Own answers, if asked for: the corners in the frame ([`Batch::put_corners`]).
    pub corners: [[[f32; BATCH]; 3]; 3],
    /// If asked for, where the largest value of each linear function over a group lies, s and t: index of [`Groups::rect`] without
    /// the set ([`Self::find_corners`]).
    pub corner: [[[u32; BATCH]; 2]; 4],
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
    pub fn push<const EXACT: bool>(&mut self, block: &Block<f32, 9>, first_slot: u32, count: usize, groups: u64) {
        let at = self.len.min(BATCH);
        for (to, from) in self.corners.iter_mut().zip(&block.fields) {
            to[at..at + 8].copy_from_slice(from);
        }
        let own: [u32; 8] = std::array::from_fn(|i| first_slot + i as u32);
        self.id[at..at + 8].copy_from_slice(if EXACT { &own } else { &block.prim });
        self.groups[at..at + 8].fill(groups);
        self.len = at + count;
    }

    /// Adds the first `count` triangles of a block of an instance, mapped into the frame: triangles of several instances
    /// are set up together.
    #[inline(always)]
    pub fn push_placed<const ANY: bool>(
        &mut self,
        block: &Block<f32, 9>,
        first_slot: u32,
        count: usize,
        groups: u64,
        place: &Place,
    ) {
        let at = self.len.min(BATCH);
        let corners: [Lanes3<f32x8>; 3] = each(|i| each(|a| f32x8::load(&block.fields[3 * i + a])));
        let apex = map3(place.frame.apex, f32x8::splat);
        for (i, corner) in corners.iter().enumerate() {
            let seen = place.frame.coordinates(each(|a| corner[a] - apex[a]));
            seen.iter().enumerate().for_each(|(a, x)| x.store(&mut self.corners[3 * i + a][at..]));
        }
        if ANY {
            let sides = [1, 2].map(|i| place.to_world.vectors::<f32x8>(each(|a| corners[i][a] - corners[0][a])));
            let numbers = [place.to_world.points(corners[0]), sides[0], sides[1]];
            self.side.iter_mut().zip(numbers.iter().flatten()).for_each(|(to, x)| x.store(&mut to[at..]));
        }
        self.id[at..at + 8].copy_from_slice(&block.prim);
        self.inst[at..at + 8].fill(place.inst);
        self.slot[at..at + 8].copy_from_slice(&std::array::from_fn::<u32, 8, _>(|i| first_slot + i as u32));
        self.groups[at..at + 8].fill(groups);
        self.len = at + count;
    }

    /// Those that are set up next, as bits.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        (1u32 << self.len.min(BATCH)) - 1
    }

    /// Corners of a waiting triangle.
    pub fn corners(&self, i: usize) -> [f32; 9] {
        std::array::from_fn(|f| self.corners[f][i])
    }

    /// Sets up what waits. Returns the triangles that may be seen from the tile.
    #[inline(always)]
    pub fn set_up<const ANY: bool, const EXACT: bool>(&self, groups: &Groups, planes: &mut Planes) -> u32 {
        // What is told it by reference would lie in memory for all: so it finds the corners itself.
        if !EXACT && let Some(parallel) = &groups.frame.parallel {
            return self.set_up_parallel::<ANY>(parallel, groups, planes);
        }
        let p = self.seen(groups, !EXACT && groups.many);
        let (d1, d2) = (minus(p[1], p[0]), minus(p[2], p[0]));
        if !EXACT {
            return self.set_up_own::<ANY>(groups, planes, &p, cross_accurate(d1, d2));
        }
        let normal = cross(d1, d2);
        let volume = dot(normal, p[0]);
        let rcp = V::constant(1.0) / volume;
        let length = sum(d1).fast_max(sum(d2)).fast_max(sum(minus(d2, d1)));
        let Doubt { eps, shift, rho } = doubt(groups, &p, length, sum(normal), rcp);

        // Triangles seen (nearly) edge-on have no side and no depth: certain nowhere, and met in a strip along the edge that is
        // seen longest. A point of them has an edge function of the volume over its depth at most.
        let tame = rho.cmp_lt(V::splat(WILD));
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let low = p[0][2].fast_min(p[1][2]).fast_min(p[2][2]);
        let width = (volume.abs() + shift + shift) / low + eps;
        let width = select(zero.cmp_lt(low), width, V::splat(f32::INFINITY));
        let back = volume.cmp_lt(zero);
        let pick = |x: V, wild: V| select(tame, x, wild);
        let faced = |x: V| select(back, -x, x);
        let [x, y, z] = map3(normal, |n| n * rcp);
        let inverse = [pick(x, zero), pick(y, zero), pick(z, V::splat(f32::MAX))];
        if groups.is_behind {
            self.set_up_side(groups, planes, None);
            pick(zero, V::splat(f32::INFINITY)).store(&mut planes.facing);
        }
        let edges = [cross(p[1], p[2]), cross(p[2], p[0]), cross(p[0], p[1])];
        let strip = longest(&edges);
        let linear = [
            each(|a| pick(faced(edges[0][a]), strip[a])),
            each(|a| pick(faced(edges[1][a]), -strip[a])),
            each(|a| pick(faced(edges[2][a]), zero)),
            inverse,
        ];
        let most = pick(one + rho, one);
        let width = pick(eps, width);
        (-width).store(&mut planes.outside);
        pick(eps, V::splat(f32::INFINITY)).store(&mut planes.inside);
        most.store(&mut planes.most);
        pick(one - rho, zero).store(&mut planes.least);
        planes.store(groups, &linear, width, |inverse| inverse * most) & self.lanes()
    }

    /// The corners in the frame. `many`: they are waiting there.
    #[inline(always)]
    pub fn seen(&self, groups: &Groups, many: bool) -> [Lanes3<V>; 3] {
        let apex = map3(groups.frame.apex, V::splat);
        each(|i| {
            let corner = each(|a| V::load(&self.corners[3 * i + a]));
            if many { corner } else { groups.frame.coordinates(each(|a| corner[a] - apex[a])) }
        })
    }

    /// The first corner and the two sides that leave it, in the world and the scale of the frame.
    #[inline(always)]
    fn sides(&self, groups: &Groups) -> (Lanes3<V>, [Lanes3<V>; 2]) {
        if groups.many {
            let [corner, one, other] = each(|i| each(|a| V::load(&self.side[3 * i + a])));
            return (corner, [one, other]);
        }
        let scale = V::splat(groups.frame.scale);
        let corner: [Lanes3<V>; 3] = each(|i| each(|a| V::load(&self.corners[3 * i + a]) * scale));
        (corner[0], [minus(corner[1], corner[0]), minus(corner[2], corner[0])])
    }

    /// Set-up for segments that start anywhere. Not from the corners in the frame: theirs is another normal, if the triangle
    /// is a needle. Returns the triangles that some segment may start behind.
    #[inline(always)]
    pub fn set_up_side(&self, groups: &Groups, planes: &mut Planes, parallel: Option<&Parallel>) -> u32 {
        let (corner, sides) = self.sides(groups);
        let normal = cross_accurate(sides[0], sides[1]);
        let from_apex = match parallel {
            Some(parallel) => parallel.view.map(|x| V::splat(x * groups.frame.scale)),
            None => each(|a| corner[a] - V::splat(groups.frame.apex[a] * groups.frame.scale)),
        };
        let volume = dot(normal, from_apex);
        let back = volume.cmp_lt(V::constant(0.0));
        let normal = map3(normal, |x| select(back, -x, x));
        let side = corner.into_iter().chain(normal);
        planes.side.iter_mut().zip(side).for_each(|(to, x)| x.store(to));
        let (size, products) = (volume.abs(), dot(map3(normal, V::abs), map3(from_apex, V::abs)));
        (V::constant(1.0) / size).store(&mut planes.rcp);
        planes.flat = size.cmp_le(products * V::splat(LEAST_DISTANCE)).bits();
        groups.starts.as_ref().map_or(u32::MAX, |starts| starts.some_behind(corner, normal))
    }

    /// Set-up for the tile's own answers.
    #[inline(always)]
    fn set_up_own<const ANY: bool>(
        &self,
        groups: &Groups,
        planes: &mut Planes,
        p: &[Lanes3<V>; 3],
        normal: Lanes3<V>,
    ) -> u32 {
        let volume = dot(normal, p[0]);
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let rcp = one / volume;
        let mut reached = u32::MAX;
        if ANY || groups.is_behind {
            reached = self.set_up_side(groups, planes, None);
        }
        // Over the volume an edge function is positive on the side that faces the apex, and the corner's weight times 1/z.
        let each_inverse = map3(*p, |q| one / q[2]);
        let (edges, eps) = own_edges(groups, p, &each_inverse);
        let edges = map3(edges, |e| map3(e, |x| x * rcp));
        let size = volume.abs();
        let eps = map3(eps, |e| e * rcp.abs());
        // A corner beside or behind the apex sets no bound to what is nearest.
        let low = p[0][2].fast_min(p[1][2]).fast_min(p[2][2]);
        let high = p[0][2].fast_max(p[1][2]).fast_max(p[2][2]);
        let [a, b, c] = each_inverse;
        let nearest = select(zero.cmp_lt(low), a.fast_max(b).fast_max(c), V::splat(f32::MAX));
        // Those that are not negative are of corners ahead of it.
        let [a, b, c] = map3(each_inverse, |x| select(zero.cmp_lt(x), x, V::splat(f32::INFINITY)));
        let farthest = a.fast_min(b).fast_min(c);
        nearest.store(&mut planes.nearest);
        farthest.store(&mut planes.farthest);

        let in_front = self.lanes() & zero.cmp_lt(high).bits();
        // Seen from its own plane, or from its corner, a triangle has no depth that its corners would not belie.
        let [a, b, c] = map3(*p, sum);
        let (lengths, closest) = (sum(normal) * a, a.fast_min(b).fast_min(c));
        let farthest_corner = a.fast_max(b).fast_max(c);
        let away = |part: f32| (farthest_corner * V::splat(part)).cmp_lt(closest);
        // Where segments start behind something, those that are flat are left to the common formula instead.
        let apart = if ANY || groups.is_behind { V::splat(-1.0) } else { lengths * V::splat(LEAST_DISTANCE) };
        let edge_on = size.cmp_le(apart);
        let tells = V::splat(LEAST_VOLUME).cmp_le(size) & (lengths * V::splat(LEAST_PART)).cmp_lt(size);
        let tells = tells & away(LEAST_DISTANCE) & (!edge_on | away(NEAR_CORNER));
        planes.wild = in_front & !tells.bits();
        planes.edge_on = in_front & edge_on.bits() & !planes.wild;
        // Weights are for the nearest hit only.
        let steady = if ANY { u32::MAX } else { steady(groups, p, (&edges, &eps), high).bits() & !planes.edge_on };
        planes.unsteady = in_front & !steady;
        let eps = eps[0].fast_max(eps[1]).fast_max(eps[2]);
        (-eps).store(&mut planes.outside);
        select(edge_on, V::splat(f32::INFINITY), eps).store(&mut planes.inside);
        let own = |inverse: V| nearest.fast_min(farthest.fast_max(inverse));
        let [e0, e1, e2] = edges;
        planes.store(groups, &[e0, e1, e2, map3(normal, |n| n * rcp)], eps, own) & in_front & reached | planes.wild
    }
}

/// Triangles whose weights f32 tells well enough, by their edge functions, what may be wrong with these, and the depth of the farthest
/// corner.
#[inline(always)]
pub fn steady(groups: &Groups, p: &[Lanes3<V>; 3], (edges, eps): (&[Lanes3<V>; 3], &[V; 3]), high: V) -> Mask {
    let most = sum(p[0]).fast_max(sum(p[1])).fast_max(sum(p[2])) * V::splat(MOST_SHIFT);
    let is_steady = |k: usize| {
        // The edge's length as it is seen: its function's slope is that times the depth. An edge that is seen end-on moves far.
        let seen = edges[k][0].abs().fast_max(edges[k][1].abs());
        let near = (eps[k] * high).cmp_le(seen * most) | eps[k].cmp_lt(groups.smallest(&edges[k]));
        near & (eps[k] * high).cmp_le(V::splat(1.0 / LEAST_SUM))
    };
    is_steady(0) & is_steady(1) & is_steady(2)
}

impl Planes {
    /// The normal of triangle `i` that points away from the apex, and the way from its first corner to some starts.
    #[inline(always)]
    pub fn to_starts(&self, i: usize, starts: &Lanes3<V>) -> (Lanes3<V>, Lanes3<V>) {
        let way = each(|a| starts[a] - V::splat(self.side[a][i]));
        (each(|a| V::splat(self.side[a + 3][i])), way)
    }

    /// Finds out where functions are largest: for who asks set by set.
    #[inline(always)]
    pub fn find_corners(&mut self) {
        let [low, high] = [0, SETS as u32].map(|i| V::splat(f32::from_bits(i)));
        for (corner, linear) in self.corner.iter_mut().zip(&self.linear) {
            for (corner, slope) in corner.iter_mut().zip(linear) {
                let is_low = V::load(slope).cmp_lt(V::constant(0.0));
                *corner = bytemuck::cast(select(is_low, low, high).to_array());
            }
        }
    }

    /// Keeps the linear functions; returns the triangles whose largest values over the tile do not rule them out.
    /// `bound` is the largest 1/z that may be found, from the largest value of its function.
    #[inline(always)]
    pub fn store(&mut self, groups: &Groups, linear: &[Lanes3<V>; 4], eps: V, bound: impl Fn(V) -> V) -> u32 {
        let zero = V::constant(0.0);
        let [[s0, s1], [t0, t1]] = splats(&groups.bounds);
        let mut seen = V::splat(f32::INFINITY);
        for (k, f) in linear.iter().enumerate() {
            let negative = [f[0].cmp_lt(zero), f[1].cmp_lt(zero)];
            let (s, t) = (select(negative[0], s0, s1), select(negative[1], t0, t1));
            let value = f[0].mul_add(s, f[1].mul_add(t, f[2]));
            let margin = if k < 3 { value + eps } else { bound(value) - V::splat(groups.nearest) };
            seen = seen.fast_min(margin);
            for (to, x) in self.linear[k].iter_mut().zip(f) {
                x.store(to);
            }
        }
        zero.cmp_le(seen).bits()
    }
}
