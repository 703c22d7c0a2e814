//! Any bytes give a mesh with indices in range, or an error.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("fuzz.stl");
    if let Ok(mesh) = lanecast::scene::stl::parse(file, bytes) {
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
    }
});
