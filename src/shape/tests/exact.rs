//! Lines whose roots a person can work out.

use glam::DVec3;

use super::super::{Cone, Cuboid, Cylinder, Disc, HalfSpace, Placed, Solid, Span, Sphere, quadric};
use super::{Piece, Random, Ray, Widths, canonical};
use crate::ray::Packet;

fn line(o: [f64; 3], d: [f64; 3]) -> Ray {
    (DVec3::from_array(o), DVec3::from_array(d))
}

/// One line against a canonical solid, in both precisions at all widths.
fn pieces<K: Solid>(ray: Ray, param: f64) -> [(Piece, f64); 2] {
    let single = f32::solid::<K>(&canonical::<f32, K>(param), &[ray])[0];
    let double = f64::solid::<K>(&canonical::<f64, K>(param), &[ray])[0];
    [(single, f64::from(f32::EPSILON)), (double, f64::EPSILON)]
}

/// The span must be `want`, within 16 ulps of the largest number that goes in.
fn spans<K: Solid>(param: f64, ray: Ray, want: [(f64, u32); 2]) {
    let speed = ray.1.length();
    for (piece, epsilon) in pieces::<K>(ray, param) {
        let got = piece.span.unwrap_or_else(|| panic!("{ray:?} missed, expected {want:?}"));
        let size = 1.0 + ray.0.length();
        for (got, want) in got.into_iter().zip(want) {
            assert!((got.0 - want.0).abs() * speed <= 16.0 * epsilon * size, "{ray:?}: {got:?}, expected {want:?}");
            assert_eq!(got.1, want.1, "face of {ray:?}");
        }
        let first = want.into_iter().find(|(t, _)| *t >= 0.0);
        match (piece.nearest, first) {
            (Some(near), Some(first)) => {
                assert!((near.0 - first.0).abs() * speed <= 32.0 * epsilon * size, "{ray:?}: {near:?} {first:?}");
                assert_eq!(near.1, first.1);
            }
            (None, None) => {}
            other => panic!("{ray:?}: {other:?}"),
        }
    }
}

fn misses<K: Solid>(param: f64, ray: Ray) {
    for (piece, _) in pieces::<K>(ray, param) {
        assert_eq!(piece, Piece { span: None, nearest: None }, "{ray:?}");
    }
}

/// A tangent line: an empty span or none, never one boundary without the other.
fn grazes<K: Solid>(param: f64, ray: Ray) {
    for (piece, epsilon) in pieces::<K>(ray, param) {
        if let Some([entry, exit]) = piece.span {
            // A depth of some ulps is a chord of their square root.
            let chord = (exit.0 - entry.0) * ray.1.length();
            assert!((0.0..8.0 * epsilon.sqrt()).contains(&chord), "{ray:?}: {piece:?}");
        }
    }
}

#[test]
fn sphere() {
    spans::<Sphere>(0.0, line([0.0, 0.0, -3.0], [0.0, 0.0, 1.0]), [(2.0, 0), (4.0, 0)]);
    // At 0.6 from the axis half the chord is 0.8.
    spans::<Sphere>(0.0, line([0.6, 0.0, -3.0], [0.0, 0.0, 2.0]), [(1.1, 0), (1.9, 0)]);
    spans::<Sphere>(0.0, line([0.0, 0.8, 3.0], [0.0, 0.0, -0.5]), [(4.8, 0), (7.2, 0)]);
    // From inside, and with the sphere behind.
    spans::<Sphere>(0.0, line([0.0, 0.6, 0.5], [1.0, 0.0, 0.0]), [(-(0.39f64.sqrt()), 0), (0.39f64.sqrt(), 0)]);
    spans::<Sphere>(0.0, line([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]), [(-4.0, 0), (-2.0, 0)]);
    misses::<Sphere>(0.0, line([1.01, 0.0, -3.0], [0.0, 0.0, 1.0]));
    grazes::<Sphere>(0.0, line([1.0, 0.0, -3.0], [0.0, 0.0, 1.0]));
    grazes::<Sphere>(0.0, line([0.0, -5.0, 1.0], [0.0, 1.0, 0.0]));
}

