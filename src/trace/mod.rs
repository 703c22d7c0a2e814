//! The engines behind one trait.
//!
//! All generic engines run the same kernels at different widths: `brute` and `scalar` at width 1 (without and with
//! the tree), `packetN` at N lanes. Their hits are equal to the last bit; [`crate::ray::slab`] says why. `tile` has its
//! own arithmetic, and hits that differ where rounding can tell; `tile-exact` asks the common kernel there.
//!
//! # Which rays they want
//! Batches go to [`Engine::intersect`] and [`Engine::occluded`] as they are; their order decides how fast they are traced.
//!
//! * `packetN`: N consecutive rays that go about the same way, such as pixels in Morton order ([`crate::camera::fill_tile`]).
//!   Source: Wald, Slusallek, Benthin, Wagner, "Interactive Rendering with Coherent Ray Tracing", 2001.
//! * `tile`, `tile-exact` (f32): 16 to 1024 rays in Morton order with a common origin (pixels of a perspective camera), a common
//!   end (any-hit: shadow rays to a point), a common point behind them (rays off a flat mirror) or one direction (a parallel camera, a sun).
//!   All else goes to the kernel of `stream`: rays without anything in common, tiles much wider than the triangles they meet, worlds with
//!   solids or with more shapes than triangles.
//!   Sources: Reshetov, Soupikov, Hurley, "Multi-level ray tracing algorithm", 2005; Wald, Boulos, Shirley, "Ray tracing
//!   deformable scenes using dynamic bounding volume hierarchies", 2007; Fuetterling, Lojewski, Pfreundt, Ebert, "Efficient
//!   ray tracing kernels for modern CPU architectures", 2015.
//! * `stream`: any rays, up to 4096 of which it sorts by direction itself; the more the better, 128 at least. Occlusion and bounced
//!   rays, of which neighbours start close to each other. What turns out coherent is traced as packets.
//!   Sources: Wald, Gribble, Boulos, Kensler, "SIMD Ray Stream Tracing", 2007; Tsakok, "Faster Incoherent Rays: Multi-BVH
//!   Ray Stream Tracing", 2009; Fuetterling and others, as above.

mod all;
mod brute;
mod leaf;
mod output;
mod query;
mod single;
mod solids;
mod stream;
mod tile;
mod traverse;
mod void;

use std::marker::PhantomData;

use crate::error::{Error, Result, nearest_name};
use crate::lanes::{Lanes, Pair, Real, f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use crate::ray::{Counters, HitPacket, Hits, Packet, Pencil, Rays};
use crate::scene::world::{Compiles, World};
pub use all::{Stretch, stretches};
use output::Output;
use query::{Query, Stack};
pub use void::is_void;

/// Whether engines count what they do even if nobody asks. When the library's parts are tested they do: kernels that do not count
/// are the same source, and to compile both again takes minutes. Tests of the whole program run these.
const ALWAYS_COUNTS: bool = cfg!(test);

/// Per-thread working memory of engines; grows on use, reusable for any world.
#[derive(Debug, Default)]
pub struct Scratch {
    single: Memory<f32>,
    double: Memory<f64>,
    tile: Box<tile::Memory>,
}

/// Working memory of the generic engines of one precision.
#[derive(Debug)]
pub struct Memory<S> {
    stack: Stack<S>,
    stream: Box<stream::Memory<S>>,
}

impl<S: Real> Default for Memory<S> {
    fn default() -> Self {
        Self { stack: Stack::default(), stream: Box::default() }
    }
}

/// A complete path from rays to hits.
pub trait Engine<S: Real>: Sync {
    /// Name for `--engine` and tables.
    fn name(&self) -> &'static str;
    /// Rays traced together.
    fn lanes(&self) -> usize;
    /// Lanes of the vectors that rays are traced in; fewer than rays that are traced together where several vectors of them are.
    fn width(&self) -> usize {
        self.lanes()
    }
    /// Whether the hits are those of the common formulas, bit for bit. Others are repeatable, whatever the threads and
    /// the order of batches, but a ray's answer may depend on its neighbours where rounding can tell.
    fn is_exact(&self) -> bool {
        true
    }
    /// Closest hit of each ray of `rays` into `hits` (reset to the batch's length). With `counters`, the counting
    /// build of the same kernels runs and adds to them. All runs on the calling thread: to use several, give each its own batches
    /// and its own `scratch`.
    fn intersect(
        &self,
        world: &World<S>,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    );
    /// Closest hits of rays that the engine makes itself, as [`Self::intersect`]. False if it wants them in memory; `hits`
    /// are then unspecified.
    fn intersect_pencil(
        &self,
        _world: &World<S>,
        _pencil: &Pencil,
        _hits: &mut Hits<S>,
        _scratch: &mut Scratch,
        _counters: Option<&mut Counters>,
    ) -> bool {
        false
    }
    /// Whether anything lies in each ray's segment: `out` is resized to the batch's length, 1 is occluded. The answer is whether
    /// [`Self::intersect`] finds something there, but for engines that are not [exact](Self::is_exact): rays with a common end are traced
    /// from there, and may differ within rounding of an edge or of an end of the segment; of rays without a common point closest-hit has a `t`
    /// of the engine's own, so the two may differ where that is within its bound of `t_min` or `t_max`, as of rays that begin or end on
    /// a surface. On the calling thread, too.
    fn occluded(
        &self,
        world: &World<S>,
        rays: &Rays<S>,
        out: &mut Vec<u8>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    );
}

/// A scalar type with its list of engines. Lists are never taken over into other crates, as the compiler would do with such short
/// functions: what is listed would be compiled there once more.
pub trait Engines: Compiles {
    /// `f32` or `f64`.
    const PRECISION: &'static str;
    /// All engines of this precision, baselines first.
    fn engines() -> &'static [&'static dyn Engine<Self>];
    /// Variants that answer one question of an experiment and are taken up only by name.
    fn variants() -> &'static [&'static dyn Engine<Self>] {
        &[]
    }
    #[doc(hidden)]
    fn memory(scratch: &mut Scratch) -> &mut Memory<Self>;
}

