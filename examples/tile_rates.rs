//! Rates of `scalar`, `packet16` and `tile` on a mesh, interleaved: primary rays and shadow rays to a point light.
//!
//! `cargo run --release --example tile_rates -- mesh.ply views.json SCENE [VIEW]`

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::scene::description::{Description, Item, ItemKind};
use lanecast::scene::world::{Preset, World};
use lanecast::scene::{ply, unpack};
use lanecast::trace::{Engine, Scratch, engine};

type Failure = Box<dyn std::error::Error>;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 576;
const TILE: u32 = 32;
const REPEATS: usize = 11;

/// A pinhole camera.
struct View {
    name: String,
    eye: DVec3,
    target: DVec3,
    up: DVec3,
    fov: f64,
}

fn main() -> Result<(), Failure> {
    let usage = "usage: tile_rates MESH.ply VIEWS.json SCENE [VIEW]";
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, views, scene, wanted @ ..] = &args[..] else { return Err(usage.into()) };
    let world = world(&PathBuf::from(mesh))?;
    for view in read_views(Path::new(views), scene)? {
        if wanted.first().is_some_and(|name| *name != view.name) {
            continue;
        }
        let primary = camera_rays(&view);
        let shadow = shadow_rays(&world, &view, &primary);
        rates(&world, &format!("{scene} {} primary", view.name), &primary, false)?;
        rates(&world, &format!("{scene} {} shadow", view.name), &shadow, true)?;
    }
    Ok(())
}

fn world(path: &Path) -> Result<World<f32>, Failure> {
    let mut scene = Description::new("mesh");
    scene.meshes.push(Arc::new(ply::parse(path, &unpack::read_file(path)?)?));
    scene.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
    Ok(World::compile(&scene, Preset::Balanced)?)
}

fn read_views(path: &Path, scene: &str) -> Result<Vec<View>, Failure> {
    let all: serde_json::Value = serde_json::from_slice(&std::fs::read(path)?)?;
    let list = all[scene].as_array().ok_or("no views of this scene")?;
    let vector = |v: &serde_json::Value| DVec3::from_array([0, 1, 2].map(|i| v[i].as_f64().unwrap_or(0.0)));
    let view = |v: &serde_json::Value| View {
        name: v["name"].as_str().unwrap_or("?").into(),
        eye: vector(&v["eye"]),
        target: vector(&v["target"]),
        up: vector(&v["up"]),
        fov: v["fov_deg"].as_f64().unwrap_or(60.0).to_radians(),
    };
    Ok(list.iter().map(view).collect())
}

/// Batches of 32x32 pixels in Morton order.
fn camera_rays(view: &View) -> Vec<Rays<f32>> {
    let forward = (view.target - view.eye).normalize();
    let right = forward.cross(view.up).normalize();
    let up = right.cross(forward);
    let half = (view.fov / 2.0).tan();
    let even = |i: u32| (0..5).fold(0, |x, bit| x | (i >> (2 * bit) & 1) << bit);
    let mut batches = Vec::new();
    for tile in 0..WIDTH / TILE * (HEIGHT / TILE) {
        let (x0, y0) = (tile % (WIDTH / TILE) * TILE, tile / (WIDTH / TILE) * TILE);
        let mut rays = Rays::new((TILE * TILE) as usize);
        for i in 0..TILE * TILE {
            let (x, y) = (f64::from(x0 + even(i)) + 0.5, f64::from(y0 + even(i >> 1)) + 0.5);
            let (w, h) = (f64::from(WIDTH), f64::from(HEIGHT));
            let dir = forward + right * (half * (2.0 * x - w) / h) + up * (half * (h - 2.0 * y) / h);
            let org = view.eye.as_vec3().to_array();
            rays.set(i as usize, org, dir.as_vec3().to_array(), 0.0, f32::INFINITY);
        }
        batches.push(rays);
    }
    batches
}