#[test]
fn cuboid() {
    // Every face as entry and as exit.
    for axis in 0..3 {
        for (sign, enter, leave) in [(1.0, 0, 1), (-1.0, 1, 0)] {
            let (mut o, mut d) = ([0.25, -0.5, 0.125], [0.0; 3]);
            (o[axis], d[axis]) = (-3.0 * sign, sign);
            spans::<Cuboid>(0.0, line(o, d), [(2.0, 2 * axis as u32 + enter), (4.0, 2 * axis as u32 + leave)]);
        }
    }
    // Enters x = -1 at t = 1, leaves y = 1 at t = 2.
    spans::<Cuboid>(0.0, line([-2.0, -1.0, 0.0], [1.0, 1.0, 0.25]), [(1.0, 0), (2.0, 3)]);
    spans::<Cuboid>(0.0, line([0.0, 0.0, 0.0], [0.0, 0.0, -0.5]), [(-2.0, 5), (2.0, 4)]);
    misses::<Cuboid>(0.0, line([-3.0, 0.0, 1.5], [1.0, 0.0, 0.0]));
    misses::<Cuboid>(0.0, line([-3.0, 0.0, 0.0], [1.0, 1.0, 0.0]));
    // Along an edge's tangent, touching it in one point.
    grazes::<Cuboid>(0.0, line([-2.0, 0.0, 0.0], [1.0, 1.0, 0.0]));
}

