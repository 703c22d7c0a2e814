//! `convert` through the real binary: what it writes is what its own and other commands read.

mod binary;

use std::path::Path;

use binary::{files, lanecast, npy_parts, refused};

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
        assert!(number("distance_of_vertices") <= 0.005 && number("distance_of_middles") <= 0.005, "{report}");
        // Torus topology: V - E + F = 0 with 3 F = 2 E.
        assert_eq!(number("vertices") * 2.0, number("triangles"), "{name}");
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
    let ended = convert(dir.path(), "--solid box --cells 6 -o v.npy --json");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let report = ended.json();
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

#[test]
fn refusals_leave_no_files() {
    let dir = folder();
    let before = files(dir.path());
    for (line, what) in [
        ("convert block.kdl -o a.stl", "--solid NAME"),
        ("convert block.kdl --solid blok -o a.stl", "no solid is called `blok`"),
        ("convert block.kdl --solid block -o a.gltf", ".stl, .obj, .ply or .npy"),
        ("convert block.kdl --solid block -o a.stl --cells 30000", "MiB"),
        ("convert block.kdl --solid block -o a.npy --tolerance 1e-3 --memory 64", "MiB"),
        ("convert block.kdl --solid block -o a.stl --tolerance 1e-30", "--tolerance"),
        ("convert block.kdl --solid block -o a.stl --tolerance nan", "--tolerance"),
        ("convert none.kdl -o a.stl", "none.kdl"),
        ("convert block.kdl --solid block -o no/such/a.stl", "a.stl"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    assert_eq!(files(dir.path()), before);
}
