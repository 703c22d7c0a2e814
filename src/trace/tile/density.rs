//! Triangles so much smaller than the distance of a tile's rays that neighbours have few of them in common: such a tile would
//! set up thousands of triangles that no ray meets. Chunks of rays ([`super::super::stream`]) are the faster way there: packets are
//! not, as a chunk waits for the memory of many nodes at once.
//!
//! What decides is the triangle that the ray in the middle of the tile meets, so that the same rays get the same bits whatever
//! tree their world has and whatever was traced before.

use std::f32::consts::PI;

use glam::{DMat3, DVec2, DVec3};

use super::groups::Groups;
use super::{Job, SET, V};
use crate::lanes::{Lanes, dot, each};
use crate::math::Aabb;
use crate::ray::{Counters, HitPacket, INVALID_ID, Packet};
use crate::trace::query::Query;
use crate::trace::traverse;

/// Triangles per ray from which on tiles are the slower way.
const DENSE: f64 = 4.0;

/// The same of rays of one direction that are asked for their nearest hit: there packets are the faster way.
const DENSE_ALONG: f64 = 2.0;

/// The same for any hit: all of the surface that they start on is seen from where they go.
const DENSE_AGAINST: f64 = 1.0;

/// Triangles per ray, if they were spread evenly over the directions, up to which nobody looks: the ray in the middle costs
/// what a few triangles for a whole tile cost.
const SPREAD: f32 = 1.0;

impl Job<'_> {
    /// Whether the loaded tile of `N` sets sees such triangles.
    #[inline(always)]
    pub(super) fn is_dense<const N: usize>(&mut self) -> bool {
        let (groups, world) = (&self.memory.groups, self.world);
        // Of instances each is looked at by itself ([`super::walk`]), and rays behind a mirror are rarely a whole tile.
        if groups.many || groups.is_behind && groups.frame.parallel.is_none() {
            return false;
        }
        let count = world.traced.objects[world.instances[0].object as usize].prim_count as f32;
        let around = match groups.frame.parallel {
            Some(_) => f32::INFINITY,
            None => 4.0 * PI / groups.spacing::<N>(),
        };
        count > SPREAD * around.min(groups.rays_on::<N>(&world.first_object().tree.bounds)) && self.met::<N>()
    }

    /// Looks at what the ray in the middle meets.
    #[cold]
    #[inline(never)]
    fn met<const N: usize>(&mut self) -> bool {
        let groups = &self.memory.groups;
        let middle = groups.bounds.map(|[low, high]| 0.5 * (f64::from(low) + f64::from(high)));
        let [u, v, a] = groups.frame.axes.map(|axis| DVec3::from(axis.map(f64::from)));
        let into = DMat3::from_cols(u, v, a).transpose();
        let spacing = f64::from(groups.spacing::<N>());
        let apex = DVec3::from(groups.frame.apex.map(f64::from));
        let middle = DVec2::from(middle);
        let (from, way) = match &groups.frame.parallel {
            // From where the tile is seen, ahead of the scene.
            Some(parallel) => (apex + into.inverse() * middle.extend(f64::from(parallel.height)), -a),
            None => (apex, into.inverse() * middle.extend(1.0)),
        };
        let (from, way) = (from.as_vec3().to_array(), way.normalize().as_vec3().to_array());
        let ray = Packet::<f32>::new(from, way, 0.0);
        let counters = &mut Counters::default();
        let mut query = Query::<f32, false, false>::new(HitPacket::new(f32::INFINITY), self.stack, counters);
        traverse::world(self.world, &ray, &mut query, 1);
        let (mut hit, names) = (query.hit, &self.world.names);
        names.iter().for_each(|names| names.apply(&mut hit.prim, &mut hit.inst));
        let (prim, inst) = (hit.prim[0], hit.inst[0]);
        let triangle = if prim == INVALID_ID { None } else { self.world.triangle(prim, inst) };
        let Some([first, e1, e2]) = triangle else { return false };
        let from = first - apex;
        let seen = [from, from + e1, from + e2].map(|corner| into * corner);
        let [p, q, r] = match groups.frame.parallel {
            Some(_) => seen.map(|p| p.truncate().extend(1.0)),
            None => seen,
        };
        let size =
            0.5 * (q.truncate() / q.z - p.truncate() / p.z).perp_dot(r.truncate() / r.z - p.truncate() / p.z).abs();
        let dense = match (&groups.frame.parallel, groups.is_behind) {
            (None, _) => DENSE,
            (Some(_), true) => DENSE_ALONG,
            (Some(_), false) => DENSE_AGAINST,
        };
        p.z.min(q.z).min(r.z) > 0.0 && spacing > dense * size
    }
}

impl Groups {
    /// About how many rays, as dense as those of the tile, a box in world space would be met by; infinite if the common
    /// point is as close to the box as that is large.
    #[inline(always)]
    pub fn rays_on<const N: usize>(&self, bounds: &Aabb<f32>) -> f32 {
        let centre = each(|a| 0.5 * (bounds.lo[a] + bounds.hi[a]) - self.frame.apex[a]);
        let half: [f32; 3] = each(|a| 0.5 * (bounds.hi[a] - bounds.lo[a]));
        let depth = dot(centre, self.frame.axes[2]);
        let square = dot(half, half) * self.frame.scale * self.frame.scale;
        if self.frame.parallel.is_some() {
            return 2.0 * square / self.spacing::<N>();
        }
        if depth * depth <= square || depth <= 0.0 {
            return f32::INFINITY;
        }
        // Half of the square around the sphere around it: a guess.
        2.0 * square / (depth * depth) / self.spacing::<N>()
    }

    /// What of the plane at depth 1 a ray of the tile has for itself.
    #[inline(always)]
    pub fn spacing<const N: usize>(&self) -> f32 {
        let [s, t] = self.bounds.map(|[lo, hi]| hi - lo);
        s * t / (N * SET * V::N) as f32
    }
}
