//! Random lines, canonical place: many of them parallel to axes, in the planes of caps, starting inside.

use glam::DVec3;

use super::super::{Cone, Cuboid, Cylinder, Sphere};
use super::{Convex, Random, Ray, Widths, canonical, exact, judge};

pub(super) fn lines(n: usize, seed: u64) -> Vec<Ray> {
    let mut r = Random(seed);
    let unit = [DVec3::X, DVec3::Y, DVec3::Z];
    let line = |i: usize| {
        let target = r.cube() * 1.2;
        let mut o = r.cube() * if i.is_multiple_of(3) { 0.9 } else { 5.0 };
        let mut d = target - o;
        match i % 11 {
            // Parallel to an axis, either way, also starting on the planes of faces and caps.
            0 | 1 => d = unit[i / 11 % 3] * if i.is_multiple_of(2) { 1.0 } else { -0.5 },
            2 => (o.z, d.z) = ((i / 11 % 3) as f64 * 0.5, 0.0),
            3 => d.x = 0.0,
            // Nearly parallel.
            4 => d = unit[i / 11 % 3] + r.cube() * 1e-6,
            5 => o = (o * 2.0).round() * 0.5,
            6 => d *= 1e-3,
            7 => d *= 1e3,
            // Towards the axis, the apex, the rims.
            8 => d = DVec3::new(0.0, 0.0, target.z) - o,
            9 => d = DVec3::Z - o,
            _ => {}
        }
        exact((o, d))
    };
    (0..n).map(line).collect()
}

fn check<K: Convex>(param: f64) {
    let rays = lines(20_000, 7);
    let param = f64::from(param as f32);
    // Origins are at most 9 away; a few roundings of that distance, in the solid's space.
    for (pieces, tol) in [
        (f32::solid::<K>(&canonical::<f32, K>(param), &rays), 2e-5),
        (f64::solid::<K>(&canonical::<f64, K>(param), &rays), 4e-14),
    ] {
        let deep = rays.iter().zip(&pieces).filter(|(ray, piece)| judge::<K>(**ray, param, piece, tol)).count();
        assert!(deep > 4000, "only {deep} lines pass inside");
    }
}

#[test]
fn sphere() {
    check::<Sphere>(0.0);
}

#[test]
fn cuboid() {
    check::<Cuboid>(0.0);
}

#[test]
fn cylinder() {
    check::<Cylinder>(0.0);
}

#[test]
fn cone() {
    for top in [0.0, 0.3, 0.75, 0.999] {
        check::<Cone>(top);
    }
}

/// The quadratic of a sphere with centre and radius, solved in f64.
#[test]
fn world_sphere() {
    let (centre, radius) = (DVec3::new(1.5, -0.25, 2.0), 0.75);
    let rays: Vec<Ray> = lines(20_000, 8).into_iter().map(|(o, d)| exact((o * 0.75 + centre, d))).collect();
    let numbers = [centre.x, centre.y, centre.z, radius];
    for (pieces, tol) in [(f32::sphere(&numbers.map(|x| x as f32), &rays), 2e-5), (f64::sphere(&numbers, &rays), 4e-14)]
    {
        let mut hits = 0;
        for ((o, d), piece) in rays.iter().zip(&pieces) {
            let local = ((*o - centre) / radius, *d / radius);
            hits += usize::from(judge::<Sphere>(local, 0.0, piece, tol));
            let (a, b, c) = (d.length_squared(), d.dot(*o - centre), (*o - centre).length_squared() - radius * radius);
            let disc = b * b - a * c;
            if disc > 0.01 * a {
                let [entry, exit] = piece.span.expect("the discriminant is positive");
                for (got, want) in [(entry.0, (-b - disc.sqrt()) / a), (exit.0, (-b + disc.sqrt()) / a)] {
                    assert!((got - want).abs() * a.sqrt() < 10.0 * tol, "{got} {want}");
                }
            }
        }
        assert!(hits > 4000);
    }
}
