//! The built-in scenes hold what they promise, from inside the binary and as files; the examples of the format's
//! reference are scenes.

use std::path::{Path, PathBuf};

use glam::DVec3;
use lanecast::error::Error;
use lanecast::scene::assembly::{Assembly, PartKind};
use lanecast::scene::description::{Description, ItemKind, Shape};
use lanecast::scene::kdl::meshes::{MeshFile, MeshFiles};
use lanecast::scene::kdl::parse;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::obj::looks::Looks;
use lanecast::scene::{builtin, mesh::Mesh};

fn file_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(format!("{name}.kdl"))
}

fn built_in(name: &str, set: &[(&str, &str)]) -> Description {
    let set: Vec<_> = set.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    builtin::load(name, &set).unwrap_or_else(|e| panic!("{e}"))
}

/// Packed scene files are what they hold, and no larger than others may be.
#[test]
fn scene_files_may_be_packed() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let file = dir.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        load(&file.to_string_lossy(), &LoadOptions { set: vec![("r".into(), "3".into())], ..Default::default() })
    };
    let gzip = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, bytes).unwrap();
        encoder.finish().unwrap()
    };
    let text = b"parameter r 2\nsphere radius=\"r\"\n";
    let plain = write("s.kdl", text).unwrap();
    for (name, packed) in [("s.kdl.gz", gzip(text)), ("s.kdl.zst", zstd::bulk::compress(text, 3).unwrap())] {
        let found = write(name, &packed).unwrap();
        assert_eq!((&found.name, &found.hash), (&plain.name, &plain.hash), "{name}");
        assert_eq!(format!("{:?}", found.groups), format!("{:?}", plain.groups), "{name}");
    }
    let bomb = write("bomb.kdl.gz", &gzip(&vec![b' '; (64 << 20) + 1])).unwrap_err().to_string();
    assert!(bomb.contains("unpacks to more than 67108864 bytes"), "{bomb}");
}

#[test]
fn files_and_built_in_scenes_are_the_same() {
    for name in builtin::NAMES {
        let options = LoadOptions::default();
        let mut from_file = load(&file_of(name).to_string_lossy(), &options).unwrap();
        let inside = load(&format!("builtin:{name}"), &options).unwrap();
        assert_eq!(from_file.source.take(), Some(file_of(name)));
        assert_eq!(from_file.hash, inside.hash);
        assert!(format!("{from_file:?}") == format!("{inside:?}"), "{name} differs");
        let shines =
            inside.background.max_element() > 0.0 || inside.materials.iter().any(|m| m.emission.max_element() > 0.0);
        assert!(!inside.cameras.is_empty() && inside.materials.len() > 1, "{name}");
        assert!(!inside.lights.is_empty() || shines, "{name} is dark");
    }
    let error = load("builtin:forrest", &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("did you mean `builtin:forest`?"), "{error}");
    let error = load("forest", &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(".kdl .obj .ply .stl") && error.contains("did you mean `builtin:forest`?"), "{error}");
}

/// The box for paths has the room of the other one, and a lamp in place of its light.
#[test]
fn the_cornell_boxes_are_one_room() {
    let (box_, room) = (built_in("cornell-box", &[]), built_in("cornell", &[]));
    assert_eq!(box_.meshes, room.meshes);
    assert!(box_.lights.is_empty() && box_.background == DVec3::ZERO && box_.cameras == room.cameras);
    let lamp = box_.materials.iter().find(|m| m.name == "lamp").unwrap();
    assert!(lamp.one_sided && lamp.emission.x > 20.0);
    let [a, b, c] = box_.meshes[1].corners(0);
    assert!((b - a).cross(c - a).normalize() == DVec3::NEG_Y, "the lamp shines down");
}

#[test]
fn a_mesh_file_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("thing.obj");
    std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl steel\nf 1 2 3\n").unwrap();
    let scene = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap();
    assert_eq!((scene.name.as_str(), scene.meshes[0].triangles.len(), scene.hash.len()), ("thing", 1, 64));
    assert_eq!(scene.materials[1].name, "steel");
    let set = LoadOptions { set: vec![("a".into(), "1".into())], ..Default::default() };
    assert!(matches!(load(&file.to_string_lossy(), &set), Err(Error::Usage(_))));
}

#[test]
fn the_flake_has_its_spheres() {
    // 1 + 9 + 81 + 729 + 6561, and the floor.
    assert_eq!(Assembly::new(&built_in("sphere-flake", &[])).unwrap().instanced_prims(), 7381 + 1);
    assert_eq!(Assembly::new(&built_in("sphere-flake", &[("depth", "1")])).unwrap().instanced_prims(), 10 + 1);
}

