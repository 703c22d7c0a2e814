//! `render --frames`: keyed parameters move cameras and things, files are numbered, `--resume` leaves out what is there.

use crate::binary;

use std::path::Path;

use binary::{Ended, files, lanecast, refused};
use lanecast::film::{Film, exr};

/// A ball that moves by keys, seen by a camera that goes around by an expression of the frame.
const SCENE: &str = "parameter shift { key 1 -1; key 3 1 }\n\
    camera \"c\" { eye \"6 * sin(frame * 10)\" 1 \"6 * cos(frame * 10)\"; look-at 0 0 0; fov 40 }\n\
    light point { position 3 6 6; intensity 120 }\n\
    define \"ball\" { sphere-flake depth=1 }\n\
    instance \"ball\" { translate \"shift\" 0 0 }\n\
    plane { point 0 -1 0; normal 0 1 0 }\n";

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("scene.kdl"), SCENE).unwrap();
    dir
}

fn render(dir: &Path, line: &str) -> Ended {
    let line = format!("render scene.kdl --size 60x40 {line}");
    let ended = lanecast(dir, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
    ended
}

fn read(dir: &Path, name: &str) -> Film {
    exr::read(&dir.join(name)).unwrap()
}

/// Each frame is the picture that its numbers written by hand give.
#[test]
fn frames_are_the_pictures_of_their_numbers() {
    let dir = folder();
    render(dir.path(), "-o out.exr --frames 1..3");
    assert_eq!(files(dir.path()), ["out.0001.exr", "out.0002.exr", "out.0003.exr", "scene.kdl"]);
    for (frame, shift) in [(1, "-1"), (2, "0"), (3, "1")] {
        let by_hand = SCENE.replace("{ key 1 -1; key 3 1 }", shift).replace("frame", &frame.to_string());
        std::fs::write(dir.path().join("hand.kdl"), by_hand).unwrap();
        let line = ["render", "hand.kdl", "--size", "60x40", "-o", "hand.exr"];
        assert_eq!(lanecast(dir.path(), &line).code, Some(0));
        assert!(read(dir.path(), &format!("out.000{frame}.exr")) == read(dir.path(), "hand.exr"), "frame {frame}");
    }
    assert!(read(dir.path(), "out.0001.exr") != read(dir.path(), "out.0002.exr"));
}

#[test]
fn resume_leaves_out_what_is_there() {
    let dir = folder();
    render(dir.path(), "-o out.png --frames 2..2");
    let second = dir.path().join("out.0002.png");
    let whole = std::fs::read(&second).unwrap();
    std::fs::write(&second, b"not a picture").unwrap();
    let said = render(dir.path(), "-o out.png --frames 1..3 --resume").err;
    assert!(said.contains("out.0002.png: there already"), "{said}");
    assert_eq!(std::fs::read(&second).unwrap(), b"not a picture");
    assert_eq!(files(dir.path()).len(), 4);
    // All that is said of them is one object.
    std::fs::remove_file(dir.path().join("out.0003.png")).unwrap();
    let said = render(dir.path(), "-o out.png --frames 1..3 --resume --json");
    assert_eq!(said.out.lines().count(), 1, "{}", said.out);
    let report = said.json();
    assert_eq!(report["kept"], serde_json::json!(["out.0001.png", "out.0002.png"]));
    let frames = report["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &frames[0]["file"], &frames[0]["complete"]), (1, &"out.0003.png".into(), &true.into()));
    let none = render(dir.path(), "-o out.png --frames 1..3 --resume --json").json();
    assert_eq!((&none["frames"], none["kept"].as_array().unwrap().len()), (&serde_json::json!([]), 3));
    render(dir.path(), "-o out.png --frames 1..3");
    assert!(std::fs::read(&second).unwrap() == whole, "without it all frames are made");
    // One frame is also a picture of its own.
    render(dir.path(), "-o one.png --set frame=2");
    assert!(std::fs::read(dir.path().join("one.png")).unwrap() == whole);
}

/// Planes of .npy pictures are files of their own: a frame that lacks one was stopped while it was written.
#[test]
fn resume_makes_frames_anew_that_are_there_in_part() {
    let dir = folder();
    let line = "-o out.npy -o out.png --frames 1..2 --aov Z,N,cryptomatte";
    render(dir.path(), line);
    let whole = files(dir.path());
    let of_frame = |name: &&String| name.starts_with("out.0001.");
    assert_eq!(whole.iter().filter(of_frame).count(), 1 + 1 + 4 + 24, "colours, PNG, Z and N, mattes: {whole:?}");
    for name in ["out.0001.N.Y.npy", "out.0001.cryptoMaterial02.A.npy", "out.0001.npy", "out.0001.png"] {
        std::fs::remove_file(dir.path().join(name)).unwrap();
        let said = render(dir.path(), &format!("{line} --resume")).err;
        assert!(
            said.contains("out.0002.npy: there already") && !said.contains("out.0001.npy: there"),
            "{name}: {said}"
        );
        assert_eq!(files(dir.path()), whole, "{name}");
    }
}

#[test]
fn refusals_say_what_is_expected() {
    let dir = folder();
    for (line, what) in [
        ("render scene.kdl -o a.exr --frames 3..1", "expected A..B"),
        ("render scene.kdl -o a.exr --frames 3", "expected A..B"),
        ("render scene.kdl -o a.exr --resume --noise 0.1", "--resume goes with a fixed number of samples"),
        ("render scene.kdl -o a.exr --resume --time-limit 5", "--resume goes with a fixed number of samples"),
        ("render scene.kdl -o a.exr --resume --preview term", "--resume goes with a fixed number of samples"),
        ("render scene.kdl -o a.exr --frames 1..2 --set frame=7", "--set frame: --frames sets it"),
        ("render scene.obj -o a.exr --frames 1..2", "--frames: scene.obj has no parameters"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    std::fs::write(dir.path().join("scene.kdl"), "parameter a { key 3 1; key 2 5 }").unwrap();
    refused(dir.path(), &["render", "scene.kdl", "-o", "a.exr"], "scene.kdl:1:24: the frames of keys must grow");
    assert_eq!(files(dir.path()), ["scene.kdl"]);
}
