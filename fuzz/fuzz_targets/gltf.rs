//! Any bytes give a scene whose meshes have indices in range and that can be assembled, or an error.
#![no_main]

use std::path::Path;

use lanecast::scene::assembly::Assembly;
use lanecast::scene::gltf;
use lanecast::scene::reference::References;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let references = References { folder: None, allow_outside: false, found: None };
    if let Ok(scene) = gltf::parse(Path::new("fuzz.gltf"), "fuzz", bytes, &references) {
        for mesh in &scene.meshes {
            assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
        }
        assert!(Assembly::new(&scene).is_ok());
    }
});
