//! Meshes that are traced as one: hits have the numbers of their placements, which the oracle knows by itself, in every engine and
//! on every way by which answers are written.

use crate::common;
use crate::tile_support;

use std::sync::Arc;

use common::{Random, ball, item, soup};
use glam::{DAffine3, DVec3};
use lanecast::camera::{Camera, PixelRect, SubPixel, Tiling, aim_tile, fill_tile};
use lanecast::measure::answers::Answers;
use lanecast::measure::truth;
use lanecast::ray::{Hits, Pencil, Rays};
use lanecast::reference::MARGIN_FACTOR;
use lanecast::scene::description::{CameraDescription, Description, Group, ItemKind, Projection};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Scratch, engine};
use tile_support::{Scene, bits, camera, differences, explained, find, mirrored, shadows};

/// Ten meshes placed once, a square placed forty times, and, if `others`, a ball placed six times that is too large to be
/// copied; placed by turns.
fn described(seed: u64, others: bool) -> Description {
    let mut r = Random(seed);
    let mut d = Description::new("joined");
    d.joins = true;
    let square = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let singles = (0..10).map(|i| if i % 2 == 0 { soup(40, &mut r) } else { ball(5 + i, 9) });
    let meshes: Vec<Mesh> = [square, ball(30, 40)].into_iter().chain(singles).collect();
    for (i, mesh) in meshes.into_iter().enumerate() {
        d.meshes.push(Arc::new(mesh));
        let items = vec![item(ItemKind::Mesh(i as u32), DAffine3::IDENTITY)];
        d.groups.push(Group { name: format!("mesh {i}"), items });
    }
    let mut place = |mesh: u32, size: f64| {
        let mut map = r.affine(size);
        map.translation = r.in_cube() * 4.0;
        // One stands where it was made.
        let map = if mesh == 2 { DAffine3::IDENTITY } else { map };
        d.groups[0].items.push(item(ItemKind::Instance(mesh + 1), map));
    };
    for i in 0..40 {
        place(0, 0.6);
        if i % 4 == 1 {
            place(2 + i / 4, 0.6);
        }
        if others && i % 7 == 0 {
            place(1, 0.4);
        }
    }
    d
}

/// Rays of every kind that the tile engine has a way for: an eye's, to a light, from mirrors, one by one.
fn kinds(world: &World<f32>, r: &mut Random) -> Vec<Rays<f32>> {
    let primary = camera(r.in_cube() * 9.0, r.in_cube(), 0.6, 32);
    let shadow = shadows(world, &primary, r.in_cube() * 8.0, 1.0, 1e-4);
    let behind = mirrored(world, &primary);
    vec![primary, shadow, behind, common::rays(500, r.bits())]
}

#[test]
fn hits_have_the_numbers_of_their_placements() {
    for (seed, others) in [(1, false), (2, true)] {
        let description = described(seed, others);
        let scene = Scene::new(World::compile(&description, Preset::Balanced).unwrap());
        let (stats, mut r) = (scene.stats(), Random(seed));
        assert_eq!((stats.joined, stats.instances), (50, if others { 56 } else { 50 }));
        assert_eq!((scene.is_single_object(), scene.instances.len()), (!others, if others { 7 } else { 1 }));
        let (mut scratch, mut seen) = (Scratch::default(), vec![0; stats.instances as usize]);
        for rays in (0..6).flat_map(|_| kinds(&scene, &mut r)) {
            assert_eq!(differences(&scene, &rays), (0, 0), "seed {seed}");
            let (mut hits, mut others) = (Hits::default(), Hits::default());
            find("scalar").intersect(&scene, &rays, &mut hits, &mut scratch, None);
            for engine in ["packet8", "stream"] {
                find(engine).intersect(&scene, &rays, &mut others, &mut scratch, None);
                assert!((0..rays.len()).all(|i| bits(&hits, i) == bits(&others, i)), "{engine}, seed {seed}");
            }
            (0..rays.len()).filter(|&i| hits.is_hit(i)).for_each(|i| seen[hits.inst[i] as usize] += 1);
            let (batches, own) = (std::slice::from_ref(&rays), Answers::Closest(vec![hits]));
            let counts = truth::judge(&scene.oracle, MARGIN_FACTOR, batches, &own, 1);
            assert_eq!(counts.unexplained, 0, "seed {seed}: {:?}", counts.samples);
        }
        // One or two are hidden.
        let found = seen.iter().filter(|&&count| count > 0).count();
        assert!(found * 20 >= seen.len() * 19, "many are never hit: {seen:?}");
    }
}

