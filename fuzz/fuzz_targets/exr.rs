//! Any bytes as an EXR picture; what is accepted must be a sound film.
#![no_main]

use std::path::Path;

use lanecast::film::exr;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(film) = exr::parse(Path::new("fuzz.exr"), bytes) {
        film.validate().expect("a film that was read keeps its invariants");
    }
});
