//! Threads, tile sizes and repetitions change no bit of a picture; a stopped render keeps what was finished.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DAffine3, DMat3, DVec3};
use lanecast::camera::{Camera, framing};
use lanecast::film::{PlaneData, Window, pix};
use lanecast::render::progressive::Progressive;
use lanecast::render::{Aov, Progress, RenderOptions, RenderOutput, Silent, render};
use lanecast::scene::description::{
    CameraDescription, Description, Item, ItemKind, Light, Material, Projection, Shape,
};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

/// Spheres in a row on a plane, every second one a mirror.
fn scene() -> Description {
    let mut d = Description::new("row");
    d.background = DVec3::new(0.2, 0.3, 0.5);
    d.materials.push(Material { mirror: DVec3::splat(0.6), ..Material::default() });
    let turn = DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let plane = DAffine3::from_mat3_translation(turn, DVec3::new(0.0, -1.0, 0.0));
    let item = |transform, material, shape| Item { transform, material: Some(material), kind: ItemKind::Shape(shape) };
    d.groups[0].items.push(item(plane, 0, Shape::HalfSpace));
    for i in 0..5u32 {
        let place = DAffine3::from_translation(DVec3::new(f64::from(i) * 1.7 - 3.4, 0.0, f64::from(i % 3)));
        d.groups[0].items.push(item(place, i % 2, Shape::Sphere));
    }
    d.lights.push(Light::Point { position: DVec3::new(2.0, 6.0, 5.0), intensity: DVec3::splat(90.0) });
    d.lights.push(Light::Directional { direction: DVec3::new(1.0, -2.0, -1.0), irradiance: DVec3::splat(1.0) });
    d
}

fn bits(output: &RenderOutput) -> Vec<(String, Vec<u32>)> {
    let plane_bits = |data: &PlaneData| match data {
        PlaneData::F32(v) => v.iter().map(|x| x.to_bits()).collect(),
        PlaneData::U32(v) => v.clone(),
        PlaneData::U8(v) => v.iter().map(|&level| level.into()).collect(),
    };
    output.film.planes.iter().map(|plane| (plane.name.clone(), plane_bits(&plane.data))).collect()
}

fn options() -> RenderOptions {
    let aovs = Aov::ALL.to_vec();
    RenderOptions { width: 67, height: 45, spp: 3, ao_samples: 4, engine: "scalar".into(), aovs, ..Default::default() }
}

fn threads_and_tiles_change_nothing<S: Shades>() {
    let d = scene();
    let world = World::<S>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 67.0 / 45.0), 67.0 / 45.0).unwrap();
    // Of paths several samples are traced together: here one, one, two, two.
    for (integrator, spp) in
        [(Integrator::Whitted, 3), (Integrator::Ao, 3), (Integrator::Cost, 3), (Integrator::Path, 6)]
    {
        let mut first = None;
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for tile in [8, 16, 32] {
                let options = RenderOptions { tile, integrator, spp, ..options() };
                let output = pool.install(|| render(&world, &d, &camera, &options, &Silent).unwrap());
                assert!(output.is_complete());
                let got = (bits(&output), output.rays);
                let want = first.get_or_insert_with(|| got.clone());
                assert!(got == *want, "{integrator:?}, {threads} threads, tiles of {tile}");
            }
        }
        let (planes, rays) = first.unwrap();
        assert_eq!(rays.primary, 67 * 45 * u64::from(spp));
        assert_eq!(planes[4].0, "Z");
        assert!(planes[4].1.iter().any(|&b| b != planes[4].1[0]), "a picture with something in it");
    }
}

#[test]
fn threads_and_tiles_change_nothing_in_f32() {
    threads_and_tiles_change_nothing::<f32>();
}

#[test]
fn threads_and_tiles_change_nothing_in_f64() {
    threads_and_tiles_change_nothing::<f64>();
}

