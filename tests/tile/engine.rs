//! The tile engines against the scalar engine, for rays with a common origin, a common end or neither: `tile-exact` has
//! its bits; `tile`, which has an arithmetic of its own, has its answers but where the oracle's margins explain it.

use crate::common;
use crate::tile_support;

use std::path::Path;

use common::{Random, ball, soup};
use glam::{DQuat, DVec3};
use lanecast::ray::{Counters, Hits, INVALID_ID, PAD, Rays};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::scene::{ply, unpack};
use lanecast::trace::Scratch;
use tile_support::{Scene, camera, compile, differences, find, mirrored, shadows};

fn worlds() -> Vec<(&'static str, Scene)> {
    let mut r = Random(77);
    let one = soup(2000, &mut r);
    let mut shifted = ball(40, 60);
    for p in &mut shifted.positions {
        *p = *p * 0.01 + DVec3::new(1000.0, 2000.0, -500.0);
    }
    let mut grid = Mesh::default();
    for i in 0..40u32 {
        for j in 0..40u32 {
            let at = |x: u32, y: u32| DVec3::new(f64::from(x) * 0.25 - 5.0, f64::from(y) * 0.25 - 5.0, 0.0);
            let first = grid.positions.len() as u32;
            grid.positions.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            grid.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    vec![
        ("soup", compile(vec![one.clone()])),
        ("every triangle twice", compile(vec![one.clone(), one])),
        ("ball", compile(vec![ball(60, 80)])),
        ("small ball far away", compile(vec![shifted])),
        ("flat grid", compile(vec![grid])),
    ]
}

#[test]
fn pictures_and_shadows_are_those_of_the_scalar_engine() {
    let mut r = Random(5);
    for (name, world) in worlds() {
        let (lo, hi) = world.bounds().unwrap();
        let place = |f: DVec3| lo + (hi - lo) * f;
        let mut traced = (0, 0);
        for case in 0..24 {
            let inside = case % 2 == 0;
            let reach = if inside { 0.5 } else { 3.0 };
            let eye = place(DVec3::splat(0.5) + r.in_cube() * reach);
            let target = place(DVec3::splat(0.5) + r.in_cube() * 0.2);
            let tan = [0.05, 0.5, 1.0, 30.0][case % 4];
            let primary = camera(eye, target, tan, 64);
            assert_eq!(differences(&world, &primary), (0, 0), "{name} case {case}");
            let light = place(DVec3::splat(0.5) + r.in_cube() * reach * 1.5);
            let (end, t_min) = [(1.0, 0.0), (1.0, 1e-4), (7.5, 0.0), (1.0 - 2e-6, 1e-6)][case / 2 % 4];
            let shadow = shadows(&world, &primary, light, end, t_min);
            assert_eq!(differences(&world, &shadow), (0, 0), "{name} shadows of case {case}");
            traced = (traced.0 + primary.live_count(), traced.1 + shadow.live_count());
        }
        println!("{name}: {} primary rays and {} shadow rays, all bits equal", traced.0, traced.1);
        assert!(traced.1 > 5000, "{name}");
    }
}

#[test]
fn rays_aimed_at_vertices_and_edges() {
    let (mesh, mut r) = (ball(30, 40), Random(9));
    let world = compile(vec![mesh.clone()]);
    for eye in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.1), DVec3::new(2.0, 1.0, 0.5), DVec3::new(0.0, 0.0, 3.0)] {
        let mut rays = Rays::new(4096);
        for i in 0..rays.len() {
            // Neighbours in the mesh are neighbours in the batch.
            let corner = mesh.triangles[i / 2 % mesh.triangles.len()].map(|v| mesh.positions[v as usize]);
            let target = if i % 2 == 0 { corner[0] } else { corner[0].lerp(corner[1], r.unit()) };
            rays.set(i, eye.as_vec3().to_array(), (target - eye).as_vec3().to_array(), 0.0, f32::INFINITY);
        }
        assert_eq!(differences(&world, &rays), (0, 0), "from {eye}");
    }
}

