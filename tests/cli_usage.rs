//! Help, versions, exit codes and refusals of the binary.

mod binary;

use binary::{lanecast, refused};

const COMMANDS: [&str; 5] = ["bench", "trace", "rays", "verify", "info"];

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn help_teaches_by_example() {
    let dir = folder();
    for command in COMMANDS {
        let ended = lanecast(dir.path(), &[command, "--help"]);
        assert_eq!(ended.code, Some(0), "{command}: {}", ended.err);
        assert!(
            ended.out.contains("Examples:") && ended.out.contains(&format!("  lanecast {command} ")),
            "{}",
            ended.out
        );
    }
    let trace = lanecast(dir.path(), &["trace", "--help"]).out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(trace.contains("the weights of the second and the third corner"), "{trace}");
    let top = lanecast(dir.path(), &["--help"]);
    assert_eq!(top.code, Some(0));
    for command in COMMANDS {
        assert!(top.out.contains(&format!("  {command} ")), "{command} in {}", top.out);
    }
    assert!(top.out.contains("Exit codes"));
}

#[test]
fn the_version_names_revision_and_instruction_set() {
    let dir = folder();
    let ended = lanecast(dir.path(), &["--version"]);
    assert_eq!(ended.code, Some(0));
    assert!(ended.out.starts_with("lanecast ") && ended.out.contains("revision ") && ended.out.contains("isa "));
}

#[test]
fn bad_usage_exits_with_2() {
    let dir = folder();
    let path = dir.path();
    assert_eq!(lanecast(path, &[]).code, Some(2));
    refused(path, &["unheard-of"], "unheard-of");
    refused(path, &["info"], "SCENE");
    refused(path, &["info", "missing.ply"], "missing.ply");
    refused(path, &["info", "builtin:sphere-flak"], "sphere-flake");
    refused(path, &["info", "scene.unknown"], "scene.unknown");
    refused(path, &["info", "builtin:sphere-flake", "--set", "depth"], "NAME=VALUE");
    refused(path, &["rays", "builtin:cornell", "--kind", "primry", "-o", "r.npy"], "primary");
    refused(path, &["rays", "builtin:cornell", "--kind", "ao", "--size", "0x4", "-o", "r.npy"], "WIDTHxHEIGHT");
    refused(path, &["rays", "builtin:cornell", "--kind", "ao", "--fov", "180", "-o", "r.npy"], "degrees");
    refused(path, &["render", "builtin:cornell", "--up", "0,0,0", "-o", "r.png"], "must have a direction");
    refused(path, &["bench", "builtin:cornell", "--engines", "scaler"], "scalar");
    refused(path, &["bench", "--threads", "0"], "threads");
    assert_eq!(binary::files(path), Vec::<String>::new(), "refusals leave no files");
}

#[test]
fn options_of_other_kinds_of_scenes_are_refused() {
    let dir = folder();
    for (scene, what) in [("builtin:die", "--apart"), ("a.glb", "--set n"), ("a.g", "--set n"), ("a.obj.gz", "--set n")]
    {
        let why = if what == "--apart" { "is no glTF file" } else { "has no parameters" };
        let options = if what == "--apart" { vec!["--apart"] } else { vec!["--set", "n=1"] };
        refused(dir.path(), &[&["info", scene][..], &options[..]].concat(), &format!("{what}: {scene} {why}"));
    }
    for scene in ["builtin:die", "a.kdl", "a.glb", "a.ply"] {
        for (option, more) in [("--top", &["all.g"][..]), ("--lenient", &[][..])] {
            let what = format!("{}: {scene} is no BRL-CAD database", [&[option][..], more].concat().join(" "));
            refused(dir.path(), &[&["info", scene, option][..], more].concat(), &what);
        }
    }
    // Where they mean something, the file is looked for.
    for line in ["info a.asc --top all.g --lenient", "info a.gltf --apart", "info a.kdl --set n=1"] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), "No such file");
    }
}

