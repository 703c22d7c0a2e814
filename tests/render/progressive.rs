//! Pictures by blocks: each pixel is traced once per sample, a stopped picture is consistent, and the finished one has the
//! bits of the plain render.

use crate::common;

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use common::zoo;
use lanecast::camera::{Camera, framing};
use lanecast::film::{Film, PlaneData, Window};
use lanecast::ray::{Counters, Hits, Rays};
use lanecast::render::progressive::{Framebuffer, Progressive, Step, Viewer};
use lanecast::render::{Aov, Progress, RenderOptions, RenderOutput, Silent, render};
use lanecast::scene::description::{Description, Light};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Integrator;
use lanecast::trace::{Engine, Engines, Scratch, engine};
use proptest::prelude::*;

struct Scene {
    description: Description,
    world: World<f32>,
    camera: Camera,
}

fn scene(width: u32, height: u32) -> Scene {
    let mut description = zoo(5, true);
    let position = glam::DVec3::new(6.0, 9.0, 8.0);
    description.lights.push(Light::Point { position, intensity: glam::DVec3::splat(300.0) });
    let world = World::<f32>::compile(&description, Preset::Balanced).unwrap();
    let aspect = f64::from(width) / f64::from(height);
    let camera = Camera::new(&framing(world.bounds(), aspect), aspect).unwrap();
    Scene { description, world, camera }
}

fn bits(film: &Film) -> Vec<Vec<u32>> {
    let plane = |data: &PlaneData| match data {
        PlaneData::F32(v) => v.iter().map(|x| x.to_bits()).collect(),
        PlaneData::U32(v) => v.clone(),
        PlaneData::U8(v) => v.iter().map(|&level| level.into()).collect(),
    };
    film.planes.iter().map(|p| plane(&p.data)).collect()
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn by_blocks(scene: &Scene, options: &RenderOptions, start: u32, threads: usize) -> RenderOutput {
    let engine = engine::<f32>(&options.engine).unwrap();
    let mut picture =
        Progressive::new(engine, &scene.world, &scene.description, &scene.camera, options, start).unwrap();
    assert!(pool(threads).install(|| picture.run(&Silent, &())));
    picture.finish()
}

fn plain(scene: &Scene, options: &RenderOptions) -> RenderOutput {
    render(&scene.world, &scene.description, &scene.camera, options, &Silent).unwrap()
}

/// Stops when it was asked this many times.
struct StopAt(AtomicU64);

impl Progress for StopAt {
    fn tile_done(&self, _: u64) {}
    fn stopped(&self) -> bool {
        self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).is_err()
    }
}

/// A crop of a picture of this size, or none.
fn crops(width: u32, height: u32) -> impl Strategy<Value = Option<Window>> {
    let edges = (0..width, 0..height, 0..width, 0..height);
    proptest::option::of(edges.prop_map(|(a, b, c, d)| Window {
        x0: a.min(c),
        y0: b.min(d),
        x1: a.max(c) + 1,
        y1: b.max(d) + 1,
    }))
}

fn cases() -> impl Strategy<Value = (RenderOptions, u32, usize, u64)> {
    let size = prop_oneof![Just((1, 1)), Just((17, 31)), (1..90u32, 1..90u32)];
    let names = ENGINES.to_vec();
    size.prop_flat_map(move |(width, height)| {
        let look =
            proptest::sample::select(vec![Integrator::Whitted, Integrator::Ao, Integrator::Cost, Integrator::Path]);
        let numbers = (1..10u32, any::<u64>(), proptest::sample::select(vec![8, 16, 32]), 0..400u64);
        let start = proptest::sample::select(vec![1, 2, 4, 8, 16]);
        let engine = proptest::sample::select(names.clone());
        (crops(width, height), look, numbers, start, 1..4usize, engine).prop_map(
            move |(crop, integrator, (spp, seed, tile, stop), start, threads, engine)| {
                let aovs = vec![Aov::Z, Aov::Normal, Aov::Primitive];
                let engine = engine.to_string();
                let ao_samples = 3;
                let options = RenderOptions {
                    width,
                    height,
                    crop,
                    spp,
                    seed,
                    tile,
                    integrator,
                    engine,
                    aovs,
                    ao_samples,
                    ..Default::default()
                };
                (options, start, threads, stop)
            },
        )
    })
}

/// Exact ones, and one that is not.
const ENGINES: [&str; 4] = ["scalar", "packet16", "auto-exact", "tile"];

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..Default::default() })]

    #[test]
    fn the_finished_picture_is_the_plain_one((options, start, threads, _) in cases()) {
        let scene = scene(options.width, options.height);
        let (want, got) = (plain(&scene, &options), by_blocks(&scene, &options, start, threads));
        prop_assert!(got.is_complete());
        prop_assert_eq!(want.rays, got.rays);
        prop_assert!(bits(&want.film) == bits(&got.film));
    }

    /// Stopped at any point, every pixel shows its own colour or that of the corner of a block around it; continued, the
    /// picture is the plain one and no ray was traced twice.
    #[test]
    fn a_stopped_picture_is_consistent_and_can_go_on((options, start, threads, stop) in cases()) {
        let options = RenderOptions { spp: 1, ..options };
        let scene = scene(options.width, options.height);
        let want = plain(&scene, &options);
        let engine = engine::<f32>(&options.engine).unwrap();
        let make = || Progressive::new(engine, &scene.world, &scene.description, &scene.camera, &options, start).unwrap();
        let pool = pool(threads);
        let mut cut = make();
        let finished = pool.install(|| cut.run(&StopAt(AtomicU64::new(stop)), &()));
        let cut = cut.finish();
        prop_assert_eq!(finished, cut.is_complete());
        consistent(&want.film, &cut.film, start)?;
        let mut picture = make();
        for again in 0..3 {
            pool.install(|| picture.run(&StopAt(AtomicU64::new(stop / (1 + again))), &()));
        }
        prop_assert!(pool.install(|| picture.run(&Silent, &())));
        let whole = picture.finish();
        prop_assert!(whole.is_complete());
        prop_assert_eq!(want.rays, whole.rays);
        prop_assert!(bits(&want.film) == bits(&whole.film));
    }
}

