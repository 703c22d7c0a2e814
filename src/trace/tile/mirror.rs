//! Rays that a flat mirror throws back: they have no common origin, but their lines pass through one point behind it,
//! the mirror image of where they came from. A block's rays are sorted by such points here, by looking at nothing but the
//! rays; those of one point are a tile that is seen from there and starts at the mirror.
//!
//! No more is asked of the point than that the lines pass it closely; how far they do is measured and goes into the error
//! bounds ([`Bundle::slack`]). Decisions are those of `EXACT`: the common formula's, bit by bit, whatever point was found.

use glam::{DMat3, DVec3};

use super::bundle::{Bundle, Shared, load3};
use super::{GROUPS, HALF_ULP, Job, Mask, SETS, V, select};
use crate::lanes::{LaneMask, Lanes, dot, each};
use crate::ray::{HitPacket, Hits, Rays};
use crate::trace::output::Output;
use crate::trace::stream;

/// Lines may pass the point at this many half ulps of the largest coordinate and the distance.
const CLOSE: f32 = 32.0;

/// The same for the first guess, which is made from one group.
const FIRST: f32 = 512.0;

/// Fewest rays worth a tile of their own.
const LEAST: u32 = 32;

/// Rays of a group that must be free and pass a point for it to be tried.
const MOSTLY: u32 = 12;

/// Points in a row that may turn out to be none before the rest of a block is left to others.
const FAILURES: u32 = 4;

/// Most rays a point is made from.
const SAMPLE: usize = V::N;

/// Rays that are left over, traced as a batch of their own.
#[derive(Debug, Default)]
pub struct Left {
    /// Their numbers in the batch they are of.
    ids: Vec<u32>,
    rays: Rays<f32>,
    hits: Hits<f32>,
}

/// Rays of a block that are not yet of a point.
struct Search<'a> {
    rays: &'a Rays<f32>,
    first: usize,
    /// Groups.
    len: usize,
    /// Per group: lanes.
    free: [u32; GROUPS],
    /// Next group to be tried, in an order that jumps about.
    next: usize,
    failures: u32,
}

impl<'a> Search<'a> {
    /// The next point and its rays.
    fn bundle(&mut self) -> Option<Bundle<'a>> {
        while self.failures < FAILURES && self.next < GROUPS {
            // 21 and 64 have no common divisor: all groups, far from each other.
            let g = self.next * 21 % GROUPS;
            self.next += 1;
            if g >= self.len || self.free[g].count_ones() < MOSTLY {
                continue;
            }
            match self.around(g) {
                Some(bundle) => {
                    (0..self.len).for_each(|g| self.free[g] &= !bundle.tame[g]);
                    self.failures = 0;
                    return Some(bundle);
                }
                None => self.failures += 1,
            }
        }
        None
    }

    /// The point that most rays of group `g` pass, and all that pass it.
    fn around(&self, g: usize) -> Option<Bundle<'a>> {
        let first = self.first + g * V::N;
        let (mut sample, mut n) = ([0; SAMPLE], 0);
        for lane in (0..V::N).filter(|lane| self.free[g] >> lane & 1 != 0) {
            (sample[n], n) = (first + lane, n + 1);
        }
        let apex = meeting_point(self.rays, &sample[..n])?;
        if self.passing(g, apex, CLOSE).0.count_ones() < MOSTLY {
            return None;
        }
        // Made anew from rays all over the block: those of one group are nearly parallel.
        for (i, ray) in sample[..n].iter_mut().enumerate() {
            let other = i * self.len / n;
            let lanes = self.passing(other, apex, FIRST).0;
            if lanes != 0 {
                *ray = self.first + other * V::N + lanes.trailing_zeros() as usize;
            }
        }
        let apex = meeting_point(self.rays, &sample[..n])?;
        let (mut tame, mut slack, mut count) = ([0; GROUPS], V::constant(0.0), 0);
        for g in 0..self.len {
            let (lanes, miss) = self.passing(g, apex, CLOSE);
            (tame[g], slack, count) = (lanes, miss.fast_max(slack), count + lanes.count_ones());
        }
        let slack = slack.to_array().into_iter().fold(0.0, f32::max);
        (count >= LEAST).then(|| Bundle::behind(self.rays, self.first, self.len, apex, slack, tame))
    }

    /// Free rays of a group whose lines pass `apex` behind their starts, at `close` half ulps; and how far at most.
    #[inline(always)]
    fn passing(&self, g: usize, apex: [f32; 3], close: f32) -> (u32, V) {
        if self.free[g] == 0 {
            return (0, V::constant(0.0));
        }
        let at = self.first + g * V::N;
        let (org, dir) = (load3(&self.rays.org, at), load3(&self.rays.dir, at));
        let way = each(|a| org[a] - V::splat(apex[a]));
        let before = dot(way, dir) / dot(dir, dir);
        let [x, y, z] = each(|a| (-before).mul_add(dir[a], way[a]).abs());
        let size = |v: [V; 3]| v[0].abs().fast_max(v[1].abs()).fast_max(v[2].abs());
        // Also what the differences round.
        let miss = size(way).mul_add(V::splat(4.0 * HALF_ULP), x + y + z);
        let most = (size(org) + size(way)) * V::splat(close * HALF_ULP);
        let passes = miss.cmp_le(most) & V::constant(0.0).cmp_lt(before);
        let lanes = passes.bits() & self.free[g];
        (lanes, select(Mask::from_bits(lanes), miss, V::constant(0.0)))
    }
}

