//! Small glTF documents made in tests, and what they place in the world.
#![allow(dead_code, reason = "each test file uses its own part of this module")]

use std::path::{Path, PathBuf};

use glam::DVec3;
use lanecast::error::Result;
use lanecast::scene::assembly::{Assembly, PartKind};
use lanecast::scene::description::Description;
use lanecast::scene::gltf;
use lanecast::scene::reference::References;

/// Corners of one triangle as floats: 36 bytes.
pub const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
/// A mesh of that triangle at the start of buffer 0, to be put in a document beside its nodes.
pub const ONE_MESH: &str = r#""meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36}]"#;

pub fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A document of version 2 with the members `rest`.
pub fn document(rest: &str) -> String {
    format!(r#"{{"asset": {{"version": "2.0"}}, {rest}}}"#)
}

/// A binary file of a document and its binary chunk.
pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, content, pad) in [(b"JSON", json.as_bytes(), b' '), (b"BIN\0", bin, 0)] {
        let padded = content.len().next_multiple_of(4);
        file.extend((padded as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
        file.resize(file.len() + padded - content.len(), pad);
    }
    let length = file.len() as u32;
    file[8..12].copy_from_slice(&length.to_le_bytes());
    file
}

pub fn parse(bytes: &[u8]) -> Result<Description> {
    gltf::parse(Path::new("t.gltf"), "t", bytes, &References { folder: None, allow_outside: false, found: None })
}

/// The scene of a binary file.
pub fn scene(rest: &str, bin: &[u8]) -> Description {
    parse(&glb(&document(rest), bin)).unwrap_or_else(|e| panic!("{e}\n{rest}"))
}

/// The message of the error that a document with a binary chunk of `bin` gives.
pub fn refusal(rest: &str, bin: &[u8]) -> String {
    match parse(&glb(&document(rest), bin)) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("not refused: {rest}"),
    }
}

/// World-space corners of every triangle, in the order of instances and primitives.
pub fn world(scene: &Description) -> Vec<[DVec3; 3]> {
    let assembly = Assembly::new(scene).unwrap();
    let mut triangles = Vec::new();
    for placement in &assembly.placements {
        for part in &assembly.objects[placement.object as usize].parts {
            let PartKind::Mesh(mesh) = &part.kind else { panic!("not a mesh") };
            let map = placement.to_world * part.to_object;
            triangles.extend((0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|p| map.transform_point3(p))));
        }
    }
    triangles
}

/// Checks corners against numbers worked out by hand, to 1e-6: quaternions in files are rounded.
pub fn assert_near(found: &[[DVec3; 3]], expected: &[[[f64; 3]; 3]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (triangle, wanted) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!(triangle.distance(DVec3::from_array(*wanted)) < 1e-6, "{found:?} is not {expected:?}");
    }
}

/// A shared scene, or a line that says it is not there.
pub fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes").join(path);
    if !path.exists() {
        println!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}
