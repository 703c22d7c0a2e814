//! `convert` through the real binary: what it writes is what its own and other commands read.

mod binary;

use std::path::Path;

use binary::{SQUARE, files, lanecast, npy_parts, refused, shared};

/// A block with a hole, on a table.
const BLOCK: &str = "\
parameter hole 0.5
plane { point 0 0 0; normal 0 0 1 }
difference \"block\" {
    box { min -1 -1 0.25; max 1 1 1.25 }
    cylinder radius=\"hole\" { from 0 0 -1; to 0 0 3 }
}
difference \"box\" { box { min 3 0 1; max 5 3 2 } }
";

/// A BRL-CAD database.
const BRLCAD: &str = "brlcad/db/moss.asc";

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("block.kdl"), BLOCK).expect("a scene");
    dir
}

fn convert(dir: &Path, more: &str) -> binary::Ended {
    lanecast(dir, &format!("convert block.kdl {more}").split_whitespace().collect::<Vec<_>>())
}

#[test]
fn meshes_come_back_as_scenes() {
    let dir = folder();
    for name in ["a.stl", "a.obj", "a.ply"] {
        let ended = convert(dir.path(), &format!("--solid block --tolerance 0.005 -o {name} --json"));
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.err);
        let report = ended.json();
        let number = |key: &str| report[key].as_f64().expect("a number");
        let want = 4.0 - std::f64::consts::PI / 4.0;
        assert!((number("volume") - want).abs() < 0.02, "{name}: {report}");
        assert!(number("distance_of_mesh") <= 0.005 && number("distance_of_solid") <= 0.005, "{report}");
        // Torus topology: V - E + F = 0 with 3 F = 2 E.
        assert_eq!(number("vertices") * 2.0, number("triangles"), "{name}");
        assert_eq!((number("euler"), number("shells")), (0.0, 1.0), "{name}");
        let info = lanecast(dir.path(), &["info", name, "--json"]);
        assert_eq!(info.code, Some(0), "{name}: {}", info.err);
        assert_eq!(info.json()["counts"]["primitives"], report["triangles"], "{name}");
        // The reader finds it closed, too: only closed meshes may be operands.
        let scene = format!("difference \"again\" {{ mesh \"{name}\"; sphere radius=0.1 }}\n");
        std::fs::write(dir.path().join("again.kdl"), scene).expect("a scene");
        let again = lanecast(dir.path(), &["info", "again.kdl"]);
        assert_eq!(again.code, Some(0), "{name}: {}", again.err);
    }
}

#[test]
fn parameters_and_threads() {
    let dir = folder();
    let volume = |more: &str| {
        let ended = convert(dir.path(), &format!("--solid block --cells 40 -o v.ply --json {more}"));
        assert_eq!(ended.code, Some(0), "{}", ended.err);
        (ended.json()["volume"].as_f64().expect("a number"), std::fs::read(dir.path().join("v.ply")).expect("a mesh"))
    };
    let (narrow, wide) = (volume("--threads 1"), volume("--set hole=0.8"));
    assert!((narrow.0 - wide.0 - std::f64::consts::PI * 0.39).abs() < 0.01, "{} {}", narrow.0, wide.0);
    assert!(narrow.1 == volume("--threads 2").1, "the same bytes on any number of threads");
}

#[test]
fn voxels_have_the_shape_and_place_that_is_printed() {
    let dir = folder();
    let ended = convert(dir.path(), "--solid box --voxels 6 -o v.npy --json");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let report = ended.json();
    // The box is 2 x 3 x 1: x runs fastest.
    assert_eq!((&report["shape"], &report["inside"]), (&serde_json::json!([2, 6, 4]), &48.into()));
    // The box is a few roundings wider than the solid.
    let near = |value: &serde_json::Value, want: f64| (value.as_f64().expect("a number") - want).abs() < 1e-6;
    let origin = &report["origin"];
    assert!(near(&origin[0], 3.25) && near(&origin[1], 0.25) && near(&origin[2], 1.25), "{report}");
    assert!(near(&report["spacing"], 0.5) && near(&report["volume"], 6.0), "{report}");
    let bytes = std::fs::read(dir.path().join("v.npy")).expect("voxels");
    let (header, data) = npy_parts(&bytes);
    assert!(header.contains("'|u1'") && header.contains("(2, 6, 4)"), "{header}");
    assert_eq!(data, [1; 48]);
}

