//! `render --integrator path` through the real binary: limits of time and noise, and what they report.

mod binary;

use std::time::Instant;

use binary::{Ended, lanecast, refused};
use lanecast::film::{Film, PlaneData, exr};

/// A lamp over a floor, half of the picture sky: noise in one half, none in the other.
const SCENE: &str = r#"
camera "main" { eye 0 -6 2; look-at 0 0 2; up 0 0 1; fov 60 }
background 0.5
material "grey" diffuse=0.6
material "lamp" { diffuse 0; emission 4 }
plane material="grey" { point 0 0 0; normal 0 0 1 }
sphere material="lamp" radius=0.4 { center 0 1 1 }
"#;

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("room.kdl"), SCENE).expect("a scene");
    dir
}

fn run(dir: &tempfile::TempDir, line: &str) -> Ended {
    let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}{}", ended.out, ended.err);
    ended
}

fn picture(dir: &tempfile::TempDir, name: &str) -> Film {
    exr::read(&dir.path().join(name)).expect("an EXR file")
}

fn samples(film: &Film) -> Vec<u32> {
    film.u32_plane("samples").expect("numbers of samples").to_vec()
}

const PATHS: &str = "render room.kdl --integrator path --size 64x64 --tile 8 --aov samples,variance --json";

#[test]
fn a_noise_limit_spends_samples_where_the_noise_is() {
    let dir = folder();
    run(&dir, &format!("{PATHS} -o fine.exr --noise 0.02 --threads 2"));
    run(&dir, &format!("{PATHS} -o again.exr --noise 0.02 --threads 1"));
    run(&dir, &format!("{PATHS} -o coarse.exr --noise 0.2"));
    let (fine, coarse) = (picture(&dir, "fine.exr"), picture(&dir, "coarse.exr"));
    let counts = samples(&fine);
    // The sky above has no noise and stays at the first round; the floor needs more.
    let (top, bottom) = (counts[5 * 64 + 5], counts[60 * 64 + 32]);
    assert!(top == 4 && bottom >= 16, "{top} {bottom}");
    assert!(samples(&coarse).iter().sum::<u32>() < counts.iter().sum::<u32>() / 2);
    // Within each tile the root of the mean variance is below the limit, relative to the mean.
    let plane = |name: &str| fine.f32_plane(name).expect(name).to_vec();
    let (planes, variance) = (["R", "G", "B"].map(plane), plane("variance"));
    for tile in 0..64 {
        let (mut mean, mut noise) = (0.0, 0.0);
        for i in 0..64 {
            let at = (tile / 8 * 8 + i / 8) * 64 + tile % 8 * 8 + i % 8;
            mean += planes.iter().map(|p| f64::from(p[at]) / 3.0).sum::<f64>() / 64.0;
            noise += f64::from(variance[at]) / 64.0;
        }
        assert!(noise.sqrt() <= 0.02 * mean * 1.001, "tile {tile}: {} of {mean}", noise.sqrt());
    }
    // As many samples, and the same picture, whatever the threads.
    let again = picture(&dir, "again.exr");
    for (a, b) in fine.planes.iter().zip(&again.planes) {
        match (&a.data, &b.data) {
            (PlaneData::F32(a), PlaneData::F32(b)) => {
                assert!(a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
            (a, b) => assert_eq!(a, b),
        }
    }
}

#[test]
fn a_time_limit_ends_the_picture_in_time() {
    let dir = folder();
    let start = Instant::now();
    let report = run(&dir, &format!("{PATHS} -o long.exr --time-limit 1.5")).json();
    let took = start.elapsed().as_secs_f64();
    // Generous: machines that test are busy.
    assert!((1.5..20.0).contains(&took), "{took} s");
    assert_eq!(report["complete"], true);
    let counts = samples(&picture(&dir, "long.exr"));
    assert!(counts.iter().all(|&n| n > 4), "more than a first round in all that time");
    // Even no time at all gives every pixel a sample; a number of samples ends before the time does.
    run(&dir, &format!("{PATHS} -o short.exr --time-limit 1e-9"));
    assert!(samples(&picture(&dir, "short.exr")).iter().all(|&n| n >= 1));
    run(&dir, &format!("{PATHS} -o few.exr --time-limit 600 --spp 6"));
    assert!(samples(&picture(&dir, "few.exr")).iter().all(|&n| n == 6));
}

/// The integer attribute `name` of an EXR file: its name and type, each with a zero, its size, and itself.
fn attribute(dir: &tempfile::TempDir, file: &str, name: &str) -> i32 {
    let bytes = std::fs::read(dir.path().join(file)).expect("a file");
    let head = [name.as_bytes(), b"\0int\0\x04\0\0\0"].concat();
    let at = bytes.windows(head.len()).position(|window| window == head).expect("the attribute") + head.len();
    i32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

#[test]
fn pictures_say_how_many_samples_were_taken() {
    let dir = folder();
    for (limit, most) in
        [("--noise 0.2", 1000), ("--time-limit 1e-9", 4), ("--time-limit 600 --spp 6", 6), ("--spp 3", 3)]
    {
        let report = run(&dir, &format!("{PATHS} -o a.exr {limit}")).json();
        let taken = report["samples_per_pixel"].as_f64().expect("a number");
        let said = attribute(&dir, "a.exr", "lanecast/spp");
        assert!(said >= 1 && said <= most && (taken - f64::from(said)).abs() <= 0.5, "{limit}: {said}, not {taken}");
    }
}

#[test]
fn limits_that_mean_nothing_are_refused() {
    let dir = folder();
    for (line, what) in [
        ("render room.kdl -o a.exr --integrator path --time-limit 0", "time limit"),
        ("render room.kdl -o a.exr --integrator path --noise nan", "noise"),
        ("render room.kdl -o a.exr --integrator path --depth 5000", "depth"),
        ("render room.kdl -o a.exr --integrator path --filter boxx", "did you mean `box`?"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
}
