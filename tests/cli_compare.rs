//! `lanecast compare` through the real binary: pictures, hits, limits, refusals.

mod binary;

use std::path::Path;

use binary::{SQUARE, lanecast, npy_parts, ray_file, refused};
use lanecast::film::{Film, PlaneData, exr, npy, png};

fn gray(folder: &Path, name: &str, value: f32) {
    let mut film = Film::full(16, 12).expect("a size");
    for plane in ["R", "G", "B"] {
        film.push(plane, PlaneData::F32(vec![value; 192])).expect("a plane");
    }
    let path = folder.join(name);
    if name.ends_with("png") {
        png::write(&path, &film, 0.0).expect("written");
    } else {
        exr::write(&path, &film, &exr::ImageInfo::default(), exr::Compression::Zip).expect("written");
    }
}

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = |name: &str, value: f32| gray(dir.path(), name, value);
    file("half.exr", 0.5);
    file("near.exr", 0.5f32.next_up());
    file("quarter.exr", 0.25);
    file("half.png", 0.5);
    file("quarter.png", 0.25);
    dir
}

fn run(dir: &tempfile::TempDir, line: &str, code: i32) -> binary::Ended {
    let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(code), "{line}: {}{}", ended.out, ended.err);
    ended
}

#[test]
fn pictures_have_figures_classes_and_maps() {
    let dir = folder();
    let report = run(&dir, "compare half.exr quarter.exr -o d.exr -o heat.png --json", 0).json();
    assert_eq!((report["kind"].as_str(), report["pass"].as_bool()), (Some("pictures"), Some(true)));
    assert_eq!((report["rmse"].as_f64(), report["peak"].as_f64()), (Some(0.25), Some(0.5)));
    assert_eq!(report["classes"]["beyond"], 576);
    assert_eq!(report["planes"][0]["max_ulp"], 1u64 << 23, "from 0.25 to 0.5 the floats double once");
    let difference = exr::read(&dir.path().join("d.exr")).expect("an EXR");
    assert_eq!(difference.f32_plane("G").expect("G")[5], -0.25);
    assert!(difference.f32_plane("flip").expect("flip")[100] > 0.1);
    let bytes = std::fs::read(dir.path().join("d.exr")).expect("a file");
    let has = |name: &str| bytes.windows(name.len()).any(|window| window == name.as_bytes());
    assert!(has("lanecast/revision") && !has("lanecast/seed") && !has("lanecast/rays") && !has("sceneHash"));
    let heat = png::read(&dir.path().join("heat.png")).expect("a PNG");
    assert_eq!((heat.width, heat.height), (16, 12));

    let near = run(&dir, "compare half.exr near.exr --json", 0).json();
    assert_eq!((near["classes"]["within_one"].as_u64(), near["max_ulp"].as_u64()), (Some(576), Some(1)));
    gray(dir.path(), "black.exr", 0.0);
    run(&dir, "compare black.exr black.exr --min-psnr 40 --min-ssim 0.9", 0);
    let text = run(&dir, "compare half.png half.exr", 0).out;
    assert!(text.contains("576 matching (100.0000 %)") && text.contains("PSNR       inf dB"), "{text}");
}

/// BRL-CAD's classes: sRGB levels 188 and 137 are off by many.
#[test]
fn levels_have_the_classes_of_pixcmp() {
    let dir = folder();
    let report = run(&dir, "compare half.png quarter.png --json", 0).json();
    assert_eq!((report["unit"].as_str(), report["classes"]["beyond"].as_u64()), (Some("level"), Some(576)));
    assert!((report["max_error"].as_f64().expect("a number") - 51.0 / 255.0).abs() < 1e-6);
    let text = run(&dir, "compare half.png quarter.png", 0).out;
    assert!(text.contains("576 off by many"), "{text}");
}

