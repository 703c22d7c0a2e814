//! Recursive ray tracing without recursion: one batch per level and light, shaded in lanes.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::branches::Branches;
use super::classic::refracted;
use super::colors::Colors;
use super::lights::Lamp;
use super::meeting::met_lanes;
use super::shader::{Shader, Workspace};
use super::spot::Spots;
use super::vertices::{DIFFUSE, EMISSION, ETA, MIRROR, NORMAL, POSITION, THROUGH, Vertices};
use crate::lanes::chosen::lanes_of;
use crate::lanes::space::{add, choose, scale, times};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, dot, each};
use crate::ray::Rays;
use crate::scene::description::Light;

/// Branches whose light would be weakened below this are not followed.
const CUT_OFF: f64 = 1.0 / 1024.0;

/// One thread's arrays, reused from level to level.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory<S> {
    now: Branches<S>,
    next: Branches<S>,
    shadows: Branches<S>,
}

/// A level: its rays, what they carry, and where they arrived.
struct Level<'m, S> {
    rays: &'m Rays<S>,
    carried: &'m Branches<S>,
    vertices: &'m Vertices<S>,
}

impl<S: Real> Shader<'_, S> {
    /// Radiance = emission + diffuse ambient + sum over lights of diffuse / pi * irradiance + mirror * radiance from
    /// the mirrored direction + through * radiance from the refracted direction, `depth` levels deep; what leaves the
    /// scene sees the background. Light passes glass straight on its way from a light.
    ///
    /// `work.hits` are the hits of `rays`. A sample's terms are added level by level and light by light.
    pub(super) fn whitted(&self, rays: &Rays<S>, spots: Spots<'_>, work: &mut Workspace<S>, out: &mut Colors) {
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let unmet = S::Wide::ALL & !met_lanes(&work.hits, first);
            if unmet == 0 {
                continue;
            }
            let missed = unmet & rays.live_lanes(first);
            if let Some(behind) = self.even_beyond() {
                out.set_lanes::<S::Wide>(first, missed, self.behind(behind));
                continue;
            }
            for i in lanes_of(missed).map(|lane| first + lane) {
                out.set(i, self.behind(self.beyond(DVec3::from(rays.dir(i).map(S::to_f64)))));
            }
        }
        let mut memory = work.whitted.take().unwrap_or_default();
        let Memory { now, next, shadows } = &mut *memory;
        let mut vertices = work.vertices.take().unwrap_or_default();
        now.start(rays.len());
        for level in 0..=self.settings.depth {
            let level_rays = if level == 0 { rays } else { &now.rays };
            self.meet(level_rays, &work.hits, &mut vertices);
            let here = Level { rays: level_rays, carried: now, vertices: &vertices };
            self.add_unlit(&here, out);
            for light in &self.lights {
                self.add_light(light, &here, shadows, work, out);
            }
            let [mirrored, refracted] = if level < self.settings.depth {
                branch(&here, next)
            } else {
                next.open(0);
                [0; 2]
            };
            work.lap(level);
            // They are traced in the next level, and count there.
            work.rays.mirror += mirrored;
            work.rays.refracted += refracted;
            std::mem::swap(now, next);
            if now.len() == 0 {
                break;
            }
            self.intersect(&now.rays, work, |i, layer| {
                self.draw(spots.at(now.path[i] as usize)).number(level + 1, layer)
            });
            for i in (0..now.len()).filter(|i| !work.hits.is_hit(*i)) {
                let behind = self.beyond(DVec3::from(now.rays.dir(i).map(S::to_f64)));
                out.add(now.path[i] as usize, now.weight_of(i) * behind);
            }
        }
        (work.whitted, work.vertices) = (Some(memory), Some(vertices));
    }

    /// Adds what points show without any light's help.
    fn add_unlit(&self, level: &Level<'_, S>, out: &mut Colors) {
        let Level { carried, vertices, .. } = level;
        let ambient = self.ambient.to_array().map(S::Wide::constant);
        for (first, lanes) in vertices.packets() {
            let shining = vertices.shining[first / S::Wide::N];
            let lanes = if self.ambient == DVec3::ZERO { shining } else { lanes };
            if lanes == 0 {
                continue;
            }
            let reflected = times(vertices.vector(DIFFUSE, first), scale(ambient, vertices.ambient(first)));
            let shines = <S::Wide as Lanes>::Mask::from_bits(shining);
            let nothing = [S::Wide::constant(0.0); 3];
            let emitted = choose(shines, vertices.vector(EMISSION, first), nothing);
            let value = carried.weighed(first, add(emitted, reflected));
            carried.shine(first, lanes, value, out);
        }
    }

    /// Adds what `light` contributes, one compact batch of shadow rays for the points that face it.
    fn add_light(
        &self,
        light: &Light,
        level: &Level<'_, S>,
        shadows: &mut Branches<S>,
        work: &mut Workspace<S>,
        out: &mut Colors,
    ) {
        let Level { rays, carried, vertices } = level;
        let lamp = Lamp::<S::Wide>::new(light);
        let zero = S::Wide::constant(0.0);
        shadows.open(if self.shadows { rays.len() } else { 0 });
        for (first, lanes) in vertices.packets() {
            let (arriving, faces) = lamp.irradiance(vertices.vector(POSITION, first), vertices.shading(first));
            let diffuse = scale(vertices.vector(DIFFUSE, first), S::Wide::constant(FRAC_1_PI));
            let value = times(carried.weighed(first, diffuse), arriving);
            let some = !(value[0].cmp_eq(zero) & value[1].cmp_eq(zero) & value[2].cmp_eq(zero));
            let lit = (faces & some).bits() & lanes;
            if lit == 0 {
                continue;
            }
            if self.shadows {
                let org = vertices.leave(first);
                let (dir, t_max) = lamp.segment(org);
                shadows.push(lit, &carried.path[first..], [org, dir, value], t_max);
            } else {
                carried.shine(first, lit, value, out);
            }
        }
        shadows.close();
        if shadows.len() == 0 {
            return;
        }
        work.rays.shadow += shadows.rays.live_count() as u64;
        if self.occlude_wholly(&shadows.rays, work) {
            return shadows.arrive(&work.occluded, out);
        }
        self.occlude(&shadows.rays, work, true, |i, left| {
            out.add(shadows.path[i] as usize, shadows.weight_of(i) * left);
        });
    }
}

