//! The tile's own arithmetic decides per ray and triangle: another tree over the same triangles, in which they are met in another
//! order and beside other ones, must give the same bits.

use crate::common;
use crate::tile_support;

use std::sync::Arc;

use common::{Random, ball, item, soup};
use glam::{DAffine3, DVec3};
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::scene::description::{Description, ItemKind};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{BuildSettings, Preset, World};
use lanecast::trace::Scratch;
use tile_support::{camera, compile, differences, find, mirrored, shadows};

/// One world with three trees.
fn worlds(meshes: &[Mesh]) -> [World<f32>; 3] {
    let mut d = Description::new("meshes");
    for (i, mesh) in meshes.iter().enumerate() {
        d.meshes.push(Arc::new(mesh.clone()));
        d.groups[0].items.push(item(ItemKind::Mesh(i as u32), DAffine3::IDENTITY));
    }
    let of = |preset, leaf| World::compile(&d, BuildSettings { preset, leaf }).unwrap();
    [of(Preset::Balanced, 8), of(Preset::Fast, 8), of(Preset::Balanced, 1)]
}

/// t, u, v, primitive and instance of every ray, as bits; whether it hits anything.
fn answers(world: &World<f32>, rays: &Rays<f32>) -> (Vec<[u32; 5]>, Vec<u8>) {
    let (mut hits, mut any, mut scratch) = (Hits::default(), Vec::new(), Scratch::default());
    find("tile").intersect(world, rays, &mut hits, &mut scratch, None);
    find("tile").occluded(world, rays, &mut any, &mut scratch, None);
    let bits = |i: usize| [hits.t[i].to_bits(), hits.u[i].to_bits(), hits.v[i].to_bits(), hits.prim[i], hits.inst[i]];
    ((0..rays.len()).map(bits).collect(), any)
}

/// Rays from `eye` to vertices and edges of a mesh, neighbours in the mesh side by side.
fn at_edges(mesh: &Mesh, eye: DVec3, r: &mut Random) -> Rays<f32> {
    let mut rays = Rays::new(4096);
    for i in 0..rays.len() {
        let corner = mesh.triangles[i / 4 % mesh.triangles.len()].map(|v| mesh.positions[v as usize]);
        let along = if i % 4 == 0 { 0.0 } else { r.unit() };
        let target = corner[i % 3].lerp(corner[(i + 1) % 3], along);
        rays.set(i, eye.as_vec3().to_array(), (target - eye).as_vec3().to_array(), 0.0, f32::INFINITY);
    }
    rays
}

#[test]
fn another_tree_gives_the_same_bits() {
    let mut r = Random(3);
    let fine = ball(120, 160);
    let room = {
        let mut walls = ball(2, 4);
        walls.positions.iter_mut().for_each(|p| *p *= 12.0);
        vec![walls, soup(800, &mut r)]
    };
    let twice = soup(3000, &mut r);
    for (name, meshes) in [
        ("soup", vec![soup(6000, &mut r)]),
        ("every triangle twice", vec![twice.clone(), twice]),
        ("fine ball", vec![fine]),
        ("much finer ball", vec![ball(300, 400)]),
        ("room", room),
    ] {
        let worlds = worlds(&meshes);
        let nodes = worlds.each_ref().map(|world| world.first_object().tree.nodes.len());
        assert!(nodes[0] < nodes[2], "{name}: {nodes:?}");
        let (mut rays, mut hits, mut differ) = (0, 0, [0; 2]);
        for case in 0..16 {
            let eye = r.in_cube() * [2.5, 8.0][case % 2];
            let primary = match case % 4 {
                3 => at_edges(&meshes[0], eye, &mut r),
                _ => camera(eye, r.in_cube(), [0.1, 0.5, 1.0][case % 3], 96),
            };
            let light = 6.0 * r.in_cube();
            let mut parallel = primary.clone();
            let dir = primary.dir(0);
            for i in 0..parallel.len() {
                let org = std::array::from_fn(|a| primary.org(i)[a] + 2.0 * (primary.dir(i)[a] - dir[a]));
                parallel.set(i, org, dir, 0.0, f32::INFINITY);
            }
            let shadow = shadows(&worlds[0], &primary, light, 1.0, 1e-4);
            for rays_of in [mirrored(&worlds[0], &primary), shadow, parallel, primary] {
                let wanted = answers(&worlds[0], &rays_of);
                rays += rays_of.live_count();
                hits += wanted.0.iter().filter(|hit| hit[3] != u32::MAX).count();
                for world in &worlds[1..] {
                    let (closest, any) = answers(world, &rays_of);
                    differ[0] += closest.iter().zip(&wanted.0).filter(|(x, y)| x != y).count();
                    differ[1] += any.iter().zip(&wanted.1).filter(|(x, y)| x != y).count();
                }
            }
        }
        println!("{name}: {rays} rays, {hits} hits; {differ:?} answers differ");
        assert!(hits > 50_000, "{name}: {hits}");
        assert_eq!(differ, [0, 0], "{name}");
    }
}

/// Where triangles are much smaller than the distance of rays, tiles leave their rays to the stream kernel; where they are not, pairs of
/// a triangle and a group are counted.
#[test]
fn tiles_leave_triangles_that_their_rays_do_not_share() {
    let [world, ..] = worlds(&[ball(400, 500)]);
    let counted = |distance: f64| {
        let rays = camera(DVec3::new(0.0, 0.3, distance), DVec3::ZERO, 0.5, 96);
        let (mut hits, mut scratch, mut counters) = (Hits::default(), Scratch::default(), Counters::default());
        find("tile").intersect(&world, &rays, &mut hits, &mut scratch, Some(&mut counters));
        (counters.prim_lanes_linear, hits.hit_count())
    };
    let (far, near) = (counted(8.0), counted(1.6));
    println!("pairs, hits: {far:?} far away, {near:?} nearby");
    assert!(far.1 > 400 && near.1 > 4000, "{far:?} {near:?}");
    assert!(far.0 == 0 && near.0 > 0, "{far:?} {near:?}");
}

/// Rays of one origin, or to one light, in no order: groups lie all over each other, and no pair of a triangle and a group is tested.
#[test]
fn tiles_leave_rays_in_no_order() {
    let scene = compile(vec![ball(60, 80), soup(300, &mut Random(3))]);
    let mut r = Random(11);
    let primary = camera(DVec3::new(0.3, 0.4, 2.5), DVec3::ZERO, 0.6, 64);
    let shadow = shadows(&scene, &primary, DVec3::new(3.0, 4.0, 1.0), 1.0, 1e-4);
    for (ordered, any) in [(&primary, false), (&shadow, true)] {
        let mut places: Vec<usize> = (0..ordered.len()).collect();
        (1..places.len()).rev().for_each(|i| places.swap(i, r.below(i + 1)));
        let mut shuffled = Rays::new(places.len());
        for (i, &k) in places.iter().enumerate() {
            shuffled.set(i, ordered.org(k), ordered.dir(k), ordered.t_min[k], ordered.t_max[k]);
        }
        let counted = |rays: &Rays<f32>| {
            let (mut scratch, mut counters) = (Scratch::default(), Counters::default());
            match any {
                false => find("tile").intersect(&scene, rays, &mut Hits::default(), &mut scratch, Some(&mut counters)),
                true => find("tile").occluded(&scene, rays, &mut Vec::new(), &mut scratch, Some(&mut counters)),
            }
            counters.prim_lanes_linear
        };
        assert!(counted(ordered) > 0 && counted(&shuffled) == 0, "any {any}");
        assert_eq!(differences(&scene, &shuffled), (0, 0), "any {any}");
    }
}