/// At a free edge no neighbour takes what a triangle leaves: here a wrong sign is a wrong answer.
#[test]
fn rays_aimed_at_free_edges() {
    let mut r = Random(21);
    let mesh = soup(400, &mut r);
    let world = compile(vec![mesh.clone()]);
    let mut doubtful = 0;
    for triangle in &mesh.triangles {
        let corner = triangle.map(|v| mesh.positions[v as usize]);
        let away = corner[0] + r.in_cube() * [0.5, 3.0, 30.0][r.below(3)];
        let (mut forth, mut back) = (Rays::new(256), Rays::new(256));
        for i in 0..256 {
            let target = corner[i % 3].lerp(corner[(i + 1) % 3], r.unit());
            let (eye, way) = (away.as_vec3(), (target - away).as_vec3());
            forth.set(i, eye.to_array(), way.to_array(), 0.0, f32::INFINITY);
            // The same line from behind the triangle to a light in the same place.
            let org = eye + way * 1.25;
            back.set(i, org.to_array(), (eye - org).to_array(), 0.0, 1.0);
        }
        assert_eq!((differences(&world, &forth), differences(&world, &back)), ((0, 0), (0, 0)));
        doubtful += 512;
    }
    println!("{doubtful} rays along free edges, all bits equal");
}

/// An edge that points at the eye is short to look at and long to compute with: its function rounds by more than is seen
/// of it.
#[test]
fn ribbons_whose_ends_point_at_the_eye() {
    let (eye, mut r) = (DVec3::new(0.25, 1.6, 0.6), Random(31));
    for _ in 0..60 {
        let (mut mesh, mut targets) = (Mesh::default(), Vec::new());
        let middle = (DVec3::new(-0.52, -0.07, -0.87) + r.in_cube() * 0.2).normalize();
        for i in 0..16 {
            let way = (middle + r.in_cube() * 0.02).normalize();
            let (start, long) = (eye + way * (0.4 + 0.4 * r.unit()), r.in_cube().normalize() * 7.7e-3);
            let end = start + (way + r.in_cube() * 0.02).normalize() * 2.3e-4;
            let corners = [start, end, start + long, end + long];
            mesh.positions.extend(corners.map(|p| p.as_vec3().as_dvec3()));
            mesh.triangles.extend([[4 * i, 4 * i + 1, 4 * i + 2], [4 * i + 1, 4 * i + 3, 4 * i + 2]]);
            for _ in 0..64 {
                targets.push(start.lerp(end, r.unit()) + long * (0.02 * (r.unit() - 0.5)));
            }
        }
        let world = compile(vec![mesh]);
        let mut rays = Rays::new(targets.len());
        for (i, target) in targets.into_iter().enumerate() {
            rays.set(i, eye.as_vec3().to_array(), (target - eye).as_vec3().to_array(), 0.0, f32::INFINITY);
        }
        assert_eq!(differences(&world, &rays), (0, 0));
    }
}

#[test]
fn nothing_escapes_from_a_closed_ball() {
    let world = compile(vec![ball(60, 80)]);
    let (mut hits, mut scratch, mut r, mut rays_traced) = (Hits::default(), Scratch::default(), Random(3), 0);
    while rays_traced < 1_000_000 {
        let rays = camera(r.in_cube() * 0.5, r.in_cube() * 4.0, 0.05 + 2.0 * r.unit(), 128);
        find("tile").intersect(&world, &rays, &mut hits, &mut scratch, None);
        assert_eq!(hits.hit_count(), rays.len());
        rays_traced += rays.len();
    }
}

#[test]
fn segments_and_dead_rays() {
    let (world, mut r) = (compile(vec![ball(20, 30), soup(500, &mut Random(1))]), Random(2));
    for len in [1, 15, 16, 17, 100, 255, 256, 257, 300, 1024] {
        for _ in 0..20 {
            let picture = camera(r.in_cube() * 5.0, r.in_cube(), 0.4, 32);
            let mut rays = Rays::new(len);
            for i in 0..len {
                let (t_min, t_max) = match r.below(6) {
                    0 => (r.unit(), 1.0),
                    1 => (0.0, r.unit()),
                    2 => (r.unit() * 2.0, f64::INFINITY),
                    3 => (-1.0, 5.0),
                    _ => (0.0, f64::INFINITY),
                };
                let dir = glam::Vec3::from_array(picture.dir(i)) * [1.0, 1e-3, 300.0][i % 3];
                rays.set(i, picture.org(i), dir.to_array(), t_min as f32, t_max as f32);
                match r.below(12) {
                    0 => rays.kill(i),
                    1 => rays.dir[1][i] = f32::NAN,
                    2 => rays.t_max[i] = -1.0,
                    3 => rays.dir[0][i] = 1e30,
                    _ => {}
                }
            }
            assert_eq!(differences(&world, &rays), (0, 0));
        }
    }
}

