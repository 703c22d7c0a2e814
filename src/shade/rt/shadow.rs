//! Whether lights are seen from surfaces: one ray to the middle of each, through whatever lets light pass.

use super::level::{Found, start};
use super::{Rt, TOLERANCE};
use crate::lanes::Real;
use crate::ray::Rays;
use crate::shade::shader::{Shader, Workspace};

/// Partitions that begin at a ray's start and end before this, mm, are passed over.
const THIN_AT_START: f64 = 0.005;
/// Light weaker than this is dark.
const DARK: f64 = 0.01;

/// What a shadow ray carries.
#[derive(Clone, Copy, Debug)]
struct Probe {
    /// Number of the ray whose hit it starts from.
    slot: u32,
    /// What still passes.
    filter: f64,
    /// The region that the ray is passing through.
    within: Option<u32>,
}

/// What a probe's next surface means.
enum Verdict {
    Arrives,
    Dark,
    GoesOn(Probe),
}

/// Shadow rays on their way to one light.
#[derive(Clone, Debug, Default)]
pub(super) struct Probes<S> {
    rays: Rays<S>,
    carry: Vec<Probe>,
}

impl<S: Real> Probes<S> {
    /// None, with room for `count`.
    pub fn open(&mut self, count: usize) {
        self.rays.reset(count);
        self.carry.clear();
    }

    /// Adds one from hit `slot`, towards the light at the unit direction `dir`; `org` is the tolerance away from the hit.
    #[inline]
    pub fn push(&mut self, slot: u32, org: [S; 3], dir: [S; 3]) {
        let from = start(org) - S::from_f64(TOLERANCE);
        self.add(Probe { slot, filter: 1.0, within: None }, org, dir, from);
    }

    fn add(&mut self, probe: Probe, org: [S; 3], dir: [S; 3], from: S) {
        self.rays.set(self.carry.len(), org, dir, from, S::INFINITY);
        self.carry.push(probe);
    }
}

impl<S: Real> Shader<'_, S> {
    /// Follows `probes` to their end, using `next` on the way: how much of the light reaches each slot, 0 to 1, into
    /// `visible`, which holds zeros.
    pub(super) fn rt_visible(
        &self,
        rt: &Rt,
        probes: &mut Probes<S>,
        next: &mut Probes<S>,
        found: &mut Found<S>,
        visible: &mut [S],
        work: &mut Workspace<S>,
    ) {
        let tolerance = S::from_f64(TOLERANCE);
        while !probes.carry.is_empty() {
            let count = probes.carry.len();
            probes.rays.truncate(count);
            work.rays.shadow += count as u64;
            self.intersect_all(&probes.rays, work);
            found.set(self.world, &probes.rays, &work.hits);
            next.open(count);
            for (i, probe) in probes.carry.iter().enumerate() {
                match judge(rt, probe, i, found) {
                    Verdict::Arrives => visible[probe.slot as usize] = S::from_f64(probe.filter),
                    Verdict::Dark => {}
                    Verdict::GoesOn(on) => {
                        next.add(on, probes.rays.org(i), probes.rays.dir(i), found.t[i] + tolerance);
                    }
                }
            }
            std::mem::swap(probes, next);
        }
    }
}

fn judge<S: Real>(rt: &Rt, probe: &Probe, i: usize, found: &Found<S>) -> Verdict {
    // A light is a thing: a ray that meets nothing has missed it.
    if !found.is_hit(i) {
        return Verdict::Dark;
    }
    let (t, region, leaving) = (found.t[i].to_f64(), found.region[i], found.is_leaving(i));
    if leaving && (probe.within == Some(region) || t < THIN_AT_START) {
        return Verdict::GoesOn(Probe { within: None, ..*probe });
    }
    let material = &rt.materials[region as usize];
    if material.is_light {
        return Verdict::Arrives;
    }
    let filter = probe.filter * material.finish.map_or(0.0, |finish| finish.transmit);
    if filter < DARK {
        return Verdict::Dark;
    }
    Verdict::GoesOn(Probe { filter, within: (!leaving).then_some(region), ..*probe })
}
