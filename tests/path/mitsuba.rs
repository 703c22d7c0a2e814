//! Paths against Mitsuba 3: the scenes of tests/mitsuba, which both read by their own code, must have the same light.
//!
//! `LANECAST_PYTHON` names a Python with numpy and mitsuba (default `python3`); without them the test says SKIPPED.
//! With `LANECAST_LONG_TESTS` set both take sixteen times the samples, and nothing is put down to noise.
//! What the two models of materials do not share is kept small by the scenes: facets of Mitsuba mask to both
//! directions independently, ours by height, which differs below a thousandth at these widths.

#[path = "../path_support/neutral.rs"]
mod neutral;

use std::path::{Path, PathBuf};
use std::process::Command;

use lanecast::film::Film;
use lanecast::render::{Aov, RenderOptions, Silent, render};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Integrator;
use neutral::Neutral;

const SCENES: [&str; 3] = ["cornell", "still_life", "interior"];
/// Pixels of a picture's side, and regions.
const SIDE: usize = 64;
const REGIONS: usize = 4;
/// Samples per pixel of Mitsuba's picture, its independent passes, and ours.
const SPP: u32 = 4096;
const PASSES: u32 = 16;
/// Samples per pixel of the picture whose noise is judged.
const NOISY_SPP: u32 = 64;
/// How far the mean radiance of a region may be off.
const CLOSE: f64 = 0.005;
/// The same in standard deviations of both pictures' noise, where that is more; not allowed in the long test.
const SIGMAS: f64 = 3.0;
/// Samples per pixel of both pictures in the long test, which leave a tenth of a per cent of noise.
const LONG_SPP: u32 = 65_536;

fn python() -> Option<String> {
    let program = std::env::var("LANECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&program).args(["-c", "import numpy, mitsuba"]).output();
    if found.is_ok_and(|out| out.status.success()) {
        return Some(program);
    }
    println!("SKIPPED: {program} with numpy and mitsuba not found");
    None
}

fn scene_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mitsuba").join(format!("{name}.json"))
}

/// Red, green, blue and variance of the brightness, of each pixel.
fn mitsuba(python: &str, folder: &Path, spp: u32) -> Vec<Vec<[f64; 4]>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/mitsuba_compare.py");
    let numbers = [SIDE as u32, spp, PASSES].map(|n| n.to_string());
    let files = SCENES.map(scene_file);
    let out = Command::new(python).arg(script).arg(folder).args(numbers).args(files).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(out.status.success(), "{}{}", text(&out.stdout), text(&out.stderr));
    println!("mitsuba: {}", text(&out.stdout).trim());
    let read = |name: &str| {
        let bytes = std::fs::read(folder.join(format!("{name}.npy"))).unwrap();
        let data = &bytes[bytes.len() - SIDE * SIDE * 16..];
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        data.chunks_exact(16).map(|p| [0, 4, 8, 12].map(|at| number(&p[at..at + 4]))).collect()
    };
    SCENES.into_iter().map(read).collect()
}

/// The same by us.
fn ours(scene: &Neutral, spp: u32) -> Vec<[f64; 4]> {
    let d = scene.description();
    let world = World::<f32>::compile(&d, Preset::Balanced).unwrap();
    let options = RenderOptions {
        width: SIDE as u32,
        height: SIDE as u32,
        spp,
        depth: scene.depth,
        integrator: Integrator::Path,
        tile: 16,
        aovs: vec![Aov::Variance],
        ..RenderOptions::default()
    };
    let output = render(&world, &d, &scene.camera(), &options, &Silent).unwrap();
    println!("{spp} samples per pixel: {:.2} s", output.seconds);
    let plane = |film: &Film, name: &str| film.f32_plane(name).unwrap().to_vec();
    let planes = ["R", "G", "B", "variance"].map(|name| plane(&output.film, name));
    (0..SIDE * SIDE).map(|i| [0, 1, 2, 3].map(|p| f64::from(planes[p][i]))).collect()
}

/// Mean colour of region (column, row), and the standard error of its mean brightness.
fn region(picture: &[[f64; 4]], column: usize, row: usize) -> ([f64; 3], f64) {
    let edge = SIDE / REGIONS;
    let n = (edge * edge) as f64;
    let (mut sum, mut variance) = ([0.0; 3], 0.0);
    for y in row * edge..(row + 1) * edge {
        for x in column * edge..(column + 1) * edge {
            let pixel = picture[y * SIDE + x];
            (0..3).for_each(|c| sum[c] += pixel[c] / n);
            variance += pixel[3] / (n * n);
        }
    }
    (sum, variance.sqrt())
}

fn brightness(pixel: &[f64; 4]) -> f64 {
    (pixel[0] + pixel[1] + pixel[2]) / 3.0
}

#[test]
fn pictures_agree_with_mitsuba() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let long = std::env::var_os("LANECAST_LONG_TESTS").is_some();
    let (spp, sigmas) = if long { (LONG_SPP, 0.0) } else { (SPP, SIGMAS) };
    let references = mitsuba(&python, folder.path(), spp);
    let mut failures = Vec::new();
    for (name, reference) in SCENES.into_iter().zip(references) {
        let scene = Neutral::read(&scene_file(name));
        let picture = ours(&scene, spp);
        let mut worst = 0.0f64;
        for row in 0..REGIONS {
            for column in 0..REGIONS {
                let (found, our_error) = region(&picture, column, row);
                let (want, their_error) = region(&reference, column, row);
                let mean = (want[0] + want[1] + want[2]) / 3.0;
                let noise = our_error.hypot(their_error) / mean;
                for (c, (f, w)) in found.into_iter().zip(want).enumerate() {
                    let off = (f - w) / mean.max(1e-9);
                    worst = worst.max(off.abs());
                    // Where both pictures together are too noisy to tell, chance is allowed for.
                    if off.abs() > CLOSE.max(sigmas * noise) {
                        failures.push(format!(
                            "{name}, {column},{row}, colour {c}: {f:.6}, Mitsuba {w:.6} ({:.2} %, noise {:.2} %)",
                            100.0 * off,
                            100.0 * noise
                        ));
                    }
                }
            }
        }
        // The error of a noisy picture is the noise that it says it has, and Mitsuba's own: no bias hides in it.
        let noisy = ours(&scene, NOISY_SPP);
        let (mut error, mut noise) = (0.0, 0.0);
        for (found, want) in noisy.iter().zip(&reference) {
            let scale = brightness(want).powi(2) + 1e-4;
            error += (brightness(found) - brightness(want)).powi(2) / scale;
            noise += (found[3] + want[3]) / scale;
        }
        let n = (SIDE * SIDE) as f64;
        println!("{name}: regions within {:.3} %; relMSE {:.6}, noise {:.6}", 100.0 * worst, error / n, noise / n);
        if error > noise {
            failures.push(format!("{name}: relMSE {} above the noise {}", error / n, noise / n));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
