//! What the points of a packet aim at: triangles and spheres of even radiance and an even sky in lanes, other lights one
//! by one.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use super::Paths;
use super::bsdf::warp::disc;
use super::emitter::CLOSE;
use super::form::{BALL, FLAT, Kind};
use super::scatter::Column;
use crate::lanes::chosen::{at, lanes_of, records, spill};
use crate::lanes::space::{Frame, choose, scale, sub};
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each};
use crate::shade::offset::end_error;

/// What a packet aims at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Targets<V: Lanes> {
    /// The place, so far off its surface that rays to there do not meet it, or far away the direction to it.
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
    /// Something that shines for each of the first `count` points of a packet at `from`: which by the bits `choice`, where on
    /// it by the numbers `u`.
    #[inline(always)]
    pub(super) fn targets(
        &self,
        from: Lanes3<S::Wide>,
        count: usize,
        u: &[Column<S>; 2],
        choice: &[u32; MAX_LANES],
    ) -> Targets<S::Wide> {
        let all = (1 << count.min(MAX_LANES)) - 1;
        let (mut which, mut kinds, mut chance) = ([0; MAX_LANES], [0; MAX_LANES], [S::ONE; MAX_LANES]);
        // Nothing branches on what is chosen: it is a surprise every time.
        for lane in 0..count.min(MAX_LANES) {
            let Some((index, kind, its)) = self.lights.choose(choice[lane]) else { break };
            (which[lane], kinds[lane], chance[lane]) = (index as u32, kind as u32, its);
        }
        let of_kind = |kind: Kind| positions(&kinds, kind as u32) & all;
        let (flats, balls, skies) = (of_kind(Kind::Triangle), of_kind(Kind::Ball), of_kind(Kind::Sky));
        let place = [S::Wide::load(&u[0]), S::Wide::load(&u[1])];
        let form = |index: u32| self.lights.form(index as usize);
        let (no_triangle, no_ball, no_sky) = ([S::ZERO; FLAT], [S::ZERO; BALL], [S::ZERO; 3]);
        let mut targets = Targets::none(S::Wide::load(&chance));
        let mut others = of_kind(Kind::Other);
        if flats != 0 {
            let numbers = records(flats, &which, |index| form(index).triangle().unwrap_or(&no_triangle));
            targets = on_triangles(from, &numbers, place, Mask::<S>::from_bits(flats), &targets);
        }
        if balls != 0 {
            let numbers = records(balls, &which, |index| form(index).ball().unwrap_or(&no_ball));
            let outside = is_outside(from, &numbers).bits();
            others |= balls & !outside;
            targets = on_balls(from, &numbers, place, Mask::<S>::from_bits(balls & outside), &targets);
        }
        if skies != 0 {
            let numbers = records(skies, &which, |index| form(index).sky().unwrap_or(&no_sky));
            targets = in_the_sky(numbers, place, Mask::<S>::from_bits(skies), &targets);
        }
        if others != 0 { self.one_by_one(from, &which, u, others, &targets) } else { targets }
    }

    /// The same for the lanes `lanes`, whose lights are `which`, and `targets` elsewhere.
    #[inline(never)]
    fn one_by_one(
        &self,
        from: Lanes3<S::Wide>,
        which: &[u32; MAX_LANES],
        u: &[Column<S>; 2],
        lanes: u32,
        targets: &Targets<S::Wide>,
    ) -> Targets<S::Wide> {
        let zero = [S::ZERO; MAX_LANES];
        let (mut dir, mut radiance, mut place) = ([zero; 3], [zero; 3], [zero; 3]);
        // Without light the density is 1 and the radiance 0.
        let (mut pdf, mut near, mut points) = ([S::ONE; MAX_LANES], zero, 0);
        let position = spill(from);
        for lane in lanes_of(lanes) {
            let from = DVec3::from(at(&position, lane).map(S::to_f64));
            let (index, two) = (which[lane] as usize, [u[0][lane].to_f64(), u[1][lane].to_f64()]);
            let Some(aim) = self.lights.aim(from, index, two, self.world, &self.looks) else { continue };
            for axis in 0..3 {
                dir[axis][lane] = S::from_f64(aim.dir[axis]);
                radiance[axis][lane] = S::from_f64(aim.radiance[axis]);
                place[axis][lane] = S::from_f64(aim.target[axis]);
            }
            pdf[lane] = S::from_f64(aim.pdf);
            near[lane] = if aim.is_far { S::ZERO } else { S::ONE };
            points |= u32::from(aim.is_point) << lane;
        }
        let mask = Mask::<S>::from_bits(lanes);
        let load = |columns: &[Column<S>; 3]| each(|axis| S::Wide::load(&columns[axis]));
        Targets {
            place: choose(mask, load(&place), targets.place),
            near: S::Wide::select(mask, S::Wide::load(&near), targets.near),
            dir: choose(mask, load(&dir), targets.dir),
            pdf: S::Wide::select(mask, S::Wide::load(&pdf), targets.pdf),
            radiance: choose(mask, load(&radiance), targets.radiance),
            is_point: Mask::<S>::from_bits(points),
        }
    }
}

impl<V: Lanes> Targets<V> {
    /// No light, with a density.
    #[inline(always)]
    fn none(pdf: V) -> Self {
        let zero = V::constant(0.0);
        let nothing = [zero; 3];
        Self { place: nothing, near: zero, dir: nothing, pdf, radiance: nothing, is_point: zero.cmp_lt(zero) }
    }
}

/// Whether points are outside of spheres, and not too close to them: others are aimed at one by one.
#[inline(always)]
fn is_outside<V: Lanes>(from: Lanes3<V>, ball: &[V; BALL]) -> V::Mask {
    let away = sub([ball[0], ball[1], ball[2]], from);
    (V::constant(CLOSE) * (ball[3] * ball[3])).cmp_lt(dot(away, away))
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
    let front = cosine.cmp_lt(zero);
    let radiance = choose(front, vector(4), vector(5));
    let error = end_error::<V::Scalar, V>(from, place, normal, flat[19]);
    let off = V::select(front, error, -error);
    let place = each(|i| normal[i].mul_add(off, place[i]));
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
    let [x, y, z, radius, red, green, blue, chosen] = *ball;
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
    let normal = scale(sub(place, [x, y, z]), one / radius);
    let off = end_error::<V::Scalar, V>(from, place, normal, chosen);
    let place = each(|i| normal[i].mul_add(off, place[i]));
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
        let ball = [1.0, 2.0, 3.0, 0.5, 7.0, 8.0, 9.0, 1e-15].map(f64x8::splat);
        let sphere = Emitter::Sphere { centre, radius, magnitude: 5.0, material: 0, ids: [0; 2] };
        let (lanes, at) = (LaneMask::from_bits(0xff), from.to_array().map(f64x8::splat));
        let mut mean = DVec3::ZERO;
        many(
            |u| on_balls(at, &ball, u, lanes, &Targets::none(f64x8::splat(0.5))),
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
            |u| in_the_sky([f64x8::splat(1.0); 3], u, lanes, &Targets::none(f64x8::splat(0.5))),
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
