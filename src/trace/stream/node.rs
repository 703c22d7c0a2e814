//! A chunk's rays against the boxes of a node.

use super::chunk::{Chunk, RAYS, Set};
use crate::bvh::Node;
use crate::lanes::marks::{Marks, marked};
use crate::lanes::{LaneMask, Lanes, Real, each, map3};
use crate::ray::slab::{Interval, PAD, pad};

/// From this many rays on, for each register that a vector of rays fills, they are tested as vectors, if that is less to do.
pub const DENSE: u32 = 32;

/// How many rays' tests of a node take as long as a register's test of one box.
const BOX: u32 = 2;

/// How many registers a vector of rays takes.
const fn registers<V: Lanes>() -> u32 {
    let lanes = <<V::Scalar as Real>::Children as Lanes>::N;
    V::N.div_ceil(lanes) as u32
}

/// Which rays meet which child of a node that has `W`.
pub struct Met<S, const W: usize> {
    /// Children that some ray meets, as bits.
    pub children: u32,
    /// Rays that meet each child: of the first and of the second 64 of the chunk.
    halves: [[u64; W]; 2],
    /// Order of the children.
    pub near: [S; W],
    /// Whether `near` is where the first ray enters.
    pub bound: bool,
}

impl<S, const W: usize> Met<S, W> {
    /// Rays that meet a child.
    #[inline(always)]
    pub fn rays(&self, slot: usize) -> Set {
        Set::from(self.halves[0][slot]) | Set::from(self.halves[1][slot]) << 64
    }
}

/// The planes of all children that rays of one octant meet first and last, axis by axis.
pub type Planes<'a, S, const W: usize> = [(&'a [S; W], &'a [S; W]); 3];

#[inline(always)]
pub fn planes<S, const W: usize>(node: &Node<S, W>, octant: usize) -> Planes<'_, S, W> {
    each(|axis| {
        let [low, high] = &node.bounds[axis];
        if octant >> axis & 1 == 0 { (low, high) } else { (high, low) }
    })
}

/// Tests `rays` of a chunk, all of one octant, whose segments end at `t`. `V`: vectors of rays; `E`: of a node's children.
#[inline(always)]
pub fn meet<V: Lanes, E: Lanes<Scalar = V::Scalar>, const W: usize, const ANY: bool>(
    node: &Node<V::Scalar, W>,
    chunk: &Chunk<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    octant: usize,
) -> Met<V::Scalar, W> {
    let many = rays.count_ones();
    if many >= const { DENSE * registers::<V>() }
        && let Some(bounds) = &chunk.bounds
    {
        let children = bounds.children::<E, W>(&planes(node, octant), octant) & ((1 << node.used) - 1);
        let boxes = children.count_ones() * chunk.len.div_ceil(V::N) as u32;
        if const { BOX * registers::<V>() } * boxes <= many {
            return dense::<V, W, ANY, false>(node, chunk, t, rays, (octant, children));
        }
    }
    sparse::<E, W, ANY>(node, chunk, t, rays, octant)
}

/// One ray after the other against all children.
#[inline(always)]
fn sparse<E: Lanes, const W: usize, const ANY: bool>(
    node: &Node<E::Scalar, W>,
    chunk: &Chunk<E::Scalar>,
    t: &[E::Scalar; RAYS],
    rays: Set,
    octant: usize,
) -> Met<E::Scalar, W> {
    let planes = map3(planes(node, octant), |(near, far)| (E::load(near), E::load(far)));
    if chunk.steep {
        return one_by_one::<E, W, ANY>(rays, |ray| exact(&planes, chunk, t, ray));
    }
    let mut met = one_by_one::<E, W, ANY>(rays, |ray| quick(&planes, chunk, t, ray));
    if !ANY {
        loosened(E::load(&met.near)).store(&mut met.near);
    }
    met
}

/// Where [`quick`] enters boxes, moved to where [`exact`] may.
#[inline(always)]
pub fn loosened<E: Lanes>(near: E) -> E {
    near - near.abs() * E::constant(WIDER * E::Scalar::EPSILON.to_f64())
}

/// `test(i)`: which children ray `i` meets, and where it enters them.
#[inline(always)]
pub fn one_by_one<E: Lanes, const W: usize, const ANY: bool>(
    rays: Set,
    test: impl Fn(usize) -> (E::Mask, E),
) -> Met<E::Scalar, W> {
    let mut marks = [Marks::<E>::none(); 2];
    let mut first = E::splat(E::Scalar::INFINITY);
    for (half, marks) in marks.iter_mut().enumerate() {
        let mut rest = (rays >> (64 * half)) as u64;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let (meets, near) = test((64 * half + i) & (RAYS - 1));
            if !ANY {
                first = E::select(meets, near.fast_min(first), first);
            }
            *marks = marks.with(meets, i);
        }
    }
    let mut near = [E::Scalar::ZERO; W];
    if !ANY {
        first.store(&mut near);
    }
    // Slots without a child are empty boxes, which no ray of an octant meets.
    let halves = marks.map(Marks::words);
    // Not ray by ray: to ask all words in the end costs less.
    Met { children: marked(&halves[0]) | marked(&halves[1]), halves, near, bound: true }
}

