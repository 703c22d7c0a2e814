//! Materials as recursive ray tracing sees them: a diffuse colour, a mirror and a refraction, all without spread.

use glam::DVec3;

use super::look::{Look, Looks, Model};
use super::path::fresnel;
use crate::lanes::space::{choose, scale};
use crate::lanes::{Lanes, Lanes3, dot, each};
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
        let unit = dir.normalize_or_zero();
        // Mirrors and glass turn rays at the shading normal, except where it is seen from behind.
        let (own, shading) = (surface.ng.dot(unit), looks.bumped(surface.material, surface).dot(unit));
        let cos = if own * shading > 0.0 { shading } else { own }.abs().min(1.0);
        let emission = looks.emission(surface.material, surface, from_front);
        Self { emission, base: look.base, ..Self::scattered(&look, cos) }
    }

    /// How `look` scatters light that it meets at cosine `cos`.
    fn scattered(look: &Look, cos: f64) -> Self {
        let Terms { diffuse, mirror, through, eta } = Terms::of(look.model, look.base.to_array(), &look.param, cos);
        let [diffuse, mirror, through] = [diffuse, mirror, through].map(DVec3::from);
        Self { diffuse, mirror, through, eta, ..Self::default() }
    }
}

/// What points scatter: see the fields of [`Classic`].
#[derive(Clone, Copy, Debug)]
pub struct Terms<V> {
    pub diffuse: Lanes3<V>,
    pub mirror: Lanes3<V>,
    pub through: Lanes3<V>,
    pub eta: V,
}

impl<V: Lanes> Terms<V> {
    /// Those of `model` with base colour `base` and parameters `param`, for light that is met at cosine `cos`.
    #[inline(always)]
    pub fn of(model: Model, base: Lanes3<V>, param: &[V; 7], cos: V) -> Self {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let plain = Self { diffuse: [zero; 3], mirror: [zero; 3], through: [zero; 3], eta: one };
        let p = param;
        match model {
            Model::Matte => Self { diffuse: base, mirror: [p[0], p[1], p[2]], ..plain },
            Model::SmoothConductor | Model::RoughConductor => {
                Self { mirror: each(|c| fresnel::conductor(cos, p[c], p[c + 3])), ..plain }
            }
            Model::SmoothDielectric | Model::RoughDielectric => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                Self { mirror: [f; 3], through: scale(base, one - f), eta: p[0], ..plain }
            }
            Model::Thin => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                let f = (f + f) / (one + f);
                Self { mirror: [f; 3], through: scale(base, one - f), ..plain }
            }
            Model::SmoothCoat | Model::RoughCoat => {
                let (f, _) = fresnel::dielectric(cos, p[0]);
                let mirror = V::select(V::constant(MIRROR_WIDTH).cmp_lt(p[2]), zero, f);
                Self { diffuse: scale(base, one - f), mirror: [mirror; 3], ..plain }
            }
            Model::MetalRough => {
                let [metallic, width, f0, transmission] = [p[0], p[1], p[2], p[3]];
                let is_rough = V::constant(MIRROR_WIDTH).cmp_lt(width);
                let body = scale(base, one - metallic);
                let f0 = each(|c| base[c] * metallic + f0 * (one - metallic));
                let f = fresnel::schlick(cos, f0);
                let diffuse = scale(body, one - transmission);
                let spread = each(|c| f0[c].mul_add(metallic, diffuse[c]));
                Self {
                    diffuse: choose(is_rough, spread, each(|c| diffuse[c] * (one - f[c]))),
                    mirror: choose(is_rough, [zero; 3], f),
                    through: each(|c| body[c] * transmission * (one - f[c])),
                    ..plain
                }
            }
        }
    }
}

/// Directions `dir` (not unit) refracted at planes with unit normals `normal`, on the side `dir` comes from, with the same
/// length, and the lanes without total reflection.
#[inline(always)]
pub fn refracted<V: Lanes>(dir: Lanes3<V>, normal: Lanes3<V>, eta: V) -> (Lanes3<V>, V::Mask) {
    let one = V::constant(1.0);
    let length = dot(dir, dir).sqrt();
    let unit = scale(dir, one / length);
    let cos = -dot(unit, normal);
    let sin2 = (one - cos * cos) / (eta * eta);
    let along = cos / eta - (one - sin2).fast_max(V::constant(0.0)).sqrt();
    (each(|i| (unit[i] / eta + normal[i] * along) * length), sin2.cmp_lt(one))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refract(dir: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
        let (bent, goes_on) = refracted(dir.to_array(), normal.to_array(), eta);
        goes_on.then(|| DVec3::from(bent))
    }

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