/// The scene would be opened first: there is none, and nobody asks.
#[test]
fn outputs_that_cannot_be_written_are_told_before_the_work() {
    let dir = folder();
    std::fs::write(dir.path().join("file"), "").expect("a file");
    let missing = std::fs::write(dir.path().join("no/a"), "").expect_err("there is no such folder").to_string();
    let in_the_way = std::fs::write(dir.path().join("file/a"), "").expect_err("no folder").to_string();
    for (line, name, why) in [
        ("render none.ply -o ok.png -o no/a.exr", "no/a.exr", &missing),
        ("render none.kdl -o no/a.npy --aov Z --frames 1..2", "no/a.0001.Z.npy", &missing),
        ("rays none.ply --kind ao -o no/a.npy", "no/a.npy", &missing),
        ("trace none.ply --rays none.npy --hits no/a.npy", "no/a.npy", &missing),
        ("convert none.kdl -o no/a.stl", "no/a.stl", &missing),
        ("compare none.exr none.exr -o no/a.png", "no/a.png", &missing),
        ("report none -o no/a.html", "no/a.html", &missing),
        ("explain none.ply -o file/a", "file/a", &in_the_way),
        ("bench none.ply -o file/a", "file/a", &in_the_way),
        ("bench none.ply --record file/a --dirty", "file/a", &in_the_way),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), &format!("error: {name}: {why}"));
    }
    assert_eq!(binary::files(dir.path()), ["file"]);
}

/// What was read is not replaced by what was made of it, also where a link leads to it.
#[test]
fn inputs_are_not_written_over() {
    let dir = folder();
    for name in ["a.npy", "a.png", "b.png", "s.ply", "bench.csv"] {
        std::fs::write(dir.path().join(name), name).expect("a file");
    }
    let mut lines = vec![
        ("trace s.ply --rays a.npy --hits a.npy", "a.npy: expected another file to write to; this one is read"),
        ("trace s.ply --rays a.npy --hits s.ply", "--hits s.ply: expected a name that ends in .npy"),
        ("rays s.ply --kind ao -o s.ply", "-o s.ply: expected a name that ends in .npy"),
        ("report . -o bench.csv", "-o bench.csv: expected a name that ends in .html"),
        ("compare a.png b.png -o ./a.png", "./a.png: expected another file"),
        ("compare a.png b.png -o c.png -o b.png", "b.png: expected another file"),
        ("convert s.ply -o s.ply", "s.ply: expected another file"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.npy", dir.path().join("link.npy")).expect("a link");
        lines.push(("trace s.ply --rays a.npy --hits link.npy", "this one is read (a.npy)"));
    }
    for (line, what) in lines {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    for name in ["a.npy", "a.png", "b.png", "s.ply", "bench.csv"] {
        assert_eq!(std::fs::read(dir.path().join(name)).expect("a file"), name.as_bytes());
    }
}

/// Two outputs are two files: the first would be lost. The scene and the pictures would be opened first: there are none, and nobody asks.
#[test]
fn outputs_are_not_written_over_by_each_other() {
    let dir = folder();
    for (line, name) in [
        ("render none.ply -o x.npy -o x.Z.npy --aov Z", "x.Z.npy"),
        ("render none.ply -o x.npy -o ./x.npy", "./x.npy"),
        ("render none.kdl -o x.png -o y.png -o x.png --frames 1..2", "x.0001.png"),
        ("compare none.exr none.exr -o d.png -o ./d.png", "./d.png"),
    ] {
        let what = format!("{name}: expected another file to write to; this one is written");
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), &what);
    }
    assert_eq!(binary::files(dir.path()), Vec::<String>::new());
    let line = "render builtin:die -o x.npy -o x.Z.npy -o x.png --size 8x8";
    let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(binary::files(dir.path()), ["x.Z.npy", "x.npy", "x.png"]);
}

