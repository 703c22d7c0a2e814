//! Rays of one direction: parallel cameras and suns.

use crate::common;
use crate::tile_support;

use common::{Random, ball, soup};
use glam::DVec3;
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::scene::mesh::Mesh;
use lanecast::trace::Scratch;
use tile_support::{Scene, compile, differences, find, pixel};

/// A picture of `n` x `n` rays in the direction `dir`, `size` wide around `middle`, that start `back` before it.
fn beams(middle: DVec3, dir: DVec3, size: f64, back: f64, n: usize) -> Rays<f32> {
    let (right, up) = dir.normalize().any_orthonormal_pair();
    let mut rays = Rays::new(n * n);
    for i in 0..n * n {
        let (x, y) = pixel(i, n);
        let across = |p: usize| size * ((p as f64 + 0.5) / n as f64 - 0.5);
        let org = middle - dir.normalize() * back + right * across(x) + up * across(y);
        rays.set(i, org.as_vec3().to_array(), dir.as_vec3().to_array(), 0.0, f32::INFINITY);
    }
    rays
}

/// From what `rays` hit towards a sun in the direction `dir`.
fn to_sun(world: &Scene, rays: &Rays<f32>, dir: DVec3, t_min: f32) -> Rays<f32> {
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    find("scalar").intersect(world, rays, &mut hits, &mut scratch, None);
    let mut out = Rays::new(rays.len());
    for i in (0..rays.len()).filter(|&i| hits.is_hit(i)) {
        let org = glam::Vec3::from_array(rays.org(i)) + glam::Vec3::from_array(rays.dir(i)) * hits.t[i];
        out.set(i, org.to_array(), dir.as_vec3().to_array(), t_min, f32::INFINITY);
    }
    out
}

/// Pairs of a triangle and a ray that tiles tested.
fn in_tiles(world: &Scene, rays: &Rays<f32>, any: bool) -> u64 {
    let (mut scratch, mut counters) = (Scratch::default(), Counters::default());
    match any {
        false => find("tile").intersect(world, rays, &mut Hits::default(), &mut scratch, Some(&mut counters)),
        true => find("tile").occluded(world, rays, &mut Vec::new(), &mut scratch, Some(&mut counters)),
    }
    counters.prim_lanes_linear
}

fn moved(mut mesh: Mesh, scale: f64, by: DVec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = *p * scale + by);
    mesh
}

