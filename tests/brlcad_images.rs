//! BRL-CAD's own benchmark images, pixel by pixel, in the classes of its `pixcmp`.

use lanecast::camera::Camera;
use lanecast::film::pix;
use lanecast::render::{RenderOptions, Silent, render};
use lanecast::scene::brlcad::describe::Options;
use lanecast::scene::brlcad::view;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Integrator;

mod brlcad_support;
use brlcad_support::shared;

const SIDE: u32 = 512;
/// Of all pixels, how many may differ by more than one level.
const OFF_BY_MANY: f64 = 0.001;

/// The picture of `name` below `top` as the bytes of a `.pix` file.
fn picture(name: &str, top: &str) -> Option<Vec<u8>> {
    let (db, script) = (shared(&format!("db/{name}.asc"))?, shared(&format!("views/{name}.rt"))?);
    let brlcad = Options { tops: vec![top.into()], lenient: false };
    let description = load(db.to_str().unwrap(), &LoadOptions { brlcad, ..Default::default() }).unwrap();
    let world = World::<f64>::compile(&description, Preset::Balanced).unwrap();
    let view = view::parse(&script, &std::fs::read(&script).unwrap()).unwrap();
    let camera = Camera::of_view(&view, 1.0).unwrap();
    let options = RenderOptions { width: SIDE, height: SIDE, integrator: Integrator::Rt, ..Default::default() };
    let output = render(&world, &description, &camera, &options, &Silent).unwrap();
    println!("{name}: {:?}, {:.2} s", output.rays, output.seconds);
    Some(pix::to_bytes(&output.film, 0.0).unwrap())
}

fn check(name: &str, top: &str) {
    let Some(reference) = shared(&format!("ref/{name}.pix")) else { return };
    let Some(found) = picture(name, top) else { return };
    let expected = std::fs::read(reference).unwrap();
    assert_eq!(found.len(), expected.len());
    let (mut matching, mut by_one, mut by_many, mut shown) = (0, 0, 0, 0);
    for (i, (f, e)) in found.chunks_exact(3).zip(expected.chunks_exact(3)).enumerate() {
        match f.iter().zip(e).map(|(a, b)| a.abs_diff(*b)).max().unwrap() {
            0 => matching += 1,
            1 => by_one += 1,
            _ => {
                by_many += 1;
                if by_many % 37 == 1 && shown < 60 {
                    println!("{name} ({}, {} from below): found {f:?}, expected {e:?}", i % 512, i / 512);
                    shown += 1;
                }
            }
        }
    }
    println!("{name}: {matching} matching, {by_one} off by one, {by_many} off by many");
    assert!(f64::from(by_many) <= OFF_BY_MANY * f64::from(SIDE * SIDE), "{name}: {by_many} pixels are off by many");
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
        let (Some(once), Some(twice)) = (picture(name, top), picture(name, top)) else { return };
        assert_eq!(once, twice);
        let bright = once.chunks_exact(3).filter(|pixel| pixel.iter().any(|&b| b > 20)).count();
        assert!(bright > 50_000, "{name}: {bright} pixels");
    }
}
