//! Solids under affine maps: ellipsoids, normals, scales, parity.

use glam::{DAffine3, DMat3, DVec3};
use proptest::prelude::*;

use super::super::{Cone, Cuboid, Cylinder, Placed, Solid, Sphere};
use super::random::lines;
use super::{Convex, Piece, Random, Ray, Widths, deepest, exact, judge};
use crate::math::normal_to_world;

/// A map as `f32` holds it, so that both precisions have the same one.
fn exact_map(m: &DAffine3) -> DAffine3 {
    m.as_affine3().as_daffine3()
}

fn random_map(r: &mut Random) -> DAffine3 {
    let mut column = |axis: DVec3| (axis + r.cube() * 0.4) * (0.4 + r.unit());
    let matrix3 = DMat3::from_cols(column(DVec3::X), column(DVec3::NEG_Y), column(DVec3::Z));
    exact_map(&DAffine3 { matrix3, translation: r.cube() * 3.0 })
}

fn traced<S: Widths, K: Solid>(map: &DAffine3, param: f64, rays: &[Ray]) -> Vec<Piece> {
    S::solid::<K>(&Placed::record::<S, K>(map, param).expect("invertible"), rays)
}

#[test]
fn a_scaled_sphere_is_the_ellipsoid() {
    let (radii, centre) = (DVec3::new(2.0, 0.5, 1.25), DVec3::new(1.0, -2.0, 0.5));
    let map = DAffine3 { matrix3: DMat3::from_diagonal(radii), translation: centre };
    let rays: Vec<Ray> = lines(10_000, 3).into_iter().map(|(o, d)| exact((o * radii + centre, d * radii))).collect();
    for (pieces, tol) in
        [(traced::<f32, Sphere>(&map, 0.0, &rays), 4e-5), (traced::<f64, Sphere>(&map, 0.0, &rays), 1e-13)]
    {
        let mut hits = 0;
        for ((o, d), piece) in rays.iter().zip(&pieces) {
            // sum ((o + t d - c) / r)^2 = 1, in world numbers.
            let sum = |x: DVec3, y: DVec3| (0..3).map(|i| x[i] * y[i] / (radii[i] * radii[i])).sum::<f64>();
            let (a, b, c) = (sum(*d, *d), sum(*d, *o - centre), sum(*o - centre, *o - centre) - 1.0);
            let disc = b * b - a * c;
            if disc > 0.01 * a {
                let [entry, exit] = piece.span.expect("the discriminant is positive");
                for (got, want) in [(entry.0, (-b - disc.sqrt()) / a), (exit.0, (-b + disc.sqrt()) / a)] {
                    assert!((got - want).abs() * a.sqrt() < 10.0 * tol, "{got} {want}");
                }
                hits += 1;
            } else if disc < -0.01 * a {
                assert_eq!(piece.span, None);
            }
        }
        assert!(hits > 2000);
    }
}

/// The outward normal is the direction in which the depth of the *mapped* solid grows.
fn normals_of<K: Convex>(param: f64, r: &mut Random) {
    for _ in 0..40 {
        let map = random_map(r);
        let to_local = map.inverse();
        let rays: Vec<Ray> = lines(50, r.bits())
            .into_iter()
            .map(|(o, d)| exact((map.transform_point3(o), map.transform_vector3(d))))
            .collect();
        for (ray, piece) in rays.iter().zip(traced::<f64, K>(&map, param, &rays)) {
            for (t, face) in piece.span.into_iter().flatten() {
                let p = ray.0 + ray.1 * t;
                let depth = |q: DVec3| K::faces(to_local.transform_point3(q), param)[face as usize];
                let h = 1e-6;
                let slope = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| depth(p + e * h) - depth(p - e * h));
                let want = DVec3::from_array(slope).normalize();
                let local = to_local.transform_point3(p);
                // The side of a pointed cone has no normal at its apex.
                if local.truncate().length() > 0.01 || face != 0 {
                    let got = normal_to_world(&map, K::normal(local, face, param));
                    assert!((got - want).length() < 1e-4, "face {face}: {got} {want}");
                }
            }
        }
    }
}

#[test]
fn normals_are_outward_and_perpendicular_under_shear() {
    let mut r = Random(5);
    normals_of::<Sphere>(0.0, &mut r);
    normals_of::<Cuboid>(0.0, &mut r);
    normals_of::<Cylinder>(0.0, &mut r);
    normals_of::<Cone>(0.0, &mut r);
    normals_of::<Cone>(0.6, &mut r);
}

/// Object and ray scaled together: the same `t`. The direction alone scaled: `t` divided by the same number.
fn scales<S: Widths, K: Convex>(param: f64, tol: f64) {
    let mut r = Random(6);
    let (map, param) = (random_map(&mut r), f64::from(param as f32));
    let to_local = map.inverse();
    let rays: Vec<Ray> = lines(4000, 9)
        .into_iter()
        .map(|(o, d)| exact((map.transform_point3(o), map.transform_vector3(d))))
        .filter(|(o, d)| {
            let local = (to_local.transform_point3(*o), to_local.transform_vector3(*d));
            // Away from tangency, where roundings are not magnified.
            deepest::<K>(local, param).1.abs() > 0.1
        })
        .collect();
    let base = traced::<S, K>(&map, param, &rays);
    let compare = |k_space: f64, k_dir: f64, exactly: bool| {
        let scaled: Vec<Ray> = rays.iter().map(|(o, d)| (*o * k_space, *d * k_space * k_dir)).collect();
        let map = DAffine3::from_scale(DVec3::splat(k_space)) * map;
        for ((ray, want), got) in rays.iter().zip(&base).zip(traced::<S, K>(&map, param, &scaled)) {
            let pairs = got.span.iter().flatten().zip(want.span.iter().flatten());
            assert_eq!(got.span.is_some(), want.span.is_some());
            for ((t, face), (want, want_face)) in pairs {
                let off = (t * k_dir - want).abs() * ray.1.length();
                assert!(if exactly { off == 0.0 } else { off <= tol }, "{t} {want} {k_space} {k_dir}");
                // At an edge of the solid a rounding may choose the other face.
                assert!(face == want_face || !exactly);
            }
            if exactly {
                assert_eq!(got.nearest.map(|(t, face)| (t * k_dir, face)), want.nearest);
            }
        }
    };
    for k in [1.0 / 1024.0, 1024.0] {
        compare(k, 1.0, true);
        compare(1.0, k, true);
    }
    for k in [1e-3, 1e3] {
        compare(k, 1.0, false);
        compare(1.0, k, false);
    }
}