/// The point nearest to the lines of some rays, by least squares.
fn meeting_point(rays: &Rays<f32>, sample: &[usize]) -> Option<[f32; 3]> {
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let centre = vector(rays.org(*sample.first()?));
    let (mut squares, mut sum, mut aside) = (0.0, DVec3::ZERO, [DVec3::ZERO; 3]);
    for &ray in sample {
        let (from, dir) = (vector(rays.org(ray)) - centre, vector(rays.dir(ray)));
        let square = dir.length_squared();
        squares += square;
        sum += square * from - dir * dir.dot(from);
        (0..3).for_each(|a| aside[a] += dir * dir[a]);
    }
    let [x, y, z] = aside;
    let point = (DMat3::from_diagonal(DVec3::splat(squares)) - DMat3::from_cols(x, y, z)).inverse() * sum + centre;
    let point = point.as_vec3();
    point.is_finite().then(|| point.to_array())
}

impl Job<'_> {
    /// Traces the rays of a block that are of such points; the others are left over. False if there are no points.
    #[cold]
    #[inline(never)]
    pub fn mirrored<const COUNT: bool>(&mut self, first: usize) -> bool {
        let all = Bundle::sorted::<SETS>(self.rays, first);
        let mut free = all.tame;
        for (g, free) in free.iter_mut().enumerate().take(all.len) {
            let at = first + g * V::N;
            *free &= V::load(&self.rays.t_min[at..]).cmp_eq(V::constant(0.0)).bits();
        }
        let mut search = Search { rays: self.rays, first, len: all.len, free, next: 0, failures: 0 };
        let mut done = [0; GROUPS];
        while let Some(bundle) = search.bundle() {
            let groups = bundle.groups();
            for g in (0..all.len).filter(|&g| groups >> g & 1 != 0 && done[g] == 0 && bundle.tame[g] != V::ALL) {
                self.miss(first + g * V::N);
            }
            let traced = self.behind::<COUNT>(&bundle, groups);
            for g in (0..all.len).filter(|g| traced >> g & 1 != 0) {
                done[g] |= bundle.tame[g];
            }
        }
        let found = done.iter().any(|&lanes| lanes != 0);
        for g in (0..all.len).filter(|_| found) {
            let left = (all.tame[g] | all.odd[g]) & !done[g];
            let at = first + g * V::N;
            if done[g] == 0 {
                self.memory.rest.push(at);
            } else {
                let lanes = (0..V::N).filter(|lane| left >> lane & 1 != 0);
                self.memory.left.ids.extend(lanes.map(|lane| (at + lane) as u32));
            }
        }
        found
    }

    /// A group's rays miss, until they are found to hit.
    fn miss(&mut self, first: usize) {
        if let Output::Closest(hits) = &mut self.output {
            HitPacket::<V>::new(V::constant(0.0)).store(hits, first);
        }
    }

    /// Traces the rays of a point as one tile, or as one for each set. Returns the groups that were traced: others spread too
    /// wide.
    fn behind<const COUNT: bool>(&mut self, bundle: &Bundle, groups: u64) -> u64 {
        if self.tile::<SETS, false, true, COUNT>(bundle, groups) {
            return groups;
        }
        let mut traced = 0;
        for q in 0..SETS {
            let here = groups >> (16 * q) & 0xffff;
            if here != 0 && self.tile::<1, false, true, COUNT>(&bundle.set(q), here) {
                traced |= here << (16 * q);
            }
        }
        traced
    }

    /// Traces what is left over.
    pub fn leftovers<const COUNT: bool>(&mut self) {
        let Left { ids, mut rays, mut hits } = std::mem::take(&mut self.memory.left);
        rays.open(ids.len());
        for (i, &id) in ids.iter().enumerate() {
            let id = id as usize;
            rays.set(i, self.rays.org(id), self.rays.dir(id), self.rays.t_min[id], self.rays.t_max[id]);
        }
        rays.close(ids.len());
        hits.prepare(ids.len());
        let Self { world, stream: memory, stack, counters, .. } = self;
        let mut job = stream::Job { world, rays: &rays, memory, stack, counters, output: Output::Closest(&mut hits) };
        job.run::<V, false, COUNT>((0..ids.len()).step_by(V::N));
        if let Output::Closest(to) = &mut self.output {
            for (i, &id) in ids.iter().enumerate() {
                let id = id as usize;
                (to.t[id], to.u[id], to.v[id]) = (hits.t[i], hits.u[i], hits.v[i]);
                (to.prim[id], to.inst[id]) = (hits.prim[i], hits.inst[i]);
            }
        }
        self.memory.left = Left { ids, rays, hits };
        self.memory.left.ids.clear();
    }
}

impl Left {
    /// Rays waiting.
    pub fn len(&self) -> usize {
        self.ids.len()
    }
}

impl<'a> Bundle<'a> {
    /// Rays whose lines pass `apex` behind their starts.
    fn behind(
        rays: &'a Rays<f32>,
        first: usize,
        len: usize,
        apex: [f32; 3],
        slack: f32,
        tame: [u32; GROUPS],
    ) -> Self {
        Self { apex, slack, shared: Shared::Behind, tame, odd: [0; GROUPS], ..Self::unsorted(rays, first, len) }
    }
}