/// The flags of a block with a hole against the solid itself, and the same voxels as a mesh.
#[test]
fn voxels_are_inside_where_the_solid_is() {
    let dir = folder();
    let ended = convert(dir.path(), "--solid block --tolerance 0.05 -o v.npy --json");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let report = ended.json();
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let (spacing, origin) = (number(&report["spacing"]), [0, 1, 2].map(|i| number(&report["origin"][i])));
    assert!((spacing * 3f64.sqrt() / 2.0 - 0.05).abs() < 1e-12, "{report}");
    let bytes = std::fs::read(dir.path().join("v.npy")).expect("voxels");
    let (_, data) = npy_parts(&bytes);
    let [nz, ny, nx] = [0, 1, 2].map(|i| report["shape"][i].as_u64().expect("a size") as usize);
    assert_eq!(data.len(), nz * ny * nx);
    for (i, flag) in data.iter().enumerate() {
        let at = |n: usize, axis: usize| origin[axis] + n as f64 * spacing;
        let [x, y, z] = [at(i % nx, 0), at(i / nx % ny, 1), at(i / nx / ny, 2)];
        let inside = x.abs() < 1.0 && y.abs() < 1.0 && (0.25..1.25).contains(&z) && x.hypot(y) > 0.5;
        assert_eq!(*flag == 1, inside, "{x} {y} {z}");
    }
    let ended = convert(dir.path(), "--solid block --voxels 12 -o faces.ply --json");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let (faces, flags) = (ended.json(), convert(dir.path(), "--solid block --voxels 12 -o w.npy --json").json());
    assert!((number(&faces["volume"]) / number(&flags["volume"]) - 1.0).abs() < 1e-4, "{faces} {flags}");
    assert_eq!(number(&faces["euler"]), 0.0, "{faces}");
}

/// A coarse grid is what was asked for; a plate that is lost between its corners is not.
#[test]
fn cells_warn_of_thin_parts_only() {
    let dir = folder();
    let scene = "union \"ball\" { sphere radius=1 }\n\
        union \"plate\" { box { min -1 -1 -1; max 1 1 1 }; box { min 2.99 -1 -1; max 3 1 1 } }\n";
    std::fs::write(dir.path().join("block.kdl"), scene).expect("a scene");
    for (solid, warned) in [("ball", false), ("plate", true)] {
        let ended = convert(dir.path(), &format!("--solid {solid} --cells 6 -o a.stl"));
        assert_eq!(
            (ended.code, ended.err.contains("thinner than a cell")),
            (Some(0), warned),
            "{solid}: {}",
            ended.err
        );
    }
}

/// Twice the same name is one solid.
#[test]
fn a_name_may_be_given_twice() {
    let dir = folder();
    let once = convert(dir.path(), "--solid block --cells 12 -o a.stl --json");
    let twice = convert(dir.path(), "--solid block --solid block --cells 12 -o a.stl --json");
    assert_eq!((twice.code, &twice.out), (Some(0), &once.out), "{}", twice.err);
    refused(
        dir.path(),
        &"convert block.kdl --solid block --solid blok -o b.stl".split(' ').collect::<Vec<_>>(),
        "`blok`",
    );
}

/// Mesh and solid beside each other in one scene; the mesh is an operand too.
#[test]
fn a_mesh_stands_beside_its_solid() {
    let dir = folder();
    let ended = convert(dir.path(), "--solid block -o block.obj -q");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""));
    assert!(ended.out.starts_with("block.obj\ntriangles "), "{}", ended.out);
    let scene = format!("{BLOCK}\nmesh \"block.obj\" {{ translate 0 4 0 }}\n");
    std::fs::write(dir.path().join("both.kdl"), scene).expect("a scene");
    let verified = lanecast(dir.path(), &["verify", "both.kdl", "--rays", "500"]);
    assert_eq!(verified.code, Some(0), "{}{}", verified.out, verified.err);
}