/// Tiles in which no ray can meet anything are shaded without their rays, but not where the work is counted.
fn tiles_without_anything_are_as_others<S: Shades>() {
    let mut d = scene();
    // Without the plane there is nothing around the spheres.
    d.groups[0].items.remove(0);
    let world = World::<S>::compile(&d, Preset::Balanced).unwrap();
    let framed = framing(world.bounds(), 1.5);
    let wide = Projection::Parallel { height: 12.0 };
    let parallel = CameraDescription { projection: wide, ..framed.clone() };
    for (description, width) in [(&framed, 240), (&parallel, 240), (&parallel, 223)] {
        let camera = Camera::new(description, 1.5).unwrap();
        for integrator in [Integrator::Whitted, Integrator::Ao, Integrator::Normals, Integrator::Depth] {
            for aovs in [Vec::new(), vec![Aov::Z, Aov::Primitive, Aov::Cryptomatte]] {
                let (spp, height) = (if width == 240 { 1 } else { 2 }, width * 2 / 3);
                let options = RenderOptions { width, height, spp, integrator, aovs, ..options() };
                let [quick, counted] = [false, true].map(|count| {
                    render(&world, &d, &camera, &RenderOptions { count, ..options.clone() }, &Silent).unwrap()
                });
                assert!(bits(&quick) == bits(&counted), "{integrator:?}, {width}");
                assert_eq!((quick.rays, counted.rays.primary), (counted.rays, u64::from(width * height * spp)));
                let of_tile = |x0: u32| (0..32).any(|dx| quick.film.f32_plane("A").unwrap()[(x0 + dx) as usize] > 0.0);
                assert!(integrator == Integrator::Whitted || !of_tile(0), "the first tile is empty");
            }
        }
    }
}

#[test]
fn tiles_without_anything_are_as_others_in_either_precision() {
    tiles_without_anything_are_as_others::<f32>();
    tiles_without_anything_are_as_others::<f64>();
}

/// What a `.pix` file gets is the same whether the film holds levels or floats.
#[test]
fn levels_are_those_of_the_colours() {
    let d = scene();
    let world = World::<f64>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 1.5), 1.5).unwrap();
    for (spp, stops, crop) in [(1, 0.0, None), (3, -1.7, None), (1, 0.6, Some(Window { x0: 5, y0: 3, x1: 61, y1: 44 }))]
    {
        let floats = RenderOptions { spp, crop, aovs: Vec::new(), ..options() };
        let levels = RenderOptions { levels: Some(stops), ..floats.clone() };
        let [floats, levels] = [floats, levels].map(|o| render(&world, &d, &camera, &o, &Silent).unwrap().film);
        assert_eq!(levels.planes.iter().map(|plane| plane.name.as_str()).collect::<Vec<_>>(), ["R", "G", "B"]);
        assert!(levels.planes.iter().all(|plane| matches!(plane.data, PlaneData::U8(_))));
        let bytes = pix::to_bytes(&floats, stops).unwrap();
        assert!(bytes.iter().any(|&byte| byte != bytes[0]), "a picture with something in it");
        assert!(pix::to_bytes(&levels, stops).unwrap() == bytes, "{spp} samples, {stops} stops");
    }
    let blocks = RenderOptions { levels: Some(0.0), ..options() };
    let engine = lanecast::trace::engine::<f64>("scalar").unwrap();
    let error = Progressive::new(engine, &world, &d, &camera, &RenderOptions { aovs: Vec::new(), ..blocks }, 4).err();
    assert!(error.unwrap().to_string().contains("levels"));
}

#[test]
fn the_seed_changes_samples_but_not_single_sample_pictures() {
    let d = scene();
    let world = World::<f32>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 1.5), 1.5).unwrap();
    let picture =
        |spp, seed| bits(&render(&world, &d, &camera, &RenderOptions { spp, seed, ..options() }, &Silent).unwrap());
    assert!(picture(1, 1) == picture(1, 2), "one sample goes through the centre");
    assert!(picture(2, 1) != picture(2, 2));
}

