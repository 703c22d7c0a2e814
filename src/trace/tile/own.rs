//! The tile's own answers: hits by its own arithmetic, whose accuracy [`super::batch`] states. They are repeatable and
//! watertight, and differ from the common formula's where rounding can tell two answers apart.

use glam::DVec3;

use super::batch::{Batch, Planes};
use super::bundle::Bundle;
use super::dead::store;
use super::exact::Exact;
use super::groups::{Group, Groups, NO_SLOT};
use super::held::{Line, Plane};
use super::parallel::Parallel;
use super::shapes;
use super::{Mask, V, select};
use crate::lanes::chosen::merge;
use crate::lanes::words::{below, positions};
use crate::lanes::{LaneMask, Lanes, f64x8, map3};
use crate::ray::{HitPacket, Hits, INVALID_ID};
use crate::scene::world::Names;
use crate::shape::{Block, Triangle};

/// The numbers of a triangle: ties of depth go to the smaller instance, then to the smaller primitive.
#[derive(Clone, Copy, Debug)]
pub struct Id {
    /// Instance.
    pub inst: u32,
    /// Primitive.
    pub prim: u32,
}

impl Id {
    /// Lanes of a group that hit nothing yet, or this triangle or one with larger numbers. `MANY`: there are instances.
    #[inline(always)]
    pub fn is_not_after<const MANY: bool>(self, groups: &Groups, g: usize) -> Mask {
        let slots = &groups.of[g].slot;
        let prim = below(self.prim, slots) | positions(slots, self.prim);
        if !MANY {
            return Mask::from_bits(prim);
        }
        let inst = &groups.inst[g];
        Mask::from_bits(below(self.inst, inst) | positions(inst, self.inst) & prim)
    }