/// Corners of all triangles of a scene of meshes, as OBJ has them.
fn corners(dir: &Path, scene: &str) -> Vec<[String; 3]> {
    let ended = lanecast(dir, &["convert", scene, "-o", "read.obj"]);
    assert_eq!(ended.code, Some(0), "{scene}: {}", ended.err);
    let text = std::fs::read_to_string(dir.join("read.obj")).expect("a mesh");
    let lines = |start: &'static str| text.lines().filter_map(move |line| line.strip_prefix(start));
    let vertices: Vec<&str> = lines("v ").collect();
    let corner = |word: &str| vertices[word.parse::<usize>().expect("a number") - 1].to_string();
    let triangle = |line: &str| line.split(' ').map(corner).collect::<Vec<_>>().try_into().expect("three corners");
    lines("f ").map(triangle).collect()
}

/// Meshes change their format and nothing else; instances are where they are placed.
#[test]
fn loose_meshes_are_written_as_they_are() {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(dir.path().join("square.ply"), SQUARE).expect("a mesh");
    let want = corners(dir.path(), "square.ply");
    assert!(!want.is_empty());
    for (from, to) in [("square.ply", "a.obj"), ("a.obj", "b.stl"), ("b.stl", "c.ply")] {
        let ended = lanecast(dir.path(), &["convert", from, "-o", to, "--json"]);
        assert_eq!(ended.code, Some(0), "{from}: {}", ended.err);
        assert_eq!(ended.json()["triangles"], want.len(), "{from}");
        assert_eq!(corners(dir.path(), to), want, "{from} to {to}");
    }
    let scene = "define \"s\" { mesh \"square.ply\" }\ninstance \"s\"\ninstance \"s\" { scale 2; translate 10 0 0 }\n";
    std::fs::write(dir.path().join("two.kdl"), scene).expect("a scene");
    let two = corners(dir.path(), "two.kdl");
    assert_eq!(two.len(), 2 * want.len());
    let numbers = |v: &str| v.split(' ').map(|x| x.parse().expect("a number")).collect::<Vec<f64>>();
    for (own, placed) in two[..want.len()].iter().flatten().zip(two[want.len()..].iter().flatten()) {
        let (own, placed) = (numbers(own), numbers(placed));
        assert_eq!([placed[0], placed[1], placed[2]], [2.0 * own[0] + 10.0, 2.0 * own[1], 2.0 * own[2]]);
    }
}

