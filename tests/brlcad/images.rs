//! BRL-CAD's own benchmark images, pixel by pixel, in the classes of its `pixcmp`.

use std::path::Path;

use lanecast::camera::Camera;
use lanecast::film::pix;
use lanecast::render::{RenderOptions, Silent, render};
use lanecast::scene::brlcad;
use lanecast::scene::brlcad::describe::{Options, describe};
use lanecast::scene::brlcad::view::{self, View};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

use crate::brlcad_support;
use brlcad_support::shared;

const SIDE: u32 = 512;
/// Of all pixels, how many may differ by more than one level.
const OFF_BY_MANY: f64 = 0.001;
/// The same between f32 and f64: chains of mirrored rays magnify what roundings start.
const F32_OFF_BY_MANY: f64 = 0.005;

/// The picture of `name` below `top` in the precision `S` as the bytes of a `.pix` file.
fn picture<S: Shades>(name: &str, top: &str) -> Option<Vec<u8>> {
    let (db, script) = (shared(&format!("db/{name}.asc"))?, shared(&format!("views/{name}.rt"))?);
    let brlcad = Options { tops: vec![top.into()], lenient: false };
    let description = load(db.to_str().unwrap(), &LoadOptions { brlcad, ..Default::default() }).unwrap();
    let world = World::<S>::compile(&description, Preset::Balanced).unwrap();
    let view = view::parse(&script, &std::fs::read(&script).unwrap()).unwrap();
    let camera = Camera::of_view(&view, 1.0).unwrap();
    let options = RenderOptions { width: SIDE, height: SIDE, integrator: Integrator::Rt, ..Default::default() };
    let output = render(&world, &description, &camera, &options, &Silent).unwrap();
    println!("{name}: {:?}, {:.2} s", output.rays, output.seconds);
    Some(pix::to_bytes(&output.film, 0.0).unwrap())
}

/// Pixels that match, are off by one level and by more, as `pixcmp` counts them.
fn classes(found: &[u8], expected: &[u8]) -> [u32; 3] {
    assert_eq!(found.len(), expected.len());
    let mut classes = [0; 3];
    for (f, e) in found.chunks_exact(3).zip(expected.chunks_exact(3)) {
        let off = f.iter().zip(e).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        classes[usize::from(off.min(2))] += 1;
    }
    classes
}

/// Against the reference image in f64, and in f32 against that.
fn check(name: &str, top: &str) {
    let Some(reference) = shared(&format!("ref/{name}.pix")) else { return };
    let Some(found) = picture::<f64>(name, top) else { return };
    let [matching, by_one, by_many] = classes(&found, &std::fs::read(reference).unwrap());
    println!("{name}: {matching} matching, {by_one} off by one, {by_many} off by many");
    assert!(f64::from(by_many) <= OFF_BY_MANY * f64::from(SIDE * SIDE), "{name}: {by_many} pixels are off by many");
    check_f32(name, top, &found);
}

/// The picture in f32 against that in f64, `wide`.
fn check_f32(name: &str, top: &str, wide: &[u8]) {
    let [matching, by_one, by_many] = classes(&picture::<f32>(name, top).unwrap(), wide);
    println!("{name} in f32: {matching} matching, {by_one} off by one, {by_many} off by many");
    assert!(f64::from(by_many) <= F32_OFF_BY_MANY * f64::from(SIDE * SIDE), "{name} in f32: {by_many} off by many");
}

#[test]
fn moss() {
    check("moss", "all.g");
}

#[test]
fn world() {
    check("world", "all.g");
}

#[test]
fn bldg391() {
    check("bldg391", "all.g");
}

#[test]
fn sphflake() {
    check("sphflake", "scene.r");
}

/// No reference here: they must come out, not black, and the same twice.
#[test]
fn star_and_m35_render() {
    for (name, top) in [("star", "all"), ("m35", "all.g")] {
        let (Some(once), Some(twice)) = (picture::<f64>(name, top), picture::<f64>(name, top)) else { return };
        assert_eq!(once, twice);
        let bright = once.chunks_exact(3).filter(|pixel| pixel.iter().any(|&b| b > 20)).count();
        assert!(bright > 50_000, "{name}: {bright} pixels");
        check_f32(name, top, &once);
    }
}