    /// Lanes of a group whose best hit is the triangle.
    #[inline(always)]
    pub fn is_of<const MANY: bool>(self, groups: &Groups, g: usize) -> Mask {
        let prim = positions(&groups.of[g].slot, self.prim);
        Mask::from_bits(if MANY { prim & positions(&groups.inst[g], self.inst) } else { prim })
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

/// Keeps the depth and the weights of a hit.
#[inline(always)]
fn keep(groups: &mut Groups, g: usize, hit: Mask, inverse: V, found: [V; 2]) {
    let Group { inv_lo, weights, .. } = &mut groups.of[g];
    *inv_lo = select(hit, inverse, *inv_lo);
    weights[0] = select(hit, found[0], weights[0]);
    weights[1] = select(hit, found[1], weights[1]);
}

/// [`Plane::meet`] where edges need more digits than f32 has: for rays that pass an edge within its rounding, and for the weights of
/// slivers and of triangles much smaller than a pixel. What is not certainly outside is looked at again in f64, for the same
/// corners and rays; so is what was found in a triangle whose weights need it. A lane that is certain keeps the weights of
/// [`Plane::meet`], whatever brought its group here: another order of triangles brings others.
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
    let (plane, line) = (Plane::of(planes, i), Line::of(groups, g));
    let (inverse, best, edges) = (plane.depth(&line), line.best, plane.edges(&line));
    if !ANY && planes.edge_on >> i & 1 != 0 {
        return pair_edge_on::<MANY>(groups, planes, g, i, id, edges.possible.bits());
    }
    let mut maybe = edges.possible;
    if groups.ends_early {
        maybe = maybe & inverse.cmp_le(groups.of[g].inv_hi);
    }
    if ANY && to_end {
        maybe = maybe & V::constant(0.0).cmp_le(plane.behind(&line)) & best.cmp_lt(V::splat(f32::INFINITY));
    } else {
        maybe = maybe & best.cmp_le(inverse);
    }
    let mut ahead = V::constant(0.0);
    if !ANY {
        maybe = maybe & (best.cmp_lt(inverse) | id.is_not_after::<MANY>(groups, g));
        if groups.is_behind {
            ahead = -plane.behind(&line);
            maybe = maybe & V::constant(0.0).cmp_le(ahead);
        }
    }
    let (inside, weights) = exact_weights(groups, planes, g, i, maybe.bits());
    if ANY {
        return occlude(groups, g, inside);
    }
    let certain = edges.certain & maybe;
    let hit = inside | certain;
    let keeps = if planes.unsteady >> i & 1 != 0 { Mask::from_bits(0) } else { certain };
    if groups.is_behind {
        groups.ahead[g] = select(hit, plane.share(ahead), groups.ahead[g]);
    }
    id.name::<MANY>(groups, g, hit);
    let unit = groups.unit(inverse);
    let weights = [0, 1].map(|k| select(keeps, edges.weights[k], weights[k] * unit));
    keep(groups, g, hit, inverse, weights);
    hit.any()
}

/// [`pair_doubtful`] for a triangle that is seen edge-on: its depth is that of the place its weights say.
#[cold]
#[inline(never)]
fn pair_edge_on<const MANY: bool>(
    groups: &mut Groups,
    planes: &Planes,
    g: usize,
    i: usize,
    id: Id,
    possible: u32,
) -> bool {
    let (inside, weights) = exact_weights(groups, planes, g, i, possible);
    let [z, one, other] = planes.corners.map(|p| p[2][i]);
    let [one, other] = [one - z, other - z].map(V::splat);
    let depth = weights[0].mul_add(one, weights[1].mul_add(other, V::splat(z)));
    let inverse = (V::constant(1.0) / depth).fast_min(V::splat(f32::MAX));
    let best = groups.of[g].inv_lo;
    let mut hit = inside & best.cmp_le(inverse) & (best.cmp_lt(inverse) | id.is_not_after::<MANY>(groups, g));
    if groups.ends_early {
        hit = hit & inverse.cmp_le(groups.of[g].inv_hi);
    }
    id.name::<MANY>(groups, g, hit);
    keep(groups, g, hit, inverse, weights.map(|weight| weight * inverse));
    hit.any()
}

impl Batch {
    /// Puts the corners where weights are told in f64: few batches need them.
    #[cold]
    #[inline(never)]
    pub fn put_corners(&self, groups: &Groups, planes: &mut Planes) {
        let p = self.seen(groups, groups.many);
        let is_flat = groups.frame.parallel.is_some();
        planes.corners = map3(p, |[x, y, z]| [x, y, if is_flat { V::constant(1.0) } else { z }].map(V::to_array));
    }
}

/// Which of the `wanted` lanes of a group meet triangle `i`, and the weights of its second and third corner there, in f64.
#[inline(always)]
fn exact_weights(groups: &Groups, planes: &Planes, g: usize, i: usize, wanted: u32) -> (Mask, [V; 2]) {
    let corners = planes.corners.map(|p| p.map(|x| f64::from(x[i])));
    let [s, t] = [groups.of[g].s, groups.of[g].t].map(V::to_array);
    let (mut hit, mut weights) = (0, [[0.0; 16]; 2]);
    for half in (0..2).filter(|half| wanted >> (8 * half) & 0xff != 0) {
        let ray = [s, t].map(|x| f64x8::new(std::array::from_fn(|k| f64::from(x[8 * half + k]))));
        let (inside, found) = weights_f64(&corners, ray);
        hit |= inside << (8 * half);
        for (weight, x) in weights.iter_mut().zip(found) {
            let x = x.to_array();
            (0..8).for_each(|k| weight[8 * half + k] = x[k] as f32);
        }
    }
    (Mask::from_bits(hit & wanted), weights.map(V::new))
}

/// Which of eight rays through the apex meet the triangle, and the weights of the second and third corner.
#[inline(always)]
fn weights_f64(corners: &[[f64; 3]; 3], ray: [f64x8; 2]) -> (u32, [f64x8; 2]) {
    let (zero, one) = (f64x8::splat(0.0), f64x8::splat(1.0));
    let [a, b, c] = map3(*corners, |p| [0, 1].map(|k| f64x8::splat(p[k]) - ray[k] * f64x8::splat(p[2])));
    let cross = |p: [f64x8; 2], q: [f64x8; 2]| p[0] * q[1] - p[1] * q[0];
    // Seen along the ray; nothing may pass between neighbours, so a rounding error counts as inside.
    let [a_size, b_size, c_size] = map3([a, b, c], |p| Lanes::abs(p[0]).fast_max(Lanes::abs(p[1])));
    let spread = a_size.fast_max(b_size).fast_max(c_size);
    let edges = [cross(b, c), cross(c, a), cross(a, b)];
    let sum = edges[0] + edges[1] + edges[2];
    let eps = f64x8::splat(16.0 * f64::EPSILON) * spread * spread;
    // The side of the triangle that faces the apex.
    let [p, q, r] = corners.map(DVec3::from_array);
    let facing = f64x8::splat(p.dot(q.cross(r)).signum());
    let [e0, e1, e2] = map3(edges, |e| e * facing);
    let inside = (-eps).cmp_le(e0.fast_min(e1).fast_min(e2)).bits() & !sum.cmp_eq(zero).bits();
    let weight = |e: f64x8| zero.fast_max(one.fast_min(e / sum));
    (inside, [weight(edges[1]), weight(edges[2])])
}

/// Whether some ray of a group is not certainly outside triangle `i`.
#[inline(always)]
pub fn may_be_inside(groups: &Groups, planes: &Planes, g: usize, i: usize) -> bool {
    Plane::of(planes, i).edges(&Line::of(groups, g)).possible.any()
}

/// Lanes that found something want nothing any more.
#[inline(always)]
pub fn occlude(groups: &mut Groups, g: usize, hit: Mask) -> bool {
    groups.of[g].inv_lo = select(hit, V::splat(f32::INFINITY), groups.of[g].inv_lo);
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
        let segments = exact.bundle.segments(g);
        match shapes::enter(exact, id.inst, &segments, exact.bundle.tame[g]) {
            Some(entered) => entered,
            None => return false,
        }
    } else {
        block.set(0, batch.corners(i), id.prim);
        let (packet, t_max) = exact.bundle.packet(g);
        (packet, t_max, exact.bundle.tame[g])
    };
    let mut any = false;
    Triangle::intersect(&packet, t_max, &block, 1, tame, |found, lanes, _| {
        let hit = found.hit & found.t.cmp_le(t_max) & Mask::from_bits(lanes);
        if ANY {
            any |= occlude(groups, g, hit);
            return;
        }
        let (inverse, share) = match &groups.frame.parallel {
            Some(parallel) => (parallel.height_at(groups.behind[g], found.t), found.t - packet.t_min),
            None => {
                let way = groups.way(g, found.t);
                ((groups.of[g].slowness / way).fast_min(V::splat(f32::MAX)), found.t / way)
            }
        };
        let unit = groups.unit(inverse);
        let best = groups.of[g].inv_lo;
        let tie = best.cmp_eq(inverse) & id.is_not_after::<MANY>(groups, g);
        let wins = hit & (best.cmp_lt(inverse) | tie);
        groups.of[g].inv_lo = select(wins, inverse, best);
        if groups.is_behind {
            groups.ahead[g] = select(wins, share, groups.ahead[g]);
        }
        id.name::<MANY>(groups, g, wins);
        for (weight, x) in groups.of[g].weights.iter_mut().zip([found.u, found.v]) {
            *weight = select(wins, x * unit, *weight);
        }
        any |= wins.any();
    });
    any
}

