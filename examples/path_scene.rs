//! Renders a scene of tests/mitsuba by paths: its time, or the variance of its pixels over pictures of many seeds.
//!
//! `cargo run --release --example path_scene -- SCENE.json SIZE SPP THREADS SEEDS [OUT.npy]`
//!
//! Prints one JSON object; OUT.npy has rows, columns, and mean red, green, blue and the variance of the brightness of
//! one picture. tests/python/mitsuba_speed.py compares both with Mitsuba.

#[path = "../tests/path_support/neutral.rs"]
mod neutral;

use std::path::Path;

use lanecast::camera::Filter;
use lanecast::film::npy;
use lanecast::measure::env::REVISION;
use lanecast::render::{RenderOptions, Silent, render};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Integrator;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let usage = "usage: path_scene SCENE.json SIZE SPP THREADS SEEDS [OUT.npy]";
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene, size, spp, threads, seeds, out @ ..] = &args[..] else { return Err(usage.into()) };
    let (size, spp, seeds): (u32, u32, u32) = (size.parse()?, spp.parse()?, seeds.parse()?);
    let scene = neutral::Neutral::read(Path::new(scene));
    let description = scene.description();
    let world = World::<f32>::compile(&description, Preset::Balanced)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build()?;
    let mut sums = vec![[0.0f64; 5]; (size * size) as usize];
    let mut seconds = Vec::new();
    for seed in 0..seeds {
        let options = RenderOptions {
            width: size,
            height: size,
            spp,
            depth: scene.depth,
            seed: u64::from(seed),
            integrator: Integrator::Path,
            filter: Filter::Box,
            ..RenderOptions::default()
        };
        let output = pool.install(|| render(&world, &description, &scene.camera(), &options, &Silent))?;
        seconds.push(output.seconds);
        let plane = |name: &str| output.film.f32_plane(name).ok_or("a plane is missing");
        let [red, green, blue] = [plane("R")?, plane("G")?, plane("B")?];
        for (i, sum) in sums.iter_mut().enumerate() {
            let color = [red[i], green[i], blue[i]].map(f64::from);
            let brightness = (color[0] + color[1] + color[2]) / 3.0;
            (0..3).for_each(|c| sum[c] += color[c]);
            sum[3] += brightness;
            sum[4] += brightness * brightness;
        }
    }
    if let [out] = out {
        let n = f64::from(seeds);
        let planes: [Vec<f32>; 4] = std::array::from_fn(|plane| {
            let value = |s: &[f64; 5]| if plane < 3 { s[plane] / n } else { (s[4] - s[3] * s[3] / n) / (n - 1.0) };
            sums.iter().map(|s| value(s) as f32).collect()
        });
        npy::write_stack(Path::new(out), size, size, &planes.each_ref().map(|plane| &plane[..]))?;
    }
    let paths = u64::from(size) * u64::from(size) * u64::from(spp);
    println!("{}", serde_json::json!({ "seconds": seconds, "paths": paths, "revision": REVISION }));
    Ok(())
}
