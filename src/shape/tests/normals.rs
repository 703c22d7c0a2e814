//! Normals that are no affine functions of the point, against the gradients, by differences, of forms of the surface
//! that the kernels do not use.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Random;
use crate::lanes::{Lanes, f64x4};
use crate::shape::{taper_side_normal, torus_normal};

/// The direction in which `form` grows at `p`.
fn gradient(form: impl Fn(DVec3) -> f64, p: DVec3) -> DVec3 {
    let step = 1e-5;
    DVec3::from(DVec3::AXES.map(|axis| form(p + step * axis) - form(p - step * axis))).normalize()
}

/// Whether `normal` has the direction of `exact`, alone and in lanes.
#[track_caller]
fn agrees(p: DVec3, exact: DVec3, alone: DVec3, wide: [f64x4; 3]) {
    assert!((alone.normalize() - exact).length() < 1e-8, "{p}: {alone} is not along {exact}");
    assert_eq!(wide.map(|x| x.lane(3)), alone.to_array(), "{p}");
}

#[test]
fn of_tori() {
    let mut r = Random(1);
    for _ in 0..2000 {
        let (minor, round, tube) = (0.05 + 0.9 * r.unit(), TAU * r.unit(), TAU * r.unit());
        let from_axis = 1.0 + minor * tube.cos();
        let p = DVec3::new(from_axis * round.cos(), from_axis * round.sin(), minor * tube.sin());
        // The distance from the circle in the middle of the tube.
        let exact = gradient(|p| (p - p.with_z(0.0).normalize()).length(), p);
        agrees(p, exact, torus_normal(p.to_array()).into(), torus_normal(p.to_array().map(Lanes::splat)));
    }
}

#[test]
fn of_tapers() {
    let mut r = Random(2);
    for _ in 0..2000 {
        let (tops, z, round) = ([2.0 * r.unit(), 2.0 * r.unit()], 0.95 * r.unit(), TAU * r.unit());
        let axes = |z: f64| tops.map(|top| 1.0 + (top - 1.0) * z);
        let [a, b] = axes(z);
        let p = DVec3::new(a * round.cos(), b * round.sin(), z);
        // How many times as far from the axis as the ellipse of its height.
        let scale = |p: DVec3| {
            let [a, b] = axes(p.z);
            (p.x / a).hypot(p.y / b)
        };
        let exact = gradient(scale, p);
        let normal = taper_side_normal(p.to_array(), tops);
        agrees(p, exact, normal.into(), taper_side_normal(p.to_array().map(Lanes::splat), tops));
    }
}
