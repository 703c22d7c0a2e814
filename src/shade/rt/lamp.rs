//! Lights: regions whose shader is `light`.

use glam::DVec3;

use super::AMBIENT;
use super::material::RtMaterial;
use crate::camera::Camera;
use crate::scene::brlcad::describe::{Look, Looks};

/// A light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    /// Where it shines from.
    pub position: DVec3,
    /// Where it aims, unit.
    pub aim: DVec3,
    /// Cosine of the angle around `aim` that it lights.
    pub cosine: f64,
    pub color: DVec3,
    /// Its share of all light.
    pub fraction: f64,
    /// Its region; `None` for the default light, which casts no shadows.
    pub region: Option<u32>,
}

/// The lights of `looks`; without any, one to the viewer's left and behind, as far off as the view is wide.
pub(super) fn lamps(looks: &Looks, materials: &[RtMaterial], camera: &Camera) -> Vec<Lamp> {
    let of = |(i, look): (usize, &Look)| materials[i].is_light.then(|| lamp(i as u32, look));
    let mut lamps: Vec<(Lamp, f64, bool)> = looks.regions.iter().enumerate().filter_map(of).flatten().collect();
    let strongest = lamps.iter().filter(|lamp| !lamp.2).map(|lamp| lamp.1).fold(0.0, f64::max);
    for (lamp, intensity, is_fixed) in &mut lamps {
        if !*is_fixed {
            lamp.fraction = *intensity / (strongest * (1.0 + AMBIENT * 0.5));
        }
    }
    if lamps.is_empty() {
        let position = camera.eye + (camera.n - camera.u) * camera.half_width;
        let fraction = 1.0 / (1.0 + AMBIENT * 0.5);
        return vec![Lamp { position, aim: -camera.n, cosine: -1.0, color: DVec3::ONE, fraction, region: None }];
    }
    lamps.into_iter().map(|(lamp, ..)| lamp).collect()
}

/// A light region: the light, its intensity, and whether its fraction is given. `None` without a place.
fn lamp(region: u32, look: &Look) -> Option<(Lamp, f64, bool)> {
    let shader = look.shader.as_ref()?;
    let middle = || look.bounds.map(|(lo, hi)| (lo + hi) * 0.5);
    let position = look.centre.or_else(middle)?;
    let aim = look.place.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    let angle = shader.number(&["angle", "a"]).unwrap_or(180.0);
    let fraction = shader.number(&["fract", "f"]).filter(|&fraction| fraction > 0.0);
    let intensity = shader.number(&["inten", "b", "bright"]).unwrap_or(1.0);
    let color = look.color.unwrap_or(DVec3::ONE);
    let lamp = Lamp {
        position,
        aim,
        cosine: angle.to_radians().cos(),
        color,
        fraction: fraction.unwrap_or_default(),
        region: Some(region),
    };
    Some((lamp, intensity, fraction.is_some()))
}

impl Lamp {
    /// What the light itself looks like from a direction: `facing` is the cosine to the viewer.
    pub fn seen(&self, facing: f64, normal: DVec3) -> DVec3 {
        let f = facing * 0.5;
        self.color * if normal.dot(self.aim) < self.cosine { f * self.fraction } else { (f + 0.5) * self.fraction }
    }
}
