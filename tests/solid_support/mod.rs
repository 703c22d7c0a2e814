//! Random trees of solids on a lattice, where faces touch, caps are shared and spheres touch planes, and rays at them.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use lanecast::lanes::Real;
use lanecast::ray::Rays;
use lanecast::scene::description::{Description, Item, ItemKind, Shape};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::solids::{self, NodeId, NodeKind, Placed, Polyhedron, Solid, SolidNode, SolidTree};

use crate::common::Random;

/// A multiple of 1/2 in -2..=2.
fn lattice(r: &mut Random) -> f64 {
    r.below(9) as f64 * 0.5 - 2.0
}

fn point(r: &mut Random) -> DVec3 {
    DVec3::new(lattice(r), lattice(r), lattice(r))
}

fn axis(r: &mut Random) -> DVec3 {
    DVec3::AXES[r.below(3)] * if r.below(2) == 0 { 1.0 } else { -1.0 }
}

/// A length of 1/2, 1 or 3/2.
fn length(r: &mut Random) -> f64 {
    0.5 + 0.5 * r.below(3) as f64
}

pub fn cuboid(lo: DVec3, hi: DVec3) -> Placed {
    let transform = DAffine3::from_scale_rotation_translation((hi - lo) * 0.5, DQuat::IDENTITY, (lo + hi) * 0.5);
    Placed { solid: Solid::Shape(Shape::Cuboid), transform }
}

/// The cube [-1, 1]^3, two triangles a side.
pub fn cube_mesh() -> Mesh {
    let positions = (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { positions: positions.collect(), triangles, groups: Vec::new(), ..Mesh::default() }
}

/// A leaf; `kinds` is how many of the kinds of solids may occur.
pub fn leaf(r: &mut Random, kinds: usize) -> Placed {
    let (p, n, s) = (point(r), axis(r), length(r));
    let (a, b) = n.any_orthonormal_pair();
    let placed = match r.below(kinds) {
        0 | 1 => Ok(cuboid(p, p + DVec3::new(length(r), length(r), length(r)))),
        2 => solids::ball(p, s),
        3 => solids::cylinder(p, p + n * length(r), s),
        4 => solids::half_space(n, lattice(r)),
        5 => solids::cone(p, p + n * length(r), s, if r.below(2) == 0 { 0.0 } else { 0.5 * s }),
        6 => {
            let turn = DQuat::from_axis_angle(r.direction(), r.unit() * 3.0);
            let planes: Vec<_> = (0..4 + r.below(6)).map(|_| (turn * r.direction(), length(r))).collect();
            let mut all: Vec<_> = DVec3::AXES.iter().flat_map(|&a| [(a, s), (-a, s)]).collect();
            all.extend(planes);
            Polyhedron::from_planes(&all)
                .map(|q| Placed { solid: Solid::Polyhedron(Arc::new(q)), transform: DAffine3::from_translation(p) })
        }
        7 => solids::ellipsoid(p, a * s, b * length(r), n * length(r)),
        8 => solids::torus(p, n, 1.0, 0.25 * s),
        9 => solids::elliptic_paraboloid(p, n * s, a, length(r), length(r)),
        10 => solids::hyperboloid(p, n * 2.0 * s, a * length(r), length(r), 0.5),
        11 => solids::elliptic_hyperboloid(p, n * s, a, length(r), length(r), 0.5),
        12 => solids::parabolic_cylinder(p, n * s, a * length(r), length(r)),
        13 => solids::hyperbolic_cylinder(p, n * s, a * length(r), length(r), 0.5),
        14 => solids::truncated_cone(p, n * s + a * 0.5, a * s, b, a * 0.5, b * length(r)),
        _ => {
            let mesh = if r.below(2) == 0 { crate::common::ball(6, 8) } else { cube_mesh() };
            let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(s), DQuat::IDENTITY, p);
            Ok(Placed { solid: Solid::Mesh(Arc::new(mesh)), transform })
        }
    };
    placed.expect("a solid with sound numbers")
}

/// All kinds of [`leaf`].
pub const KINDS: usize = 16;

/// Adds a random subtree of at most `depth` levels of operations.
pub fn grow(tree: &mut SolidTree, r: &mut Random, depth: usize, kinds: usize) -> NodeId {
    if depth == 0 || r.below(4) == 0 {
        return tree.solid(leaf(r, kinds));
    }
    let count = 2 + r.below(2);
    let mut list: Vec<NodeId> = (0..count).map(|_| grow(tree, r, depth - 1, kinds)).collect();
    // Sometimes the same subtree twice: everything coincides.
    if r.below(5) == 0 {
        list.push(list[0]);
    }
    let kind = match r.below(10) {
        0..5 => NodeKind::Union(list),
        5 => NodeKind::Intersection(list),
        6..9 => NodeKind::Difference(list),
        _ => NodeKind::Xor(list),
    };
    let transform = match r.below(4) {
        0 => DAffine3::from_translation(point(r) * 0.5),
        1 => DAffine3::from_rotation_translation(DQuat::from_axis_angle(r.direction(), r.unit()), DVec3::ZERO),
        _ => DAffine3::IDENTITY,
    };
    let node = tree.add(SolidNode { transform, material: None, kind });
    if r.below(12) == 0 { tree.op(NodeKind::Complement(node)) } else { node }
}

pub fn item(index: u32, transform: DAffine3) -> Item {
    Item { transform, material: None, kind: ItemKind::Solids(index) }
}

/// A scene of one tree.
pub fn scene(tree: SolidTree) -> Description {
    let mut d = Description::new("solids");
    d.solids.push(Arc::new(tree));
    d.groups[0].items.push(item(0, DAffine3::IDENTITY));
    d
}

/// Rays from outside and inside, many on the lattice and along its axes, some in the planes of faces.
pub fn rays<S: Real>(n: usize, seed: u64) -> Rays<S> {
    let mut r = Random(seed);
    let mut rays = Rays::new(n);
    for i in 0..n {
        let target = r.in_cube() * 2.5;
        let mut org = if i % 3 == 0 { r.in_cube() * 2.0 } else { r.direction() * (4.0 + 4.0 * r.unit()) };
        let mut dir = target - org;
        match i % 8 {
            1 => {
                // Along an axis, between the planes of the lattice.
                dir = axis(&mut r);
                org = target - dir * 6.0;
            }
            2 => {
                // Through points of the lattice: edges and corners.
                org = (org * 2.0).round() / 2.0;
                dir = (target * 2.0).round() / 2.0 - org;
            }
            3 => dir *= 1e-3,
            4 => dir *= 250.0,
            _ => {}
        }
        let (t_min, t_max) = match i % 16 {
            5 => (0.0, 0.9),
            6 => (0.3, f64::INFINITY),
            _ => (0.0, f64::INFINITY),
        };
        let s = |v: DVec3| v.to_array().map(S::from_f64);
        rays.set(i, s(org), s(dir), S::from_f64(t_min), S::from_f64(t_max));
    }
    rays
}
