//! Paths of light. One program for all of these tests: most of the time they take is to build them.

#[path = "../path_support/mod.rs"]
mod path_support;

mod closed_forms;
mod furnace;
mod lamps;
mod looks;
mod mitsuba;
mod pictures;