#[test]
fn teaching_is_small_and_gallery_complete() {
    assert!(Assembly::new(&built_in("teaching", &[])).unwrap().instanced_prims() < 30);
    let gallery = built_in("gallery", &[]);
    let has = |wanted: fn(&Shape) -> bool| {
        let sheared = |t: glam::DMat3| t.x_axis.dot(t.y_axis).abs().max(t.x_axis.dot(t.z_axis).abs()) > 0.05;
        gallery.groups[0].items.iter().any(|i| match &i.kind {
            ItemKind::Shape(s) => wanted(s) && sheared(i.transform.matrix3),
            _ => false,
        })
    };
    assert!(has(|s| *s == Shape::Sphere), "sphere");
    assert!(has(|s| *s == Shape::Cuboid), "box");
    assert!(has(|s| *s == Shape::Disc), "disc");
    assert!(has(|s| *s == Shape::Cylinder), "cylinder");
    assert!(has(|s| *s == Shape::cone(0.0)), "cone");
    let shapes = || gallery.groups[0].items.iter().map(|i| &i.kind);
    assert!(shapes().any(|k| matches!(k, ItemKind::Shape(Shape::HalfSpace))));
    assert!(shapes().any(|k| matches!(k, ItemKind::Shape(Shape::Cone { top, .. }) if *top > 0.0)));
    assert!(shapes().any(|k| matches!(k, ItemKind::Mesh(_))));
}

#[test]
fn the_cornell_box_has_its_measured_volumes() {
    let cornell = built_in("cornell", &[]);
    assert_eq!(cornell.meshes.len(), 16);
    let area = |mesh: &Mesh| -> f64 {
        let corners = (0..mesh.triangles.len()).map(|i| mesh.corners(i));
        corners.map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
    };
    // The lamp is 130 by 105 mm; the tops of the blocks are their footprints, turned squares of about 165 mm.
    assert!((area(&cornell.meshes[1]) - 13_650.0).abs() < 1e-9);
    for (top, height) in [(6, 165.0), (11, 330.0)] {
        let mesh = &cornell.meshes[top];
        assert!((area(mesh) / 165.0_f64.powi(2) - 1.0).abs() < 0.02, "{}", area(mesh));
        assert!(mesh.positions.iter().all(|p| p.y == height));
        let walls: Vec<DVec3> = cornell.meshes[top + 1..top + 5].iter().flat_map(|m| m.positions.clone()).collect();
        assert!(walls.iter().all(|w| mesh.positions.iter().any(|p| p.x == w.x && p.z == w.z)));
    }
}

#[test]
fn the_forest_is_nested_and_has_ten_million_triangles() {
    let forest = built_in("forest", &[]);
    let assembly = Assembly::new(&forest).unwrap();
    let triangles: u64 = assembly
        .placements
        .iter()
        .flat_map(|p| &assembly.objects[p.object as usize].parts)
        .map(|part| if let PartKind::Mesh(mesh) = &part.kind { mesh.triangles.len() as u64 } else { 0 })
        .sum();
    assert!(triangles > 10_000_000, "{triangles}");
    let stored: usize = forest.meshes.iter().map(|m| m.triangles.len()).sum();
    assert!(stored < 100_000, "{stored}");
    // A root instance leads to a group that itself holds instances.
    let has_instances =
        |g: u32| forest.groups[g as usize].items.iter().any(|i| matches!(i.kind, ItemKind::Instance(_)));
    assert!(forest.groups[0].items.iter().any(|i| matches!(i.kind, ItemKind::Instance(g) if has_instances(g))));
}

#[test]
fn terrain_grows_with_its_parameter() {
    let count = |set: &[(&str, &str)]| built_in("terrain", set).meshes[0].triangles.len();
    assert_eq!(count(&[]), 100_352);
    assert_eq!(count(&[("size", "1024")]), 2 << 20);
    let error = builtin::load("terrain", &[("sise".into(), "2".into())]).unwrap_err().to_string();
    assert!(error.contains("did you mean `size`?"), "{error}");
}

#[test]
fn the_examples_of_the_reference_are_scenes() {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SCENES.md")).unwrap();
    let examples: Vec<&str> =
        text.split("```kdl\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default()).collect();
    assert!(examples.len() >= 10);
    let folder = tempfile::tempdir().unwrap();
    for name in ["teapot.ply", "bolt.stl"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    let file = || MeshFile { mesh: Mesh::default(), digest: [0; 32], looks: Looks::default() };
    let read = |_: &Path| Ok(file());
    let files = MeshFiles { folder: Some(folder.path()), allow_outside: false, found: None, read: &read };
    for example in examples {
        let scene = parse(Path::new("docs/SCENES.md"), "example", example.as_bytes(), &[], &files);
        assert!(scene.is_ok(), "{example}\n{}", scene.unwrap_err());
    }
}
