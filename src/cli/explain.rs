//! `lanecast explain`: why one engine beats another.

mod table;

use std::path::{Path, PathBuf};

use super::common::{CameraArgs, OutputArgs, SceneArgs, ThreadArgs};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use crate::error::{Error, Result};
use crate::film::exr::{Compression, ImageInfo};
use crate::film::{Film, PlaneData, Window, check_folder, exr, heat};
use crate::lanes::compiled_isa;
use crate::measure::bench::chosen;
use crate::measure::env::REVISION;
use crate::measure::explain::{Costs, Maps, Quality, Work, costs, quality, work};
use crate::measure::eye::View;
use crate::measure::raysets::{RayKind, convert};
use crate::measure::timing::Workers;
use crate::scene::description::{Description, Precision};
use crate::scene::world::World;
use crate::trace::Engines;

/// Picture whose rays are counted unless `--size` says otherwise.
const DEFAULT_SIZE: (u32, u32) = (384, 224);

/// Share of the pixels below the brightest colour of a cost map.
const FULL: f64 = 0.995;

const EXAMPLES: &str = "\
Examples:
  lanecast explain builtin:sphere-flake
  lanecast explain model.ply --rays diffuse --engine scalar,packet16
  lanecast explain model.ply --rays shadow --engine packet16,tile -o why

Every engine is counted packet by packet: node visits, box and primitive tests, lanes in use, bytes looked at; the \
times of the 32x32 pixel tiles are fitted to these counts, which says where the time goes. Of the tree: SAH cost, \
end-point overlap, sizes and depths of leaves; of the rays: the depth at which those of a packet part. For scenes of \
triangles, the limit: how long the machine's lanes take for the counted tests alone, by single tests measured in the \
same run (docs/METHODOLOGY.md says what that is and is not). With -o, what each pixel cost: cost-CLASS-ENGINE.exr \
and .png. Engines are not checked here (verify does that); figures of speed are of one thread and only to go with \
the counts.";

/// Arguments of `lanecast explain`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ExplainArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Ray classes
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "primary")]
    rays: Vec<RayKind>,
    /// Engines to compare [default: scalar and auto]
    #[arg(long, visible_alias = "engines", value_name = "A,B", value_delimiter = ',')]
    engine: Vec<String>,
    #[command(flatten)]
    camera: CameraArgs,
    /// Seed of the random directions
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Folder for cost maps
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// The object of `--json`.
#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    precision: &'static str,
    isa: &'static str,
    size: (u32, u32),
    tree: Option<Quality>,
    costs: Costs,
    classes: Vec<Class>,
}

/// All engines on one class of rays.
#[derive(serde::Serialize)]
struct Class {
    rays: &'static str,
    query: &'static str,
    engines: Vec<Work>,
}

/// Runs `lanecast explain`.
///
/// # Errors
/// Bad input; [`Error::Interrupted`].
pub fn run(args: &ExplainArgs) -> Result<()> {
    args.folder.iter().try_for_each(|folder| check_folder(folder))?;
    let description = args.scene.seen_by(&args.camera)?.load(&args.output)?;
    match args.scene.options.precision(&description) {
        Precision::F32 => explain::<f32>(args, &description),
        Precision::F64 => explain::<f64>(args, &description),
    }
}

fn explain<S: Engines>(args: &ExplainArgs, description: &Description) -> Result<()> {
    let names = if args.engine.is_empty() { vec!["scalar".into(), "auto".into()] } else { args.engine.clone() };
    // Each once, by whatever name, as `bench` does.
    let (engines, kinds) = (chosen::<S>(&names)?, RayKind::each_once(&args.rays));
    let size = args.camera.size.unwrap_or(DEFAULT_SIZE);
    let workers = Workers::new(args.threads.count())?;
    let world = workers.install(|| World::<S>::compile(description, args.scene.options.build()))?;
    let camera = |bounds, size| args.camera.ready(description, bounds, size);
    let view = workers.install(|| View::new(&world, description, &camera, size, args.seed))?;
    let bar = args.output.progress_bar((kinds.len() * engines.len()) as u64, "counting");
    let mut report = Report {
        scene: &args.scene.scene,
        precision: S::PRECISION,
        isa: compiled_isa(),
        size,
        tree: workers.install(|| quality(&world)),
        costs: workers.install(costs::<S>),
        classes: Vec::new(),
    };
    for kind in kinds {
        let batches = convert::<S>(&workers.install(|| view.rays(&world, kind))?);
        let mut class = Class { rays: kind.name(), query: kind.query().name(), engines: Vec::new() };
        for &engine in &engines {
            if stopped() {
                return Err(Error::Interrupted);
            }
            class
                .engines
                .push(workers.install(|| work(engine, &world, &batches, kind, size, &report.costs, &stopped))?);
            bar.inc(1);
        }
        report.classes.push(class);
    }
    bar.finish_and_clear();
    if let Some(folder) = &args.folder {
        write_maps(folder, &report, args)?;
    }
    if args.output.json { json_to_stdout(&report) } else { to_stdout(&table::table(&report)) }
}

fn write_maps(folder: &Path, report: &Report<'_>, args: &ExplainArgs) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    for class in &report.classes {
        for work in &class.engines {
            let Some(Maps { size: (width, height), nodes, prims }) = &work.maps else { continue };
            let path = folder.join(format!("cost-{}-{}.exr", class.rays, work.engine));
            let window = Window::full(*width, *height);
            let cost: Vec<f32> = nodes.iter().zip(prims).map(|(n, p)| n + p).collect();
            let full = heat::quantile(&cost, FULL);
            let mut film = heat::film(*width, *height, window, &cost, full)?;
            film.push("cost.nodes", PlaneData::F32(nodes.clone()))?;
            film.push("cost.prims", PlaneData::F32(prims.clone()))?;
            write_exr(&path, &film, work)?;
            let png = path.with_extension("png");
            heat::write_png(&png, window, &cost, full)?;
            args.output.say(&format!("{}: white is {full:.2} node visits and primitive tests per ray", png.display()));
        }
    }
    Ok(())
}

fn write_exr(path: &Path, film: &Film, work: &Work) -> Result<()> {
    let info = ImageInfo {
        software: format!("lanecast {}", env!("CARGO_PKG_VERSION")),
        revision: REVISION.into(),
        engine: work.engine.into(),
        isa: compiled_isa().into(),
        lanes: work.width as u32,
        batch: work.lanes as u32,
        rays: work.rays,
        ..Default::default()
    };
    exr::write(path, film, &info, Compression::Zip)
}