/// The mirrored and refracted rays of `level` that carry enough light into `next`, all mirrored ones first, and how many of each there are.
fn branch<S: Real>(level: &Level<'_, S>, next: &mut Branches<S>) -> [u64; 2] {
    let Level { rays, carried, vertices } = level;
    let bright = |light: Lanes3<S::Wide>| {
        S::Wide::constant(CUT_OFF).cmp_le(light[0].fast_max(light[1]).fast_max(light[2])).bits()
    };
    let along = |first: usize| -> Lanes3<S::Wide> { each(|axis| S::Wide::load(&rays.dir[axis][first..])) };
    next.open(2 * rays.len());
    for (first, lanes) in vertices.sending() {
        let throughput = carried.weighed(first, vertices.vector(MIRROR, first));
        let lanes = lanes & bright(throughput);
        if lanes == 0 {
            continue;
        }
        let (normal, dir) = (vertices.vector(NORMAL, first), along(first));
        let mirrored = reflect(dir, vertices.shading(first));
        // Where the shading normal would send it into the surface, the surface's own normal decides.
        let outward = S::Wide::constant(0.0).cmp_lt(dot(mirrored, normal));
        let dir = choose(outward, mirrored, reflect(dir, normal));
        next.push(lanes, &carried.path[first..], [vertices.leave(first), dir, throughput], S::INFINITY);
    }
    let count_mirrored = next.len();
    for (first, lanes) in vertices.sending() {
        let throughput = carried.weighed(first, vertices.vector(THROUGH, first));
        let lanes = lanes & bright(throughput);
        if lanes == 0 {
            continue;
        }
        let (dir, normal, shading) = (along(first), vertices.vector(NORMAL, first), vertices.shading(first));
        let (dir, goes_on) = entering(dir, normal, shading, vertices.scalar(ETA, first));
        let lanes = lanes & goes_on.bits();
        next.push(lanes, &carried.path[first..], [vertices.enter(first), dir, throughput], S::INFINITY);
    }
    next.close();
    let mirrored = next.rays.live_among(count_mirrored);
    [mirrored, next.rays.live_count() - mirrored].map(|count| count as u64)
}

/// Directions `dir` refracted at surfaces with unit normals `normal` and shading normals `shading`, and the lanes without
/// total reflection; see [`refracted`].
#[inline(always)]
fn entering<V: Lanes>(dir: Lanes3<V>, normal: Lanes3<V>, shading: Lanes3<V>, eta: V) -> (Lanes3<V>, V::Mask) {
    let zero = V::constant(0.0);
    let (bent, bends) = refracted(dir, shading, eta);
    let (own, goes_on) = refracted(dir, normal, eta);
    // Where the shading normal is seen from behind, or would send the ray out again, the surface's own normal decides.
    let inward = dot(dir, shading).cmp_lt(zero) & dot(bent, normal).cmp_lt(zero);
    (choose(inward, bent, own), inward & bends | !inward & goes_on)
}

/// Directions `dir` mirrored at planes with unit normals `normal`; the length stays.
#[inline(always)]
fn reflect<V: Lanes>(dir: Lanes3<V>, normal: Lanes3<V>) -> Lanes3<V> {
    let along = V::constant(-2.0) * dot(dir, normal);
    each(|i| normal[i].mul_add(along, dir[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_turn_the_normal_part_only() {
        let d = reflect([3.0, -4.0, 1.0], [0.0, 1.0, 0.0]);
        assert_eq!(d, [3.0, 4.0, 1.0]);
        let n = DVec3::new(1.0, 1.0, 0.0).normalize();
        let d = DVec3::from(reflect([-2.0, 0.0, 0.0], n.to_array()));
        assert!((d - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-15);
    }
}
