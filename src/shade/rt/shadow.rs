//! Whether lights are seen from surfaces: one ray to the middle of each, through whatever lets light pass.

use glam::DVec3;

use super::lamp::Lamp;
use super::{Found, Meeting, Rt, TOLERANCE};
use crate::lanes::Real;
use crate::shade::shader::{Shader, Workspace};

/// Partitions that begin at a ray's start and end before this, mm, are passed over.
const THIN_AT_START: f64 = 0.005;
/// Light weaker than this is dark.
const DARK: f64 = 0.01;

/// A shadow ray on its way.
#[derive(Clone, Copy)]
struct Probe {
    /// Number of its answer.
    slot: usize,
    org: DVec3,
    dir: DVec3,
    /// Where on the ray to go on.
    from: f64,
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

impl<S: Real> Shader<'_, S> {
    /// How much of `lamp` reaches the meetings numbered `lit`: 0 to 1.
    pub(super) fn rt_visible(
        &self,
        rt: &Rt,
        lamp: &Lamp,
        lit: &[usize],
        meetings: &[Meeting],
        work: &mut Workspace<S>,
    ) -> Vec<f64> {
        if lamp.region.is_none() {
            return vec![1.0; lit.len()];
        }
        let mut answers = vec![0.0; lit.len()];
        let probe = |(slot, &i): (usize, &usize)| {
            let position = meetings[i].position;
            let dir = (lamp.position - position).normalize();
            Probe { slot, org: position + dir * TOLERANCE, dir, from: 0.0, filter: 1.0, within: None }
        };
        let mut probes: Vec<Probe> = lit.iter().enumerate().map(probe).collect();
        while !probes.is_empty() {
            let mut batch = std::mem::take(&mut work.batch);
            batch.reset(probes.len());
            for (i, probe) in probes.iter().enumerate() {
                let (org, dir) = (probe.org.to_array().map(S::from_f64), probe.dir.to_array().map(S::from_f64));
                batch.set(i, org, dir, S::from_f64(probe.from), S::from_f64(f64::INFINITY));
            }
            work.rays.shadow += probes.len() as u64;
            self.intersect_all(&batch, work);
            let mut on = Vec::new();
            for (i, probe) in probes.iter().enumerate() {
                match judge(rt, probe, &self.rt_found(i, probe.org, probe.dir, work)) {
                    Verdict::Arrives => answers[probe.slot] = probe.filter,
                    Verdict::Dark => {}
                    Verdict::GoesOn(probe) => on.push(probe),
                }
            }
            work.batch = batch;
            probes = on;
        }
        answers
    }
}

fn judge(rt: &Rt, probe: &Probe, found: &Found) -> Verdict {
    // A light is a thing: a ray that meets nothing has missed it.
    let (t, region, entering) = match *found {
        Found::Nothing => return Verdict::Dark,
        Found::Entering { t, region, .. } => (t, region, true),
        Found::Leaving { t, region, .. } => (t, region, false),
    };
    let on = Probe { from: t + TOLERANCE, ..*probe };
    if !entering && (probe.within == Some(region) || t < THIN_AT_START) {
        return Verdict::GoesOn(Probe { within: None, ..on });
    }
    let material = &rt.materials[region as usize];
    if material.is_light {
        return Verdict::Arrives;
    }
    let filter = probe.filter * material.finish.map_or(0.0, |finish| finish.transmit);
    if filter < DARK {
        return Verdict::Dark;
    }
    Verdict::GoesOn(Probe { filter, within: entering.then_some(region), ..on })
}
