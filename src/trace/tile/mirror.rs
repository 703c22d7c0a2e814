//! Rays that a flat mirror throws back: they have no common origin, but their lines pass through one point behind it,
//! the mirror image of where they came from. A block's rays are sorted by such points here, by looking at nothing but the
//! rays; those of one point are a tile that is seen from there and starts at the mirror.
//!
//! No more is asked of the point than that the lines pass it closely. How far they do is measured and goes into the error
//! bounds ([`Bundle::slack`]), so with `EXACT` answers are the common formula's, bit by bit, whatever point was found; the
//! tile's own keep their bound, as lines miss the point by no more than what rounds anyway ([`CLOSE`]).

use glam::{DMat3, DVec3};

use super::bundle::{Bundle, Shared, groups, largest, load3};
use super::columns::Columns;
use super::frame::reach;
use super::{GROUPS, HALF_ULP, Job, Mask, SET, SETS, V, select};
use crate::lanes::chosen::merge_lists;
use crate::lanes::words::{greatest, positions};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each};
use crate::ray::{HitPacket, Hits, INVALID_ID, Packet, Rays};
use crate::scene::world::Names;
use crate::trace::output::Output;
use crate::trace::stream;

/// Lines may pass the point at this many half ulps of the start's largest coordinate and of the distance (up to [`FAR`]), by each
/// axis: what the rounding of starts and directions leaves, and well below the bound that answers keep.
const CLOSE: [f32; 2] = [4.0, 1.5];

/// Distances of the point count up to this many times the scene's largest coordinate: what directions round to grows with the
/// distance, the bound that answers keep does not.
const FAR: f32 = 2.0;

/// The same for the first guess, which is made from one group.
const FIRST: [f32; 2] = [512.0; 2];

/// Fewest rays worth a tile of their own.
const LEAST: u32 = 64;

/// Rays of a group that must be free and pass a point for it to be tried.
const MOSTLY: u32 = 12;

/// Points in a row that may turn out to be none before the rest of a block is left to others.
const FAILURES: u32 = 4;

/// From one group that is tried to the next: all of them, as it has no divisor in common with [`GROUPS`], in an order that jumps
/// about.
const JUMP: usize = 21;

/// Groups whose rays a point is made from.
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
    /// All of the block, as far as they are sorted.
    all: Bundle<'a>,
    /// Per group: lanes.
    free: [u32; GROUPS],
    /// Distance of the point that counts at most.
    far: f32,
    /// Groups that were tried.
    tried: usize,
    failures: u32,
}

impl<'a> Search<'a> {
    /// In the block that starts with ray `first`, in a scene of coordinates up to `reach`; `None` if a few groups that are far
    /// from each other say that it is not worth it.
    fn new(rays: &'a Rays<f32>, first: usize, reach: f32) -> Option<Self> {
        let all = Bundle::unsorted(rays, first, groups::<SETS>(rays, first));
        // One chance less than later: what does not look like a mirror mostly is none.
        let mut search = Self { rays, all, free: [0; GROUPS], far: FAR * reach, tried: 0, failures: 1 };
        // The groups that are tried if there is no mirror.
        let columns = Columns::of(rays);
        (1..FAILURES as usize - 1).for_each(|k| columns.prefetch(first / V::N + k * JUMP % GROUPS));
        loop {
            let g = search.next()?;
            if !Packet::<V>::has_segment(rays, first + g * V::N) {
                continue;
            }
            search.sort(g);
            if search.free[g].count_ones() >= MOSTLY {
                match search.guess(g) {
                    Some(_) => break,
                    None => search.failures += 1,
                }
            }
        }
        (0..search.all.len).for_each(|g| search.sort(g));
        (search.tried, search.failures) = (0, 0);
        Some(search)
    }

    /// The group that is to be tried next.
    fn next(&mut self) -> Option<usize> {
        while self.failures < FAILURES && self.tried < GROUPS {
            let g = self.tried * JUMP % GROUPS;
            self.tried += 1;
            if g < self.all.len {
                return Some(g);
            }
        }
        None
    }

    /// Tells the lanes of a group that may be of a point.
    #[inline(always)]
    fn sort(&mut self, g: usize) {
        self.all.sort_group(self.rays, g);
        let at = self.all.first + g * V::N;
        let (t_min, t_max) = (V::load(&self.rays.t_min[at..]), V::load(&self.rays.t_max[at..]));
        let whole = t_min.cmp_eq(V::constant(0.0)) & t_max.cmp_eq(V::splat(f32::INFINITY));
        self.free[g] = self.all.tame[g] & whole.bits();
    }

