//! Materials as recursive ray tracing sees them: a diffuse colour, a mirror and a refraction, all without spread.

use glam::DVec3;

use super::look::{Look, Looks, Model};
use super::path::fresnel;
use crate::scene::world::Surface;

/// Rougher facets than this width are taken for diffuse: a mirror would show what they blur away.
const MIRROR_WIDTH: f64 = 0.05;

/// What one point does with light from the direction it is seen along.
#[derive(Clone, Copy, Debug, Default)]
pub struct Classic {
    /// Radiance that leaves the point towards the viewer by itself.
    pub emission: DVec3,
    /// Base colour of the material.
    pub base: DVec3,
    /// Diffuse reflectance.
    pub diffuse: DVec3,
    /// Share of the mirrored direction's radiance.
    pub mirror: DVec3,
    /// Share of the radiance of the direction behind the surface.
    pub through: DVec3,
    /// Index of refraction behind the surface over that before it; 1 lets light go straight on.
    pub eta: f64,
}

impl Classic {
    /// The point `surface` seen along `dir` (not unit). Mixtures count as their first material.
    pub fn of(looks: &Looks<'_>, surface: &Surface<'_>, dir: DVec3) -> Self {
        let from_front = surface.ng.dot(dir) <= 0.0;
        let material = looks.resolve(surface.material, 1.0);
        let look = looks.look(material, surface, from_front);
        let cos = surface.ng.dot(dir.normalize_or_zero()).abs().min(1.0);
        let emission = looks.emission(surface.material, surface, from_front);
        Self { emission, base: look.base, ..Self::scattered(&look, cos) }
    }

    /// How `look` scatters light that it meets at cosine `cos`.
    fn scattered(look: &Look, cos: f64) -> Self {
        let (base, p) = (look.base, &look.param);
        let plain = Self { eta: 1.0, ..Self::default() };
        match look.model {
            Model::Matte => Self { diffuse: base, mirror: DVec3::new(p[0], p[1], p[2]), ..plain },
            Model::SmoothConductor | Model::RoughConductor => {
                let f = DVec3::from([0, 1, 2].map(|c| fresnel::conductor(cos, p[c], p[c + 3])));
                Self { mirror: f, ..plain }
            }
            Model::SmoothDielectric | Model::RoughDielectric => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                Self { mirror: DVec3::splat(f), through: base * (1.0 - f), eta: p[0], ..plain }
            }
            Model::Thin => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                let f = 2.0 * f / (1.0 + f);
                Self { mirror: DVec3::splat(f), through: base * (1.0 - f), ..plain }
            }
            Model::SmoothCoat | Model::RoughCoat => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                let mirror = if p[2] > MIRROR_WIDTH { DVec3::ZERO } else { DVec3::splat(f) };
                Self { diffuse: base * (1.0 - f), mirror, ..plain }
            }
            Model::MetalRough => {
                let [metallic, width, f0, transmission] = [p[0], p[1], p[2], p[3]];
                let body = base * (1.0 - metallic);
                let f0 = base * metallic + DVec3::splat(f0 * (1.0 - metallic));
                let f = DVec3::from(fresnel::schlick(cos, f0.to_array()));
                let diffuse = body * (1.0 - transmission);
                let through = body * transmission * (DVec3::ONE - f);
                if width > MIRROR_WIDTH {
                    Self { diffuse: diffuse + f0 * metallic, through, ..plain }
                } else {
                    Self { diffuse: diffuse * (DVec3::ONE - f), mirror: f, through, ..plain }
                }
            }
        }
    }
}

/// Direction `dir` (not unit) refracted at a plane with unit normal `normal`, on the side `dir` comes from, with the
/// same length; `None` with total reflection.
pub fn refract(dir: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let length = dir.length();
    let unit = dir / length;
    let cos = -unit.dot(normal);
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    (sin2 < 1.0).then(|| (unit / eta + normal * (cos / eta - (1.0 - sin2).sqrt())) * length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Snell's law at 30 degrees into glass of 1.5: sin 30 / 1.5 = 1 / 3.
    #[test]
    fn refraction_obeys_snell() {
        let dir = DVec3::new(0.5, -(0.75f64.sqrt()), 0.0) * 3.0;
        let bent = refract(dir, DVec3::Y, 1.5).unwrap();
        assert!((bent.length() - 3.0).abs() < 1e-12 && (bent.x / 3.0 - 1.0 / 3.0).abs() < 1e-12 && bent.y < 0.0);
        assert!((refract(bent, DVec3::Y, 1.0 / 1.5).unwrap() - dir).length() < 1e-12);
        assert_eq!(refract(DVec3::new(0.9, -0.1, 0.0), DVec3::Y, 1.0 / 1.5), None, "total reflection");
        assert!((refract(dir, DVec3::Y, 1.0).unwrap() - dir).length() < 1e-12);
    }
}
