//! Laws that hold for all solids, without a picture to compare with: on random trees, ray by ray, for all stretches inside.

use crate::common;
use crate::solid_support;

use common::Random;
use glam::{DAffine3, DVec3};
use lanecast::ray::{INVALID_ID, Rays};
use lanecast::scene::solids::{NodeId, NodeKind, SolidNode, SolidTree};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Scratch, Stretch, stretches};
use proptest::prelude::*;
use solid_support::{KINDS, grow, rays, scene};

/// Coordinates are below 20: what f64 rounds away, and a margin for lines that graze.
const NEAR: f64 = 1e-9;

type Make = fn(&mut SolidTree, [NodeId; 3]) -> NodeId;

fn op(kind: fn(Vec<NodeId>) -> NodeKind, tree: &mut SolidTree, operands: &[NodeId]) -> NodeId {
    tree.op(kind(operands.to_vec()))
}

/// What `make` builds over three random operands that `seed` makes.
fn inside(seed: u64, rays: &Rays<f64>, make: Make) -> Vec<Vec<Stretch>> {
    let mut tree = SolidTree::new("law");
    let mut r = Random(seed);
    let depth = r.below(4);
    let operands = [0, 1, 2].map(|_| grow(&mut tree, &mut r, depth, KINDS));
    tree.root = make(&mut tree, operands);
    let world = World::<f64>::compile(&scene(tree), Preset::Fast).unwrap();
    let mut by_ray = vec![Vec::new(); rays.len()];
    for stretch in stretches::<lanecast::lanes::f64x8>(&world, rays, &mut Scratch::default()) {
        by_ray[stretch.ray as usize].push(stretch);
    }
    by_ray
}

/// Stretches that rounding cannot make or break, gaps likewise.
fn solid_parts(list: &[Stretch], speed: f64) -> Vec<[f64; 2]> {
    let mut parts: Vec<[f64; 2]> = Vec::new();
    for s in list {
        match parts.last_mut() {
            Some(last) if (s.t_in - last[1]) * speed < 1e3 * NEAR => last[1] = last[1].max(s.t_out),
            _ => parts.push([s.t_in, s.t_out]),
        }
    }
    parts.retain(|[a, b]| (b - a) * speed > 1e3 * NEAR);
    parts
}

fn same(a: &[Vec<Stretch>], b: &[Vec<Stretch>], rays: &Rays<f64>) -> Result<(), TestCaseError> {
    for i in 0..rays.len() {
        let speed = DVec3::from_array(rays.dir(i)).length();
        let (x, y) = (solid_parts(&a[i], speed), solid_parts(&b[i], speed));
        let near = |p: f64, q: f64| p == q || (p - q).abs() * speed <= NEAR * (1.0 + p.abs() * speed);
        let alike = x.len() == y.len() && x.iter().zip(&y).all(|(p, q)| near(p[0], q[0]) && near(p[1], q[1]));
        prop_assert!(alike, "ray {i}: {:?} {:?}: {x:?} {y:?}", rays.org(i), rays.dir(i));
    }
    Ok(())
}