/// Every generic engine, packets of all widths included, gives the picture of `scalar`. (`tile`, and so `auto`,
/// computes in a frame of its own and is judged by `verify`.)
fn engines_agree<S: Shades>() {
    let d = scene();
    let world = World::<S>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 1.5), 1.5).unwrap();
    let picture = |name: &str| {
        let aovs = vec![Aov::Z, Aov::Normal, Aov::Instance, Aov::Primitive];
        let options = RenderOptions { engine: name.into(), aovs, ..options() };
        bits(&render(&world, &d, &camera, &options, &Silent).unwrap())
    };
    let want = picture("scalar");
    let names: Vec<&str> = S::engines().iter().filter(|e| e.is_exact()).map(|e| e.name()).collect();
    assert!(names.len() >= 3, "{names:?}");
    for name in names {
        assert!(picture(name) == want, "{name}");
    }
}

#[test]
fn engines_agree_on_every_bit() {
    engines_agree::<f32>();
    engines_agree::<f64>();
}

/// Stops after some tiles.
struct StopAfter {
    left: AtomicU64,
    total: AtomicU64,
}

impl Progress for StopAfter {
    fn tile_done(&self, total: u64) {
        self.total.store(total, Ordering::SeqCst);
        self.left.fetch_sub(1, Ordering::SeqCst);
    }
    fn stopped(&self) -> bool {
        self.left.load(Ordering::SeqCst) == 0
    }
}

#[test]
fn a_stopped_render_keeps_the_finished_tiles_and_says_so() {
    let d = scene();
    let world = World::<f32>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 1.5), 1.5).unwrap();
    let options = RenderOptions { tile: 16, ..options() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let whole = pool.install(|| render(&world, &d, &camera, &options, &Silent).unwrap());
    let stop = StopAfter { left: AtomicU64::new(4), total: AtomicU64::new(0) };
    let part = pool.install(|| render(&world, &d, &camera, &options, &stop).unwrap());
    assert_eq!((part.tiles_done, part.tiles_total, part.is_complete()), (4, 15, false));
    assert_eq!(stop.total.load(Ordering::SeqCst), 15);
    let (part, whole) = (bits(&part), bits(&whole));
    // R, and the coverage: each pixel is either the whole picture's or untouched.
    let untouched = (0..67 * 45).filter(|&i| part[3].1[i] == 0 && part[0].1[i] == 0).count();
    assert!((0..67 * 45).all(|i| part[0].1[i] == whole[0].1[i] || part[0].1[i] == 0));
    assert!((67 * 45 - 4 * 256..67 * 45).contains(&untouched));
}

/// Stops when it was asked this many times.
struct StopAt(AtomicU64);

impl Progress for StopAt {
    fn tile_done(&self, _: u64) {}
    fn stopped(&self) -> bool {
        self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).is_err()
    }
}

/// Where rounds go over all tiles, each has some samples when the picture is stopped: that does not make it whole. A time limit that is
/// over does.
#[test]
fn a_render_stopped_between_rounds_is_not_complete() {
    let d = scene();
    let world = World::<f32>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&framing(world.bounds(), 1.5), 1.5).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let made = |noise, time_limit, asked| {
        let options = RenderOptions { tile: 16, spp: 1 << 16, noise, time_limit, aovs: Vec::new(), ..options() };
        let stop = StopAt(AtomicU64::new(asked));
        let output = pool.install(|| render(&world, &d, &camera, &options, &stop).unwrap());
        (output.tiles_done, output.is_complete())
    };
    // Rounds of 4, 8 and 16 samples in 15 tiles: the third ends early.
    assert_eq!(made(Some(1e-9), None, 200), (15, false));
    assert_eq!(made(None, Some(1e6), 200), (15, false));
    assert!(!made(None, Some(1e6), 20).1);
    assert_eq!(made(None, Some(1e-9), 200), (15, true));
    // Enough before the stop is asked for.
    assert_eq!(made(Some(1e9), None, 1000), (15, true));
}
