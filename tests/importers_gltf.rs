//! glTF documents against positions worked out by hand, against the same geometry as OBJ, and shared scenes against
//! the list of what they hold.

mod gltf_support;

use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt::Write;

use glam::DVec3;
use gltf_support::{ONE_MESH, TRIANGLE, assert_near, document, floats, glb, scene, shared, world};
use lanecast::ray::{Hits, Rays};
use lanecast::scene::assembly::Assembly;
use lanecast::scene::description::{Description, ItemKind, Projection};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch};

fn one_mesh(nodes: &str) -> Description {
    scene(&format!("{nodes}, {ONE_MESH}"), &floats(&TRIANGLE))
}

#[test]
fn transforms_nest_and_matrices_are_columns() {
    let s = FRAC_1_SQRT_2;
    let nodes = format!(
        r#""nodes": [
            {{"translation": [10, 0, 0], "children": [1, 2], "mesh": 0}},
            {{"rotation": [0, 0, {s}, {s}], "scale": [2, 3, 1], "mesh": 0}},
            {{"matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 5,6,7,1], "mesh": 0}}]"#
    );
    let scene = one_mesh(&nodes);
    // Scaled, then turned by 90 degrees about z, then moved.
    let turned = [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [7.0, 0.0, 0.0]];
    let by_matrix = [[15.0, 6.0, 7.0], [15.0, 7.0, 7.0], [14.0, 6.0, 7.0]];
    let moved = [[10.0, 0.0, 0.0], [11.0, 0.0, 0.0], [10.0, 1.0, 0.0]];
    assert_near(&world(&scene), &[moved, turned, by_matrix]);
    assert_eq!(scene.meshes.len(), 1, "one mesh, placed three times");
}

#[test]
fn instances_place_one_mesh_many_times() {
    let mut bin = floats(&TRIANGLE);
    bin.extend(floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    // No turn, and half a turn about z.
    bin.extend([0_i16, 0, 0, 32767, 0, 0, 32767, 0].iter().flat_map(|x| x.to_le_bytes()));
    bin.extend(floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]));
    let length = bin.len();
    let rest = format!(
        r#""extensionsRequired": ["EXT_mesh_gpu_instancing"],
        "nodes": [{{"mesh": 0, "translation": [0, 0, 100], "children": [1], "extensions": {{"EXT_mesh_gpu_instancing":
            {{"attributes": {{"TRANSLATION": 1, "ROTATION": 2, "SCALE": 3, "_ID": 9}}}}}}}}, {{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
            {{"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 2, "type": "VEC3"}},
            {{"bufferView": 0, "byteOffset": 60, "componentType": 5122, "normalized": true, "count": 2,
              "type": "VEC4"}},
            {{"bufferView": 0, "byteOffset": 76, "componentType": 5126, "count": 2, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {length}}}], "buffers": [{{"byteLength": {length}}}]"#
    );
    let scene = scene(&rest, &bin);
    let first = [[1.0, 2.0, 103.0], [2.0, 2.0, 103.0], [1.0, 3.0, 103.0]];
    let second = [[4.0, 5.0, 106.0], [2.0, 5.0, 106.0], [4.0, 3.0, 106.0]];
    let child = [[0.0, 0.0, 100.0], [1.0, 0.0, 100.0], [0.0, 1.0, 100.0]];
    assert_near(&world(&scene), &[first, second, child]);
    assert_eq!((scene.meshes.len(), scene.warnings.len()), (1, 0), "{:?}", scene.warnings);
}

/// Nine bytes of quantized corners with a stride of four, then sparse values, then indices of three sizes.
fn packed_bin() -> Vec<u8> {
    let mut bin = vec![0, 0, 0, 99, 127, 0, 0, 99, 0, 129, 0, 99];
    bin.extend(floats(&[7.0, 8.0, 9.0]));
    bin.extend([2_u8, 1, 0, 0]);
    bin.extend([2_u16, 1, 0, 0].iter().flat_map(|x| x.to_le_bytes()));
    bin.extend([2_u32, 1, 0].iter().flat_map(|x| x.to_le_bytes()));
    bin
}

fn packed(positions: &str, primitive: &str) -> Description {
    let bin = packed_bin();
    let rest = format!(
        r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}{primitive}}}]}}],
        "accessors": [{{"count": 3, "type": "VEC3", {positions}}},
            {{"bufferView": 1, "byteOffset": 12, "componentType": 5121, "count": 3, "type": "SCALAR"}},
            {{"bufferView": 1, "byteOffset": 16, "componentType": 5123, "count": 3, "type": "SCALAR"}},
            {{"bufferView": 1, "byteOffset": 24, "componentType": 5125, "count": 3, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 12, "byteStride": 4}},
            {{"buffer": 0, "byteOffset": 12, "byteLength": {}}}], "buffers": [{{"byteLength": {}}}]"#,
        bin.len() - 12,
        bin.len()
    );
    scene(&rest, &bin)
}

