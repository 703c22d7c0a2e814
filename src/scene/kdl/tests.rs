//! Tests of statements: what each means, against numbers worked out by hand.

use std::path::Path;

use glam::{DVec3, dvec3};

use super::*;
use crate::error::Error;
use crate::scene::description::{ItemKind, Light, Precision, Projection, Shape};
use crate::scene::mesh::{Mesh, MeshGroup};

fn read_fake(path: &Path) -> Result<meshes::MeshFile> {
    let groups = vec![MeshGroup { name: String::new(), material: "steel".into(), first: 0, count: 1 }];
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let digest = [path.as_os_str().len() as u8; 32];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], groups, ..Mesh::default() };
    Ok(meshes::MeshFile { mesh, digest, looks: Default::default() })
}

fn scene_with(text: &str, set: &[(&str, &str)]) -> Result<Description> {
    let set: Vec<_> = set.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read_fake };
    parse(Path::new("t.kdl"), "t", text.as_bytes(), &set, &files)
}

fn scene(text: &str) -> Description {
    scene_with(text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// Asserts that item `i` of the root is `shape` and takes local points to world points.
fn assert_item(text: &str, i: usize, shape: Shape, points: &[([f64; 3], [f64; 3])]) {
    let description = scene(text);
    let item = &description.groups[0].items[i];
    assert!(matches!(item.kind, ItemKind::Shape(s) if s == shape), "{text}: {:?}", item.kind);
    for &(local, world) in points {
        let got = item.transform.transform_point3(local.into());
        assert!(got.distance(world.into()) < 1e-12, "{text}: {local:?} went to {got}, not {world:?}");
    }
}

const O: [f64; 3] = [0.0, 0.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

#[test]
fn shapes_have_their_size_and_place() {
    use Shape::*;
    assert_item("sphere", 0, Sphere, &[(X, X)]);
    assert_item("sphere radius=2 center=\"1, 2, 3\"", 0, Sphere, &[(X, [3.0, 2.0, 3.0]), (O, [1.0, 2.0, 3.0])]);
    assert_item("sphere { center 1 2 3; radius \"1 + 1\" }", 0, Sphere, &[(Y, [1.0, 4.0, 3.0])]);
    assert_item("box", 0, Cuboid, &[([1.0; 3], [0.5; 3])]);
    assert_item(
        "box { min 1 2 3; max 2 4 6 }",
        0,
        Cuboid,
        &[([-1.0; 3], [1.0, 2.0, 3.0]), ([1.0; 3], [2.0, 4.0, 6.0])],
    );
    assert_item("box size=\"2, 4, 6\" { center 1 1 1 }", 0, Cuboid, &[([1.0; 3], [2.0, 3.0, 4.0])]);
    assert_item(
        "cylinder radius=2 { from 1 0 0; to 1 0 5 }",
        0,
        Cylinder,
        &[(X, [3.0, 0.0, 0.0]), (Z, [1.0, 0.0, 5.0])],
    );
    assert_item("cylinder { from 0 0 0; to 0 3 0 }", 0, Cylinder, &[(O, O), (Z, [0.0, 3.0, 0.0])]);
    assert_item("cone radius=2 top=1", 0, Shape::cone(0.5), &[(X, [2.0, 0.0, 0.0]), (Z, Z)]);
    // A cone that widens upwards stands on its head.
    let mirrored = Cone { top: 0.5, is_mirrored: true };
    assert_item(
        "cone radius=1 top=2 { to 0 0 4 }",
        0,
        mirrored,
        &[(O, [0.0, 0.0, 4.0]), (Z, O), (X, [2.0, 0.0, 4.0]), (Y, [0.0, 2.0, 4.0])],
    );
    assert_item("disc radius=3 { center 0 1 0; normal 0 0 2 }", 0, Disc, &[(X, [3.0, 1.0, 0.0])]);
    assert_item("plane { point 0 5 0; normal 0 2 0 }", 0, HalfSpace, &[(O, [0.0, 5.0, 0.0]), (Z, [0.0, 6.0, 0.0])]);
    assert_item("half-space { normal 0 0 -1 }", 0, HalfSpace, &[(Z, [0.0, 0.0, -1.0])]);
}

#[test]
fn transforms_act_in_written_order() {
    use Shape::Sphere;
    assert_item("sphere { rotate z 90; translate 1 0 0 }", 0, Sphere, &[(X, [1.0, 1.0, 0.0])]);
    assert_item("sphere { translate 1 0 0; rotate z 90 }", 0, Sphere, &[(X, [0.0, 2.0, 0.0])]);
    assert_item("sphere { translate 1 1 1; scale 2 }", 0, Sphere, &[(O, [2.0; 3])]);
    assert_item("sphere { scale 1 2 3 }", 0, Sphere, &[([1.0; 3], [1.0, 2.0, 3.0])]);
    assert_item("sphere { rotate x 90 }", 0, Sphere, &[(Y, Z)]);
    assert_item("sphere { rotate y 90 }", 0, Sphere, &[(Z, X)]);
    assert_item("sphere { rotate 1 1 1 120 }", 0, Sphere, &[(X, Y), (Y, Z)]);
    assert_item("sphere { shear xy=0.5 zx=2 }", 0, Sphere, &[(Y, [0.5, 1.0, 0.0]), (X, [1.0, 0.0, 2.0])]);
    assert_item("sphere { matrix 1 2 0 10  0 1 0 20  0 0 1 30 }", 0, Sphere, &[(Y, [12.0, 21.0, 30.0])]);
    // Inner statements first, then those of the groups around them.
    let nested = "group { scale 2; group { translate 1 0 0; sphere { rotate z 90 } } }";
    assert_item(nested, 0, Sphere, &[(X, [2.0, 2.0, 0.0])]);
    // Size and place come before the statements.
    assert_item("sphere radius=2 { center 1 0 0; rotate z 90 }", 0, Sphere, &[(O, Y), (X, [0.0, 3.0, 0.0])]);
}

#[test]
fn repeats_count_and_choose_picks() {
    let text = "parameter step 2\nrepeat 3 { sphere { translate \"i * step\" 0 0 } }
        repeat 2 index=\"row\" { repeat 2 { box { translate row i 0 } } }
        choose 1.9 { sphere; disc; box }";
    let items = &scene(text).groups[0].items;
    let places: Vec<DVec3> = items.iter().map(|i| i.transform.translation).collect();
    let flat = |x: f64, y: f64| dvec3(x, y, 0.0);
    let wanted =
        [(0, 0), (2, 0), (4, 0), (0, 0), (0, 1), (1, 0), (1, 1), (0, 0)].map(|(x, y)| flat(x.into(), y.into()));
    assert_eq!(places, wanted);
    assert!(matches!(items[7].kind, ItemKind::Shape(Shape::Disc)));
}

#[test]
fn groups_bake_and_instances_share() {
    let text = "material \"red\" { diffuse 1 0 0 }
        material \"blue\" { diffuse 0 0 1 }
        instance \"pair\" { translate 0 0 5 }
        group material=\"red\" { sphere; group { box material=\"blue\"; disc } }
        define \"pair\" material=\"blue\" { scale 2; sphere; instance \"leaf\" }
        define \"leaf\" { cone }";
    let description = scene(text);
    let names: Vec<&str> = description.groups.iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["", "pair", "leaf"]);
    let root = &description.groups[0].items;
    assert!(matches!(root[0].kind, ItemKind::Instance(1)));
    assert_eq!(root[0].transform.translation, dvec3(0.0, 0.0, 5.0));
    let materials: Vec<_> = root.iter().map(|i| i.material).collect();
    assert_eq!(materials, [None, Some(1), Some(2), Some(1)]);
    let pair = &description.groups[1].items;
    assert_eq!((pair[0].material, pair[0].transform.matrix3.x_axis.x), (Some(2), 2.0));
    assert!(matches!(pair[1].kind, ItemKind::Instance(2)) && pair[1].material.is_none());
}

#[test]
fn settings_are_taken_up() {
    let text = "scene \"show\"; units mm; precision f64; background 0.5; ambient 0.1 0.2 0.3
        camera \"a\" { eye 0 1 5; look-at 0 1 0; up 0 1 1; fov 90 }
        camera \"b\" parallel=4 eye=\"0, 0, 9\"
        light point { position 1 2 3; intensity 4 }
        light \"directional\" { direction 0 -1 0; irradiance 1 2 3 }
        material \"m\" { diffuse 0.5; mirror 0.1 0.2 0.3; emission 17 }
        material \"default\" { diffuse 0.25 }
        polygon { point 0 0 0; point 1 0 0; point 1 1 0; point 0 1 0; translate 0 0 1 }";
    let d = scene(text);
    assert_eq!((d.name.as_str(), d.precision, d.background), ("show", Some(Precision::F64), DVec3::splat(0.5)));
    assert_eq!(d.ambient, dvec3(0.1, 0.2, 0.3));
    assert_eq!(d.cameras[0].projection, Projection::Perspective { theta: std::f64::consts::FRAC_PI_2 });
    assert_eq!((d.cameras[0].eye, d.cameras[0].up), (dvec3(0.0, 1.0, 5.0), dvec3(0.0, 1.0, 1.0)));
    assert_eq!(d.cameras[1].projection, Projection::Parallel { height: 4.0 });
    assert_eq!(d.lights[0], Light::Point { position: dvec3(1.0, 2.0, 3.0), intensity: DVec3::splat(4.0) });
    let irradiance = dvec3(1.0, 2.0, 3.0);
    assert_eq!(d.lights[1], Light::Directional { direction: dvec3(0.0, -1.0, 0.0), irradiance });
    assert_eq!((d.materials[1].mirror, d.materials[1].emission), (dvec3(0.1, 0.2, 0.3), DVec3::splat(17.0)));
    assert_eq!(d.materials[0].diffuse, DVec3::splat(0.25));
    assert_eq!(d.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn set_changes_parameters_and_the_hash() {
    let text = "parameter a 1; parameter b \"a * 10\"; sphere radius=\"b\"";
    let radius = |set: &[(&str, &str)]| scene_with(text, set).unwrap().groups[0].items[0].transform.matrix3.x_axis.x;
    assert_eq!(radius(&[]), 10.0);
    assert_eq!(radius(&[("a", "2")]), 20.0);
    assert_eq!(radius(&[("a", "2"), ("b", "a + 0.5")]), 2.5);
    assert_eq!(radius(&[("a", "2"), ("a", "3")]), 30.0);
    let hash = |set| scene_with(text, set).unwrap().hash;
    assert_eq!(hash(&[]).len(), 64);
    assert_ne!(hash(&[]), hash(&[("a", "1")]));
    // The same scene, set in other words, has the same hash.
    assert_eq!(hash(&[("a", "1"), ("b", "2")]), hash(&[("b", "2"), ("a", "1")]));
    assert_eq!(hash(&[("a", "3"), ("b", "2"), ("a", "1")]), hash(&[("a", "1"), ("b", "2")]));
    assert_ne!(hash(&[("a", "1"), ("b", "2")]), hash(&[("a", "2"), ("b", "1")]));
    for (set, phrase) in [
        (("radios", "2"), "has no parameter `radios`; it has `a, b`"),
        (("a", "1 +"), "--set a=1 +: expected a number"),
        (("a", "1/0"), "not finite"),
    ] {
        let error = scene_with(text, &[set]).unwrap_err();
        assert!(matches!(&error, Error::Usage(what) if what.contains(phrase)), "{error}");
    }
}

#[test]
fn parameters_say_what_sliders_offer() {
    let text = "parameter a 3 from=1 to=\"2 * 4\" step=0.5\nparameter b -2\nparameter c { key 0 1; key 9 2 }";
    let parameters = scene_with(text, &[("a", "9")]).unwrap().parameters;
    let told: Vec<_> = parameters.iter().map(|p| (p.name.as_str(), p.value, p.range, p.step)).collect();
    assert_eq!(told, [("a", 9.0, (1.0, 8.0), 0.5), ("b", -2.0, (-4.0, 0.0), 0.0), ("c", 1.0, (0.0, 2.0), 0.0)]);
    for (text, want) in [
        ("parameter a 3 from=5 to=4", "t.kdl:1:1: a slider from 5 to 4: expected `from` below `to`"),
        ("parameter a 3 step=0", "t.kdl:1:15: "),
        ("parameter a 3 form=5", "t.kdl:1:15: `parameter` has no property `form`"),
    ] {
        let error = scene_with(text, &[]).unwrap_err().to_string();
        assert!(error.starts_with(want), "{error}");
    }
}

#[test]
fn mesh_files_are_read_once_and_bring_their_materials() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.ply"), "").unwrap();
    let read = |path: &Path| read_fake(path);
    let files = MeshFiles { folder: Some(folder.path()), allow_outside: false, found: None, read: &read };
    let text = b"units m; mesh \"a.ply\"; mesh \"./a.ply\" units=mm { translate 1 0 0 }";
    let d = parse(Path::new("t.kdl"), "t", text, &[], &files).unwrap();
    assert_eq!((d.meshes.len(), d.groups[0].items.len()), (1, 2));
    let corner = d.groups[0].items[1].transform.transform_point3(DVec3::X);
    assert!(corner.distance(dvec3(1.001, 0.0, 0.0)) < 1e-15);
    assert_eq!(d.materials.last().unwrap().name, "steel");
    let other = parse(Path::new("t.kdl"), "t", b"mesh \"a.ply\"", &[], &files).unwrap();
    assert_ne!(d.hash, other.hash);
}
