//! Random trees of solids: all engines give the same bits, and the oracle explains every answer.

use std::sync::Arc;

use crate::common;
use crate::solid_support;

use common::Random;
use glam::{DAffine3, DVec3};
use lanecast::lanes::Real;
use lanecast::ray::{Hits, Rays};
use lanecast::reference::{EngineHit, Oracle, OracleRay, Tally};
use lanecast::scene::description::{Description, Precision, Shape};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::solids::{self, NodeKind, Placed, Solid, SolidTree};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch};
use rayon::prelude::*;
use solid_support::{KINDS, cube_mesh, cuboid, grow, leaf, rays, scene};

fn oracle_ray<S: Real>(rays: &Rays<S>, i: usize) -> OracleRay {
    let v = |p: [S; 3]| DVec3::from_array(p.map(Real::to_f64));
    OracleRay { org: v(rays.org(i)), dir: v(rays.dir(i)), t_min: rays.t_min[i].to_f64(), t_max: rays.t_max[i].to_f64() }
}

/// Bits over all engines, then the verdicts on them.
fn judged<S: Engines>(description: &Description, rays: &Rays<S>, seed: u64, precision: Precision) -> Tally {
    let world = World::<S>::compile(description, Preset::Fast).unwrap();
    let oracle = Oracle::new(&world.assembly);
    let n = rays.len();
    let mut scratch = Scratch::default();
    let (mut want, mut got) = (Hits::<S>::default(), Hits::<S>::default());
    let (mut any_want, mut any) = (Vec::new(), Vec::new());
    for (e, engine) in S::engines().iter().enumerate() {
        engine.intersect(&world, rays, &mut got, &mut scratch, None);
        engine.occluded(&world, rays, &mut any, &mut scratch, None);
        if e == 0 {
            (want, any_want) = (got.clone(), any.clone());
            for i in 0..n {
                assert_eq!(any[i] == 1, got.is_hit(i), "seed {seed} ray {i}: any-hit and closest-hit differ");
            }
        }
        for i in 0..n {
            let bits = |h: &Hits<S>| ([h.t[i], h.u[i], h.v[i]].map(|x| x.to_f64().to_bits()), h.prim[i], h.inst[i]);
            assert_eq!(bits(&got), bits(&want), "seed {seed}, {}, ray {i}: {:?}", engine.name(), oracle_ray(rays, i));
        }
        assert_eq!(any, any_want, "seed {seed}, {}", engine.name());
    }
    let mut tally = Tally::default();
    for i in 0..n {
        let answer = want.is_hit(i).then(|| EngineHit {
            t: want.t[i].to_f64(),
            u: want.u[i].to_f64(),
            v: want.v[i].to_f64(),
            prim: want.prim[i],
            inst: want.inst[i],
        });
        tally.add(answer.is_some(), &oracle.judge(&oracle_ray(rays, i), answer, precision));
    }
    tally
}

fn all<S: Engines>(precision: Precision, kinds: usize, seeds: std::ops::Range<u64>, n: usize) {
    let sum = trees::<S>(precision, kinds, seeds, n);
    assert!(sum.hits > sum.rays / 8, "only {} of {} rays hit", sum.hits, sum.rays);
}

/// The sum over random trees, all of whose rays must be explained.
fn trees<S: Engines>(precision: Precision, kinds: usize, seeds: std::ops::Range<u64>, n: usize) -> Tally {
    sum_over::<S>(precision, seeds, n, |seed| {
        let mut r = Random(seed);
        let mut tree = SolidTree::new("random");
        tree.root = grow(&mut tree, &mut r, 1 + (seed % 8) as usize, kinds);
        tree
    })
}

/// The sum over the solids of some seeds, all of whose rays must be explained.
fn sum_over<S: Engines>(
    precision: Precision,
    seeds: std::ops::Range<u64>,
    n: usize,
    solid: impl Fn(u64) -> SolidTree + Sync,
) -> Tally {
    let tallies: Vec<(u64, Tally)> = seeds
        .into_par_iter()
        .map(|seed| (seed, judged::<S>(&scene(solid(seed)), &rays(n, seed), seed, precision)))
        .collect();
    let mut sum = Tally::default();
    for (seed, tally) in &tallies {
        if !tally.is_clean() {
            println!("seed {seed}: {tally}");
        }
        sum.merge(tally);
    }
    println!("{precision:?}: {sum}");
    assert!(sum.is_clean(), "{} unexplained", sum.unexplained);
    sum
}

/// Trees per test and rays per tree.
fn size() -> (u64, usize) {
    if std::env::var_os("LANECAST_LONG_TESTS").is_some() { (2000, 5000) } else { (64, 500) }
}

