//! `lanecast bench`: engines x ray classes x scenes, as a table, as rows, as JSON.

mod against;
mod experiment;

use std::io::Write;
use std::path::{Path, PathBuf};

use super::common::{CameraArgs, OutputArgs, SceneArgs, SceneOptions, ThreadArgs};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use super::render::{self, RenderArgs};
use crate::error::{Error, Result};
use crate::film::{check_apart, check_folder, write_atomically};
use crate::measure::bench::{self, Plan};
use crate::measure::compare::{self, Change, Comparison};
use crate::measure::env;
use crate::measure::explain::Ports;
use crate::measure::history;
use crate::measure::peers::Invitation;
use crate::measure::raysets::RayKind;
use crate::measure::rows::{self, LEGEND, Outcome, Row, Run};
use crate::measure::scaling;
use crate::measure::timing::Workers;
use crate::scene::description::{Description, Precision};
use crate::trace::Engines;

/// Scenes of a bench that is not told one.
const DEFAULT_SCENES: [&str; 3] = ["builtin:cornell", "builtin:sphere-flake", "builtin:terrain"];

/// Picture of a bench unless `--size` says otherwise.
const DEFAULT_SIZE: (u32, u32) = (384, 224);

const EXAMPLES: &str = "\
Examples:
  lanecast bench
  lanecast bench model.ply --rays primary,ao --engines scalar,packet16 --threads 1
  lanecast bench model.ply --rays primary,diffuse --engines auto --threads 16 --scaling
  lanecast bench model.ply --size 1024x576 --eye 0,1,5 --look-at 0,1,0 -o results
  lanecast bench model.ply --peers obvhs,embree --embree libembree4.so.4 --threads 1
  lanecast bench model.ply --against ../old/lanecast --turns 8 --engines scalar,tile
  lanecast bench --compare results/before results/after
  lanecast bench --experiment scenes/experiments/widths.kdl -o out/widths
  lanecast bench model.ply --record results

Before the clock starts, every engine's hits are compared bit for bit with the scalar engine's (those of tile, which \
has an arithmetic of its own, up to rounding, and the f64 oracle must explain the others), and a sample of those \
with the oracle; a wrong engine gets no figure and the exit code is 1. Engines take turns (A B C, A B C, ...) so \
that a disturbance of the machine falls on all alike. The clock covers traversal of packed rays and the writing of \
hits, nothing else. Peers take their turns in the same run; their hits may differ from ours by rounding, but one ray \
in 10000 at most may differ for another reason; or four in 1000, if the oracle explains our answer to each of them and \
the peer's to all but one in 10000.";

/// Arguments of `lanecast bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// Scenes: files or builtin:NAME [default: small built-in scenes]
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
    #[command(flatten)]
    options: SceneOptions,
    /// Ray classes: primary, camera (the same, made under the clock), shadow, ao, reflect, diffuse, diffuse2, diffuse3,
    /// scatter
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "primary,shadow,ao,reflect,diffuse")]
    rays: Vec<RayKind>,
    /// Engines by name [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    engines: Vec<String>,
    /// Other tracers to run beside them, on the same rays and threads: obvhs, embree, embree-robust, and with the cargo
    /// feature `peers` bvh, parry; tinybvh is in no build, and its rows say so
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Peers")]
    peers: Vec<String>,
    /// Embree 4's shared library [default: $LANECAST_EMBREE, else the usual names on the library path]
    #[arg(long, value_name = "PATH", help_heading = "Peers")]
    embree: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Run engines on 1, 2, 4, ... threads up to --threads in the same rounds, and say what each thread adds
    #[arg(long, conflicts_with_all = ["compare", "experiment", "against"])]
    scaling: bool,
    /// Timed rounds
    #[arg(long, value_name = "R", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    repeat: u32,
    /// Seed of the random directions
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Show what moved between two runs: folders that -o wrote, their bench.csv files, or folders of such folders (turns);
    /// nothing is measured
    #[arg(
        long,
        value_names = ["OLD", "NEW"],
        num_args = 2,
        conflicts_with_all = [
            "scenes", "SceneOptions", "rays", "engines", "peers", "embree", "CameraArgs", "ThreadArgs", "repeat", "seed",
            "turns", "folder"
        ]
    )]
    compare: Vec<PathBuf>,
    /// Measure what a file asks for (docs/EXPERIMENTS.md; scenes/experiments has some); the same command goes on where it was
    #[arg(
        long,
        value_name = "FILE.kdl",
        conflicts_with_all = [
            "scenes", "SceneOptions", "rays", "engines", "peers", "CameraArgs", "ThreadArgs", "repeat", "seed",
            "turns", "compare", "against", "record"
        ]
    )]
    experiment: Option<PathBuf>,
    /// Take turns with another lanecast (old, new, old, new, ...) and show what moved: the surest comparison
    #[arg(long, value_name = "PROGRAM", conflicts_with_all = ["compare", "record"])]
    against: Option<PathBuf>,
    /// Turns of each program with --against
    #[arg(
        long,
        value_name = "N",
        default_value_t = 6,
        requires = "against",
        value_parser = clap::value_parser!(u32).range(3..=1000)
    )]
    turns: u32,
    /// Keep the rows for good, in DIR/CPU/DATE-REVISION/SCENE; refused for a build whose sources no revision names
    #[arg(long, value_name = "DIR", conflicts_with = "compare")]
    record: Option<PathBuf>,
    /// Let --record keep rows of such a build; they are marked
    #[arg(long, requires = "record")]
    dirty: bool,
    /// Folder for bench.csv (one row per figure), bench.env.txt (machine and build) and a picture of each scene
    /// (NAME.exr: colours, depth, normals, ids, node visits; the second scene of a name is NAME-2, in the rows, too)
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

