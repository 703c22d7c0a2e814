//! Tiles: up to 1024 rays with a common origin, a common end (any-hit), a common point behind them ([`mirror`]), or one direction
//! ([`parallel`]), through the tree of widest nodes together.
//!
//! The speed comes from doing per tile what packets do per ray: one node test is all its boxes against the whole tile,
//! triangles are set up once per tile, and a ray's share of a triangle test is four linear functions of its two
//! coordinates. `tile` answers with that arithmetic ([`own`]; [`batch`] states its accuracy). In `tile-exact` the common
//! formula decides where rounding could matter, so its hits are those of the other engines, bit by bit ([`exact`]).
//! Instances are entered by taking the tile's frame through their maps ([`place`]), or, where their triangles are finer than
//! the rays, by the stream kernel ([`fine`]); shapes in them are tested ray by ray ([`shapes`]). To the stream kernel
//! ([`super::stream`]) go blocks of rays without a common point or too wide for a frame, tiles whose rays are in no order ([`mixed`]) or
//! farther apart than triangles ([`density`]),
//! and worlds with solids, with more shapes than triangles, or with maps too flat for f32; for `tile-exact` also all worlds
//! with instances. There `tile` asks for answers of the plain test. Single odd rays go to the packet kernel.
//!
//! Sources: Reshetov, Soupikov, Hurley, "Multi-level ray tracing algorithm", 2005; Wald, Boulos, Shirley, "Ray tracing
//! deformable scenes using dynamic bounding volume hierarchies", 2007; Fuetterling, Lojewski, Pfreundt, Ebert,
//! "Efficient ray tracing kernels for modern CPU architectures", 2015.

mod batch;
mod bundle;
mod columns;
mod dead;
mod density;
mod due;
mod edges;
mod engine;
mod even;
mod exact;
mod fine;
mod frame;
mod full;
mod gaps;
mod grid;
mod groups;
mod held;
mod late;
mod lines;
mod listing;
mod mirror;
mod mixed;
mod node;
mod others;
mod own;
mod pairs;
mod parallel;
mod place;
mod presumed;
mod reach;
mod shapes;
mod slab;
mod spans;
mod starts;
mod sure;
mod walk;
mod written;

use super::output::Output;
use super::query::Stack;
use super::{Scratch, stream};
use crate::lanes::{Lanes, f32x16};
use crate::ray::{Counters, Rays};
use crate::scene::world::World;
use bundle::{Bundle, Shared, Source};
use columns::{AHEAD, Next};
use exact::Exact;
use late::Late;
use others::suits;
use presumed::First;

/// A group's rays: the vector of the whole engine.
type V = f32x16;

/// A truth value per ray of a group.
type Mask = <V as Lanes>::Mask;

/// `if_true` where the mask is set.
#[inline(always)]
fn select(mask: Mask, if_true: V, if_false: V) -> V {
    <V as Lanes>::select(mask, if_true, if_false)
}

/// Groups in a set: a vector holds one number for each of them. In ray files a set is 16x16 pixels.
const SET: usize = V::N;

/// Most sets in a tile.
const SETS: usize = 4;

/// Most groups in a tile.
const GROUPS: usize = SETS * SET;

/// Most rays in a tile.
const BLOCK: usize = GROUPS * V::N;

/// Groups up to which a call is left to the packet kernel: to look for what their rays have in common takes as long as to trace them.
const FEW: usize = 3;

/// Groups between the one whose answers are written and the one for whose answers the memory is asked.
const ANSWERS_AHEAD: usize = 8;

/// Half the distance from 1 to the next number: the largest relative error of one operation.
const HALF_ULP: f32 = f32::EPSILON / 2.0;

/// Working memory of the engine.
#[derive(Debug, Default)]
pub struct Memory {
    groups: groups::Groups,
    batch: batch::Batch,
    /// Those of them that are left where some are left out ([`gaps`]).
    kept: batch::Batch,
    trial: gaps::Trial,
    /// Leaves that are about to be read.
    due: due::Due,
    planes: batch::Planes,
    listing: listing::Listing,
    again: pairs::Again,
    slabs: slab::Slabs,
    levels: Vec<node::Level>,
    /// For shapes, and for what the stream kernel leaves to packets.
    stack: Stack<f32>,
    /// For fine instances.
    visitors: stream::Visitors<f32>,
    /// Where groups start that are for the stream kernel.
    rest: Vec<usize>,
    /// The same of tiles whose rays are much farther apart than triangles.
    apart: Vec<usize>,
    /// Single rays that are.
    left: mirror::Left,
    written: written::Written,
}

/// The engine; `EXACT`: with the hits of the common formula.
#[derive(Clone, Copy, Debug)]
pub struct Tile<const EXACT: bool> {
    name: &'static str,
    /// Most groups in a tile.
    most: usize,
}

impl Tile<true> {
    /// 32x32 rays with the scalar engine's bits.
    pub const EXACT: Self = Self { name: "tile-exact", most: GROUPS };
}

