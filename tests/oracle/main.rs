//! The f64 oracle and what it judges. One program for all of these tests: most of the time they take is to build them.

#[path = "../oracle_support/mod.rs"]
mod oracle_support;

mod closest;
mod judge;
mod margin;
