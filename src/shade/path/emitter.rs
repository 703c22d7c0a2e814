//! One thing that shines, and how a path aims at it.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3};

use super::lights::in_cone;
use crate::lanes::Real;
use crate::scene::description::Light;
use crate::scene::world::World;
use crate::shade::lights::Spot;
use crate::shade::look::Looks;
use crate::shade::offset::{chosen_error, end_error};

/// Spheres closer than this, in squares of radii from the centre, are aimed at by their area, as from within. Whoever asks
/// for the density does so from where a ray starts, a little beside the point that aimed, and a point of the sphere may be
/// rounded to either side: all must agree about which it was.
pub(super) const CLOSE: f64 = 1.02;

/// Something that shines.
#[derive(Clone, Copy, Debug)]
pub enum Emitter {
    /// A light without a surface.
    Light(Light),
    /// An emitting triangle, world space.
    Triangle {
        /// First corner.
        corner: DVec3,
        /// To the second and the third.
        edges: [DVec3; 2],
        /// Unit normal as wound.
        normal: DVec3,
        /// Area.
        area: f64,
        /// Length of its [`crate::scene::world::Surface::magnitude`].
        magnitude: f64,
        /// Material number.
        material: u32,
        /// Primitive and instance.
        ids: [u32; 2],
    },
    /// An emitting disc or ellipse.
    Disc {
        /// Centre.
        centre: DVec3,
        /// To two ends of conjugate half diameters.
        axes: [DVec3; 2],
        /// Unit normal.
        normal: DVec3,
        /// Area.
        area: f64,
        /// See [`Self::Triangle`].
        magnitude: f64,
        /// Material number.
        material: u32,
        /// Primitive and instance.
        ids: [u32; 2],
    },
    /// An emitting sphere.
    Sphere {
        /// Centre.
        centre: DVec3,
        /// Radius.
        radius: f64,
        /// See [`Self::Triangle`].
        magnitude: f64,
        /// Material number.
        material: u32,
        /// Primitive and instance.
        ids: [u32; 2],
    },
    /// An emitting surface that paths find only by chance.
    Unaimed,
}

/// Light that can arrive at a point.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// Where the light is, or, far away, the direction to it. Not quite on a surface, but so far off it that rays to
    /// there do not meet it.
    pub target: DVec3,
    /// Whether it is infinitely far.
    pub is_far: bool,
    /// Unit direction to it.
    pub dir: DVec3,
    /// Density per solid angle; of a point, the chance of the light.
    pub pdf: f64,
    /// Radiance from there; of a point, irradiance on a surface that faces it.
    pub radiance: DVec3,
    /// Whether the light has no extent: nothing else ever finds it.
    pub is_point: bool,
}

impl Emitter {
    /// The image of a triangle with `corners`; its `magnitude`: see [`Self::Triangle`].
    pub fn triangle(to_world: &DAffine3, corners: [DVec3; 3], magnitude: f64, material: u32, ids: [u32; 2]) -> Self {
        let [a, b, c] = corners.map(|p| to_world.transform_point3(p));
        // A mirroring map leaves the front where it was wound, as [`World::surface`] does.
        let cross = (b - a).cross(c - a) * to_world.matrix3.determinant().signum();
        let (normal, area) = (cross.normalize_or_zero(), 0.5 * cross.length());
        Self::Triangle { corner: a, edges: [b - a, c - a], normal, area, magnitude, material, ids }
    }

    /// The image of the unit disc.
    pub fn disc(to_world: &DAffine3, magnitude: f64, material: u32, ids: [u32; 2]) -> Self {
        let axes = [to_world.matrix3.x_axis, to_world.matrix3.y_axis];
        let cross = axes[0].cross(axes[1]);
        let mirrored = to_world.matrix3.determinant().signum();
        let normal = cross.normalize_or_zero() * mirrored;
        let (centre, area) = (to_world.translation, PI * cross.length());
        Self::Disc { centre, axes, normal, area, magnitude, material, ids }
    }

    /// The image of the unit sphere, if that is a sphere.
    pub fn sphere(to_world: &DAffine3, magnitude: f64, material: u32, ids: [u32; 2]) -> Self {
        let m = to_world.matrix3;
        let radius = m.x_axis.length();
        let alike = |x: f64| (x - radius).abs() <= 1e-9 * radius;
        let right = |x: f64| x.abs() <= 1e-9 * radius * radius;
        let is_round = alike(m.y_axis.length()) && alike(m.z_axis.length());
        let is_right = right(m.x_axis.dot(m.y_axis)) && right(m.y_axis.dot(m.z_axis)) && right(m.z_axis.dot(m.x_axis));
        if is_round && is_right && radius > 0.0 {
            Self::Sphere { centre: to_world.translation, radius, magnitude, material, ids }
        } else {
            Self::Unaimed
        }
    }