impl Tile<false> {
    /// 32x32 rays.
    pub const LARGEST: Self = Self { name: "tile", most: GROUPS };
    /// 16x16 rays, to see what the size is worth.
    pub const LARGE: Self = Self { name: "tile-16x16", most: SET };
    /// 8x8 rays, the same.
    pub const MEDIUM: Self = Self { name: "tile-8x8", most: 4 };
    /// 4x4 rays, the same.
    pub const SMALL: Self = Self { name: "tile-4x4", most: 1 };
}

/// One call of the engine.
struct Job<'a> {
    world: &'a World<f32>,
    rays: &'a Rays<f32>,
    memory: &'a mut Memory,
    stack: &'a mut Stack<f32>,
    stream: &'a mut stream::Memory<f32>,
    counters: &'a mut Counters,
    output: Output<'a, f32>,
    /// Most groups in a tile: 64, 16, 4 or 1.
    most: usize,
    /// Whether hits are written past the caches.
    past: bool,
    /// First ray of the last tile, if its answers are still to be written.
    unwritten: Option<usize>,
}

impl<'a> Job<'a> {
    fn new(
        world: &'a World<f32>,
        rays: &'a Rays<f32>,
        scratch: &'a mut Scratch,
        counters: &'a mut Counters,
        output: Output<'a, f32>,
        most: usize,
    ) -> Self {
        let Scratch { single: super::Memory { stack, stream }, tile: memory, .. } = scratch;
        stack.reserve(world.stack_bound());
        memory.stack.reserve(world.stack_bound());
        memory.visitors.reserve(world.stack_bound());
        let past = memory.written.past(rays.len(), &output);
        Self { world, rays, memory, stack, stream, counters, output, most, past, unwritten: None }
    }

    fn run<const ANY: bool, const EXACT: bool, const COUNT: bool>(&mut self) {
        if self.most == GROUPS && self.rays.len() <= FEW * V::N {
            (0..self.rays.len()).step_by(V::N).for_each(|first| self.packet::<ANY, COUNT>(first));
            return;
        }
        let mirrors = !ANY && self.most == GROUPS && suits(self.world, true);
        let suits = suits(self.world, EXACT);
        if suits {
            self.make_levels();
        }
        // What one call learns must not change what another one answers.
        self.memory.slabs.forget();
        columns::prefetch_first(self.rays);
        self.memory.groups.asked = AHEAD;
        for first in (0..self.rays.len()).step_by(BLOCK) {
            if !suits {
                self.leave::<SETS>(first);
                continue;
            }
            let mut look = match self.most == GROUPS {
                true => First::of(self.rays, first, ANY),
                false => First::Mixed,
            };
            if let First::Shared(bundle) = &mut look
                && self.presumed::<ANY, EXACT, COUNT>(bundle)
            {
                continue;
            }
            if let First::Dead = look {
                self.missed(first);
                continue;
            }
            if let First::Parallel = look
                && !EXACT
                && self.parallel::<ANY, COUNT>(first)
            {
                continue;
            }
            let scattered = matches!(look, First::Scattered | First::Parallel);
            if self.most == GROUPS
                && !scattered
                && let Some(mut bundle) = Bundle::find::<SETS>(self.rays, first, ANY)
            {
                self.block::<ANY, EXACT, COUNT>(&mut bundle);
                continue;
            }
            if mirrors && self.mirrored::<EXACT, COUNT>(first) {
                if self.memory.left.len() > stream::SOURCE {
                    self.leftovers::<EXACT, COUNT>();
                }
                continue;
            }
            if scattered {
                self.leave::<SETS>(first);
                continue;
            }
            for first in (first..self.rays.len().min(first + BLOCK)).step_by(SET * V::N) {
                match Bundle::find::<1>(self.rays, first, ANY) {
                    Some(mut bundle) => self.block::<ANY, EXACT, COUNT>(&mut bundle),
                    None => self.leave::<1>(first),
                }
            }
        }
        self.write_late();
        if self.memory.left.len() > 0 {
            self.leftovers::<EXACT, COUNT>();
        }
        let rest = std::mem::take(&mut self.memory.rest);
        self.memory.rest = self.streamed::<ANY, EXACT, COUNT>(rest, false);
        let apart = std::mem::take(&mut self.memory.apart);
        self.memory.apart = self.streamed::<ANY, EXACT, COUNT>(apart, true);
        self.end();
    }

    /// Traces a block after one look at its rays; false if they are not what was presumed, or spread too wide.
    fn presumed<const ANY: bool, const EXACT: bool, const COUNT: bool>(&mut self, bundle: &mut Bundle) -> bool {
        let groups = bundle.groups();
        match bundle.len <= SET {
            true => self.tile::<1, ANY, EXACT, COUNT>(bundle, groups),
            false => self.tile::<SETS, ANY, EXACT, COUNT>(bundle, groups),
        }
    }

    /// Traces a block as one tile or as one for each set.
    fn block<const ANY: bool, const EXACT: bool, const COUNT: bool>(&mut self, bundle: &mut Bundle) {
        let all = bundle.groups();
        for g in (0..bundle.len).filter(|g| all >> g & 1 == 0) {
            self.packet::<ANY, COUNT>(bundle.first + g * V::N);
        }
        if all >> SET != 0 && self.tile::<SETS, ANY, EXACT, COUNT>(bundle, all) {
            return;
        }
        for q in (0..SETS).filter(|q| all >> (q * SET) & 0xffff != 0) {
            self.set::<ANY, EXACT, COUNT>(&mut bundle.set(q), all >> (q * SET) & 0xffff);
        }
    }

