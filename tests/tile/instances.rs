//! Tiles through instances: meshes under rotations, uneven scales, shears, mirrors and far translations, against the
//! scalar engine and the oracle; ties between instances; closed meshes stay closed under every map.

use crate::common;
use crate::tile_support;

use std::sync::Arc;

use common::{Random, ball, item, soup};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::scene::description::{Description, Group, ItemKind};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::Scratch;
use proptest::prelude::*;
use tile_support::{Scene, camera, differences, find, shadows};

/// A world of meshes and their placements: mesh, map.
fn world(meshes: &[Mesh], places: &[(usize, DAffine3)]) -> World<f32> {
    let mut d = Description::new("instances");
    for (i, mesh) in meshes.iter().enumerate() {
        d.meshes.push(Arc::new(mesh.clone()));
        let items = vec![item(ItemKind::Mesh(i as u32), DAffine3::IDENTITY)];
        d.groups.push(Group { name: format!("mesh {i}"), items });
    }
    let instance = |&(mesh, map): &(usize, DAffine3)| item(ItemKind::Instance(mesh as u32 + 1), map);
    d.groups[0].items = places.iter().map(instance).collect();
    World::compile(&d, Preset::Balanced).unwrap()
}

/// Sixty maps of every kind, around `centre`.
fn maps(r: &mut Random, centre: DVec3) -> Vec<DAffine3> {
    let mut maps = Vec::new();
    for i in 0..60 {
        let mut map = match i % 5 {
            0 => DAffine3::from_axis_angle(r.direction(), r.unit() * 6.0),
            1 => DAffine3::from_scale(DVec3::new(0.05 + r.unit(), 0.05 + r.unit(), -0.05 - r.unit())),
            2 => r.affine(0.3),
            3 => {
                let size = 0.01 + 0.05 * r.unit();
                r.affine(size)
            }
            _ => DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.01)) * r.affine(0.5),
        };
        map.translation = centre + r.in_cube() * 6.0;
        maps.push(map);
    }
    maps
}

fn scene(seed: u64, centre: DVec3) -> Scene {
    let mut r = Random(seed);
    let places: Vec<_> = maps(&mut r, centre).into_iter().enumerate().map(|(i, map)| (i % 3, map)).collect();
    Scene::new(world(&[soup(150, &mut r), ball(9, 12), soup(3, &mut r)], &places))
}

#[test]
fn pictures_and_shadows_are_explained() {
    let (mut primaries, mut seconds, mut r) = (0, 0, Random(40));
    for (seed, centre) in [(1, DVec3::ZERO), (2, DVec3::new(100.0, -30.0, 5.0)), (3, DVec3::new(1e4, 2e4, -1e4))] {
        let scene = scene(seed, centre);
        for case in 0..8 {
            let reach = [3.0, 15.0][case % 2];
            let (eye, target) = (centre + r.in_cube() * reach, centre + r.in_cube() * 2.0);
            let primary = camera(eye, target, [0.05, 0.5, 1.0, 30.0][case % 4], 64);
            assert_eq!(differences(&scene, &primary), (0, 0), "seed {seed} case {case}");
            let light = centre + r.in_cube() * reach * 1.5;
            let (end, t_min) = [(1.0, 0.0), (1.0, 1e-4), (7.5, 0.0), (1.0 - 2e-6, 1e-6)][case / 2 % 4];
            let shadow = shadows(&scene, &primary, light, end, t_min);
            assert_eq!(differences(&scene, &shadow), (0, 0), "seed {seed} shadows of case {case}");
            (primaries, seconds) = (primaries + primary.live_count(), seconds + shadow.live_count());
        }
    }
    println!("{primaries} primary rays, {seconds} shadow rays");
    assert!(seconds > 20_000);
}