/// Elliptic tori of all shapes, stretched, sheared and mirrored, alone and cut by each other.
fn elliptic_tori<S: Engines>(precision: Precision, seeds: std::ops::Range<u64>, n: usize) {
    let tori = |seed: u64| {
        let mut r = Random(seed);
        let mut tree = SolidTree::new("tori");
        let mut torus = |tree: &mut SolidTree| {
            let solid = Solid::EllipticTorus { reach: 0.1 + 0.85 * r.unit(), lean: 1.8 * r.unit() - 0.9 };
            let mut transform = r.affine(1.0);
            transform.translation *= 0.25;
            tree.solid(Placed { solid, transform })
        };
        let first = torus(&mut tree);
        let kind = [NodeKind::Union, NodeKind::Difference, NodeKind::Xor];
        if !seed.is_multiple_of(4) {
            let second = torus(&mut tree);
            tree.op(kind[seed as usize % 4 - 1](vec![first, second]));
        }
        tree
    };
    let sum = sum_over::<S>(precision, seeds, n, tori);
    assert!(sum.hits > sum.rays / 8, "only {} of {} rays hit", sum.hits, sum.rays);
}

/// One operation over many small convex leaves, flush with each other and with the faces of a block: a block less all of them, or
/// what is in either. The first boundary of such a solid is not found by a sweep.
fn many_leaves<S: Engines>(precision: Precision, seeds: std::ops::Range<u64>, n: usize) {
    let solid = |seed: u64| {
        let mut r = Random(seed);
        let mut tree = SolidTree::new("many");
        let block = tree.solid(cuboid(DVec3::splat(-2.0), DVec3::splat(2.0)));
        let mut list = vec![block];
        let count = [30, 60, 300, 1000][seed as usize % 4];
        while list.len() < count {
            let mut small = leaf(&mut r, 8);
            // It would leave little of the rest.
            if matches!(small.solid, Solid::Shape(Shape::HalfSpace)) {
                continue;
            }
            let to = (r.in_cube() * 10.0).round() / 4.0;
            small.transform =
                DAffine3::from_translation(to) * DAffine3::from_scale(DVec3::splat(0.25)) * small.transform;
            list.push(tree.solid(small));
        }
        let is_union = seed % 8 > 5;
        list.drain(..usize::from(is_union));
        tree.op(if is_union { NodeKind::Union(list) } else { NodeKind::Difference(list) });
        tree
    };
    let sum = sum_over::<S>(precision, seeds, n, solid);
    assert!(sum.hits > sum.rays / 4, "only {} of {} rays hit", sum.hits, sum.rays);
}

/// Trees beside a slab a thousand wide, which tells how near boundaries are one: nearer than what is small is told apart.
fn beside_a_slab<S: Engines>(precision: Precision, seeds: std::ops::Range<u64>, n: usize) {
    let beside = |seed: u64| {
        let mut r = Random(seed);
        let mut tree = SolidTree::new("beside a slab");
        let small = grow(&mut tree, &mut r, 1 + (seed % 3) as usize, 8);
        let slab = tree.solid(cuboid(DVec3::new(-500.0, -500.0, -31.0), DVec3::new(500.0, 500.0, -30.0)));
        let kind = [NodeKind::Union, NodeKind::Xor][seed as usize % 2];
        tree.root = tree.op(kind(vec![slab, small]));
        tree
    };
    let sum = sum_over::<S>(precision, seeds, n, beside);
    assert!(sum.hits > sum.rays / 8, "only {} of {} rays hit", sum.hits, sum.rays);
}

/// A capsule beside the slab, and lines across it next to where its ball joins its mantle: both are met within the tolerance, and
/// the mantle, which comes last in the tree, bounds the solid.
fn joints_beside_a_slab<S: Engines>(precision: Precision) {
    let mut r = Random(5);
    let mut tree = SolidTree::new("a capsule beside a slab");
    let slab = tree.solid(cuboid(DVec3::new(-500.0, -500.0, -31.0), DVec3::new(500.0, 500.0, -30.0)));
    let balls = [DVec3::ZERO, DVec3::Z * 2.0].map(|centre| tree.solid(solids::ball(centre, 0.5).unwrap()));
    let mantle = tree.solid(solids::cylinder(DVec3::ZERO, DVec3::Z * 2.0, 0.5).unwrap());
    let capsule = tree.op(NodeKind::Union(vec![balls[0], balls[1], mantle]));
    tree.root = tree.op(NodeKind::Xor(vec![slab, capsule]));
    let mut rays = Rays::new(2000);
    for i in 0..rays.len() {
        let turn = r.unit() * std::f64::consts::TAU;
        let (across, aside) = (DVec3::new(turn.cos(), turn.sin(), 0.0), DVec3::new(-turn.sin(), turn.cos(), 0.0));
        let height = 0.005 + 0.02 * r.unit();
        let org = across * 2.0 + aside * (0.3 * r.unit()) + DVec3::Z * if i % 2 == 0 { height } else { 2.0 - height };
        let s = |v: DVec3| v.to_array().map(S::from_f64);
        rays.set(i, s(org), s(-across), S::ZERO, S::INFINITY);
    }
    let tally = judged::<S>(&scene(tree), &rays, 0, precision);
    assert!(tally.is_clean() && tally.hits == tally.rays, "{tally}");
}

