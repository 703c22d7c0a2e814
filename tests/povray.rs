//! Pictures against POV-Ray: the scenes of tests/povray, each written in both languages, must show the same, pixel by
//! pixel.
//!
//! `LANECAST_POVRAY` names the program (default `povray`); without it the tests say SKIPPED. tests/povray/compare.py
//! times these pictures.

use std::path::{Path, PathBuf};
use std::process::Command;

use lanecast::camera::Camera;
use lanecast::render::{RenderOptions, Silent, render};
use lanecast::scene::description::Description;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Shades;

const WIDTH: usize = 240;
const HEIGHT: usize = 180;
/// Largest difference of radiance where both see the same surface in the same light: POV-Ray's file is rounded to
/// 1/65535, and its lights fall off by 1 / d^2 up to 10^-5 of their light.
const TOLERANCE: f64 = 5e-5;
/// The share of pixels that may differ by more: edges, and edges of shadows, that pass between two roundings.
const EDGES: f64 = 0.001;

/// Red, green, blue of each pixel, rows from the top.
type Picture = Vec<[f64; 3]>;

fn povray() -> Option<String> {
    let program = std::env::var("LANECAST_POVRAY").unwrap_or_else(|_| "povray".to_owned());
    if Command::new(&program).arg("--version").output().is_ok_and(|out| out.status.success()) {
        return Some(program);
    }
    println!("SKIPPED: {program} not found");
    None
}

fn scene_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/povray").join(name)
}

/// POV-Ray's picture of `name`.pov with `declares`, and how many rays it says it sent from the eye.
fn theirs(program: &str, name: &str, declares: &[&str]) -> (Picture, usize) {
    // POV-Ray is often configured to read and write in the current folder only.
    let folder = tempfile::tempdir().unwrap();
    for file in [format!("{name}.pov"), "common.inc".to_owned()] {
        std::fs::copy(scene_file(&file), folder.path().join(file)).unwrap();
    }
    // 16 bits per channel, as they are.
    let mut command = Command::new(program);
    command.args(["-D", "-A", "+WT1", "+FP16", "File_Gamma=1.0", &format!("+W{WIDTH}"), &format!("+H{HEIGHT}")]);
    command
        .args([format!("+I{name}.pov"), "+Oout.ppm".to_owned()])
        .args(declares.iter().map(|d| format!("Declare={d}")));
    let out = command.current_dir(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{said}");
    let rays = said.lines().find_map(|line| line.strip_prefix("Rays:")?.split_whitespace().next()?.parse().ok());
    let bytes = std::fs::read(folder.path().join("out.ppm")).unwrap();
    let header = String::from_utf8_lossy(&bytes[..bytes.len() - WIDTH * HEIGHT * 6]).into_owned();
    assert!(header.starts_with("P6") && header.trim_end().ends_with("65535"), "{header}");
    let number = |b: &[u8]| f64::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0;
    let pixels = bytes[header.len()..].chunks_exact(6);
    (pixels.map(|p| [0, 2, 4].map(|at| number(&p[at..]))).collect(), rays.expect("a count of rays"))
}

/// Our picture, and which pixels hit something.
fn ours<S: Shades>(d: &Description) -> (Picture, Vec<bool>) {
    let world = World::<S>::compile(d, Preset::Balanced).unwrap();
    let camera = Camera::new(&d.cameras[0], WIDTH as f64 / HEIGHT as f64).unwrap();
    let options = RenderOptions { width: WIDTH as u32, height: HEIGHT as u32, ..RenderOptions::default() };
    let film = render(&world, d, &camera, &options, &Silent).unwrap().film;
    let planes = ["R", "G", "B", "A"].map(|name| film.f32_plane(name).unwrap().to_vec());
    let pixels = (0..WIDTH * HEIGHT).map(|i| [0, 1, 2].map(|c| f64::from(planes[c][i])));
    (pixels.collect(), planes[3].iter().map(|alpha| *alpha > 0.0).collect())
}

/// Asserts that both saw the same surfaces and the same light.
fn agree(what: &str, (picture, hits): &(Picture, Vec<bool>), reference: &Picture) {
    let n = picture.len() as f64;
    // Behind everything it is black, and everything has some light from everywhere.
    let masks = hits.iter().zip(reference).filter(|(hit, p)| **hit != p.iter().any(|c| *c > 0.0)).count();
    let seen = hits.iter().filter(|hit| **hit).count() as f64 / n;
    let off = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
    let differences: Vec<f64> = picture.iter().zip(reference).map(|(a, b)| off(a, b)).collect();
    let edges = differences.iter().filter(|d| **d > TOLERANCE).count();
    let rest = differences.iter().copied().filter(|d| *d <= TOLERANCE).fold(0.0, f64::max);
    println!("{what}: {masks} of {n} hits differ, {edges} pixels differ, the others by {rest:.1e} at most");
    assert!((0.3..0.9).contains(&seen), "{what}: {seen} of the picture is covered");
    // A value that is cut off at 1 would agree with any other.
    let brightest = reference.iter().flatten().copied().fold(0.0, f64::max);
    assert!(brightest < 1.0, "{what}: {brightest}");
    assert!((masks as f64) < EDGES * n, "{what}: {masks} hits differ");
    assert!((edges as f64) < EDGES * n, "{what}: {edges} pixels differ");
}

/// Compares `name` with `set`, a parameter's value on either side, against every way in which POV-Ray can be told it.
fn compare(name: &str, set: Option<(&str, &str)>, ways: &[&[&str]]) {
    let Some(program) = povray() else { return };
    let set: Vec<_> = set.into_iter().map(|(ours, value)| (ours.to_owned(), value.to_owned())).collect();
    let options = LoadOptions { set, ..LoadOptions::default() };
    let d = load(scene_file(&format!("{name}.kdl")).to_str().unwrap(), &options).unwrap();
    let (exact, single) = (ours::<f64>(&d), ours::<f32>(&d));
    for way in ways {
        let (reference, rays) = theirs(&program, name, way);
        assert_eq!(rays, WIDTH * HEIGHT, "one ray per pixel, no reflections");
        agree(&format!("{name} {way:?} in f64"), &exact, &reference);
        agree(&format!("{name} {way:?} in f32"), &single, &reference);
    }
}

#[test]
fn parts_agree_with_povray() {
    compare("parts", None, &[&[]]);
}

#[test]
fn sponge_agrees_with_povray() {
    compare("sponge", None, &[&[], &["Bounded=1"]]);
}

#[test]
fn a_coarser_sponge_agrees_with_povray() {
    compare("sponge", Some(("side", "5")), &[&["Side=5"], &["Side=5", "Bounded=1"]]);
}
