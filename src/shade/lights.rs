//! Lights: how much arrives at a point, and the ray that asks whether it does.

use std::f64::consts::PI;

use glam::DVec3;

use crate::camera::Camera;
use crate::lanes::space::{scale, sub};
use crate::lanes::{Lanes, Lanes3, Real, dot, map3};
use crate::scene::description::Light;

/// The light of scenes that have none: directional, from beside and above the camera, with irradiance pi, so a
/// surface that faces it shows its own diffuse colour. It goes through walls (the shader asks for no shadows), or
/// every view from inside a room would be black.
pub fn headlight(camera: &Camera) -> Light {
    let direction = -(camera.n + 0.3 * camera.u + 0.4 * camera.v).normalize();
    Light::Directional { direction, irradiance: DVec3::splat(PI) }
}

/// A light as points in lanes see it.
pub(super) struct Lamp<V> {
    /// Where it is; `None`: infinitely far.
    position: Option<Lanes3<V>>,
    /// Unit direction to a light that is far.
    toward: Lanes3<V>,
    /// Intensity; of a light that is far irradiance.
    strength: Lanes3<V>,
    /// Of a spot light its unit direction, and the cosines of its angles.
    spot: Option<(Lanes3<V>, [V; 2])>,
}

impl<V: Lanes> Lamp<V> {
    /// Light `light`.
    pub fn new(light: &Light) -> Self {
        let vector = |v: DVec3| v.to_array().map(V::constant);
        let nowhere = vector(DVec3::ZERO);
        match *light {
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                let spot = match *light {
                    Light::Spot { direction, inner, outer, .. } => {
                        Some((vector(direction.normalize_or_zero()), [inner.cos(), outer.cos()].map(V::constant)))
                    }
                    _ => None,
                };
                Self { position: Some(vector(position)), toward: nowhere, strength: vector(intensity), spot }
            }
            Light::Directional { direction, irradiance } | Light::Sun { direction, irradiance, .. } => {
                let toward = vector(-direction.normalize_or_zero());
                Self { position: None, toward, strength: vector(irradiance), spot: None }
            }
        }
    }

    /// Irradiance that the light sends to surfaces at `position` with unit normal `normal`, if nothing is in between; and
    /// the lanes that it reaches: those that face it.
    #[inline(always)]
    pub fn irradiance(&self, position: Lanes3<V>, normal: Lanes3<V>) -> (Lanes3<V>, V::Mask) {
        let zero = V::constant(0.0);
        let (arriving, toward) = match self.position {
            Some(from) => {
                let to_light = sub(from, position);
                let largest = to_light[0].abs().fast_max(to_light[1].abs()).fast_max(to_light[2].abs());
                // Squares of large and small distances would leave the range of numbers.
                let nearer = V::constant(1.0) / largest;
                let scaled = scale(to_light, nearer);
                let square = dot(scaled, scaled);
                let toward = scale(scaled, V::constant(1.0) / square.sqrt());
                let share =
                    self.spot.map_or(V::constant(1.0), |(axis, cosines)| spot_share(-dot(toward, axis), cosines));
                // One division for three colours.
                let share = share / square;
                (map3(self.strength, |x| x * share * nearer * nearer), toward)
            }
            None => (self.strength, self.toward),
        };
        let cosine = dot(normal, toward);
        let value = scale(arriving, cosine);
        let sum = value[0] + value[1] + value[2];
        (value, zero.cmp_lt(cosine) & sum.abs().cmp_lt(V::splat(V::Scalar::INFINITY)))
    }

    /// Directions and ends of shadow rays from `org` to the light. The ray to a point light ends just before it: with t = 1
    /// at the light, so that a lamp drawn around or on a surface at that very point does not shade itself.
    #[inline(always)]
    pub fn segment(&self, org: Lanes3<V>) -> (Lanes3<V>, V::Scalar) {
        match self.position {
            Some(from) => {
                let end = 1.0 - 32.0 * V::Scalar::EPSILON.to_f64();
                (sub(from, org), V::Scalar::from_f64(end))
            }
            None => (self.toward, V::Scalar::INFINITY),
        }
    }
}

