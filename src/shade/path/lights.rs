//! What shines: the list of lights and emitting surfaces that paths aim at.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::alias::Alias;
use super::emitter::{Aim, Emitter};
use super::form::{Form, Kind};
use super::sky::Sky;
use super::surfaces::Surfaces;
use crate::lanes::Real;
use crate::scene::description::{Description, Light};
use crate::scene::world::World;
use crate::shade::look::Looks;

/// Everything that shines.
pub struct Lights<'a, S> {
    emitters: Vec<Emitter>,
    /// Parallel to the list, the sky last: what packets need of them.
    forms: Vec<Form<S>>,
    /// Parallel to them: kind and chance.
    kinds: Vec<(Kind, S)>,
    alias: Alias,
    /// Those of the list that come first.
    surfaces: Surfaces,
    /// Index of the sky in the list.
    sky_index: usize,
    sky: Option<Sky<'a>>,
    /// Indices of the suns: rays that leave the scene may see them.
    suns: Vec<usize>,
    background: DVec3,
}

impl<'a, S: Real> Lights<'a, S> {
    /// The lights of `description` and the emitting surfaces of `world`; where nothing shines, a sky of radiance 1 in
    /// all directions.
    pub fn new(world: &World<S>, description: &'a Description, looks: &Looks<'_>) -> Self {
        Self::of(Surfaces::new(world, looks), world, description, looks)
    }

    /// The same with `surfaces` as those that are aimed at.
    pub fn of(surfaces: Surfaces, world: &World<S>, description: &'a Description, looks: &Looks<'_>) -> Self {
        let mut emitters = surfaces.emitters(world);
        emitters.extend(description.lights.iter().map(|&light| Emitter::Light(light)));
        let is_dark = emitters.is_empty() && description.environment.is_none() && description.background == DVec3::ZERO;
        let is_sun = |e: &Emitter| matches!(e, Emitter::Light(Light::Sun { .. }));
        let suns = (0..emitters.len()).filter(|&i| is_sun(&emitters[i])).collect();
        let sky = description.environment.as_ref().map(Sky::new);
        let sky_index = emitters.len();
        let radius = world.bounds().map_or(1.0, |(lo, hi)| 0.5 * (hi - lo).length()).max(1e-30);
        let mut weights: Vec<f64> = emitters.iter().map(|e| e.power(radius, looks)).collect();
        weights.extend(sky.as_ref().map(|sky| sky.brightness() * PI * radius * radius));
        share(&mut weights, |i| emitters.get(i).is_none_or(Emitter::is_far));
        let of_sky =
            sky.as_ref().and_then(Sky::even).map_or(Form::Other, |light| Form::Sky(light.to_array().map(S::from_f64)));
        let forms: Vec<_> = emitters.iter().map(|e| e.form(looks)).chain([of_sky]).collect();
        let alias = Alias::new(&weights);
        let kind = |(i, form): (usize, &Form<S>)| (form.kind(), S::from_f64(alias.chance(i)));
        Self {
            emitters,
            kinds: forms.iter().enumerate().map(kind).collect(),
            forms,
            alias,
            surfaces,
            sky_index,
            sky,
            suns,
            background: if is_dark { DVec3::ONE } else { description.background },
        }
    }

    /// The light that the bits `choice` fall on, its kind and its chance.
    #[inline(always)]
    pub fn choose(&self, choice: u32) -> Option<(usize, Kind, S)> {
        let index = self.alias.choose(choice)?;
        let (kind, chance) = self.kinds[index];
        Some((index, kind, chance))
    }

    /// What packets need of light `index`.
    #[inline(always)]
    pub fn form(&self, index: usize) -> &Form<S> {
        &self.forms[index]
    }

    /// Whether nothing can be aimed at.
    pub fn is_empty(&self) -> bool {
        self.alias.choose(0).is_none()
    }

    /// Aims from `from` at light `index`.
    pub fn aim(&self, from: DVec3, index: usize, place: [f64; 2], world: &World<S>, looks: &Looks<'_>) -> Option<Aim> {
        let aim = if index == self.sky_index {
            let sky = self.sky.as_ref()?;
            let (dir, radiance, pdf) = sky.sample(place)?;
            Aim { target: dir, is_far: true, dir, pdf, radiance, is_point: false }
        } else {
            self.emitters[index].aim(from, place, world, looks)?
        };
        let chance = self.alias.chance(index);
        let pdf = if aim.is_point { chance } else { aim.pdf * chance };
        (pdf > 0.0).then_some(Aim { pdf, ..aim })
    }

