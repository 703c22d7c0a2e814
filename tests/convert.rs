//! Solids as meshes: closed and manifold whatever the solid, as near to it as was asked for, sharp where it is sharp.

mod common;
mod manifold;
mod solid_support;

use std::f64::consts::PI;

use common::Random;
use glam::{DAffine3, DQuat, DVec3};
use lanecast::convert::nearby::from_triangle;
use lanecast::convert::{Fineness, Solids, Surface, Voxels, Wanted, Watch, surface};
use lanecast::reference::Oracle;
use lanecast::scene::description::{Description, ItemKind, Shape};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::solids::{self, NodeKind, Placed, SolidNode, SolidTree};
use manifold::manifold;
use solid_support::{KINDS, cuboid, grow, scene};

const MEMORY: u64 = 1 << 30;

fn converted(description: &Description, tolerance: f64, cells: Option<u32>) -> Surface {
    let solids = Solids::new(description, &[]).unwrap();
    surface(&solids, &Fineness { tolerance, cells, memory: MEMORY }, &Watch::NONE).unwrap()
}

/// Least distance from the solid's surface along some lines through a point, or just beside it, by the oracle.
fn distance(oracle: &Oracle, point: DVec3, reach: f64) -> f64 {
    let ways = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::new(1.0, -1.0, 1.0), DVec3::new(-1.0, 1.0, 1.0)];
    let beside = 1e-3 * reach;
    let steps = [DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut least = reach;
    for step in steps {
        for dir in ways.map(DVec3::normalize).into_iter().flat_map(|way| [way, -way]) {
            let mut from = 0.0;
            // Every boundary on the way, one after the other.
            while let Some(hit) = oracle.closest(point + step * beside - dir * reach, dir, from, 2.0 * reach) {
                least = least.min((hit.t - reach).abs() + beside * step.length());
                from = hit.t + 1e-3 * reach;
            }
        }
        // What a ray just misses, the next one meets.
        if least < 0.1 * reach {
            break;
        }
    }
    least
}

fn one(placed: Placed) -> Description {
    let mut tree = SolidTree::new("one");
    tree.solid(placed);
    scene(tree)
}

fn turned(placed: Placed) -> Placed {
    let turn = DAffine3::from_rotation_translation(
        DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.6),
        DVec3::new(0.3, -0.2, 0.1),
    );
    Placed { transform: turn * placed.transform, ..placed }
}

fn tree(name: &str, op: fn(Vec<u32>) -> NodeKind, operands: Vec<Placed>) -> Description {
    let mut tree = SolidTree::new(name);
    let operands = operands.into_iter().map(|placed| tree.solid(placed)).collect();
    tree.op(op(operands));
    scene(tree)
}

/// Points of the solid's surface that rays from all around meet, by the oracle.
fn points_of(oracle: &Oracle, middle: DVec3, size: f64, count: usize) -> Vec<DVec3> {
    let mut r = Random(11);
    let mut ray = || {
        let org = middle + r.direction() * 2.0 * size;
        let dir = (middle + r.in_cube() * 0.5 * size - org).normalize();
        oracle.closest(org, dir, 0.0, 1e9).map(|hit| org + dir * hit.t)
    };
    (0..count).filter_map(|_| ray()).collect()
}

/// Distance of a point from the nearest triangle, all of them asked.
fn from_mesh(mesh: &Mesh, point: DVec3) -> f64 {
    (0..mesh.triangles.len()).map(|i| from_triangle(point, mesh.corners(i))).fold(f64::INFINITY, f64::min)
}

