//! Rays, hits, packets: what travels between the floors.

pub mod batch;
pub mod counters;

pub use batch::{Hits, Rays, INVALID_ID};
pub use counters::Counters;
