//! What peers have in common that trace one ray after another over triangles in world space.

use super::{Facts, Packed, Peer, rename};
use crate::measure::raysets::Query;
use crate::ray::{Hits, Rays};

/// A hit: the peer's own number of the triangle, then t, u and v.
pub type Found = (u32, [f32; 3]);

/// A tracer of single rays.
pub trait Single: Send + Sync + 'static {
    /// A ray with its segment, in the tracer's own layout.
    type Ray: Send;
    /// The ray from `org` along `dir` (of any length), for hits from `t_min` to `t_max`.
    fn ray(org: [f32; 3], dir: [f32; 3], t_min: f32, t_max: f32) -> Self::Ray;
    /// The first hit of the segment.
    fn closest(&self, ray: &Self::Ray) -> Option<Found>;
    /// Whether the segment holds anything.
    fn occluded(&self, ray: &Self::Ray) -> bool;
}

/// A tracer of single rays as a peer.
pub struct Singles<T> {
    /// What its rows say.
    pub facts: Facts,
    /// The tracer with its scene.
    pub tracer: T,
    /// Our primitive and instance number of each of its triangles.
    pub ids: Vec<[u32; 2]>,
}

impl<T: Single> Peer<f32> for Singles<T> {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn pack<'a>(&'a self, rays: &Rays<f32>, _query: Query) -> Box<dyn Packed<f32> + 'a> {
        let one = |i| rays.is_live(i).then(|| T::ray(rays.org(i), rays.dir(i), rays.t_min[i], rays.t_max[i]));
        Box::new(Batch { tracer: &self.tracer, rays: (0..rays.len()).map(one).collect() })
    }

    fn rename(&self, hits: &mut Hits<f32>) {
        rename(hits, |prim, _| self.ids.get(prim as usize).copied());
    }
}

/// Rays of a batch; dead ones are not traced.
struct Batch<'a, T: Single> {
    tracer: &'a T,
    rays: Vec<Option<T::Ray>>,
}

impl<T: Single> Packed<f32> for Batch<'_, T> {
    fn intersect(&mut self, hits: &mut Hits<f32>) {
        hits.reset(self.rays.len());
        for (i, ray) in self.rays.iter().enumerate() {
            if let Some((prim, [t, u, v])) = ray.as_ref().and_then(|ray| self.tracer.closest(ray)) {
                (hits.t[i], hits.u[i], hits.v[i]) = (t, u, v);
                (hits.prim[i], hits.inst[i]) = (prim, 0);
            }
        }
    }

    fn occluded(&mut self, out: &mut Vec<u8>) {
        let blocked = |ray: &Option<T::Ray>| ray.as_ref().is_some_and(|ray| self.tracer.occluded(ray));
        out.clear();
        out.extend(self.rays.iter().map(|ray| u8::from(blocked(ray))));
    }
}
