//! What the points of a packet aim at: triangles and spheres of even radiance and an even sky in lanes, other lights one
//! by one.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use super::Paths;
use super::bsdf::warp::disc;
use super::form::{BALL, FLAT, Form};
use super::scatter::Column;
use crate::lanes::chosen::{at, records, spill};
use crate::lanes::space::{Frame, choose, scale, sub};
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each};

/// Spheres closer than this, in squares of radii from the centre, are aimed at one by one.
const CLOSE: f64 = 1.02;

/// What a packet aims at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Targets<V: Lanes> {
    /// The place, or far away the direction to it.
    pub place: Lanes3<V>,
    /// 1 for a place, 0 for a direction.
    pub near: V,
    /// Unit direction.
    pub dir: Lanes3<V>,
    /// Density per solid angle; of a point the chance of the light.
    pub pdf: V,
    /// Radiance from there; of a point irradiance.
    pub radiance: Lanes3<V>,
    /// Lights without extent.
    pub is_point: V::Mask,
}

/// Masks of packets.
type Mask<S> = <<S as Real>::Wide as Lanes>::Mask;

impl<S: Real> Paths<'_, S> {
    /// Something that shines for each of the first `count` points of a packet at `from`, by the numbers `u`: two for the
    /// place, one for the choice.
    #[inline(always)]
    pub(super) fn targets(&self, from: Lanes3<S::Wide>, count: usize, u: &[Column<S>; 3]) -> Targets<S::Wide> {
        let zero = [S::ZERO; MAX_LANES];
        let (mut dir, mut radiance, mut target) = ([zero; 3], [zero; 3], [zero; 3]);
        // Without light the density is 1 and the radiance 0.
        let (mut pdf, mut near, mut points) = ([S::ONE; MAX_LANES], zero, 0);
        let (mut which, [mut flats, mut balls, mut skies]) = ([0; MAX_LANES], [0u32; 3]);
        let position = spill(from);
        for lane in 0..count.min(MAX_LANES) {
            let Some((index, chance)) = self.lights.choose(u[2][lane].to_f64()) else { continue };
            (which[lane], pdf[lane]) = (index as u32, S::from_f64(chance));
            match self.lights.form(index) {
                Form::Triangle(_) => flats |= 1 << lane,
                Form::Ball(ball) if is_outside(ball, at(&position, lane)) => balls |= 1 << lane,
                Form::Sky(_) => skies |= 1 << lane,
                Form::Ball(_) | Form::Other => {
                    let from = DVec3::from(at(&position, lane).map(S::to_f64));
                    let place = [u[0][lane].to_f64(), u[1][lane].to_f64()];
                    pdf[lane] = S::ONE;
                    let Some(aim) = self.lights.aim(from, (index, chance), place, self.world, &self.looks) else {
                        continue;
                    };
                    for axis in 0..3 {
                        dir[axis][lane] = S::from_f64(aim.dir[axis]);
                        radiance[axis][lane] = S::from_f64(aim.radiance[axis]);
                        target[axis][lane] = S::from_f64(aim.target[axis]);
                    }
                    pdf[lane] = S::from_f64(aim.pdf);
                    near[lane] = if aim.is_far { S::ZERO } else { S::ONE };
                    points |= u32::from(aim.is_point) << lane;
                }
            }
        }
        let load = |columns: &[Column<S>; 3]| each(|axis| S::Wide::load(&columns[axis]));
        let mut targets = Targets {
            place: load(&target),
            near: S::Wide::load(&near),
            dir: load(&dir),
            pdf: S::Wide::load(&pdf),
            radiance: load(&radiance),
            is_point: Mask::<S>::from_bits(points),
        };
        let u = [S::Wide::load(&u[0]), S::Wide::load(&u[1])];
        let form = |index: u32| self.lights.form(index as usize);
        let (no_triangle, no_ball, no_sky) = ([S::ZERO; FLAT], [S::ZERO; BALL], [S::ZERO; 3]);
        if flats != 0 {
            let numbers = records(flats, &which, |index| form(index).triangle().unwrap_or(&no_triangle));
            targets = on_triangles(from, &numbers, u, Mask::<S>::from_bits(flats), &targets);
        }
        if balls != 0 {
            let numbers = records(balls, &which, |index| form(index).ball().unwrap_or(&no_ball));
            targets = on_balls(from, &numbers, u, Mask::<S>::from_bits(balls), &targets);
        }
        if skies != 0 {
            let numbers = records(skies, &which, |index| form(index).sky().unwrap_or(&no_sky));
            targets = in_the_sky(numbers, u, Mask::<S>::from_bits(skies), &targets);
        }
        targets
    }
}

