//! Scenes made here (no data files), and how results are compared before a clock starts.
#![allow(dead_code, reason = "each bench uses its own part")]

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use lanecast::lanes::Real;
use lanecast::ray::Hits;
use lanecast::scene::description::{CameraDescription, Description, Group, Item, ItemKind, Light, Projection};
use lanecast::scene::mesh::Mesh;

/// splitmix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point of the cube [-1, 1]^3.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// A scene of one mesh with the camera it is seen by.
pub struct Scene {
    pub name: &'static str,
    pub description: Description,
    pub camera: CameraDescription,
}

fn scene(name: &'static str, mesh: Mesh, eye: DVec3, look_at: DVec3) -> Scene {
    let mut description = Description::new(name);
    description.meshes.push(Arc::new(mesh));
    description.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
    let projection = Projection::Perspective { theta: 0.9 };
    Scene { name, description, camera: CameraDescription { name: name.into(), eye, look_at, up: DVec3::Z, projection } }
}

/// A connected surface: `n` x `n` cells of hills, two triangles each, seen from above one corner.
pub fn terrain(n: u32) -> Scene {
    let mut mesh = Mesh::default();
    let height = |x: f64, y: f64| {
        // Five octaves of waves whose directions share no period.
        (0..5)
            .map(|k| (x * 1.9f64.powi(k) + f64::from(k)).sin() * (y * 2.3f64.powi(k)).cos() / 2f64.powi(k))
            .sum::<f64>()
    };
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (f64::from(i) / f64::from(n) * 10.0, f64::from(j) / f64::from(n) * 10.0);
            mesh.positions.push(DVec3::new(x, y, 0.6 * height(x, y)));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let at = |i: u32, j: u32| i * (n + 1) + j;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let mut terrain = scene("terrain", mesh, DVec3::new(-1.0, -1.5, 4.0), DVec3::new(5.0, 5.0, 0.0));
    // A low sun: hills throw shadows.
    terrain.description.lights.push(Light::Point { position: DVec3::new(13.0, -2.0, 1.8), intensity: DVec3::ONE });
    terrain
}

/// Disconnected triangles that overlap in depth: `n` of them in a cube, seen from outside.
pub fn soup(n: u32) -> Scene {
    let mut r = Random(1);
    let mut mesh = Mesh::default();
    for i in 0..n {
        let centre = r.cube() * 5.0;
        for _ in 0..3 {
            mesh.positions.push(centre + r.cube() * 0.3);
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    scene("soup", mesh, DVec3::new(12.0, 3.0, 2.0), DVec3::ZERO)
}

/// Many objects: `n` octahedra, no two alike, each placed once, in a cube seen from outside. What a call of an engine does for each
/// object, whatever its rays, shows here.
pub fn crowd(n: u32) -> Scene {
    let mut r = Random(1);
    let mut crowd = scene("crowd", octahedron(0.2), DVec3::new(12.0, 3.0, 2.0), DVec3::ZERO);
    let Description { meshes, groups, .. } = &mut crowd.description;
    for i in 1..=n {
        meshes.push(Arc::new(octahedron(0.1 + 0.1 * r.unit())));
        let item = |kind, transform| Item { transform, material: None, kind };
        groups.push(Group { items: vec![item(ItemKind::Mesh(i), DAffine3::IDENTITY)], ..Group::default() });
        groups[0].items.push(item(ItemKind::Instance(i), DAffine3::from_translation(r.cube() * 5.0)));
    }
    crowd
}

fn octahedron(size: f64) -> Mesh {
    let positions = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].map(|p| p * size).into();
    let half = |apex| [[0, 2, apex], [2, 1, apex], [1, 3, apex], [3, 0, apex]];
    Mesh { positions, triangles: [half(4), half(5)].concat(), ..Mesh::default() }
}

/// Bits of one answer: t, u, v and the ids.
type Bits = ([u64; 3], u32, u32);

/// The answer to ray `i` as bits.
pub fn bits<S: Real>(hits: &Hits<S>, i: usize) -> Bits {
    ([hits.t[i], hits.u[i], hits.v[i]].map(|x| x.to_f64().to_bits()), hits.prim[i], hits.inst[i])
}

/// Panics unless both lists of hits are the same to the bit and some rays hit.
pub fn require_same<S: Real>(what: &str, got: &Hits<S>, want: &Hits<S>) {
    assert_eq!(got.len(), want.len(), "{what}");
    assert!(want.hit_count() * 50 > want.len(), "{what}: only {} of {} hit", want.hit_count(), want.len());
    for i in 0..want.len() {
        assert_eq!(bits(got, i), bits(want, i), "{what}: ray {i}");
    }
}