#[test]
fn other_kinds_of_scenes() {
    let dir = folder();
    for (line, solid) in [("builtin:bolt --solid washer", "washer"), ("builtin:die --solid first", "die")] {
        let line = format!("convert {line} -o {solid}.stl --json");
        let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
        assert_eq!(ended.json()["shells"], 1, "{line}");
    }
    let Some(path) = shared(BRLCAD) else { return };
    let path = path.to_str().expect("UTF-8");
    let ended = lanecast(dir.path(), &["convert", path, "--top", "all.g", "-o", "moss.ply", "--cells", "60", "--json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(ended.json()["triangles"].as_u64().expect("a number") > 1000, "{}", ended.out);
}

/// Coordinates of 30000 leave f32 steps of 0.002: the default gives way to that, a bound is told of what was asked for, and flags
/// have no vertices.
#[test]
fn far_from_the_origin_only_what_was_asked_for_is_refused() {
    let dir = folder();
    std::fs::write(dir.path().join("block.kdl"), "box size=1 { translate 10000 20000 30000 }\n").expect("a scene");
    for line in ["-o a.stl", "-o a.stl --cells 20", "-o a.stl --voxels 20", "-o a.npy --voxels 300", "-o a.npy"] {
        let ended = convert(dir.path(), &format!("{line} --json"));
        assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
        let volume = ended.json()["volume"].as_f64().expect("a number");
        assert!((volume - 1.0).abs() < 0.05, "{line}: {volume}");
    }
    let refuse = |line: &str, what: &str| refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    refuse("convert block.kdl -o b.stl --tolerance 0.001", "--tolerance: expected a number of at least 7.1");
    refuse("convert block.kdl -o b.stl --cells 1000", "--cells 1000: finer than the digits of f32");
    refuse("convert block.kdl -o b.stl --voxels 1000", "expected at most 279");
    std::fs::write(dir.path().join("block.kdl"), "box size=1 { translate 0 0 1e8 }\n").expect("a scene");
    refuse("convert block.kdl -o b.stl", "move them to the origin");
    assert!(!dir.path().join("b.stl").exists());
}

#[test]
fn refusals_leave_no_files() {
    let dir = folder();
    std::fs::write(dir.path().join("mesh.ply"), SQUARE).expect("a mesh");
    let before = files(dir.path());
    for (line, what) in [
        ("convert block.kdl -o a.stl", "--solid NAME"),
        ("convert block.kdl --solid blok -o a.stl", "no solid is called `blok`"),
        ("convert block.kdl --solid block -o a.gltf", ".stl, .obj, .ply or .npy"),
        ("convert block.kdl --solid block -o a.stl --cells 30000", "MiB"),
        ("convert block.kdl --solid block -o a.npy --tolerance 1e-3 --memory 64", "MiB"),
        ("convert block.kdl --solid block -o a.stl --tolerance 1e-30", "--tolerance"),
        ("convert block.kdl --solid block -o a.stl --tolerance nan", "--tolerance"),
        ("convert block.kdl --solid block -o a.stl --cells 2000 --memory 100", "--cells"),
        ("convert block.kdl --solid block -o a.npy --cells 20", "--voxels"),
        ("convert block.kdl --solid block -o a.npy --voxels 20 --tolerance 0.1", "cannot be used with"),
        ("convert mesh.ply -o a.npy", "is a solid"),
        ("convert mesh.ply -o a.stl --cells 20", "they become .stl, .obj or .ply as they are"),
        ("convert mesh.ply -o a.stl --memory 0", "1 MiB: more than --memory"),
        ("convert none.kdl -o a.stl", "none.kdl"),
        ("convert block.kdl --solid block -o no/such/a.stl", "a.stl"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    assert_eq!(files(dir.path()), before);
}

/// What an error says would fit does: of meshes, of voxels and of their faces, which need more than their flags.
#[test]
fn what_is_said_to_fit_fits() {
    let dir = folder();
    for (line, option) in [
        ("-o a.stl --cells 6000 --memory 8", "--cells"),
        ("-o a.stl --cells 60 --memory 2", "--cells"),
        ("-o a.stl --tolerance 0.001 --memory 4", "--cells"),
        ("-o a.stl --tolerance 0.001 --memory 8", "--cells"),
        ("-o a.stl --voxels 6000 --memory 8", "--voxels"),
        ("-o a.stl --voxels 100 --memory 8", "--voxels"),
        ("-o a.npy --voxels 6000 --memory 8", "--voxels"),
        ("-o a.npy --voxels 6000 --memory 8", "--tolerance"),
    ] {
        let start = "convert builtin:bolt --solid bolt";
        let words = format!("{start} {line}");
        let ended = lanecast(dir.path(), &words.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(2), "{line}: {}", ended.err);
        let rest = ended.err.split(&format!("{option} ")).nth(1);
        let number = rest.and_then(|rest| rest.split([' ', ',', ';']).next());
        let number = number.unwrap_or_else(|| panic!("{line}: {option} in {}", ended.err));
        let (file, memory) = (&line[..8], line.rsplit(' ').next().expect("a number"));
        let words = format!("{start} {file} {option} {number} --memory {memory}");
        let fitting = lanecast(dir.path(), &words.split(' ').collect::<Vec<_>>());
        assert_eq!(fitting.code, Some(0), "{words}: {}", fitting.err);
    }
    let line = "convert builtin:bolt --solid bolt -o a.stl --cells 50 --memory 0";
    refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), "no coarser one fits");
}
