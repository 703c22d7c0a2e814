//! Any bytes as a BRL-CAD view script; what is accepted says where to look from.
#![no_main]

use std::path::Path;

use lanecast::scene::brlcad::view::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(view) = parse(Path::new("fuzz.rt"), bytes) {
        assert!(view.size > 0.0 && view.size.is_finite() && view.eye.is_finite());
        assert!(view.axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-6));
        assert!(view.perspective.is_none_or(|angle| angle > 0.0 && angle < std::f64::consts::PI));
        assert!(view.tops.iter().map(|name| 1 + name.len()).sum::<usize>() <= bytes.len());
    }
});