    /// Traces some groups of one set as one tile, unless its rays spread too wide; as four or sixteen or as packets where tiles are to
    /// be smaller than a set.
    fn set<const ANY: bool, const EXACT: bool, const COUNT: bool>(&mut self, bundle: &mut Bundle, all: u64) {
        if self.most >= SET {
            if !self.tile::<1, ANY, EXACT, COUNT>(bundle, all) {
                match frame::suits(self.world.tree_bounds(), bundle.apex) {
                    true => self.leave_some(bundle, all),
                    // Next to the smallest and the largest numbers packets keep the common formula's bits whatever is rounded to zero.
                    false => listing::groups(all).for_each(|g| self.packet::<ANY, COUNT>(bundle.first + g * V::N)),
                }
            }
            return;
        }
        for quarter in [0xf, 0xf0, 0xf00, 0xf000] {
            if self.most > 1 && self.tile::<1, ANY, EXACT, COUNT>(bundle, all & quarter) {
                continue;
            }
            for g in (0..SET).filter(|g| (all & quarter) >> g & 1 != 0) {
                if !self.tile::<1, ANY, EXACT, COUNT>(bundle, 1 << g) {
                    self.packet::<ANY, COUNT>(bundle.first + g * V::N);
                }
            }
        }
    }

    /// Traces some groups of the first `N` sets as a tile, unless they spread too wide.
    #[inline(always)]
    fn tile<const N: usize, const ANY: bool, const EXACT: bool, const COUNT: bool>(
        &mut self,
        bundle: &mut Bundle,
        groups: u64,
    ) -> bool {
        if groups == 0 {
            return true;
        }
        let late = &mut Late { first: &mut self.unwritten, output: &mut self.output };
        if !self.memory.groups.load::<N, ANY, EXACT>(bundle, groups, self.world, late) {
            return false;
        }
        if bundle.shared != Shared::Behind && self.memory.groups.are_mixed::<N>() {
            self.leave_some(bundle, groups);
            return !matches!(bundle.source, Source::Pencil(..));
        }
        if self.is_dense::<N>() {
            let Memory { apart, rest, .. } = &mut *self.memory;
            let left = if bundle.shared == Shared::Along { rest } else { apart };
            left.extend(listing::groups(groups).map(|g| bundle.first + g * V::N));
            return true;
        }
        let next = Next::of(self.rays, bundle.first + bundle.len * V::N);
        let exact = Exact { bundle, world: self.world, object: self.world.first_object(), next };
        walk::walk::<N, ANY, EXACT, COUNT>(self.memory, &exact, groups, self.counters);
        self.memory.groups.asked = exact.next.asked();
        exact.next.ask_sample();
        if !ANY && !EXACT && N == SETS && self.leave_late::<COUNT>(bundle) {
            return true;
        }
        for g in (0..N * SET).filter(|g| groups >> g & 1 != 0) {
            if !self.past {
                self.output.prefetch(bundle.first + (g + ANSWERS_AHEAD) * V::N);
            }
            self.finish::<ANY, EXACT, COUNT>(&exact, g);
        }
        true
    }

    /// Writes a group's answers; rays that were not for the tile are traced now.
    #[inline(always)]
    fn finish<const ANY: bool, const EXACT: bool, const COUNT: bool>(&mut self, exact: &Exact, g: usize) {
        let first = exact.bundle.first + g * V::N;
        let mut odd = exact.bundle.odd[g];
        if COUNT {
            self.counters.rays += u64::from((exact.bundle.tame[g] | odd).count_ones());
        }
        if ANY {
            let mut done = self.memory.groups.done(g, exact.bundle.tame[g]);
            if odd != 0 {
                done |= self.rest::<ANY, COUNT>(first, odd, None).1;
            }
            self.output.put_any(first, V::N, done);
            return;
        }
        let lanes = exact.bundle.tame[g];
        let is_part = exact.bundle.shared == Shared::Behind && lanes != V::ALL;
        if !EXACT && odd == 0 && !is_part {
            if let Output::Closest(hits, names) = &mut self.output {
                self.memory.groups.store_own(g, exact.bundle, (hits, *names), self.past);
            }
            return;
        }
        let (packet, t_max) = exact.bundle.packet(g);
        let mut hit = if EXACT {
            let exact::Final { hit, denied } = exact.finish(&self.memory.groups, g, &packet, t_max);
            odd |= denied;
            hit
        } else {
            self.memory.groups.own_hits(g, exact.bundle)
        };
        if odd != 0 {
            hit = self.rest::<ANY, COUNT>(first, odd, Some(hit)).0;
        }
        match &mut self.output {
            Output::Closest(hits, names) if is_part => mirror::put(&hit, (hits, *names), first, lanes),
            output => output.put(first, &hit, 0),
        }
    }
}
