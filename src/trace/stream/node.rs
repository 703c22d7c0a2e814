//! A chunk's rays against the eight boxes of a node.

use super::chunk::{Chunk, RAYS, Set};
use crate::bvh::{Node, WIDTH};
use crate::lanes::words::Marks;
use crate::lanes::{LaneMask, Lanes, Real, each, map3};
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

/// The planes of all children that rays of one octant meet first and last, axis by axis.
pub type Planes<'a, S> = [(&'a [S; WIDTH], &'a [S; WIDTH]); 3];

#[inline(always)]
fn planes<S>(node: &Node<S>, octant: usize) -> Planes<'_, S> {
    each(|axis| {
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
    let planes = map3(planes(node, octant), |(near, far)| (S::Octo::load(near), S::Octo::load(far)));
    let mut marks = [Marks::none(); 2];
    let mut first = S::Octo::splat(S::INFINITY);
    for (half, marks) in marks.iter_mut().enumerate() {
        let mut rest = (rays >> (64 * half)) as u64;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let ray = (64 * half + i as usize) & (RAYS - 1);
            let [x, y, z] = each(|a| {
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
    let mut rest = chunk.bounds.as_ref().map_or(u32::MAX, |bounds| bounds.children(&planes, octant));
    rest &= (1 << node.used) - 1;
    while rest != 0 {
        let child = rest.trailing_zeros() as usize & (WIDTH - 1);
        rest &= rest - 1;
        let corner = map3(planes, |(near, far)| (V::splat(near[child]), V::splat(far[child])));
        let mut meeting = [0u64; 2];
        for (half, meeting) in meeting.iter_mut().enumerate() {
            for at in (64 * half..chunk.len.min(64 * half + 64)).step_by(V::N) {
                let [x, y, z] = each(|a| {
                    let (org, rcp) = (V::load(&chunk.org[a][at..]), V::load(&chunk.rcp[a][at..]));
                    ((corner[a].0 - org) * rcp, (corner[a].1 - org) * rcp)
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
