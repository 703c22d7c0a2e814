//! Solids made of solids. One program for all of these tests: most of the time they take is to build them.

#[path = "../common/mod.rs"]
mod common;
#[path = "../solid_support/mod.rs"]
mod solid_support;

mod hostile;
mod laws;
mod oracle;
