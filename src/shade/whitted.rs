//! Recursive ray tracing without recursion: one batch per level and light.

use std::f64::consts::PI;

use glam::DVec3;

use super::classic::refract;
use super::lights::{irradiance, shadow_segment};
use super::sample::Sample;
use super::shader::{Shader, Vertex, Workspace};
use crate::lanes::Real;
use crate::ray::Rays;
use crate::scene::description::Light;

/// Branches whose light would be weakened below this are not followed.
const CUT_OFF: f64 = 1.0 / 1024.0;

/// A ray that leaves a vertex: org, direction, what of its radiance reaches the eye.
type Branch<'v, S> = (&'v Vertex, [S; 3], DVec3, DVec3);

impl<S: Real> Shader<'_, S> {
    /// Radiance = emission + diffuse ambient + sum over lights of diffuse / pi * irradiance + mirror * radiance from
    /// the mirrored direction + through * radiance from the refracted direction, `depth` levels deep; what leaves the
    /// scene sees the background. Light passes glass straight on its way from a light.
    ///
    /// `work.vertices` are the hits of `rays`. A sample's terms are added level by level and light by light.
    pub(super) fn whitted(
        &self,
        rays: &Rays<S>,
        pixels: &[(u32, u32)],
        sample: u32,
        work: &mut Workspace<S>,
        out: &mut [Sample],
    ) {
        for i in 0..rays.len() {
            if !work.hits.is_hit(i) && rays.is_live(i) {
                let behind = self.beyond(DVec3::from(rays.dir(i).map(S::to_f64)));
                out[i].radiance = behind;
                // A background that shines is part of the picture; a black one stays transparent.
                out[i].alpha = f64::from(u8::from(behind != DVec3::ZERO));
            }
        }
        let mut vertices = std::mem::take(&mut work.vertices);
        let mut next = Vec::new();
        for level in 0..=self.settings.depth {
            for vertex in &vertices {
                let point = &vertex.classic;
                let unlit = point.emission + point.diffuse * self.ambient * vertex.ambient;
                out[vertex.path as usize].radiance += vertex.throughput * unlit;
            }
            for light in &self.lights {
                self.add_light(light, &vertices, work, out);
            }
            if level == self.settings.depth || vertices.is_empty() {
                work.lap(level);
                break;
            }
            next.clear();
            let branches = self.branches(&vertices);
            work.lap(level);
            self.follow(&branches, pixels, (sample, level + 1), &mut next, work, out);
            std::mem::swap(&mut vertices, &mut next);
        }
        work.vertices = vertices;
    }

    /// Adds what `light` contributes to each vertex, one compact batch of shadow rays for those that face it.
    fn add_light(&self, light: &Light, vertices: &[Vertex], work: &mut Workspace<S>, out: &mut [Sample]) {
        let lit: Vec<(&Vertex, DVec3)> = vertices
            .iter()
            .filter_map(|vertex| {
                let arriving = irradiance(light, vertex.position, vertex.shading_normal)?;
                let value = vertex.throughput * vertex.classic.diffuse / PI * arriving;
                (value != DVec3::ZERO).then_some((vertex, value))
            })
            .collect();
        if !self.shadows {
            lit.iter().for_each(|(vertex, value)| out[vertex.path as usize].radiance += *value);
            return;
        }
        if lit.is_empty() {
            return;
        }
        work.batch.reset(lit.len());
        for (i, (vertex, _)) in lit.iter().enumerate() {
            let org: [S; 3] = vertex.leave();
            let (dir, t_max) = shadow_segment::<S>(light, DVec3::from(org.map(S::to_f64)));
            work.batch.set(i, org, dir.to_array().map(S::from_f64), S::from_f64(0.0), S::from_f64(t_max));
        }
        work.rays.shadow += work.batch.live_count() as u64;
        self.occlude(work, true, |i, left| {
            let (vertex, value) = lit[i];
            out[vertex.path as usize].radiance += value * left;
        });
    }

    /// The mirrored and refracted rays of `vertices` that carry enough light, all mirrored ones first.
    fn branches<'v>(&self, vertices: &'v [Vertex]) -> Vec<Branch<'v, S>> {
        let bright = |light: DVec3| light.max_element() >= CUT_OFF;
        let mirrored = vertices.iter().filter_map(|vertex| {
            let throughput = vertex.throughput * vertex.classic.mirror;
            let dir = reflect(vertex.dir, vertex.shading_normal);
            // Where the shading normal would send it into the surface, the surface's own normal decides.
            let dir = if dir.dot(vertex.normal) > 0.0 { dir } else { reflect(vertex.dir, vertex.normal) };
            bright(throughput).then(|| (vertex, vertex.leave(), dir, throughput))
        });
        let refracted = vertices.iter().filter_map(|vertex| {
            let throughput = vertex.throughput * vertex.classic.through;
            let dir = refract(vertex.dir, vertex.normal, vertex.classic.eta)?;
            bright(throughput).then(|| (vertex, vertex.enter(), dir, throughput))
        });
        mirrored.chain(refracted).collect()
    }

    /// Follows `branches`: their hits into `next`, the background where there is none.
    fn follow(
        &self,
        branches: &[Branch<'_, S>],
        pixels: &[(u32, u32)],
        (sample, level): (u32, u32),
        next: &mut Vec<Vertex>,
        work: &mut Workspace<S>,
        out: &mut [Sample],
    ) {
        if branches.is_empty() {
            return;
        }
        let mut batch = std::mem::take(&mut work.batch);
        batch.reset(branches.len());
        for (i, &(vertex, org, dir, _)) in branches.iter().enumerate() {
            batch.set(i, org, dir.to_array().map(S::from_f64), S::from_f64(0.0), S::from_f64(f64::INFINITY));
            // Of a vertex's two branches the mirrored one counts as such.
            let is_mirrored = dir.dot(vertex.normal) > 0.0;
            *(if is_mirrored { &mut work.rays.mirror } else { &mut work.rays.refracted }) +=
                u64::from(batch.is_live(i));
        }
        self.intersect(&batch, work, |i, layer| self.number(pixels[branches[i].0.path as usize], sample, level, layer));
        for (i, &(vertex, _, dir, throughput)) in branches.iter().enumerate() {
            if work.hits.is_hit(i) {
                next.push(self.vertex(&batch, &work.hits, i, vertex.path, throughput));
            } else {
                out[vertex.path as usize].radiance += throughput * self.beyond(dir);
            }
        }
        work.batch = batch;
    }
}

/// Direction `dir` mirrored at a plane with unit normal `normal`; the length stays.
fn reflect(dir: DVec3, normal: DVec3) -> DVec3 {
    dir - 2.0 * dir.dot(normal) * normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_turn_the_normal_part_only() {
        let d = reflect(DVec3::new(3.0, -4.0, 1.0), DVec3::Y);
        assert_eq!(d, DVec3::new(3.0, 4.0, 1.0));
        let n = DVec3::new(1.0, 1.0, 0.0).normalize();
        assert!((reflect(DVec3::new(-2.0, 0.0, 0.0), n) - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-15);
    }
}
