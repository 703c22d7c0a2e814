//! What the tests of tiles share: a world with its judge, the tile engines against `scalar` and the oracle, pictures and
//! the shadow rays of what they show.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::borrow::Cow;
use std::ops::Deref;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use lanecast::measure::agreement;
use lanecast::measure::answers::Answers;
use lanecast::measure::raysets::{RayKind, Setting, Starts};
use lanecast::measure::truth;
use lanecast::ray::{Hits, Rays};
use lanecast::reference::Oracle;
use lanecast::scene::description::{Description, ItemKind};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engine, Scratch, engine};

use crate::common;

/// A world and the oracle that judges it.
pub struct Scene {
    pub world: World<f32>,
    pub oracle: Oracle,
}

impl Scene {
    pub fn new(world: World<f32>) -> Self {
        Self { oracle: Oracle::new(&world.assembly), world }
    }
}

impl Deref for Scene {
    type Target = World<f32>;

    fn deref(&self) -> &World<f32> {
        &self.world
    }
}

pub fn compile(meshes: Vec<Mesh>) -> Scene {
    let mut d = Description::new("meshes");
    for (i, mesh) in meshes.into_iter().enumerate() {
        d.meshes.push(Arc::new(mesh));
        d.groups[0].items.push(common::item(ItemKind::Mesh(i as u32), DAffine3::IDENTITY));
    }
    Scene::new(World::compile(&d, Preset::Balanced).unwrap())
}

pub fn find(name: &str) -> &'static dyn Engine<f32> {
    engine::<f32>(name).unwrap()
}

/// How many answers differ from the scalar engine's, bit by bit: closest hits, any-hits.
pub fn differences(world: &Scene, rays: &Rays<f32>) -> (usize, usize) {
    let mut scratch = Scratch::default();
    let (mut want, mut got) = (Hits::default(), Hits::default());
    find("scalar").intersect(world, rays, &mut want, &mut scratch, None);
    find("tile-exact").intersect(world, rays, &mut got, &mut scratch, None);
    let closest = (0..rays.len()).filter(|&i| bits(&want, i) != bits(&got, i)).count();
    let (mut any_want, mut any) = (Vec::new(), Vec::new());
    find("scalar").occluded(world, rays, &mut any_want, &mut scratch, None);
    find("tile-exact").occluded(world, rays, &mut any, &mut scratch, None);
    let different = (0..rays.len()).filter(|&i| any_want[i] != any[i]).count();
    find("tile").intersect(world, rays, &mut got, &mut scratch, None);
    find("tile").occluded(world, rays, &mut any, &mut scratch, None);
    let (want, any_want) = (Answers::Closest(vec![want]), Answers::Any(vec![any_want]));
    let whole = [Answers::Closest(vec![got.clone()]), Answers::Any(vec![any.clone()])];
    explained(world, rays, &want, &whole[0]);
    explained(world, rays, &any_want, &whole[1]);
    for small in ["tile-16x16", "tile-8x8", "tile-4x4"] {
        find(small).intersect(world, rays, &mut got, &mut scratch, None);
        find(small).occluded(world, rays, &mut any, &mut scratch, None);
        admitted_like(&whole[0], world, rays, &want, &Answers::Closest(vec![got.clone()]));
        admitted_like(&whole[1], world, rays, &any_want, &Answers::Any(vec![any.clone()]));
    }
    (closest, different)
}

/// As [`admitted`] where `known` answers are: the oracle, which takes its time, is not asked once more about the same answer.
fn admitted_like(known: &Answers<f32>, scene: &Scene, rays: &Rays<f32>, scalar: &Answers<f32>, own: &Answers<f32>) {
    let mut unlike = agreement::compare(scalar, own).unlike;
    match (known, own) {
        (Answers::Closest(known), Answers::Closest(own)) => {
            unlike.retain(|&i| bits(&known[0], i as usize) != bits(&own[0], i as usize));
        }
        (Answers::Any(known), Answers::Any(own)) => unlike.retain(|&i| known[0][i as usize] != own[0][i as usize]),
        _ => panic!("answers to the same question"),
    }
    let counts = truth::judge_rays(&scene.oracle, truth::OWN_MARGIN_FACTOR, std::slice::from_ref(rays), own, &unlike);
    assert_eq!(counts.unexplained, 0, "{:?}", counts.samples);
}

