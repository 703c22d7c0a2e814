//! Rays that leave a convex body never meet it again: its ambient occlusion is exactly 1, whatever its size, place
//! and shape. This is where secondary origins fail first.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::camera::{Camera, framing};
use lanecast::film::PlaneData;
use lanecast::render::{RenderOptions, Silent, render};
use lanecast::scene::description::{CameraDescription, Description, Group, Item, ItemKind, Projection, Shape};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

fn item(transform: DAffine3, kind: ItemKind) -> Item {
    Item { transform, material: None, kind }
}

/// Share of the hit pixels that are not fully open, and the number of hit pixels.
fn leaks<S: Shades>(description: &Description, camera: Option<CameraDescription>) -> (f64, usize) {
    let world = World::<S>::compile(description, Preset::Balanced).unwrap();
    let camera = Camera::new(&camera.unwrap_or_else(|| framing(world.bounds(), 1.0)), 1.0).unwrap();
    let options = RenderOptions {
        width: 96,
        height: 96,
        integrator: Integrator::Ao,
        ao_samples: 16,
        ao_radius: f64::INFINITY,
        engine: "scalar".into(),
        ..RenderOptions::default()
    };
    let film = render(&world, description, &camera, &options, &Silent).unwrap().film;
    let plane = |name: &str| match &film.planes.iter().find(|p| p.name == name).unwrap().data {
        PlaneData::F32(data) => data.clone(),
        PlaneData::U32(_) | PlaneData::U8(_) => panic!("{name} is a float plane"),
    };
    let open: Vec<f32> = plane("R").into_iter().zip(plane("A")).filter(|(_, a)| *a == 1.0).map(|(r, _)| r).collect();
    (open.iter().filter(|&&r| r != 1.0).count() as f64 / open.len().max(1) as f64, open.len())
}

/// An octahedron with each face cut into n^2 triangles and pushed out to the unit sphere.
fn ball(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for face in 0..8u32 {
        let sign = |bit: u32| if face >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corners = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        let point = |i: u32, j: u32| {
            let (a, b) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            (corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b).normalize()
        };
        let mut add = |p: [(u32, u32); 3]| {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(p.map(|(i, j)| point(i, j)));
            mesh.triangles.push([first, first + 1, first + 2]);
        };
        for i in 0..n {
            for j in 0..n - i {
                add([(i, j), (i + 1, j), (i, j + 1)]);
                if i + j + 1 < n {
                    add([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                }
            }
        }
    }
    mesh
}

fn all_open<S: Shades>() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let stretch = DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::new(3.0, 0.5, 1.0));
    let places = [
        ("unit", DAffine3::IDENTITY),
        ("small", DAffine3::from_scale(DVec3::splat(1e-3))),
        ("large", DAffine3::from_scale(DVec3::splat(1e4))),
        ("far", DAffine3::from_translation(DVec3::new(200.0, -300.0, 100.0))),
        ("stretched", DAffine3::from_mat3_translation(stretch, DVec3::new(5.0, 6.0, 7.0))),
    ];
    let cone = Shape::cone(0.4);
    let mut kinds = [Shape::Sphere, Shape::Cuboid, Shape::Cylinder, cone].map(ItemKind::Shape).to_vec();
    kinds.push(ItemKind::Mesh(0));
    for kind in kinds {
        for (name, place) in places {
            for instanced in [false, true] {
                let mut d = Description::new("convex");
                d.meshes.push(ball(12).into());
                if instanced {
                    d.groups.push(Group { name: "body".into(), items: vec![item(DAffine3::IDENTITY, kind.clone())] });
                    d.groups[0].items.push(item(place, ItemKind::Instance(1)));
                } else {
                    d.groups[0].items.push(item(place, kind.clone()));
                }
                let (leaks, pixels) = leaks::<S>(&d, None);
                let what = if matches!(kind, ItemKind::Mesh(_)) { "mesh".into() } else { format!("{kind:?}") };
                assert!(pixels > 500, "{what} {name}: only {pixels} pixels");
                assert!(leaks == 0.0, "{what} {name}, instanced {instanced}: {leaks} of {pixels} pixels");
            }
        }
    }
}

#[test]
fn convex_bodies_are_open_in_f32() {
    all_open::<f32>();
}

#[test]
fn convex_bodies_are_open_in_f64() {
    all_open::<f64>();
}

/// A tilted square much larger than its distance from the eye: its corners' rounding errors are what counts.
fn large_squares_are_open<S: Shades>() {
    for turn in 0..4 {
        let k = f64::from(turn);
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3 + k, 1.1 - 0.3 * k, 0.1 * k - 0.7));
        for (size, height) in [(1.0, 1.0), (10.0, 0.1), (100.0, 1.0), (1e4, 10.0), (1e6, 1.0)] {
            let corner = |x: f64, y: f64| turn * DVec3::new(x * size, y * size, 0.0);
            let positions = vec![corner(-1.0, -1.1), corner(1.3, -1.0), corner(1.0, 1.0), corner(-1.0, 1.2)];
            let mut d = Description::new("square");
            d.meshes.push(
                Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], groups: Vec::new(), ..Mesh::default() }.into(),
            );
            d.groups[0].items.push(item(DAffine3::IDENTITY, ItemKind::Mesh(0)));
            let (eye, look_at) = (turn * DVec3::new(0.3, 0.2, height), turn * DVec3::new(0.35, 0.1, 0.0));
            let projection = Projection::Perspective { theta: 1.0 };
            let camera = CameraDescription { name: "near".into(), eye, look_at, up: DVec3::Y, projection };
            let (leaks, pixels) = leaks::<S>(&d, Some(camera));
            assert!(pixels > 500 && leaks == 0.0, "size {size} height {height}: {leaks} of {pixels} pixels");
        }
    }
}

#[test]
fn large_squares_are_open_from_near() {
    large_squares_are_open::<f32>();
    large_squares_are_open::<f64>();
}
