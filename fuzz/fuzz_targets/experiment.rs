//! Any bytes as an experiment; what is accepted has a bounded number of cases.
#![no_main]

use std::path::Path;

use lanecast::measure::experiment::{MAX_CASES, parse};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(experiment) = parse(Path::new("fuzz.kdl"), bytes) {
        assert!(!experiment.cases.is_empty() && !experiment.rays.is_empty());
        // Scenes, sizes, threads, presets and precisions of one variation come on top.
        assert!(experiment.cases.len() <= MAX_CASES);
    }
});