impl BenchArgs {
    /// Checks that the library that is given has a peer to run.
    fn check_embree(&self) -> Result<()> {
        let is_used = self.peers.iter().any(|name| name.starts_with("embree"));
        if self.embree.is_some() && !is_used {
            return Err(Error::Usage("--embree: expected embree or embree-robust among --peers".into()));
        }
        Ok(())
    }

    fn invitation(&self) -> Invitation {
        Invitation { names: self.peers.clone(), embree: self.embree.clone() }
    }
}

#[derive(serde::Serialize)]
struct Report<'a> {
    run: &'a Run,
    ports: &'a Ports,
    rows: &'a [Row],
}

/// Runs `lanecast bench`.
///
/// # Errors
/// Bad input; [`Error::Mismatch`] if an engine is wrong; [`Error::Interrupted`]. What was measured before any of them
/// is printed and written.
pub fn run(args: &BenchArgs) -> Result<()> {
    if let [old, new] = &args.compare[..] {
        return tell(compare::compare(&compare::read(old)?, &compare::read(new)?), &args.output);
    }
    if let Some(file) = &args.experiment {
        return experiment::run(file, args.folder.as_deref(), args.embree.as_deref(), &args.output);
    }
    args.check_embree()?;
    args.folder.iter().chain(&args.record).try_for_each(|folder| check_folder(folder))?;
    if let Some(other) = &args.against {
        let (_dropped_at_the_end, temporary) = against::temporary()?;
        let changes = against::run(other, args.turns, args.folder.as_ref().unwrap_or(&temporary), &args.output)?;
        return tell(changes, &args.output);
    }
    if args.record.is_some() {
        history::check_revision(env::REVISION, args.dirty)?;
    }
    args.invitation().check()?;
    args.folder.iter().try_for_each(|dir| check_pictures(args, dir))?;
    // Peers ask for it, and then our engines get it too.
    let mut workers = Workers::new(args.threads.count())?.flushing(!args.peers.is_empty());
    if args.scaling {
        workers = workers.with_fewer()?;
        if workers.fewer().is_empty() {
            return Err(Error::Usage("--scaling compares numbers of threads: expected --threads 2 or more".into()));
        }
    }
    let run = Run::now(workers.threads());
    let ports = workers.install(Ports::measure);
    let facts = env::facts(workers.threads(), &ports);
    let mut rows = Vec::new();
    let finished = measure(args, &workers, &mut rows);
    if !rows.is_empty() {
        say_ports(&ports, &args.output);
    }
    if args.output.json {
        json_to_stdout(&Report { run: &run, ports: &ports, rows: &rows })?;
    } else if !rows.is_empty() {
        let all = rows.iter().filter(|row| row.threads == workers.threads()).cloned().collect::<Vec<_>>();
        to_stdout(&format!("{}{LEGEND}{}", rows::table(&all), scaling::table(&rows)))?;
    }
    if let (Some(dir), false) = (&args.folder, rows.is_empty()) {
        write(dir, &run, &rows, &facts)?;
        args.output.say(&format!("rows: {}", dir.join("bench.csv").display()));
    }
    if let Some(root) = &args.record {
        for rows in rows.chunk_by(|a, b| a.scene.hash == b.scene.hash) {
            let dir = history::folder(root, &run, &rows[0].scene.name)?;
            write(&dir, &run, rows, &facts)?;
            args.output.say(&format!("rows: {}", dir.join("bench.csv").display()));
        }
    }
    finished?;
    if let Some(dir) = &args.folder {
        pictures(args, dir)?;
    }
    let wrong = rows.iter().filter(|row| matches!(row.outcome, Outcome::Wrong(_))).count();
    if wrong > 0 {
        return Err(Error::Mismatch(format!("bench: {wrong} of {} rows have wrong hits", rows.len())));
    }
    Ok(())
}

/// Says what moved.
fn tell(changes: Vec<Change>, output: &OutputArgs) -> Result<()> {
    let comparison = Comparison::of(changes)?;
    if output.json { json_to_stdout(&comparison) } else { to_stdout(&compare::table(&comparison)) }
}

/// Says what a core does in a cycle.
fn say_ports(ports: &Ports, output: &OutputArgs) {
    output.say(&format!("ports: {}", ports.words()));
}

