//! Any bytes give a mesh with indices in range, or an error.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("fuzz.obj");
    if let Ok(out) = lanecast::scene::obj::parse(file, bytes) {
        let vertices = out.mesh.positions.len();
        assert!(out.mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
    }
});
