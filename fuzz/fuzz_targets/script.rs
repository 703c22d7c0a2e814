//! Any bytes as a script for a view; what is accepted has at most a command per line.
#![no_main]

use std::path::Path;

use lanecast::view::script::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(lines) = parse(Path::new("fuzz.txt"), bytes) {
        assert!(lines.len() <= 1 + bytes.iter().filter(|&&byte| byte == b'\n').count());
        assert!(lines.windows(2).all(|pair| pair[0].line < pair[1].line));
    }
});