/// The near and far planes of a node's boxes, axis by axis.
type Boxes<E> = [(E, E); 3];

/// The box test of all engines.
#[inline(always)]
pub fn exact<E: Lanes>(planes: &Boxes<E>, chunk: &Chunk<E::Scalar>, t: &[E::Scalar; RAYS], ray: usize) -> (E::Mask, E) {
    let [x, y, z] = each(|a| {
        let (org, rcp) = (E::splat(chunk.org[a][ray]), E::splat(chunk.rcp[a][ray]));
        ((planes[a].0 - org) * rcp, (planes[a].1 - org) * rcp)
    });
    let near = x.0.fast_max(y.0).fast_max(z.0);
    let interval = Interval { near, far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
    (interval.meets(E::splat(chunk.t_min[ray]), E::splat(t[ray])), near)
}

/// How much more than [`pad`] the ends are moved outwards by [`quick`], in half ulps.
///
/// With `u` half an ulp of 1, `T` what exact arithmetic gives and `P` the product of origin and reciprocal: [`exact`] is off by
/// less than `2.1 u |T|`. `quick` is off by less than `2.2 u |T|` (without fused operations) and, by them and the two roundings
/// of the shift, `3.2 u |P|`; but the shift was moved by `4 u |P|` the safe way. So `quick` starts no more than `4.4 u |T|`
/// behind `exact` and ends no more than that before it: less than half of what the end is moved by beyond [`PAD`].
const WIDER: f64 = 12.0;

/// [`exact`] or more, in half the operations: planes times reciprocals less what the origin contributes, fused. It may meet boxes
/// that `exact` just misses, and never the other way round. For rays that do not start behind their origins.
#[inline(always)]
pub fn quick<E: Lanes>(planes: &Boxes<E>, chunk: &Chunk<E::Scalar>, t: &[E::Scalar; RAYS], ray: usize) -> (E::Mask, E) {
    let [x, y, z] = each(|a| {
        let rcp = E::splat(chunk.rcp[a][ray]);
        let [near, far] = [0, 1].map(|end: usize| E::splat(chunk.shift[end][a][ray]));
        (planes[a].0.mul_add(rcp, -near), planes[a].1.mul_add(rcp, -far))
    });
    let near = x.0.fast_max(y.0).fast_max(z.0);
    let far = E::splat(t[ray]).fast_min(x.1.fast_min(y.1).fast_min(z.1));
    // What ends behind a start at 0 or later is missed whichever way it is moved.
    let far = far.mul_add(E::constant((PAD + WIDER) * E::Scalar::EPSILON.to_f64()), far);
    (near.fast_max(E::splat(chunk.t_min[ray])).cmp_le(far), near)
}

/// One child of `children` after the other against vectors of rays, which are of `octant` or (`MIXED`) of any. Not inlined: where chunks go through many instances it is
/// rare, and they lose a tenth of their rate to it.
#[inline(never)]
pub fn dense<V: Lanes, const W: usize, const ANY: bool, const MIXED: bool>(
    node: &Node<V::Scalar, W>,
    chunk: &Chunk<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    (octant, children): (usize, u32),
) -> Met<V::Scalar, W> {
    let planes = planes(node, octant);
    let mut met = Met { children: 0, halves: [[0; W]; 2], near: [V::Scalar::ZERO; W], bound: false };
    let mut rest = children;
    while rest != 0 {
        let child = rest.trailing_zeros() as usize & (W - 1);
        rest &= rest - 1;
        let corner = map3(planes, |(near, far)| (V::splat(near[child]), V::splat(far[child])));
        let mut meeting = [0u64; 2];
        for (half, meeting) in meeting.iter_mut().enumerate() {
            for at in (64 * half..chunk.len.min(64 * half + 64)).step_by(V::N) {
                let [x, y, z] = each(|a| {
                    let (org, rcp) = (V::load(&chunk.org[a][at..]), V::load(&chunk.rcp[a][at..]));
                    let (t0, t1) = ((corner[a].0 - org) * rcp, (corner[a].1 - org) * rcp);
                    if MIXED { (t0.fast_min(t1), t0.fast_max(t1)) } else { (t0, t1) }
                });
                let near = x.0.fast_max(y.0).fast_max(z.0);
                let interval = Interval { near, far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
                let meets = interval.meets(V::load(&chunk.t_min[at..]), V::load(&t[at..]));
                *meeting |= u64::from(meets.bits()) << (at % 64);
            }
        }
        let meeting = [meeting[0] & rays as u64, meeting[1] & (rays >> 64) as u64];
        (met.halves[0][child], met.halves[1][child]) = (meeting[0], meeting[1]);
        met.children |= u32::from(meeting[0] | meeting[1] != 0) << child;
    }
    if !ANY {
        // How far the near corner lies along the mean direction.
        let along = |a: usize| V::Scalar::splat(chunk.mean[a]);
        for (child, near) in met.near.iter_mut().enumerate() {
            let [x, y, z] = each(|a| planes[a].0[child] * along(a));
            *near = x + y + z;
        }
    }
    met
}

#[cfg(test)]
mod tests {
    use super::super::OCTANTS;
    use super::super::chunk::row;
    use super::*;
    use crate::bvh::{Child, WIDE, WIDTH};
    use crate::lanes::rows::{Row, to_rows};
    use crate::lanes::{f32x8, f32x16, f64x8};
    use crate::math::Aabb;
    use crate::ray::{Packet, Rays};

    /// Rays of one octant near boxes, some far from the origin, some nearly along an axis.
    fn check<V: Lanes, E: Lanes<Scalar = V::Scalar>, const W: usize>() {
        let mut state = 11u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let (mut exactly, mut quickly, mut steep) = (0, 0, 0);
        for round in 0..300 {
            let far = [0.0, 1e2, 1e6, 1e20][round % 4];
            let octant = round / 4 % OCTANTS;
            let sign = |axis: usize| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
            let mut rays = Rays::<V::Scalar>::new(RAYS);
            for i in 0..RAYS {
                let org = each(|_| V::Scalar::from_f64(far + 8.0 * next() - 4.0));
                let thin = [1.0, 1e-9, 1e-37, 0.0][if i % 8 == 7 { round / 16 % 4 } else { 0 }];
                let dir =
                    each(|a| V::Scalar::from_f64(sign(a) * (0.05 + next()) * if a == i % 3 { thin } else { 1.0 }));
                let t_min = V::Scalar::from_f64(if i % 5 == 0 && round % 64 == 1 { -2.0 } else { 0.0 });
                rays.set(i, org, dir, t_min, V::Scalar::from_f64(if i % 2 == 0 { 3.0 } else { f64::INFINITY }));
            }
            let mut node = Node::<V::Scalar, W>::empty();
            for _ in 0..W - 2 {
                let lo = each(|_| V::Scalar::from_f64(far + 8.0 * next() - 4.0));
                let bounds = Aabb { lo, hi: each(|a| lo[a] + V::Scalar::from_f64(2.0 * next())) };
                node.push(&bounds, Child::ROOT);
            }
            let (mut rows, places) = (vec![Row::ZERO; RAYS], (0..RAYS as u32).collect::<Vec<_>>());
            for at in (0..RAYS).step_by(V::N) {
                let (packet, t_max, _) = Packet::<V>::load(&rays, at);
                to_rows(row(&packet, t_max), &mut rows[at..]);
            }
            let (mut chunk, mut t) = (Chunk::default(), [V::Scalar::ZERO; RAYS]);
            chunk.gather::<V, false>(&rows, &places, &mut t, false);
            steep += u32::from(chunk.steep);
            // A direction of zero points up, whatever the octant.
            let (mut rest, mut of_octant) = (Set::MAX, 0);
            while rest != 0 {
                let (own, alike) = chunk.first_octant::<V>(rest);
                of_octant |= if own == octant { alike } else { 0 };
                rest &= !alike;
            }
            let planes = map3(planes(&node, octant), |(near, far)| (E::load(near), E::load(far)));
            let meeting = one_by_one::<E, W, false>(of_octant, |ray| exact(&planes, &chunk, &t, ray));
            let met = sparse::<E, W, false>(&node, &chunk, &t, of_octant, octant);
            let boxes = (octant, (1 << node.used) - 1);
            let by_boxes = dense::<V, W, true, false>(&node, &chunk, &t, of_octant, boxes);
            for slot in 0..W {
                assert_eq!(meeting.rays(slot) & !met.rays(slot), 0, "a ray misses a box that it meets");
                assert_eq!(meeting.rays(slot), by_boxes.rays(slot), "a box and a ray tell otherwise");
                assert!(meeting.rays(slot) == 0 || met.near[slot] <= meeting.near[slot]);
                exactly += meeting.rays(slot).count_ones();
                quickly += met.rays(slot).count_ones();
            }
        }
        assert!(exactly > 10_000 && quickly < exactly + exactly / 50, "{exactly} {quickly}");
        assert!((10..200).contains(&steep), "{steep} chunks by the exact test only");
    }

    #[test]
    fn the_quick_test_meets_what_the_exact_one_meets() {
        check::<f32x16, f32x8, WIDTH>();
        check::<f32x16, f32x16, WIDE>();
        check::<f64x8, f64x8, WIDTH>();
    }
}
