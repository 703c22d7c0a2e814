//! Any bytes after a binary database's header give a database whose regions can be walked, or an error.
#![no_main]

use std::path::Path;

use lanecast::scene::brlcad::regions::walk;
use lanecast::scene::brlcad::{ObjectKind, Step, choose_tops, parse};
use libfuzzer_sys::fuzz_target;

const HEADER: [u8; 8] = [0x76, 1, 0, 0, 0, 0, 1, 0x35];

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("fuzz.g");
    // Seeds are whole files.
    let bytes = [&HEADER, bytes.strip_prefix(&HEADER).unwrap_or(bytes)].concat();
    let Ok(database) = parse(file, &bytes) else { return };
    for object in &database.objects {
        if let ObjectKind::Combination(combination) = &object.kind {
            let members = combination.members.len();
            let numbers = combination.expression.steps().iter().filter_map(|step| match step {
                Step::Member(i) => Some(*i as usize),
                _ => None,
            });
            assert!(numbers.eq(0..members));
        }
    }
    if let Ok(tops) = choose_tops(&database, &[])
        && let Ok(found) = walk(file, &database, &tops)
    {
        for region in &found.regions {
            let members = region.expression.steps().iter().filter(|step| matches!(step, Step::Member(_))).count();
            assert_eq!(members, region.solids.len());
        }
    }
});