/// From each hit a little off the surface to a light above the eye, t = 1.
fn shadow_rays(world: &World<f32>, view: &View, primary: &[Rays<f32>]) -> Vec<Rays<f32>> {
    let (lo, hi) = world.bounds().unwrap_or_default();
    let light = view.eye + (hi - lo).length() * 0.05 * view.up + 1e-3 * (hi - lo);
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    let trace = |from: &Rays<f32>| {
        let scalar = engine::<f32>("scalar").expect("an engine of this name");
        scalar.intersect(world, from, &mut hits, &mut scratch, None);
        let mut rays = Rays::new(from.len());
        for i in (0..from.len()).filter(|&i| hits.is_hit(i)) {
            let (org, dir) = (from.org(i).map(f64::from), from.dir(i).map(f64::from));
            let t = f64::from(hits.t[i]) * (1.0 - 1e-4);
            let org = (DVec3::from_array(org) + DVec3::from_array(dir) * t).as_vec3();
            let dir = (light - org.as_dvec3()).as_vec3();
            rays.set(i, org.to_array(), dir.to_array(), 0.0, 1.0);
        }
        rays
    };
    primary.iter().map(trace).collect()
}

fn rates(world: &World<f32>, title: &str, batches: &[Rays<f32>], any: bool) -> Result<(), Failure> {
    let engines = ["scalar", "packet16", "tile"].map(engine::<f32>);
    let [scalar, packet, tile] = engines;
    let engines = [scalar?, packet?, tile?];
    let mut scratch = Scratch::default();
    let rays: usize = batches.iter().map(Rays::len).sum();
    let mut results = engines.map(|_| (Vec::new(), 0u64));
    for repeat in 0..=REPEATS {
        for (engine, (seconds, sum)) in engines.iter().zip(&mut results) {
            let start = Instant::now();
            let checksum = trace(*engine, world, batches, any, &mut scratch);
            // The first round warms up.
            if repeat > 0 {
                seconds.push(start.elapsed().as_secs_f64());
            }
            *sum = checksum;
        }
    }
    let mut medians = [0.0; 3];
    for (median, (seconds, _)) in medians.iter_mut().zip(&mut results) {
        seconds.sort_by(f64::total_cmp);
        *median = rays as f64 / seconds[REPEATS / 2] / 1e6;
    }
    let best = results.each_ref().map(|(seconds, _)| rays as f64 / seconds[0] / 1e6);
    println!("{title}");
    for ((engine, (_, sum)), (median, best)) in engines.iter().zip(&results).zip(medians.iter().zip(best)) {
        let (by_median, by_best) = (median / medians[1], best / (rays as f64 / results[1].0[0] / 1e6));
        println!(
            "  {:9} median {median:6.1} best {best:6.1} Mrays/s, {by_median:4.2} ({by_best:4.2}) x packet16, sum {sum:x}",
            engine.name()
        );
    }
    let mut counters = Counters::default();
    let (mut hits, mut out) = (Hits::default(), Vec::new());
    for rays in batches {
        match any {
            true => engines[2].occluded(world, rays, &mut out, &mut scratch, Some(&mut counters)),
            false => engines[2].intersect(world, rays, &mut hits, &mut scratch, Some(&mut counters)),
        }
    }
    println!("  {counters:?}");
    Ok(())
}

/// Traces everything; returns a sum that depends on every answer.
fn trace(engine: &dyn Engine<f32>, world: &World<f32>, batches: &[Rays<f32>], any: bool, scratch: &mut Scratch) -> u64 {
    let (mut hits, mut out, mut sum) = (Hits::default(), Vec::new(), 0u64);
    for rays in batches {
        if any {
            engine.occluded(world, rays, &mut out, scratch, None);
            sum = sum.wrapping_mul(31).wrapping_add(out.iter().map(|&x| u64::from(x)).sum());
        } else {
            engine.intersect(world, rays, &mut hits, scratch, None);
            let bits = |i: usize| u64::from(hits.t[i].to_bits() ^ hits.u[i].to_bits().rotate_left(9) ^ hits.prim[i]);
            sum = sum.wrapping_mul(31).wrapping_add(bits(0) + bits(rays.len() / 3) + bits(rays.len() - 1));
        }
    }
    sum
}
