//! Whether lights are seen from surfaces: one ray to the middle of each, through whatever lets light pass.

use super::level::{Found, start};
use super::{Rt, TOLERANCE};
use crate::lanes::chosen::{Chosen, lanes_of};
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real};
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
    /// None, with room for `count`; [`Self::close`] ends the additions.
    pub fn open(&mut self, count: usize) {
        self.rays.open(count);
        self.carry.clear();
    }

    /// Adds those of `lanes` from hits `first + lane`, towards the light at the unit directions `dir`; `org` is the tolerance
    /// away from the hits.
    #[inline]
    pub fn push(&mut self, first: usize, lanes: u32, org: Lanes3<S::Wide>, dir: Lanes3<S::Wide>) {
        let (chosen, at) = (Chosen::of(lanes), self.carry.len());
        let from = start(org) - S::Wide::constant(TOLERANCE);
        self.rays.put(at, &chosen, [org, dir], S::Wide::splat(S::INFINITY));
        chosen.pack(from, &mut self.rays.t_min[at..]);
        self.carry.extend(chosen.iter().map(|lane| Probe { slot: (first + lane) as u32, filter: 1.0, within: None }));
    }

    fn add(&mut self, probe: Probe, org: [S; 3], dir: [S; 3], from: S) {
        self.rays.set(self.carry.len(), org, dir, from, S::INFINITY);
        self.carry.push(probe);
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.carry.len());
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
        let mut is_first = true;
        while !probes.carry.is_empty() {
            work.rays.shadow += probes.carry.len() as u64;
            self.intersect_all(&probes.rays, work);
            found.open(probes.rays.padded_len());
            next.open(probes.carry.len());
            for k in 0..found.hit.len() {
                // A light is a thing: a ray that meets nothing has missed it.
                let first = k * S::Wide::N;
                let (hit, regions) = self.world.met_parts(&work.hits, first);
                let mut rest = hit;
                if is_first {
                    rest &= !simple_verdicts(rt, first, hit, &regions, probes, &work.hits.t, visible);
                }
                if rest != 0 {
                    found.set_vector(k, self.world, &probes.rays, &work.hits);
                }
                for i in lanes_of(rest).map(|lane| first + lane) {
                    let probe = &probes.carry[i];
                    match judge(rt, probe, i, found) {
                        Verdict::Arrives => visible[probe.slot as usize] = S::from_f64(probe.filter),
                        Verdict::Dark => {}
                        Verdict::GoesOn(on) => {
                            next.add(on, probes.rays.org(i), probes.rays.dir(i), found.t[i] + tolerance);
                        }
                    }
                }
            }
            next.close();
            std::mem::swap(probes, next);
            is_first = false;
        }
    }
}

/// Of probes `lanes` that come straight from a surface and have met something, in `regions`, those for which it makes no
/// difference which side of it: they have met lights, and arrive, or what nothing passes through.
#[inline]
fn simple_verdicts<S: Real>(
    rt: &Rt,
    first: usize,
    lanes: u32,
    regions: &[u32; MAX_LANES],
    probes: &Probes<S>,
    t: &[S],
    visible: &mut [S],
) -> u32 {
    let is_far = S::Wide::constant(THIN_AT_START).cmp_le(S::Wide::load(&t[first..]));
    let (mut rest, mut simple) = (lanes & is_far.bits(), 0);
    while rest != 0 {
        let region = regions[rest.trailing_zeros() as usize % MAX_LANES];
        let same = positions(regions, region) & rest;
        rest &= !same;
        let material = &rt.materials[region as usize];
        if material.is_light {
            for probe in lanes_of(same).map(|lane| &probes.carry[first + lane]) {
                visible[probe.slot as usize] = S::from_f64(probe.filter);
            }
        }
        if material.is_light || material.finish.is_none_or(|finish| finish.transmit <= 0.0) {
            simple |= same;
        }
    }
    simple
}

fn judge<S: Real>(rt: &Rt, probe: &Probe, i: usize, found: &Found<S>) -> Verdict {
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