    /// Density with which [`Self::aim`] from `from` finds the hit at `to`, unit geometric normal `ng`, on primitive
    /// `prim` of instance `inst`: per solid angle; 0 if it never does.
    pub fn pdf_of_hit(&self, from: DVec3, to: DVec3, ng: DVec3, prim: u32, inst: u32, world: &World<S>) -> f64 {
        let object = world.assembly.placements[inst as usize].object;
        self.surfaces
            .index(prim, inst, object)
            .map_or(0.0, |i| self.alias.chance(i) * self.emitters[i].pdf(from, to, ng))
    }

    /// Whether there is something behind the scene that pictures show, also where it is black: an environment, or a background
    /// that is not.
    pub fn are_behind(&self) -> bool {
        self.sky.is_some() || self.background != DVec3::ZERO
    }

    /// Radiance of all rays that leave the scene, and the density per solid angle with which [`Self::aim`] finds it, where
    /// they are the same for all directions.
    pub fn even(&self) -> Option<(DVec3, f64)> {
        if !self.suns.is_empty() {
            return None;
        }
        let Some(sky) = &self.sky else { return Some((self.background, 0.0)) };
        let radiance = sky.even()?;
        Some((radiance, self.alias.chance(self.sky_index) * sky.seen(DVec3::Y).1))
    }

    /// Radiance of a ray that leaves the scene in direction `dir` (need not be unit): each source of it times `weight` of the
    /// density per solid angle with which [`Self::aim`] finds it there.
    pub fn beyond(&self, dir: DVec3, weight: impl Fn(f64) -> f64) -> DVec3 {
        let mut sum = match &self.sky {
            None => self.background * weight(0.0),
            Some(sky) => {
                let (radiance, pdf) = sky.seen(dir);
                radiance * weight(self.alias.chance(self.sky_index) * pdf)
            }
        };
        for &sun in &self.suns {
            if let Some((radiance, pdf)) = self.emitters[sun].sun(dir.normalize_or_zero()) {
                sum += radiance * weight(self.alias.chance(sun) * pdf);
            }
        }
        sum
    }
}

/// A uniform direction of the cone around `axis` whose cosine of the half angle is `1 - height`, as a unit vector.
pub(super) fn in_cone(axis: DVec3, height: f64, place: [f64; 2]) -> DVec3 {
    let below = place[0] * height;
    let sin = (below * (2.0 - below)).max(0.0).sqrt();
    let [x, y] = crate::camera::sampling::orthonormal_basis(axis);
    let (s, c) = (TAU * place[1]).sin_cos();
    x * (sin * c) + y * (sin * s) + axis * (1.0 - below)
}

/// Weighs light from afar (`is_far`) down to that of the scene's own lights: what falls on the whole scene is more than
/// what arrives at a place in it, of which lamps close by give more than their part.
fn share(weights: &mut [f64], is_far: impl Fn(usize) -> bool) {
    let of = |far: bool| (0..weights.len()).filter(|&i| is_far(i) == far).map(|i| weights[i]).sum::<f64>();
    let (near, far) = (of(false), of(true));
    if 0.0 < near && near < far && far.is_finite() {
        (0..weights.len()).filter(|&i| is_far(i)).for_each(|i| weights[i] *= near / far);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_from_afar_is_chosen_as_often_as_lamps_at_most() {
        let shared = |mut weights: [f64; 4]| {
            share(&mut weights, |i| i >= 2);
            weights
        };
        assert_eq!(shared([1.0, 3.0, 30.0, 10.0]), [1.0, 3.0, 3.0, 1.0]);
        assert_eq!(shared([1.0, 3.0, 2.0, 1.0]), [1.0, 3.0, 2.0, 1.0]);
        assert_eq!(shared([0.0, 0.0, 2.0, 1.0]), [0.0, 0.0, 2.0, 1.0]);
    }
}