/// A flat grid of triangles in the plane z = 0.
fn grid() -> Mesh {
    let mut grid = Mesh::default();
    for i in 0..1600u32 {
        let at = |x: u32, y: u32| DVec3::new(f64::from(x) * 0.25 - 5.0, f64::from(y) * 0.25 - 5.0, 0.0);
        let (x, y, first) = (i % 40, i / 40, grid.positions.len() as u32);
        grid.positions.extend([at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        grid.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    grid
}

fn direction(case: usize, r: &mut Random) -> DVec3 {
    let any = r.in_cube().normalize();
    match case % 6 {
        0 => DVec3::X,
        1 => -DVec3::Z,
        2 => DVec3::new(1e-7, 1.0, -1e-7),
        3 => DVec3::new(any.x, any.y, 1e-6 * any.z).normalize() * 3.0,
        4 => any * 1e-3,
        _ => any,
    }
}

#[test]
fn pictures_and_suns_are_those_of_the_scalar_engine() {
    let mut r = Random(5);
    let one = soup(2000, &mut r);
    for (name, meshes) in [
        ("soup", vec![one.clone()]),
        ("every triangle twice", vec![one.clone(), one]),
        ("ball", vec![ball(60, 80)]),
        ("small ball far away", vec![moved(ball(40, 60), 0.01, DVec3::new(1000.0, 2000.0, -500.0))]),
        ("flat grid", vec![grid()]),
        ("grid, ball and soup", vec![grid(), moved(ball(30, 40), 1.0, DVec3::Z), soup(500, &mut r)]),
    ] {
        let world = compile(meshes);
        let (lo, hi) = world.bounds().unwrap();
        let (size, middle) = ((hi - lo).max_element(), 0.5 * (lo + hi));
        let (mut live, mut tested) = (0, [0; 2]);
        for case in 0..24 {
            let dir = direction(case, &mut r);
            let back = size * [0.6, 0.2, 5.0][case % 3];
            let at = middle + r.in_cube() * 0.2 * size;
            let mut primary = beams(at, dir, size * [1.2, 0.3, 0.02][case / 2 % 3], back, 64);
            assert_eq!(differences(&world, &primary), (0, 0), "{name} case {case}");
            tested[0] += in_tiles(&world, &primary, false);
            let sun = direction(case / 6, &mut r);
            let shadow = to_sun(&world, &primary, sun, [0.0, 1e-4][case % 2]);
            assert_eq!(differences(&world, &shadow), (0, 0), "{name} shadows of case {case}");
            tested[1] += in_tiles(&world, &shadow, true);
            live += primary.live_count() + shadow.live_count();
            // Ends, starts and dead rays as they come: beyond the scene, and within it.
            let far = (4.0 * size / dir.length()) as f32;
            for i in 0..primary.len() {
                match r.bits() % 8 {
                    0 => primary.kill(i),
                    1 => primary.t_min[i] = 0.2 * far * r.unit() as f32,
                    2 => primary.t_max[i] = far * [1.0, 1e6][i % 2],
                    3 if case % 4 == 0 => primary.t_max[i] = far * r.unit() as f32,
                    _ => {}
                }
            }
            assert_eq!(differences(&world, &primary), (0, 0), "{name} case {case}, cut");
        }
        println!("{name}: {live} rays; pairs in tiles: {tested:?}");
        assert!(live > 40_000 && tested.iter().all(|pairs| *pairs > 10_000), "{name}: {live} {tested:?}");
    }
}

#[test]
fn rays_aimed_at_vertices_and_edges() {
    let mut r = Random(9);
    for mesh in [ball(30, 40), soup(800, &mut r), grid()] {
        let world = compile(vec![mesh.clone()]);
        for case in 0..12 {
            let dir = direction(case, &mut r);
            let (mut forth, mut back) = (Rays::new(4096), Rays::new(4096));
            for i in 0..forth.len() {
                // Neighbours in the mesh are neighbours in the batch.
                let corner = mesh.triangles[i / 4 % mesh.triangles.len()].map(|v| mesh.positions[v as usize]);
                let along = if i % 4 == 0 { 0.0 } else { r.unit() };
                let target = corner[i % 3].lerp(corner[(i + 1) % 3], along);
                let way = (dir.normalize() * 2.0).as_vec3();
                let as_given = dir.as_vec3().to_array();
                forth.set(i, (target.as_vec3() - way).to_array(), as_given, 0.0, f32::INFINITY);
                back.set(i, (target.as_vec3() + way * 0.1).to_array(), (-dir).as_vec3().to_array(), 0.0, f32::INFINITY);
            }
            assert_eq!((differences(&world, &forth), differences(&world, &back)), ((0, 0), (0, 0)), "case {case}");
        }
    }
}

#[test]
fn nothing_escapes_from_a_closed_ball() {
    let world = compile(vec![ball(60, 80)]);
    let (mut hits, mut any, mut scratch, mut r) = (Hits::default(), Vec::new(), Scratch::default(), Random(3));
    let mut traced = 0;
    for case in 0..120 {
        let rays = beams(r.in_cube() * 0.2, direction(case, &mut r), 0.6 * r.unit(), 0.2, 96);
        assert!(in_tiles(&world, &rays, false) > 0 && in_tiles(&world, &rays, true) > 0);
        find("tile").intersect(&world, &rays, &mut hits, &mut scratch, None);
        find("tile").occluded(&world, &rays, &mut any, &mut scratch, None);
        assert_eq!((hits.hit_count(), any.iter().filter(|hit| **hit != 0).count()), (rays.len(), rays.len()));
        traced += rays.len();
    }
    println!("{traced} rays");
}

/// One ray of another direction, one that ends among the triangles, or starts very far away: the block is for others.
#[test]
fn blocks_that_are_for_others() {
    let world = compile(vec![ball(60, 80), soup(300, &mut Random(3))]);
    let dir = DVec3::new(0.3, -0.8, 0.5);
    let rays = || beams(DVec3::ZERO, dir, 1.5, 1.5, 32);
    type Change = fn(&mut Rays<f32>, usize);
    let changes: [(bool, Change); 6] = [
        (true, |_, _| {}),
        (true, |rays, i| rays.kill(i)),
        (true, |rays, i| rays.t_max[i] = 1e6),
        (false, |rays, i| rays.dir[0][i] = rays.dir[0][i].next_up()),
        (false, |rays, i| rays.t_max[i] = 1.5),
        (false, |rays, i| (0..3).for_each(|a| rays.org[a][i] -= 1000.0 * rays.dir[a][i])),
    ];
    for (k, (is_tile, change)) in changes.into_iter().enumerate() {
        for i in [1, 300, 1023] {
            let mut rays = rays();
            change(&mut rays, i);
            for any in [false, true] {
                assert_eq!(in_tiles(&world, &rays, any) > 0, is_tile, "change {k} of ray {i}, any {any}");
            }
            assert_eq!(differences(&world, &rays), (0, 0), "change {k} of ray {i}");
        }
    }
}

/// Triangles much smaller than the distance of rays, and rays in no order, are left to the stream kernel.
#[test]
fn fine_triangles_and_rays_in_no_order() {
    let world = compile(vec![ball(400, 500)]);
    for (size, is_tile) in [(6.0, false), (0.2, true)] {
        let rays = beams(DVec3::ZERO, DVec3::new(0.1, 0.2, -1.0), size, 1.5, 96);
        let suns = to_sun(&world, &rays, DVec3::new(0.5, 0.3, 0.4), 1e-4);
        assert_eq!(
            [in_tiles(&world, &rays, false), in_tiles(&world, &suns, true)].map(|n| n > 0),
            [is_tile; 2],
            "{size}"
        );
        assert_eq!((differences(&world, &rays), differences(&world, &suns)), ((0, 0), (0, 0)));
    }
    let ordered = beams(DVec3::ZERO, DVec3::new(0.1, 0.2, -1.0), 0.2, 1.5, 64);
    let mut places: Vec<usize> = (0..ordered.len()).collect();
    let mut r = Random(11);
    (1..places.len()).rev().for_each(|i| places.swap(i, r.below(i + 1)));
    let mut shuffled = Rays::new(places.len());
    for (i, &k) in places.iter().enumerate() {
        shuffled.set(i, ordered.org(k), ordered.dir(k), ordered.t_min[k], ordered.t_max[k]);
    }
    assert_eq!(in_tiles(&world, &shuffled, false), 0);
    assert_eq!(differences(&world, &shuffled), (0, 0));
}
