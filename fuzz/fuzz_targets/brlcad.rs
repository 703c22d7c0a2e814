//! Any bytes give a database whose regions can be walked, or an error.
#![no_main]

use std::path::Path;

use lanecast::scene::brlcad::regions::walk;
use lanecast::scene::brlcad::{Step, choose_tops, parse};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("fuzz.asc");
    if let Ok(database) = parse(file, bytes)
        && let Ok(tops) = choose_tops(&database, &[])
        && let Ok(found) = walk(file, &database, &tops)
    {
        for region in &found.regions {
            let members = region.expression.steps().iter().filter(|step| matches!(step, Step::Member(_))).count();
            assert_eq!(members, region.solids.len());
        }
    }
});