/// Colour of the middle of a small picture of `text`, seen from `eye` with the orientation `turn` (a quaternion), and how many
/// of its pixels are otherwise.
fn middle<S: Shades>(text: &str, eye: &str, turn: &str) -> ([u8; 3], usize) {
    let file = Path::new("d.asc");
    let database = brlcad::parse(file, text.as_bytes()).unwrap();
    let description = describe(file, "d", &database, &Options::default()).unwrap();
    let world = World::<S>::compile(&description, Preset::Balanced).unwrap();
    let script = format!("viewsize 10;\norientation {turn};\neye_pt {eye};\nstart 0;\nend;\n");
    let camera = Camera::of_view(&view::parse(Path::new("d.rt"), script.as_bytes()).unwrap(), 1.0).unwrap();
    let options = RenderOptions { width: 40, height: 40, integrator: Integrator::Rt, ..Default::default() };
    let film = render(&world, &description, &camera, &options, &Silent).unwrap().film;
    let bytes = pix::to_bytes(&film, 0.0).unwrap();
    let pixels: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|pixel| pixel.try_into().unwrap()).collect();
    let middle = pixels[20 * 40 + 20];
    (middle, pixels.iter().filter(|pixel| **pixel != middle).count())
}

/// What surrounds a thing is the same whether its tiles are shaded with their rays or without.
fn surroundings_are_seen_without_rays<S: Shades>() {
    let ball = "title {t}\nunits mm\nput b ell V {0 0 0} A {1 0 0} B {0 1 0} C {0 0 1}\n";
    let region = "put r comb region yes tree {l b}\n";
    let sky = "put s comb region yes shader {envmap cloud} tree {l b}\nput all comb region no tree {u {l r} {l s}}\n";
    for (text, surrounded) in [(format!("{ball}{region}"), false), (format!("{ball}{region}{sky}"), true)] {
        let file = Path::new("d.asc");
        let database = brlcad::parse(file, text.as_bytes()).unwrap();
        let description = describe(file, "d", &database, &Options::default()).unwrap();
        assert_eq!(description.looks.as_ref().unwrap().surroundings.is_some(), surrounded);
        let world = World::<S>::compile(&description, Preset::Balanced).unwrap();
        for perspective in [None, Some(40f64.to_radians())] {
            let script = b"viewsize 9;\norientation 0.1 0.1 0.7 0.7;\neye_pt 5 1 20;\nstart 0;\nend;\n";
            let view = View { perspective, ..view::parse(Path::new("d.rt"), script).unwrap() };
            let camera = Camera::of_view(&view, 1.0).unwrap();
            let pictures = [false, true].map(|count| {
                let (width, height, integrator) = (150, 150, Integrator::Rt);
                let options = RenderOptions { width, height, integrator, count, ..Default::default() };
                let output = render(&world, &description, &camera, &options, &Silent).unwrap();
                (pix::to_bytes(&output.film, 0.0).unwrap(), output.rays)
            });
            assert!(pictures[0] == pictures[1], "{text} {perspective:?}");
            let corner = pictures[0].0.first_chunk::<3>().unwrap();
            assert_eq!(*corner == [0, 0, 1], !surrounded);
            assert!(pictures[0].0.chunks_exact(3).filter(|pixel| pixel[0] > 20).count() > 200);
        }
    }
}

#[test]
fn surroundings_are_seen_without_rays_in_either_precision() {
    surroundings_are_seen_without_rays::<f32>();
    surroundings_are_seen_without_rays::<f64>();
}

/// The inside of a region without bounds, by its definition: 0.18 where a ray never leaves it, and 0.8^6 of that where it
/// does; the darkest blue outside.
#[test]
fn the_inside_of_a_half_space() {
    let ground = "title {t}\nunits mm\nput h half N {0 0 1} d 0\nput r comb region yes tree {l h}\n";
    let hollow = "title {t}\nunits mm\nput h half N {0 0 1} d 9e5\nput b ell V {0 0 0} A {3 0 0} B {0 3 0} C {0 0 3}\n\
        put r comb region yes tree {- {l h} {l b}}\n";
    let (down, up) = ("0 0 0 1", "1 0 0 0");
    let (aslant, rising) = ("0.3826834323650898 0 0 0.9238795325112867", "0.9238795325112867 0 0 0.3826834323650898");
    let (inside, leaving, outside) = ([46; 3], [12; 3], [0, 0, 1]);
    for (text, eye, turn, seen) in [
        (ground, "0 0 -7", down, inside),
        (ground, "0 0 -7", aslant, inside),
        (ground, "0 0 -7", rising, leaving),
        (ground, "0 0 -7", up, leaving),
        (ground, "0 0 7", up, outside),
        (ground, "0 0 7", rising, outside),
        (hollow, "0 0 -9", down, inside),
        (hollow, "0 0 -9", aslant, inside),
    ] {
        assert_eq!(middle::<f64>(text, eye, turn), (seen, 0), "{eye} {turn}");
        assert_eq!(middle::<f32>(text, eye, turn), (seen, 0), "{eye} {turn} in f32");
    }
    assert_eq!(middle::<f64>(hollow, "0 0 -9", up).0, leaving);
}
