//! The tile engine. One program for all of these tests: most of the time they take is to build them.

#[path = "../common/mod.rs"]
mod common;
#[path = "../tile_support/mod.rs"]
mod tile_support;

mod engine;
mod gaps;
mod instances;
mod joined;
mod late;
mod order;
mod parallel;
mod pencil;