/// 16 bits are finer than the levels of a display: what differs within one of them is different.
#[test]
fn deep_pngs_are_not_rounded_to_levels() {
    let dir = folder();
    let deep = |name: &str, value: u16| {
        let file = std::fs::File::create(dir.path().join(name)).expect("a file");
        let mut encoder = ::png::Encoder::new(file, 16, 12);
        encoder.set_color(::png::ColorType::Grayscale);
        encoder.set_depth(::png::BitDepth::Sixteen);
        let mut body = encoder.write_header().expect("a header");
        body.write_image_data(&value.to_be_bytes().repeat(192)).expect("pixels");
        body.finish().expect("written");
    };
    deep("a.png", 188 * 257);
    deep("b.png", 188 * 257 + 100);
    let report = run(&dir, "compare a.png b.png --max-different 0 --json", 1).json();
    assert_eq!((report["domain"].as_str(), report["unit"].as_str()), (Some("linear"), Some("ulp")));
    assert!(report["rmse"].as_f64().expect("a number") > 1e-4 && report["levels"]["exact"] == 576, "{report}");
    run(&dir, "compare a.png a.png --max-different 0 --max-rmse 0", 0);
    // Beside a file of levels it is shown as a display shows it.
    let shown = run(&dir, "compare half.png b.png --max-different 0 --json", 0).json();
    assert_eq!((shown["domain"].as_str(), shown["unit"].as_str()), (Some("display"), Some("level")));
}

/// Coverage is no colour: levels are three per pixel, whether both files, one or none have it.
#[test]
fn levels_are_of_colours_whatever_is_covered() {
    let dir = folder();
    for (name, coverage) in [("opaque", 1.0), ("thin", 0.5)] {
        let mut film = Film::full(16, 12).expect("a size");
        for (plane, value) in [("R", 0.5 * coverage), ("G", 0.5 * coverage), ("B", 0.5 * coverage), ("A", coverage)] {
            film.push(plane, PlaneData::F32(vec![value; 192])).expect("a plane");
        }
        png::write(&dir.path().join(format!("{name}.png")), &film, 0.0).expect("written");
    }
    for files in ["half.png opaque.png", "opaque.png half.png", "opaque.png thin.png", "half.png half.png"] {
        let report = run(&dir, &format!("compare {files} --max-different 0 --json"), 0).json();
        assert_eq!(
            (report["unit"].as_str(), report["classes"]["exact"].as_u64()),
            (Some("level"), Some(576)),
            "{files}"
        );
    }
    let report = run(&dir, "compare opaque.png quarter.png --max-different 0 --json", 1).json();
    assert_eq!((report["unit"].as_str(), report["classes"]["beyond"].as_u64()), (Some("level"), Some(576)));
}

#[test]
fn limits_decide_the_exit_code() {
    let dir = folder();
    for (limits, code) in [
        ("--max-rmse 0.3 --min-psnr 6 --max-flip 1 --max-hdr-flip 1 --max-relmse 0.3 --min-ssim 0", 0),
        ("--max-rmse 0.2", 1),
        ("--min-psnr 7", 1),
        ("--min-ssim 0.999", 1),
        ("--max-flip 0.01", 1),
        ("--max-beyond 575", 1),
        ("--max-ulp 8388608", 0),
        ("--max-different 0", 1),
    ] {
        let ended = run(&dir, &format!("compare half.exr quarter.exr {limits} --json"), code);
        assert_eq!(ended.json()["pass"], code == 0, "{limits}");
        assert!(code == 0 || ended.err.contains("beyond"), "{limits}: {}", ended.err);
    }
}

/// Samples without a number are left out of the errors, so a picture of nothing else has none, and FLIP takes NaN for black and
/// infinity for white: no limit is kept by that.
#[test]
fn what_is_not_finite_keeps_no_limit() {
    let dir = folder();
    for (reference, name, value) in [("black.exr", "nan.exr", f32::NAN), ("white.exr", "infinite.exr", f32::INFINITY)] {
        gray(dir.path(), reference, if value.is_nan() { 0.0 } else { 1.0 });
        gray(dir.path(), name, value);
        for limit in ["max-rmse 9", "max-relmse 9", "min-psnr 0", "min-ssim 0", "max-flip 1", "max-hdr-flip 1"] {
            let ended = run(&dir, &format!("compare {reference} {name} --{limit} --json"), 1);
            assert!(ended.json()["pass"] == false && ended.json()["not_finite"] == 576, "{limit}: {}", ended.out);
            assert!(ended.err.contains("576 samples are finite in one file only"), "{limit}: {}", ended.err);
        }
        run(&dir, &format!("compare {name} {name} --max-rmse 0 --min-psnr 100 --min-ssim 0.9999"), 0);
    }
}