    /// Whether its light comes from infinitely far.
    pub fn is_far(&self) -> bool {
        matches!(self, Self::Light(Light::Directional { .. } | Light::Sun { .. }))
    }

    /// Power, roughly: what chances go by. `radius`: of the scene, scene units.
    pub fn power(&self, radius: f64, looks: &Looks<'_>) -> f64 {
        let mean = |c: DVec3| c.element_sum() / 3.0;
        let surface = |area: f64, material: u32| {
            mean(looks.plain_emission(material, true) + looks.plain_emission(material, false)) * area * PI
        };
        match *self {
            Self::Light(Light::Point { intensity, .. }) => mean(intensity) * 4.0 * PI,
            Self::Light(Light::Spot { intensity, inner, outer, .. }) => {
                mean(intensity) * TAU * 0.5 * (height(inner) + height(outer))
            }
            Self::Light(Light::Directional { irradiance, .. } | Light::Sun { irradiance, .. }) => {
                mean(irradiance) * PI * radius * radius
            }
            Self::Triangle { area, material, .. } | Self::Disc { area, material, .. } => surface(area, material),
            // Only its outside shines into the scene.
            Self::Sphere { radius, material, .. } => {
                mean(looks.plain_emission(material, true)) * 4.0 * PI * PI * radius * radius
            }
            Self::Unaimed => 0.0,
        }
    }

    /// Aims from `from`; the density is this emitter's alone.
    pub fn aim<S: Real>(&self, from: DVec3, place: [f64; 2], world: &World<S>, looks: &Looks<'_>) -> Option<Aim> {
        match *self {
            Self::Light(light) => aim_at_light(&light, from, place),
            Self::Triangle { corner, edges, normal, area, magnitude, material, ids } => {
                let [b, c] = on_triangle(place);
                let target = corner + edges[0] * b + edges[1] * c;
                let (mut aim, facing) = planar(from, target, normal, area)?;
                let front = normal.dot(aim.dir) < 0.0;
                aim.radiance = radiance(looks, world, material, (target, [b, c]), front, ids);
                Some(aim.off_surface::<S>(from, facing, magnitude))
            }
            Self::Disc { centre, axes, normal, area, magnitude, material, ids } => {
                let radius = place[0].sqrt();
                let (sin, cos) = (TAU * place[1]).sin_cos();
                let target = centre + axes[0] * (radius * cos) + axes[1] * (radius * sin);
                let (mut aim, facing) = planar(from, target, normal, area)?;
                let front = normal.dot(aim.dir) < 0.0;
                aim.radiance = radiance(looks, world, material, (target, [0.0; 2]), front, ids);
                Some(aim.off_surface::<S>(from, facing, magnitude))
            }
            Self::Sphere { centre, radius, magnitude, material, ids } => {
                let (mut aim, facing) = aim_at_sphere(from, centre, radius, place)?;
                let front = (aim.target - centre).dot(aim.dir) < 0.0;
                aim.radiance = radiance(looks, world, material, (aim.target, [0.0; 2]), front, ids);
                Some(aim.off_surface::<S>(from, facing, magnitude))
            }
            Self::Unaimed => None,
        }
    }

    /// Radiance of a sun in direction `dir` (unit) and the density of [`Self::aim`] there.
    pub fn sun(&self, dir: DVec3) -> Option<(DVec3, f64)> {
        let Self::Light(Light::Sun { direction, irradiance, radius }) = *self else { return None };
        let height = height(radius);
        let inside = 1.0 + dir.dot(direction.normalize_or_zero()) <= height;
        inside.then(|| (sun_radiance(irradiance, radius), 1.0 / (TAU * height)))
    }

