//! `lanecast verify`: do the fast kernels agree with the truth?

mod table;

use super::common::{CameraArgs, OutputArgs, PrecisionArg, SceneArgs, ThreadArgs};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use crate::error::{Error, Result};
use crate::measure::raysets::RayKind;
use crate::measure::timing::Workers;
use crate::measure::verify::{Line, MAX_RAYS, Options, verify};
use crate::scene::description::Description;
use crate::trace::Engines;

const EXAMPLES: &str = "\
Examples:
  lanecast verify builtin:sphere-flake
  lanecast verify model.ply --rays 100000 --kinds primary,diffuse --precision f32

Every engine answers closest-hit and any-hit queries for every ray class. Each answer is judged by an f64 \
oracle (same, explained by a rounding margin, or unexplained) and compared bit for bit with the scalar engine and with \
itself when the rays come in another order (tile, which has an arithmetic of its own, only with itself, when the same \
batches come in another order). The oracle tests every primitive; of 100000 and more, those that simple trees of its own \
leave. Rays on which tile's bits are not scalar's are a column of their own (`own`), which fails nothing: what is wrong \
among them is unexplained. The table adds up the engines; -v shows each, and so does a failure. Exit code 1 if any answer is unexplained \
or any bit differs.";

/// Arguments of `lanecast verify`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct VerifyArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Rays per class, about, if there is no --size [default: as many as take seconds]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_RAYS))]
    rays: Option<u64>,
    /// Ray classes
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "primary,shadow,ao,reflect,diffuse,scatter"
    )]
    kinds: Vec<RayKind>,
    /// Seed of the random directions
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    pass: bool,
    lines: &'a [Line],
}

/// Runs `lanecast verify`; without `--precision`, in both.
///
/// # Errors
/// Bad input; [`Error::Mismatch`] if anything is wrong; [`Error::Interrupted`] after printing what was finished.
pub fn run(args: &VerifyArgs) -> Result<()> {
    let description = args.scene.seen_by(&args.camera)?.load(&args.output)?;
    let workers = Workers::new(args.threads.count())?;
    let mut lines = Vec::new();
    let finished = match args.scene.options.precision {
        Some(PrecisionArg::F32) => one::<f32>(args, &workers, &description, &mut lines),
        Some(PrecisionArg::F64) => one::<f64>(args, &workers, &description, &mut lines),
        None => one::<f32>(args, &workers, &description, &mut lines)
            .and_then(|()| one::<f64>(args, &workers, &description, &mut lines)),
    };
    if !matches!(finished, Ok(()) | Err(Error::Interrupted)) {
        return finished;
    }
    let failed = lines.iter().filter(|line| !line.passes()).count();
    if args.output.json {
        json_to_stdout(&Report { scene: &args.scene.scene, pass: failed == 0 && finished.is_ok(), lines: &lines })?;
    } else {
        to_stdout(&table::table(&lines, args.output.verbose > 0))?;
    }
    finished?;
    if failed > 0 {
        return Err(Error::Mismatch(format!("verify: {failed} of {} lines fail", lines.len())));
    }
    Ok(())
}

fn one<S: Engines>(
    args: &VerifyArgs,
    workers: &Workers,
    description: &Description,
    lines: &mut Vec<Line>,
) -> Result<()> {
    let options = Options {
        rays: args.rays,
        size: args.camera.size,
        kinds: RayKind::each_once(&args.kinds),
        seed: args.seed,
        build: args.scene.options.build(),
    };
    let camera = |bounds, size| args.camera.ready(description, bounds, size);
    let bar = args.output.progress_bar((2 * options.kinds.len() * S::engines().len()) as u64, "verifying");
    let mut report = |line: Line| {
        bar.inc(1);
        lines.push(line);
    };
    let result = verify::<S>(workers, description, &camera, &options, &stopped, &mut report);
    bar.finish_and_clear();
    result
}