/// Boxes in one mesh: beside, across and inside each other, some of them turned inwards, alone and cut by a ball.
fn meshes_of_boxes<S: Engines>(precision: Precision, seeds: std::ops::Range<u64>, n: usize) {
    let boxes = |seed: u64| {
        let mut r = Random(seed);
        let mut mesh = Mesh::default();
        for i in 0..2 + r.below(3) {
            let one = cube_mesh();
            let at = mesh.positions.len() as u32;
            let (centre, half) = (r.in_cube(), DVec3::new(0.4 + r.unit(), 0.4 + r.unit(), 0.4 + r.unit()));
            let is_void = i > 0 && r.below(3) == 0;
            mesh.positions.extend(one.positions.iter().map(|&p| centre + p * if is_void { -0.7 * half } else { half }));
            mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|k| k + at)));
        }
        let mut tree = SolidTree::new("boxes");
        tree.root = tree.solid(Placed { solid: Solid::Mesh(Arc::new(mesh)), transform: DAffine3::IDENTITY });
        if r.below(2) == 0 {
            let ball = tree.solid(solids::ball(r.in_cube(), 0.5 + r.unit()).unwrap());
            tree.root = tree.op(NodeKind::Difference(vec![tree.root, ball]));
        }
        tree
    };
    let sum = sum_over::<S>(precision, seeds, n, boxes);
    assert!(sum.hits > sum.rays / 8, "only {} of {} rays hit", sum.hits, sum.rays);
}

#[test]
fn beside_a_slab_f64() {
    beside_a_slab::<f64>(Precision::F64, 30_000..30_000 + size().0, size().1);
}

#[test]
fn beside_a_slab_f32() {
    beside_a_slab::<f32>(Precision::F32, 30_000..30_000 + size().0, size().1);
}

#[test]
fn joints_are_told_apart_beside_a_slab() {
    joints_beside_a_slab::<f32>(Precision::F32);
    joints_beside_a_slab::<f64>(Precision::F64);
}

#[test]
fn meshes_of_boxes_f64() {
    meshes_of_boxes::<f64>(Precision::F64, 0..size().0, size().1);
}

#[test]
fn meshes_of_boxes_f32() {
    meshes_of_boxes::<f32>(Precision::F32, 0..size().0, size().1);
}

/// Trees whose rays run in the faces of meshes, meet tips and edges of no width, and rims edge-on: among all of the long
/// form's trees these had the most of them.
#[test]
fn tips_rims_and_faces() {
    for seed in [10_034, 10_158, 10_394, 11_031, 11_115, 11_426, 11_513, 11_662, 11_851, 11_960] {
        trees::<f64>(Precision::F64, KINDS, seed..seed + 1, 5000);
    }
    for seed in [20_014, 20_339, 20_346, 20_382, 20_893, 20_972, 21_154, 21_256, 21_603] {
        trees::<f32>(Precision::F32, KINDS, seed..seed + 1, 5000);
    }
}

#[test]
fn elliptic_tori_f64() {
    elliptic_tori::<f64>(Precision::F64, 0..size().0, size().1);
}

#[test]
fn elliptic_tori_f32() {
    elliptic_tori::<f32>(Precision::F32, 0..size().0, size().1);
}

#[test]
fn many_leaves_f64() {
    many_leaves::<f64>(Precision::F64, 0..size().0, size().1);
}

/// A line enters the block where a cylinder inside touches its face, 1e-13 before it enters that: of the long form's 10^7 rays
/// the one that f64 tells apart more sharply than the oracle's own rounding.
#[test]
fn mantles_that_touch_faces() {
    many_leaves::<f64>(Precision::F64, 1571..1572, 5000);
}

#[test]
fn many_leaves_f32() {
    many_leaves::<f32>(Precision::F32, 0..size().0, size().1);
}

#[test]
fn convex_solids_f64() {
    all::<f64>(Precision::F64, 8, 0..size().0, size().1);
}

#[test]
fn convex_solids_f32() {
    all::<f32>(Precision::F32, 8, 0..size().0, size().1);
}

#[test]
fn all_solids_f64() {
    all::<f64>(Precision::F64, KINDS, 10_000..10_000 + size().0, size().1);
}

#[test]
fn all_solids_f32() {
    all::<f32>(Precision::F32, KINDS, 20_000..20_000 + size().0, size().1);
}