/// Solids with their volumes, areas and Euler characteristics; distances both ways by the oracle.
#[test]
fn closed_forms() {
    let (z, tolerance) = (DVec3::Z, 0.006);
    let cube = || cuboid(DVec3::splat(-1.0), DVec3::ONE);
    let cone = 2f64.sqrt() * PI + PI;
    let hole = |x: f64| solids::cylinder(DVec3::new(x, 0.0, -1.0), DVec3::new(x, 0.0, 1.0), 0.3).unwrap();
    let plate = vec![cuboid(DVec3::new(-2.0, -0.6, -0.1), DVec3::new(2.0, 0.6, 0.1)), hole(-1.2), hole(0.1), hole(1.2)];
    // A ball that leaves the cube's twelve edges; caps of it lie outside.
    let (r, h) = (1.2f64, 0.2);
    let frame = 8.0 - (4.0 / 3.0 * PI * r * r * r - 6.0 * PI * h * h * (3.0 * r - h) / 3.0);
    let frame_area = 24.0 - 6.0 * PI * (r * r - 1.0) + 4.0 * PI * r * r - 12.0 * PI * r * h;
    let ball = |r| solids::ball(DVec3::ZERO, r).unwrap();
    for (what, description, volume, area, euler) in [
        ("ball", one(ball(1.0)), 4.0 / 3.0 * PI, 4.0 * PI, 2),
        ("cube", one(cube()), 8.0, 24.0, 2),
        ("turned cube", one(turned(cube())), 8.0, 24.0, 2),
        ("sheet", one(turned(cuboid(DVec3::new(-1.0, -1.0, -0.01), DVec3::new(1.0, 1.0, 0.01)))), 0.08, 8.16, 2),
        ("cylinder", one(turned(solids::cylinder(-z, z, 0.8).unwrap())), 1.28 * PI, 4.48 * PI, 2),
        ("cone", one(turned(solids::cone(DVec3::ZERO, z, 1.0, 0.0).unwrap())), PI / 3.0, cone, 2),
        ("torus", one(turned(solids::torus(DVec3::ZERO, z, 1.0, 0.3).unwrap())), 0.18 * PI * PI, 1.2 * PI * PI, 0),
        ("frame", tree("frame", NodeKind::Difference, vec![turned(cube()), turned(ball(r))]), frame, frame_area, -8),
        (
            "plate",
            tree("plate", NodeKind::Difference, plate.into_iter().map(turned).collect()),
            0.96 - 3.0 * 0.018 * PI,
            2.0 * (4.8 - 0.27 * PI) + 0.2 * (10.4 + 1.8 * PI),
            -4,
        ),
    ] {
        let found = converted(&description, tolerance, None);
        assert_eq!((manifold(&found.mesh, what), found.topology.euler), (euler, euler), "{what}");
        assert!(found.distances.largest() <= tolerance, "{what}: {:?} on {:?}", found.distances, found.grid);
        let off = (found.mesh.volume() - volume).abs();
        assert!(off <= 0.5 * tolerance * area, "{what}: volume is off by {off}");
        let off = (found.mesh.area() / area - 1.0).abs();
        assert!(off <= 0.01, "{what}: area {} instead of {area}", found.mesh.area());
        let solids = Solids::new(&description, &[]).unwrap();
        let oracle = Oracle::new(&solids.world.assembly);
        for p in found.mesh.positions.iter().step_by(3) {
            let away = distance(&oracle, *p, 0.1);
            assert!(away <= tolerance, "{what}: {p} of the mesh is {away} away");
        }
        let (middle, size) = (0.5 * (solids.lo + solids.hi), (solids.hi - solids.lo).length());
        for p in points_of(&oracle, middle, size, 300) {
            let away = from_mesh(&found.mesh, p);
            assert!(away <= tolerance, "{what}: {p} of the solid is {away} away");
        }
    }
}

/// Cubes in any position, on grids of which no cell knows of its corners: all corners, no edge cut.
#[test]
fn cubes_keep_their_corners_and_edges() {
    let mut r = Random(3);
    for number in 0..24 {
        let turn = if number == 0 { DQuat::IDENTITY } else { DQuat::from_axis_angle(r.direction(), 3.0 * r.unit()) };
        let transform = DAffine3::from_rotation_translation(turn, r.in_cube());
        let to_local = transform.inverse();
        let cube = Placed { transform, ..cuboid(DVec3::splat(-1.0), DVec3::ONE) };
        let mesh = converted(&one(cube), 0.1, Some(10 + number % 9)).mesh;
        manifold(&mesh, "cube");
        let local: Vec<DVec3> = mesh.positions.iter().map(|p| to_local.transform_point3(*p)).collect();
        for corner in (0..8).map(|i: u8| DVec3::from_array([i & 1, i >> 1 & 1, i >> 2].map(f64::from)) * 2.0 - 1.0) {
            let least = local.iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
            assert!(least < 1e-6, "cube {number}: corner {corner} is {least} away");
        }
        for p in &local {
            let out = p.abs().max_element() - 1.0;
            assert!(out.abs() < 1e-6, "cube {number}: {p} is not on it");
        }
        let off = mesh.volume() / 8.0 - 1.0;
        assert!(off.abs() < 2e-3, "cube {number}: edges are cut, volume off by {off}");
    }
}

