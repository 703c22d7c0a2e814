//! No ray passes between triangles that share an edge: from inside a closed mesh nothing escapes, neither through
//! edges nor through vertices, whatever the engine.
//!
//! `LANECAST_LONG_TESTS=1` also sends 10^8 rays through a fine sphere from a file.

mod common;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use common::Random;
use glam::{DAffine3, DVec3};
use lanecast::ray::{Hits, Rays};
use lanecast::scene::description::{Description, ItemKind};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::world::{Preset, World};
use lanecast::scene::{ply, unpack};
use lanecast::trace::{Engine, Engines, Scratch};
use rayon::prelude::*;

/// Rays per batch.
const BATCH: usize = 10_000;

/// `p` as f32 holds it: what the world stores.
fn stored(p: DVec3) -> DVec3 {
    p.as_vec3().as_dvec3()
}

/// A ray from well inside to a vertex, a point of an edge, or a point of a triangle, by turns.
fn aimed(mesh: &Mesh, i: usize, r: &mut Random) -> (DVec3, DVec3) {
    let [a, b, c] = mesh.corners(r.below(mesh.triangles.len())).map(stored);
    let target = match i % 3 {
        0 => a,
        1 => a + (b - a) * r.unit(),
        _ => {
            let (u, v) = (r.unit(), r.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    };
    let org = stored(r.direction() * (0.5 * r.unit()));
    // In f32, as a renderer would.
    (org, (target.as_vec3() - org.as_vec3()).as_dvec3())
}

fn world<S: Engines>(mesh: &Arc<Mesh>) -> World<S> {
    let mut scene = Description::new("ball");
    scene.meshes.push(Arc::clone(mesh));
    scene.groups[0].items.push(common::item(ItemKind::Mesh(0), DAffine3::IDENTITY));
    World::compile(&scene, Preset::Balanced).unwrap()
}

/// Number of rays that escape, by closest-hit or any-hit; says where the first one went.
fn escapes<S: Engines>(world: &World<S>, mesh: &Mesh, engine: &dyn Engine<S>, batches: usize, seed: u64) -> u64 {
    let escaped = AtomicU64::new(0);
    (0..batches).into_par_iter().for_each_init(
        || (Rays::<S>::new(BATCH), Hits::default(), Vec::new(), Scratch::default()),
        |(rays, hits, any, scratch), batch| {
            let mut r = Random(seed ^ (batch as u64) << 32);
            for i in 0..BATCH {
                let (org, dir) = aimed(mesh, i, &mut r);
                let narrow = |v: DVec3| v.to_array().map(S::from_f64);
                rays.set(i, narrow(org), narrow(dir), S::ZERO, S::INFINITY);
            }
            engine.intersect(world, rays, hits, scratch, None);
            // Any-hit takes other ways through the tree; a sample of it will do.
            if batch % 8 == 0 {
                engine.occluded(world, rays, any, scratch, None);
            } else {
                any.clear();
                any.resize(BATCH, 1);
            }
            for i in 0..BATCH {
                if (!hits.is_hit(i) || any[i] == 0) && escaped.fetch_add(1, Ordering::Relaxed) == 0 {
                    eprintln!("{} loses org {:?} dir {:?} (kind {})", engine.name(), rays.org(i), rays.dir(i), i % 3);
                }
            }
        },
    );
    escaped.into_inner()
}

/// All engines over one mesh; brute force, which tests every triangle, gets a tenth of the rays.
fn holds<S: Engines>(mesh: Mesh, batches: usize) {
    let mesh = Arc::new(mesh);
    let world = world::<S>(&mesh);
    for (seed, engine) in S::engines().iter().enumerate() {
        let batches = if engine.name() == "brute" { batches.div_ceil(10) } else { batches };
        let escaped = escapes(&world, &mesh, *engine, batches, seed as u64);
        assert_eq!(escaped, 0, "{} of {} rays escape from {}", escaped, batches * BATCH, engine.name());
    }
}

#[test]
fn two_million_rays_stay_inside() {
    // Four engines with a tree, 50 batches each, over two balls: one with needles at its poles.
    holds::<f32>(common::ball(24, 32), 25);
    holds::<f32>(common::ball(60, 250), 25);
}

#[test]
fn double_precision_holds_too() {
    holds::<f64>(common::ball(24, 32), 3);
}

#[test]
fn a_ball_with_a_hole_leaks() {
    let mut mesh = common::ball(24, 32);
    mesh.triangles.remove(300);
    let mesh = Arc::new(mesh);
    let whole = common::ball(24, 32);
    let world = world::<f32>(&mesh);
    let engine = lanecast::trace::engine::<f32>("packet16").unwrap();
    assert!(escapes(&world, &whole, engine, 2, 5) > 0, "the test cannot see a hole");
}

#[test]
fn a_hundred_million_rays_stay_inside() {
    if std::env::var("LANECAST_LONG_TESTS").as_deref() != Ok("1") {
        println!("SKIPPED: 10^8 rays; set LANECAST_LONG_TESTS=1");
        return;
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/pathological/watertight_sphere.ply");
    if !file.exists() {
        println!("SKIPPED: no shared scene watertight_sphere.ply");
        return;
    }
    let mesh = Arc::new(ply::parse(&file, &unpack::read_file(&file).unwrap()).unwrap());
    let world = world::<f32>(&mesh);
    let engine = lanecast::trace::engine::<f32>("packet16").unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let batches = 100_000_000 / BATCH;
    let escaped = pool.install(|| escapes(&world, &mesh, engine, batches, 99));
    println!("{} triangles, {} rays, {escaped} escaped", mesh.triangles.len(), batches * BATCH);
    assert_eq!(escaped, 0);
}