fn consistent(want: &Film, got: &Film, start: u32) -> Result<(), TestCaseError> {
    let (window, want, got) = (want.window, bits(want), bits(got));
    let planes = |of: &[Vec<u32>], i: usize| of.iter().map(|plane| plane[i]).collect::<Vec<_>>();
    let width = window.width();
    for index in 0..window.area() as u32 {
        let (x, y) = (index % width, index / width);
        let shown = planes(&got, index as usize);
        let corner = |block: u32| planes(&want, (y / block * block * width + x / block * block) as usize);
        let known = [1, 2, 4, 8, 16].into_iter().filter(|&b| b <= start).any(|b| corner(b) == shown);
        // Red, green, blue, coverage of a miss in a black world.
        prop_assert!(known || shown[..4] == [0; 4], "{x},{y}");
    }
    Ok(())
}

/// Passes on to `scalar` and counts how often it sees each direction.
struct Counting(Mutex<HashMap<[u32; 3], u32>>);

impl Engine<f32> for Counting {
    fn name(&self) -> &'static str {
        "counting"
    }
    fn lanes(&self) -> usize {
        1
    }
    fn intersect(
        &self,
        world: &World<f32>,
        rays: &Rays<f32>,
        hits: &mut Hits<f32>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        let mut seen = self.0.lock().unwrap();
        for i in (0..rays.len()).filter(|&i| rays.is_live(i)) {
            *seen.entry(rays.dir(i).map(f32::to_bits)).or_default() += 1;
        }
        drop(seen);
        f32::engines()[1].intersect(world, rays, hits, scratch, counters);
    }
    fn occluded(&self, _: &World<f32>, _: &Rays<f32>, _: &mut Vec<u8>, _: &mut Scratch, _: Option<&mut Counters>) {
        unreachable!("normals need no shadows");
    }
}

/// Each pixel's ray once, seen by the engine itself.
#[test]
fn every_pixel_is_traced_exactly_once() {
    for (width, height) in [(1, 1), (17, 31), (1920, 1080)] {
        let scene = scene(width, height);
        for start in [1, 16] {
            let counting = Counting(Mutex::default());
            let options = RenderOptions { width, height, integrator: Integrator::Normals, ..Default::default() };
            let mut picture =
                Progressive::new(&counting, &scene.world, &scene.description, &scene.camera, &options, start).unwrap();
            assert!(pool(2).install(|| picture.run(&Silent, &())));
            let seen = counting.0.into_inner().unwrap();
            assert_eq!(seen.len() as u32, width * height, "{width}x{height} from {start}: directions differ by pixel");
            assert!(seen.values().all(|&times| times == 1), "{width}x{height} from {start}");
        }
    }
}

/// Remembers the steps and how many pixels were set after each.
#[derive(Default)]
struct Steps(Mutex<Vec<(Step, u64)>>);

impl Viewer for Steps {
    fn painted(&self, frame: &Framebuffer, part: Window) {
        assert!(part.area() > 0 && frame.window().index(part.x1 - 1, part.y1 - 1).is_some());
        // Whatever was painted is seen.
        assert!(frame.shown(part.x0, part.y0).is_some() && frame.shown(part.x1 - 1, part.y1 - 1).is_some());
    }
    fn step_done(&self, frame: &Framebuffer, step: Step) {
        self.0.lock().unwrap().push((step, frame.left()));
    }
}

#[test]
fn steps_come_in_order_and_set_what_they_say() {
    let (width, height) = (70, 33);
    let scene = scene(width, height);
    let options = RenderOptions { width, height, spp: 5, engine: "scalar".into(), ..Default::default() };
    let scalar = engine::<f32>("scalar").unwrap();
    let mut picture = Progressive::new(scalar, &scene.world, &scene.description, &scene.camera, &options, 16).unwrap();
    let steps = Steps::default();
    assert!(pool(2).install(|| picture.run(&Silent, &steps)));
    let left = |block: u32| u64::from(width * height - width.div_ceil(block) * height.div_ceil(block));
    let want = [
        (Step::Blocks(16), left(16)),
        (Step::Blocks(8), left(8)),
        (Step::Blocks(4), left(4)),
        (Step::Blocks(2), left(2)),
        (Step::Blocks(1), 0),
        (Step::Samples(4), 0),
        (Step::Samples(5), 0),
    ];
    assert_eq!(*steps.0.lock().unwrap(), want);
}

#[test]
fn starts_out_of_range_are_refused() {
    let scene = scene(4, 4);
    let options = RenderOptions { width: 4, height: 4, ..Default::default() };
    let scalar = engine::<f32>("scalar").unwrap();
    let refused = Progressive::new(scalar, &scene.world, &scene.description, &scene.camera, &options, 3).err();
    assert!(refused.unwrap().to_string().contains("1, 2, 4, 8 or 16"));
}