/// What a block is does not matter to the others of its batch, whichever kernel it is for and however long its rays wait there.
#[test]
fn blocks_of_all_sorts_in_one_batch() {
    const BLOCK: usize = 1024;
    // Flat, for mirrors.
    let corners = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]].map(|[x, y]| DVec3::new(x, -1.0, y));
    let floor = Mesh { positions: corners.into(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let (scene, mut r) = (compile(vec![ball(20, 30), soup(300, &mut Random(3)), floor]), Random(9));
    let picture = camera(DVec3::new(4.0, 3.0, 5.0), DVec3::ZERO, 0.3, 32);
    let thrown = mirrored(&scene, &picture);
    let lit = |light: [f64; 3], end, t_min| shadows(&scene, &picture, DVec3::from(light), end, t_min);
    let to_light = [lit([3.0, 4.0, 1.0], 1.0, 0.0), lit([3.0, 4.0, 1.0], 3.0, 0.01)];
    let to_other = lit([-2.0, 4.0, 3.0], 1.0, 0.0);
    let blocks = 48;
    let mut rays = Rays::new(blocks * BLOCK - 5);
    for block in 0..blocks {
        let (sort, dead) = (block % 6, [0, 16, 700, BLOCK][r.below(4)]);
        let scattered = common::rays(BLOCK, block as u64);
        // From some ray on the point that the first group has in common is not what the others have; dead and odd rays everywhere.
        let (turn, holes, odd) = ([BLOCK, 500, 1000][r.below(3)], [0, 3, 20][r.below(3)], [0, 300][r.below(2)]);
        for k in 0..BLOCK.min(rays.len() - block * BLOCK) {
            let i = block * BLOCK + k;
            let from = match sort {
                0 if k < turn => &picture,
                1 => &thrown,
                2 | 3 if k < turn => &to_light[sort - 2],
                2 | 3 => &to_other,
                _ => &scattered,
            };
            rays.set(i, from.org(k), from.dir(k), from.t_min[k], from.t_max[k]);
            if k < dead {
                rays.kill(i);
            } else if holes != 0 && r.below(holes) == 0 {
                match r.below(4) {
                    0 => rays.org[r.below(3)][i] = f32::NAN,
                    1 => rays.dir[r.below(3)][i] = f32::INFINITY,
                    2 => rays.t_max[i] = f32::NAN,
                    _ => rays.kill(i),
                }
            } else if odd != 0 && r.below(odd) == 0 {
                rays.dir[0][i] = 1e30;
            }
        }
    }
    assert_eq!(differences(&scene, &rays), (0, 0));
    let (mut all, mut alone, mut scratch) = (Hits::default(), Hits::default(), Scratch::default());
    let (mut all_any, mut alone_any) = (Vec::new(), Vec::new());
    for name in ["tile", "tile-exact", "tile-16x16"] {
        find(name).intersect(&scene, &rays, &mut all, &mut scratch, None);
        find(name).occluded(&scene, &rays, &mut all_any, &mut scratch, None);
        for first in (0..rays.len()).step_by(BLOCK) {
            let mut block = Rays::new(BLOCK.min(rays.len() - first));
            for k in 0..block.len() {
                let i = first + k;
                block.set(k, rays.org(i), rays.dir(i), rays.t_min[i], rays.t_max[i]);
            }
            find(name).intersect(&scene, &block, &mut alone, &mut scratch, None);
            find(name).occluded(&scene, &block, &mut alone_any, &mut scratch, None);
            for k in 0..block.len() {
                let bits = |h: &Hits<f32>, i: usize| ([h.t[i], h.u[i], h.v[i]].map(f32::to_bits), h.prim[i], h.inst[i]);
                assert_eq!(bits(&all, first + k), bits(&alone, k), "{name}: ray {k} of block {}", first / BLOCK);
                assert_eq!(all_any[first + k], alone_any[k], "{name}: ray {k} of block {}", first / BLOCK);
            }
        }
    }
    assert!(all.hit_count() > 3000, "{}", all.hit_count());
}

/// Whoever reads whole vectors of hits reads past the last ray.
#[test]
fn what_follows_the_last_hit_is_misses() {
    let corners = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]].map(|[x, y]| DVec3::new(x, -1.0, y));
    let floor = Mesh { positions: corners.into(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let scene = compile(vec![ball(20, 30), floor]);
    let picture = camera(DVec3::new(4.0, 3.0, 5.0), DVec3::ZERO, 0.3, 64);
    let sorts = [mirrored(&scene, &picture), common::rays(4096, 1), picture];
    let (mut hits, mut scratch, mut found) = (Hits::default(), Scratch::default(), 0);
    for (sort, n) in (0..sorts.len()).flat_map(|sort| [1, 15, 43, 250, 1000, 1025, 3999].map(|n| (sort, n))) {
        let mut rays = Rays::new(n);
        for i in 0..n {
            let from = &sorts[sort];
            rays.set(i, from.org(i), from.dir(i), from.t_min[i], from.t_max[i]);
        }
        for name in ["tile", "tile-exact", "tile-16x16", "tile-8x8", "tile-4x4"] {
            // As after a call for more rays, all of which hit something.
            hits.reset(n + PAD);
            hits.prim.fill(0);
            hits.inst.fill(0);
            hits.t.fill(0.0);
            find(name).intersect(&scene, &rays, &mut hits, &mut scratch, None);
            found += (0..n).filter(|&i| hits.is_hit(i)).count();
            for i in n..n.next_multiple_of(PAD) {
                let padding = (hits.t[i], hits.prim[i], hits.inst[i]);
                assert_eq!(padding, (f32::INFINITY, INVALID_ID, INVALID_ID), "{name}: {n} rays of sort {sort}");
            }
        }
    }
    assert!(found > 10_000, "{found}");
}

#[test]
fn ends_exactly_at_a_hit() {
    let (world, mut r) = (compile(vec![soup(800, &mut Random(4))]), Random(8));
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    for _ in 0..20 {
        let mut rays = camera(r.in_cube() * 6.0, r.in_cube(), 0.3, 32);
        find("scalar").intersect(&world, &rays, &mut hits, &mut scratch, None);
        for i in 0..rays.len() {
            let t = hits.t[i];
            match i % 4 {
                0 => rays.t_max[i] = t,
                1 => rays.t_max[i] = t.next_down(),
                2 if t.is_finite() => rays.t_min[i] = t,
                3 if t.is_finite() => rays.t_min[i] = t.next_up(),
                _ => {}
            }
        }
        assert_eq!(differences(&world, &rays), (0, 0));
    }
}

/// The cube [-1, 1]^3.
fn cube() -> Mesh {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
    let mut mesh = Mesh { positions: (0..8).map(corner).collect(), ..Mesh::default() };
    for axis in 0..3 {
        let [one, other] = [1u32, 2].map(|k| 1 << ((axis + k) % 3));
        for from in [0, 1 << axis] {
            let [a, b, c, d] = [from, from | one, from | other, from | one | other];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// Long triangles that are 1000 times as long as wide, in the cube of half-width 4.
fn needles(n: u32, r: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        let (one, other) = (4.0 * r.in_cube(), 4.0 * r.in_cube());
        let beside = one.lerp(other, r.unit()) + 1e-3 * (other - one).length() * r.direction();
        mesh.positions.extend([one, other, beside].map(|p| p.as_vec3().as_dvec3()));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// Weights of triangles so small, seen from so far, that f32 has few digits for them: those of the hit's place, as far as corners
/// and rays are known, and never beyond a corner.
#[test]
fn weights_of_tiny_triangles() {
    let mut r = Random(41);
    let (mut hits, mut scratch, mut count, mut worst) = (Hits::default(), Scratch::default(), 0, 0.0f64);
    for size in [3e-5, 1e-4, 3e-4] {
        let mut mesh = Mesh::default();
        for i in 0..2000u32 {
            let at = r.in_cube() * DVec3::new(0.01, 0.01, 1.0);
            mesh.positions.extend([(); 3].map(|()| (at + size * r.in_cube()).as_vec3().as_dvec3()));
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let scene = compile(vec![mesh.clone()]);
        let rays = camera(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, 1e-3, 512);
        find("tile").intersect(&scene, &rays, &mut hits, &mut scratch, None);
        for i in (0..rays.len()).filter(|&i| hits.is_hit(i)) {
            let [a, b, c] = mesh.triangles[hits.prim[i] as usize].map(|v| mesh.positions[v as usize]);
            let (u, v) = (f64::from(hits.u[i]), f64::from(hits.v[i]));
            let [org, dir] = [rays.org(i), rays.dir(i)].map(|p| DVec3::from_array(p.map(f64::from)));
            let from_eye = a + u * (b - a) + v * (c - a) - org;
            let beside = from_eye.cross(dir).length() / dir.length();
            worst = worst.max(beside / from_eye.length());
            assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6, "{u} {v}");
            count += 1;
        }
    }
    let half_ulps = worst / f64::from(f32::EPSILON / 2.0);
    println!("{count} hits, at most {half_ulps:.3} half ulps of the distance beside the ray");
    assert!(count > 10_000 && half_ulps < 1.0, "{count} hits, {half_ulps} half ulps");
}

/// Rooms whose walls are mirrors, with things in them that are not flat: of what a wall throws back most has a common point
/// behind the wall.
#[test]
fn mirror_rays() {
    let mut r = Random(21);
    let room = |scale: f64, at: DVec3, things: Vec<Mesh>| {
        let mut walls = cube();
        let shear = |p: DVec3| (p * 6.0 + DVec3::new(0.1 * p.y, 0.2 * p.z, 0.0)) * scale + at;
        walls.positions.iter_mut().for_each(|p| *p = shear(*p));
        let placed = things.into_iter().map(|mut mesh| {
            mesh.positions.iter_mut().for_each(|p| *p = *p * scale + at);
            mesh
        });
        compile([walls].into_iter().chain(placed).collect())
    };
    let away = DVec3::new(300.0, -700.0, 1000.0);
    // With the least share of the triangle tests that tiles do: what a ball and small triangles throw back has no point.
    for (name, least_share, world) in [
        ("empty", 0.8, room(1.0, DVec3::ZERO, vec![])),
        ("soup", 0.3, room(1.0, DVec3::ZERO, vec![soup(500, &mut r)])),
        ("needles", 0.15, room(1.0, DVec3::ZERO, vec![needles(3000, &mut r)])),
        ("ball and soup far away", 0.15, room(1.0, away, vec![ball(30, 40), soup(500, &mut r)])),
        ("small", 0.1, room(1e-3, DVec3::ZERO, vec![ball(30, 40), soup(2000, &mut r)])),
    ] {
        let (lo, hi) = world.bounds().unwrap();
        let place = |f: DVec3| 0.5 * (lo + hi) + 0.5 * (hi - lo) * f;
        let (mut traced, mut counters) = (0, Counters::default());
        for case in 0..12 {
            let eye = place(0.8 * r.in_cube());
            let primary = camera(eye, place(r.in_cube()), [0.1, 0.5, 1.0][case % 3], 64);
            let mut rays = mirrored(&world, &primary);
            for _ in 0..2 {
                assert_eq!(differences(&world, &rays), (0, 0), "{name} case {case}");
                traced += rays.live_count();
                let scratch = &mut Scratch::default();
                find("tile").intersect(&world, &rays, &mut Hits::default(), scratch, Some(&mut counters));
                rays = mirrored(&world, &rays);
            }
            // Ends, starts and dead rays as they come.
            let live: Vec<usize> = (0..rays.len()).filter(|&i| rays.is_live(i)).collect();
            for i in live {
                match r.bits() % 8 {
                    0 => rays.kill(i),
                    1 => rays.t_max[i] = ((hi - lo).length() * r.unit()) as f32,
                    2 => rays.t_min[i] = (0.1 * (hi - lo).length() * r.unit()) as f32,
                    _ => {}
                }
            }
            assert_eq!(differences(&world, &rays), (0, 0), "{name} case {case}, cut");
        }
        // Only tiles count these.
        let share = counters.prim_lanes_linear as f64 / counters.prim_lanes_total as f64;
        println!("{name}: {traced} mirror rays, all bits equal; {share:.2} of the triangle tests in tiles");
        assert!(traced > 50_000, "{name}: {traced}");
        assert!(share > least_share, "{name}: {share}");
    }
}

/// A mirror under small things, seen from so far that the lines it throws back pass the eye's image by more than answers may be wrong.
#[test]
fn mirrors_of_distant_eyes() {
    let mut r = Random(77);
    let mut floor = cube();
    floor.positions.iter_mut().for_each(|p| *p = DVec3::new(6.0 * p.x, 6.0 * p.y, 0.1 * p.z - 5.0));
    let world = compile(vec![floor, needles(400, &mut r), soup(400, &mut r)]);
    for distance in [30.0, 100.0, 300.0, 1e3, 1e4] {
        let eye = DVec3::new(0.1, 0.4, 0.9).normalize() * distance;
        let primary = camera(eye, DVec3::ZERO, 4.0 / distance, 256);
        let thrown = mirrored(&world, &primary);
        assert!(thrown.live_count() > 20_000, "{}", thrown.live_count());
        assert_eq!(differences(&world, &thrown), (0, 0), "from {distance}");
    }
}

/// A floor seen from its own height, by rays in its plane and a little off it.
#[test]
fn eyes_at_floor_height() {
    let mut floor = Mesh::default();
    for i in 0..48 {
        floor.positions.push(DVec3::new(f64::from(i % 6) * 0.4 - 1.0, 0.0, f64::from(i / 6) / 3.5 - 1.0));
        let (column, row) = (i % 6, i / 6);
        if column < 5 && row < 7 {
            floor.triangles.extend([[i, i + 1, i + 7], [i, i + 7, i + 6]]);
        }
    }
    let world = compile(vec![floor]);
    for offs in [&[0.0][..], &[0.0, 1e-17], &[1e-12, -1e-12], &[0.2, -0.2, 0.0], &[1e-8, -1e-8]] {
        let mut r = Random(41);
        for case in 0..12 {
            let eye = [r.unit() * 2.0 - 1.0, 0.0, [3.0, 1.0, 0.3][case % 3]].map(|x| x as f32);
            let mut rays = Rays::new(2048);
            for i in 0..rays.len() {
                let dir = [r.unit() * 2.0 - 1.0, offs[i % offs.len()], -1.0].map(|x| x as f32);
                rays.set(i, eye, dir, 0.0, f32::INFINITY);
            }
            assert_eq!(differences(&world, &rays), (0, 0), "{offs:?} case {case}");
        }
    }
    // As cameras of an odd height see it: the middle row lies in the plane.
    for eye in [[0.3, 0.0, 3.0], [-0.7, 0.0, 2.0], [0.3, 0.0, 0.31], [0.0, 0.0, 1.7]] {
        let mut rays = Rays::new(1024);
        for i in 0..rays.len() {
            let at = |k: usize| (k as f32 - 15.0) / 40.0;
            rays.set(i, eye, [at(i % 32), at(i / 32), -1.0], 0.0, f32::INFINITY);
        }
        assert_eq!(differences(&world, &rays), (0, 0), "{eye:?}");
    }
}

/// Segments that start or end at minus zero, as hits do that lie in the start.
#[test]
fn segments_to_minus_zero() {
    let mut r = Random(43);
    let world = compile(vec![soup(300, &mut r)]);
    for case in 0..8 {
        let mut rays = camera(DVec3::new(0.1, 0.2, 9.0), DVec3::ZERO, 0.4, 32);
        for i in 0..rays.len() {
            match (r.bits() % 64, case % 4) {
                (0, 0) | (1, 3) => rays.t_max[i] = -0.0,
                (_, 1 | 3) => rays.t_min[i] = -0.0,
                _ => {}
            }
        }
        if case % 4 > 0 {
            rays.t_min[5 * case] = 0.5;
        }
        assert_eq!(differences(&world, &rays), (0, 0), "case {case}");
        let hits = &mut Hits::default();
        find("tile").intersect(&world, &rays, hits, &mut Scratch::default(), None);
        assert!(hits.hit_count() > 200, "{}", hits.hit_count());
    }
}

/// Blocks on a lattice, seen from points that lie in the planes of many of their sides: those are seen edge-on.
#[test]
fn eyes_in_the_planes_of_triangles() {
    let mut r = Random(31);
    let mut blocks = Mesh::default();
    for _ in 0..150 {
        let at = (6.0 * r.in_cube()).round();
        let first = blocks.positions.len() as u32;
        let one = cube();
        blocks.positions.extend(one.positions.iter().map(|p| 0.5 * *p + at + 0.5));
        blocks.triangles.extend(one.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    // Turned a little, so that sides lie in such planes but for rounding.
    let mut turned = blocks.clone();
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.3);
    turned.positions.iter_mut().for_each(|p| *p = (turn * *p).as_vec3().as_dvec3());
    for (world, turn) in [(compile(vec![blocks]), DQuat::IDENTITY), (compile(vec![turned]), turn)] {
        let mut hits = 0;
        for case in 0..18 {
            let eye = (7.0 * r.in_cube()).round();
            let mut target = 4.0 * r.in_cube();
            target[case % 3] = eye[case % 3];
            let rays = camera(turn * eye, turn * target, [1e-6, 1e-3, 0.5][case / 3 % 3], 64);
            assert_eq!(differences(&world, &rays), (0, 0), "case {case}");
            let thrown = mirrored(&world, &rays);
            hits += thrown.live_count();
            assert_eq!(differences(&world, &thrown), (0, 0), "mirror rays of case {case}");
        }
        assert!(hits > 15_000, "{hits}");
    }
}

#[test]
fn incoherent_rays_and_other_worlds_take_the_packet_path() {
    for seed in 0..3 {
        for world in [
            Scene::new(World::compile(&common::zoo(seed, true), Preset::Balanced).unwrap()),
            Scene::new(World::compile(&common::zoo(seed, false), Preset::Balanced).unwrap()),
            compile(vec![soup(1000, &mut Random(seed))]),
        ] {
            assert_eq!(differences(&world, &common::rays(3000, seed)), (0, 0));
            let eye = Random(seed).in_cube() * 6.0;
            assert_eq!(differences(&world, &camera(eye, DVec3::ZERO, 0.6, 64)), (0, 0));
        }
    }
    // One origin, every direction: nothing fits a frame.
    let (world, mut r) = (compile(vec![soup(1000, &mut Random(6))]), Random(7));
    let mut rays = Rays::new(2048);
    for i in 0..rays.len() {
        rays.set(i, [0.1, 0.2, 0.3], r.direction().as_vec3().to_array(), 0.0, f32::INFINITY);
    }
    assert_eq!(differences(&world, &rays), (0, 0));
}

#[test]
fn counts_and_repeats() {
    let world = compile(vec![ball(60, 80)]);
    let rays = camera(DVec3::new(0.1, 0.2, 0.3), DVec3::X, 0.7, 64);
    let (mut first, mut again, mut scratch) = (Hits::default(), Hits::default(), Scratch::default());
    let mut counters = Counters::default();
    find("tile").intersect(&world, &rays, &mut first, &mut scratch, Some(&mut counters));
    find("tile").intersect(&world, &rays, &mut again, &mut scratch, None);
    assert_eq!(first.t, again.t);
    assert_eq!(counters.rays, rays.len() as u64);
    // The point of tiles: far fewer node visits than rays.
    assert!(counters.nodes * 4 < counters.rays, "{counters:?}");
}

/// Two tests, as one would be the longest by far.
#[test]
fn meshes_of_hard_sizes() {
    hard_meshes(&["denormal", "huge_range", "exponential", "flat_grid"]);
}

#[test]
fn meshes_of_hard_shapes() {
    hard_meshes(&["needles", "duplicates_x64", "teapot_in_stadium"]);
}

fn hard_meshes(names: &[&str]) {
    for name in names {
        let file = format!("../shared/scenes/pathological/{name}.ply");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let Ok(bytes) = unpack::read_file(&path) else {
            println!("SKIPPED: {} is not there", path.display());
            continue;
        };
        let world = compile(vec![ply::parse(&path, &bytes).unwrap()]);
        let (lo, hi) = world.bounds().unwrap();
        let mut r = Random(11);
        for case in 0..4 {
            let at = |f: DVec3| lo + (hi - lo) * f;
            let eye = at(DVec3::splat(0.5) + r.in_cube() * if case % 2 == 0 { 0.5 } else { 2.0 });
            let rays = camera(eye, at(DVec3::splat(0.5) + r.in_cube() * 0.1), 0.4, 64);
            assert_eq!(differences(&world, &rays), (0, 0), "{name} case {case}");
            let light = at(DVec3::splat(0.5) + r.in_cube());
            let shadow = shadows(&world, &rays, light, 1.0, 0.0);
            assert_eq!(differences(&world, &shadow), (0, 0), "{name} shadows of case {case}");
        }
    }
}
