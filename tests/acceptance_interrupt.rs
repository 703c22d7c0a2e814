//! A render that is stopped by Ctrl-C: exit code 130, a valid picture of the finished tiles, no temporary file. One that is killed goes
//! on from its finished tiles.
#![cfg(unix)]

mod binary;

use std::process::Command;
use std::time::Duration;

use binary::watch::{Running, until_it_listens};
use binary::{Ended, files, lanecast};
use lanecast::film::{exr, png};

const LIMIT: Duration = Duration::from_secs(50);

fn interrupt(running: &Running) {
    until_it_listens(running.id());
    let sent = Command::new("kill").args(["-INT", &running.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}

/// A picture that takes minutes, stopped after `wait`: the files left, and stderr.
fn stopped(target: &str, wait: Duration) -> (tempfile::TempDir, Vec<String>, String) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let line = format!("render builtin:gallery -o {target} --size 640x640 --spp 20 --integrator ao --ao-samples 256");
    let running = Running::start(dir.path(), &line.split(' ').collect::<Vec<_>>());
    std::thread::sleep(wait);
    interrupt(&running);
    let watched = running.wait(LIMIT);
    assert_eq!(watched.ended.code, Some(130), "{}", watched.ended.err);
    assert!(!watched.ended.err.contains("panicked"), "{}", watched.ended.err);
    let left = files(dir.path());
    (dir, left, watched.ended.err)
}

#[test]
fn what_was_finished_is_written() {
    let (dir, left, said) = stopped("out.exr", Duration::from_secs(4));
    assert_eq!(left, ["out.exr"], "{said}");
    assert!(said.contains("only ") && said.contains(" tiles"), "{said}");
    let film = exr::read(&dir.path().join("out.exr")).expect("a whole file");
    assert_eq!((film.width, film.height), (640, 640));
    let alpha = film.f32_plane("A").expect("A");
    let done: u64 = said.split("only ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok()).expect("a number");
    assert!(done < 400, "{said}");
    // Tiles are whole or empty: at most as many are seen as are said to be done.
    let tile = |i: usize| i / 640 / 32 * 20 + i % 640 / 32;
    let seen: std::collections::BTreeSet<_> =
        alpha.iter().enumerate().filter(|(_, a)| **a != 0.0).map(|(i, _)| tile(i)).collect();
    assert!(seen.len() as u64 <= done, "{} tiles show something, {said}", seen.len());
}

/// At any moment, also before the first tile or while the scene is built, nothing half-made is left.
#[test]
fn no_moment_leaves_a_broken_or_temporary_file() {
    for milliseconds in [60, 150, 400, 1000] {
        let (dir, left, said) = stopped("out.png", Duration::from_millis(milliseconds));
        assert!(left.is_empty() || left == ["out.png"], "after {milliseconds} ms: {left:?}");
        if !left.is_empty() {
            let film = png::read(&dir.path().join("out.png")).expect("a whole file");
            assert_eq!((film.width, film.height), (640, 640), "{said}");
        }
    }
}

/// One tile that takes minutes: nothing is finished, so nothing is written, and an older picture is kept.
#[test]
fn without_a_finished_tile_the_older_picture_is_kept() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let target = dir.path().join("out.png");
    let line = "render builtin:gallery -o out.png --size 32x32 --spp 65536 --integrator ao --ao-samples 256";
    for older in [None, Some(&b"an older picture"[..])] {
        if let Some(bytes) = older {
            std::fs::write(&target, bytes).expect("a file");
        }
        let running = Running::start(dir.path(), &line.split(' ').collect::<Vec<_>>());
        std::thread::sleep(Duration::from_millis(2500));
        interrupt(&running);
        let Ended { code, err, .. } = running.wait(LIMIT).ended;
        assert_eq!(code, Some(130), "{err}");
        assert!(err.contains("none of 1 tiles was finished, nothing is written"), "{err}");
        assert_eq!(std::fs::read(&target).ok().as_deref(), older, "{err}");
        assert_eq!(files(dir.path()).len(), usize::from(older.is_some()));
    }
}

/// Killed without a chance to write anything: `--resume` goes on, and the picture has the bits of one that nobody disturbed.
#[test]
fn a_killed_render_goes_on() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let line = |target: &str, more: &str| {
        let line = format!("render builtin:gallery -o {target} --size 320x320 --spp 8 --integrator ao --aov Z{more}");
        line.split(' ').map(String::from).collect::<Vec<_>>()
    };
    let words = line("out.exr", " --resume");
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (running, kept) = (Running::start(dir.path(), &words), dir.path().join("out.exr.tiles"));
    let since = std::time::Instant::now();
    let length = || std::fs::metadata(&kept).map_or(0, |meta| meta.len());
    while length() < 100_000 {
        assert!(since.elapsed() < LIMIT, "tiles are kept");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-KILL", &running.id().to_string()]).status().expect("kill").success());
    running.wait(LIMIT);
    assert_eq!(files(dir.path()), ["out.exr.tiles"], "killed before it was done");
    let ended = lanecast(dir.path(), &words);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(files(dir.path()), ["out.exr"], "the tiles are not needed any more");
    let words = line("whole.exr", "");
    assert_eq!(lanecast(dir.path(), &words.iter().map(String::as_str).collect::<Vec<_>>()).code, Some(0));
    let [out, whole] = ["out.exr", "whole.exr"].map(|name| exr::read(&dir.path().join(name)).expect("a file"));
    assert_eq!(out.planes, whole.planes);
}

/// Where time or noise decides, all tiles have samples soon: a stopped picture is written and said to be cut short, a stopped frame is
/// not written.
#[test]
fn pictures_without_a_number_of_samples_can_be_stopped_too() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = "light point { position 3 6 6; intensity 120 }\nsphere { translate \"frame * 0.1\" 0 0 }\n";
    std::fs::write(dir.path().join("turn.kdl"), scene).expect("a scene");
    let common = "render turn.kdl --size 128x128 --integrator path --json";
    for (more, wanted) in [
        ("-o a.exr --noise 1e-9", &["a.exr"][..]),
        ("-o b.exr --time-limit 600", &["b.exr"][..]),
        ("-o c.exr --time-limit 600 --frames 1..2", &[][..]),
    ] {
        let line = format!("{common} {more}");
        let running = Running::start(dir.path(), &line.split(' ').collect::<Vec<_>>());
        std::thread::sleep(Duration::from_millis(1500));
        interrupt(&running);
        let Ended { code, out, err } = running.wait(LIMIT).ended;
        assert_eq!(code, Some(130), "{line}: {err}");
        assert!(out.contains("\"complete\":false"), "{line}: {out}");
        assert!(out.contains(&format!("\"written\":{}", !wanted.is_empty())), "{line}: {out}");
        assert_eq!(err.contains("written"), wanted.is_empty(), "{line}: {err}");
        let left: Vec<_> = files(dir.path()).into_iter().filter(|name| name != "turn.kdl").collect();
        assert_eq!(left, wanted, "{line}: {err}");
        wanted.iter().for_each(|name| std::fs::remove_file(dir.path().join(name)).expect("a file"));
    }
}
