//! Renders: the same picture however it is cut up. One program for all of these tests: most of the time they take is to build them.

#[path = "../binary/mod.rs"]
mod binary;
#[path = "../common/mod.rs"]
mod common;

mod determinism;
mod frames;
mod joined;
mod kept;
mod offsets;
mod progressive;
mod shading;
