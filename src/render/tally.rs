//! What tiles of a picture add up to.

use std::mem::take;

use crate::lanes::Real;
use crate::ray::Counters;
use crate::shade::{PathStats, RayCounts, Workspace};

/// Counts of some tiles or batches.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Tally {
    /// Finished ones.
    pub done: u64,
    /// Live rays traced, by kind.
    pub rays: RayCounts,
    /// What the engine counted.
    pub counters: Counters,
    /// Where the time went.
    pub paths: PathStats,
}

impl Tally {
    /// Takes what was counted in `work` since the last time.
    pub fn take<S: Real>(work: &mut Workspace<S>, done: u64) -> Self {
        Self { done, rays: take(&mut work.rays), counters: take(&mut work.counters), paths: take(&mut work.stats) }
    }

    /// Both together.
    pub fn plus(mut self, other: Self) -> Self {
        self.done += other.done;
        self.rays += other.rays;
        self.counters += other.counters;
        self.paths.merge(&other.paths);
        self
    }
}
