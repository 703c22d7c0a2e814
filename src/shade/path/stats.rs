//! Where the time of paths goes.

use std::time::Duration;

/// What one bounce took.
#[derive(Clone, Copy, Debug, Default)]
pub struct BounceStats {
    /// Rays traced for closest hits.
    pub rays: u64,
    /// Shadow rays.
    pub shadows: u64,
    /// Points that scattered.
    pub points: u64,
    /// Lanes of the packets that they were scattered in.
    pub lanes: u64,
    /// Time in closest hits.
    pub tracing: Duration,
    /// Time in shadow rays.
    pub shadowing: Duration,
    /// Time in shading: surfaces, lights, scattering.
    pub shading: Duration,
}

/// What all bounces took, over all threads.
#[derive(Clone, Debug, Default)]
pub struct PathStats {
    /// By number of the bounce, 0 for primary rays.
    pub bounces: Vec<BounceStats>,
}

impl PathStats {
    /// Adds what one wave's bounce took.
    pub fn add(&mut self, bounce: u32, stats: &BounceStats) {
        let at = bounce as usize;
        if self.bounces.len() <= at {
            self.bounces.resize(at + 1, BounceStats::default());
        }
        let sum = &mut self.bounces[at];
        sum.rays += stats.rays;
        sum.shadows += stats.shadows;
        sum.points += stats.points;
        sum.lanes += stats.lanes;
        sum.tracing += stats.tracing;
        sum.shadowing += stats.shadowing;
        sum.shading += stats.shading;
    }

    /// Adds another thread's.
    pub fn merge(&mut self, other: &Self) {
        for (bounce, stats) in other.bounces.iter().enumerate() {
            self.add(bounce as u32, stats);
        }
    }
}
