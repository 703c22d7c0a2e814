//! The oracle's closest hits: trees against brute force, ties, transforms, degenerate and pathological input.

use crate::oracle_support;

use glam::{DAffine3, DQuat, DVec3};
use lanecast::reference::{Oracle, OracleHit, Search};
use lanecast::scene::assembly::Assembly;
use lanecast::scene::description::{Item, ItemKind, Shape};
use lanecast::scene::mesh::Mesh;
use oracle_support::{Random, assembly, mesh_scene, read_ply, shape, soup};

const INF: f64 = f64::INFINITY;

fn shoot(oracle: &Oracle, org: DVec3, dir: DVec3) -> Option<OracleHit> {
    oracle.closest(org, dir, 0.0, INF)
}

/// Same answers from trees and brute force over `count` random rays around `centre`; the number of hits.
fn compare_searches(assembly: &Assembly, random: &mut Random, centre: DVec3, radius: f64, count: usize) -> usize {
    let brute = Oracle::with_search(assembly, Search::Brute);
    let tree = Oracle::with_search(assembly, Search::Tree);
    let mut hits = 0;
    for _ in 0..count {
        let org = centre + 2.0 * radius * random.vector();
        let dir = centre + radius * random.vector() - org;
        let want = shoot(&brute, org, dir);
        assert_eq!(shoot(&tree, org, dir), want, "{org} {dir}");
        hits += usize::from(want.is_some());
    }
    hits
}

#[test]
fn trees_answer_like_brute_force() {
    let mut random = Random(1);
    let mesh = mesh_scene(soup(&mut random, 3000, 0.1));
    assert!(compare_searches(&mesh, &mut random, DVec3::ZERO, 1.0, 2000) > 500);
    // Instances of a mesh and shapes, turned and stretched, over a ground plane.
    let shapes = [Shape::Sphere, Shape::Disc, Shape::Cuboid, Shape::Cylinder, Shape::cone(0.3)];
    let mut group: Vec<_> =
        shapes.iter().map(|&s| shape(s, DAffine3::from_translation(2.0 * random.vector()))).collect();
    group.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
    let mut root = vec![shape(Shape::HalfSpace, DAffine3::from_translation(DVec3::Z * -4.0))];
    for _ in 0..40 {
        let turn = DQuat::from_scaled_axis(3.0 * random.vector());
        let scale = DVec3::splat(0.6) + 0.5 * random.vector();
        let transform = DAffine3::from_scale_rotation_translation(scale, turn, 6.0 * random.vector());
        root.push(Item { transform, material: None, kind: ItemKind::Instance(1) });
    }
    let scene = assembly(vec![soup(&mut random, 50, 0.5)], vec![root, group]);
    assert!(compare_searches(&scene, &mut random, DVec3::ZERO, 6.0, 3000) > 1000);
}

#[test]
fn ties_go_to_the_smaller_instance_then_primitive() {
    let quad = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        triangles: vec![[0, 0, 1], [0, 1, 2], [0, 1, 2], [1, 2, 0]],
        groups: vec![],
        ..Mesh::default()
    };
    let item = |kind| Item { transform: DAffine3::IDENTITY, material: None, kind };
    let root = vec![item(ItemKind::Instance(1)), item(ItemKind::Instance(1)), item(ItemKind::Instance(1))];
    let scene = assembly(vec![quad], vec![root, vec![item(ItemKind::Mesh(0))]]);
    for search in [Search::Brute, Search::Tree] {
        let hit = shoot(&Oracle::with_search(&scene, search), DVec3::new(0.25, 0.25, 2.0), DVec3::NEG_Z).unwrap();
        assert_eq!((hit.t, hit.inst, hit.prim), (2.0, 0, 1), "triangle 0 is degenerate");
        assert_eq!((hit.u, hit.v, hit.ng), (0.25, 0.25, DVec3::Z));
    }
}

#[test]
fn the_segment_is_closed_and_dead_rays_miss() {
    let oracle = Oracle::new(&assembly(vec![], vec![vec![shape(Shape::Sphere, DAffine3::IDENTITY)]]));
    let (org, dir) = (DVec3::X * -3.0, DVec3::X);
    let t = |t_min, t_max| oracle.closest(org, dir, t_min, t_max).map(|h| h.t);
    assert_eq!(t(0.0, 2.0), Some(2.0));
    assert_eq!(t(2.0, INF), Some(2.0));
    assert_eq!(t(0.0, 2.0f64.next_down()), None);
    assert_eq!(t(2.0f64.next_up(), INF), Some(4.0));
    assert_eq!(t(4.0f64.next_up(), INF), None);
    assert_eq!(t(3.0, 1.0), None);
    assert_eq!(t(f64::NAN, INF), None);
    assert_eq!(t(0.0, f64::NAN), None);
    for bad in [f64::NAN, INF, -INF] {
        for axis in 0..3 {
            let (mut o, mut d) = (org, dir);
            o[axis] = bad;
            d[axis] = bad;
            assert_eq!(shoot(&oracle, o, dir), None);
            assert_eq!(shoot(&oracle, org, d), None);
        }
    }
    assert_eq!(shoot(&oracle, org, DVec3::ZERO), None);
}