/// A random tree, cut to a box so that complements have bounds.
fn random(seed: u64, depth: usize) -> Description {
    let mut tree = SolidTree::new("random");
    let grown = grow(&mut tree, &mut Random(seed), depth, KINDS);
    let bound = tree.solid(cuboid(DVec3::splat(-3.1), DVec3::splat(2.9)));
    tree.op(NodeKind::Intersection(vec![grown, bound]));
    scene(tree)
}

/// Coarse grids, where all kinds of cells occur.
#[test]
fn random_trees_give_manifolds() {
    let mut made = 0;
    for (seed, cells) in (0..40u64).flat_map(|seed| [(seed, 9), (seed, 24)]) {
        let solids = Solids::new(&random(seed, 1 + (seed % 5) as usize), &[]).unwrap();
        let fineness = Fineness { tolerance: 0.1, cells: Some(cells), memory: MEMORY };
        let found = match surface(&solids, &fineness, &Watch::NONE) {
            Err(error) if error.to_string().contains("they are empty") => continue,
            found => found.unwrap(),
        };
        made += 1;
        manifold(&found.mesh, &format!("seed {seed}, {cells} cells"));
        let oracle = Oracle::new(&solids.world.assembly);
        let reach = 2.0 * found.grid.spacing;
        for p in found.mesh.positions.iter().step_by(17) {
            let away = distance(&oracle, *p, reach);
            assert!(away <= found.distances.mesh + 1e-3 * reach, "seed {seed}: {p} is {away} away");
        }
    }
    assert!(made > 60, "{made} of 80 are not empty");
}

/// Every second cube of 27.
fn lattice() -> Vec<Placed> {
    let cubes = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9]).filter(|c| c.iter().sum::<i32>() % 2 == 0);
    cubes.map(|c| DVec3::from_array(c.map(f64::from))).map(|lo| cuboid(lo, lo + 1.0)).collect()
}

/// Solids that no manifold has the shape of: their vertices are doubled.
#[test]
fn solids_that_touch() {
    let cube = |at: [f64; 3]| cuboid(DVec3::from_array(at), DVec3::from_array(at) + 1.0);
    let ball = solids::ball(DVec3::new(0.5, 0.5, 1.5), 0.5).unwrap();
    for (what, operands, volume) in [
        ("edge", vec![cube([0.0; 3]), cube([1.0, 1.0, 0.0])], 2.0),
        ("corner", vec![cube([0.0; 3]), cube([1.0; 3])], 2.0),
        ("tangent ball", vec![cube([0.0; 3]), ball.clone()], 1.0 + PI / 6.0),
        ("lattice", lattice(), 14.0),
    ] {
        for turn in [|placed: Placed| placed, turned] {
            let description = tree(what, NodeKind::Union, operands.iter().cloned().map(turn).collect());
            for cells in [7, 10, 30] {
                let mesh = converted(&description, 0.1, Some(cells)).mesh;
                manifold(&mesh, &format!("{what}, {cells} cells"));
                let off = mesh.volume() / volume - 1.0;
                assert!(cells < 30 || off.abs() < 0.01, "{what}: volume off by {off}");
            }
        }
    }
    let hollow = tree("hollow", NodeKind::Difference, vec![turned(cube([0.0; 3])), turned(ball)]);
    manifold(&converted(&hollow, 0.02, None).mesh, "a ball that touches the inside of a face");
}

