//! The contract of equal bits: t, u, v, primitive and instance do not depend on the width of a packet, the number of
//! threads or how the rays are cut into batches.

mod binary;

use binary::shared;
use lanecast::camera::framing;
use lanecast::measure::answers::Answers;
use lanecast::measure::eye::{Eye, View};
use lanecast::measure::raysets::{Query, RayKind};
use lanecast::measure::timing::Workers;
use lanecast::ray::Rays;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, engine};

const SIZE: (u32, u32) = (160, 96);

/// Rays for the pathological files, where one ray can cost as much as a picture of something sensible: boxes that all
/// overlap, hits that only f64 can tell.
const FEW: (u32, u32) = (64, 32);

/// Ray files are in tiles of 32x32, Morton order inside: so many consecutive rays are tiles of 8x8, 16x16 and 32x32.
const TILES: [usize; 3] = [64, 256, 1024];

/// The same rays in batches of `tile`.
fn cut<S: Engines>(batches: &[Rays<f32>], tile: usize) -> Vec<Rays<S>> {
    let parts = batches.iter().flat_map(|batch| (0..batch.len()).step_by(tile).map(move |from| (batch, from)));
    let one = |(batch, from): (&Rays<f32>, usize)| {
        let mut rays = Rays::new(tile.min(batch.len() - from));
        for slot in 0..rays.len() {
            let i = from + slot;
            let wide = |v: [f32; 3]| v.map(|x| S::from_f64(f64::from(x)));
            let (t_min, t_max) = (f64::from(batch.t_min[i]), f64::from(batch.t_max[i]));
            rays.set(slot, wide(batch.org(i)), wide(batch.dir(i)), S::from_f64(t_min), S::from_f64(t_max));
        }
        rays
    };
    parts.map(one).collect()
}

fn same_bits<S: Engines>(scene: &str, size: (u32, u32)) {
    let description = load(scene, &LoadOptions::default()).expect("a scene");
    let world = World::<S>::compile(&description, Preset::Fast).expect("a world");
    let aspect = f64::from(size.0) / f64::from(size.1);
    let first = |bounds| description.cameras.first().cloned().unwrap_or_else(|| framing(bounds, aspect));
    let camera = |bounds, size| Eye::new(&first(bounds), size);
    let view = View::new(&world, &description, &camera, size, 1).expect("a view");
    let workers = [1, 2].map(|threads| Workers::new(threads).expect("threads"));
    for kind in [RayKind::Primary, RayKind::Diffuse, RayKind::Scatter] {
        let rays = view.rays(&world, kind).unwrap();
        for query in [Query::Closest, Query::Any] {
            let mut want: Option<(u64, u64)> = None;
            for tile in TILES {
                let batches = cut::<S>(&rays, tile);
                for name in ["scalar", "packet4", "packet8", "packet16", "stream"] {
                    for workers in &workers {
                        let mut answers = Answers::new(query, &batches);
                        workers.pass(engine::<S>(name).expect("an engine"), &world, &batches, &mut answers);
                        // The checksum is over the bytes of t, u, v, prim, inst in the order of the rays.
                        let got = (answers.checksum(), answers.hit_count());
                        let place = format!("{scene} {} {kind:?} {query:?} {name} {tile}", S::PRECISION);
                        assert_eq!(*want.get_or_insert(got), got, "{place}, {} threads", workers.threads());
                    }
                }
            }
            let hits = want.map_or(0, |(_, hits)| hits);
            println!("{scene} {} {kind:?} {query:?}: {hits} hits", S::PRECISION);
        }
    }
}

fn mesh(name: &str) {
    let Some(path) = shared(&format!("scenes/{name}/{name}.ply")) else { return };
    same_bits::<f32>(path.to_str().expect("UTF-8"), SIZE);
}

#[test]
fn sponza() {
    mesh("sponza_crytek");
}

#[test]
fn conference() {
    mesh("conference");
}

#[test]
fn teapot() {
    mesh("teapot");
}

#[test]
fn scenes_with_shapes_and_instances() {
    for scene in ["builtin:gallery", "builtin:sphere-flake", "builtin:teaching"] {
        same_bits::<f32>(scene, SIZE);
        same_bits::<f64>(scene, SIZE);
    }
}

/// Scenes that make trouble.
fn pathological<S: Engines>() {
    let Some(folder) = shared("scenes/pathological") else { return };
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut scenes: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "ply")).collect();
    scenes.sort();
    assert!(scenes.len() >= 13, "{scenes:?}");
    for scene in scenes {
        same_bits::<S>(scene.to_str().expect("UTF-8"), FEW);
    }
}

// Two tests, so that both cores have one: they take longest.
#[test]
fn pathological_in_f32() {
    pathological::<f32>();
}

#[test]
fn pathological_in_f64() {
    pathological::<f64>();
}
