//! Lights as described. Emitting surfaces are lights too: see [`super::material::Material::emission`].

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::texture::Texture;

/// A light without a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Point light: irradiance at distance r is `intensity` / r^2.
    Point {
        /// World position.
        position: DVec3,
        /// Radiant intensity, linear Rec.709.
        intensity: DVec3,
    },
    /// Directional light, infinitely far.
    Directional {
        /// Direction the light travels (from the light into the scene), need not be unit.
        direction: DVec3,
        /// Irradiance on a surface facing the light, linear Rec.709.
        irradiance: DVec3,
    },
    /// Point light that shines into a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// Axis of the cone, need not be unit.
        direction: DVec3,
        /// Radiant intensity along the axis, linear Rec.709.
        intensity: DVec3,
        /// Angle from the axis up to which the intensity is full, radians.
        inner: f64,
        /// Angle from the axis where it has fallen to 0, radians; larger than `inner`, below pi.
        outer: f64,
    },
    /// Disc of constant radiance, infinitely far.
    Sun {
        /// Direction the light travels from the disc's centre, need not be unit.
        direction: DVec3,
        /// Irradiance on a surface facing the centre, linear Rec.709.
        irradiance: DVec3,
        /// Angle from the centre to the rim, radians; above 0, below pi / 2.
        radius: f64,
    },
}

/// Radiance from all directions, by a picture whose columns are longitudes and whose rows are latitudes.
///
/// Direction (x, y, z), y up, in the picture's own space is at u = 1/2 + atan2(x, -z) / 2 pi, v = acos(y) / pi: the
/// middle of the picture is the direction -z, +x is to its right.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The picture, with [`super::texture::Texels::Float`].
    pub texture: Arc<Texture>,
    /// Factor of its values.
    pub scale: DVec3,
    /// The picture's space to world space, a rotation.
    pub to_world: DMat3,
}