/// The same mesh on any number of threads.
#[test]
fn threads_change_nothing() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| converted(&random(5, 4), 0.1, Some(24)).mesh)
    };
    assert_eq!(on(1), on(3));
}

/// Overlapping and touching solids of a scene are one solid; shapes that stand alone count too.
#[test]
fn a_scene_is_one_solid() {
    let mut description = one(cuboid(DVec3::ZERO, DVec3::ONE));
    let mut add = |shape, at: DVec3, half: f64| {
        let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(half), DQuat::IDENTITY, at);
        description.groups[0].items.push(common::item(ItemKind::Shape(shape), transform));
    };
    add(Shape::Cuboid, DVec3::new(1.5, 0.5, 0.5), 0.5);
    add(Shape::Cuboid, DVec3::new(0.75, 0.5, 0.5), 0.25);
    add(Shape::Sphere, DVec3::new(5.0, 0.5, 0.5), 0.5);
    add(Shape::Disc, DVec3::new(9.0, 0.0, 0.0), 1.0);
    let solids = Solids::new(&description, &[]).unwrap();
    assert!(solids.left_out == 1 && (solids.hi.x - 5.5).abs() < 1e-6);
    let found = surface(&solids, &Fineness { tolerance: 0.01, cells: Some(60), memory: MEMORY }, &Watch::NONE).unwrap();
    assert_eq!(manifold(&found.mesh, "scene"), 4);
    let want = 2.0 + PI / 6.0;
    assert!((found.mesh.volume() - want).abs() < 0.01, "{} {want}", found.mesh.volume());
}

/// The built-in scenes' solids: closed, and rays meet the mesh where they meet the solid.
#[test]
fn rays_see_the_same_solid() {
    for (name, solid) in
        [("bolt", "plate"), ("bolt", "washer"), ("die", "first"), ("rook", "white rook"), ("bolt", "bolt")]
    {
        let description = load(&format!("builtin:{name}"), &LoadOptions::default()).unwrap();
        let solids = Solids::new(&description, &[solid.into()]).unwrap();
        let tolerance = (solids.hi - solids.lo).length() / 256.0;
        let fineness = Fineness { tolerance, cells: None, memory: MEMORY };
        let found = surface(&solids, &fineness, &Watch::NONE).unwrap();
        manifold(&found.mesh, solid);
        let (middle, size) = (0.5 * (solids.lo + solids.hi), (solids.hi - solids.lo).length());
        let near = size / 256.0;
        let meshed = {
            let mut d = Description::new("mesh");
            d.meshes.push(found.mesh.into());
            d.groups[0].items.push(common::item(ItemKind::Mesh(0), DAffine3::IDENTITY));
            lanecast::scene::assembly::Assembly::new(&d).unwrap()
        };
        let (truth, mesh) =
            (Oracle::new(&solids.world.assembly), Oracle::with_search(&meshed, lanecast::reference::Search::Tree));
        let mut r = Random(7);
        let (mut hits, mut far) = (0, 0);
        for _ in 0..3000 {
            let org = middle + r.direction() * size;
            let dir = (middle + r.in_cube() * 0.3 * size - org).normalize();
            let (a, b) = (truth.closest(org, dir, 0.0, 1e9), mesh.closest(org, dir, 0.0, 1e9));
            match (a, b) {
                (None, None) => continue,
                (Some(a), Some(b)) => {
                    hits += 1;
                    // A distance along the ray counts as it is seen from the surface.
                    let facing = a.ng.normalize().dot(dir).abs();
                    far += usize::from((a.t - b.t).abs() * facing > near);
                }
                _ => far += 1,
            }
        }
        // Rays past a silhouette or an edge see something else behind it.
        assert!(hits > 300 && far * 200 < hits, "{name} {solid}: {far} of {hits} differ");
    }
}