const LAWS: [(&str, Make, Make); 10] = [
    ("A - A is empty", |t, [a, ..]| op(NodeKind::Difference, t, &[a, a]), |t, _| op(NodeKind::Union, t, &[])),
    ("A ^ A is empty", |t, [a, ..]| op(NodeKind::Xor, t, &[a, a]), |t, _| op(NodeKind::Union, t, &[])),
    ("A | A = A", |t, [a, ..]| op(NodeKind::Union, t, &[a, a]), |_, [a, ..]| a),
    ("A & A = A", |t, [a, ..]| op(NodeKind::Intersection, t, &[a, a]), |_, [a, ..]| a),
    (
        "A & B = A - (A - B)",
        |t, [a, b, _]| op(NodeKind::Intersection, t, &[a, b]),
        |t, [a, b, _]| {
            let rest = op(NodeKind::Difference, t, &[a, b]);
            op(NodeKind::Difference, t, &[a, rest])
        },
    ),
    (
        "(A - B) - C = A - (B | C)",
        |t, [a, b, c]| {
            let first = op(NodeKind::Difference, t, &[a, b]);
            op(NodeKind::Difference, t, &[first, c])
        },
        |t, [a, b, c]| {
            let both = op(NodeKind::Union, t, &[b, c]);
            op(NodeKind::Difference, t, &[a, both])
        },
    ),
    (
        "A ^ B = (A | B) - (A & B)",
        |t, [a, b, _]| op(NodeKind::Xor, t, &[a, b]),
        |t, [a, b, _]| {
            let (all, both) = (op(NodeKind::Union, t, &[a, b]), op(NodeKind::Intersection, t, &[a, b]));
            op(NodeKind::Difference, t, &[all, both])
        },
    ),
    (
        "!(A | B) = !A & !B",
        |t, [a, b, _]| {
            let all = op(NodeKind::Union, t, &[a, b]);
            t.op(NodeKind::Complement(all))
        },
        |t, [a, b, _]| {
            let not = [a, b].map(|x| t.op(NodeKind::Complement(x)));
            op(NodeKind::Intersection, t, &not)
        },
    ),
    (
        "A & (B | C) = (A & B) | (A & C)",
        |t, [a, b, c]| {
            let either = op(NodeKind::Union, t, &[b, c]);
            op(NodeKind::Intersection, t, &[a, either])
        },
        |t, [a, b, c]| {
            let (ab, ac) = (op(NodeKind::Intersection, t, &[a, b]), op(NodeKind::Intersection, t, &[a, c]));
            op(NodeKind::Union, t, &[ab, ac])
        },
    ),
    (
        "moving the whole is moving the operands",
        |t, [a, b, _]| {
            let all = op(NodeKind::Difference, t, &[a, b]);
            moved(t, all)
        },
        |t, [a, b, _]| {
            let operands = [a, b].map(|x| moved(t, x));
            op(NodeKind::Difference, t, &operands)
        },
    ),
];

fn moved(tree: &mut SolidTree, node: NodeId) -> NodeId {
    let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.4);
    let transform =
        DAffine3::from_scale_rotation_translation(DVec3::new(1.0, 1.3, 0.8), turn, DVec3::new(0.2, -0.3, 0.1));
    tree.add(SolidNode { transform, material: None, kind: NodeKind::Union(vec![node]) })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn laws_of_sets(seed in any::<u64>()) {
        let rays = rays::<f64>(160, seed ^ 1);
        for (law, left, right) in LAWS {
            let (left, right) = (inside(seed, &rays, left), inside(seed, &rays, right));
            if let Err(e) = same(&left, &right, &rays) {
                return Err(TestCaseError::fail(format!("{law}: {e}")));
            }
        }
    }

    /// A segment without ends enters what it leaves: stretches are closed unless the solid has no bounds.
    #[test]
    fn boundaries_come_in_pairs(seed in any::<u64>()) {
        let mut tree = SolidTree::new("pairs");
        let mut r = Random(seed);
        let depth = r.below(6);
        let root = grow(&mut tree, &mut r, depth, KINDS);
        // Cut to a ball: bounded.
        let ball = tree.solid(lanecast::scene::solids::ball(DVec3::ZERO, 3.0).unwrap());
        tree.root = op(NodeKind::Intersection, &mut tree, &[root, ball]);
        let world = World::<f64>::compile(&scene(tree), Preset::Fast).unwrap();
        let mut rays = rays::<f64>(200, seed ^ 2);
        for i in 0..rays.len() {
            rays.t_min[i] = -1e9;
            rays.t_max[i] = 1e9;
        }
        for s in stretches::<f64>(&world, &rays, &mut Scratch::default()) {
            prop_assert!(s.prim_in != INVALID_ID && s.prim_out != INVALID_ID && s.t_in < s.t_out, "{s:?}");
        }
    }
}
