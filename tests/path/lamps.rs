//! Lamps near points that they shine at, against formulas: far from the origin, from inside, and with holes.

use crate::path_support;

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::camera::Camera;
use lanecast::scene::description::{Description, Material, Shape};
use lanecast::scene::material::Alpha;
use lanecast::shade::Shades;
use path_support::{add, dark, lamp, look, parallel, parallelogram, paths, picture, shape, sphere, values};

/// Diffuse reflectance of receivers.
const RHO: f64 = 0.5;
/// Radiance of lamps.
const L: f64 = 3.0;
const SIZE: u32 = 8;

/// Checks that what `camera` sees in `d`, by paths of one scattering, is `want` within four standard errors and the
/// share `tolerance`.
#[track_caller]
fn shows<S: Shades>(what: &str, d: &Description, camera: &Camera, want: f64, tolerance: f64) {
    let film = picture::<S>(d, camera, &paths(SIZE, 256, 1)).film;
    let all = values(&film, "R");
    let count = all.len() as f64;
    let mean = all.iter().map(|&x| f64::from(x)).sum::<f64>() / count;
    let spread = all.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (spread / count).sqrt();
    assert!(error < 0.02 * want, "{what}: too much noise to tell: {mean} with a standard error of {error}");
    let off = (mean - want).abs();
    assert!(off < 4.0 * error + tolerance * want, "{what}: got {mean} with a standard error of {error}, want {want}");
}

/// A matte plane z = 0, what `build` makes, and a camera that sees the origin only, all under `map`.
fn receiver(map: &DAffine3, build: impl Fn(&mut Description)) -> (Description, Camera) {
    let mut d = dark();
    let matte = add(&mut d, Material { diffuse: DVec3::splat(RHO), ..Material::default() });
    shape(&mut d, Shape::HalfSpace, DAffine3::IDENTITY, matte);
    build(&mut d);
    d.groups[0].items.iter_mut().for_each(|item| item.transform = *map * item.transform);
    (d, parallel(map.transform_point3(DVec3::new(0.0, -0.2, 0.05)), map.translation, 2e-4))
}

/// Places in which coordinates are large against the distance of a lamp, in f32 up to where those still have digits.
const FAR: [f64; 4] = [0.0, 50.0, 100.0, 1000.0];
const FAR_F32: [f64; 3] = [0.0, 50.0, 100.0];

/// The same light wherever the scene is: what `build` makes shines at the origin with the form factor `factor`. Turned, since
/// coordinates that are the same all over a flat lamp are not rounded away.
#[track_caller]
fn everywhere(what: &str, factor: f64, build: impl Fn(&mut Description)) {
    let want = RHO * L * factor;
    let turn = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 0.5).normalize(), 0.7);
    let scene = |offset: f64| receiver(&DAffine3::from_rotation_translation(turn, DVec3::splat(offset)), &build);
    for offset in FAR {
        let (d, camera) = scene(offset);
        shows::<f64>(&format!("{what} at {offset}, f64"), &d, &camera, want, 1e-3);
    }
    // Where rays start and what they meet is off by some thousandths of the distance.
    for offset in FAR_F32 {
        let (d, camera) = scene(offset);
        shows::<f32>(&format!("{what} at {offset}, f32"), &d, &camera, want, 1e-2);
    }
}

#[test]
fn spheres_far_from_the_origin_lose_no_light() {
    let (radius, height) = (0.03f64, 0.13f64);
    everywhere("a sphere", (radius / height).powi(2), |d| {
        let id = add(d, lamp(L));
        sphere(d, DVec3::Z * height, radius, id);
    });
    // What may have holes is aimed at one by one.
    everywhere("a sphere of opacity 1 - 1e-9", (radius / height).powi(2), |d| {
        let id = add(d, Material { alpha: Alpha::Blend, opacity: 1.0 - 1e-9, ..lamp(L) });
        sphere(d, DVec3::Z * height, radius, id);
    });
}

#[test]
fn discs_far_from_the_origin_lose_no_light() {
    let (radius, height) = (0.03f64, 0.13f64);
    let factor = radius * radius / (radius * radius + height * height);
    everywhere("a disc", factor, |d| {
        let id = add(d, lamp(L));
        let map = DMat3::from_diagonal(DVec3::new(radius, radius, -1.0));
        shape(d, Shape::Disc, DAffine3::from_mat3_translation(map, DVec3::Z * height), id);
    });
}

#[test]
fn triangles_far_from_the_origin_lose_no_light() {
    // Of four squares that have a corner above the point, face on.
    let (half, height) = (0.03f64, 0.13f64);
    let root = (half * half + height * height).sqrt();
    let factor = 4.0 * (half / root) * (half / root).atan() / PI;
    everywhere("a square", factor, |d| {
        let id = add(d, lamp(L));
        let corner = DVec3::new(-half, -half, height);
        parallelogram(d, corner, DVec3::X * (2.0 * half), DVec3::Y * (2.0 * half), id);
    });
}

/// Every point of the inside sees nothing but the inside: what it emits, and the share `RHO` of that again.
#[test]
fn a_sphere_lights_itself_from_within() {
    for (centre, radius) in [(DVec3::ZERO, 1.3), (DVec3::new(3.0, -2.0, 5.0), 0.7)] {
        let mut d = dark();
        let id = add(&mut d, Material { diffuse: DVec3::splat(RHO), ..lamp(1.0) });
        sphere(&mut d, centre, radius, id);
        let eye = centre + DVec3::new(0.1, 0.2, 0.0) * radius;
        let camera = look(eye, eye + DVec3::new(0.9, 0.3, 0.2), 0.8);
        shows::<f32>("f32", &d, &camera, 1.0 + RHO, 1e-3);
        shows::<f64>("f64", &d, &camera, 1.0 + RHO, 1e-3);
    }
}

/// A lamp with holes shows its near side and, through that, the inside of its far side, as large.
#[test]
fn spheres_with_holes_shine_with_both_sides() {
    let (centre, radius, z) = (DVec3::new(1.0, 0.0, 2.0), 1.5, 2.0 / f64::sqrt(5.0));
    for opacity in [0.3, 0.5, 0.8] {
        let (d, camera) = receiver(&DAffine3::IDENTITY, |d| {
            let id = add(d, Material { alpha: Alpha::Blend, opacity, ..lamp(L) });
            sphere(d, centre, radius, id);
        });
        let seen = 1.0 - (1.0 - opacity) * (1.0 - opacity);
        let want = RHO * L * seen * radius * radius / centre.length_squared() * z;
        shows::<f32>(&format!("opacity {opacity}"), &d, &camera, want, 1e-2);
    }
}