impl Engines for f32 {
    const PRECISION: &'static str = "f32";

    #[inline(never)]
    fn engines() -> &'static [&'static dyn Engine<Self>] {
        &[
            &Generic::<f32, false>("brute", PhantomData),
            &Generic::<f32, true>("scalar", PhantomData),
            &Generic::<f32x4, true>("packet4", PhantomData),
            &Generic::<f32x8, true>("packet8", PhantomData),
            &Generic::<f32x16, true>("packet16", PhantomData),
            &stream::Stream::<f32x16>(PhantomData),
            &tile::Tile::EXACT,
            &tile::Tile::LARGEST,
        ]
    }

    #[inline(never)]
    fn variants() -> &'static [&'static dyn Engine<Self>] {
        &[&tile::Tile::SMALL, &tile::Tile::MEDIUM, &tile::Tile::LARGE]
    }

    fn memory(scratch: &mut Scratch) -> &mut Memory<Self> {
        &mut scratch.single
    }
}

/// Vectors of rays of the stream kernel in f64: two registers of AVX-512 or of AVX2.
#[cfg(target_feature = "avx512f")]
type Doubles = Pair<f64x8>;
#[cfg(not(target_feature = "avx512f"))]
type Doubles = f64x8;

impl Engines for f64 {
    const PRECISION: &'static str = "f64";

    #[inline(never)]
    fn engines() -> &'static [&'static dyn Engine<Self>] {
        &[
            &Generic::<f64, false>("brute", PhantomData),
            &Generic::<f64, true>("scalar", PhantomData),
            &Generic::<f64x2, true>("packet2", PhantomData),
            &Generic::<f64x4, true>("packet4", PhantomData),
            &Generic::<f64x8, true>("packet8", PhantomData),
            &Generic::<Pair<f64x8>, true>("packet16", PhantomData),
            &stream::Stream::<Doubles>(PhantomData),
        ]
    }

    fn memory(scratch: &mut Scratch) -> &mut Memory<Self> {
        &mut scratch.double
    }
}

/// Name of the fastest engine on coherent rays that [`Engine::is_exact`].
pub const EXACT_ENGINE: &str = "auto-exact";

