//! Finished tiles that are kept in a file: a render that was stopped goes on with the same bits, whatever became of the file.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use lanecast::camera::Camera;
use lanecast::error::Error;
use lanecast::film::{Film, PlaneData};
use lanecast::render::{Aov, Keeper, Progress, RenderOptions, RenderOutput, render_kept};
use lanecast::scene::description::Description;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::engine;

/// Tiles of the picture.
const TILES: u64 = 24;

/// Stops after some tiles.
struct StopAfter {
    most: u64,
    seen: AtomicU64,
}

impl Progress for StopAfter {
    fn tile_done(&self, total: u64) {
        assert_eq!(total, TILES);
        self.seen.fetch_add(1, Ordering::Relaxed);
    }
    fn stopped(&self) -> bool {
        self.seen.load(Ordering::Relaxed) >= self.most
    }
}

struct Scene {
    description: Description,
    world: World<f32>,
    camera: Camera,
    options: RenderOptions,
}

impl Scene {
    fn new() -> Self {
        let description = load("builtin:gallery", &LoadOptions::default()).expect("a scene");
        let world = World::compile(&description, Preset::Balanced).expect("a world");
        let camera = Camera::new(&description.cameras[0], 90.0 / 60.0).expect("a camera");
        let aovs = vec![Aov::Z, Aov::Primitive, Aov::Cryptomatte];
        let options = RenderOptions { width: 90, height: 60, tile: 16, spp: 2, aovs, ..RenderOptions::default() };
        Self { description, world, camera, options }
    }

    /// Renders up to `most` tiles, of which those in `file` are some; also how many tiles that took.
    fn render(&self, file: Option<(&Path, &str)>, most: u64) -> Result<(RenderOutput, u64), Error> {
        let progress = StopAfter { most, seen: AtomicU64::new(0) };
        let keeper = file.map(|(path, of)| Keeper::new(path.into(), of));
        let (Self { description, world, camera, options }, engine) =
            (self, engine::<f32>("scalar").expect("an engine"));
        let output = render_kept(engine, world, description, camera, options, &progress, keeper.as_ref())?;
        assert!(keeper.is_none_or(|keeper| keeper.trouble().is_none()));
        Ok((output, progress.seen.load(Ordering::Relaxed)))
    }
}

/// Bits of all planes, NaNs too.
fn bits(film: &Film) -> Vec<(&str, Vec<u32>)> {
    let of = |data: &PlaneData| match data {
        PlaneData::F32(values) => values.iter().map(|x| x.to_bits()).collect(),
        PlaneData::U32(values) => values.clone(),
        PlaneData::U8(values) => values.iter().map(|x| u32::from(*x)).collect(),
    };
    film.planes.iter().map(|plane| (plane.name.as_str(), of(&plane.data))).collect()
}

fn assert_same(got: &RenderOutput, want: &RenderOutput, what: &str) {
    assert!(got.is_complete() && got.tiles_total == TILES, "{what}");
    assert_eq!(bits(&got.film), bits(&want.film), "{what}");
    assert_eq!((&got.film.texts, got.rays), (&want.film.texts, want.rays), "{what}");
}

#[test]
fn a_stopped_render_goes_on_with_the_same_bits() {
    let (dir, scene) = (tempfile::tempdir().expect("a folder"), Scene::new());
    let path = dir.path().join("out.exr.tiles");
    let (whole, _) = scene.render(None, u64::MAX).expect("a picture");
    assert!(whole.film.texts.iter().any(|(name, _)| name.contains("manifest")), "mattes have names");
    let (first, done) = scene.render(Some((&path, "a")), 9).expect("a part");
    assert!(!first.is_complete() && (9..TILES).contains(&first.tiles_done) && done == first.tiles_done, "{done}");
    // Once more, and then to the end.
    let (second, seen) = scene.render(Some((&path, "a")), 15).expect("a part");
    assert!(second.tiles_done >= 15 && seen == second.tiles_done, "{seen}");
    let (third, seen) = scene.render(Some((&path, "a")), u64::MAX).expect("a picture");
    assert_same(&third, &whole, "in three parts");
    assert_eq!(seen, TILES, "those of before count as done");
    // All of them are there now: nothing is left to trace.
    let before = std::fs::metadata(&path).expect("a file").len();
    assert_same(&scene.render(Some((&path, "a")), u64::MAX).expect("a picture").0, &whole, "all kept");
    assert_eq!(std::fs::metadata(&path).expect("a file").len(), before, "no tile is kept twice");
}

#[test]
fn a_broken_file_costs_tiles_and_no_bits() {
    let (dir, scene) = (tempfile::tempdir().expect("a folder"), Scene::new());
    let path = dir.path().join("tiles");
    let (whole, _) = scene.render(None, u64::MAX).expect("a picture");
    scene.render(Some((&path, "a")), u64::MAX).expect("a picture");
    let bytes = std::fs::read(&path).expect("a file");
    for at in (0..bytes.len()).step_by(bytes.len() / 9) {
        std::fs::write(&path, &bytes[..at]).expect("a file");
        assert_same(&scene.render(Some((&path, "a")), u64::MAX).expect("a picture").0, &whole, &format!("cut at {at}"));
        assert_eq!(std::fs::metadata(&path).expect("a file").len() / 1000, bytes.len() as u64 / 1000, "whole again");
    }
    // Behind the head, where a number, a length, a note, pixels or a digest are.
    for at in (40..bytes.len()).step_by(bytes.len() / 13).chain([40, 43, 44, 46, 47, 48, 60]) {
        let mut broken = bytes.clone();
        broken[at] ^= 0x55;
        std::fs::write(&path, broken).expect("a file");
        assert_same(
            &scene.render(Some((&path, "a")), u64::MAX).expect("a picture").0,
            &whole,
            &format!("broken at {at}"),
        );
    }
}

#[test]
fn tiles_of_another_picture_and_other_files_are_left_alone() {
    let (dir, scene) = (tempfile::tempdir().expect("a folder"), Scene::new());
    let path = dir.path().join("tiles");
    scene.render(Some((&path, "a")), 3).expect("a part");
    let before = std::fs::read(&path).expect("a file");
    let error = scene.render(Some((&path, "b")), 3).map(|_| ()).expect_err("another picture");
    assert!(matches!(&error, Error::Usage(what) if what.contains("another picture")), "{error}");
    assert_eq!(std::fs::read(&path).expect("a file"), before);
    for other in ["LCtile", "x", "a letter of mine that is longer than forty characters"] {
        std::fs::write(&path, other).expect("a file");
        let ended = scene.render(Some((&path, "a")), 3).map(|_| ());
        match "LCtiles1".starts_with(other) {
            true => ended.expect("a head that was cut off"),
            false => {
                let error = ended.expect_err("not such a file");
                assert!(matches!(error, Error::Input(_)), "{error}");
                assert_eq!(std::fs::read_to_string(&path).expect("a file"), other);
            }
        }
    }
    let adaptive = Scene { options: RenderOptions { noise: Some(0.1), ..scene.options.clone() }, ..scene };
    assert!(matches!(adaptive.render(Some((&path, "a")), 3), Err(Error::Usage(_))));
}
