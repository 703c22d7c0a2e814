//! Streams: many rays without a common point through the tree of widest nodes together, for what packets are bad at.
//!
//! The rays of a batch are sorted by octant and cut into chunks of up to 128. A chunk goes down the tree as one, with
//! a bit per ray for every box on the stack. At a node rays are tested one by one against eight or sixteen boxes, or,
//! where many rays are left and few boxes, as vectors of rays against one box after the other; in both cases a loop of
//! known length replaces the branches of one ray's own traversal, which are what incoherent rays spend their time on. At a
//! leaf likewise; where few rays meet one and the plain test is asked, they wait for those of other leaves ([`due`]). Vectors of
//! rays that are coherent after all go to the packet kernel, unless triangles are known to be too fine for that ([`Job::apart`]); among
//! shapes, blocks of such vectors go down the tree together; short any-hit rays may go unsorted ([`neighbours`]). The
//! kernels and so the hits are those of the other generic engines, bit by bit: a sieve settles what is certain ([`sift`]). For tiles,
//! which have an arithmetic of their own, it also says where ([`Job::plain`]).
//!
//! Sources: Wald, Gribble, Boulos, Kensler, "SIMD Ray Stream Tracing", 2007; Tsakok, "Faster Incoherent Rays: Multi-BVH
//! Ray Stream Tracing", 2009; Fuetterling, Lojewski, Pfreundt, Ebert, "Efficient ray tracing kernels for modern CPU
//! architectures", 2015.

mod best;
mod block;
mod bounds;
mod chunk;
mod due;
mod engine;
mod inside;
mod leaf;
mod mixed;
mod neighbours;
mod node;
mod patience;
mod region;
mod sift;
mod signs;
mod visitors;
mod walk;

use super::output::Output;
use super::query::{Query, Stack};
use super::traverse;
use crate::lanes::rows::{Row, to_rows};
use crate::lanes::words::{prefetch, transpose_bits};
use crate::lanes::{Lanes, Real};
use crate::ray::{Counters, HitPacket, Packet, Rays};
use crate::scene::world::World;
use best::Best;
use block::Block;
use chunk::{Chunk, RAYS};
pub use engine::Stream;
use inside::Inside;
use signs::{Signs, is_narrow};
pub use visitors::{Visit, Visitors, bring_in};

/// Rays that are sorted together.
pub const SOURCE: usize = 4096;

/// Widest range of the slopes of rays that are traced as a packet.
const SPREAD: f64 = 0.25;

/// The same where chunks have the plain test, which makes them the faster for all but parallel rays.
const PLAIN_SPREAD: f64 = 1.0 / 64.0;

/// How many vectors ahead the memory is asked for rays.
const AHEAD: usize = 8;

/// Octants of directions.
const OCTANTS: usize = 8;

/// Octants times dominant axes, the latter rounded up to a power of two.
const KEYS: usize = 4 * OCTANTS;

/// Working memory of the engine.
#[derive(Clone, Debug)]
pub struct Memory<S> {
    /// The vectors that are sorted, ray by ray: a ray moves as one row instead of eight numbers from eight columns.
    rows: Vec<Row<S>>,
    /// Where each of them starts in the batch.
    starts: Vec<u32>,
    /// Places among `rows` of the rays of each octant along each dominant axis: octants along x, then along y, then along z.
    bins: [Vec<u32>; KEYS],
    /// Those of one octant, along x, then y, then z.
    places: Vec<u32>,
    chunk: Chunk<S>,
    /// Rays of the chunk in an instance's space.
    inside: Inside<S>,
    best: Best<S>,
    waiting: walk::Pile<S>,
    closer: leaf::Closer<S>,
    sifted: sift::Sifted<S>,
    block: Block<S>,
    savings: neighbours::Savings,
    /// Whether the last vector of rays was traced as a packet.
    packets: bool,
}

impl<S: Real> Default for Memory<S> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            starts: Vec::new(),
            bins: Default::default(),
            places: Vec::new(),
            chunk: Chunk::default(),
            inside: Inside::default(),
            best: Best::default(),
            waiting: walk::Pile::default(),
            closer: leaf::Closer::default(),
            sifted: sift::Sifted::default(),
            block: Block::default(),
            savings: neighbours::Savings::default(),
            packets: false,
        }
    }
}

