//! parry3d: the collision library's tree, whose ray casts go through a binary tree of single triangles.
//!
//! Source: the crate `parry3d` 0.31 (parry.rs, Dimforge, 2020 to 2026). Its tree and its triangle test are called directly: a
//! mesh of its own would look corners up by two indices. Both ways of building are run, each a mode: `binned` and `ploc`,
//! which its documentation advises for rays. It has no any-hit query, but its search ends early when a leaf claims to be
//! infinitely near, and is used so.

use std::time::Instant;

use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::Ray;
use parry3d::query::details::local_ray_intersection_with_triangle;

use super::singles::{Found, Single, Singles};
use super::triangles::{MAX_COINCIDENT, Triangles};
use super::{Facts, Peer};

/// Family.
pub const NAME: &str = "parry";

/// Builds its trees; `ploc` is missing where too many triangles share a box centre, see [`MAX_COINCIDENT`].
///
/// # Errors
/// Why it cannot have these triangles.
pub fn build(triangles: &Triangles) -> Result<Vec<Box<dyn Peer<f32>>>, String> {
    let mut peers = Vec::new();
    if triangles.most_coincident() <= MAX_COINCIDENT {
        peers.push(mode(triangles, "ploc", BvhBuildStrategy::Ploc)?);
    }
    peers.push(mode(triangles, "binned", BvhBuildStrategy::Binned)?);
    Ok(peers)
}

fn mode(triangles: &Triangles, mode: &'static str, strategy: BvhBuildStrategy) -> Result<Box<dyn Peer<f32>>, String> {
    // Its builders panic on some extreme inputs; a peer must not take the bench down.
    let built = std::panic::catch_unwind(|| {
        let start = Instant::now();
        let vector = |[x, y, z, _]: [f32; 4]| Vector::new(x, y, z);
        let corners: Vec<_> = (0..triangles.indices.len()).map(|i| triangles.corners(i).map(vector)).collect();
        let leaves: Vec<Aabb> = corners.iter().map(|three| Aabb::from_points(three.iter().copied())).collect();
        let tree = Bvh::from_leaves(strategy, &leaves);
        (Parry { tree, corners }, start.elapsed().as_secs_f64())
    });
    let (tracer, build_seconds) = built.map_err(|_| format!("its {mode} builder panicked on this scene"))?;
    let facts = Facts {
        name: NAME,
        mode,
        description: format!("parry3d 0.31, {mode} tree, its triangle test, single rays"),
        build_seconds,
        bytes: (tracer.tree.total_memory_size() + size_of_val(&tracer.corners[..])) as u64,
    };
    Ok(Box::new(Singles { facts, tracer, ids: triangles.ids.clone() }))
}

struct Parry {
    tree: Bvh,
    corners: Vec<[Vector; 3]>,
}

/// Its rays have no beginning: hits before `t_min` are refused one by one.
struct Segment {
    ray: Ray,
    t_min: f32,
    t_max: f32,
}

impl Parry {
    /// t, u and v of the ray on the plane of triangle `i`, if it is hit anywhere from the origin on.
    #[inline]
    fn hit(&self, ray: &Ray, i: u32) -> Option<[f32; 3]> {
        let [a, b, c] = self.corners[i as usize];
        let (hit, weights) = local_ray_intersection_with_triangle(a, b, c, ray)?;
        Some([hit.time_of_impact, weights.y, weights.z])
    }
}

impl Single for Parry {
    type Ray = Segment;

    fn ray(org: [f32; 3], dir: [f32; 3], t_min: f32, t_max: f32) -> Segment {
        Segment { ray: Ray::new(org.into(), dir.into()), t_min, t_max }
    }

    fn closest(&self, Segment { ray, t_min, t_max }: &Segment) -> Option<Found> {
        // The search keeps the number and t alone; u and v of the hit come from its test once more.
        let (prim, _) = self.tree.cast_ray(ray, *t_max, |i, end| {
            let [t, ..] = self.hit(ray, i)?;
            (t >= *t_min && t <= end).then_some(t)
        })?;
        Some((prim, self.hit(ray, prim)?))
    }

    fn occluded(&self, Segment { ray, t_min, t_max }: &Segment) -> bool {
        let found = self.tree.cast_ray(ray, *t_max, |i, _| {
            let [t, ..] = self.hit(ray, i)?;
            (t >= *t_min && t <= *t_max).then_some(f32::NEG_INFINITY)
        });
        found.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One triangle in the plane z = 1, as often as asked.
    fn pile(count: usize) -> Triangles {
        let vertices = [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.0]];
        Triangles { vertices: vertices.into(), indices: vec![[0, 1, 2]; count], ids: vec![[0, 0]; count] }
    }

    #[test]
    fn a_pile_of_triangles_is_kept_from_the_builder_it_slows_down() {
        let modes =
            |count| -> Vec<&str> { build(&pile(count)).unwrap().iter().map(|peer| peer.facts().mode).collect() };
        assert_eq!(modes(MAX_COINCIDENT), ["ploc", "binned"]);
        assert_eq!(modes(MAX_COINCIDENT + 1), ["binned"]);
    }

    /// A ray of direction (0, 0, 1/2) meets (0.25, 0.5, 1) at t = 2; the segment's ends are kept.
    #[test]
    fn segments_begin_and_end() {
        let corners = pile(1).corners(0).map(|[x, y, z, _]| Vector::new(x, y, z));
        let leaf = Aabb::from_points(corners);
        let parry = Parry { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &[leaf]), corners: vec![corners] };
        for (t_min, t_max, met) in [(0.0, f32::INFINITY, true), (1.9, 2.1, true), (2.1, 9.0, false), (0.0, 1.9, false)]
        {
            let ray = Parry::ray([0.25, 0.5, 0.0], [0.0, 0.0, 0.5], t_min, t_max);
            assert_eq!(parry.closest(&ray), met.then_some((0, [2.0, 0.25, 0.5])), "{t_min} {t_max}");
            assert_eq!(parry.occluded(&ray), met, "{t_min} {t_max}");
        }
    }
}
