//! The tile's own answers: hits by its own arithmetic, whose accuracy [`super::batch`] states. They are repeatable and
//! watertight, and differ from the common formula's where rounding can tell two answers apart.

use glam::DVec3;

use super::batch::{Batch, Planes};
use super::bundle::Bundle;
use super::exact::Exact;
use super::groups::{Group, Groups, NO_SLOT};
use super::shapes;
use super::{Mask, V, select};
use crate::lanes::chosen::merge;
use crate::lanes::past::store_past;
use crate::lanes::words::{below, positions};
use crate::lanes::{LaneMask, Lanes, dot, each};
use crate::ray::{HitPacket, Hits, INVALID_ID};
use crate::shape::{Block, Triangle};

/// 1/z of triangle `i` where its plane says `inverse`: not nearer and not farther than its corners.
#[inline(always)]
pub fn own_depth(planes: &Planes, i: usize, inverse: V) -> V {
    V::splat(planes.nearest[i]).fast_min(V::splat(planes.farthest[i]).fast_max(inverse))
}

/// What a pair of triangle and group came to.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// Some ray hit the triangle.
    pub hit: bool,
    /// Some ray passes an edge within its rounding: for [`pair_doubtful`].
    pub doubt: bool,
}

/// The numbers of a triangle: ties of depth go to the smaller instance, then to the smaller primitive.
#[derive(Clone, Copy, Debug)]
pub struct Id {
    /// Instance.
    pub inst: u32,
    /// Primitive.
    pub prim: u32,
}

impl Id {
    /// Lanes of a group that hit nothing yet or something with larger numbers. `MANY`: there are instances.
    #[inline(always)]
    pub fn comes_first<const MANY: bool>(self, groups: &Groups, g: usize) -> Mask {
        let smaller = below(self.prim, &groups.of[g].slot);
        if !MANY {
            return Mask::from_bits(smaller);
        }
        let inst = &groups.inst[g];
        Mask::from_bits(below(self.inst, inst) | positions(inst, self.inst) & smaller)
    }

    /// Names the triangle as what some lanes hit.
    #[inline(always)]
    pub fn name<const MANY: bool>(self, groups: &mut Groups, g: usize, hit: Mask) {
        groups.of[g].slot = merge(hit, self.prim, groups.of[g].slot);
        if MANY {
            groups.inst[g] = merge(hit, self.inst, groups.inst[g]);
        }
    }
}

/// One triangle against the rays of one group that share their origin.
#[inline(always)]
pub fn pair<const ANY: bool, const MANY: bool>(
    groups: &mut Groups,
    planes: &Planes,
    g: usize,
    i: usize,
    id: Id,
) -> Verdict {
    let (inside, maybe, edges) = inside(groups, planes, g, i);
    let inverse = own_depth(planes, i, linear(groups, planes, g, i, 3));
    let best = groups.of[g].inv_lo;
    let reached = inverse.cmp_le(groups.of[g].inv_hi) & best.cmp_le(inverse);
    let doubt = (maybe & reached).any();
    if ANY {
        return Verdict { hit: occlude(groups, g, inside & reached), doubt };
    }
    let nearer = best.cmp_lt(inverse) | id.comes_first::<MANY>(groups, g);
    let hit = inside & reached & nearer;
    id.name::<MANY>(groups, g, hit);
    keep(groups, planes, g, i, hit, inverse, edges);
    Verdict { hit: hit.any(), doubt }
}

/// Keeps the depth and the weights of a hit; `edges` are the edge functions.
#[inline(always)]
fn keep(groups: &mut Groups, planes: &Planes, g: usize, i: usize, hit: Mask, inverse: V, edges: [V; 3]) {
    let [e0, e1, e2] = each(|k| edges[k] - V::splat(planes.eps[k][i]));
    let Group { inv_lo, weights, .. } = &mut groups.of[g];
    *inv_lo = select(hit, inverse, *inv_lo);
    weights[0] = select(hit, e1, weights[0]);
    weights[1] = select(hit, e2, weights[1]);
    weights[2] = select(hit, e0 + e1 + e2, weights[2]);
}

