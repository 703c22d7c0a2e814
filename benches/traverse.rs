//! Engines on whole scenes, by ray class. Elements are rays; one thread.
//!
//! Ids: `<precision>/<scene>/<class>/<engine>`. Before an engine's clock starts its answers to all rays are compared
//! bit for bit with those of `scalar` (those of `tile` up to what the oracle explains), and `scalar`'s answers to a sample with those of `brute`, which has no tree.

mod common;

use std::borrow::Cow;

use common::{Scene, crowd, soup, terrain};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lanecast::measure::answers::Answers;
use lanecast::measure::eye::{Eye, View};
use lanecast::measure::raysets::{Query, RayKind, convert};
use lanecast::measure::truth;
use lanecast::ray::Rays;
use lanecast::reference::Oracle;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engine, Engines, Scratch, engine};

/// Pixels on a side: 16 batches of 1024 rays.
const SIZE: u32 = 128;

fn run<S: Engines>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    batches: &[Rays<S>],
    answers: &mut Answers<S>,
    scratch: &mut Scratch,
) {
    match answers {
        Answers::Closest(all) => {
            for (rays, hits) in batches.iter().zip(all) {
                engine.intersect(world, rays, hits, scratch, None);
            }
        }
        Answers::Any(all) => {
            for (rays, out) in batches.iter().zip(all) {
                engine.occluded(world, rays, out, scratch, None);
            }
        }
    }
}

fn answers<S: Engines>(name: &str, world: &World<S>, batches: &[Rays<S>], query: Query) -> Answers<S> {
    let engine = engine::<S>(name).expect("a baseline engine");
    let mut answers = Answers::new(query, batches);
    run(engine, world, batches, &mut answers, &mut Scratch::default());
    answers
}

/// What `scalar` answers, once brute force agrees on two batches of it.
fn truth<S: Engines>(what: &str, world: &World<S>, batches: &[Rays<S>], query: Query) -> Answers<S> {
    // From the middle of the picture, where there is something to hit.
    let sample = &batches[batches.len() / 2..][..2];
    let (brute, scalar) = (answers("brute", world, sample, query), answers("scalar", world, sample, query));
    assert_eq!(scalar.difference(&brute), None, "{what}: scalar against brute");
    let all = answers("scalar", world, batches, query);
    assert!(all.hit_count() > 50, "{what}: only {} hits", all.hit_count());
    all
}

fn scene<S: Engines>(criterion: &mut Criterion, scene: &Scene) {
    let world = World::<S>::compile(&scene.description, Preset::Balanced).expect("the scene compiles");
    let camera = |_, size| Eye::new(&scene.camera, size);
    let view = View::new(&world, &scene.description, &camera, (SIZE, SIZE), 1).expect("a view");
    let (mut scratch, oracle) = (Scratch::default(), Oracle::new(&world.assembly));
    // Further bounces hit too little in open scenes.
    // Here rays are packed before the clock starts: the camera's own would be the primary ones again.
    let kinds = RayKind::ALL.into_iter().filter(|kind| *kind != RayKind::Camera);
    for kind in kinds.filter(|kind| kind.parent().is_none_or(|before| before.parent().is_none())) {
        let batches = convert::<S>(&view.rays(&world, kind).expect("the scalar engine"));
        let id = format!("{}/{}/{}", S::PRECISION, scene.name, kind.name());
        let want = truth(&id, &world, &batches, kind.query());
        let live: usize = batches.iter().map(Rays::live_count).sum();
        let mut group = criterion.benchmark_group(&id);
        group.throughput(Throughput::Elements(live as u64));
        group.sample_size(20);
        // Brute force is the judge here; timing it would take the day.
        for engine in S::engines().iter().filter(|e| e.name() != "brute") {
            let mut got = Answers::new(kind.query(), &batches);
            run(*engine, &world, &batches, &mut got, &mut scratch);
            if let Err(why) = truth::admit(*engine, &batches, &want, &got, || Cow::Borrowed(&oracle)) {
                panic!("{id}: {}: {why}", engine.name());
            }
            group.bench_function(engine.name(), |b| {
                b.iter(|| run(*engine, &world, &batches, &mut got, &mut scratch));
            });
        }
        group.finish();
    }
}

fn all(criterion: &mut Criterion) {
    for made in [terrain(100), soup(20_000), crowd(2000)] {
        scene::<f32>(criterion, &made);
        scene::<f64>(criterion, &made);
    }
}

criterion_group!(traverse, all);
criterion_main!(traverse);