/// Nor are the files that a scene refers to.
#[test]
fn files_of_a_scene_are_not_written_over() {
    let dir = folder();
    let corners = ["0 0 0", "0 1 0", "1 0 0", "0 0 1"];
    let facets = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].map(|facet| {
        let loops = facet.map(|k| format!("vertex {}\n", corners[k])).concat();
        format!("facet normal 0 0 0\nouter loop\n{loops}endloop\nendfacet\n")
    });
    let stl = format!("solid s\n{}endsolid s\n", facets.concat());
    std::fs::write(dir.path().join("part.stl"), &stl).expect("a mesh");
    std::fs::write(dir.path().join("part.kdl"), "mesh \"part.stl\"\n").expect("a scene");
    let ended = lanecast(dir.path(), &["render", "part.kdl", "-o", "wood.png", "--size", "8x8"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let wood = std::fs::read(dir.path().join("wood.png")).expect("a picture");
    let looks = "material \"wood\" { texture \"wood.png\" }\nbox material=\"wood\"\n";
    std::fs::write(dir.path().join("looks.kdl"), looks).expect("a scene");
    let before = binary::files(dir.path());
    for (line, what) in [
        ("convert part.kdl -o part.stl", "part.stl: expected another file to write to; this one is read"),
        ("render looks.kdl -o wood.png --size 8x8", "wood.png: expected another file to write to; this one is read"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    assert_eq!(binary::files(dir.path()), before);
    assert_eq!(std::fs::read(dir.path().join("part.stl")).expect("the mesh"), stl.as_bytes());
    assert_eq!(std::fs::read(dir.path().join("wood.png")).expect("the picture"), wood);
    // Beside them there is room.
    let ended = lanecast(dir.path(), &["render", "looks.kdl", "-o", "other.png", "--size", "8x8"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// Nor by the pictures of several frames, of a view, or those that a bench leaves beside its rows; before any work is done.
#[test]
fn files_of_a_scene_outlive_frames_views_and_benches() {
    let dir = folder();
    let (at, run) = (dir.path(), |line: &str| lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>()));
    std::fs::write(at.join("ball.kdl"), "sphere radius=1\n").expect("a scene");
    let ended = run("render ball.kdl -o sky.exr --size 16x8");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let sky = std::fs::read(at.join("sky.exr")).expect("a picture");
    for (scene, picture) in [("sky.kdl", "sky.exr"), ("turn.kdl", "sky.0002.exr")] {
        std::fs::write(at.join(picture), &sky).expect("a picture");
        std::fs::write(at.join(scene), format!("environment \"{picture}\"\nsphere radius=1\n")).expect("a scene");
    }
    std::fs::write(at.join("script.txt"), "wait\nsave ./sky.exr\n").expect("a script");
    let before = binary::files(at);
    let read = "expected another file to write to; this one is read";
    for (line, name) in [
        ("render turn.kdl -o sky.exr --frames 1..2 --size 8x8", "sky.0002.exr"),
        ("bench ball.kdl sky.kdl -o . --size 8x8 --rays primary --engines scalar --repeat 1", "./sky.exr"),
    ] {
        refused(at, &line.split(' ').collect::<Vec<_>>(), &format!("{name}: {read}"));
    }
    let ended = run("view sky.kdl --size 8x8 --headless-script script.txt");
    assert_eq!(ended.code, Some(2), "{}", ended.err);
    assert!(ended.err.contains(&format!("script.txt:2:1: ./sky.exr: {read}")), "{}", ended.err);
    assert_eq!(binary::files(at), before);
    for picture in ["sky.exr", "sky.0002.exr"] {
        assert!(std::fs::read(at.join(picture)).expect("the picture") == sky, "{picture}");
    }
    // Where nothing is replaced, nothing is refused.
    let ended = run("render turn.kdl -o sky.exr --frames 3..3 --size 8x8");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// Whatever says what is measured has no meaning where nothing is, or where a file says it.
#[test]
fn options_without_effect_are_refused() {
    let dir = folder();
    let settings = [
        "--rays ao",
        "--engines tile",
        "--peers obvhs",
        "--repeat 3",
        "--seed 2",
        "--threads 1",
        "--size 8x8",
        "--set x=1",
        "--leaf 4",
        "--precision f64",
        "--fov 30",
        "--record rows",
        "--scaling",
        "--turns 5",
    ];
    for mode in ["--compare a b", "--experiment a.kdl"] {
        for setting in settings {
            let line = format!("bench {mode} {setting}");
            refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), setting.split(' ').next().unwrap_or_default());
        }
    }
    refused(dir.path(), &["bench", "--turns", "5"], "--against");
    for peers in ["", " --peers obvhs", " --against none"] {
        let line = format!("bench none.ply --embree x.so{peers}");
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), "--embree: expected embree or embree-robust");
    }
    refused(dir.path(), &["report", ".", "--readme", "text.md", "-o", "page.html"], "--output");
}

/// `--eye -1,0,0` is a point, not an option.
#[test]
fn negative_coordinates_are_values() {
    let dir = folder();
    let arguments = "rays builtin:cornell --kind primary --size 32x32 --eye -9,1,8 --look-at -1,0,0 -o rays.npy";
    let ended = lanecast(dir.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let bytes = std::fs::read(dir.path().join("rays.npy")).expect("a ray file");
    let (header, data) = binary::npy_parts(&bytes);
    assert!(header.contains("(1024, 8)"), "{header}");
    assert_eq!(&data[..12], [-9f32, 1.0, 8.0].map(f32::to_le_bytes).concat());
}

/// `lanecast info ... | head -0` ends quietly with success.
#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["info", "builtin:cornell"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("an end");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(!err.contains("error") && !err.contains("panicked"), "{err}");
}
