//! The clock: passes of an engine over batches of rays that are already packed in memory.
//!
//! A pass covers traversal and the writing of hits to memory, nothing else: files are read, trees built, rays packed
//! and answers allocated before. Each thread has its share of the batches and its own [`Scratch`], helps the others when
//! it is done, is pinned to one core where the system allows it, and is awake before the clock starts.
//!
//! Peers run on the same threads by the same rule. Their rays are packed anew before each pass, outside the clock.
//!
//! Rays that a camera makes are another matter: there the clock covers making and, for peers, packing them too, a batch at
//! a time.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::lanes::{FlushDenormals, Real};
use crate::measure::answers::Answers;
use crate::measure::peers::Peer;
use crate::measure::raysets::Query;
use crate::measure::share::share;
use crate::ray::{Counters, Hits, Pencil, Rays};
use crate::scene::world::World;
use crate::trace::{Engine, Scratch};

/// Largest number of threads that may be asked for.
pub const MAX_THREADS: usize = 1024;

/// Pinned threads with their working memory; reused for all passes of a run.
pub struct Workers {
    pool: rayon::ThreadPool,
    scratches: Vec<Mutex<Scratch>>,
    flushing: bool,
    fewer: Vec<Workers>,
}

impl Workers {
    /// `threads` workers; 0 means one per core.
    ///
    /// # Errors
    /// A usage error for more than [`MAX_THREADS`] or if the system refuses the threads.
    pub fn new(threads: usize) -> Result<Self> {
        if threads > MAX_THREADS {
            return Err(Error::Usage(format!("--threads {threads}: at most {MAX_THREADS}")));
        }
        let cores = core_affinity::get_core_ids().unwrap_or_default();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("tracer {i}"))
            .start_handler(move |i| {
                if !cores.is_empty() {
                    // A system that refuses gives noisier figures, not wrong ones.
                    let _pinned = core_affinity::set_for_current(cores[i % cores.len()]);
                }
            })
            .build()
            .map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))?;
        let scratches = (0..pool.current_num_threads()).map(|_| Mutex::default()).collect();
        Ok(Self { pool, scratches, flushing: false, fewer: Vec::new() })
    }

    /// Whether denormal numbers count as zero during passes, of engines and peers alike: what peers ask for.
    #[must_use]
    pub fn flushing(mut self, on: bool) -> Self {
        self.flushing = on;
        self
    }

    /// With teams of 1, 2, 4, ... of these threads' cores beside them, to see what each thread adds.
    ///
    /// # Errors
    /// A usage error if the system refuses the threads.
    pub fn with_fewer(mut self) -> Result<Self> {
        let counts = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|&n| n < self.threads());
        self.fewer = counts.map(|n| Ok(Self::new(n)?.flushing(self.flushing))).collect::<Result<_>>()?;
        Ok(self)
    }

    /// See [`Workers::with_fewer`].
    pub fn fewer(&self) -> &[Self] {
        &self.fewer
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.scratches.len()
    }

    /// Runs `work` on these threads (building a world, making ray sets).
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }

    /// One timed pass over all `batches`; returns seconds. `answers` must come from [`Answers::new`] with the same
    /// batches, so that nothing is allocated under the clock.
    pub fn pass<S: Real>(
        &self,
        engine: &dyn Engine<S>,
        world: &World<S>,
        batches: &[Rays<S>],
        answers: &mut Answers<S>,
    ) -> f64 {
        self.pool.install(|| match answers {
            Answers::Closest(out) => self.timed(jobs(batches, out), |(rays, hits), scratch| {
                engine.intersect(world, rays, hits, scratch, None);
            }),
            Answers::Any(out) => self.timed(jobs(batches, out), |(rays, flags), scratch| {
                engine.occluded(world, rays, flags, scratch, None);
            }),
        })
    }

    /// One timed pass of a peer, with rays packed before and primitives renamed after the clock; see
    /// [`Workers::pass`].
    pub fn peer_pass<S: Real>(&self, peer: &dyn Peer<S>, batches: &[Rays<S>], answers: &mut Answers<S>) -> f64 {
        self.pool.install(|| match answers {
            Answers::Closest(out) => {
                let pack = |(rays, hits)| (peer.pack(rays, Query::Closest), hits);
                let packed = batches.par_iter().zip(&mut *out).map(pack).collect();
                let seconds = self.timed(packed, |(packed, hits): &mut (_, &mut _), _| packed.intersect(hits));
                out.par_iter_mut().for_each(|hits| peer.rename(hits));
                seconds
            }
            Answers::Any(out) => {
                let pack = |(rays, flags)| (peer.pack(rays, Query::Any), flags);
                let packed = batches.par_iter().zip(out).map(pack).collect();
                self.timed(packed, |(packed, flags): &mut (_, &mut _), _| packed.occluded(flags))
            }
        })
    }

    /// One timed pass over batches that `maker` makes under the clock: closest hits into `out`, one per batch.
    fn made_pass<S: Real>(
        &self,
        tracer: Tracer<'_, S>,
        world: &World<S>,
        maker: &Maker<'_, S>,
        out: &mut [Hits<S>],
    ) -> f64 {
        let memory: Vec<Mutex<(Pencil, Rays<S>)>> = self.scratches.iter().map(|_| Mutex::default()).collect();
        let jobs = out.iter_mut().enumerate().collect();
        let seconds = self.pool.install(|| {
            self.timed(jobs, |(number, hits): &mut (usize, &mut Hits<S>), scratch| {
                let thread = rayon::current_thread_index().unwrap_or(0);
                let mut memory = memory[thread].lock().unwrap_or_else(PoisonError::into_inner);
                let (pencil, rays) = &mut *memory;
                if maker(*number, pencil, rays) == Made::Pencil {
                    if let Tracer::Engine(engine) = tracer
                        && engine.intersect_pencil(world, pencil, hits, scratch, None)
                    {
                        return;
                    }
                    pencil.fill(rays);
                }
                match tracer {
                    Tracer::Engine(engine) => engine.intersect(world, rays, hits, scratch, None),
                    Tracer::Peer(peer) => peer.pack(rays, Query::Closest).intersect(hits),
                }
            })
        });
        if let Tracer::Peer(peer) = tracer {
            out.iter_mut().for_each(|hits| peer.rename(hits));
        }
        seconds
    }

    /// Seconds of doing all `jobs`, each with the scratch of the thread that takes it.
    fn timed<T: Send>(&self, mut jobs: Vec<T>, work: impl Fn(&mut T, &mut Scratch) + Sync) -> f64 {
        share(&mut jobs, |job| {
            let _flushed = self.flushing.then(FlushDenormals::new);
            let thread = rayon::current_thread_index().unwrap_or(0);
            // Only this thread ever takes this lock, so it is free: about 20 ns per batch.
            let mut scratch = self.scratches[thread].lock().unwrap_or_else(PoisonError::into_inner);
            work(job, &mut scratch);
        })
    }

    /// One untimed pass of the counting build of the engine.
    pub fn count<S: Real>(
        &self,
        engine: &dyn Engine<S>,
        world: &World<S>,
        batches: &[Rays<S>],
        query: Query,
    ) -> Counters {
        let mut counters = Counters::default();
        let (mut scratch, mut hits, mut flags) = (Scratch::default(), Hits::new(0), Vec::new());
        for rays in batches {
            match query {
                Query::Closest => engine.intersect(world, rays, &mut hits, &mut scratch, Some(&mut counters)),
                Query::Any => engine.occluded(world, rays, &mut flags, &mut scratch, Some(&mut counters)),
            }
        }
        counters
    }
}

