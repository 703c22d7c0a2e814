//! Recursive ray tracing without recursion: one batch per level and light.

use std::f64::consts::PI;

use glam::DVec3;

use super::lights::{irradiance, shadow_segment};
use super::shader::{Sample, Shader, Vertex, Workspace};
use crate::lanes::Real;
use crate::ray::Rays;
use crate::scene::description::Light;

impl<S: Real> Shader<'_, S> {
    /// Radiance = emission + diffuse ambient + sum over lights of diffuse / pi * irradiance + mirror * radiance
    /// from the mirrored direction, `depth` mirrors deep; what leaves the scene sees the background.
    ///
    /// `work.vertices` are the hits of `rays`. A sample's terms are added level by level and light by light.
    pub(super) fn whitted(&self, rays: &Rays<S>, work: &mut Workspace<S>, out: &mut [Sample]) {
        for i in 0..rays.len() {
            if !work.hits.is_hit(i) && rays.is_live(i) {
                out[i].radiance = self.background;
                // A background that shines is part of the picture; a black one stays transparent.
                out[i].alpha = f64::from(u8::from(self.background != DVec3::ZERO));
            }
        }
        let mut vertices = std::mem::take(&mut work.vertices);
        let mut next = Vec::new();
        for level in 0..=self.settings.depth {
            for vertex in &vertices {
                let material = self.material(vertex.material);
                let unlit = material.emission + material.diffuse * self.ambient;
                out[vertex.path as usize].radiance += vertex.throughput * unlit;
            }
            for light in &self.lights {
                self.add_light(light, &vertices, work, out);
            }
            if level == self.settings.depth || vertices.is_empty() {
                break;
            }
            self.mirror(&vertices, &mut next, work, out);
            std::mem::swap(&mut vertices, &mut next);
        }
        work.vertices = vertices;
    }

    /// Adds what `light` contributes to each vertex, one compact batch of shadow rays for those that face it.
    fn add_light(&self, light: &Light, vertices: &[Vertex], work: &mut Workspace<S>, out: &mut [Sample]) {
        let lit: Vec<(&Vertex, DVec3)> = vertices
            .iter()
            .filter_map(|vertex| {
                let arriving = irradiance(light, vertex.position, vertex.normal)?;
                let value = vertex.throughput * self.material(vertex.material).diffuse / PI * arriving;
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
        self.occlude(work);
        for ((vertex, value), &occluded) in lit.iter().zip(&work.occluded) {
            if occluded == 0 {
                out[vertex.path as usize].radiance += *value;
            }
        }
    }

    /// Follows the mirror part of each vertex: its hits into `next`, the background where there is none.
    fn mirror(&self, vertices: &[Vertex], next: &mut Vec<Vertex>, work: &mut Workspace<S>, out: &mut [Sample]) {
        next.clear();
        let seen: Vec<(&Vertex, DVec3)> = vertices
            .iter()
            .map(|vertex| (vertex, vertex.throughput * self.material(vertex.material).mirror))
            .filter(|(_, throughput)| *throughput != DVec3::ZERO)
            .collect();
        if seen.is_empty() {
            return;
        }
        let mut batch = std::mem::take(&mut work.batch);
        batch.reset(seen.len());
        for (i, (vertex, _)) in seen.iter().enumerate() {
            let dir = reflect(vertex.dir, vertex.normal).to_array().map(S::from_f64);
            batch.set(i, vertex.leave(), dir, S::from_f64(0.0), S::from_f64(f64::INFINITY));
        }
        work.rays.mirror += batch.live_count() as u64;
        self.intersect(&batch, work);
        for (i, &(vertex, throughput)) in seen.iter().enumerate() {
            if work.hits.is_hit(i) {
                next.push(self.vertex(&batch, &work.hits, i, vertex.path, throughput));
            } else {
                out[vertex.path as usize].radiance += throughput * self.background;
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