    /// The next point and its rays.
    fn bundle(&mut self) -> Option<Bundle<'a>> {
        while let Some(g) = self.next() {
            if self.free[g].count_ones() < MOSTLY {
                continue;
            }
            if let Some(bundle) = self.around(g) {
                (0..self.all.len).for_each(|g| self.free[g] &= !bundle.tame[g]);
                self.failures = 0;
                return Some(bundle);
            }
            self.failures += 1;
        }
        None
    }

    /// Two free rays of a group: the first and the last, which are the farthest from each other if rays come by pixels.
    fn ends(&self, g: usize) -> [usize; 2] {
        let (lanes, first) = (self.free[g], self.all.first + g * V::N);
        [first + lanes.trailing_zeros() as usize, first + 31 - lanes.leading_zeros() as usize]
    }

    /// Where two rays of a group come closest, if most others pass there too.
    fn guess(&self, g: usize) -> Option<[f32; 3]> {
        let apex = meeting_point(self.rays, &self.ends(g))?;
        (self.passing(g, apex, CLOSE).0.count_ones() >= MOSTLY).then_some(apex)
    }

    /// The point that most rays of group `g` pass, and all that pass it.
    fn around(&self, g: usize) -> Option<Bundle<'a>> {
        let guess = self.guess(g)?;
        let Bundle { first, len, .. } = self.all;
        // Made anew from rays all over the block: two of one group are nearly parallel.
        let (mut sample, mut n) = ([0; SAMPLE + 2], 2);
        sample[..2].copy_from_slice(&self.ends(g));
        for i in 0..SAMPLE {
            let other = i * len / SAMPLE;
            let lanes = self.passing(other, guess, FIRST).0;
            if lanes != 0 {
                (sample[n], n) = (first + other * V::N + lanes.trailing_zeros() as usize, n + 1);
            }
        }
        let apex = meeting_point(self.rays, &sample[..n])?;
        let (mut tame, mut slack, mut count) = ([0; GROUPS], V::constant(0.0), 0);
        for g in 0..len {
            let (lanes, miss) = self.passing(g, apex, CLOSE);
            (tame[g], slack, count) = (lanes, miss.fast_max(slack), count + lanes.count_ones());
        }
        if count < LEAST {
            return None;
        }
        let unsorted = Bundle::unsorted(self.rays, first, len);
        Some(Bundle { apex, slack: greatest(slack), shared: Shared::Behind, tame, ..unsorted })
    }

    /// Free rays of a group whose lines pass `apex` behind their starts, at `close` half ulps; and how far at most.
    #[inline(always)]
    fn passing(&self, g: usize, apex: [f32; 3], close: [f32; 2]) -> (u32, V) {
        if self.free[g] == 0 {
            return (0, V::constant(0.0));
        }
        let at = self.all.first + g * V::N;
        let (org, dir) = (load3(&self.rays.org, at), load3(&self.rays.dir, at));
        let way = each(|a| org[a] - V::splat(apex[a]));
        // Twice, as the first time rounds about as much as is looked for.
        let rcp = V::constant(1.0) / dot(dir, dir);
        let across = |v: Lanes3<V>, along: V| each(|a| (-along).mul_add(dir[a], v[a]));
        let before = dot(way, dir) * rcp;
        let rest = across(way, before);
        let rest = across(rest, dot(rest, dir) * rcp);
        let (miss, distance) = (largest(rest), largest(way));
        let [near, far] = close.map(|x| V::splat(x * HALF_ULP));
        let most = near.mul_add(largest(org), far * distance.fast_min(V::splat(self.far)));
        // By all axes together, and with what the differences round.
        let slack = V::splat(4.0 * HALF_ULP).mul_add(distance, V::constant(3.0) * miss);
        let passes = miss.cmp_le(most) & V::constant(0.0).cmp_lt(before);
        let lanes = passes.bits() & self.free[g];
        (lanes, select(Mask::from_bits(lanes), slack, V::constant(0.0)))
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
    #[inline(never)]
    pub fn mirrored<const EXACT: bool, const COUNT: bool>(&mut self, first: usize) -> bool {
        let reach = reach(self.world.tree_bounds(), [0.0; 3]);
        let Some(mut search) = Search::new(self.rays, first, reach) else { return false };
        let mut done = [0; GROUPS];
        let len = search.all.len;
        while let Some(mut bundle) = search.bundle() {
            let groups = bundle.groups();
            for g in (0..len).filter(|&g| groups >> g & 1 != 0 && done[g] == 0 && bundle.tame[g] != V::ALL) {
                self.miss(first + g * V::N);
            }
            let traced = self.behind::<EXACT, COUNT>(&mut bundle, groups);
            for g in (0..len).filter(|g| traced >> g & 1 != 0) {
                done[g] |= bundle.tame[g];
            }
        }
        if done == [0; GROUPS] {
            return false;
        }
        for g in 0..len {
            let left = (search.all.tame[g] | search.all.odd[g]) & !done[g];
            let at = first + g * V::N;
            if done[g] == 0 {
                self.memory.rest.push(at);
            } else {
                let lanes = (0..V::N).filter(|lane| left >> lane & 1 != 0);
                self.memory.left.ids.extend(lanes.map(|lane| (at + lane) as u32));
            }
        }
        true
    }

    /// A group's rays miss, until they are found to hit.
    fn miss(&mut self, first: usize) {
        if let Output::Closest(hits, _) = &mut self.output {
            HitPacket::<V>::new(V::constant(0.0)).store(hits, first);
        }
    }

    /// Traces the rays of a point as one tile, or as one for each set. Returns the groups that were traced: others spread too
    /// wide.
    fn behind<const EXACT: bool, const COUNT: bool>(&mut self, bundle: &mut Bundle, groups: u64) -> u64 {
        if self.tile::<SETS, false, EXACT, COUNT>(bundle, groups) {
            return groups;
        }
        let mut traced = 0;
        for q in 0..SETS {
            let here = groups >> (SET * q) & 0xffff;
            if here != 0 && self.tile::<1, false, EXACT, COUNT>(&mut bundle.set(q), here) {
                traced |= here << (SET * q);
            }
        }
        traced
    }

    /// Traces what is left over.
    pub fn leftovers<const EXACT: bool, const COUNT: bool>(&mut self) {
        let Left { ids, mut rays, mut hits } = std::mem::take(&mut self.memory.left);
        rays.open(ids.len());
        for (i, &id) in ids.iter().enumerate() {
            let id = id as usize;
            rays.set(i, self.rays.org(id), self.rays.dir(id), self.rays.t_min[id], self.rays.t_max[id]);
        }
        rays.close(ids.len());
        hits.prepare(ids.len());
        let Self { world, stream: memory, stack, counters, .. } = self;
        let mut job = stream::Job {
            world,
            rays: &rays,
            memory,
            stack,
            counters,
            output: Output::Closest(&mut hits, self.world.names.as_ref()),
            // Which rays wait here together is chance, and must not matter.
            apart: !EXACT,
            plain: !EXACT,
        };
        job.run::<V, false, COUNT>((0..ids.len()).step_by(V::N));
        if let Output::Closest(to, _) = &mut self.output {
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

/// Writes the hits of some lanes of a group, by their names; what is there of the others stays.
#[inline(always)]
pub fn put(hit: &HitPacket<V>, (hits, names): (&mut Hits<f32>, Option<&Names>), first: usize, lanes: u32) {
    let mut hit = *hit;
    if let Some(names) = names {
        names.apply(&mut hit.prim, &mut hit.inst);
    }
    let mask = Mask::from_bits(lanes);
    let found = Mask::from_bits(!positions(&hit.prim, INVALID_ID));
    let t = select(found, hit.t, V::splat(f32::INFINITY));
    for (x, to) in [(t, &mut hits.t), (hit.u, &mut hits.u), (hit.v, &mut hits.v)] {
        select(mask, x, V::load(&to[first..])).store(&mut to[first..]);
    }
    for (list, to) in [(hit.prim, &mut hits.prim), (hit.inst, &mut hits.inst)] {
        if let Some(to) = to[first..].first_chunk_mut() {
            *to = merge_lists(mask, list, *to);
        }
    }
}

impl Left {
    /// Rays waiting.
    pub fn len(&self) -> usize {
        self.ids.len()
    }
}
