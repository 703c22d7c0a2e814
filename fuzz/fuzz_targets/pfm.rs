//! Any bytes as a PFM picture; what is accepted must be a sound film.
#![no_main]

use std::path::Path;

use lanecast::film::pfm;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(film) = pfm::parse(Path::new("fuzz.pfm"), bytes) {
        film.validate().expect("a film that was read keeps its invariants");
    }
});