fn is_outside<S: Real>(ball: &[S; BALL], from: [S; 3]) -> bool {
    let away: [f64; 3] = each(|axis| ball[axis].to_f64() - from[axis].to_f64());
    dot(away, away) > CLOSE * ball[3].to_f64().powi(2)
}

/// Uniform points of emitting triangles in the lanes `lanes`, whose chance is the density in `others`.
/// Source of the map: E. Heitz, *A Low-Distortion Map Between Triangle and Square*, 2019.
#[inline(always)]
fn on_triangles<V: Lanes>(
    from: Lanes3<V>,
    flat: &[V; FLAT],
    [u, v]: [V; 2],
    lanes: V::Mask,
    others: &Targets<V>,
) -> Targets<V> {
    let (zero, one, half) = (V::constant(0.0), V::constant(1.0), V::constant(0.5));
    let vector = |k: usize| [flat[3 * k], flat[3 * k + 1], flat[3 * k + 2]];
    let upper = u.cmp_lt(v);
    let b = V::select(upper, half * u, u - half * v);
    let c = V::select(upper, v - half * u, half * v);
    let (corner, e1, e2, normal) = (vector(0), vector(1), vector(2), vector(3));
    let place: Lanes3<V> = each(|i| c.mul_add(e2[i], b.mul_add(e1[i], corner[i])));
    let away = sub(place, from);
    let square = dot(away, away);
    let dir = scale(away, one / square.sqrt());
    let cosine = dot(dir, normal);
    let radiance = choose(cosine.cmp_lt(zero), vector(4), vector(5));
    let pdf = others.pdf * square / (cosine.abs() * flat[18]);
    // Seen edge on, or from where it is, it gives nothing.
    let seen = lanes & pdf.cmp_lt(V::splat(V::Scalar::INFINITY)) & zero.cmp_lt(pdf);
    Targets {
        place: choose(lanes, place, others.place),
        near: V::select(lanes, one, others.near),
        dir: choose(seen, dir, others.dir),
        pdf: V::select(seen, pdf, others.pdf),
        radiance: choose(seen, radiance, others.radiance),
        is_point: others.is_point,
    }
}

/// Directions, uniform in the cones under which points outside of them see the emitting spheres `ball` (centre, radius,
/// radiance) in the lanes `lanes`, whose chance is the density in `others`.
#[inline(always)]
fn on_balls<V: Lanes>(from: Lanes3<V>, ball: &[V; BALL], u: [V; 2], lanes: V::Mask, others: &Targets<V>) -> Targets<V> {
    let (zero, one, two) = (V::constant(0.0), V::constant(1.0), V::constant(2.0));
    let [x, y, z, radius, red, green, blue] = *ball;
    let away = sub([x, y, z], from);
    let square = dot(away, away);
    let sine = radius * radius / square;
    // 1 - cosine of half the angle of the cone, and of the angle from its axis, both without cancellation.
    let height = sine / (one + (one - sine).fast_max(zero).sqrt());
    let [a, b] = disc(u);
    let below = a.mul_add(a, b * b) * height;
    let aside = (height * (two - below)).sqrt();
    let dir = Frame::new(scale(away, one / square.sqrt())).to_world([a * aside, b * aside, one - below]);
    // The nearer intersection, rather a little before it: at the rim the root is lost to rounding.
    let passed = square * below * (two - below);
    let rounding = V::constant(8.0 * V::Scalar::EPSILON.to_f64()) * square;
    let half = (radius.mul_add(radius, rounding) - passed).fast_max(zero).sqrt();
    let way = dot(dir, away) - half;
    let place: Lanes3<V> = each(|i| dir[i].mul_add(way, from[i]));
    let pdf = others.pdf / (V::constant(TAU) * height);
    Targets {
        place: choose(lanes, place, others.place),
        near: V::select(lanes, one, others.near),
        dir: choose(lanes, dir, others.dir),
        pdf: V::select(lanes, pdf, others.pdf),
        radiance: choose(lanes, [red, green, blue], others.radiance),
        is_point: others.is_point,
    }
}