#[test]
fn t_follows_the_scale() {
    fn all<S: Widths>(tol: f64) {
        scales::<S, Sphere>(0.0, tol);
        scales::<S, Cuboid>(0.0, tol);
        scales::<S, Cylinder>(0.0, tol);
        scales::<S, Cone>(0.25, tol);
    }
    all::<f32>(2e-4);
    all::<f64>(4e-13);
}

#[test]
fn singular_and_overflowing_maps_are_refused() {
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    assert!(Placed::record::<f64, Sphere>(&flat, 0.0).is_none());
    let tiny = DAffine3::from_scale(DVec3::splat(1e-45));
    assert!(Placed::record::<f32, Sphere>(&tiny, 0.0).is_none(), "1e45 is no f32");
    let nan = DAffine3::from_translation(DVec3::new(f64::NAN, 0.0, 0.0));
    assert!(Placed::record::<f64, Sphere>(&nan, 0.0).is_none());
}

fn parity<S: Widths, K: Convex>(map: &DAffine3, param: f64, world: &[Ray], tol: f64) {
    let (to_local, param) = (map.inverse(), f64::from(param as f32));
    for (ray, piece) in world.iter().zip(traced::<S, K>(map, param, world)) {
        let local = (to_local.transform_point3(ray.0), to_local.transform_vector3(ray.1));
        judge::<K>(local, param, &piece, tol);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Inside between the two boundaries, outside beyond them, whatever the map.
    #[test]
    fn parity_under_any_map(
        m in prop::array::uniform9(-2.0f64..2.0),
        at in prop::array::uniform3(-5.0f64..5.0),
        o in prop::array::uniform3(-8.0f64..8.0),
        local_targets in prop::collection::vec(prop::array::uniform3(-1.3f64..1.3), 5),
        top in 0.0f64..0.99,
    ) {
        let map = exact_map(&DAffine3 { matrix3: DMat3::from_cols_array(&m), translation: DVec3::from_array(at) });
        let size = |m: DMat3| m.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        // How much the way to the local space magnifies a rounding in the world.
        let magnifies = size(map.matrix3.inverse());
        prop_assume!(magnifies < 50.0);
        let o = DVec3::from_array(o);
        let rays: Vec<Ray> = local_targets
            .into_iter()
            .map(|p| exact((o, map.transform_point3(DVec3::from_array(p)) - o)))
            .collect();
        let tol = (1.0 + magnifies) * 20.0 * 16.0;
        let (single, double) = (tol * f64::from(f32::EPSILON), tol * f64::EPSILON);
        parity::<f32, Sphere>(&map, 0.0, &rays, single);
        parity::<f64, Sphere>(&map, 0.0, &rays, double);
        parity::<f32, Cuboid>(&map, 0.0, &rays, single);
        parity::<f64, Cuboid>(&map, 0.0, &rays, double);
        parity::<f32, Cylinder>(&map, 0.0, &rays, single);
        parity::<f64, Cylinder>(&map, 0.0, &rays, double);
        parity::<f32, Cone>(&map, top, &rays, single);
        parity::<f64, Cone>(&map, top, &rays, double);
    }
}

/// Plates 10^-5 as thick as wide, seen from 100 widths: 10^7 local units, where an ulp is the shape's own size. The
/// rays go through (x, y, 0) in the middle of the plate; its top is at most 10^-5 away from there.
#[test]
fn flat_shapes_are_met_from_far_away() {
    fn met<S: Widths, K: Solid>(param: f64, tol: f64) {
        let map = exact_map(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 1e-5)));
        let mut r = Random(11);
        let mut ray = || {
            let (target, lean) = (r.cube() * 0.3, r.cube() * 0.3);
            let (x, y) = (target.x as f32, target.y as f32);
            let to = DVec3::new(f64::from(x), f64::from(y), 0.0);
            let org = (to + DVec3::new(lean.x, lean.y, 1.0) * 100.0).as_vec3().as_dvec3();
            (org, (to - org).as_vec3().as_dvec3())
        };
        let rays: Vec<Ray> = (0..1000).map(|_| ray()).collect();
        for (i, piece) in traced::<S, K>(&map, param, &rays).iter().enumerate() {
            let (t, _) = piece.nearest.unwrap_or_else(|| panic!("ray {i} of {:?}: {piece:?}", rays[i]));
            assert!((t - 1.0).abs() < tol, "ray {i}: {t}");
        }
    }
    met::<f32, Sphere>(0.0, 1e-6);
    met::<f32, Cylinder>(0.0, 1e-6);
    met::<f32, Cone>(0.4, 1e-6);
    met::<f64, Sphere>(0.0, 2e-7);
    met::<f64, Cylinder>(0.0, 2e-7);
    met::<f64, Cone>(0.4, 2e-7);
}