/// All scenes; finished rows are in `rows` also when a later scene fails.
fn measure(args: &BenchArgs, workers: &Workers, rows: &mut Vec<Row>) -> Result<()> {
    let scenes = scenes(args);
    let classes = RayKind::each_once(&args.rays).len();
    let bar = args.output.progress_bar((scenes.len() * classes) as u64, "measuring");
    let mut names = Vec::new();
    for scene in &scenes {
        let mut description = args.options.seen_by(scene, &args.camera)?.load(scene, &args.output)?;
        description.name = unlike(&description.name, &mut names);
        let result = match args.options.precision(&description) {
            Precision::F32 => one::<f32>(args, workers, &description, &bar, rows),
            Precision::F64 => one::<f64>(args, workers, &description, &bar, rows),
        };
        if result.is_err() {
            bar.finish_and_clear();
            return result;
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// The scenes to measure.
fn scenes(args: &BenchArgs) -> Vec<String> {
    if args.scenes.is_empty() { DEFAULT_SCENES.map(String::from).into() } else { args.scenes.clone() }
}

/// `name`, or with a number behind it if files named after it and one of `others` would be the same; then one of the others, too.
fn unlike(name: &str, others: &mut Vec<String>) -> String {
    let numbered = |n: usize| if n == 1 { name.to_string() } else { format!("{name}-{n}") };
    // One of so many numbers is free.
    let free = (1..=others.len() + 1).map(numbered).find(|name| others.iter().all(|other| stem(other) != stem(name)));
    let name = free.unwrap_or_else(|| name.to_string());
    others.push(name.clone());
    name
}

/// `name` as a file's: a scene may be called anything, a file may not.
fn stem(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
}

/// A scene and its picture's place in `dir`, named after it as its rows are; `names` are those of the scenes before.
fn with_picture(args: &BenchArgs, scene: &str, dir: &Path, names: &mut Vec<String>) -> Result<(Description, PathBuf)> {
    // What it is shown without is said when it is measured.
    let quiet = OutputArgs { quiet: true, ..OutputArgs::default() };
    let description = args.options.seen_by(scene, &args.camera)?.load(scene, &quiet)?;
    let path = dir.join(format!("{}.exr", stem(&unlike(&description.name, names))));
    Ok((description, path))
}

/// Checks that the pictures will replace none of the files that the scenes are read from.
fn check_pictures(args: &BenchArgs, dir: &Path) -> Result<()> {
    // Only what is there can be replaced: in a new folder no scene has to be opened for it.
    let is_picture = |file: PathBuf| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if !std::fs::read_dir(dir).is_ok_and(|entries| entries.flatten().any(|entry| is_picture(entry.path()))) {
        return Ok(());
    }
    let (mut names, mut paths, mut inputs) = (Vec::new(), Vec::new(), Vec::new());
    for scene in scenes(args) {
        // Without all scenes there will be no picture; which one cannot be opened is said when its turn comes.
        let Ok((description, path)) = with_picture(args, &scene, dir, &mut names) else { return Ok(()) };
        paths.push(path);
        inputs.extend(description.inputs().into_iter().map(Path::to_path_buf));
    }
    let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    paths.iter().try_for_each(|path| check_apart(path, &inputs))
}

/// What the rays saw: one EXR per scene.
fn pictures(args: &BenchArgs, dir: &Path) -> Result<()> {
    let mut names = Vec::new();
    for scene in scenes(args) {
        let (description, path) = with_picture(args, &scene, dir, &mut names)?;
        let scene = SceneArgs { scene, options: args.options.clone() };
        let mut picture = RenderArgs::plain(scene, args.camera.clone(), args.threads, path);
        picture.output.quiet = args.output.quiet;
        render::of_scene(&picture, &description)?;
    }
    Ok(())
}

fn one<S: Engines>(
    args: &BenchArgs,
    workers: &Workers,
    description: &Description,
    bar: &indicatif::ProgressBar,
    rows: &mut Vec<Row>,
) -> Result<()> {
    let size = args.camera.size.unwrap_or(DEFAULT_SIZE);
    let plan = Plan {
        kinds: RayKind::each_once(&args.rays),
        engines: args.engines.clone(),
        size,
        repeat: args.repeat,
        seed: args.seed,
        build: args.options.build(),
        peers: args.invitation(),
    };
    let camera = |bounds, size| args.camera.ready(description, bounds, size);
    let mut class = "";
    let mut report = |row: Row| {
        if class != row.class {
            class = row.class;
            bar.inc(1);
        }
        rows.push(row);
    };
    bench::scene::<S>(workers, description, &camera, &plan, &stopped, &mut report)
}

fn write(dir: &Path, run: &Run, rows: &[Row], facts: &str) -> Result<()> {
    std::fs::create_dir_all(dir).map_err(|e| Error::io(dir, e))?;
    // The rows come last: a folder that has them is whole.
    write_whole(&dir.join("bench.env.txt"), facts.as_bytes())?;
    write_whole(&dir.join("bench.csv"), rows::csv(run, rows).as_bytes())
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |file| file.write_all(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_one_name_are_told_apart() {
        let mut names = Vec::new();
        let given = ["m", "m", "m-2", "a b", "a-b", "m"].map(|name| unlike(name, &mut names));
        assert_eq!(given, ["m", "m-2", "m-2-2", "a b", "a-b-2", "m-3"]);
    }
}
