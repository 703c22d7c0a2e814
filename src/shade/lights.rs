//! Lights: how much arrives at a point, and the ray that asks whether it does.

use std::f64::consts::PI;

use glam::DVec3;

use crate::camera::Camera;
use crate::lanes::space::{add, scale, sub};
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
    /// How a spot light's intensity falls off.
    spot: Option<Spot<V>>,
}

impl<V: Lanes> Lamp<V> {
    /// Light `light`.
    pub fn new(light: &Light) -> Self {
        let vector = |v: DVec3| v.to_array().map(V::constant);
        let nowhere = vector(DVec3::ZERO);
        match *light {
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                let spot = match *light {
                    Light::Spot { direction, inner, outer, .. } => Some(Spot::new(direction, inner, outer)),
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
                let share = self.spot.as_ref().map_or(V::constant(1.0), |spot| spot.share(toward));
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

/// How the intensity of a spot light falls off away from its axis. Angles are kept as the heights of their caps, 1 - cos,
/// which narrow spots have many digits of where their cosines have few.
/// Source: the attenuation that the glTF extension KHR_lights_punctual recommends.
pub(super) struct Spot<V> {
    /// Unit direction of the axis.
    axis: Lanes3<V>,
    /// Height of the angle beyond which nothing goes.
    outer: V,
    /// How much that is above the height of the angle within which all goes.
    fade: V,
}

impl<V: Lanes> Spot<V> {
    /// Below it the edge is sharp: angles this small are beyond the digits of a direction.
    const LEAST_FADE: f64 = 1e-30;

    /// The spot light along `direction` with angles `inner` and `outer`.
    pub fn new(direction: DVec3, inner: f64, outer: f64) -> Self {
        // cos a - cos b = 2 sin((b + a) / 2) sin((b - a) / 2).
        let fall = |from: f64, to: f64| 2.0 * (0.5 * (to + from)).sin() * (0.5 * (to - from)).sin();
        Self {
            axis: direction.normalize_or_zero().to_array().map(V::constant),
            outer: V::constant(fall(0.0, outer)),
            fade: V::constant(fall(inner, outer).max(Self::LEAST_FADE)),
        }
    }

    /// Share of the intensity that arrives where the unit direction `toward` leads to the light.
    #[inline(always)]
    pub fn share(&self, toward: Lanes3<V>) -> V {
        // The chord between two unit directions: its square is twice the height.
        let chord = add(toward, self.axis);
        let height = V::constant(0.5) * dot(chord, chord);
        let share = (self.outer - height) / self.fade;
        let share = share.fast_max(V::constant(0.0)).fast_min(V::constant(1.0));
        share * share
    }
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

    /// Where the height of the cap is half the whole one, at its angle over the root of 2 as angles are small, a quarter goes.
    #[test]
    fn narrow_spot_lights_are_full_along_their_axis() {
        for (outer, in_f32) in [(1e-2, true), (8.7e-4, true), (1e-4, true), (1e-7, false)] {
            let light = Light::Spot {
                position: DVec3::ZERO,
                direction: DVec3::X,
                intensity: DVec3::splat(50.0),
                inner: 0.0,
                outer,
            };
            for (angle, share) in [(0.0, 1.0), (outer * 0.5f64.sqrt(), 0.25), (1.5 * outer, 0.0)] {
                let p = DVec3::new(angle.cos(), angle.sin(), 0.0);
                let exact = irradiance(&light, p, -p).unwrap().x;
                assert!((exact / 50.0 - share).abs() < 1e-5, "{outer} {angle}: {exact}");
                let (short, _) = Lamp::<f32>::new(&light).irradiance(p.as_vec3().to_array(), (-p).as_vec3().to_array());
                assert!(!in_f32 || (short[0] / 50.0 - share as f32).abs() < 1e-4, "{outer} {angle}: {short:?}");
            }
        }
        let sharp =
            Light::Spot { position: DVec3::ZERO, direction: DVec3::X, intensity: DVec3::ONE, inner: 0.3, outer: 0.3 };
        for (angle, share) in [(0.299_f64, 1.0), (0.301, 0.0)] {
            let p = DVec3::new(angle.cos(), angle.sin(), 0.0);
            assert!((irradiance(&sharp, p, -p).unwrap().x - share).abs() < 1e-12, "{angle}");
        }
    }
}