/// One hit, to the last bit.
pub fn bits(hits: &Hits<f32>, i: usize) -> ([u32; 3], u32, u32) {
    ([hits.t[i], hits.u[i], hits.v[i]].map(f32::to_bits), hits.prim[i], hits.inst[i])
}

/// Lets the oracle judge where `own` is not `scalar` up to rounding.
pub fn admitted(scene: &Scene, rays: &Rays<f32>, scalar: &Answers<f32>, own: &Answers<f32>) {
    let batches = std::slice::from_ref(rays);
    if let Err(why) = truth::admit(find("tile"), batches, scalar, own, || Cow::Borrowed(&scene.oracle)) {
        panic!("{why}");
    }
}

/// The same, and a sample of the rest.
pub fn explained(scene: &Scene, rays: &Rays<f32>, scalar: &Answers<f32>, own: &Answers<f32>) {
    admitted(scene, rays, scalar, own);
    let (batches, oracle) = (std::slice::from_ref(rays), &scene.oracle);
    let counts = truth::judge(oracle, truth::OWN_MARGIN_FACTOR, batches, own, 199);
    assert_eq!(counts.unexplained, 0, "{:?}", counts.samples);
}

/// Morton order in squares of 32.
pub fn pixel(i: usize, width: usize) -> (usize, usize) {
    let even = |i: usize| (0..5).fold(0, |x, bit| x | (i >> (2 * bit) & 1) << bit);
    let (tile, inside) = (i / 1024, i % 1024);
    (tile % (width / 32) * 32 + even(inside), tile / (width / 32) * 32 + even(inside >> 1))
}

/// A picture of `n` x `n` rays from `eye` towards `target`.
pub fn camera(eye: DVec3, target: DVec3, tan: f64, n: usize) -> Rays<f32> {
    let forward = (target - eye).normalize();
    let (right, up) = forward.any_orthonormal_pair();
    let mut rays = Rays::new(n * n);
    for i in 0..n * n {
        let (x, y) = pixel(i, n);
        let across = |p: usize| (p as f64 + 0.5) / n as f64 * 2.0 - 1.0;
        let dir = forward + right * (tan * across(x)) + up * (tan * across(y));
        rays.set(i, eye.as_vec3().to_array(), dir.as_vec3().to_array(), 0.0, f32::INFINITY);
    }
    rays
}

/// From the hits of `rays` to `light`, t = `end` at the light.
pub fn shadows(world: &World<f32>, rays: &Rays<f32>, light: DVec3, end: f32, t_min: f32) -> Rays<f32> {
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    find("scalar").intersect(world, rays, &mut hits, &mut scratch, None);
    let mut out = Rays::new(rays.len());
    for i in (0..rays.len()).filter(|&i| hits.is_hit(i)) {
        let at = |v: [f32; 3]| glam::Vec3::from_array(v);
        let org = at(rays.org(i)) + at(rays.dir(i)) * hits.t[i];
        let dir = (light - org.as_dvec3()) / f64::from(end);
        out.set(i, org.to_array(), dir.as_vec3().to_array(), t_min, end);
    }
    out
}

/// What the surfaces that `rays` hit throw back, as mirrors.
pub fn mirrored(world: &World<f32>, rays: &Rays<f32>) -> Rays<f32> {
    let starts = Starts::trace(world, find("scalar"), std::slice::from_ref(rays));
    let setting = Setting { light: DVec3::ZERO, diagonal: 1.0, seed: 1 };
    starts.rays(RayKind::Reflect, &setting).remove(0)
}
