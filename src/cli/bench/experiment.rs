//! `bench --experiment`: every case of a file, one step after the other; what is finished is never measured again.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{say_ports, write, write_whole};
use crate::bvh::LEAF_PRIMS;
use crate::camera::framing;
use crate::cli::interrupt::stopped;
use crate::cli::output::{OutputArgs, json_to_stdout};
use crate::error::{Error, Result};
use crate::measure::bench::{self, Plan};
use crate::measure::env;
use crate::measure::experiment::{Case, Experiment, parse};
use crate::measure::explain::Ports;
use crate::measure::eye::Eye;
use crate::measure::peers::Invitation;
use crate::measure::raysets::RayKind;
use crate::measure::rows::{Outcome, Row, Run};
use crate::measure::timing::Workers;
use crate::scene::description::{Description, Precision};
use crate::scene::load::{LoadOptions, check, load};
use crate::scene::world::{BuildSettings, Preset};
use crate::trace::Engines;

/// What was done: the object of `--json`.
#[derive(serde::Serialize)]
struct Report<'a> {
    run: Run,
    ports: &'a Ports,
    experiment: &'a str,
    /// Where the rows are, those of each step in CASE/CLASS/bench.csv.
    folder: &'a Path,
    steps: usize,
    /// Steps that were there already.
    finished: usize,
    /// Steps that were measured now.
    measured: usize,
    /// Rows of these with wrong hits.
    wrong: usize,
}

/// Runs the experiment in `file` into `folder` (default: one called after it).
///
/// # Errors
/// A file that is no experiment; a folder of another one; scenes that cannot be opened; [`Error::Mismatch`] if an engine is
/// wrong; [`Error::Interrupted`] (then, and after a kill, the same command goes on where it was).
pub fn run(file: &Path, folder: Option<&Path>, embree: Option<&Path>, output: &OutputArgs) -> Result<()> {
    let text = std::fs::read(file).map_err(|e| Error::io(file, e))?;
    let experiment = parse(file, &text)?;
    let folder = folder.map_or_else(|| PathBuf::from(format!("experiment-{}", experiment.name)), Path::to_path_buf);
    experiment.cases.iter().try_for_each(|case| check(&scene_of(case, file), &options(case)))?;
    claim(&folder, &text)?;
    output.say(&format!("{}: {}", experiment.name, experiment.question));
    let ports = Workers::new(1)?.install(Ports::measure);
    say_ports(&ports, output);
    let left = |case: &Case| -> Vec<RayKind> {
        let there = |kind: &RayKind| place(&folder, case, *kind).join("bench.csv").exists();
        experiment.rays.iter().copied().filter(|kind| !there(kind)).collect()
    };
    let steps = experiment.cases.len() * experiment.rays.len();
    let mut report = Report {
        run: Run::now(experiment.cases.iter().map(|case| case.threads as usize).max().unwrap_or(0)),
        ports: &ports,
        experiment: &experiment.name,
        folder: &folder,
        steps,
        finished: steps - experiment.cases.iter().map(|case| left(case).len()).sum::<usize>(),
        measured: 0,
        wrong: 0,
    };
    if report.finished > 0 {
        output.say(&format!("{} of {steps} steps are finished already", report.finished));
    }
    let begun = Instant::now();
    let ended = cases(&experiment, &left, (file, embree), &mut report, output);
    if output.json {
        json_to_stdout(&report)?;
    }
    ended?;
    let Report { measured, wrong, .. } = report;
    output.say(&format!("{measured} steps in {}; now: lanecast report {}", seconds(begun.elapsed()), folder.display()));
    if wrong > 0 {
        return Err(Error::Mismatch(format!("bench: {wrong} rows have wrong hits")));
    }
    Ok(())
}