/// One triangle against the rays of one group that share their end (any-hit).
///
/// Such rays start on surfaces, a few roundings in front of them. Depths from the far end cannot tell which side of
/// its own surface a ray starts on; where the start lies with respect to the triangle's plane can.
#[inline(always)]
pub fn pair_to_end(groups: &mut Groups, planes: &Planes, g: usize, i: usize) -> Verdict {
    let (inside, maybe, _) = inside(groups, planes, g, i);
    let behind = behind(groups, planes, g, i);
    let mut reached = V::constant(0.0).cmp_le(behind) & groups.of[g].inv_lo.cmp_lt(V::splat(f32::INFINITY));
    if groups.ends_early {
        reached = reached & own_depth(planes, i, linear(groups, planes, g, i, 3)).cmp_le(groups.of[g].inv_hi);
    }
    let doubt = (maybe & reached).any();
    Verdict { hit: occlude(groups, g, inside & reached), doubt }
}

/// One triangle against the rays of one group that share a point behind them. As with a common end, which side of a triangle
/// they start on is told by the start; and so is how far ahead of it they hit.
#[inline(always)]
pub fn pair_ahead(groups: &mut Groups, planes: &Planes, g: usize, i: usize, id: Id) -> Verdict {
    let (inside, maybe, edges) = inside(groups, planes, g, i);
    let inverse = own_depth(planes, i, linear(groups, planes, g, i, 3));
    let best = groups.of[g].inv_lo;
    let ahead = -behind(groups, planes, g, i);
    let reached = V::constant(0.0).cmp_le(ahead) & best.cmp_le(inverse);
    let nearer = best.cmp_lt(inverse) | id.comes_first::<false>(groups, g);
    let hit = inside & reached & nearer;
    groups.ahead[g] = select(hit, ahead * V::splat(planes.rcp[i]), groups.ahead[g]);
    id.name::<false>(groups, g, hit);
    keep(groups, planes, g, i, hit, inverse, edges);
    Verdict { hit: hit.any(), doubt: (maybe & reached).any() }
}

/// How far the segments of a group start behind a triangle's plane as seen from their common point; in some unit.
#[inline(always)]
fn behind(groups: &Groups, planes: &Planes, g: usize, i: usize) -> V {
    let (normal, way) = planes.to_starts(i, &groups.of[g].start);
    dot(normal, way)
}

/// [`pair`] where edges need more digits than f32 has: for a sliver, a triangle much smaller than a pixel, or rays that
/// pass an edge within its rounding. What is not certainly outside is looked at again in f64, for the same corners and
/// rays.
#[cold]
#[inline(never)]
pub fn pair_doubtful<const ANY: bool, const MANY: bool>(
    groups: &mut Groups,
    planes: &Planes,
    g: usize,
    i: usize,
    id: Id,
    to_end: bool,
) -> bool {
    let (inside, doubtful, _) = inside(groups, planes, g, i);
    let inverse = own_depth(planes, i, linear(groups, planes, g, i, 3));
    let best = groups.of[g].inv_lo;
    let mut maybe = (inside | doubtful) & inverse.cmp_le(groups.of[g].inv_hi);
    if ANY && to_end {
        maybe = maybe & V::constant(0.0).cmp_le(behind(groups, planes, g, i)) & best.cmp_lt(V::splat(f32::INFINITY));
    } else {
        maybe = maybe & best.cmp_le(inverse);
    }
    let mut ahead = V::constant(0.0);
    if !ANY {
        maybe = maybe & (best.cmp_lt(inverse) | id.comes_first::<MANY>(groups, g));
        if groups.is_behind {
            ahead = -behind(groups, planes, g, i);
            maybe = maybe & V::constant(0.0).cmp_le(ahead);
        }
    }
    let (mut rest, mut hit) = (maybe.bits(), 0);
    let mut weights = groups.of[g].weights.map(V::to_array);
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize & 15;
        rest &= rest - 1;
        let ray = [groups.of[g].s.to_array()[lane], groups.of[g].t.to_array()[lane], 1.0].map(f64::from);
        let corners = planes.corners.map(|p| p.map(|x| f64::from(x[i])));
        if let Some(found) = weights_f64(corners, ray) {
            hit |= 1 << lane;
            (0..3).for_each(|k| weights[k][lane] = found[k] as f32);
        }
    }
    let hit = Mask::from_bits(hit);
    if ANY {
        return occlude(groups, g, hit);
    }
    groups.of[g].inv_lo = select(hit, inverse, best);
    if groups.is_behind {
        groups.ahead[g] = select(hit, ahead * V::splat(planes.rcp[i]), groups.ahead[g]);
    }
    id.name::<MANY>(groups, g, hit);
    groups.of[g].weights = weights.map(V::new);
    hit.any()
}

