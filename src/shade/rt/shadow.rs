//! Whether lights are seen from surfaces: one ray to the middle of each, through whatever lets light pass.

use super::level::{Found, start, vector};
use super::{Rt, TOLERANCE};
use crate::lanes::chosen::{Chosen, is_run, lanes_of};
use crate::lanes::words::positions;
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real};
use crate::ray::Rays;
use crate::shade::shader::{Shader, Workspace};

/// Partitions that begin at a ray's start and end before this, mm, are passed over.
const THIN_AT_START: f64 = 0.005;
/// Light weaker than this is dark.
const DARK: f64 = 0.01;

/// What a shadow ray carries that has passed through something.
#[derive(Clone, Copy, Debug)]
struct Passed {
    /// What still passes.
    filter: f64,
    /// The region that the ray is passing through.
    within: Option<u32>,
}

impl Passed {
    const NOTHING: Self = Self { filter: 1.0, within: None };
}

/// What a probe's next surface means.
enum Verdict {
    Arrives,
    Dark,
    GoesOn(Passed),
}

/// Shadow rays on their way to one light.
#[derive(Clone, Debug, Default)]
pub(super) struct Probes<S> {
    rays: Rays<S>,
    count: usize,
    /// Numbers of the rays whose hits they start from; more than there are rays.
    slots: Column<u32>,
    /// Parallel to the rays; none while they come straight from surfaces.
    passed: Vec<Passed>,
}

impl<S: Real> Probes<S> {
    /// None, with room for `room`; [`Self::close`] ends the additions.
    pub fn open(&mut self, room: usize) {
        self.rays.open(room);
        self.count = 0;
        self.passed.clear();
        // Lanes are written a vector at a time.
        self.slots.at_least(room + MAX_LANES);
    }

    /// Adds those of `lanes` from hits `first + lane`, towards the light at the unit directions `dir`; `org` is the tolerance
    /// away from the hits.
    #[inline]
    pub fn push(&mut self, first: usize, lanes: u32, org: Lanes3<S::Wide>, dir: Lanes3<S::Wide>) {
        let (chosen, at) = (Chosen::of(lanes), self.count);
        let from = start(org) - S::Wide::constant(TOLERANCE);
        self.rays.put(at, &chosen, [org, dir], [from, S::Wide::splat(S::INFINITY)]);
        self.slots[at..at + MAX_LANES].copy_from_slice(&chosen.numbers(first as u32));
        self.count += chosen.count();
    }

    fn add(&mut self, slot: u32, passed: Passed, org: [S; 3], dir: [S; 3], from: S) {
        self.rays.set(self.count, org, dir, from, S::INFINITY);
        self.slots[self.count] = slot;
        self.passed.push(passed);
        self.count += 1;
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.count);
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
        while probes.count > 0 {
            work.rays.shadow += probes.count as u64;
            self.intersect_all(&probes.rays, work);
            found.open(probes.rays.padded_len());
            next.open(probes.count);
            for k in 0..found.hit.len() {
                // A light is a thing: a ray that meets nothing has missed it.
                let first = k * S::Wide::N;
                let (hit, regions) = self.world.met_parts(&work.hits, first);
                let mut rest = hit;
                if probes.passed.is_empty() {
                    let slots = &probes.slots[first..];
                    rest &= !simple_verdicts(rt, hit, &regions, slots, &work.hits.t[first..], visible);
                }
                if rest != 0 {
                    let dir = vector(&probes.rays.dir, first);
                    found.set_vector(k, self.world, &probes.rays, dir, &work.hits);
                }
                for i in lanes_of(rest).map(|lane| first + lane) {
                    let (slot, passed) = (probes.slots[i], probes.passed.get(i).copied().unwrap_or(Passed::NOTHING));
                    match judge(rt, passed, i, found) {
                        Verdict::Arrives => visible[slot as usize] = S::from_f64(passed.filter),
                        Verdict::Dark => {}
                        Verdict::GoesOn(on) => {
                            next.add(slot, on, probes.rays.org(i), probes.rays.dir(i), found.t[i] + tolerance);
                        }
                    }
                }
            }
            next.close();
            std::mem::swap(probes, next);
        }
    }
}

/// Of probes `lanes` that come straight from the surfaces of `slots` and have met something, in `regions` and at `t`, those for
/// which it makes no difference which side of it: they have met lights, and arrive, or what nothing passes through.
#[inline]
fn simple_verdicts<S: Real>(
    rt: &Rt,
    lanes: u32,
    regions: &[u32; MAX_LANES],
    slots: &[u32],
    t: &[S],
    visible: &mut [S],
) -> u32 {
    let is_far = S::Wide::constant(THIN_AT_START).cmp_le(S::Wide::load(t));
    let (mut rest, mut simple) = (lanes & is_far.bits(), 0);
    while rest != 0 {
        let region = regions[rest.trailing_zeros() as usize % MAX_LANES];
        let same = positions(regions, region) & rest;
        rest &= !same;
        let material = &rt.materials[region as usize];
        if material.is_light {
            arrive::<S>(same, &slots[..S::Wide::N], visible);
        }
        if material.is_light || material.finish.is_none_or(|finish| finish.transmit <= 0.0) {
            simple |= same;
        }
    }
    simple
}

/// All of the light arrives at `slots` of `lanes`.
#[inline(always)]
fn arrive<S: Real>(lanes: u32, slots: &[u32], visible: &mut [S]) {
    let place = slots[0] as usize;
    let together = visible.get_mut(place..place + S::Wide::N).filter(|_| is_run(slots));
    let Some(visible) = together else {
        return lanes_of(lanes).for_each(|lane| visible[slots[lane] as usize] = S::ONE);
    };
    let before = S::Wide::load(visible);
    S::Wide::select(<S::Wide as Lanes>::Mask::from_bits(lanes), S::Wide::constant(1.0), before).store(visible);
}

fn judge<S: Real>(rt: &Rt, passed: Passed, i: usize, found: &Found<S>) -> Verdict {
    let (t, region, leaving) = (found.t[i].to_f64(), found.region[i], found.is_leaving(i));
    if leaving && (passed.within == Some(region) || t < THIN_AT_START) {
        return Verdict::GoesOn(Passed { within: None, ..passed });
    }
    let material = &rt.materials[region as usize];
    if material.is_light {
        return Verdict::Arrives;
    }
    let filter = passed.filter * material.finish.map_or(0.0, |finish| finish.transmit);
    if filter < DARK {
        return Verdict::Dark;
    }
    Verdict::GoesOn(Passed { filter, within: (!leaving).then_some(region) })
}
