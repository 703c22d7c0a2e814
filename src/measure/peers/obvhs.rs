//! obvhs with its own single-ray traversals: the tracer whose builder makes our binary tree.
//!
//! Source: the crate `obvhs` 0.4 (github.com/DGriffin91/obvhs, 2024); its very slow preset (pre-splits, reinsertion of every node). Triangles are
//! stored in leaf order in the crate's form for tracing, as its examples advise, so that a leaf reads them in a row.

use std::time::{Duration, Instant};

use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{INVALID_ID, Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use super::triangles::{MAX_COINCIDENT, Triangles};
use super::{Facts, Packed, Peer, rename};
use crate::measure::raysets::Query;
use crate::ray::{Hits, Rays};

/// Families: binary tree, and eight-wide tree with boxes in eight bits.
pub const NAMES: [&str; 2] = ["obvhs-bvh2", "obvhs-cwbvh"];

/// Builds the family called `name`.
///
/// # Errors
/// Why it cannot have these triangles.
pub fn build(name: &'static str, triangles: &Triangles) -> Result<Box<dyn Peer<f32>>, String> {
    let list: Vec<Triangle> = (0..triangles.indices.len()).map(|i| triangle(triangles.corners(i))).collect();
    let coincident = triangles.most_coincident();
    if coincident > MAX_COINCIDENT {
        return Err(format!(
            "{coincident} triangles share a box centre, its builder is given at most {MAX_COINCIDENT}"
        ));
    }
    // Its builders panic on some extreme inputs; a peer must not take the bench down.
    let built = std::panic::catch_unwind(|| {
        let (start, params) = (Instant::now(), BvhBuildParams::very_slow_build());
        if name == NAMES[0] {
            let tree = build_bvh2_from_tris(&list, params, &mut Duration::default());
            finish::<Bvh2>(name, tree, &list, triangles, start)
        } else {
            let tree = build_cwbvh_from_tris(&list, params, &mut Duration::default());
            finish::<CwBvh>(name, tree, &list, triangles, start)
        }
    });
    built.map_err(|_| "its builder panicked on this scene".into())
}

fn finish<T: Traverse>(
    name: &'static str,
    tree: T,
    list: &[Triangle],
    triangles: &Triangles,
    start: Instant,
) -> Box<dyn Peer<f32>> {
    let order = tree.order();
    let stored: Vec<RtTriangle> = order.iter().map(|&i| RtTriangle::from(&list[i as usize])).collect();
    let facts = Facts {
        name,
        mode: "",
        description: format!("obvhs 0.4 {}, very_slow build, single rays", T::WHAT),
        build_seconds: start.elapsed().as_secs_f64(),
        bytes: (tree.bytes() + size_of_val(&stored[..])) as u64,
    };
    let ids = order.iter().map(|&i| triangles.ids[i as usize]).collect();
    Box::new(Obvhs { facts, tree, triangles: stored, ids })
}

fn triangle(corners: [[f32; 4]; 3]) -> Triangle {
    let [v0, v1, v2] = corners.map(|[x, y, z, _]| [x, y, z].into());
    Triangle { v0, v1, v2 }
}

/// What the two trees have in common.
trait Traverse: Send + Sync + 'static {
    const WHAT: &'static str;
    /// Triangle of each slot of the leaves.
    fn order(&self) -> &[u32];
    fn bytes(&self) -> usize;
    fn closest(&self, ray: Ray, triangles: &[RtTriangle]) -> RayHit;
    fn misses(&self, ray: Ray, triangles: &[RtTriangle]) -> bool;
}

/// Both trees have these methods, but the crate has no trait for them.
macro_rules! traverse {
    ($tree:ty, $what:literal) => {
        impl Traverse for $tree {
            const WHAT: &'static str = $what;

            fn order(&self) -> &[u32] {
                &self.primitive_indices
            }

            fn bytes(&self) -> usize {
                size_of_val(&self.nodes[..])
            }

            fn closest(&self, ray: Ray, triangles: &[RtTriangle]) -> RayHit {
                let mut hit = RayHit::none();
                self.ray_traverse(ray, &mut hit, |ray, slot| triangles[slot].intersect(ray));
                hit
            }

            fn misses(&self, ray: Ray, triangles: &[RtTriangle]) -> bool {
                self.ray_traverse_miss(ray, |ray, slot| triangles[slot].intersect(ray))
            }
        }
    };
}

traverse!(Bvh2, "BVH2");
traverse!(CwBvh, "CWBVH");

struct Obvhs<T> {
    facts: Facts,
    tree: T,
    triangles: Vec<RtTriangle>,
    ids: Vec<[u32; 2]>,
}

impl<T: Traverse> Peer<f32> for Obvhs<T> {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn pack<'a>(&'a self, rays: &Rays<f32>, _query: Query) -> Box<dyn Packed<f32> + 'a> {
        let one = |i| match rays.is_live(i) {
            true => Ray::new(rays.org(i).into(), rays.dir(i).into(), rays.t_min[i], rays.t_max[i]),
            false => Ray::new(Default::default(), Default::default(), 1.0, 0.0),
        };
        Box::new(Batch { peer: self, rays: (0..rays.len()).map(one).collect() })
    }

    fn rename(&self, hits: &mut Hits<f32>) {
        rename(hits, |prim, _| self.ids.get(prim as usize).copied());
    }
}

/// Rays of a batch; dead ones end before they start and are not traced.
struct Batch<'a, T> {
    peer: &'a Obvhs<T>,
    rays: Vec<Ray>,
}

fn is_live(ray: &Ray) -> bool {
    ray.tmin <= ray.tmax
}

impl<T: Traverse> Packed<f32> for Batch<'_, T> {
    fn intersect(&mut self, hits: &mut Hits<f32>) {
        hits.reset(self.rays.len());
        for (i, ray) in self.rays.iter().enumerate() {
            if !is_live(ray) {
                continue;
            }
            let hit = self.peer.tree.closest(*ray, &self.peer.triangles);
            if hit.primitive_id != INVALID_ID {
                let uv = self.peer.triangles[hit.primitive_id as usize].compute_barycentric(ray);
                (hits.t[i], hits.u[i], hits.v[i]) = (hit.t, uv.x, uv.y);
                (hits.prim[i], hits.inst[i]) = (hit.primitive_id, 0);
            }
        }
    }

    fn occluded(&mut self, out: &mut Vec<u8>) {
        let (tree, triangles) = (&self.peer.tree, &self.peer.triangles);
        out.clear();
        out.extend(self.rays.iter().map(|ray| u8::from(is_live(ray) && !tree.misses(*ray, triangles))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coincident_centres_are_counted_and_refused() {
        let (a, b) = ([0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]);
        let mut scene = Triangles { vertices: vec![a, b, [1.0, 0.0, 0.0, 0.0]], ..Default::default() };
        for i in 0..=MAX_COINCIDENT as u32 {
            scene.indices.push([0, 1, 2]);
            scene.ids.push([i, 0]);
        }
        let why = build(NAMES[0], &scene).err().unwrap();
        assert!(why.contains("501 triangles share"), "{why}");
        scene.indices.pop();
        assert!(build(NAMES[0], &scene).is_ok());
    }
}
