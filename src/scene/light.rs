//! Lights as described. Emitting surfaces are lights too: see [`super::material::Material::emission`].

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DAffine2, DMat3, DVec3};

use super::material::{TextureRef, Wrap};
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

/// How the picture is looked up.
const LOOKUP: TextureRef = TextureRef {
    texture: 0,
    uv_set: 0,
    transform: DAffine2::IDENTITY,
    wrap: [Wrap::Repeat, Wrap::Clamp],
    nearest: false,
};

impl Environment {
    /// Radiance from direction `dir` (where one looks; need not be unit), linear Rec.709, finite and not negative
    /// whatever the picture holds.
    pub fn radiance(&self, dir: DVec3) -> DVec3 {
        self.radiance_at(self.place(dir))
    }

    /// The same at a place of the picture, 0..1 to the right and down.
    pub fn radiance_at(&self, place: [f64; 2]) -> DVec3 {
        let [r, g, b, _] = self.texture.sample(&LOOKUP, place);
        let light = DVec3::new(r.into(), g.into(), b.into()) * self.scale;
        if light.is_finite() { light.max(DVec3::ZERO) } else { DVec3::ZERO }
    }

    /// Where in the picture direction `dir` is.
    pub fn place(&self, dir: DVec3) -> [f64; 2] {
        let d = (self.to_world.transpose() * dir).normalize_or(DVec3::NEG_Z);
        [0.5 + d.x.atan2(-d.z) / TAU, d.y.clamp(-1.0, 1.0).acos() / PI]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::Texels;

    #[test]
    fn the_middle_is_ahead_and_x_to_the_right() {
        let texels = Texels::Float(vec![[1.0; 4], [1.0; 4], [f32::NAN; 4], [1.0; 4]]);
        let texture = Arc::new(Texture { name: String::new(), width: 4, height: 1, texels });
        let e = Environment { texture, scale: DVec3::ONE, to_world: DMat3::IDENTITY };
        assert_eq!(e.place(DVec3::NEG_Z), [0.5, 0.5]);
        assert_eq!(e.place(DVec3::X * 3.0), [0.75, 0.5]);
        assert_eq!(e.place(DVec3::Y)[1], 0.0);
        assert_eq!((e.radiance_at([0.125, 0.5]), e.radiance_at([0.625, 0.5])), (DVec3::ONE, DVec3::ZERO));
    }
}