#[test]
fn voxels_of_a_ball_and_a_box() {
    let solids = Solids::new(&one(solids::ball(DVec3::new(1.0, 2.0, 3.0), 1.0).unwrap()), &[]).unwrap();
    let fineness = Fineness { tolerance: 0.1, cells: None, memory: MEMORY };
    let found = Voxels::new(&solids, 0.07, Wanted::Faces, &fineness, &Watch::NONE).unwrap();
    let [nx, ny, nz] = found.size;
    let flags: Vec<u8> = found.planes().flatten().collect();
    assert_eq!(flags.len(), nx * ny * nz);
    for (i, flag) in flags.iter().enumerate() {
        let at = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
        let away = (found.origin + at * found.spacing - DVec3::new(1.0, 2.0, 3.0)).length() - 1.0;
        assert!((*flag == 1) == (away < 0.0) || away.abs() < 1e-9, "{at}: {away}");
    }
    let count = flags.iter().map(|f| u64::from(*f)).sum::<u64>();
    assert_eq!(count, found.count());
    let (mesh, _) = found.mesh(&fineness).unwrap();
    assert_eq!(manifold(&mesh, "voxels of a ball"), 2);
    assert!((mesh.volume() / (count as f64 * 0.07f64.powi(3)) - 1.0).abs() < 1e-5);

    let solids = Solids::new(&one(cuboid(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.0))), &[]).unwrap();
    let found = Voxels::new(&solids, 0.5, Wanted::Faces, &fineness, &Watch::NONE).unwrap();
    assert_eq!((found.size, found.count()), ([8, 6, 4], 8 * 6 * 4));
    let (mesh, _) = found.mesh(&fineness).unwrap();
    assert_eq!((manifold(&mesh, "voxels of a box"), mesh.triangles.len()), (2, 4 * (8 * 6 + 6 * 4 + 8 * 4)));
    assert!((mesh.area() - 52.0).abs() < 1e-4 && (mesh.volume() - 24.0).abs() < 1e-4);
}

/// Voxels that touch at edges and corners.
#[test]
fn voxels_of_a_lattice() {
    let solids = Solids::new(&tree("lattice", NodeKind::Union, lattice()), &[]).unwrap();
    let fineness = Fineness { tolerance: 0.1, cells: None, memory: MEMORY };
    let found = Voxels::new(&solids, 1.0, Wanted::Faces, &fineness, &Watch::NONE).unwrap();
    assert_eq!(found.count(), 14);
    let (mesh, topology) = found.mesh(&fineness).unwrap();
    manifold(&mesh, "voxels of a lattice");
    assert!((mesh.volume() - 14.0).abs() < 1e-4 && (mesh.area() - 84.0).abs() < 1e-3, "{topology:?}");
}

#[test]
fn what_cannot_be_converted_is_refused() {
    let refused =
        |description: &Description, names: &[String]| Solids::new(description, names).unwrap_err().to_string();
    let half = one(solids::half_space(DVec3::Z, 0.0).unwrap());
    assert!(refused(&half, &[]).contains("has no bounds"));
    let mut tree = SolidTree::new("outside");
    let ball = tree.solid(solids::ball(DVec3::ZERO, 1.0).unwrap());
    tree.add(SolidNode { transform: DAffine3::IDENTITY, material: None, kind: NodeKind::Complement(ball) });
    assert!(refused(&scene(tree), &[]).contains("has no bounds"));
    let mut empty = Description::new("empty");
    assert!(refused(&empty, &[]).contains("nothing in the scene is a solid"));
    empty.groups[0].items.push(common::item(ItemKind::Shape(Shape::Disc), DAffine3::IDENTITY));
    assert!(refused(&empty, &[]).contains("nothing in the scene is a solid"));
    assert!(refused(&half, &["bal".into()]).contains("no solid is called `bal`"));

    let solids = Solids::new(&one(solids::ball(DVec3::ZERO, 1.0).unwrap()), &[]).unwrap();
    let fine = |memory, cells| surface(&solids, &Fineness { tolerance: 1e-6, cells, memory }, &Watch::NONE);
    assert!(fine(MEMORY, Some(5000)).unwrap_err().to_string().contains("MiB"));
    assert!(fine(1 << 24, None).unwrap_err().to_string().contains("fits, with distances of about"));
    let stop = Watch { stop: &|| true, ..Watch::NONE };
    assert!(surface(&solids, &Fineness { tolerance: 0.1, cells: None, memory: MEMORY }, &stop).is_err());
}