/// Some answers must come from tiles, not from the kernel they hand rays to.
#[test]
fn tiles_take_instances() {
    let scene = scene(1, DVec3::ZERO);
    let rays = camera(DVec3::new(9.0, 8.0, 7.0), DVec3::ZERO, 0.5, 64);
    let count = |name| {
        let (mut hits, mut counters) = (Hits::default(), Counters::default());
        find(name).intersect(&scene, &rays, &mut hits, &mut Scratch::default(), Some(&mut counters));
        (hits.hit_count(), counters)
    };
    let ((seen, tile), (also, stream)) = (count("tile"), count("stream"));
    assert!(seen > 1000 && seen.abs_diff(also) < 5, "{seen} {also}");
    assert!(tile.prim_lanes_linear > 0 && stream.prim_lanes_linear == 0, "{tile:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// One map of any kind over one mesh, seen from anywhere, and its shadows.
    #[test]
    fn any_map(
        turn in prop::array::uniform3(-3.0f64..3.0),
        scale in prop::array::uniform3(-1.0f64..1.0),
        shear in prop::array::uniform3(-1.5f64..1.5),
        size in -2.0f64..2.0,
        mirrored in any::<bool>(),
        away in prop::array::uniform3(-1.0f64..1.0),
        far in 0.0f64..4.0,
        seed in any::<u64>(),
    ) {
        let mut r = Random(seed);
        let scale = DVec3::from(scale.map(|x| 10f64.powf(x + size))) * if mirrored { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(shear[0], 1.0, 0.0), DVec3::new(shear[1], shear[2], 1.0));
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from(turn)));
        let map = DAffine3 {
            matrix3: turn * shear * DMat3::from_diagonal(scale),
            translation: DVec3::from(away) * 10f64.powf(far),
        };
        let second = DAffine3::from_translation(map.translation) * DAffine3::from_scale(DVec3::splat(10f64.powf(size)));
        let scene = Scene::new(world(&[soup(60, &mut r), ball(8, 10)], &[(0, map), (1, map), (1, second)]));
        let (lo, hi) = scene.bounds().unwrap();
        let at = |f: DVec3| lo + (hi - lo) * (DVec3::splat(0.5) + f);
        let eye = at(r.in_cube() * if seed % 2 == 0 { 0.4 } else { 2.0 });
        let primary = camera(eye, at(r.in_cube() * 0.2), 0.4, 32);
        prop_assert_eq!(differences(&scene, &primary), (0, 0));
        let shadow = shadows(&scene, &primary, at(r.in_cube()), 1.0, 0.0);
        prop_assert_eq!(differences(&scene, &shadow), (0, 0));
    }
}

/// Rays inside closed balls under every map, aimed at vertices, edges and faces: none may pass.
#[test]
fn closed_meshes_stay_closed_under_every_map() {
    let (mesh, mut r, mut traced) = (ball(20, 30), Random(12), 0);
    let (mut hits, mut any, mut scratch) = (Hits::default(), Vec::new(), Scratch::default());
    for centre in [DVec3::ZERO, DVec3::new(50.0, 0.0, -20.0), DVec3::splat(1e4)] {
        for map in maps(&mut r, centre) {
            // Nothing but the one ball: what passes is a miss. In f32 from the eye on, as a renderer would.
            let world = world(std::slice::from_ref(&mesh), &[(0, map)]);
            let (eye, mut rays) = (map.transform_point3(r.in_cube() * 0.2).as_vec3(), Rays::new(1024));
            let toward = map.transform_vector3(r.direction());
            for i in 0..rays.len() {
                // One octant of the ball, so that a frame holds it.
                let face = loop {
                    let face = mesh.corners(r.below(mesh.triangles.len()));
                    if map.transform_vector3(face[0]).normalize().dot(toward.normalize()) > 0.7 {
                        break face;
                    }
                };
                let target = match i % 3 {
                    0 => face[0],
                    1 => face[0].lerp(face[1], r.unit()),
                    _ => (face[0] + face[1] + face[2]) / 3.0,
                };
                let dir = map.transform_point3(target).as_vec3() - eye;
                rays.set(i, eye.to_array(), dir.to_array(), 0.0, f32::INFINITY);
            }
            find("tile").intersect(&world, &rays, &mut hits, &mut scratch, None);
            find("tile").occluded(&world, &rays, &mut any, &mut scratch, None);
            assert_eq!(hits.hit_count(), rays.len(), "{map:?}");
            assert_eq!(any.iter().filter(|&&hit| hit == 0).count(), 0, "{map:?}");
            traced += rays.len();
        }
    }
    println!("{traced} rays stay inside");
}