#[test]
fn accessors_of_every_kind() {
    let bytes = r#""bufferView": 0, "componentType": 5120"#;
    let raw = [[0.0, 0.0, 0.0], [127.0, 0.0, 0.0], [0.0, -127.0, 0.0]];
    assert_near(&world(&packed(bytes, "")), &[raw]);
    let unsigned = r#""bufferView": 0, "componentType": 5121"#;
    assert_near(&world(&packed(unsigned, "")), &[[raw[0], raw[1], [0.0, 129.0, 0.0]]]);
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let normalized = format!(r#"{bytes}, "normalized": true"#);
    assert_near(&world(&packed(&normalized, "")), &[unit]);
    for indices in 1..=3 {
        let reversed = packed(&normalized, &format!(r#", "indices": {indices}"#));
        assert_near(&world(&reversed), &[[unit[2], unit[1], unit[0]]]);
    }
    // Without a buffer view all are zero, except the sparse ones: number 2 here.
    let sparse = r#""componentType": 5126, "sparse": {"count": 1,
        "indices": {"bufferView": 1, "byteOffset": 12, "componentType": 5121}, "values": {"bufferView": 1}}"#;
    assert_near(&world(&packed(sparse, "")), &[[[0.0; 3], [0.0; 3], [7.0, 8.0, 9.0]]]);
    assert_near(&world(&packed(r#""componentType": 5126"#, "")), &[[[0.0; 3]; 3]]);
}

#[test]
fn strips_fans_and_what_has_no_triangles() {
    let corners: Vec<f32> = (0..5_u8).flat_map(|i| [f32::from(i), 0.0, 0.0]).collect();
    let with_modes = |modes: &[u32]| {
        let primitives: Vec<_> =
            modes.iter().map(|mode| format!(r#"{{"attributes": {{"POSITION": 0}}, "mode": {mode}}}"#)).collect();
        let rest = format!(
            r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 60}}], "buffers": [{{"byteLength": 60}}]"#,
            primitives.join(",")
        );
        scene(&rest, &floats(&corners))
    };
    let ids = |scene: &Description| -> Vec<[u32; 3]> {
        world(scene).iter().map(|triangle| triangle.map(|p| p.x as u32)).collect()
    };
    // The lists of glTF 2.0, section 3.7.2.1.
    assert_eq!(ids(&with_modes(&[5])), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(ids(&with_modes(&[6])), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    let cut = with_modes(&[4]);
    assert_eq!(ids(&cut), [[0, 1, 2]]);
    assert!(cut.warnings[0].contains("incomplete"), "{:?}", cut.warnings);
    let mixed = with_modes(&[0, 4, 1, 5, 4]);
    assert_eq!(ids(&mixed), [[0, 1, 2], [0, 1, 2], [1, 3, 2], [2, 3, 4], [0, 1, 2]]);
    assert!(mixed.warnings[0].starts_with("2 primitives without triangles"), "{:?}", mixed.warnings);
    assert_eq!(mixed.meshes.len(), 2, "the two equal primitives are one mesh");
}

#[test]
fn what_is_not_read_of_meshes_is_a_warning() {
    let with = |attributes: &str, of_mesh: &str, of_node: &str| {
        let rest = format!(
            r#""nodes": [{{"mesh": 0{of_node}}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}},
            {{"attributes": {{"POSITION": 0{attributes}}}}}]{of_mesh}}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 36}}], "buffers": [{{"byteLength": 36}}]"#
        );
        scene(&rest, &floats(&TRIANGLE))
    };
    assert_eq!(with("", "", "").warnings, Vec::<String>::new());
    let coloured = with(r#", "COLOR_0": 0"#, "", "");
    assert_eq!(coloured.warnings, ["1 primitives have colours at their vertices (COLOR_0), which are not read"]);
    assert_eq!(coloured.meshes.len(), 1, "the same mesh");
    for (of_mesh, of_node, warns) in [("[0, 0]", "[]", false), ("[0, 0.5]", "[0]", true), ("[0]", "[-1]", true)] {
        let [of_mesh, of_node] = [of_mesh, of_node].map(|list| format!(r#", "weights": {list}"#));
        let wanted = ["morph targets are not applied, though they have weights other than 0"];
        assert_eq!(with("", &of_mesh, &of_node).warnings, wanted[..usize::from(warns)], "{of_mesh}{of_node}");
    }
}

#[test]
fn the_default_scene_is_the_one_shown() {
    let nodes = r#""nodes": [{"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0], "children": [2]}, {"mesh": 0}]"#;
    let xs = |scenes: &str| -> Vec<f64> {
        world(&one_mesh(&format!("{nodes}{scenes}"))).iter().map(|triangle| triangle[0].x).collect()
    };
    assert_eq!(xs(r#", "scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [1]}]"#), [1.0, 1.0]);
    assert_eq!(xs(r#", "scenes": [{"nodes": [0]}, {"nodes": [1]}]"#), [0.0]);
    assert_eq!(xs(""), [0.0, 1.0, 1.0]);
    assert_eq!(xs(r#", "scenes": [{}]"#), [0.0; 0]);
}

#[test]
fn cameras_stand_where_their_nodes_are() {
    let s = FRAC_1_SQRT_2;
    let scene = one_mesh(&format!(
        r#""cameras": [{{"type": "perspective", "perspective": {{"yfov": 0.8, "znear": 1}}, "name": "far"}},
            {{"type": "orthographic", "orthographic": {{"xmag": 3, "ymag": 2, "znear": 0, "zfar": 1}}}}],
        "nodes": [{{"translation": [1, 2, 3], "scale": [5, 5, 5], "children": [1, 2]}},
            {{"camera": 0, "rotation": [0, {s}, 0, {s}]}}, {{"camera": 1, "name": "plan"}}, {{"camera": 0}}]"#
    ));
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["far", "plan", "far (node 3)"]);
    // A quarter turn about y takes -z to -x.
    let [turned, plan, _] = &scene.cameras[..] else { panic!("three cameras") };
    let eye = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!((turned.eye, plan.eye), (eye, eye));
    assert!(turned.look_at.distance(eye - DVec3::X) < 1e-9 && turned.up.distance(DVec3::Y) < 1e-9, "{turned:?}");
    assert!(plan.look_at.distance(eye - DVec3::Z) < 1e-9, "{plan:?}");
    assert_eq!(turned.projection, Projection::Perspective { theta: 0.8 });
    assert_eq!(plan.projection, Projection::Parallel { height: 4.0 });
}

#[test]
fn hidden_nodes_are_left_out() {
    let scene = one_mesh(r#""nodes": [{"mesh": 0}, {"scale": [0, 0, 0], "children": [2]}, {"mesh": 0}]"#);
    assert_eq!(world(&scene).len(), 1);
    assert!(scene.warnings[0].starts_with("1 nodes or instances are left out"), "{:?}", scene.warnings);
}

#[test]
fn deep_trees_need_no_stack() {
    const DEPTH: usize = 1_000_000;
    let mut nodes = String::from(r#""nodes": ["#);
    for i in 1..=DEPTH {
        write!(nodes, r#"{{"children":[{i}],"translation":[1,0,0]}},"#).unwrap();
    }
    let scene = one_mesh(&(nodes + r#"{"mesh": 0}]"#));
    let x = DEPTH as f64;
    assert_near(&world(&scene), &[[[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]]);
}

#[test]
fn buffers_from_chunks_texts_and_files_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let bin = floats(&TRIANGLE);
    let nodes = r#""nodes": [{"mesh": 0}], "#.to_owned() + ONE_MESH;
    let with_uri =
        |uri: &str| document(&nodes.replace(r#""buffers": [{"#, &format!(r#""buffers": [{{"uri": "{uri}","#)));
    std::fs::create_dir(folder.path().join("a b")).unwrap();
    std::fs::write(folder.path().join("a b/é.bin"), &bin).unwrap();
    let inline = with_uri("data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA");
    let packed = |bytes: &[u8]| zstd::bulk::compress(bytes, 3).unwrap();
    for (name, bytes) in [
        ("chunk.glb", glb(&document(&nodes), &bin)),
        ("packed.glb.zst", packed(&glb(&document(&nodes), &bin))),
        ("inline.gltf", inline.clone().into_bytes()),
        ("file.gltf", with_uri("a%20b/%C3%A9.bin").into_bytes()),
        ("packed.gltf.zst", packed(with_uri("./a%20b/é.bin").as_bytes())),
    ] {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let scene = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_near(&world(&scene), &[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
        assert_eq!((scene.hash.len(), scene.source.as_deref()), (64, Some(file.as_path())));
    }
    // Another content of the file is another scene.
    let file = folder.path().join("file.gltf");
    let hash = || load(&file.to_string_lossy(), &LoadOptions::default()).unwrap().hash;
    let before = hash();
    std::fs::write(folder.path().join("a b/é.bin"), floats(&[2.0; 9])).unwrap();
    assert_ne!(before, hash());
}

/// A wavy square of `side` x `side` quads with positions that f32 holds.
fn wavy(side: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let row = side + 1;
    let position = |i: u32| {
        let (x, y) = ((i % row) as f32 / side as f32, (i / row) as f32 / side as f32);
        [x, y, (8.0 * x).sin() * (6.0 * y).cos() / 4.0]
    };
    let corners = (0..side * side).map(|q| q / side * row + q % side);
    let triangles = corners.flat_map(|a| [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]).collect();
    ((0..row * row).map(position).collect(), triangles)
}

fn hits(scene: &Description) -> Hits<f32> {
    let world = World::<f32>::compile(scene, Preset::Fast).unwrap();
    let mut rays = Rays::<f32>::new(4096);
    for i in 0..4096 {
        let target = [(i % 64) as f32 / 64.0 + 0.004, (i / 64) as f32 / 64.0 + 0.003, 0.0];
        let eye = [0.4, 0.6, 3.0];
        rays.set(i, eye, [0, 1, 2].map(|axis| target[axis] - eye[axis]), 0.0, f32::INFINITY);
    }
    let mut hits = Hits::default();
    f32::engines()[0].intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
    hits
}

#[test]
fn the_same_geometry_as_obj_gives_the_same_hits() {
    let (positions, triangles) = wavy(30);
    let mut text = String::new();
    for [x, y, z] in positions.iter().map(|p| p.map(f64::from)) {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    triangles.iter().for_each(|[a, b, c]| writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wavy.obj");
    std::fs::write(&file, text).unwrap();
    let obj = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap();

    let mut bin = floats(positions.as_flattened());
    let vertex_bytes = bin.len();
    bin.extend(triangles.as_flattened().iter().flat_map(|&i| (i as u16).to_le_bytes()));
    let rest = format!(
        r#""nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5123, "count": {}, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {vertex_bytes}}},
            {{"buffer": 0, "byteOffset": {vertex_bytes}, "byteLength": {}}}], "buffers": [{{"byteLength": {}}}]"#,
        positions.len(),
        3 * triangles.len(),
        bin.len() - vertex_bytes,
        bin.len()
    );
    let gltf = scene(&rest, &bin);
    assert!(obj.meshes[0].positions == gltf.meshes[0].positions);
    assert!(obj.meshes[0].triangles == gltf.meshes[0].triangles);
    let (of_obj, of_gltf) = (hits(&obj), hits(&gltf));
    assert!(of_obj.hit_count() > 3000, "{} hits", of_obj.hit_count());
    assert!(of_obj.t == of_gltf.t && of_obj.prim == of_gltf.prim && of_obj.inst == of_gltf.inst);
}

#[test]
fn shared_scenes_hold_what_their_list_says() {
    // Triangles stored and placed, placements, nodes without extent, from the list of sources. Each tree of
    // embree_trees ends in a twig of 1874 triangles whose matrix is zero.
    for (path, stored, placed, placements, nothing) in [
        ("embree_trees/embree_trees.glb.zst", 73_582, 139_281_176, 73_786, 15),
        ("san_miguel/san_miguel.glb.zst", 1_610_763, 9_407_550, 49_489, 0),
        ("gltf_balloon/scene.gltf", 35_698, 35_698, 37, 0),
    ] {
        let Some(file) = shared(path) else { continue };
        let scene = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap();
        let assembly = Assembly::new(&scene).unwrap();
        assert_eq!(scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>(), stored, "{path}");
        assert_eq!(assembly.instanced_prims(), placed - 1874 * nothing, "{path}");
        assert_eq!(assembly.placements.len() as u64, placements - nothing, "{path}");
        assert!(
            scene
                .groups
                .iter()
                .flat_map(|g| &g.items)
                .all(|i| matches!(i.kind, ItemKind::Mesh(_) | ItemKind::Instance(_)))
        );
    }
}

#[test]
fn a_mesh_statement_says_that_gltf_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.kdl"), "mesh \"b.glb\"").unwrap();
    std::fs::write(folder.path().join("b.glb"), "").unwrap();
    let file = folder.path().join("a.kdl");
    let error = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("b.glb: ") && error.contains("glTF holds a whole scene"), "{error}");
}