/// Uniform directions to a sky of even radiance in the lanes `lanes`, whose chance is the density in `others`.
#[inline(always)]
fn in_the_sky<V: Lanes>(radiance: Lanes3<V>, u: [V; 2], lanes: V::Mask, others: &Targets<V>) -> Targets<V> {
    let (zero, one, two) = (V::constant(0.0), V::constant(1.0), V::constant(2.0));
    let [a, b] = disc(u);
    let square = a.mul_add(a, b * b);
    let aside = two * (one - square).fast_max(zero).sqrt();
    let dir = [a * aside, one - two * square, b * aside];
    Targets {
        place: choose(lanes, dir, others.place),
        near: V::select(lanes, zero, others.near),
        dir: choose(lanes, dir, others.dir),
        pdf: V::select(lanes, others.pdf * V::constant(0.25 * FRAC_1_PI), others.pdf),
        radiance: choose(lanes, radiance, others.radiance),
        is_point: others.is_point,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::sobol::PixelPoints;
    use crate::lanes::f64x8;
    use crate::shade::path::emitter::Emitter;

    fn nothing() -> Targets<f64x8> {
        let zero = f64x8::splat(0.0);
        let (dir, is_point) = ([zero; 3], zero.cmp_lt(zero));
        Targets { place: dir, near: zero, dir, pdf: f64x8::splat(0.5), radiance: dir, is_point }
    }

    /// Calls `found` with each of many targets that `aim` finds from two numbers.
    fn many(aim: impl Fn([f64x8; 2]) -> Targets<f64x8>, mut found: impl FnMut(DVec3, DVec3, f64, f64)) {
        let points = PixelPoints::new(3, 1, 4);
        for first in (0..4096).step_by(8) {
            let u: [[f64; 2]; 8] = std::array::from_fn(|lane| points.point(first + lane as u32, 0));
            let targets = aim([0, 1].map(|k| f64x8::new(u.map(|u| u[k]))));
            for lane in 0..8 {
                let vector = |v: [f64x8; 3]| DVec3::from(v.map(|x| x.lane(lane)));
                found(vector(targets.place), vector(targets.dir), targets.pdf.lane(lane), targets.near.lane(lane));
            }
        }
    }

    #[test]
    fn spheres_are_seen_as_one_by_one() {
        let (centre, radius, from) = (DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(-1.0, 0.5, 4.0));
        let ball = [1.0, 2.0, 3.0, 0.5, 7.0, 8.0, 9.0].map(f64x8::splat);
        let sphere = Emitter::Sphere { centre, radius, material: 0, ids: [0; 2] };
        let (lanes, at) = (LaneMask::from_bits(0xff), from.to_array().map(f64x8::splat));
        let mut mean = DVec3::ZERO;
        many(
            |u| on_balls(at, &ball, u, lanes, &nothing()),
            |place, dir, pdf, near| {
                assert!(((place - centre).length() - radius).abs() < 1e-6 && near == 1.0);
                let normal = (place - centre) / radius;
                assert!(normal.dot(dir) < 1e-6 && ((place - from).normalize() - dir).length() < 1e-9);
                assert!((0.5 * sphere.pdf(from, place, normal) / pdf - 1.0).abs() < 1e-9);
                mean += dir / 4096.0;
            },
        );
        // The mean of a cone: its axis, times the mean of the cosine.
        let axis = (centre - from).normalize();
        let cosine = 0.5 * (1.0 + (1.0 - radius * radius / (centre - from).length_squared()).sqrt());
        assert!((mean - axis * cosine).length() < 1e-4, "{mean} {axis}");
    }

    #[test]
    fn the_sky_is_even() {
        let (mut mean, mut squares, lanes) = (DVec3::ZERO, DVec3::ZERO, LaneMask::from_bits(0xff));
        many(
            |u| in_the_sky([f64x8::splat(1.0); 3], u, lanes, &nothing()),
            |place, dir, pdf, near| {
                assert!(place == dir && near == 0.0 && (dir.length() - 1.0).abs() < 1e-12);
                assert!((pdf - 0.5 / (2.0 * TAU)).abs() < 1e-12);
                mean += dir / 4096.0;
                squares += dir * dir / 4096.0;
            },
        );
        assert!(mean.length() < 1e-3 && (squares - 1.0 / 3.0).length() < 1e-3, "{mean} {squares}");
    }
}
