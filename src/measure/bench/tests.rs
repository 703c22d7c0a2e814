//! What a bench reports, and when.

use std::cell::Cell;

use super::*;
use crate::camera::framing;
use crate::measure::eye::Eye;
use crate::scene::load::{LoadOptions, load};

/// What is measured must be in hand, and may be on disk, before anything else is measured: `stop` is asked before every pass.
#[test]
fn rows_of_a_class_come_before_the_next_is_measured() {
    let description = load("builtin:cornell", &LoadOptions::default()).unwrap();
    let plan = Plan {
        kinds: vec![RayKind::Primary, RayKind::Ao],
        engines: vec!["scalar".into()],
        size: (8, 8),
        repeat: 1,
        seed: 1,
        build: crate::bvh::Preset::Fast.into(),
        peers: Invitation::default(),
    };
    let camera = |bounds, size| Eye::new(&framing(bounds, 1.0), size);
    let (workers, asked) = (Workers::new(1).unwrap(), Cell::new(0));
    let stop = || asked.replace(asked.get() + 1) < 0;
    let mut seen = Vec::new();
    let mut report = |kind: RayKind, rows: Vec<Row>| {
        seen.push((kind, rows.len(), asked.replace(0)));
        if seen.len() == 2 { Err(Error::Interrupted) } else { Ok(()) }
    };
    let ended = classes::<f32>(&workers, &description, &camera, &plan, &stop, &mut report);
    assert!(matches!(ended, Err(Error::Interrupted)), "the reporter's errors end it");
    // Before the check, the warm-up and the timed round.
    assert_eq!(seen, [(RayKind::Primary, 1, 3), (RayKind::Ao, 1, 3)]);
}
