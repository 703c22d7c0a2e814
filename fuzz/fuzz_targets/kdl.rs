//! Any bytes as a scene file: no panic, no hang, no unbounded memory.
#![no_main]

use std::path::Path;

use lanecast::error::Error;
use lanecast::scene::kdl::{meshes::MeshFiles, parse};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let read = |path: &Path| Err(Error::whole(path, "no files here"));
    let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read };
    let _ = parse(Path::new("fuzz.kdl"), "fuzz", data, &[], &files);
});
