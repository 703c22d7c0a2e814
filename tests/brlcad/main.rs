//! Databases of BRL-CAD. One program for all of these tests: most of the time they take is to build them.

#[path = "../brlcad_support/mod.rs"]
mod brlcad_support;
#[path = "../common/mod.rs"]
mod common;

mod binary;
mod bots;
mod hits;
mod images;
mod read;