/// All cases, each with the classes of rays that are `left` of it.
fn cases(
    experiment: &Experiment,
    left: &dyn Fn(&Case) -> Vec<RayKind>,
    (file, embree): (&Path, Option<&Path>),
    report: &mut Report<'_>,
    output: &OutputArgs,
) -> Result<()> {
    let bar = output.progress_bar(report.steps as u64, "measuring");
    bar.inc(report.finished as u64);
    // The bar's estimate must not count what an earlier run did.
    bar.reset_eta();
    let begun = Instant::now();
    // Many cases are of one scene.
    let mut said = HashSet::new();
    for case in &experiment.cases {
        let left = left(case);
        if left.is_empty() {
            continue;
        }
        let scene = scene_of(case, file);
        // A step begins where the one before ended.
        let (threads, ports) = (case.threads as usize, report.ports);
        let begins = || (Run::now(threads), env::facts(threads, ports));
        let mut at_begin = begins();
        let mut step = |class: RayKind, rows: Vec<Row>| -> Result<()> {
            let (run, facts) = std::mem::replace(&mut at_begin, begins());
            let run = Run { command: case.command_on(&scene, class, embree), ..run };
            write(&place(report.folder, case, class), &run, &rows, &facts)?;
            report.wrong += rows.iter().filter(|row| matches!(row.outcome, Outcome::Wrong(_))).count();
            report.measured += 1;
            bar.inc(1);
            if report.measured == 1 {
                let (rest, first) = ((report.steps - report.finished - 1) as u32, begun.elapsed());
                output.say(&format!(
                    "the first step took {}; {rest} to go, about {}",
                    seconds(first),
                    seconds(rest * first)
                ));
            }
            Ok(())
        };
        let result = load(&scene, &options(case)).and_then(|description| {
            output.warn(description.warnings.iter().filter(|&warning| said.insert(warning.clone())));
            measure(case, &description, &left, embree, &mut step)
        });
        if result.is_err() {
            bar.finish_and_clear();
            return result;
        }
    }
    bar.finish_and_clear();
    Ok(())
}

fn seconds(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}

/// The folder of one step.
fn place(folder: &Path, case: &Case, class: RayKind) -> PathBuf {
    folder.join(case.label()).join(class.name())
}

/// Makes sure that `folder` is new or holds this very experiment.
fn claim(folder: &Path, text: &[u8]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let copy = folder.join("experiment.kdl");
    match std::fs::read(&copy) {
        Ok(old) if old == text => Ok(()),
        Ok(_) => {
            Err(Error::Usage(format!("{} holds another experiment; give another folder with -o", folder.display())))
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => write_whole(&copy, text),
        Err(e) => Err(Error::io(copy, e)),
    }
}

/// Where the scene of a case in the experiment `file` is.
fn scene_of(case: &Case, file: &Path) -> String {
    let beside = file.parent().unwrap_or(Path::new("")).join(&case.scene);
    if beside.is_file() { beside.to_string_lossy().into_owned() } else { case.scene.clone() }
}

/// How the scene of a case is opened.
fn options(case: &Case) -> LoadOptions {
    LoadOptions { set: case.set.clone(), ..Default::default() }
}

/// Takes all rows of one class of rays.
type Step<'a> = dyn FnMut(RayKind, Vec<Row>) -> Result<()> + 'a;

fn measure(
    case: &Case,
    description: &Description,
    kinds: &[RayKind],
    embree: Option<&Path>,
    step: &mut Step<'_>,
) -> Result<()> {
    let workers = Workers::new(case.threads as usize)?.flushing(!case.peers.is_empty());
    let preset = match case.preset.as_str() {
        "fast" => Preset::Fast,
        "best" => Preset::Best,
        _ => Preset::Balanced,
    };
    let plan = Plan {
        kinds: kinds.to_vec(),
        engines: case.engines.clone(),
        size: case.size,
        repeat: case.repeat,
        seed: case.seed,
        build: BuildSettings { leaf: case.leaf.map_or(LEAF_PRIMS, usize::from), ..preset.into() },
        peers: Invitation { names: case.peers.clone(), embree: embree.map(Path::to_path_buf) },
    };
    let f64_asked = match case.precision.as_str() {
        "" => description.precision == Some(Precision::F64),
        word => word == "f64",
    };
    if f64_asked {
        one::<f64>(&workers, description, &plan, step)
    } else {
        one::<f32>(&workers, description, &plan, step)
    }
}

fn one<S: Engines>(workers: &Workers, description: &Description, plan: &Plan, step: &mut Step<'_>) -> Result<()> {
    let camera = |bounds, size: (u32, u32)| {
        let framed = || framing(bounds, f64::from(size.0) / f64::from(size.1));
        Eye::new(&description.cameras.first().cloned().unwrap_or_else(framed), size)
    };
    bench::classes::<S>(workers, description, &camera, plan, &stopped, step)
}