    /// Density of [`Self::aim`] from `from` per solid angle at `to`, where the unit normal is `ng`.
    pub fn pdf(&self, from: DVec3, to: DVec3, ng: DVec3) -> f64 {
        match *self {
            Self::Triangle { area, .. } | Self::Disc { area, .. } => {
                let away = to - from;
                let square = away.length_squared();
                let cosine = (away.dot(ng) / square.sqrt()).abs();
                if cosine > 0.0 && area > 0.0 { square / (cosine * area) } else { 0.0 }
            }
            Self::Sphere { centre, radius, .. } => match cap((centre - from).length_squared(), radius) {
                // Only the near side is aimed at; through its holes the far one is seen, too.
                Some(_) if (to - from).dot(to - centre) > 0.0 => 0.0,
                Some(height) => 1.0 / (TAU * height),
                None => {
                    let away = to - from;
                    let square = away.length_squared();
                    let cosine = (away.dot(ng) / square.sqrt()).abs();
                    if cosine > 0.0 { square / (cosine * 4.0 * PI * radius * radius) } else { 0.0 }
                }
            },
            Self::Light(_) | Self::Unaimed => 0.0,
        }
    }
}

impl Aim {
    /// The same with the target off the surface it is on, whose unit normal on the side of `from` is `facing`.
    fn off_surface<S: Real>(self, from: DVec3, facing: DVec3, magnitude: f64) -> Self {
        let chosen = chosen_error::<S>(magnitude);
        let off = end_error::<S, f64>(from.to_array(), self.target.to_array(), facing.to_array(), chosen);
        Self { target: self.target + facing * off, ..self }
    }
}

/// What `material` emits at a place (with the weights of a triangle's corners) of primitive and instance `ids`.
fn radiance<S: Real>(
    looks: &Looks<'_>,
    world: &World<S>,
    material: u32,
    (target, [b, c]): (DVec3, [f64; 2]),
    front: bool,
    ids: [u32; 2],
) -> DVec3 {
    if !looks.has_pictured_emission(material) && !looks.is_holed(material) {
        return looks.plain_emission(material, front);
    }
    let surface = world.surface(target, DVec3::ZERO, 0.0, b, c, ids[0], ids[1]);
    looks.emission(material, &surface, front) * looks.opacity(material, &surface)
}

/// Aim at `target` on a flat surface of `area`, without radiance, and the normal on the side of `from`.
fn planar(from: DVec3, target: DVec3, normal: DVec3, area: f64) -> Option<(Aim, DVec3)> {
    let away = target - from;
    let square = away.length_squared();
    let dir = away.try_normalize()?;
    let along = dir.dot(normal);
    let facing = if along < 0.0 { normal } else { -normal };
    (along != 0.0 && area > 0.0).then(|| {
        let pdf = square / (along.abs() * area);
        (Aim { target, is_far: false, dir, pdf, radiance: DVec3::ZERO, is_point: false }, facing)
    })
}

/// Weights of the second and third corner of a uniform point.
/// Source: E. Heitz, *A Low-Distortion Map Between Triangle and Square*, 2019.
fn on_triangle([u, v]: [f64; 2]) -> [f64; 2] {
    if v > u { [0.5 * u, v - 0.5 * u] } else { [u - 0.5 * v, 0.5 * v] }
}

/// `1 - cos` of half the angle under which a sphere is seen from a distance whose square is `square`; `None` inside and
/// closer than [`CLOSE`].
fn cap(square: f64, radius: f64) -> Option<f64> {
    let sin2 = radius * radius / square;
    // (1 - cos) without cancellation for small angles.
    (CLOSE * (radius * radius) < square).then(|| sin2 / (1.0 + (1.0 - sin2).sqrt()))
}

/// Aim at a sphere, without radiance, and its normal there on the side of `from`.
fn aim_at_sphere(from: DVec3, centre: DVec3, radius: f64, place: [f64; 2]) -> Option<(Aim, DVec3)> {
    let to_centre = centre - from;
    let square = to_centre.length_squared();
    if let Some(height) = cap(square, radius) {
        let dir = in_cone(to_centre.normalize(), height, place);
        // The nearer intersection; at the rim the root may be lost to rounding.
        let middle = dir.dot(to_centre);
        let half = (radius * radius - (square - middle * middle)).max(0.0).sqrt();
        let target = from + dir * (middle - half);
        let pdf = 1.0 / (TAU * height);
        let aim = Aim { target, is_far: false, dir, pdf, radiance: DVec3::ZERO, is_point: false };
        return Some((aim, (target - centre) / radius));
    }
    let normal = in_cone(DVec3::Z, 2.0, place);
    planar(from, centre + normal * radius, normal, 4.0 * PI * radius * radius)
}

