//! Where the time of a picture goes, bounce by bounce.

use std::time::{Duration, Instant};

use super::sample::RayCounts;

/// What one bounce took.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct BounceStats {
    /// Rays traced for closest hits.
    pub rays: u64,
    /// Shadow rays.
    pub shadows: u64,
    /// Points that scattered in packets.
    pub points: u64,
    /// Lanes of those packets; 0 where shading goes hit by hit.
    pub lanes: u64,
    /// Time in closest hits.
    pub tracing: Duration,
    /// Time in shadow rays.
    pub shadowing: Duration,
    /// Time in shading: surfaces, lights, scattering.
    pub shading: Duration,
}

/// What all bounces took, over all threads. Times of different threads add up.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
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

/// Measures the levels of recursive ray tracing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    since: Instant,
    before: RayCounts,
    /// Time in closest hits since the last lap.
    pub tracing: Duration,
    /// The same in shadow and occlusion rays.
    pub shadowing: Duration,
}

impl Default for Clock {
    fn default() -> Self {
        let none = Duration::ZERO;
        Self { since: Instant::now(), before: RayCounts::default(), tracing: none, shadowing: none }
    }
}

impl Clock {
    /// Starts with the counts `rays`.
    pub fn start(&mut self, rays: &RayCounts) {
        *self = Self { before: *rays, ..Self::default() };
    }

    /// What the level took that ends now, with the counts `rays`; the next one begins.
    pub fn lap(&mut self, rays: &RayCounts) -> BounceStats {
        let closest = |r: &RayCounts| r.primary + r.mirror + r.refracted;
        let any = |r: &RayCounts| r.shadow + r.occlusion;
        let stats = BounceStats {
            rays: closest(rays) - closest(&self.before),
            shadows: any(rays) - any(&self.before),
            tracing: self.tracing,
            shadowing: self.shadowing,
            shading: self.since.elapsed().saturating_sub(self.tracing + self.shadowing),
            ..BounceStats::default()
        };
        self.start(rays);
        stats
    }
}