/// Rays that the tile engine makes itself.
#[test]
fn made_rays_hit_what_is_called_the_same() {
    for others in [false, true] {
        let scene = Scene::new(World::compile(&described(5, others), Preset::Balanced).unwrap());
        let projection = Projection::Perspective { theta: 0.8 };
        let (eye, look_at, up) = (DVec3::new(9.0, 7.0, 5.0), DVec3::ZERO, DVec3::Z);
        let camera = Camera::new(&CameraDescription { name: "eye".into(), eye, look_at, up, projection }, 1.0).unwrap();
        let (size, mut made) = (128, 0);
        let (tiling, rect) = (Tiling::new(size, size, 32).unwrap(), PixelRect { x0: 0, y0: 0, x1: size, y1: size });
        let (mut pencil, mut rays, mut scratch) = (Pencil::default(), Rays::new(0), Scratch::default());
        for tile in 0..tiling.tiles() {
            let (mut want, mut got) = (Hits::new(0), Hits::new(0));
            assert!(aim_tile(&camera, &tiling, tile, rect, SubPixel::Anchor, &mut pencil));
            fill_tile(&camera, &tiling, tile, rect, SubPixel::Anchor, &mut rays);
            if find("tile").intersect_pencil(&scene, &pencil, &mut got, &mut scratch, None) {
                made += got.hit_count();
                find("scalar").intersect(&scene, &rays, &mut want, &mut scratch, None);
                explained(&scene, &rays, &Answers::Closest(vec![want]), &Answers::Closest(vec![got]));
            }
        }
        assert!(made > 1000, "{made}");
    }
}

/// In f64 a hit is where it was, on what it was on, however it is traced.
#[test]
fn nothing_moves() {
    let mut description = described(7, true);
    let joined = World::<f64>::compile(&description, Preset::Balanced).unwrap();
    description.joins = false;
    let apart = World::<f64>::compile(&description, Preset::Balanced).unwrap();
    assert_eq!((joined.stats().joined, apart.stats().joined), (50, 0));
    let (rays, mut scratch) = (common::rays::<f64>(6000, 3), Scratch::default());
    let mut hits = [Hits::default(), Hits::default()];
    for (world, hits) in [&joined, &apart].into_iter().zip(&mut hits) {
        engine::<f64>("stream").unwrap().intersect(world, &rays, hits, &mut scratch, None);
    }
    let [one, other] = &hits;
    let mut found = 0;
    for i in (0..rays.len()).filter(|&i| one.is_hit(i) || other.is_hit(i)) {
        assert_eq!((one.prim[i], one.inst[i]), (other.prim[i], other.inst[i]), "ray {i}");
        assert!((one.t[i] - other.t[i]).abs() <= 1e-9 * other.t[i].abs().max(1.0), "ray {i}");
        assert!((one.u[i] - other.u[i]).abs() + (one.v[i] - other.v[i]).abs() < 1e-7, "ray {i}");
        found += 1;
    }
    assert!(found > 500, "{found}");
}

/// Of equal triangles the one with the smaller number is hit.
#[test]
fn ties_go_to_the_smaller_instance() {
    let (mut r, mut d) = (Random(78), Description::new("ties"));
    d.joins = true;
    let (mesh, map) = (Arc::new(soup(300, &mut r)), r.affine(0.5));
    for i in 0..4 {
        d.meshes.push(mesh.clone());
        d.groups.push(Group { name: String::new(), items: vec![item(ItemKind::Mesh(i), DAffine3::IDENTITY)] });
        d.groups[0].items.push(item(ItemKind::Instance(i + 1), map));
    }
    let scene = Scene::new(World::compile(&d, Preset::Balanced).unwrap());
    assert!(scene.is_single_object() && scene.stats().joined == 4);
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    let rays = camera(r.direction() * 9.0, map.translation, 0.15, 64);
    assert_eq!(differences(&scene, &rays), (0, 0));
    for engine in ["scalar", "stream", "tile"] {
        find(engine).intersect(&scene, &rays, &mut hits, &mut scratch, None);
        assert!(hits.hit_count() > 500, "{engine}: {}", hits.hit_count());
        assert!((0..rays.len()).all(|i| !hits.is_hit(i) || hits.inst[i] == 0), "{engine}: a larger instance is hit");
    }
}
