//! Any bytes give an OpenSCAD model whose solids can be lowered, or an error.
#![no_main]

use std::path::Path;

use lanecast::error::Error;
use lanecast::scene::openscad::parse;
use lanecast::scene::reference::References;
use lanecast::scene::solids::flat::FlatTree;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let no_files = References { folder: None, allow_outside: false, found: None };
    let read = |path: &Path| Err(Error::whole(path, "no files here"));
    if let Ok(scene) = parse(Path::new("fuzz.csg"), "fuzz", bytes, &no_files, &read) {
        for tree in &scene.solids {
            assert!(FlatTree::new(tree).is_ok());
        }
    }
});
