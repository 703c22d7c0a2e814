//! What the oracle's tests share: random numbers, small scenes, a reader of the test meshes.
#![allow(dead_code, reason = "each test binary uses its own part of this module")]

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use lanecast::scene::assembly::Assembly;
use lanecast::scene::description::{Description, Group, Item, ItemKind, Shape};
use lanecast::scene::mesh::Mesh;

/// Uniform numbers in [-1, 1): splitmix64 (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn number(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }
}

pub fn shape(shape: Shape, transform: DAffine3) -> Item {
    Item { transform, material: None, kind: ItemKind::Shape(shape) }
}

pub fn assembly(meshes: Vec<Mesh>, groups: Vec<Vec<Item>>) -> Assembly {
    let mut description = Description::new("test");
    description.meshes = meshes.into_iter().map(Arc::new).collect();
    description.groups = groups.into_iter().map(|items| Group { name: String::new(), items }).collect();
    Assembly::new(&description).unwrap()
}

pub fn mesh_scene(mesh: Mesh) -> Assembly {
    let item = Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) };
    assembly(vec![mesh], vec![vec![item]])
}

pub fn soup(random: &mut Random, count: u32, size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count {
        let at = random.vector();
        mesh.positions.extend((0..3).map(|_| at + size * random.vector()));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// Vertices and triangles of a binary little-endian PLY with float x y z and triangle lists.
pub fn read_ply(bytes: &[u8]) -> Mesh {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..body]).unwrap();
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|l| l.strip_prefix(element)).unwrap();
        line.trim().parse().unwrap()
    };
    let (vertices, faces) = bytes[body..].split_at(12 * count("element vertex"));
    let float = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
    let index = |b: &[u8]| u32::from_le_bytes(b.try_into().unwrap());
    let positions = vertices.chunks_exact(12).map(|v| DVec3::new(float(&v[..4]), float(&v[4..8]), float(&v[8..])));
    let triangles = faces.chunks_exact(13).map(|f| {
        assert_eq!(f[0], 3);
        [index(&f[1..5]), index(&f[5..9]), index(&f[9..])]
    });
    let mesh =
        Mesh { positions: positions.collect(), triangles: triangles.collect(), groups: vec![], ..Mesh::default() };
    assert_eq!(mesh.triangles.len(), count("element face"));
    mesh
}
