//! Lights: how much arrives at a point, and the ray that asks whether it does.

use std::f64::consts::PI;

use glam::DVec3;

use crate::camera::Camera;
use crate::lanes::Real;
use crate::scene::description::Light;

/// The light of scenes that have none: directional, from beside and above the camera, with irradiance pi, so a
/// surface that faces it shows its own diffuse colour. It goes through walls (the shader asks for no shadows), or
/// every view from inside a room would be black.
pub fn headlight(camera: &Camera) -> Light {
    let direction = -(camera.n + 0.3 * camera.u + 0.4 * camera.v).normalize();
    Light::Directional { direction, irradiance: DVec3::splat(PI) }
}

/// Irradiance that `light` sends to a surface at `position` with unit normal `normal`, if nothing is in between;
/// `None` if the surface faces away.
pub(super) fn irradiance(light: &Light, position: DVec3, normal: DVec3) -> Option<DVec3> {
    let (arriving, direction) = match *light {
        Light::Point { position: from, intensity } => {
            let to_light = from - position;
            (intensity / to_light.length_squared(), to_light)
        }
        Light::Spot { position: from, intensity, .. } => {
            let to_light = from - position;
            (intensity * spot_share(light, -to_light) / to_light.length_squared(), to_light)
        }
        Light::Directional { direction, irradiance } | Light::Sun { direction, irradiance, .. } => {
            (irradiance, -direction)
        }
    };
    let cosine = normal.dot(direction.normalize_or_zero());
    let value = arriving * cosine;
    (cosine > 0.0 && value.is_finite()).then_some(value)
}

/// Share of a spot light's intensity that goes along `away` (from the light, need not be unit); 1 for other lights.
/// Source: the attenuation that the glTF extension KHR_lights_punctual recommends.
pub(super) fn spot_share(light: &Light, away: DVec3) -> f64 {
    let Light::Spot { direction, inner, outer, .. } = *light else { return 1.0 };
    let cosine = away.normalize_or_zero().dot(direction.normalize_or_zero());
    let (full, none) = (inner.cos(), outer.cos());
    ((cosine - none) / (full - none).max(1e-6)).clamp(0.0, 1.0).powi(2)
}

/// Direction and end of the shadow ray from `org` to `light`. The ray to a point light ends just before it: with
/// t = 1 at the light, so that a lamp drawn around or on a surface at that very point does not shade itself.
pub(super) fn shadow_segment<S: Real>(light: &Light, org: DVec3) -> (DVec3, f64) {
    match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            (position - org, 1.0 - 32.0 * S::EPSILON.to_f64())
        }
        Light::Directional { direction, .. } | Light::Sun { direction, .. } => (-direction, f64::INFINITY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn point_light_falls_off_with_the_square_and_the_cosine() {
        let light = Light::Point { position: DVec3::new(3.0, 4.0, 0.0), intensity: DVec3::new(50.0, 25.0, 0.0) };
        // Distance 5, cosine 4/5: 50 / 25 * 0.8.
        let e = irradiance(&light, DVec3::ZERO, DVec3::Y).unwrap();
        assert!((e - DVec3::new(1.6, 0.8, 0.0)).length() < 1e-15, "{e}");
        assert_eq!(irradiance(&light, DVec3::ZERO, -DVec3::Y), None);
        assert_eq!(irradiance(&light, DVec3::new(3.0, 4.0, 0.0), DVec3::Y), None);
    }

    #[test]
    fn directional_light_knows_no_distance_and_no_length() {
        let light = Light::Directional { direction: DVec3::new(0.0, -7.0, 0.0), irradiance: DVec3::splat(2.0) };
        let tilted = DVec3::new(0.6, 0.8, 0.0);
        assert!((irradiance(&light, DVec3::splat(1e9), tilted).unwrap() - DVec3::splat(1.6)).length() < 1e-15);
        let (dir, t_max) = shadow_segment::<f32>(&light, DVec3::ZERO);
        assert_eq!((dir, t_max), (DVec3::new(0.0, 7.0, 0.0), f64::INFINITY));
    }

    #[test]
    fn shadow_rays_end_just_before_a_point_light() {
        let light = Light::Point { position: DVec3::new(0.0, 8.0, 0.0), intensity: DVec3::ONE };
        let (dir, t_max) = shadow_segment::<f32>(&light, DVec3::new(0.0, 2.0, 0.0));
        assert_eq!(dir, DVec3::new(0.0, 6.0, 0.0));
        assert!(t_max < 1.0 && t_max > 0.999_99 && (t_max as f32) < 1.0);
    }
}
