//! Fine meshes seen by pictures: what is left out between rays is what none of them hits.

use crate::common;
use crate::tile_support;

use std::sync::Arc;

use common::{Random, ball, item};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::scene::description::{Description, Group, ItemKind};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::Scratch;
use tile_support::{Scene, camera, compile, differences, find};

/// The same rays, but two in each block are in each other's place: no columns and rows, and the same frame.
fn disordered(rays: &Rays<f32>) -> Rays<f32> {
    let mut other = Rays::new(rays.len());
    (0..rays.len()).for_each(|i| other.set(i, rays.org(place(i)), rays.dir(place(i)), 0.0, f32::INFINITY));
    other
}

/// Where ray `i` went; its own inverse.
fn place(i: usize) -> usize {
    match i % 1024 {
        1 => i + 1021,
        1022 => i - 1021,
        _ => i,
    }
}

/// Hits of `tile`, and pairs of a ray and a triangle that were tested.
fn traced(world: &World<f32>, rays: &Rays<f32>) -> (Hits<f32>, u64) {
    let (mut hits, mut counters, mut counted) = (Hits::default(), Counters::default(), Hits::default());
    find("tile").intersect(world, rays, &mut counted, &mut Scratch::default(), Some(&mut counters));
    find("tile").intersect(world, rays, &mut hits, &mut Scratch::default(), None);
    (hits, counters.prim_lanes_linear)
}

/// How many times as many pairs are tested if rays are not in their places; hits are the same, bit by bit.
fn gained(world: &World<f32>, rays: &Rays<f32>) -> f64 {
    let ((hits, pairs), (others, more)) = (traced(world, rays), traced(world, &disordered(rays)));
    let bits = |hits: &Hits<f32>, i: usize| {
        [hits.t[i].to_bits(), hits.u[i].to_bits(), hits.v[i].to_bits(), hits.prim[i], hits.inst[i]]
    };
    let different = (0..rays.len()).find(|&i| bits(&hits, i) != bits(&others, place(i)));
    assert_eq!(different, None);
    assert!((0..rays.len()).filter(|&i| hits.is_hit(i)).count() > rays.len() / 4);
    more as f64 / pairs as f64
}

/// With directions of length one.
fn unit(mut rays: Rays<f32>) -> Rays<f32> {
    for i in 0..rays.len() {
        let dir = Vec3::from_array(rays.dir(i)).normalize().to_array();
        rays.set(i, rays.org(i), dir, 0.0, f32::INFINITY);
    }
    rays
}

fn moved(mut mesh: Mesh, map: DMat3, by: DVec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = map * *p + by);
    mesh
}

/// A fine ball, and a coarse wall behind it.
fn fine_ball(map: DMat3, by: DVec3) -> Scene {
    let corner = |x: f64, y: f64| by + DVec3::new(x, y, -3.0);
    let positions = vec![corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)];
    let wall = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    compile(vec![moved(ball(120, 240), map, by), wall])
}

#[test]
fn hits_are_those_of_rays_without_columns() {
    let flat = DMat3::from_diagonal(DVec3::new(1.0, 0.7, 0.4));
    for (map, by) in [(DMat3::IDENTITY, DVec3::ZERO), (flat, DVec3::new(30.0, -20.0, 50.0))] {
        let world = fine_ball(map, by);
        for (eye, tan) in [(DVec3::new(0.0, 0.0, 5.0), 0.21), (DVec3::new(2.0, 3.0, 4.0), 0.2)] {
            let rays = camera(by + eye, by, tan, 128);
            let gain = gained(&world, &rays);
            assert!(gain > 1.3, "{gain}");
            assert!(gained(&world, &unit(rays)) > 1.3);
        }
    }
}

#[test]
fn pictures_of_fine_meshes_are_judged_by_the_oracle() {
    let world = fine_ball(DMat3::IDENTITY, DVec3::ZERO);
    // Aside of the picture's middle, from near by, and through an edge of the ball.
    for (eye, target, tan) in
        [(DVec3::new(0.0, 0.0, 5.0), DVec3::new(0.4, 0.3, 0.0), 0.3), (DVec3::Z * 1.4, DVec3::ZERO, 0.4)]
    {
        assert_eq!(differences(&world, &camera(eye, target, tan, 64)), (0, 0));
    }
}

#[test]
fn needles_and_slabs_between_rays_are_found() {
    // Stripes much thinner than pixels are wide, and long ones: what is seen of them is seen by few rays, but it is seen.
    let mut stripes = Mesh::default();
    for i in 0..4000u32 {
        let (x, size) = (f64::from(i) * 0.0005 - 1.0, if i % 9 == 0 { 1.0 } else { 0.002 });
        let (y, z) = (f64::from(i % 61) / 30.0 - 1.0, f64::from(i % 7) * 0.01);
        let first = stripes.positions.len() as u32;
        let points = [DVec3::new(x, y, z), DVec3::new(x + 2e-4, y + size, z), DVec3::new(x + 1e-4, y - size, z + 0.01)];
        stripes.positions.extend(points.map(|p| p.as_vec3().as_dvec3()));
        stripes.triangles.push([first, first + 1, first + 2]);
    }
    let world = compile(vec![stripes]);
    for eye in [DVec3::new(0.1, 0.2, 6.0), DVec3::new(3.0, 1.0, 5.0)] {
        let rays = camera(eye, DVec3::ZERO, 0.18, 64);
        let ((hits, _), (others, _)) = (traced(&world, &rays), traced(&world, &disordered(&rays)));
        assert!((0..rays.len()).all(|i| hits.t[i].to_bits() == others.t[place(i)].to_bits()));
        assert!((0..rays.len()).filter(|&i| hits.is_hit(i)).count() > 100);
        assert_eq!(differences(&world, &rays), (0, 0));
    }
}

#[test]
fn instances_lose_nothing_either() {
    let mut d = Description::new("instances");
    // Dust much finer than pixels, but not so much of it that streams take it, and a wall.
    let (mut r, mut dust) = (Random(7), Mesh::default());
    for i in 0..6000u32 {
        let centre = r.in_cube() * 2.0;
        dust.positions.extend([(); 3].map(|()| (centre + r.in_cube() * 0.006).as_vec3().as_dvec3()));
        dust.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let corner = |x: f64, y: f64| DVec3::new(x, y, -3.0);
    let positions = vec![corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)];
    let wall = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    for (i, mesh) in [dust, wall].into_iter().enumerate() {
        d.meshes.push(Arc::new(mesh));
        let items = vec![item(ItemKind::Mesh(i as u32), DAffine3::IDENTITY)];
        d.groups.push(Group { name: format!("mesh {i}"), items });
    }
    let map = |x: f64| {
        let scale = DVec3::new(1.0, 0.8, -1.2);
        DAffine3::from_scale_rotation_translation(scale, glam::DQuat::from_rotation_y(x), DVec3::X * x)
    };
    d.groups[0].items = [-0.3, 0.2].map(|x| item(ItemKind::Instance(1), map(x))).to_vec();
    d.groups[0].items.push(item(ItemKind::Instance(2), DAffine3::IDENTITY));
    let world = World::compile(&d, Preset::Balanced).unwrap();
    let rays = camera(DVec3::new(0.5, 1.0, 6.0), DVec3::ZERO, 0.3, 128);
    let gain = gained(&world, &rays);
    assert!(gain > 1.3, "{gain}");
    let (hits, _) = traced(&world, &rays);
    let dusty = (0..rays.len()).filter(|&i| hits.is_hit(i) && hits.inst[i] < 2).count();
    assert!(dusty > 50, "{dusty}");
}
