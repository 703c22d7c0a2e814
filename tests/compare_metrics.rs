//! PSNR, SSIM and FLIP against independent implementations: scikit-image, and the evaluator of FLIP's authors.
//! `LANECAST_PYTHON` names a Python with numpy, scikit-image and flip-evaluator; without them the test says SKIPPED.

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::Random;
use lanecast::film::metrics::{Rgb, Viewing, hdr_flip, ldr_flip, psnr, ssim};
use lanecast::film::{npy, srgb};

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

/// Largest difference from the other implementation.
const TOLERANCE: f64 = 1e-4;

struct Pair {
    name: &'static str,
    a: [Vec<f32>; 3],
    b: [Vec<f32>; 3],
}

fn rgb(planes: &[Vec<f32>; 3]) -> Rgb<'_> {
    Rgb { width: WIDTH, height: HEIGHT, planes: [&planes[0], &planes[1], &planes[2]] }
}

/// A scene with smooth parts, edges, texture and highlights; `value(x, y, channel)`.
fn picture(value: impl Fn(usize, usize, usize) -> f64) -> [Vec<f32>; 3] {
    let plane = |c: usize| (0..WIDTH * HEIGHT).map(|i| value(i % WIDTH, i / WIDTH, c) as f32).collect();
    [plane(0), plane(1), plane(2)]
}

fn base(x: usize, y: usize, c: usize) -> f64 {
    let (u, v) = (x as f64 / WIDTH as f64, y as f64 / HEIGHT as f64);
    let disc = if (u - 0.3).hypot(v - 0.5) < 0.2 { 0.4 } else { 0.0 };
    let stripes = if u > 0.6 && (x / 3 + c).is_multiple_of(2) { 0.25 } else { 0.05 };
    (0.1 + 0.3 * u * (c + 1) as f64 / 3.0 + disc + stripes * v).min(1.0)
}

fn pairs() -> Vec<Pair> {
    let mut random = Random(11);
    let noise: Vec<f64> = (0..3 * WIDTH * HEIGHT).map(|_| random.unit() - 0.5).collect();
    let noisy = |amount: f64| picture(|x, y, c| (base(x, y, c) + amount * noise[3 * (y * WIDTH + x) + c]).max(0.0));
    let bright = |x: usize, y: usize| if (x / 8 + y / 8).is_multiple_of(5) { 60.0 } else { 1.5 };
    vec![
        Pair { name: "noise", a: picture(base), b: noisy(0.1) },
        Pair { name: "faint", a: picture(base), b: noisy(0.004) },
        Pair { name: "moved", a: picture(base), b: picture(|x, y, c| base((x + 1).min(WIDTH - 1), y, c)) },
        Pair { name: "tinted", a: picture(base), b: picture(|x, y, c| base(x, y, c) * [1.0, 0.9, 1.1][c]) },
        Pair {
            name: "highlights",
            a: picture(|x, y, c| base(x, y, c) * bright(x, y)),
            b: picture(|x, y, c| base(x, y, c) * bright(x, y) * (1.0 + 0.3 * noise[3 * (y * WIDTH + x) + c])),
        },
    ]
}

fn python() -> Option<String> {
    let program = std::env::var("LANECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&program).args(["-c", "import numpy, skimage, flip_evaluator"]).output();
    if found.is_ok_and(|out| out.status.success()) {
        return Some(program);
    }
    println!("SKIPPED: {program} with numpy, scikit-image and flip-evaluator not found");
    None
}

fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/metrics.py")
}

#[test]
fn psnr_ssim_and_flip_agree_with_independent_implementations() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let pairs = pairs();
    for Pair { name, a, b } in &pairs {
        for (which, planes) in [("a", a), ("b", b)] {
            let path = dir.path().join(format!("{name}_{which}.npy"));
            npy::write_stack(&path, WIDTH as u32, HEIGHT as u32, &rgb(planes).planes).unwrap();
        }
    }
    let out = Command::new(python).arg(script()).arg(dir.path()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let theirs: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();

    for Pair { name, a, b } in &pairs {
        let white = a.iter().flatten().fold(0.0f32, |most, &x| most.max(x)).into();
        let shown = |planes: &[Vec<f32>; 3]| {
            planes.each_ref().map(|plane| {
                plane.iter().map(|&x| srgb::encode(f64::from(x).clamp(0.0, 1.0)) as f32).collect::<Vec<f32>>()
            })
        };
        let (sa, sb) = (shown(a), shown(b));
        let squared = |a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]| {
            let pairs = a.iter().flatten().zip(b.iter().flatten());
            pairs.map(|(x, y)| (f64::from(*x) - f64::from(*y)).powi(2)).sum::<f64>() / (3 * WIDTH * HEIGHT) as f64
        };
        let viewing = Viewing::default();
        let dense = Viewing { pixels_per_degree: 40.0 };
        let ours = [
            ("psnr", psnr(squared(a, b), white)),
            ("ssim", ssim(&rgb(a), &rgb(b), white).unwrap().unwrap()),
            ("psnr_display", psnr(squared(&sa, &sb), 1.0)),
            ("ssim_display", ssim(&rgb(&sa), &rgb(&sb), 1.0).unwrap().unwrap()),
            ("flip", ldr_flip(&rgb(a), &rgb(b), viewing).unwrap().mean()),
            ("flip_dense", ldr_flip(&rgb(a), &rgb(b), dense).unwrap().mean()),
            ("hdr_flip", hdr_flip(&rgb(a), &rgb(b), viewing).unwrap().mean()),
        ];
        for (metric, ours) in ours {
            let theirs = theirs[name][metric].as_f64().unwrap_or_else(|| panic!("{name}: no {metric}"));
            println!("{name} {metric}: ours {ours:.6} theirs {theirs:.6}");
            assert!((ours - theirs).abs() <= TOLERANCE, "{name} {metric}: ours {ours} theirs {theirs}");
        }
    }
}
