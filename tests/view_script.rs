//! `lanecast view --headless-script`: what a person does in the window, without one.

mod binary;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use binary::{Ended, SQUARE, files, lanecast, refused};
use lanecast::film::{Film, exr};
use serde_json::Value;

/// A folder with the unit square, a scene and a script.
fn folder(script: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("square.ply"), SQUARE).unwrap();
    std::fs::write(dir.path().join("script.txt"), script).unwrap();
    dir
}

fn view(dir: &Path, line: &str) -> Vec<Value> {
    let line = format!("view {line} --headless-script script.txt");
    let Ended { code, out, err } = lanecast(dir, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(code, Some(0), "{line}: {err}");
    out.lines().map(|line| serde_json::from_str(line).expect("an object per line")).collect()
}

/// A view that goes on, and what says its next line.
fn begun(dir: &Path, scene: &str, size: &str) -> (Child, impl FnMut() -> Value) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["view", scene, "--size", size, "--headless-script", "script.txt"])
        .current_dir(dir)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary");
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    (child, move || serde_json::from_str(&lines.next().expect("a line").unwrap()).unwrap())
}

fn render(dir: &Path, line: &str) -> Film {
    let line = format!("render {line} --exact -o plain.exr");
    let ended = lanecast(dir, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
    exr::read(&dir.join("plain.exr")).unwrap()
}

/// Largest difference of two pictures' colours, and how many pixels differ by more than a hundredth.
fn apart(a: &Film, b: &Film) -> (f32, usize) {
    let (a, b) = (a.color().unwrap(), b.color().unwrap());
    let by_pixel = (0..a[0].len()).map(|i| (0..3).map(|c| (a[c][i] - b[c][i]).abs()).fold(0.0, f32::max));
    by_pixel.fold((0.0, 0), |(most, many), d| (d.max(most), many + usize::from(d > 0.01)))
}

#[test]
fn the_view_is_the_rendered_picture() {
    let dir = folder("wait\nsave seen.exr\nintegrator normals\nspp 3\nwait\nsave normals.exr\n");
    let said = view(dir.path(), "builtin:gallery --size 130x75");
    assert_eq!(said.len(), 2);
    assert_eq!((&said[0]["command"], &said[0]["complete"]), (&"wait".into(), &true.into()));
    assert!(said[0]["first_picture_seconds"].as_f64() < said[0]["seconds"].as_f64());
    for (name, options) in [("seen.exr", ""), ("normals.exr", " --integrator normals --spp 3")] {
        let want = render(dir.path(), &format!("builtin:gallery --size 130x75{options}"));
        assert!(exr::read(&dir.path().join(name)).unwrap() == want, "{name}");
    }
}

/// A saved picture tells of what it shows, also after the view has moved on.
#[test]
fn saved_pictures_know_how_they_were_made() {
    let dir = folder("spp 3\nwait\norbit 20 0\nspp 5\nsave seen.exr\nwait\nsave turned.exr\n");
    view(dir.path(), "builtin:gallery --size 65x40 --engine packet8 --precision f32");
    render(dir.path(), "builtin:gallery --size 65x40 --spp 3");
    let attributes = |name: &str| {
        let meta = ::exr::meta::MetaData::read_from_file(dir.path().join(name), false).expect("an EXR");
        meta.headers[0].own_attributes.clone()
    };
    let [seen, turned, plain] = ["seen.exr", "turned.exr", "plain.exr"].map(attributes);
    let told = |of: &::exr::meta::header::LayerAttributes, name: &str| {
        format!("{:?}", of.other.get(&::exr::meta::attribute::Text::from(name)).expect(name))
    };
    for name in ["lanecast/sceneHash", "lanecast/spp", "lanecast/seed", "lanecast/isa", "lanecast/revision"] {
        assert_eq!(told(&seen, name), told(&plain, name), "{name}");
    }
    assert_eq!(seen.world_to_camera, plain.world_to_camera);
    assert_ne!(turned.world_to_camera, plain.world_to_camera);
    let number = |name: &str| match seen.other.get(&::exr::meta::attribute::Text::from(name)) {
        Some(::exr::meta::attribute::AttributeValue::F64(x)) => *x,
        other => panic!("{name}: {other:?}"),
    };
    assert!(number("lanecast/rays") >= 3.0 * 65.0 * 40.0 && number("lanecast/renderSeconds") > 0.0);
    // Lanes are those of a vector, however many vectors go together.
    let ints = |of| ["lanecast/lanes", "lanecast/batch"].map(|name| told(of, name));
    assert_eq!(
        (ints(&seen), ints(&plain)),
        (["I32(8)", "I32(8)"].map(String::from), ["I32(16)", "I32(1024)"].map(String::from))
    );
    assert!(told(&seen, "lanecast/lanes").contains('8') && told(&turned, "lanecast/spp").contains('5'));
}

/// Light that scatters more often than a mirror is followed: as deep as render goes, whether begun with or changed to.
#[test]
fn paths_are_as_long_as_those_of_render() {
    let dir = folder("wait\nsave begun.exr\nintegrator whitted\nintegrator path\nwait\nsave changed.exr\n");
    view(dir.path(), "builtin:cornell --size 32x20 --integrator path --spp 2");
    let want = render(dir.path(), "builtin:cornell --size 32x20 --integrator path --spp 2");
    for name in ["begun.exr", "changed.exr"] {
        assert!(exr::read(&dir.path().join(name)).unwrap() == want, "{name}");
    }
}

/// Views of BRL-CAD's `rt` too, which sample pixels at a corner, and again after a way out and home.
#[test]
fn a_view_of_rt_is_the_rendered_picture() {
    let dir = folder("wait\nsave seen.exr\norbit 10 0\nreset\nwait\nsave again.exr\n");
    view(dir.path(), "builtin:gallery --size 65x40 --az 35");
    let want = render(dir.path(), "builtin:gallery --size 65x40 --az 35");
    for name in ["seen.exr", "again.exr"] {
        assert!(exr::read(&dir.path().join(name)).unwrap() == want, "{name}");
    }
}

/// Moving by script is looking from there.
#[test]
fn moves_lead_where_they_say() {
    let start = "--eye 0,0,5 --look-at 0,0,0 --up 0,1,0 --fov 60";
    for (script, eye) in [
        ("orbit -90 0", "--eye 5,0,0 --look-at 0,0,0 --up 0,1,0 --fov 60"),
        ("orbit 0 30", "--eye 0,2.5,4.330127018922193 --look-at 0,0,0 --up 0,1,0 --fov 60"),
        ("zoom 2", "--eye 0,0,2.5 --look-at 0,0,0 --up 0,1,0 --fov 60"),
        ("fly 0.2 -0.1 0.5", "--eye 1,-0.5,2.5 --look-at 1,-0.5,-2.5 --up 0,1,0 --fov 60"),
        ("turn 45 0\nturn -45 0\nfov 30", "--eye 0,0,5 --look-at 0,0,0 --up 0,1,0 --fov 30"),
        ("orbit 10 10\nfly 1 1 1\nreset", start),
    ] {
        let dir = folder(&format!("{script}\nwait\nsave seen.exr\n"));
        view(dir.path(), &format!("builtin:sphere-flake --size 90x60 {start}"));
        let seen = exr::read(&dir.path().join("seen.exr")).unwrap();
        let want = render(dir.path(), &format!("builtin:sphere-flake --size 90x60 {eye}"));
        // Rounding moves edges by less than a pixel: a few of the 5400 may differ.
        let (_, many) = apart(&seen, &want);
        assert!(many <= 40, "{script}: {many} pixels differ");
    }
}

#[test]
fn a_click_tells_what_lies_there() {
    let dir = folder("click 32 32\nclick 0 0\nclick 64 0\n");
    let said = view(dir.path(), "square.ply --eye 0.5,0.5,2 --look-at 0.5,0.5,0 --fov 90 --size 64x64");
    let hit = &said[0]["hit"];
    let near = |value: &Value, want: f64| (value.as_f64().expect("a number") - want).abs() < 1e-6;
    // The picture is 4 wide at z = 0; the middle of pixel 32 lies half a pixel right of and below the centre.
    assert!(near(&hit["t"], 2.0) && near(&hit["position"][0], 0.5 + 2.0 / 64.0), "{hit}");
    assert!(near(&hit["position"][1], 0.5 - 2.0 / 64.0) && near(&hit["position"][2], 0.0), "{hit}");
    assert!(near(&hit["normal"][2], 1.0) && near(&hit["distance"], (4.0f64 + 2.0 / 1024.0).sqrt()), "{hit}");
    assert_eq!((&hit["primitive"], &hit["instance"], &hit["material"]), (&0.into(), &0.into(), &"default".into()));
    assert!(hit["tests"].as_u64() >= Some(1) && hit["leaves"].as_u64() >= Some(1), "{hit}");
    assert_eq!((&said[1]["hit"], &said[2]["hit"]), (&Value::Null, &Value::Null));
}

/// A frame of no time shows blocks; heat maps show something; an orbit is timed.
#[test]
fn frames_maps_and_orbits() {
    let script = "blocks 8\nframe 0\nsave frame.exr\nheat nodes\nwait\nsave nodes.exr\nheat lanes\nwait\nsave lanes.exr\n\
        heat off\nspin 3 5 0\n";
    let dir = folder(script);
    let said = view(dir.path(), "builtin:sphere-flake --size 200x120 --threads 1");
    let commands: Vec<&str> = said.iter().map(|o| o["command"].as_str().unwrap()).collect();
    assert_eq!(commands, ["frame", "wait", "wait", "spin"]);
    assert_eq!((&said[0]["complete"], &said[3]["complete_frames"]), (&false.into(), &3.into()));
    assert!(said[3]["frames_per_second"].as_f64() > Some(0.1));
    let frame = exr::read(&dir.path().join("frame.exr")).unwrap();
    let red = frame.f32_plane("R").unwrap();
    assert!((0..200 * 120).all(|i| red[i] == red[i / 200 / 8 * 8 * 200 + i % 200 / 8 * 8]), "blocks of 8");
    let [nodes, lanes] = ["nodes.exr", "lanes.exr"].map(|name| exr::read(&dir.path().join(name)).unwrap());
    for map in [&nodes, &lanes] {
        let values: std::collections::BTreeSet<_> = map.f32_plane("R").unwrap().iter().map(|r| r.to_bits()).collect();
        assert!(values.len() >= 3, "{values:?}");
    }
    assert!(apart(&nodes, &lanes).1 > 1000);
}

#[test]
fn refusals_say_what_is_expected() {
    let dir = folder("wait\norbit 1\n");
    let line = "view square.ply --headless-script";
    let arguments: Vec<&str> = line.split(' ').chain(["script.txt"]).collect();
    refused(dir.path(), &arguments, "script.txt:2:1: expected `orbit` and RIGHT UP");
    for (script, what) in [
        ("camera front", "script.txt:1:1: no camera `front`; there are: none"),
        ("engine skalar", "script.txt:1:1: no engine `skalar`"),
        ("integrator normal", "did you mean `normals`?"),
        ("integrator rt", "script.txt:1:1: the integrator `rt` shows BRL-CAD databases only"),
        ("fov 200", "between 0 and 180"),
        ("spp 0", "samples per pixel"),
        ("blocks 3", "16, 8, 4, 2 or 1"),
        ("save a.png", "nothing to save"),
        ("wait\nsave a.jpg", "script.txt:2:1: expected a file name that ends in .exr"),
    ] {
        std::fs::write(dir.path().join("script.txt"), script).unwrap();
        let ended = lanecast(dir.path(), &arguments);
        assert_eq!(ended.code, Some(2), "{script}: {}", ended.err);
        assert!(ended.err.contains(what) && !ended.err.contains("panicked"), "{script}: {}", ended.err);
    }
    std::fs::write(dir.path().join("script.txt"), "wait").unwrap();
    for (line, what) in [
        ("view square.ply --exact --engine tile", "--exact: tile has an arithmetic of its own"),
        ("view square.ply --engine skalar", "skalar"),
        ("view square.ply --integrator rt", "BRL-CAD databases"),
    ] {
        refused(dir.path(), &format!("{line} --headless-script script.txt").split(' ').collect::<Vec<_>>(), what);
    }
    let builtin = ["view", "builtin:die", "--headless-script", "script.txt"];
    std::fs::write(dir.path().join("script.txt"), "reload 1").unwrap();
    refused(dir.path(), &builtin, "script.txt:1:1: the scene has no file");
    assert_eq!(files(dir.path()), ["script.txt", "square.ply"]);
}

/// What `--integrator rt` refuses to begin with is refused later, too, and let through by `--lenient`.
#[test]
fn shaders_that_rt_does_not_know_are_refused_whenever_it_is_chosen() {
    let dir = folder("integrator rt\nframe 0\n");
    let database = "title {t}\nunits mm\nput {a.s} sph V {0 0 0} A {10 0 0} B {0 10 0} C {0 0 10}\n\
        put {a.r} comb region yes shader {wood} tree {l a.s}\n";
    std::fs::write(dir.path().join("wood.asc"), database).unwrap();
    let line = "view wood.asc --size 8x8 --headless-script script.txt";
    let arguments: Vec<&str> = line.split(' ').collect();
    refused(dir.path(), &arguments, "script.txt:1:1: the shader `wood` of region /a.r is not supported; --lenient");
    let ended = lanecast(dir.path(), &[&arguments[..], &["--lenient"]].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// What it may not be changed to by hand, it is not changed to by an edit of the file: the last good picture stays.
#[test]
fn shaders_that_rt_does_not_know_are_refused_when_a_file_brings_them() {
    let dir = folder("integrator rt\nwait\nsave a.exr\nreload 30\nwait\nsave b.exr\n");
    let write = |shader: &str| {
        let text = format!(
            "title {{t}}\nunits mm\nput {{a.s}} sph V {{0 0 0}} A {{10 0 0}} B {{0 10 0}} C {{0 0 10}}\n\
             put {{a.r}} comb region yes shader {{{shader}}} tree {{l a.s}}\n"
        );
        // In one step: half a file would be another mistake.
        let (new, file) = (dir.path().join("new"), dir.path().join("ball.asc"));
        std::fs::write(&new, text).unwrap();
        std::fs::rename(new, file).unwrap();
    };
    write("plastic");
    let (mut child, mut next) = begun(dir.path(), "ball.asc", "16x16");
    assert_eq!(next()["command"], "wait");
    write("wood");
    let reload = next();
    let error = reload["error"].as_str().expect("an error");
    assert!(error.contains("the shader `wood` of region /a.r is not supported; --lenient"), "{error}");
    assert_eq!(reload["changed"], false, "the scene is what it was");
    assert_eq!(next()["complete"], true);
    assert!(child.wait().unwrap().success());
    let [a, b] = ["a.exr", "b.exr"].map(|name| exr::read(&dir.path().join(name)).unwrap());
    assert!(a == b, "the last good picture");
}

const SCENE: &str = "camera \"c\" { eye 0 0 6; look-at 0 0 0; up 0 1 0; fov 40 }\n\
    difference { box { size 2 2 2 }; sphere radius=RADIUS }\n";

/// Save, and the picture follows; a mistake is told with its place and the last good picture stays; what does not belong to
/// the scene changes nothing.
#[test]
fn an_edit_is_seen() {
    let script = "wait\nsave a.exr\nreload 30\nsave b.exr\nreload 30\nwait\nsave c.exr\nreload 1\n";
    let dir = folder(script);
    let scene = dir.path().join("scene.kdl");
    let write = |radius: &str| std::fs::write(&scene, SCENE.replace("RADIUS", radius)).unwrap();
    write("1.2");
    let (mut child, mut next) = begun(dir.path(), "scene.kdl", "60x50");
    assert_eq!(next()["command"], "wait");
    write("1.35");
    let reload = next();
    assert_eq!((&reload["changed"], &reload["error"]), (&true.into(), &Value::Null), "{reload}");
    assert!(reload["save_to_picture_seconds"].as_f64() < Some(20.0), "{reload}");
    std::fs::write(&scene, SCENE.replace("RADIUS", "1.35 oops=2")).unwrap();
    let broken = next();
    let error = broken["error"].as_str().expect("an error");
    assert!(error.contains("scene.kdl:2:") && error.contains("oops"), "{error}");
    assert_eq!(broken["changed"], false, "the scene is what it was");
    assert_eq!(next()["complete"], true);
    // Put right as it was, and a picture saved beside it: the scene is the same.
    write("1.35");
    assert_eq!(next()["changed"], false);
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success(), "{said}");
    let [a, b, c] = ["a.exr", "b.exr", "c.exr"].map(|name| exr::read(&dir.path().join(name)).unwrap());
    assert!(apart(&a, &b).1 > 50, "the hole is wider");
    assert!(b == c, "the last good picture");
    let want = render(dir.path(), "scene.kdl --size 60x50");
    assert!(b == want, "the picture after the edit is the rendered one");
}

/// Many editors empty a file before they write it, and an empty scene is a scene: not this one. Where the system tells when a file is
/// closed.
#[cfg(target_os = "linux")]
#[test]
fn a_slow_save_is_seen_when_it_is_over() {
    let dir = folder("wait\nreload 30\nsave seen.exr\nreload 1\n");
    let scene = dir.path().join("scene.kdl");
    std::fs::write(&scene, SCENE.replace("RADIUS", "1.2")).unwrap();
    let (mut child, mut next) = begun(dir.path(), "scene.kdl", "60x50");
    assert_eq!(next()["command"], "wait");
    let mut file = std::fs::File::create(&scene).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(200));
    std::io::Write::write_all(&mut file, SCENE.replace("RADIUS", "1.35").as_bytes()).unwrap();
    drop(file);
    let reload = next();
    assert_eq!((&reload["changed"], &reload["error"]), (&true.into(), &Value::Null), "{reload}");
    assert_eq!(next()["changed"], false, "there was one change");
    assert!(child.wait().unwrap().success());
    let want = render(dir.path(), "scene.kdl --size 60x50");
    assert!(exr::read(&dir.path().join("seen.exr")).unwrap() == want, "the picture of the whole file");
}

/// `set` is what `--set` is, in a scene that stays open; a mistake keeps the picture.
#[test]
fn a_parameter_is_set() {
    let dir =
        folder("wait\nset hole.radius 6\nwait\nsave seen.exr\nset hole.radius 6\nset hole 5\nwait\nsave kept.exr\n");
    let said = view(dir.path(), "builtin:bolt --size 60x50");
    assert_eq!((&said[1]["command"], &said[1]["changed"]), (&"set".into(), &true.into()));
    assert_eq!(said[3]["changed"], false);
    let error = said[4]["error"].as_str().expect("an error");
    assert!(error.contains("no parameter `hole`"), "{error}");
    assert_eq!(said[4]["changed"], false, "the scene is what it was");
    let want = render(dir.path(), "builtin:bolt --size 60x50 --set hole.radius=6");
    for name in ["seen.exr", "kept.exr"] {
        assert!(exr::read(&dir.path().join(name)).unwrap() == want, "{name}");
    }
}