/// Limits on samples are of every sample: a plane without a counterpart breaks them, and without any pair there is nothing to say.
/// Levels are of colours, whatever else one file holds.
#[test]
fn planes_of_one_file_break_the_limits_on_samples() {
    let dir = folder();
    let mut film = exr::read(&dir.path().join("half.exr")).expect("an EXR");
    film.push("Z", PlaneData::F32(vec![1.0; 192])).expect("a plane");
    let info = exr::ImageInfo::default();
    exr::write(&dir.path().join("deep.exr"), &film, &info, exr::Compression::Zip).expect("written");
    npy::write_plane(&dir.path().join("gray.npy"), 16, 12, &PlaneData::F32(vec![0.5; 192])).expect("written");
    for limit in ["--max-different 0", "--max-beyond 0", "--max-ulp 0"] {
        for files in ["half.exr deep.exr", "deep.exr half.exr"] {
            let ended = run(&dir, &format!("compare {files} {limit} --json"), 1);
            assert_eq!(ended.json()["pass"], false, "{files} {limit}");
            assert!(ended.err.contains("in one file only, or of another type: Z"), "{}", ended.err);
        }
        let line = format!("compare gray.npy half.exr {limit}");
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), "no sample");
    }
    run(&dir, "compare deep.exr deep.exr --max-different 0 --max-ulp 0", 0);
    run(&dir, "compare half.exr deep.exr --max-rmse 0", 0);
    run(&dir, "compare gray.npy half.exr --max-rmse 0", 0);
    run(&dir, "compare half.png deep.exr --max-different 0", 0);
}

#[test]
fn what_does_not_compare_is_refused() {
    let dir = folder();
    let at = dir.path();
    std::fs::write(at.join("rays.npy"), ray_file(&[[0.0; 8]])).expect("a file");
    std::fs::write(at.join("cut.pfm"), "PF 2 2 -1\nabc").expect("a file");
    refused(at, &["compare", "half.exr", "nowhere.exr"], "nowhere.exr");
    refused(at, &["compare", "half.exr", "cut.pfm"], "byte 10");
    refused(at, &["compare", "half.exr", "scene.tif"], ".pfm");
    refused(at, &["compare", "half.png", "half.png", "--map", "hdr-flip", "-o", "a.png"], "linear light");
    refused(at, &["compare", "half.png", "half.png", "--max-hdr-flip", "1"], "HDR-FLIP");
    // Not even the files before the one that is refused are written.
    for (line, what) in [
        ("half.exr half.exr -o d.exr -o a.jpg", "-o a.jpg: expected a name that ends in .exr or .png"),
        ("half.png half.png -o d.exr -o d.png --map hdr-flip", "linear light"),
        ("half.png half.png -o d.exr --max-hdr-flip 1", "HDR-FLIP"),
    ] {
        refused(at, &format!("compare {line}").split(' ').collect::<Vec<_>>(), what);
        assert!(!at.join("d.exr").exists(), "{line}");
    }
    for limit in
        ["max-rmse=nan", "max-relmse=inf", "min-psnr=nan", "min-ssim=-inf", "max-flip=NaN", "max-hdr-flip=1e999"]
    {
        refused(at, &["compare", "half.exr", "half.exr", &format!("--{limit}")], "expected a number");
    }
    let mut film = Film::full(3, 3).expect("a size");
    film.push("Y", PlaneData::F32(vec![0.0; 9])).expect("a plane");
    npy::write_plane(&at.join("small.npy"), 3, 3, &film.planes[0].data).expect("written");
    let sizes = lanecast(at, &["compare", "half.exr", "small.npy"]);
    assert!(sizes.code == Some(1) && sizes.err.contains("16x12 and 3x3"), "{}", sizes.err);
    // That is a comparison that fails, and no bad input.
    let said = lanecast(at, &["compare", "half.exr", "small.npy", "--json"]);
    let report = said.json();
    assert_eq!((said.code, &report["pass"], &report["kind"]), (Some(1), &false.into(), &"pictures".into()));
    assert_eq!(report["sizes"], serde_json::json!([[16, 12], [3, 3]]));
    let why = report["failures"][0].as_str().expect("a reason");
    assert_eq!(why, "pictures of different sizes: 16x12 and 3x3");
}