#[test]
fn cylinder() {
    spans::<Cylinder>(0.0, line([-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), [(2.0, 0), (4.0, 0)]);
    spans::<Cylinder>(0.0, line([-3.0, 0.6, 0.5], [2.0, 0.0, 0.0]), [(1.1, 0), (1.9, 0)]);
    spans::<Cylinder>(0.0, line([0.5, 0.5, -2.0], [0.0, 0.0, 1.0]), [(2.0, 1), (3.0, 2)]);
    spans::<Cylinder>(0.0, line([0.5, 0.5, 2.0], [0.0, 0.0, -1.0]), [(1.0, 2), (2.0, 1)]);
    // In through the base, out through the side.
    spans::<Cylinder>(0.0, line([0.0, 0.0, -0.75], [1.0, 0.0, 1.5]), [(0.5, 1), (1.0, 0)]);
    spans::<Cylinder>(0.0, line([0.0, 0.0, 0.5], [0.0, 1.0, 0.0]), [(-1.0, 0), (1.0, 0)]);
    // Parallel to the axis outside, parallel to the caps above.
    misses::<Cylinder>(0.0, line([0.8, 0.8, -2.0], [0.0, 0.0, 1.0]));
    misses::<Cylinder>(0.0, line([-3.0, 0.0, 1.25], [1.0, 0.0, 0.0]));
    misses::<Cylinder>(0.0, line([-3.0, 0.0, -0.25], [1.0, 0.0, 0.0]));
    grazes::<Cylinder>(0.0, line([-3.0, 1.0, 0.5], [1.0, 0.0, 0.0]));
    // Crosses the rim of the base only.
    grazes::<Cylinder>(0.0, line([-2.0, 0.0, 1.0], [1.0, 0.0, -1.0]));
}

#[test]
fn cone() {
    // At half height the radius is 0.5 (pointed) or 0.75.
    spans::<Cone>(0.0, line([-2.0, 0.0, 0.5], [1.0, 0.0, 0.0]), [(1.5, 0), (2.5, 0)]);
    spans::<Cone>(0.5, line([-2.0, 0.0, 0.5], [1.0, 0.0, 0.0]), [(1.25, 0), (2.75, 0)]);
    // Parallel to the axis: through both caps, or out through the side.
    spans::<Cone>(0.5, line([0.25, 0.25, -1.0], [0.0, 0.0, 1.0]), [(1.0, 1), (2.0, 2)]);
    spans::<Cone>(0.0, line([0.5, 0.0, -1.0], [0.0, 0.0, 1.0]), [(1.0, 1), (1.5, 0)]);
    spans::<Cone>(0.0, line([0.5, 0.0, 3.0], [0.0, 0.0, -1.0]), [(2.5, 0), (3.0, 1)]);
    // Parallel to a generator (the quadratic term vanishes).
    spans::<Cone>(0.0, line([1.5, 0.0, -1.0], [-1.0, 0.0, 1.0]), [(1.0, 1), (1.75, 0)]);
    spans::<Cone>(0.0, line([-1.5, 0.0, 2.0], [1.0, 0.0, -1.0]), [(1.25, 0), (2.0, 1)]);
    // Above the apex is the other nappe, which is no part of the solid.
    misses::<Cone>(0.0, line([-2.0, 0.0, 1.5], [1.0, 0.0, 0.0]));
    misses::<Cone>(0.0, line([-2.0, 0.75, 0.5], [1.0, 0.0, 0.0]));
    misses::<Cone>(0.5, line([1.2, 0.0, 1.5], [0.0, 0.1, 1.0]));
    grazes::<Cone>(0.0, line([-2.0, 0.0, 1.0], [1.0, 0.0, 0.0]));
    grazes::<Cone>(0.0, line([-2.0, 0.5, 0.5], [1.0, 0.0, 0.0]));
}

/// Lines through `tip`, all numbers exact in f32; the parameter there is 1. None is nearly along the cone of slope 1, where
/// the far root is uncertain.
fn lines_through(tip: DVec3) -> impl Iterator<Item = Ray> {
    let mut r = Random(7);
    let mut number = move || (r.unit() * 128.0).floor() / 16.0 - 4.0;
    let origins = std::iter::repeat_with(move || DVec3::new(number(), number(), number()));
    let lines = origins.map(move |o| (o, tip - o));
    lines.filter(|(_, d)| (d.x.hypot(d.y) - d.z.abs()).abs() > 0.1 * d.length()).take(4000)
}

#[test]
fn lines_through_the_tip_of_a_cone_meet_it_there() {
    let mut steep = 0;
    for ray in lines_through(DVec3::Z) {
        for (piece, epsilon) in pieces::<Cone>(ray, 0.0) {
            let (d, tolerance) = (ray.1, 16.0 * epsilon * (1.0 + ray.0.length()) / ray.1.length());
            let (across, along) = (d.x.hypot(d.y), d.z.abs());
            let at_tip = |t: f64| (t - 1.0).abs() <= tolerance;
            match piece.span {
                Some([entry, exit]) if along > across => {
                    steep += 1;
                    let (tip, base) = if d.z < 0.0 { (entry, exit) } else { (exit, entry) };
                    assert!(at_tip(tip.0) && base.1 == 1 && !at_tip(base.0), "{ray:?}: {piece:?}");
                }
                None => assert!(along <= across, "{ray:?} missed"),
                Some([entry, exit]) => assert!(at_tip(entry.0) && at_tip(exit.0), "{ray:?}: {piece:?}"),
            }
        }
    }
    assert!(steep > 2000, "{steep}");
}

#[test]
fn lines_across_a_sharp_end_meet_it_there() {
    // x^2 + y^2 <= 1 - z and y^2 <= 1 - z have a tip and an edge at z = 1, where lines in that plane meet them.
    for (o, d) in lines_through(DVec3::Z).map(|(o, d)| (o.with_z(1.0), d.with_z(0.0))).filter(|(_, d)| d.y != 0.0) {
        let tolerance = 16.0 * f64::EPSILON * (1.0 + o.length()) / d.length();
        let mut check = |span: Span<f64>| {
            let at_end = |t: f64| (t - 1.0).abs() <= tolerance;
            assert!(!span.hit || (at_end(span.t_in) && at_end(span.t_out)), "{o} {d}: {span:?}");
        };
        quadric::trough::<f64>(o.to_array(), d.to_array(), [1.0, -1.0, 0.0], &mut check);
        quadric::round::<f64>(o.to_array(), d.to_array(), [1.0, -1.0, 0.0], &mut check);
        // A little below: a strip of half the width 1/32, a disc of that radius.
        let below = o.with_z(1.0 - 1.0 / 1024.0).to_array();
        let crossed = |half: f64, span: Span<f64>| {
            assert!(span.hit && (span.t_in - (1.0 - half)).abs() <= tolerance, "{o} {d}: {span:?}");
            assert!((span.t_out - (1.0 + half)).abs() <= tolerance, "{o} {d}: {span:?}");
        };
        let strip = 1.0 / 32.0 / d.y.abs();
        let within = (d.x * strip).abs() < 0.75;
        quadric::trough::<f64>(below, d.to_array(), [1.0, -1.0, 0.0], |span| {
            if within {
                crossed(strip, span);
            }
        });
        quadric::round::<f64>(below, d.to_array(), [1.0, -1.0, 0.0], |span| crossed(1.0 / 32.0 / d.length(), span));
    }
}

#[test]
fn disc() {
    spans::<Disc>(0.0, line([0.5, 0.5, 2.0], [0.0, 0.0, -4.0]), [(0.5, 0), (0.5, 0)]);
    spans::<Disc>(0.0, line([-1.0, 0.0, -1.0], [1.0, 0.25, 1.0]), [(1.0, 0), (1.0, 0)]);
    spans::<Disc>(0.0, line([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), [(-1.0, 0), (-1.0, 0)]);
    misses::<Disc>(0.0, line([0.8, 0.8, 2.0], [0.0, 0.0, -1.0]));
    misses::<Disc>(0.0, line([-2.0, 0.0, 0.5], [1.0, 0.0, 0.0]));
    // In its own plane.
    misses::<Disc>(0.0, line([-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
}

#[test]
fn half_space() {
    const FAR: f64 = f64::INFINITY;
    let check = |ray: Ray, span: Option<[f64; 2]>, nearest: Option<f64>| {
        for (piece, _) in pieces::<HalfSpace>(ray, 0.0) {
            assert_eq!(piece.span.map(|s| s.map(|(t, face)| (t, face))), span.map(|s| s.map(|t| (t, 0))), "{ray:?}");
            assert_eq!(piece.nearest, nearest.map(|t| (t, 0)), "{ray:?}");
        }
    };
    check(line([1.0, 2.0, 3.0], [0.0, 0.0, -2.0]), Some([1.5, FAR]), Some(1.5));
    check(line([1.0, 2.0, -3.0], [0.0, 1.0, 2.0]), Some([-FAR, 1.5]), Some(1.5));
    check(line([1.0, 2.0, 3.0], [0.0, 0.0, 2.0]), Some([-FAR, -1.5]), None);
    check(line([1.0, 2.0, -3.0], [0.0, 0.0, -2.0]), Some([-1.5, FAR]), None);
    // Level: inside for ever, or never; no boundary is met.
    check(line([1.0, 2.0, -3.0], [1.0, 1.0, 0.0]), Some([-FAR, FAR]), None);
    check(line([1.0, 2.0, 3.0], [1.0, 0.0, 0.0]), None, None);
    check(line([1.0, 2.0, -3.0], [0.0, 1.0, -0.0]), Some([-FAR, FAR]), None);
}

/// A segment without a beginning: the boundary is still where the line leaves, not at minus infinity.
#[test]
fn half_space_from_minus_infinity() {
    let record = canonical::<f64, HalfSpace>(0.0);
    for (direction, want) in [(1.0, Some(3.0)), (-1.0, Some(-3.0)), (0.0, None)] {
        let packet = Packet::new([0.0, 0.0, -3.0], [1.0, 0.0, direction], f64::NEG_INFINITY);
        let span = Placed::span::<f64, HalfSpace>(&packet, &record);
        let found = span.nearest(&packet, &Placed::bounds(&record));
        assert_eq!(found.hit.then_some(found.t), want);
    }
}
