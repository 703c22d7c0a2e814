//! NumPy and the OpenEXR module judge the files that lanecast writes, and write files for lanecast to read.
//! `LANECAST_PYTHON` names the interpreter (default `python3`); without numpy and OpenEXR the tests say SKIPPED.

use std::path::Path;
use std::process::Command;

use lanecast::film::exr::{Compression, ImageInfo};
use lanecast::film::{Film, PlaneData, Window, exr, npy, png, srgb};
use lanecast::ray::{Hits, Rays};

fn python() -> Option<String> {
    let program = std::env::var("LANECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&program).args(["-c", "import numpy, OpenEXR"]).output();
    if found.is_ok_and(|out| out.status.success()) {
        return Some(program);
    }
    println!("SKIPPED: {program} with numpy and OpenEXR not found");
    None
}

/// Runs a script of tests/python on a folder; its assertions are the test.
fn run(python: &str, script: &str, dir: &Path) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    let out = Command::new(python).arg(&script).arg(dir).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(out.status.success(), "{}{}", text(&out.stdout), text(&out.stderr));
    assert_eq!(text(&out.stdout).trim(), "checked", "the script did not reach its end");
}

#[test]
fn numpy_reads_and_writes_the_same_arrays() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    let mut rays = Rays::new(3);
    rays.set(0, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 0.5, f32::INFINITY);
    rays.set(1, [-0.0, 1e-40, 3.4e38], [0.1, 0.2, 0.3], 0.0, 100.0);
    npy::write_rays(&file("rays.npy"), [&rays]).unwrap();
    let mut hits = Hits::<f32>::new(2);
    (hits.t[0], hits.u[0], hits.v[0], hits.prim[0], hits.inst[0]) = (1.5, 0.25, 0.125, 7, 4_000_000_000);
    npy::write_hits(&file("hits.npy"), [&hits]).unwrap();
    npy::write_occlusion(&file("occluded.npy"), [[1, 0, 1]]).unwrap();
    npy::write_plane(&file("plane.npy"), 3, 2, &PlaneData::F32(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0])).unwrap();
    npy::write_plane(&file("ids.npy"), 1, 2, &PlaneData::U32(vec![1, u32::MAX])).unwrap();

    run(&python, "npy.py", dir.path());

    let from_numpy = npy::read_rays(&file("numpy_rays.npy")).unwrap();
    assert_eq!((from_numpy.len(), from_numpy.org(1), from_numpy.t_max[1]), (5, [8.0, 9.0, 10.0], 15.0));
    let doubles = npy::read_rays(&file("numpy_double_rays.npy")).unwrap();
    assert_eq!((doubles.len(), doubles.org(0)), (1, [0.1, 0.2, 0.3]));
    assert_eq!(npy::read_rays(&file("numpy_version_2.npy")).unwrap().len(), 5);
    assert_eq!(npy::read_occlusion(&file("numpy_bool.npy")).unwrap(), [1, 0, 0]);
    let hits = npy::read_hits(&file("numpy_hits.npy")).unwrap();
    assert_eq!((hits.t[1], hits.prim[1], hits.inst[1]), (0.5, 11, u32::MAX));
    for (name, what) in [("big_endian", "'>f4'"), ("fortran", "fortran_order"), ("seven", "(5, 7)")] {
        let message = npy::read_rays(&file(&format!("numpy_{name}.npy"))).unwrap_err().to_string();
        assert!(message.contains(what), "{message}");
    }
}

/// A crop with one value per pixel and plane that the script can recompute.
fn film() -> Film {
    let mut film = Film::new(100, 50, Window { x0: 10, y0: 20, x1: 40, y1: 45 }).unwrap();
    let n = film.pixels();
    for (k, name) in ["R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "albedo.R", "cost.nodes"].into_iter().enumerate() {
        film.push(name, PlaneData::F32((0..n).map(|i| k as f32 + i as f32 / 1024.0).collect())).unwrap();
    }
    film.push("id.instance", PlaneData::U32((0..n as u32).map(|i| i * 7).collect())).unwrap();
    let long = "a name of more than the 31 characters of old EXR files";
    film.push(long, PlaneData::F32(vec![0.5; n])).unwrap();
    film.push("id.primitive", PlaneData::U32((0..n as u32).map(|i| u32::MAX - i).collect())).unwrap();
    film
}

fn info() -> ImageInfo {
    ImageInfo {
        software: "lanecast test".to_owned(),
        revision: "0123abc".to_owned(),
        scene_hash: "f00d".to_owned(),
        engine: "packet16".to_owned(),
        isa: "x86-64-v4".to_owned(),
        lanes: 16,
        batch: 256,
        spp: 4,
        seed: u64::MAX,
        render_seconds: 1.25,
        rays: 9_000_000_000,
        // A turn of 90 degrees about z and a translation by (5, 6, 7), for column vectors.
        world_to_camera: Some([
            [0.0, -1.0, 0.0, 5.0],
            [1.0, 0.0, 0.0, 6.0],
            [0.0, 0.0, 1.0, 7.0],
            [0.0, 0.0, 0.0, 1.0],
        ]),
        world_to_ndc: Some([[2.0, 0.0, 0.0, 0.0], [0.0, 3.0, 0.0, 0.0], [0.0, 0.0, 4.0, 5.0], [0.0, 0.0, 1.0, 0.0]]),
    }
}

#[test]
fn openexr_reads_and_writes_the_same_pictures() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let film = film();
    exr::write(&dir.path().join("zip.exr"), &film, &info(), Compression::Zip).unwrap();
    exr::write(&dir.path().join("piz.exr"), &film, &info(), Compression::Piz).unwrap();

    run(&python, "exr.py", dir.path());

    let back = exr::read(&dir.path().join("openexr.exr")).unwrap();
    assert_eq!((back.width, back.height, back.window), (4, 3, Window::full(4, 3)));
    assert_eq!(back.f32_plane("half.Y").unwrap()[5], 2.5);
    assert_eq!(back.f32_plane("R").unwrap()[11], 11.0);
    assert_eq!(back.u32_plane("id.instance").unwrap()[11], 4_294_967_284);
}

#[test]
fn another_decoder_reads_the_png() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let mut film = Film::full(4, 1).unwrap();
    for (name, scale) in [("R", 1.0), ("G", 0.5), ("B", 0.0)] {
        let plane = [0.0, 0.18, 0.5, 1.0].iter().map(|x| x * scale).collect();
        film.push(name, PlaneData::F32(plane)).unwrap();
    }
    png::write(&dir.path().join("a.png"), &film, 0.0).unwrap();

    run(&python, "png.py", dir.path());

    let gray = png::read(&dir.path().join("zlib.png")).unwrap();
    assert_eq!(gray.f32_plane("G").unwrap(), [0.0, srgb::decode(128.0 / 255.0) as f32, 1.0]);
}
