//! Rays, hits, packets: what travels between the floors.

pub mod batch;
pub mod counters;
pub mod packet;
pub mod pencil;
pub mod slab;

pub use batch::{Hits, INVALID_ID, PAD, Rays};
pub use counters::Counters;
pub use packet::{Candidate, HitPacket, Packet};
pub use pencil::Pencil;