/// What a [`Maker`] made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Made {
    /// Where rays go.
    Pencil,
    /// The rays.
    Rays,
}

/// Makes the rays of the batch of that number, in one of two forms, in memory that is used again and again.
pub type Maker<'a, S> = dyn Fn(usize, &mut Pencil, &mut Rays<S>) -> Made + Sync + 'a;

/// What is traced under the clock.
#[derive(Clone, Copy)]
pub struct Load<'a, S> {
    /// The rays.
    pub batches: &'a [Rays<S>],
    /// Makes them anew, if that is to be timed too.
    pub maker: Option<&'a Maker<'a, S>>,
}

impl<'a, S> Load<'a, S> {
    /// Rays that are packed in memory.
    pub fn packed(batches: &'a [Rays<S>]) -> Self {
        Self { batches, maker: None }
    }
}

/// Every batch with its output slot.
fn jobs<'a, S, O>(batches: &'a [Rays<S>], out: &'a mut [O]) -> Vec<(&'a Rays<S>, &'a mut O)> {
    batches.iter().zip(out).collect()
}

/// Who is timed.
#[derive(Clone, Copy)]
pub enum Tracer<'a, S> {
    /// One of our engines.
    Engine(&'a dyn Engine<S>),
    /// Another tracer.
    Peer(&'a dyn Peer<S>),
}

impl<S: Real> Tracer<'_, S> {
    /// One timed pass, see [`Workers::pass`].
    pub fn pass(self, workers: &Workers, world: &World<S>, load: Load<'_, S>, answers: &mut Answers<S>) -> f64 {
        let Load { batches, maker } = load;
        match (self, maker, answers) {
            (_, Some(maker), Answers::Closest(out)) => workers.made_pass(self, world, maker, out),
            (Self::Engine(engine), _, answers) => workers.pass(engine, world, batches, answers),
            (Self::Peer(peer), _, answers) => workers.peer_pass(peer, batches, answers),
        }
    }
}

/// One tracer on one list of batches, with what its passes took.
pub struct Series<'a, S> {
    /// On which threads.
    pub workers: &'a Workers,
    /// Who traces.
    pub tracer: Tracer<'a, S>,
    /// Answers of the last pass.
    pub answers: Answers<S>,
    /// Seconds of each timed pass, in the order they ran.
    pub seconds: Vec<f64>,
}

