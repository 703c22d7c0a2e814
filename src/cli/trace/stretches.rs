//! `lanecast trace --query all`: every stretch of the rays inside a solid.

use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use super::super::interrupt::stopped;
use super::super::output::{json_to_stdout, to_stdout};
use super::{Bytes, Mrays, Seconds, TraceArgs, mrays};
use crate::error::{Error, Result};
use crate::film::npy;
use crate::lanes::{Real, compiled_isa};
use crate::measure::answers::checksum;
use crate::measure::raysets::split;
use crate::measure::stats::summary;
use crate::measure::timing::Workers;
use crate::ray::Rays;
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::trace::{Engines, Scratch, Stretch, stretches};

/// Engines that find stretches.
const ONE_BY_ONE: &str = "scalar";
const PACKETS: &str = "packet8";

/// The object of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    scene: &'a str,
    engine: &'static str,
    query: &'static str,
    precision: &'static str,
    isa: &'static str,
    threads: usize,
    rays: u64,
    /// Rays that have a stretch.
    hits: u64,
    stretches: u64,
    /// Sum of all stretches' lengths in t, of those that end.
    inside: f64,
    repeat: u32,
    seconds: Seconds,
    mrays_per_s: Mrays,
    build_seconds: f64,
    bytes: Bytes,
    /// Of the stretches, as a file of them has them.
    checksum: String,
}

/// Traces, times and writes.
///
/// # Errors
/// Bad input, [`Error::Mismatch`] if rays one by one give other stretches, [`Error::Interrupted`].
pub fn run<S: Engines>(args: &TraceArgs, description: &Description, rays: &Rays<f32>) -> Result<()> {
    let engine = args.engine.find::<S>()?.name();
    // What the default stands for has an answer of its own here: packets of eight.
    if !args.engine.is_default() && ![ONE_BY_ONE, PACKETS].contains(&engine) {
        let what = format!("--engine {engine}: --query all is answered by {ONE_BY_ONE} or, as now, by {PACKETS}");
        args.output.warn([&what]);
    }
    let scalar = args.engine.find::<S>()?.lanes() == 1;
    let workers = Workers::new(args.threads.count())?;
    let world = workers.install(|| World::<S>::compile(description, args.scene.options.build()))?;
    let batches = split::<S>(rays, workers.threads());
    let pass = |scalar: bool| workers.install(|| all(&world, &batches, scalar));
    let found = pass(scalar);
    if !scalar && pass(true) != found {
        return Err(Error::Mismatch("the stretches of packets differ from those of rays one by one".into()));
    }
    let mut seconds = Vec::new();
    for _ in 0..args.repeat {
        if stopped() {
            return Err(Error::Interrupted);
        }
        let start = Instant::now();
        std::hint::black_box(pass(scalar));
        seconds.push(start.elapsed().as_secs_f64());
    }
    if let Some(path) = &args.hits {
        npy::write_stretches(path, &found)?;
    }
    let seconds = summary(&seconds).ok_or_else(|| Error::Usage("--repeat 0: nothing to report".into()))?;
    let (stats, count) = (world.stats(), rays.len() as u64);
    let report = Report {
        scene: &args.scene.scene,
        engine: if scalar { ONE_BY_ONE } else { PACKETS },
        query: "all",
        precision: S::PRECISION,
        isa: compiled_isa(),
        threads: workers.threads(),
        rays: count,
        // They are in order of rays.
        hits: found.chunk_by(|a, b| a.ray == b.ray).count() as u64,
        stretches: found.len() as u64,
        // The sum of nothing is -0 to `sum`.
        inside: found
            .iter()
            .map(|s| s.t_out - s.t_in)
            .filter(|length| length.is_finite())
            .fold(0.0, |all, one| all + one),
        repeat: args.repeat,
        mrays_per_s: Mrays { best: mrays(count, seconds.min), median: mrays(count, seconds.median) },
        seconds: Seconds { min: seconds.min, median: seconds.median, max: seconds.max },
        build_seconds: stats.build_seconds,
        bytes: Bytes::of(&stats),
        checksum: format!("{:016x}", checksum(found.iter().flat_map(npy::stretch_record))),
    };
    if args.output.json { json_to_stdout(&report) } else { to_stdout(&text(&report)) }
}

/// The stretches of all batches, rays numbered through them.
fn all<S: Engines>(world: &World<S>, batches: &[Rays<S>], scalar: bool) -> Vec<Stretch> {
    let mut firsts = Vec::with_capacity(batches.len());
    let mut count = 0;
    for batch in batches {
        firsts.push(count);
        count += batch.len() as u32;
    }
    let lists: Vec<Vec<Stretch>> = batches
        .par_iter()
        .zip(&firsts)
        .map_init(Scratch::default, |scratch, (rays, first)| {
            let mut list = match scalar {
                true => stretches::<S>(world, rays, scratch),
                false => stretches::<<S as Real>::Octo>(world, rays, scratch),
            };
            list.iter_mut().for_each(|s| s.ray += first);
            list
        })
        .collect();
    lists.concat()
}

fn text(report: &Report<'_>) -> String {
    format!(
        "{} {} all {} ({}), {} threads\n\
         rays      {}\n\
         stretches {}, length {:.6e}, in {} rays\n\
         speed     {:.3} Mrays/s median of {}\n\
         build     {:.3} s\n\
         checksum  {}\n",
        report.scene,
        report.engine,
        report.precision,
        report.isa,
        report.threads,
        report.rays,
        report.stretches,
        report.inside,
        report.hits,
        report.mrays_per_s.median,
        report.repeat,
        report.build_seconds,
        report.checksum,
    )
}