/// Options of scenes, of files without a size and of heat maps mean nothing to other pictures, which need not be opened for that.
#[test]
fn options_without_effect_on_pictures_are_refused() {
    let dir = folder();
    for option in [
        "--set q=1",
        "--top foo",
        "--precision f64",
        "--preset best",
        "--leaf 4",
        "--lenient",
        "--size 3x3",
        "--map error",
        "--full 2",
        "--map error -o d.exr",
    ] {
        let line = format!("compare none.exr none.png {option}");
        let words: Vec<&str> = line.split(' ').collect();
        refused(dir.path(), &words, &format!("error: {} is for ", words[3]));
    }
    run(&dir, "compare half.exr quarter.exr -o d.png --map error --full 2", 0);
    run(&dir, "render builtin:die -o a.pix --size 8x4", 0);
    run(&dir, "compare a.pix a.pix --size 8x4 --max-rmse 0", 0);
}

/// Rays down on a square: hits at t = 1, a miss beside it.
#[test]
fn hits_are_judged_by_the_oracle() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let at = dir.path();
    std::fs::write(at.join("square.ply"), SQUARE).expect("a scene");
    let ray = |x: f32, y: f32| [x, y, 1.0, 0.0, 0.0, 0.0, -1.0, f32::INFINITY];
    std::fs::write(at.join("rays.npy"), ray_file(&[ray(0.7, 0.2), ray(0.2, 0.7), ray(3.0, 0.5)])).expect("rays");
    for (engine, hits) in [("scalar", "a.npy"), ("tile", "b.npy")] {
        run(&dir, &format!("trace square.ply --rays rays.npy --engine {engine} --hits {hits} --repeat 1"), 0);
    }
    let judged = "--scene square.ply --rays rays.npy";
    let same = run(&dir, &format!("compare a.npy b.npy {judged} --json"), 0).json();
    assert_eq!(
        (same["kind"].as_str(), same["rays"].as_u64(), same["differences"].as_u64()),
        (Some("hits"), Some(3), Some(0))
    );
    assert_eq!(same["judged"]["unexplained"], 0);

    // The second ray's t, at byte 20 of the data, becomes 1.5.
    let mut bytes = std::fs::read(at.join("b.npy")).expect("hits");
    let start = bytes.len() - npy_parts(&bytes).1.len();
    bytes[start + 20..start + 24].copy_from_slice(&1.5f32.to_le_bytes());
    std::fs::write(at.join("wrong.npy"), bytes).expect("hits");
    let wrong = run(&dir, &format!("compare a.npy wrong.npy {judged} --json"), 1).json();
    assert_eq!((wrong["differences"].as_u64(), wrong["judged"]["b"]["unexplained"].as_u64()), (Some(1), Some(1)));
    let unasked = run(&dir, "compare a.npy wrong.npy", 0).out;
    assert!(unasked.contains("1 beyond rounding") && unasked.contains("ray 1: "), "{unasked}");
    run(&dir, "compare a.npy wrong.npy --max-beyond 0", 1);
    // Two rays against three.
    std::fs::write(at.join("few.npy"), ray_file(&[ray(0.7, 0.2), ray(0.2, 0.7)])).expect("rays");
    run(&dir, "trace square.ply --rays few.npy --engine scalar --hits short.npy --repeat 1", 0);
    let short = run(&dir, "compare a.npy short.npy --json", 1).json();
    assert_eq!((short["pass"].as_bool(), &short["answers"]), (Some(false), &serde_json::json!([3, 2])), "{short}");
    refused(at, &["compare", "a.npy", "rays.npy"], "hits");
    refused(at, &["compare", "a.npy", "b.npy", "-o", "d.exr"], "no pixels");
    refused(at, &["compare", "a.npy", "b.npy", "--max-rmse", "1"], "--max-beyond");
    for option in ["--set q=1", "--precision f64"] {
        let line = format!("compare a.npy b.npy {option}");
        let words: Vec<&str> = line.split(' ').collect();
        refused(at, &words, &format!("{} says how to open a scene: expected --scene and --rays", words[3]));
    }
    for option in ["--map flip", "--full 1", "--exposure 0", "--peak 1", "--size 4x4", "--ppd 60"] {
        let line = format!("compare a.npy b.npy {option}");
        let words: Vec<&str> = line.split(' ').collect();
        refused(at, &words, words[3]);
    }
}
