//! A chunk's rays against the eight boxes of a node.

use super::chunk::{Chunk, RAYS, Set};
use crate::bvh::{Node, WIDTH};
use crate::lanes::words::Marks;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::slab::{Interval, pad};

/// From this many rays on they are tested as vectors.
const DENSE: u32 = 48;

/// Which rays meet which child.
pub struct Met<S> {
    /// Children that some ray meets, as bits.
    pub children: u32,
    /// Rays that meet each child: of the first and of the second 64 of the chunk.
    halves: [[u64; WIDTH]; 2],
    /// Order of the children.
    pub near: [S; WIDTH],
    /// Whether `near` is where the first ray enters.
    pub bound: bool,
}

impl<S> Met<S> {
    /// Rays that meet a child.
    #[inline(always)]
    pub fn rays(&self, slot: usize) -> Set {
        Set::from(self.halves[0][slot]) | Set::from(self.halves[1][slot]) << 64
    }
}

/// The planes of all children that rays of `octant` meet first and last, axis by axis.
#[inline(always)]
fn planes<S>(node: &Node<S>, octant: usize) -> [(&[S; WIDTH], &[S; WIDTH]); 3] {
    [0, 1, 2].map(|axis| {
        let [low, high] = &node.bounds[axis];
        if octant >> axis & 1 == 0 { (low, high) } else { (high, low) }
    })
}

/// Tests `rays` of a chunk, all of one octant, whose segments end at `t`.
#[inline(always)]
pub fn meet<V: Lanes, const ANY: bool>(
    node: &Node<V::Scalar>,
    chunk: &Chunk<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    octant: usize,
) -> Met<V::Scalar> {
    if rays.count_ones() >= DENSE {
        dense::<V, ANY>(node, chunk, t, rays, octant)
    } else {
        sparse::<V::Scalar, ANY>(node, chunk, t, rays, octant)
    }
}

/// One ray after the other against all children.
#[inline(always)]
fn sparse<S: Real, const ANY: bool>(
    node: &Node<S>,
    chunk: &Chunk<S>,
    t: &[S; RAYS],
    rays: Set,
    octant: usize,
) -> Met<S> {
    let planes = planes(node, octant).map(|(near, far)| (S::Octo::load(near), S::Octo::load(far)));
    let mut marks = [Marks::none(); 2];
    let mut first = S::Octo::splat(S::INFINITY);
    for (half, marks) in marks.iter_mut().enumerate() {
        let mut rest = (rays >> (64 * half)) as u64;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let ray = (64 * half + i as usize) & (RAYS - 1);
            let [x, y, z] = [0, 1, 2].map(|a| {
                let (org, rcp) = (S::Octo::splat(chunk.org[a][ray]), S::Octo::splat(chunk.rcp[a][ray]));
                ((planes[a].0 - org) * rcp, (planes[a].1 - org) * rcp)
            });
            let near = x.0.fast_max(y.0).fast_max(z.0);
            let interval = Interval { near, far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
            let meets = interval.meets(S::Octo::splat(chunk.t_min[ray]), S::Octo::splat(t[ray]));
            if !ANY {
                first = S::Octo::select(meets, near.fast_min(first), first);
            }
            *marks = marks.with(meets.bits(), i);
        }
    }
    let mut near = [S::ZERO; WIDTH];
    first.store(&mut near);
    // Slots without a child are empty boxes, which no ray of an octant meets.
    let [low, high] = marks;
    Met { children: low.not_zero() | high.not_zero(), halves: [low.words(), high.words()], near, bound: true }
}

/// One child after the other against vectors of rays.
#[inline(always)]
fn dense<V: Lanes, const ANY: bool>(
    node: &Node<V::Scalar>,
    chunk: &Chunk<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    octant: usize,
) -> Met<V::Scalar> {
    let planes = planes(node, octant);
    let mut met = Met { children: 0, halves: [[0; WIDTH]; 2], near: [V::Scalar::ZERO; WIDTH], bound: false };
    for at in (0..chunk.len.min(RAYS)).step_by(V::N) {
        let lanes = (rays >> at) as u32 & V::ALL;
        if lanes == 0 {
            continue;
        }
        let [org, rcp] = [&chunk.org, &chunk.rcp].map(|v| [0, 1, 2].map(|a| V::load(&v[a][at..])));
        let (t_min, t) = (V::load(&chunk.t_min[at..]), V::load(&t[at..]));
        for child in 0..WIDTH {
            let [x, y, z] = [0, 1, 2].map(|a| {
                let plane = |bounds: &[V::Scalar; WIDTH]| (V::splat(bounds[child]) - org[a]) * rcp[a];
                (plane(planes[a].0), plane(planes[a].1))
            });
            let near = x.0.fast_max(y.0).fast_max(z.0);
            let interval = Interval { near, far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
            met.halves[at / 64][child] |= u64::from(interval.meets(t_min, t).bits() & lanes) << (at % 64);
        }
    }
    for child in 0..WIDTH {
        met.children |= u32::from((met.halves[0][child] | met.halves[1][child]) != 0) << child;
    }
    if !ANY {
        // How far the near corner lies along the mean direction.
        let along = |a: usize| V::Scalar::splat(chunk.mean[a]);
        for (child, near) in met.near.iter_mut().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|a| planes[a].0[child] * along(a));
            *near = x + y + z;
        }
    }
    met
}
