//! What several integration tests share: a small random generator, scenes that mix every kind of primitive, rays
//! that meet them at awkward places.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::lanes::Real;
use lanecast::ray::Rays;
use lanecast::scene::description::{Description, Group, Item, ItemKind, Shape};
use lanecast::scene::mesh::Mesh;

/// splitmix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// Rotation, non-uniform scale, shear, sometimes a mirror; well conditioned.
    pub fn affine(&mut self, size: f64) -> DAffine3 {
        let turn = DMat3::from_quat(DQuat::from_axis_angle(self.direction(), self.unit() * 6.0));
        let scale = DVec3::new(0.3 + self.unit(), 0.3 + self.unit(), 0.3 + self.unit()) * size;
        let mirror = if self.below(3) == 0 { -1.0 } else { 1.0 };
        let shear = DMat3::from_cols(DVec3::X * mirror, DVec3::new(self.unit() - 0.5, 1.0, 0.0), DVec3::Z);
        DAffine3 { matrix3: turn * shear * DMat3::from_diagonal(scale), translation: self.in_cube() * 4.0 }
    }
}

pub const SHAPES: [Shape; 7] =
    [Shape::Sphere, Shape::HalfSpace, Shape::Disc, Shape::Cuboid, Shape::Cylinder, Shape::cone(0.0), Shape::cone(0.4)];

pub fn item(kind: ItemKind, transform: DAffine3) -> Item {
    Item { transform, material: None, kind }
}

