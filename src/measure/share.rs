//! The jobs of one timed pass, shared among the threads of a pool.
//!
//! Each thread has a run of neighbouring jobs, which need the same parts of a scene, and takes from the far ends of the others' runs
//! when its own is done. The clock starts when all threads are awake: how long the system takes to wake them is not a tracer's doing.

use std::slice::IterMut;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Does every one of `jobs` once, on all threads of the pool that the caller is in; returns the seconds from the first thread's start to
/// the last one's end.
pub(crate) fn share<T: Send>(jobs: &mut [T], work: impl Fn(&mut T) + Sync) -> f64 {
    let threads = rayon::current_num_threads();
    let run = jobs.len().div_ceil(threads).max(1);
    let runs: Vec<Mutex<IterMut<'_, T>>> = jobs.chunks_mut(run).map(|run| Mutex::new(run.iter_mut())).collect();
    // Functions, so that a run is locked while a job is taken and free while it is done.
    let first = |of: usize| runs[of].lock().unwrap_or_else(PoisonError::into_inner).next();
    let last = |of: usize| runs[of].lock().unwrap_or_else(PoisonError::into_inner).next_back();
    let awake = AtomicUsize::new(0);
    let spans = rayon::broadcast(|thread| {
        awake.fetch_add(1, Ordering::AcqRel);
        while awake.load(Ordering::Acquire) < threads {
            // More threads than cores need their turns to arrive.
            std::thread::yield_now();
        }
        let start = Instant::now();
        let own = thread.index();
        if own < runs.len() {
            while let Some(job) = first(own) {
                work(job);
            }
        }
        for other in (own + 1..runs.len()).chain(0..own.min(runs.len())) {
            while let Some(job) = last(other) {
                work(job);
            }
        }
        (start, Instant::now())
    });
    let start = spans.iter().map(|span| span.0).min();
    let end = spans.iter().map(|span| span.1).max();
    start.zip(end).map_or(0.0, |(start, end)| (end - start).as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn on(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
    }

    /// Fewer jobs than threads, more, none; and more threads than cores.
    #[test]
    fn every_job_is_done_once() {
        for threads in [1, 2, 3, 40] {
            for jobs in [0, 1, 2, 7, 100] {
                let mut done = vec![0; jobs];
                let seconds = on(threads).install(|| share(&mut done, |count| *count += 1));
                assert_eq!(done, vec![1; jobs], "{threads} threads");
                assert!(seconds >= 0.0);
            }
        }
    }

    /// All the work lies at one end of the list, whichever.
    #[test]
    fn a_thread_without_work_takes_from_the_others() {
        for slow in [0..8, 24..32] {
            let by = [AtomicUsize::new(0), AtomicUsize::new(0)];
            let mut jobs: Vec<usize> = (0..32).collect();
            on(2).install(|| {
                share(&mut jobs, |job| {
                    if slow.contains(job) {
                        by[rayon::current_thread_index().unwrap()].fetch_add(1, Ordering::Relaxed);
                        std::thread::sleep(Duration::from_millis(20));
                    }
                })
            });
            let [one, other] = by.map(AtomicUsize::into_inner);
            assert!(one + other == 8 && one.min(other) >= 3, "{one} and {other}");
        }
    }

    #[test]
    fn the_clock_covers_the_longest_thread() {
        for mut jobs in [[50, 10], [10, 50]] {
            let seconds = on(2).install(|| share(&mut jobs, |&mut ms| std::thread::sleep(Duration::from_millis(ms))));
            assert!(seconds >= 0.05, "{seconds}");
        }
    }
}
