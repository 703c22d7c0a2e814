//! Rays that the tile engine makes itself against the same rays in memory.

use crate::common;
use crate::tile_support;

use std::sync::Arc;

use common::{Random, ball, item, soup};
use glam::{DAffine3, DVec3};
use lanecast::camera::{Camera, PixelRect, SubPixel, Tiling, aim_tile, fill_tile};
use lanecast::measure::answers::Answers;
use lanecast::ray::{Counters, Hits, INVALID_ID, Pencil, Rays};
use lanecast::scene::description::{CameraDescription, Description, Group, ItemKind, Projection};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::Scratch;
use tile_support::{Scene, compile, explained, find};

const SIZE: u32 = 96;

fn looking(eye: DVec3, look_at: DVec3, projection: Projection) -> Camera {
    let up = DVec3::new(0.1, 1.0, 0.2);
    Camera::new(&CameraDescription { name: "test".into(), eye, look_at, up, projection }, 1.0).unwrap()
}

fn perspective(degrees: f64) -> Projection {
    Projection::Perspective { theta: degrees.to_radians() }
}

/// Forty balls, turned and stretched.
fn instances(r: &mut Random) -> Scene {
    let mut d = Description::new("instances");
    d.meshes.push(Arc::new(ball(9, 12)));
    d.groups.push(Group { name: "ball".into(), items: vec![item(ItemKind::Mesh(0), DAffine3::IDENTITY)] });
    for _ in 0..40 {
        let mut map = r.affine(0.5);
        map.translation = r.in_cube() * 3.0;
        d.groups[0].items.push(item(ItemKind::Instance(1), map));
    }
    Scene::new(World::compile(&d, Preset::Balanced).unwrap())
}

/// Traces a picture tile by tile; every tile's hits are compared with the scalar engine's and judged. Returns tiles that
/// the engine made, tiles in all, and hits.
fn compare(scene: &Scene, camera: &Camera, edge: u32, rect: PixelRect, sub_pixel: SubPixel) -> [usize; 3] {
    let tiling = Tiling::new(SIZE - 7, SIZE - 3, edge).unwrap();
    let (mut pencil, mut rays, mut scratch) = (Pencil::default(), Rays::new(0), Scratch::default());
    let (mut want, mut got) = (Hits::new(0), Hits::new(0));
    let mut made = 0;
    let mut count = 0;
    for tile in 0..tiling.tiles() {
        let is_pencil = aim_tile(camera, &tiling, tile, rect, sub_pixel, &mut pencil);
        assert_eq!(is_pencil, !camera.parallel);
        fill_tile(camera, &tiling, tile, rect, sub_pixel, &mut rays);
        if !is_pencil || !find("tile").intersect_pencil(scene, &pencil, &mut got, &mut scratch, None) {
            continue;
        }
        made += 1;
        find("scalar").intersect(scene, &rays, &mut want, &mut scratch, None);
        assert_eq!(got.len(), rays.len());
        for i in (0..rays.len()).filter(|&i| !rays.is_live(i)) {
            assert_eq!((got.t[i], got.prim[i], got.inst[i]), (f32::INFINITY, INVALID_ID, INVALID_ID), "a dead ray");
        }
        count += want.hit_count();
        explained(scene, &rays, &Answers::Closest(vec![want.clone()]), &Answers::Closest(vec![got.clone()]));
    }
    [made, tiling.tiles() as usize, count]
}

fn whole() -> PixelRect {
    PixelRect { x0: 0, y0: 0, x1: SIZE, y1: SIZE }
}

#[test]
fn made_rays_hit_what_rays_in_memory_hit() {
    let mut r = Random(31);
    let mut shifted = ball(40, 60);
    for p in &mut shifted.positions {
        *p = *p * 0.01 + DVec3::new(1000.0, 2000.0, -500.0);
    }
    let scenes = [
        ("soup", compile(vec![soup(3000, &mut r)])),
        ("ball", compile(vec![ball(50, 70)])),
        ("small ball far away", compile(vec![shifted])),
        ("instances", instances(&mut r)),
    ];
    for (name, scene) in &scenes {
        let (lo, hi) = scene.bounds().unwrap();
        let place = |f: DVec3| lo + (hi - lo) * f;
        let mut all = [0; 3];
        for case in 0..12 {
            let eye = place(DVec3::splat(0.5) + r.in_cube() * [0.5, 3.0][case % 2]);
            let target = place(DVec3::splat(0.5) + r.in_cube() * 0.2);
            let camera = looking(eye, target, perspective([15.0, 60.0, 110.0][case % 3]));
            let rect = if case % 4 == 0 { PixelRect { x0: 5, y0: 9, x1: 71, y1: 50 } } else { whole() };
            let sample = SubPixel::Sample { sample: case as u32, seed: 3 };
            let sub_pixel = if case % 2 == 0 { SubPixel::Anchor } else { sample };
            let one = compare(scene, &camera, [32, 16, 8][case % 3], rect, sub_pixel);
            all = [0, 1, 2].map(|i| all[i] + one[i]);
        }
        let [made, tiles, hits] = all;
        println!("{name}: {made} of {tiles} tiles made in the engine, {hits} hits");
        assert!(made * 3 > tiles * 2 && hits > 1000, "{name}: {all:?}");
    }
}

/// From within a closed mesh every ray hits, whatever the tile.
#[test]
fn nothing_escapes() {
    let scene = compile(vec![ball(60, 90)]);
    let tiling = Tiling::new(128, 128, 32).unwrap();
    let all = PixelRect { x0: 0, y0: 0, x1: 128, y1: 128 };
    let (mut pencil, mut hits, mut scratch) = (Pencil::default(), Hits::new(0), Scratch::default());
    let mut r = Random(8);
    for case in 0..20 {
        let camera = looking(r.in_cube() * 0.6, r.in_cube() * 5.0, perspective([20.0, 90.0][case % 2]));
        for tile in 0..tiling.tiles() {
            aim_tile(&camera, &tiling, tile, all, SubPixel::Anchor, &mut pencil);
            let mut counters = Counters::default();
            let made = find("tile").intersect_pencil(&scene, &pencil, &mut hits, &mut scratch, Some(&mut counters));
            assert!(made && hits.hit_count() == 1024, "case {case} tile {tile}: {}", hits.hit_count());
            assert!(counters.rays == 1024 && counters.prims > 0);
        }
    }
}

#[test]
fn what_has_no_common_point_or_goes_too_far_aside_is_left_to_others() {
    let scene = compile(vec![ball(20, 30)]);
    let eye = DVec3::new(0.0, 0.0, 4.0);
    let parallel = looking(eye, DVec3::ZERO, Projection::Parallel { height: 3.0 });
    assert_eq!(compare(&scene, &parallel, 32, whole(), SubPixel::Anchor)[0], 0);
    let wide = compare(&scene, &looking(eye, DVec3::ZERO, perspective(170.0)), 32, whole(), SubPixel::Anchor);
    assert!(wide[0] < wide[1] / 4, "{wide:?}");
    // Engines whose answers are the common formula's want rays in memory.
    let (mut pencil, mut hits, mut scratch) = (Pencil::default(), Hits::new(0), Scratch::default());
    let tiling = Tiling::new(SIZE, SIZE, 32).unwrap();
    aim_tile(&looking(eye, DVec3::ZERO, perspective(40.0)), &tiling, 0, whole(), SubPixel::Anchor, &mut pencil);
    for name in ["scalar", "packet16", "stream", "tile-exact", "tile-16x16"] {
        assert!(!find(name).intersect_pencil(&scene, &pencil, &mut hits, &mut scratch, None), "{name}");
    }
}