/// A random triangle soup in the cube of half-width 4.
pub fn soup(n: usize, r: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n as u32 {
        let centre = r.in_cube() * 4.0;
        for _ in 0..3 {
            // Kept in f32 so that both precisions hold the same triangle.
            mesh.positions.push((centre + r.in_cube() * 0.5).as_vec3().as_dvec3());
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// A closed sphere of triangles with shared vertices.
pub fn ball(rings: u32, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for ring in 0..=rings {
        let theta = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for s in 0..segments {
            let phi = std::f64::consts::TAU * f64::from(s) / f64::from(segments);
            let p = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            mesh.positions.push(if ring == 0 {
                DVec3::Z
            } else if ring == rings {
                DVec3::NEG_Z
            } else {
                p
            });
        }
    }
    for ring in 0..rings {
        for s in 0..segments {
            let next = (s + 1) % segments;
            let at = |r: u32, s: u32| r * segments + if r == 0 || r == rings { 0 } else { s };
            let quad = [at(ring, s), at(ring + 1, s), at(ring + 1, next), at(ring, next)];
            if ring + 1 < rings {
                mesh.triangles.push([quad[0], quad[1], quad[2]]);
            }
            if ring > 0 {
                mesh.triangles.push([quad[0], quad[2], quad[3]]);
            }
        }
    }
    mesh
}

/// Meshes, every shape under random maps, duplicates, and nested instances of all that.
pub fn zoo(seed: u64, instances: bool) -> Description {
    let mut r = Random(seed);
    let mut d = Description::new("zoo");
    d.meshes = vec![Arc::new(soup(300, &mut r)), Arc::new(ball(12, 16))];
    let mut root = Group::default();
    root.items.push(item(ItemKind::Mesh(0), DAffine3::IDENTITY));
    // The same mesh twice: every triangle ties.
    root.items.push(item(ItemKind::Mesh(0), DAffine3::IDENTITY));
    for i in 0..60 {
        let shape = SHAPES[i % SHAPES.len()];
        // Few half-spaces, far out, or nothing else would be seen.
        let map = match shape {
            Shape::HalfSpace if i > 7 => continue,
            Shape::HalfSpace => DAffine3::from_translation(DVec3::new(0.0, 0.0, -5.0)) * r.affine(0.1),
            _ => r.affine(0.4),
        };
        root.items.push(item(ItemKind::Shape(shape), map));
    }
    if instances {
        let mut inner = Group { name: "inner".into(), items: vec![item(ItemKind::Mesh(1), r.affine(0.5))] };
        for shape in SHAPES.into_iter().filter(|s| *s != Shape::HalfSpace) {
            inner.items.push(item(ItemKind::Shape(shape), r.affine(0.3)));
        }
        let mut outer = Group { name: "outer".into(), items: Vec::new() };
        for _ in 0..3 {
            outer.items.push(item(ItemKind::Instance(2), r.affine(0.6)));
        }
        for _ in 0..5 {
            root.items.push(item(ItemKind::Instance(1), r.affine(0.8)));
            root.items.push(item(ItemKind::Instance(2), r.affine(0.5)));
        }
        // One placement twice: instances tie.
        let again = root.items.last().unwrap().clone();
        root.items.push(again);
        d.groups = vec![root, outer, inner];
    } else {
        d.groups = vec![root];
    }
    d
}

/// Shapes and no triangles: a heap that a beam of rays meets in part, and a half-space far below, in the root or in
/// instances.
pub fn shapes(seed: u64, count: usize, instances: bool) -> Description {
    let mut r = Random(seed);
    let mut d = Description::new("shapes");
    let mut heap = Group { name: "heap".into(), items: Vec::new() };
    for i in 0..count {
        let shape = SHAPES[i % SHAPES.len()];
        let place = DAffine3::from_translation(r.in_cube() * 3.0);
        if shape != Shape::HalfSpace {
            heap.items.push(item(ItemKind::Shape(shape), place * r.affine(0.3)));
        }
    }
    let below = DAffine3::from_translation(DVec3::new(0.0, 0.0, -5.0)) * r.affine(0.1);
    let mut root = Group::default();
    root.items.push(item(ItemKind::Shape(Shape::HalfSpace), below));
    if instances {
        for _ in 0..4 {
            root.items.push(item(ItemKind::Instance(1), r.affine(0.7)));
        }
        d.groups = vec![root, heap];
    } else {
        root.items.extend(heap.items);
        d.groups = vec![root];
    }
    d
}

/// Coherent rays in squares of pixels, Morton order: of a parallel camera, through one eye, or towards one light. Some are dead,
/// some have ends.
pub fn coherent<S: Real>(n: usize, seed: u64) -> Rays<S> {
    let mut r = Random(seed);
    let mut rays = Rays::new(n);
    let (dir, eye) = (r.direction(), r.direction() * 9.0);
    let dir = if seed.is_multiple_of(3) { DVec3::new(0.0, 0.0, -1.0) } else { dir };
    let (right, up) = dir.any_orthonormal_pair();
    let side = (n as f64).sqrt().ceil().max(1.0);
    for i in 0..n {
        let (x, y) = lanecast::camera::morton_decode(i as u32);
        let place = right * (f64::from(x) / side - 0.5) * 4.0 + up * (f64::from(y) / side - 0.5) * 4.0;
        let (org, dir) = match seed % 3 {
            0 => (place - dir * 8.0, dir),
            1 => (eye, place - eye),
            _ => (place, eye - place),
        };
        let (mut t_min, mut t_max) = (0.0, if seed % 3 == 2 { 1.0 } else { f64::INFINITY });
        match i % 61 {
            7 => (t_min, t_max) = (0.9, 0.2),
            13 => t_min = 0.5,
            29 => t_max = 0.6,
            _ => {}
        }
        let exact = |v: DVec3| v.as_vec3().to_array().map(|x| S::from_f64(f64::from(x)));
        let (t_min, t_max) = (f64::from(t_min as f32), f64::from(t_max as f32));
        rays.set(i, exact(org), exact(dir), S::from_f64(t_min), S::from_f64(t_max));
    }
    rays
}

/// Rays of all kinds: bundles from one eye, scattered ones, axis-parallel ones, from inside, with short and
/// inverted segments, long and short directions, dead ones.
pub fn rays<S: Real>(n: usize, seed: u64) -> Rays<S> {
    let mut r = Random(seed);
    let mut rays = Rays::new(n);
    let eye = r.in_cube() * 8.0;
    for i in 0..n {
        let target = r.in_cube() * 4.0;
        let mut org = if i % 4 == 0 { eye } else { r.in_cube() * 6.0 };
        let mut dir = target - org;
        match i % 16 {
            5 => dir = [DVec3::X, DVec3::NEG_Y, DVec3::Z][r.below(3)],
            6 => dir *= 1e-3,
            7 => dir *= 1e3,
            9 => org = (org * 4.0).round() / 4.0,
            _ => {}
        }
        let (mut t_min, mut t_max) = (0.0, f64::INFINITY);
        match i % 32 {
            3 => t_max = 0.7,
            10 => t_min = 0.4,
            11 => (t_min, t_max) = (0.9, 0.2),
            13 => org.x = f64::NAN,
            17 => dir = DVec3::ZERO,
            19 => dir.y = f64::INFINITY,
            23 => t_min = -2.0,
            _ => {}
        }
        // Values that f32 holds exactly, so both precisions trace the same ray.
        let exact = |v: DVec3| v.as_vec3().to_array().map(|x| S::from_f64(f64::from(x)));
        let (t_min, t_max) = (f64::from(t_min as f32), f64::from(t_max as f32));
        rays.set(i, exact(org), exact(dir), S::from_f64(t_min), S::from_f64(t_max));
    }
    rays
}
