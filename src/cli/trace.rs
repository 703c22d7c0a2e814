//! `lanecast trace`: a file of rays through one engine, checked, timed, hits written.

mod stretches;

use std::borrow::Cow;
use std::path::PathBuf;

use serde::Serialize;

use super::common::{EngineArgs, OutputArgs, SceneArgs, ThreadArgs, check_ending};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use crate::error::{Error, Result};
use crate::film::{check_apart, check_file, npy};
use crate::lanes::compiled_isa;
use crate::measure::answers::Answers;
use crate::measure::raysets::{Query, split};
use crate::measure::stats::{Summary, summary};
use crate::measure::timing::{Load, Series, Tracer, Workers, interleave};
use crate::measure::truth;
use crate::ray::{Counters, Rays};
use crate::reference::Oracle;
use crate::scene::description::{Description, Precision};
use crate::scene::world::{World, WorldStats};
use crate::trace::{Engine, Engines, engine};

const EXAMPLES: &str = "\
Examples:
  lanecast trace model.ply --rays primary.npy
  lanecast trace bolt.kdl --rays primary.npy --query all --hits inside.npy
  lanecast trace model.ply --rays ao.npy --query any --engine scalar --threads 1 --json
  lanecast trace model.ply --rays primary.npy --hits hits.npy --repeat 1

RAYS are NumPy little-endian f4 of shape (N, 8): ox oy oz t_min dx dy dz t_max.
HITS are a structured array of shape (N): t (f4) in lengths of the ray's direction, infinite where nothing is hit; u \
and v (f4), on triangles the weights of the second and the third corner, on shapes and solids the number of the face, \
and 1 where a solid was subtracted, else 0; prim (u4), the number of the primitive in its object, and inst (u4), that \
of the instance, both in the order of the scene, 4294967295 where nothing is hit.
The hits are compared with the scalar engine's before the clock starts: bit for bit, or, for the engine tile, up to \
what the f64 oracle explains by rounding. That engine (and auto, where it is tile) may answer closest and any \
differently for rays that begin or end on a surface, within the rounding of t at t_min and t_max; --exact does not.";

/// Arguments of `lanecast trace`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct TraceArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// File of rays
    #[arg(long, value_name = "FILE.npy")]
    rays: PathBuf,
    /// What to ask: closest, any, or all (every stretch inside a solid; by the engines scalar or packet8)
    #[arg(long, default_value = "closest")]
    query: Asked,
    #[command(flatten)]
    engine: EngineArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Timed passes
    #[arg(long, value_name = "R", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    repeat: u32,
    /// Write the hits: t u v prim inst per ray, or one byte per ray for --query any; for --query all
    /// t_in t_out ray inst prim_in prim_out per stretch of a ray inside a solid
    #[arg(long, value_name = "FILE.npy")]
    hits: Option<PathBuf>,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    /// The nearest hit, or whether there is one.
    Hits(Query),
    /// All stretches inside solids.
    All,
}

impl std::str::FromStr for Asked {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        match word {
            "all" => Ok(Self::All),
            _ => word.parse().map(Self::Hits).map_err(|_: Error| {
                Error::Usage(format!("unknown query `{word}`; the queries are closest, any and all"))
            }),
        }
    }
}

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
    hits: u64,
    repeat: u32,
    seconds: Seconds,
    mrays_per_s: Mrays,
    build_seconds: f64,
    bytes: Bytes,
    checksum: String,
    /// What trees of solids cost, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    solids: Option<SolidCounts>,
}

/// Counts of the event sweeps, each over the number of rays.
#[derive(Serialize)]
struct SolidCounts {
    /// Trees of solids tested, one packet each.
    tests_per_ray: f64,
    /// Leaves whose boxes the packets met.
    leaves_met_per_ray: f64,
    /// Leaves left after pruning.
    leaves_kept_per_ray: f64,
    /// Boundaries of leaves, one packet each.
    events_per_ray: f64,
    /// Steps over them.
    steps_per_ray: f64,
}

impl SolidCounts {
    fn of(counters: &Counters) -> Option<Self> {
        let per_ray = |count: u64| count as f64 / counters.rays.max(1) as f64;
        (counters.solids > 0).then(|| Self {
            tests_per_ray: per_ray(counters.solids),
            leaves_met_per_ray: per_ray(counters.solid_leaves_met),
            leaves_kept_per_ray: per_ray(counters.solid_leaves_kept),
            events_per_ray: per_ray(counters.solid_events),
            steps_per_ray: per_ray(counters.solid_steps),
        })
    }
}

#[derive(Serialize)]
struct Seconds {
    min: f64,
    median: f64,
    max: f64,
}

#[derive(Serialize)]
struct Mrays {
    best: f64,
    median: f64,
}

#[derive(Serialize)]
struct Bytes {
    nodes: u64,
    primitives: u64,
    total: u64,
}

impl Bytes {
    fn of(stats: &WorldStats) -> Self {
        let (nodes, primitives) = (stats.node_bytes, stats.prim_bytes);
        Self { nodes, primitives, total: nodes + primitives }
    }
}

