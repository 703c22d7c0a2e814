//! Bounds over all rays of a chunk: which of a node's boxes none of them meets.
//!
//! As for packets ([`crate::bvh::Bundle`]): the same monotone expression as the box test of one ray, at the ends of
//! the intervals, so that a box that a ray meets is never rejected. Short rays that start near each other, such as
//! those of ambient occlusion, get rid of most of the upper nodes' children by it.

use super::chunk::{Chunk, RAYS};
use super::node::Planes;
use crate::lanes::{LaneMask, Lanes, Real, each};
use crate::ray::slab::{Interval, pad};

/// Least and greatest values over a chunk.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<S> {
    org: [(S, S); 3],
    rcp: [(S, S); 3],
    /// Start of the earliest segment, end of the longest.
    t_min: S,
    t_max: S,
}

impl<S: Real> Bounds<S> {
    /// Bounds over a chunk of one octant, filled up to whole vectors, whose segments end at `t`.
    #[inline(always)]
    pub fn of<V: Lanes<Scalar = S>>(chunk: &Chunk<S>, t: &[S; RAYS]) -> Self {
        let range = |from: &[S; RAYS]| {
            let first = V::load(from);
            let (mut low, mut high) = (first, first);
            for at in (V::N..chunk.len.min(RAYS)).step_by(V::N) {
                let next = V::load(&from[at..]);
                (low, high) = (next.fast_min(low), next.fast_max(high));
            }
            (low.range(V::ALL).0, high.range(V::ALL).1)
        };
        let (org, rcp) = (each(|a| range(&chunk.org[a])), each(|a| range(&chunk.rcp[a])));
        Self { org, rcp, t_min: range(&chunk.t_min).0, t_max: range(t).1 }
    }

    /// Children that some ray of `octant` may meet, as bits. `E`: vectors of `W` children.
    #[inline(always)]
    pub fn children<E: Lanes<Scalar = S>, const W: usize>(&self, planes: &Planes<'_, S, W>, octant: usize) -> u32 {
        let splat = E::splat;
        let [x, y, z] = each(|a| {
            let (low, high) = self.org[a];
            let (org_near, org_far) = if octant >> a & 1 == 0 { (high, low) } else { (low, high) };
            let (r0, r1) = (splat(self.rcp[a].0), splat(self.rcp[a].1));
            let enter = E::load(planes[a].0) - splat(org_near);
            let leave = E::load(planes[a].1) - splat(org_far);
            ((enter * r0).fast_min(enter * r1), (leave * r0).fast_max(leave * r1))
        });
        let interval = Interval { near: x.0.fast_max(y.0).fast_max(z.0), far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
        interval.meets(splat(self.t_min), splat(self.t_max)).bits() & E::ALL
    }
}
