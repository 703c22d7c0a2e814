//! Any bytes give a library whose materials have numbers in range, or an error.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(library) = lanecast::scene::mtl::parse(Path::new("fuzz.mtl"), bytes) {
        for material in library.entries.iter().map(|entry| entry.material()) {
            assert!(material.diffuse.min_element() >= 0.0 && material.diffuse.max_element() <= 1.0);
            assert!((0.0..=1.0).contains(&material.opacity) && material.emission.is_finite());
        }
    }
});