#[test]
fn an_ellipsoid_is_a_stretched_sphere() {
    // x^2/a^2 + y^2/b^2 + z^2/c^2 = 1 solved without the map; the normal is the gradient.
    let (axes, centre) = (DVec3::new(1000.0, 3.0, 0.2), DVec3::new(10.0, -20.0, 30.0));
    let place = DAffine3::from_scale_rotation_translation(axes, DQuat::IDENTITY, centre);
    let half = DAffine3::from_translation(centre * 0.5);
    let inner = vec![shape(Shape::Sphere, half.inverse() * place)];
    let instance = Item { transform: half, material: None, kind: ItemKind::Instance(1) };
    let oracle = Oracle::new(&assembly(vec![], vec![vec![instance], inner]));
    let mut random = Random(3);
    let mut hits = 0;
    for scale in [1e-3, 1.0, 1e3].into_iter().cycle().take(3000) {
        let org = centre + 3.0 * axes * random.vector();
        let dir = scale * (axes * random.vector() - (org - centre));
        let (o, d) = ((org - centre) / axes, dir / axes);
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
        let disc = b * b - a * c;
        let Some(hit) = shoot(&oracle, org, dir) else {
            assert!(disc < 1e-9 * a || c < 0.0 && -b + disc.sqrt() < 0.0, "{org} {dir}");
            continue;
        };
        let roots = [(-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a];
        let want = roots.into_iter().find(|&t| t >= 0.0).unwrap();
        assert!((hit.t - want).abs() <= 1e-9 * want.max(1.0 / scale), "{} {want}", hit.t);
        let gradient = (org + want * dir - centre) / (axes * axes);
        assert!(hit.ng.normalize().dot(gradient.normalize()) > 1.0 - 1e-9);
        hits += 1;
    }
    assert!(hits > 1500, "{hits}");
}

#[test]
fn extreme_and_coinciding_geometry_is_found_by_trees() {
    let mut random = Random(4);
    for size in [1e-41, 1e-20, 1e20, 3.4e38] {
        let mut mesh = soup(&mut random, 300, 0.3);
        mesh.positions.iter_mut().for_each(|p| *p = (*p * size).as_vec3().as_dvec3());
        let hits = compare_searches(&mesh_scene(mesh), &mut random, DVec3::ZERO, size, 500);
        assert!(hits > 50, "{size}: {hits}");
    }
    // One triangle 5000 times, and one that is a point, a NaN, and infinite.
    let mut mesh = soup(&mut random, 1, 1.0);
    mesh.triangles = vec![[0, 1, 2]; 5000];
    mesh.positions.extend([DVec3::NAN, DVec3::splat(INF)]);
    mesh.triangles.extend([[0, 0, 0], [0, 1, 3], [0, 1, 4]]);
    let scene = mesh_scene(mesh);
    assert!(compare_searches(&scene, &mut random, DVec3::ZERO, 1.0, 300) > 5);
    // Nothing at all, and shapes flattened to nothing.
    assert_eq!(shoot(&Oracle::new(&Assembly::default()), DVec3::ZERO, DVec3::X), None);
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    let flat = assembly(vec![], vec![vec![shape(Shape::Sphere, flat)]]);
    assert_eq!(shoot(&Oracle::new(&flat), DVec3::X * -3.0, DVec3::X), None);
}

#[test]
fn pathological_files_are_answered_alike_by_trees() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes/pathological");
    let Ok(files) = std::fs::read_dir(folder) else {
        println!("SKIPPED: no pathological meshes in {folder}");
        return;
    };
    for file in files.map(|f| f.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "ply")) {
        let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
        let mesh = read_ply(&std::fs::read(&file).unwrap());
        let middle = |i: usize| mesh.triangles[i].iter().map(|&v| mesh.positions[v as usize] / 3.0).sum::<DVec3>();
        let scene = mesh_scene(mesh.clone());
        let (brute, tree) = (Oracle::with_search(&scene, Search::Brute), Oracle::with_search(&scene, Search::Tree));
        let mut random = Random(5);
        let (mut hits, mut targets) = (0, 0);
        for _ in 0..(mesh.triangles.len().min(1) * 60) {
            let i = random.bits() as usize % mesh.triangles.len();
            let [a, b, c] = mesh.corners(i);
            let size = (b - a).length().max((c - a).length());
            let org = middle(i) + 2.0 * size * random.vector();
            let dir = middle(i) - org;
            let want = shoot(&brute, org, dir);
            assert_eq!(shoot(&tree, org, dir), want, "{name} {org} {dir}");
            hits += usize::from(want.is_some());
            targets += usize::from((b - a).cross(c - a).length() > 1e-9 * size * size);
        }
        assert!(hits >= targets, "{name}: {hits} hits of {targets} proper triangles aimed at");
    }
}