/// Runs `lanecast trace`.
///
/// # Errors
/// Bad input; [`Error::Mismatch`] if the engine's hits are not the `scalar` engine's; [`Error::Interrupted`].
pub fn run(args: &TraceArgs) -> Result<()> {
    if let Some(file) = &args.hits {
        check_ending("--hits", file, "npy")?;
        check_file(file)?;
        check_apart(file, &[&args.rays])?;
    }
    let description = args.scene.load(&args.output)?;
    let rays = npy::read_rays(&args.rays)?;
    match (args.query, args.scene.options.precision(&description)) {
        (Asked::Hits(query), Precision::F32) => trace::<f32>(args, query, &description, &rays),
        (Asked::Hits(query), Precision::F64) => trace::<f64>(args, query, &description, &rays),
        (Asked::All, Precision::F32) => stretches::run::<f32>(args, &description, &rays),
        (Asked::All, Precision::F64) => stretches::run::<f64>(args, &description, &rays),
    }
}

fn trace<S: Engines>(args: &TraceArgs, query: Query, description: &Description, rays: &Rays<f32>) -> Result<()> {
    let engine = args.engine.find::<S>()?;
    let workers = Workers::new(args.threads.count())?;
    let world = workers.install(|| World::<S>::compile(description, args.scene.options.build()))?;
    let batches = split::<S>(rays, workers.threads());
    let answers = checked(&workers, engine, &world, &batches, query)?;

    let mut series = [Series::new(&workers, Tracer::Engine(engine), answers)];
    interleave(&world, Load::packed(&batches), &mut series, (0, args.repeat), &stopped)?;
    let [Series { answers, seconds, .. }] = series;
    if let Some(path) = &args.hits {
        match &answers {
            Answers::Closest(batches) => npy::write_hits(path, batches)?,
            Answers::Any(batches) => npy::write_occlusion(path, batches)?,
        };
    }
    let seconds = summary(&seconds).ok_or_else(|| Error::Usage("--repeat 0: nothing to report".into()))?;
    let stats = world.stats();
    let count = rays.len() as u64;
    let report = Report {
        scene: &args.scene.scene,
        engine: engine.name(),
        query: query.name(),
        precision: S::PRECISION,
        isa: compiled_isa(),
        threads: workers.threads(),
        rays: count,
        hits: answers.hit_count(),
        repeat: args.repeat,
        mrays_per_s: Mrays { best: mrays(count, seconds.min), median: mrays(count, seconds.median) },
        seconds: Seconds { min: seconds.min, median: seconds.median, max: seconds.max },
        build_seconds: stats.build_seconds,
        bytes: Bytes::of(&stats),
        checksum: format!("{:016x}", answers.checksum()),
        solids: SolidCounts::of(&workers.count(engine, &world, &batches, query)),
    };
    if args.output.json { json_to_stdout(&report) } else { to_stdout(&text(&report, &seconds)) }
}

/// The engine's answers, which also warm caches up, once they are known to be right.
fn checked<S: Engines>(
    workers: &Workers,
    engine: &dyn Engine<S>,
    world: &World<S>,
    batches: &[Rays<S>],
    query: Query,
) -> Result<Answers<S>> {
    let mut answers = Answers::new(query, batches);
    workers.pass(engine, world, batches, &mut answers);
    if engine.name() != "scalar" {
        let mut scalar = Answers::new(query, batches);
        workers.pass(self::engine::<S>("scalar")?, world, batches, &mut scalar);
        let oracle = || Cow::Owned(Oracle::new(&world.assembly));
        let admitted = workers.install(|| truth::admit(engine, batches, &scalar, &answers, oracle));
        admitted.map_err(|why| Error::Mismatch(format!("{}: {why}", engine.name())))?;
    }
    Ok(answers)
}

/// Million rays per second; 0 for a file without rays.
fn mrays(rays: u64, seconds: f64) -> f64 {
    if seconds > 0.0 { rays as f64 / seconds / 1e6 } else { 0.0 }
}

fn text(report: &Report<'_>, seconds: &Summary) -> String {
    let share = 100.0 * report.hits as f64 / (report.rays.max(1)) as f64;
    let mib = report.bytes.total as f64 / f64::from(1 << 20);
    let solids = report.solids.as_ref().map_or(String::new(), |s| {
        format!(
            "solids   per ray {:.3} tests, {:.3} leaves met, {:.3} kept, {:.3} events, {:.3} steps (packets)\n",
            s.tests_per_ray, s.leaves_met_per_ray, s.leaves_kept_per_ray, s.events_per_ray, s.steps_per_ray
        )
    });
    format!(
        "{} {} {} {} ({}), {} threads\n\
         rays     {}, {} hit ({share:.1} %)\n\
         speed    {:.3} Mrays/s median, {:.3} best of {} (spread {:.1} %)\n\
         pass     {:.3} ms median\n\
         build    {:.3} s, {mib:.1} MiB\n\
         {solids}checksum {}\n",
        report.scene,
        report.engine,
        report.query,
        report.precision,
        report.isa,
        report.threads,
        report.rays,
        report.hits,
        report.mrays_per_s.median,
        report.mrays_per_s.best,
        report.repeat,
        100.0 * seconds.spread,
        1e3 * report.seconds.median,
        report.build_seconds,
        report.checksum
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_is_rays_over_time() {
        assert_eq!(mrays(3_000_000, 0.5), 6.0);
        assert_eq!(mrays(0, 0.0), 0.0);
    }
}
