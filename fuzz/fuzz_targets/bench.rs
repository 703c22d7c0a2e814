//! Any bytes as rows of `bench.csv`; what is accepted has at most a figure per line.
#![no_main]

use std::path::Path;

use lanecast::measure::compare::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(turn) = parse(Path::new("fuzz.csv"), bytes) {
        assert!(turn.figures.len() <= bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count());
        assert!(turn.figures.values().all(|figure| figure.mrays >= 0.0 && figure.mrays.is_finite()));
    }
});