impl Groups {
    /// Lanes of a group that hit something, and t, u, v there (elsewhere u and v are 0).
    #[inline(always)]
    fn own_numbers(&self, g: usize, bundle: &Bundle) -> (Mask, V, V, V) {
        if self.full {
            return self.whole_numbers(g);
        }
        let found = Mask::from_bits(!positions(&self.of[g].slot, NO_SLOT));
        let (depth, t) = match &self.frame.parallel {
            Some(parallel) => (V::constant(1.0), self.way_along(parallel, g, bundle)),
            None => {
                let depth = V::constant(1.0) / self.of[g].inv_lo;
                let t = depth * self.of[g].slowness;
                (depth, if self.is_behind { t * self.ahead[g] } else { t })
            }
        };
        let mut t = t;
        if !self.endless {
            let [t_min, t_max] = bundle.ends(g);
            t = t_min.fast_max(t_max.fast_min(t));
        }
        let [u, v] = self.of[g].weights.map(|w| select(found, w * depth, V::constant(0.0)));
        (found, t, u, v)
    }

    /// The same of a full tile of rays that start in the common point and have no end.
    #[inline(always)]
    pub fn whole_numbers(&self, g: usize) -> (Mask, V, V, V) {
        let Group { slot, inv_lo, slowness, weights, .. } = &self.of[g];
        let found = Mask::from_bits(!positions(slot, NO_SLOT));
        let depth = V::constant(1.0) / *inv_lo;
        let [u, v] = weights.map(|w| select(found, w * depth, V::constant(0.0)));
        (found, depth * *slowness, u, v)
    }

    /// Of rays of one direction: their parameters at their hits.
    #[inline(never)]
    fn way_along(&self, parallel: &Parallel, g: usize, bundle: &Bundle) -> V {
        let start = bundle.ends(g)[0];
        parallel.between(start + self.ahead[g], self.behind[g], self.of[g].inv_lo).fast_max(start)
    }

    /// Writes a group's own hits and misses, by their names. `past`: past the caches.
    #[inline(always)]
    pub fn store_own(&self, g: usize, bundle: &Bundle, to: (&mut Hits<f32>, Option<&Names>), past: bool) {
        self.store(g, bundle.first + g * V::N, self.own_numbers(g, bundle), to, past);
    }

    /// Writes a group's numbers from ray `first` on.
    #[inline(always)]
    pub fn store(
        &self,
        g: usize,
        first: usize,
        (found, t, u, v): (Mask, V, V, V),
        (hits, names): (&mut Hits<f32>, Option<&Names>),
        past: bool,
    ) {
        let store = |x: &[u32; 16], to: &mut [u32]| store(x, to, first, past);
        let t = select(found, t, V::splat(f32::INFINITY));
        let none = V::splat(f32::from_bits(INVALID_ID));
        for (x, to) in [(t, &mut hits.t), (u, &mut hits.u), (v, &mut hits.v)] {
            store(&bytemuck::cast(x.to_array()), bytemuck::cast_slice_mut(to));
        }
        if let Some(names) = names {
            let (mut prim, mut inst) = (self.of[g].slot, if self.many { self.inst[g] } else { [0; 16] });
            names.apply(&mut prim, &mut inst);
            store(&prim, &mut hits.prim);
            return store(
                &bytemuck::cast(select(found, V::new(bytemuck::cast(inst)), none).to_array()),
                &mut hits.inst,
            );
        }
        store(&self.of[g].slot, &mut hits.prim);
        if self.many {
            return store(&self.inst[g], &mut hits.inst);
        }
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