/// One call of the engine, or the part of one that another engine leaves to this one.
pub struct Job<'a, S> {
    /// What is traced.
    pub world: &'a World<S>,
    /// The batch.
    pub rays: &'a Rays<S>,
    /// Working memory.
    pub memory: &'a mut Memory<S>,
    /// Stack of the packet kernel, with room for this world.
    pub stack: &'a mut Stack<S>,
    /// Counters.
    pub counters: &'a mut Counters,
    /// Where answers go.
    pub output: Output<'a, S>,
    /// Rays that point the same way are known to have few triangles in common all the same: none are traced as packets.
    pub apart: bool,
    /// Closest-hit: hits may be those of the plain test, not the common formula's, where it is certain (see [`sift`]). Few are
    /// traced as packets then: chunks are the faster.
    pub plain: bool,
}

impl<S: Real> Job<'_, S> {
    /// Traces the vectors of rays that start at `starts`.
    pub fn run<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        starts: impl Iterator<Item = usize>,
    ) {
        self.memory.waiting.reserve(self.world.stack_bound());
        if self.world.totals.of_shapes {
            self.blocks::<V, ANY, COUNT>(starts);
        } else {
            let (mut sorted, mut some, mut count) = (0, [0; RAYS], 0);
            for at in starts {
                if self.is_dead::<V>(at) {
                    continue;
                }
                if ANY && (count > 0 || self.memory.savings.are_worth_trying()) {
                    (some[count], count) = (at, count + 1);
                    if count == RAYS / V::N {
                        sorted += self.neighbours::<V, COUNT>(&some[..count]);
                        count = 0;
                    }
                } else {
                    sorted += self.alike::<V, ANY, COUNT>(at);
                }
                if sorted + RAYS > SOURCE {
                    self.sorted::<V, ANY, COUNT>();
                    sorted = 0;
                }
            }
            if ANY {
                self.neighbours::<V, COUNT>(&some[..count]);
            }
        }
        self.sorted::<V, ANY, COUNT>();
    }

    /// Traces vectors of rays among shapes, some as blocks, and sorts the others.
    fn blocks<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        mut starts: impl Iterator<Item = usize>,
    ) {
        self.memory.block.start();
        let mut sorted = 0;
        loop {
            let (mut some, mut count) = ([0; block::SIZES[0]], 0);
            for (to, at) in some.iter_mut().zip(&mut starts) {
                (*to, count) = (at, count + 1);
            }
            if count == 0 {
                return;
            }
            sorted += self.block::<V, ANY, COUNT>(&some[..count], 0);
            if sorted + V::N * block::SIZES[0] > SOURCE {
                self.sorted::<V, ANY, COUNT>();
                sorted = 0;
            }
        }
    }

    /// Traces a vector of rays as a packet, or, if they are of more than two octants and the world repays it, sorts its live
    /// rays. Returns how many were sorted. Rays of a chunk that meet a shape are scattered over its vectors; those that only ask
    /// whether there is anything are done too soon for chunks to make up for that.
    #[inline(always)]
    fn among_shapes<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(&mut self, at: usize) -> usize {
        let (packet, t_max, live) = Packet::<V>::load(self.rays, at);
        let alike = live != 0 && (ANY || !self.world.kinds.sorting || Signs::of(&packet).nearly_agree(live));
        if alike {
            self.trace::<V, ANY, COUNT>(at, &packet, t_max, live);
            return 0;
        }
        self.sort::<V, COUNT>(at, &packet, t_max, live)
    }

    /// Whether no ray of a vector has a segment; then says that they meet nothing.
    #[inline(always)]
    fn is_dead<V: Lanes<Scalar = S>>(&mut self, at: usize) -> bool {
        // Among packets it costs more than it gives (results/NOTES.md).
        if !self.memory.packets {
            self.ask::<V>(at + AHEAD * V::N);
        }
        let dead = !Packet::<V>::has_segment(self.rays, at);
        if dead && let Output::Closest(hits, _) = &mut self.output {
            HitPacket::new(V::constant(f64::INFINITY)).store(hits, at);
        }
        dead
    }

    /// Traces a vector of rays that point nearly the same way as a packet, or sorts its live rays. Returns how many were
    /// sorted.
    #[inline(always)]
    fn alike<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(&mut self, at: usize) -> usize {
        // After a packet mostly comes another: then its rays are read once.
        if self.memory.packets && !self.apart && self.packet::<V, ANY, COUNT>(at) {
            return 0;
        }
        let (packet, t_max, live) = Packet::<V>::load(self.rays, at);
        self.memory.packets = live != 0
            && !(self.apart || self.memory.packets)
            && Signs::of(&packet).agree(live)
            && self.packet::<V, ANY, COUNT>(at);
        match self.memory.packets {
            true => 0,
            false => self.sort::<V, COUNT>(at, &packet, t_max, live),
        }
    }

    /// Asks the memory for the rays of the vector at `at`, and for the ends of those that come as long after it; of rays without a
    /// segment nothing else is read.
    #[inline(always)]
    fn ask<V: Lanes<Scalar = S>>(&self, at: usize) {
        let rays = self.rays;
        [&rays.t_min, &rays.t_max].into_iter().for_each(|column| prefetch(column, at + AHEAD * V::N));
        if at + V::N <= rays.padded_len() && Packet::<V>::has_segment(rays, at) {
            rays.org.iter().chain(&rays.dir).for_each(|column| prefetch(column, at));
        }
    }

    /// Sorts the `live` rays of the vector at `at` by octant and dominant axis. Returns how many.
    #[inline(always)]
    fn sort<V: Lanes<Scalar = S>, const COUNT: bool>(
        &mut self,
        at: usize,
        packet: &Packet<V>,
        t_max: V,
        live: u32,
    ) -> usize {
        if COUNT {
            self.counters.rays += u64::from(live.count_ones());
        }
        match &mut self.output {
            Output::Closest(hits, _) if live != V::ALL => HitPacket::<V>::new(t_max).store(hits, at),
            Output::Closest(..) => {}
            Output::Any(out) => out.iter_mut().skip(at).take(V::N).for_each(|out| *out = 0),
        }
        let Memory { rows, starts, bins, .. } = &mut *self.memory;
        let first = starts.len() * V::N;
        if rows.len() < first + V::N {
            rows.resize(first + SOURCE, Row::ZERO);
        }
        to_rows(chunk::row(packet, t_max), &mut rows[first..first + V::N]);
        starts.push(at as u32);
        let keys = transpose_bits(Signs::of(packet).0);
        let mut rest = live;
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            let key = usize::from(keys[lane as usize % keys.len()]);
            bins[key % KEYS].push(first as u32 + lane);
        }
        live.count_ones() as usize
    }

    /// Traces the vector of rays at `at` as a packet, if they are of one octant and dominant axis and point nearly the same way;
    /// otherwise returns false. It loads them itself: handed over in memory they would cost those that are sorted, most of all,
    /// 2 to 5 %.
    #[inline(never)]
    fn packet<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(&mut self, at: usize) -> bool {
        let (packet, t_max, live) = Packet::<V>::load(self.rays, at);
        let most = if ANY || !self.plain { SPREAD } else { PLAIN_SPREAD };
        let alike = live != 0
            && Signs::of(&packet).agree(live)
            && packet.shear[..2].iter().all(|slope| is_narrow(*slope, most, live));
        if alike {
            self.trace::<V, ANY, COUNT>(at, &packet, t_max, live);
        }
        alike
    }

    /// Traces the `live` rays of the vector at `at` as a packet.
    #[inline(always)]
    fn trace<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        at: usize,
        packet: &Packet<V>,
        t_max: V,
        live: u32,
    ) {
        let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t_max), self.stack, self.counters);
        if COUNT {
            query.counters.rays += u64::from(live.count_ones());
        }
        traverse::world(self.world, packet, &mut query, live);
        let (hit, done) = (query.hit, query.done);
        self.output.put(at, &hit, done);
    }

    /// Traces what was sorted, chunk by chunk.
    #[inline(always)]
    fn sorted<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(&mut self) {
        let sieve = (ANY || self.plain) && !self.world.kinds.large;
        let sheared = !sieve || self.world.kinds.ask_for_shear();
        let Memory { rows, starts, bins, places, chunk, inside, best, waiting, closer, sifted, .. } = &mut *self.memory;
        let id = |place: u32| starts[place as usize / V::N] as usize + place as usize % V::N;
        for octant in 0..OCTANTS {
            places.clear();
            bins[octant..].iter_mut().step_by(OCTANTS).for_each(|alike| places.append(alike));
            let mut rest = &places[..];
            while !rest.is_empty() {
                // Chunks of nearly equal sizes.
                let (places, others) = rest.split_at(rest.len().div_ceil(rest.len().div_ceil(RAYS)));
                rest = others;
                chunk.gather::<V, ANY>(rows, places, &mut best.t, sheared);
                best.start();
                let room = walk::Room { waiting, closer, sifted };
                let mut walk = walk::Walk::new(best, room, self.stack, self.counters, sieve);
                walk.world::<V, ANY, COUNT>(self.world, chunk, inside, octant);
                match &mut self.output {
                    Output::Closest(hits, names) => best.scatter((hits, *names), places, id),
                    Output::Any(out) => best.scatter_done(out, places, id),
                }
            }
        }
        starts.clear();
    }
}
