//! The library in forty lines: read a PLY mesh, build a world, trace a picture's worth of rays with every engine.
//!
//! `cargo run --release --example trace_mesh -- mesh.ply`

use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use lanecast::ray::{Hits, Rays};
use lanecast::scene::description::{Description, Item, ItemKind};
use lanecast::scene::world::{Preset, World};
use lanecast::scene::{ply, unpack};
use lanecast::trace::{Engines, Scratch};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::path::PathBuf::from(std::env::args().nth(1).ok_or("usage: trace_mesh MESH.ply")?);
    let mut scene = Description::new("mesh");
    scene.meshes.push(Arc::new(ply::parse(&path, &unpack::read_file(&path)?)?));
    scene.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
    let world = World::<f32>::compile(&scene, Preset::Balanced)?;
    println!("{:?}", world.stats());

    // 512 x 512 rays from a corner of the bounds to the opposite half, in 4x4 blocks so that packets are coherent.
    let (lo, hi) = world.bounds().ok_or("nothing to see")?;
    let (eye, n) = (lo.lerp(hi, 0.2), 512);
    let mut rays = Rays::new(n * n);
    for i in 0..n * n {
        let (block, inside) = (i / 16, i % 16);
        let (x, y) = (block % (n / 4) * 4 + inside % 4, block / (n / 4) * 4 + inside / 4);
        let target = lo + (hi - lo) * DVec3::new(x as f64 / n as f64, y as f64 / n as f64, 0.9);
        rays.set(i, eye.as_vec3().to_array(), (target - eye).as_vec3().to_array(), 0.0, f32::INFINITY);
    }
    let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
    for engine in f32::engines().iter().filter(|e| e.name() != "brute") {
        let start = Instant::now();
        engine.intersect(&world, &rays, &mut hits, &mut scratch, None);
        let rate = (n * n) as f64 / start.elapsed().as_secs_f64() / 1e6;
        println!("{:9} {} hits, {rate:.1} million rays per second", engine.name(), hits.hit_count());
    }
    Ok(())
}