impl<'a, S: Real> Series<'a, S> {
    /// A series without passes, holding the answers that were checked.
    pub fn new(workers: &'a Workers, tracer: Tracer<'a, S>, answers: Answers<S>) -> Self {
        Self { workers, tracer, answers, seconds: Vec::new() }
    }
}

/// Times all `series` interleaved (A B C, A B C, ...): `warm_up` rounds that are thrown away, then `repeat` rounds.
/// A disturbance of the machine then falls on all alike. `stop` is asked before every pass.
///
/// # Errors
/// [`Error::Interrupted`] when `stop` says so.
pub fn interleave<S: Real>(
    world: &World<S>,
    load: Load<'_, S>,
    series: &mut [Series<'_, S>],
    (warm_up, repeat): (u32, u32),
    stop: &dyn Fn() -> bool,
) -> Result<()> {
    for round in 0..warm_up + repeat {
        for one in series.iter_mut() {
            if stop() {
                return Err(Error::Interrupted);
            }
            let seconds = one.tracer.pass(one.workers, world, load, &mut one.answers);
            if round >= warm_up {
                one.seconds.push(seconds);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::testing::{Slab, empty_world, falling_rays};
    use std::sync::atomic::{AtomicU32, Ordering};

    /// 1, 2 and 3 threads fill every slot with the same bits; the heights make each answer different.
    #[test]
    fn passes_fill_every_slot_whatever_the_number_of_threads() {
        let (world, batches) = (empty_world::<f32>(), falling_rays::<f32>(&[100, 1, 0, 37, 16]));
        let mut want = None;
        for threads in 1..=3 {
            let workers = Workers::new(threads).unwrap();
            assert_eq!(workers.threads(), threads);
            let mut answers = Answers::new(Query::Closest, &batches);
            assert!(workers.pass(&Slab::default(), &world, &batches, &mut answers) >= 0.0);
            assert_eq!(answers.hit_count(), 154);
            let sum = answers.checksum();
            assert_eq!(*want.get_or_insert(sum), sum);
            let mut any = Answers::new(Query::Any, &batches);
            workers.pass(&Slab::default(), &world, &batches, &mut any);
            assert_eq!(any.hit_count(), 154);
        }
    }

    #[test]
    fn rounds_are_interleaved_and_warm_ups_are_not_counted() {
        let (world, batches) = (empty_world::<f64>(), falling_rays::<f64>(&[16]));
        let order = Mutex::new(String::new());
        let engines = [Slab::named("A", &order), Slab::named("B", &order)];
        let workers = Workers::new(1).unwrap();
        let empty = Answers::new(Query::Closest, &batches);
        let of = engines.iter().map(|e| Series::new(&workers, Tracer::Engine(e), empty.clone()));
        let mut series: Vec<_> = of.collect();
        interleave(&world, Load::packed(&batches), &mut series, (1, 3), &|| false).unwrap();
        assert_eq!(series.iter().map(|s| s.seconds.len()).collect::<Vec<_>>(), [3, 3]);
        drop(series);
        assert_eq!(order.lock().unwrap().as_str(), "ABABABAB");
    }

    #[test]
    fn stops_before_the_next_pass() {
        let (world, batches) = (empty_world::<f64>(), falling_rays::<f64>(&[16]));
        let (engine, workers) = (Slab::default(), Workers::new(1).unwrap());
        let mut series = [Series::new(&workers, Tracer::Engine(&engine), Answers::new(Query::Any, &batches))];
        let asked = AtomicU32::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) == 2;
        let result = interleave(&world, Load::packed(&batches), &mut series, (0, 10), &stop);
        assert!(matches!(result, Err(Error::Interrupted)));
        assert_eq!(series[0].seconds.len(), 2);
    }

    #[test]
    fn counting_adds_up_over_batches() {
        let (world, batches) = (empty_world::<f32>(), falling_rays::<f32>(&[100, 7]));
        let workers = Workers::new(1).unwrap();
        assert_eq!(workers.count(&Slab::default(), &world, &batches, Query::Closest).rays, 107);
        assert_eq!(workers.count(&Slab::default(), &world, &batches, Query::Any).rays, 107);
    }

    #[test]
    fn teams_of_fewer_threads_are_powers_of_two() {
        for (threads, fewer) in [(1, vec![]), (2, vec![1]), (3, vec![1, 2]), (4, vec![1, 2]), (5, vec![1, 2, 4])] {
            let workers = Workers::new(threads).unwrap().flushing(true).with_fewer().unwrap();
            assert_eq!(workers.fewer().iter().map(Workers::threads).collect::<Vec<_>>(), fewer);
            assert!(workers.fewer().iter().all(|team| team.flushing));
        }
    }

    #[test]
    fn absurd_thread_counts_are_refused() {
        assert!(Workers::new(MAX_THREADS + 1).is_err());
    }
}