/// Weights of the second and third corner and one, if the ray through the apex meets the triangle.
fn weights_f64(corners: [[f64; 3]; 3], ray: [f64; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = corners.map(|p| [p[0] - ray[0] * p[2], p[1] - ray[1] * p[2]]);
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    // Seen along the ray; nothing may pass between neighbours, so a rounding error counts as inside.
    let spread = [a, b, c].into_iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let edges = [cross(b, c), cross(c, a), cross(a, b)];
    let sum = edges[0] + edges[1] + edges[2];
    let eps = 16.0 * f64::EPSILON * spread * spread;
    // The side of the triangle that faces the apex.
    let [p, q, r] = corners.map(DVec3::from_array);
    let facing = p.dot(q.cross(r)).signum();
    let inside = edges.iter().all(|e| e * facing >= -eps);
    (inside && sum != 0.0).then(|| [(edges[1] / sum).clamp(0.0, 1.0), (edges[2] / sum).clamp(0.0, 1.0), 1.0])
}

/// A linear function of triangle `i` at the rays of a group.
#[inline(always)]
fn linear(groups: &Groups, planes: &Planes, g: usize, i: usize, k: usize) -> V {
    let [x, y, z] = each(|x| V::splat(planes.linear[k][x][i]));
    x.mul_add(groups.of[g].s, y.mul_add(groups.of[g].t, z))
}

/// Lanes surely inside the triangle, lanes that rounding may have put on the wrong side of an edge, and the edge
/// functions.
#[inline(always)]
fn inside(groups: &Groups, planes: &Planes, g: usize, i: usize) -> (Mask, Mask, [V; 3]) {
    let edges = each(|k| linear(groups, planes, g, i, k));
    let least = edges[0].fast_min(edges[1]).fast_min(edges[2]);
    let sure = V::splat(planes.sure[i]);
    (sure.cmp_le(least), V::constant(0.0).cmp_le(least) & least.cmp_lt(sure), edges)
}

/// Whether some ray of a group is not certainly outside triangle `i`.
#[inline(always)]
pub fn may_be_inside(groups: &Groups, planes: &Planes, g: usize, i: usize) -> bool {
    let (inside, doubtful, _) = inside(groups, planes, g, i);
    (inside | doubtful).any()
}

/// Lanes that found something want nothing any more.
#[inline(always)]
pub fn occlude(groups: &mut Groups, g: usize, hit: Mask) -> bool {
    groups.of[g].inv_lo = select(hit, V::splat(f32::INFINITY), groups.of[g].inv_lo);
    groups.of[g].done |= hit.bits();
    hit.any()
}

/// Where the tile's arithmetic is of no use (tiny triangles, triangles seen edge-on): one triangle against one group by
/// the common formula. Whether it was hit.
#[cold]
#[inline(never)]
pub fn decide<const ANY: bool, const MANY: bool>(
    groups: &mut Groups,
    exact: &Exact,
    g: usize,
    batch: &Batch,
    i: usize,
) -> bool {
    let (id, mut block) = (Id { inst: batch.inst[i], prim: batch.id[i] }, Block::empty());
    let (packet, t_max, tame) = if MANY {
        let object = exact.world.instances[id.inst as usize].object;
        let blocks = &exact.world.objects[object as usize].triangles;
        let (at, place) = ((batch.slot[i] >> 3) as usize, (batch.slot[i] & 7) as usize);
        block.set(0, blocks[at].get(place), id.prim);
        shapes::enter(exact, id.inst, g)
    } else {
        block.set(0, batch.corners(i), id.prim);
        let (packet, t_max) = exact.bundle.packet(g);
        (packet, t_max, exact.bundle.tame[g])
    };
    let one = V::constant(1.0);
    let mut any = false;
    Triangle::intersect(&packet, t_max, &block, 1, tame, |found, lanes, _| {
        let hit = found.hit & found.t.cmp_le(t_max) & Mask::from_bits(lanes);
        if ANY {
            any |= occlude(groups, g, hit);
            return;
        }
        let way = groups.way(g, found.t);
        let inverse = (one / (way * groups.of[g].speed)).fast_min(V::splat(f32::MAX));
        let best = groups.of[g].inv_lo;
        let tie = best.cmp_eq(inverse) & id.comes_first::<MANY>(groups, g);
        let wins = hit & (best.cmp_lt(inverse) | tie);
        groups.of[g].inv_lo = select(wins, inverse, best);
        if groups.is_behind {
            groups.ahead[g] = select(wins, found.t / way, groups.ahead[g]);
        }
        id.name::<MANY>(groups, g, wins);
        for (weight, x) in groups.of[g].weights.iter_mut().zip([found.u, found.v, one]) {
            *weight = select(wins, x, *weight);
        }
        any |= wins.any();
    });
    any
}

impl Groups {
    /// Lanes of a group that hit something, and t, u, v there (elsewhere u and v are 0).
    #[inline(always)]
    fn own_numbers(&self, g: usize, bundle: &Bundle) -> (Mask, V, V, V) {
        let found = Mask::from_bits(!positions(&self.of[g].slot, NO_SLOT));
        let one = V::constant(1.0);
        let [t_min, t_max] = bundle.ends(g);
        let part = if self.is_behind { self.ahead[g] } else { one };
        let t = t_min.fast_max(t_max.fast_min(part / (self.of[g].inv_lo * self.of[g].speed)));
        let [u, v, sum] = self.of[g].weights;
        let scale = one / sum;
        let or_zero = |x: V| select(found, x * scale, V::constant(0.0));
        (found, t, or_zero(u), or_zero(v))
    }

    /// Writes a group's own hits and misses. `past`: past the caches.
    #[inline(always)]
    pub fn store_own(&self, g: usize, bundle: &Bundle, hits: &mut Hits<f32>, past: bool) {
        let (found, t, u, v) = self.own_numbers(g, bundle);
        let first = bundle.first + g * V::N;
        let store = |x: &[u32; 16], to: &mut [u32]| match to[first..].first_chunk_mut() {
            Some(to) if past => store_past(x, to),
            Some(to) => *to = *x,
            None => {}
        };
        let t = select(found, t, V::splat(f32::INFINITY));
        for (x, to) in [(t, &mut hits.t), (u, &mut hits.u), (v, &mut hits.v)] {
            store(&bytemuck::cast(x.to_array()), bytemuck::cast_slice_mut(to));
        }
        store(&self.of[g].slot, &mut hits.prim);
        if self.many {
            return store(&self.inst[g], &mut hits.inst);
        }
        let none = V::splat(f32::from_bits(INVALID_ID));
        store(&bytemuck::cast(select(found, V::constant(0.0), none).to_array()), &mut hits.inst);
    }

    /// A group's own hits for the packet kernel to go on with.
    pub fn own_hits(&self, g: usize, bundle: &Bundle) -> HitPacket<V> {
        let (found, t, u, v) = self.own_numbers(g, bundle);
        let mut hit = HitPacket::new(select(found, t, bundle.ends(g)[1]));
        (hit.u, hit.v, hit.prim) = (u, v, self.of[g].slot);
        hit.inst = match self.many {
            true => self.inst[g],
            false => self.of[g].slot.map(|prim| if prim == NO_SLOT { INVALID_ID } else { 0 }),
        };
        hit
    }
}