/// The engine called `name`; `auto` is the fastest one of the precision on coherent rays (the last of the list, which
/// hands what does not suit it to the packets), [`EXACT_ENGINE`] the fastest exact one; also [`Engines::variants`].
///
/// # Errors
/// A usage error that lists the names and the nearest one.
pub fn engine<S: Engines>(name: &str) -> Result<&'static dyn Engine<S>> {
    let names = || S::engines().iter().chain(S::variants()).map(|e| e.name()).chain(["auto", EXACT_ENGINE]);
    let engines = || S::engines().iter().copied();
    let found = match name {
        "auto" => engines().next_back(),
        EXACT_ENGINE => engines().rfind(|e| e.is_exact()),
        _ => engines().chain(S::variants().iter().copied()).find(|e| e.name() == name),
    };
    found.ok_or_else(|| {
        let near = nearest_name(name, names()).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
        let list = names().collect::<Vec<_>>().join(", ");
        Error::Usage(format!("no engine `{name}` in {}: there are {list}{near}", S::PRECISION))
    })
}

/// The generic engine of width `V::N`: over the tree, or (`TREE` false) over every primitive.
struct Generic<V, const TREE: bool>(&'static str, PhantomData<fn() -> V>);

impl<V: Lanes, const TREE: bool> Generic<V, TREE> {
    #[inline(always)]
    fn packet<const ANY: bool, const COUNT: bool>(
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        first: usize,
        stack: &mut Stack<V::Scalar>,
        counters: &mut Counters,
    ) -> (HitPacket<V>, u32) {
        let (packet, t_max, live) = Packet::<V>::load(rays, first);
        let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t_max), stack, counters);
        if COUNT {
            query.counters.rays += u64::from(live.count_ones());
        }
        if live != 0 {
            if TREE {
                traverse::world(world, &packet, &mut query, live);
            } else {
                brute::world(world, &packet, &mut query, live);
            }
        }
        (query.hit, query.done)
    }

    fn closest<const COUNT: bool>(
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        hits: &mut Hits<V::Scalar>,
        stack: &mut Stack<V::Scalar>,
        counters: &mut Counters,
    ) {
        for first in (0..rays.len()).step_by(V::N) {
            let (hit, _) = Self::packet::<false, COUNT>(world, rays, first, stack, counters);
            Output::Closest(hits, world.names.as_ref()).put(first, &hit, 0);
        }
    }

    /// Any-hit, the rays from `first` on: as many as `out` has places for. Not inlined: streams call it too, and are to be as fast.
    #[inline(never)]
    fn any<const COUNT: bool>(
        world: &World<V::Scalar>,
        (rays, first): (&Rays<V::Scalar>, usize),
        out: &mut [u8],
        stack: &mut Stack<V::Scalar>,
        counters: &mut Counters,
    ) {
        for (i, lanes) in out.chunks_mut(V::N).enumerate() {
            let (_, done) = Self::packet::<true, COUNT>(world, rays, first + i * V::N, stack, counters);
            for (lane, out) in lanes.iter_mut().enumerate() {
                *out = (done >> lane & 1) as u8;
            }
        }
    }
}

impl<V: Lanes, const TREE: bool> Engine<V::Scalar> for Generic<V, TREE>
where
    V::Scalar: Engines,
{
    fn name(&self) -> &'static str {
        self.0
    }

    fn lanes(&self) -> usize {
        V::N
    }

    fn intersect(
        &self,
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        hits: &mut Hits<V::Scalar>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        hits.reset(rays.len());
        let stack = &mut V::Scalar::memory(scratch).stack;
        stack.reserve(world.stack_bound());
        let (mut unread, count) = (Counters::default(), ALWAYS_COUNTS || counters.is_some());
        let counters = counters.unwrap_or(&mut unread);
        match count {
            true => Self::closest::<true>(world, rays, hits, stack, counters),
            false => Self::closest::<false>(world, rays, hits, stack, counters),
        }
    }

    fn occluded(
        &self,
        world: &World<V::Scalar>,
        rays: &Rays<V::Scalar>,
        out: &mut Vec<u8>,
        scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        out.clear();
        out.resize(rays.len(), 0);
        let stack = &mut V::Scalar::memory(scratch).stack;
        stack.reserve(world.stack_bound());
        let (mut unread, count) = (Counters::default(), ALWAYS_COUNTS || counters.is_some());
        let counters = counters.unwrap_or(&mut unread);
        match count {
            true => Self::any::<true>(world, (rays, 0), out, stack, counters),
            false => Self::any::<false>(world, (rays, 0), out, stack, counters),
        }
    }
}