fn aim_at_light(light: &Light, from: DVec3, place: [f64; 2]) -> Option<Aim> {
    let far = |dir: DVec3, pdf: f64, radiance: DVec3, is_point: bool| {
        Some(Aim { target: dir, is_far: true, dir, pdf, radiance, is_point })
    };
    match *light {
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            let away = position - from;
            let dir = away.try_normalize()?;
            let share = match *light {
                Light::Spot { direction, inner, outer, .. } => Spot::new(direction, inner, outer).share(dir.to_array()),
                _ => 1.0,
            };
            let radiance = intensity * (share / away.length_squared());
            radiance.is_finite().then_some(Aim {
                target: position,
                is_far: false,
                dir,
                pdf: 1.0,
                radiance,
                is_point: true,
            })
        }
        Light::Directional { direction, irradiance } => far(-direction.try_normalize()?, 1.0, irradiance, true),
        Light::Sun { direction, irradiance, radius } => {
            let height = height(radius);
            let dir = in_cone(-direction.try_normalize()?, height, place);
            far(dir, 1.0 / (TAU * height), sun_radiance(irradiance, radius), false)
        }
    }
}

/// `1 - cos` of an angle, to all digits also where it is small: the height of the cap of a unit sphere within it.
fn height(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin().powi(2)
}

/// Irradiance of a disc of radiance L, face on, is L pi sin^2 of its radius.
fn sun_radiance(irradiance: DVec3, radius: f64) -> DVec3 {
    irradiance / (PI * radius.sin().powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::sampling::PixelRandom;

    #[test]
    fn spheres_are_seen_under_their_solid_angle() {
        let (centre, radius, from) = (DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(-1.0, 0.0, 4.0));
        let random = PixelRandom::new(0, 0, 0);
        for k in 0..1000 {
            let (aim, _) = aim_at_sphere(from, centre, radius, random.spread(k, 0)).unwrap();
            assert!(((aim.target - centre).length() - radius).abs() < 1e-6, "{k}");
            let normal = (aim.target - centre) / radius;
            assert!(normal.dot(aim.dir) < 1e-6);
            let sphere = Emitter::Sphere { centre, radius, magnitude: 5.0, material: 0, ids: [0; 2] };
            assert!((sphere.pdf(from, aim.target, normal) / aim.pdf - 1.0).abs() < 1e-9);
        }
        let sin2 = radius * radius / (centre - from).length_squared();
        let solid_angle = TAU * (1.0 - (1.0 - sin2).sqrt());
        let (aim, _) = aim_at_sphere(from, centre, radius, [0.3, 0.4]).unwrap();
        assert!((aim.pdf * solid_angle - 1.0).abs() < 1e-9);
        let (inside, _) = aim_at_sphere(centre + DVec3::X * 0.1, centre, radius, [0.3, 0.4]).unwrap();
        assert!(((inside.target - centre).length() - radius).abs() < 1e-12 && inside.pdf > 0.0);
    }

    /// A spot of a twentieth of a degree, and one of a millionth part of that.
    #[test]
    fn narrow_spots_are_as_bright_as_they_say() {
        for outer in [0.05f64.to_radians(), 5e-8f64.to_radians()] {
            let (position, direction, intensity) = (DVec3::Z * 4.0, -DVec3::Z, DVec3::splat(50.0));
            let light = Light::Spot { position, direction, intensity, inner: 0.0, outer };
            let seen = |x: f64| aim_at_light(&light, DVec3::X * x, [0.5; 2]).unwrap().radiance.x;
            assert!((seen(0.0) - 50.0 / 16.0).abs() < 1e-9, "{}", seen(0.0));
            // At half the height of the cap, and outside.
            assert!((seen(4.0 * outer * 0.5f64.sqrt()) - 0.25 * 50.0 / 16.0).abs() < 1e-5);
            assert_eq!(seen(4.0 * 1.5 * outer), 0.0);
        }
    }

    #[test]
    fn triangle_points_are_uniform() {
        let random = PixelRandom::new(3, 1, 0);
        let (mut mean, n) = ([0.0; 2], 4096);
        for k in 0..n {
            let [b, c] = on_triangle(random.spread(k, 0));
            assert!(b >= 0.0 && c >= 0.0 && b + c <= 1.0 + 1e-12);
            mean = [mean[0] + b / f64::from(n), mean[1] + c / f64::from(n)];
        }
        assert!(mean.iter().all(|m| (m - 1.0 / 3.0).abs() < 2e-3), "{mean:?}");
    }
}
