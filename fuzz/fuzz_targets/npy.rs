//! Any bytes as each kind of NumPy file.
#![no_main]

use std::path::Path;

use lanecast::film::npy;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("fuzz.npy");
    let sizes = [
        npy::parse_rays(file, bytes).map(|rays| 32 * rays.len()),
        npy::parse_hits(file, bytes).map(|hits| 20 * hits.len()),
        npy::parse_occlusion(file, bytes).map(|flags| flags.len()),
        npy::parse_plane(file, bytes).map(|(_, _, data)| 4 * data.len()),
    ];
    if let Ok(film) = npy::parse_film(file, bytes) {
        film.validate().expect("a film that was read keeps its invariants");
    }
    // Whatever is accepted was in the file.
    assert!(sizes.into_iter().flatten().all(|size| size <= bytes.len()));
});