/// Share of a spot light's intensity that goes along directions at cosine `cosine` to its own; `inner` and `outer` are the
/// cosines of the angles within which all and beyond which nothing goes.
/// Source: the attenuation that the glTF extension KHR_lights_punctual recommends.
#[inline(always)]
pub(super) fn spot_share<V: Lanes>(cosine: V, [inner, outer]: [V; 2]) -> V {
    let share = (cosine - outer) / (inner - outer).fast_max(V::constant(1e-6));
    let share = share.fast_max(V::constant(0.0)).fast_min(V::constant(1.0));
    share * share
}

#[cfg(test)]
mod tests {
    use super::*;

    fn irradiance(light: &Light, position: DVec3, normal: DVec3) -> Option<DVec3> {
        let (value, faces) = Lamp::<f64>::new(light).irradiance(position.to_array(), normal.to_array());
        faces.then(|| DVec3::from(value))
    }

    #[test]
    fn point_light_falls_off_with_the_square_and_the_cosine() {
        for scale in [1.0, 1e-30, 1e30] {
            let light = Light::Point {
                position: DVec3::new(3.0, 4.0, 0.0) * scale,
                intensity: DVec3::new(50.0, 25.0, 0.0) * scale * scale,
            };
            // Distance 5, cosine 4/5: 50 / 25 * 0.8.
            let e = irradiance(&light, DVec3::ZERO, DVec3::Y).unwrap();
            assert!((e - DVec3::new(1.6, 0.8, 0.0)).length() < 1e-14, "{e}");
            assert_eq!(irradiance(&light, DVec3::ZERO, -DVec3::Y), None);
            assert_eq!(irradiance(&light, DVec3::new(3.0, 4.0, 0.0) * scale, DVec3::Y), None);
        }
    }

    #[test]
    fn directional_light_knows_no_distance_and_no_length() {
        let light = Light::Directional { direction: DVec3::new(0.0, -7.0, 0.0), irradiance: DVec3::splat(2.0) };
        let tilted = DVec3::new(0.6, 0.8, 0.0);
        assert!((irradiance(&light, DVec3::splat(1e9), tilted).unwrap() - DVec3::splat(1.6)).length() < 1e-15);
        assert_eq!(Lamp::<f32>::new(&light).segment([0.0; 3]), ([0.0, 1.0, 0.0], f32::INFINITY));
    }

    #[test]
    fn shadow_rays_end_just_before_a_point_light() {
        let light = Light::Point { position: DVec3::new(0.0, 8.0, 0.0), intensity: DVec3::ONE };
        let (dir, t_max) = Lamp::<f32>::new(&light).segment([0.0, 2.0, 0.0]);
        assert_eq!(dir, [0.0, 6.0, 0.0]);
        assert!(t_max < 1.0 && t_max > 0.999_99);
    }

    /// Half the cosine's way from the outer to the inner angle: a quarter.
    #[test]
    fn spot_lights_fade_between_their_angles() {
        let (inner, outer) = (0.2, 0.6);
        let light =
            Light::Spot { position: DVec3::ZERO, direction: DVec3::X * 3.0, intensity: DVec3::ONE, inner, outer };
        let at = |cosine: f64| {
            let position = DVec3::new(cosine, (1.0 - cosine * cosine).sqrt(), 0.0);
            irradiance(&light, position, -position).map_or(0.0, |e| e.x)
        };
        let middle = 0.5 * (inner.cos() + outer.cos());
        for (cosine, share) in
            [(1.0, 1.0), (inner.cos() + 1e-9, 1.0), (middle, 0.25), (outer.cos() - 1e-9, 0.0), (-1.0, 0.0)]
        {
            assert!((at(cosine) - share).abs() < 1e-12, "{cosine}");
        }
    }
}
