//! Any bytes as a PNG picture; what is accepted must be a sound film.
#![no_main]

use std::path::Path;

use lanecast::film::png;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(film) = png::parse(Path::new("fuzz.png"), bytes) {
        film.validate().expect("a film that was read keeps its invariants");
    }
});