/// The same placement twice, and meshes whose triangles lie in one another: the smaller instance wins, whatever the
/// order in which they are met.
#[test]
fn ties_go_to_the_smaller_instance() {
    let mut r = Random(77);
    let mesh = soup(300, &mut r);
    let maps: Vec<DAffine3> = (0..6).map(|_| r.affine(0.5)).collect();
    let twice: Vec<(usize, DAffine3)> = maps.iter().chain(maps.iter().rev()).map(|&map| (0, map)).collect();
    let scene = Scene::new(world(std::slice::from_ref(&mesh), &twice));
    let (mut hits, mut scratch, mut seen) = (Hits::default(), Scratch::default(), 0);
    for _ in 0..12 {
        let rays = camera(r.in_cube() * 12.0, r.in_cube() * 2.0, 0.6, 64);
        assert_eq!(differences(&scene, &rays), (0, 0));
        find("tile").intersect(&scene, &rays, &mut hits, &mut scratch, None);
        let found = (0..rays.len()).filter(|&i| hits.is_hit(i)).map(|i| hits.inst[i]);
        seen += found.inspect(|&inst| assert!(inst < 6, "instance {inst} hides its equal")).count();
    }
    assert!(seen > 5_000, "{seen}");
}

/// The same among triangles finer than the rays, where the larger instance is met first: its box begins before the other's.
#[test]
fn ties_of_fine_instances_go_to_the_smaller_one() {
    let mut r = Random(78);
    let mesh = soup(12_000, &mut r);
    let mut wider = mesh.clone();
    for corner in [DVec3::splat(-5.0), DVec3::splat(5.0)] {
        let first = wider.positions.len() as u32;
        wider.positions.extend([corner, corner * 0.999, corner + DVec3::X * 0.01]);
        wider.triangles.push([first, first + 1, first + 2]);
    }
    let map = r.affine(0.5);
    let scene = Scene::new(world(&[mesh, wider], &[(0, map), (1, map)]));
    let (mut hits, mut scratch, mut seen) = (Hits::default(), Scratch::default(), 0);
    for _ in 0..4 {
        let rays = camera(r.direction() * 40.0, DVec3::ZERO, 0.1, 32);
        assert_eq!(differences(&scene, &rays), (0, 0));
        find("tile").intersect(&scene, &rays, &mut hits, &mut scratch, None);
        let found = (0..rays.len()).filter(|&i| hits.is_hit(i) && hits.prim[i] < 12_000);
        seen += found.inspect(|&i| assert_eq!(hits.inst[i], 0, "ray {i}: the larger instance hides its equal")).count();
    }
    assert!(seen > 1_000, "{seen}");
}

/// What is too flat for f32 is left to the other kernels, and still right.
#[test]
fn flat_and_huge_maps_are_handed_on() {
    let mut r = Random(6);
    let meshes = [soup(200, &mut r), ball(8, 12)];
    for odd in [
        DAffine3::from_axis_angle(DVec3::ONE.normalize(), 0.7) * DAffine3::from_scale(DVec3::new(1.0, 1.0, 1e-5)),
        DAffine3::from_scale(DVec3::splat(1e-14)),
        DAffine3::from_translation(DVec3::splat(1e13)),
    ] {
        let scene = Scene::new(world(&meshes, &[(0, r.affine(0.5)), (1, r.affine(1.0)), (1, odd)]));
        for _ in 0..4 {
            let rays = camera(r.in_cube() * 12.0, r.in_cube() * 2.0, 0.4, 32);
            assert_eq!(differences(&scene, &rays), (0, 0), "{odd:?}");
        }
    }
}

/// A ray's answer does not depend on the order in which tiles come, nor on what a thread traced before.
#[test]
fn tiles_do_not_learn_answers_from_each_other() {
    let scene = scene(9, DVec3::ZERO);
    let rays = camera(DVec3::new(4.0, 3.0, 9.0), DVec3::ZERO, 0.6, 128);
    let (mut all, mut some, mut used) = (Hits::default(), Hits::default(), Scratch::default());
    find("tile").intersect(&scene, &rays, &mut all, &mut used, None);
    for block in (0..rays.len() / 1024).rev() {
        let mut part = Rays::new(1024);
        for i in 0..1024 {
            let at = block * 1024 + i;
            part.set(i, rays.org(at), rays.dir(at), rays.t_min[at], rays.t_max[at]);
        }
        find("tile").intersect(&scene, &part, &mut some, &mut used, None);
        for i in 0..1024 {
            let at = block * 1024 + i;
            let bits = |h: &Hits<f32>, i: usize| (h.t[i].to_bits(), h.u[i].to_bits(), h.prim[i], h.inst[i]);
            assert_eq!(bits(&some, i), bits(&all, at));
        }
    }
}
