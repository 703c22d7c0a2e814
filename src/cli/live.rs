//! `lanecast view`: a scene to walk around in.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::common::{CameraArgs, EngineArgs, OutputArgs, SceneArgs, SceneOptions, ThreadArgs, finite};
use super::interrupt::stopped;
use super::output::json_to_stdout;
use super::picture::{target, write};
use super::render::check_rt;
use crate::error::{Error, Result};
use crate::film::exr::ImageInfo;
use crate::lanes::compiled_isa;
use crate::measure::env::REVISION;
use crate::render::RenderOptions;
use crate::render::progressive::LARGEST_BLOCK;
use crate::scene::description::{Description, Precision};
use crate::scene::world::World;
use crate::shade::{Integrator, Shades};
use crate::trace::EXACT_ENGINE;
use crate::view::action::View;
use crate::view::meshes::Meshes;
use crate::view::reload::{Setting, Source};
use crate::view::script;
use crate::view::shot::Shot;
use crate::view::stage::{Look, Scene, Stage};
use crate::view::studio::Studio;
use crate::view::window;

/// Picture size unless `--size` says otherwise.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);
/// Largest script, bytes; one more is enough to refuse it.
const MAX_SCRIPT: u64 = 1 << 20;

const EXAMPLES: &str = "\
Examples:
  lanecast view builtin:forest
  lanecast view scene.kdl --camera side --spp 16
  lanecast view model.ply --headless-script orbit.txt

Drag to orbit, wheel to zoom, V for sliders of the scene's parameters, F1 for all keys. The scene is opened anew \
when a file in its folder changes.
A script has one command per line (docs/VIEW.md): orbit, turn, pan, zoom, fly, widen, fov, camera, reset, \
integrator, engine, heat, exposure, spp, blocks, wait, frame, spin, click, save, set, reload. What wait, frame, \
spin, click, set and reload find is printed as one JSON object per line.";

/// Arguments of `lanecast view`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ViewArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    camera: CameraArgs,
    /// What to show first: whitted, path (all light), ao, normals, depth, cost or rt (BRL-CAD databases only)
    #[arg(long, value_name = "NAME", default_value = Integrator::Whitted.name())]
    integrator: Integrator,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 1)]
    spp: u32,
    /// Brightness: colours are shown times 2^STOPS
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    exposure: f32,
    #[command(flatten)]
    engine: EngineArgs,
    /// Do what the file says instead of opening a window
    #[arg(long, value_name = "FILE")]
    headless_script: Option<PathBuf>,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// Runs `lanecast view`.
///
/// # Errors
/// Bad input or options; a script that cannot be done.
pub fn run(args: &ViewArgs) -> Result<()> {
    let read = |path: &PathBuf| Ok((path.clone(), script::parse(path, &read_script(path)?)?));
    let script = args.headless_script.as_ref().map(read).transpose()?;
    let threads = args.threads.count();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))?;
    let source = source(&args.scene.seen_by(&args.camera)?)?;
    let stage = pool.install(|| first(&source))?;
    args.output.warn(&stage.description().warnings);
    let view = view(args, &*stage)?;
    let save = |path: &Path, shot: &Shot, exposure: f32| save(args, path, shot, exposure);
    let name = stage.description().name.clone();
    // A window has nothing to finish: there Ctrl-C ends the process at once.
    let stopped = if script.is_some() { stopped } else { || false };
    let mut studio = Studio { stage, view, source: &source, save: &save, stopped };
    match script {
        Some((path, lines)) => pool.install(|| studio.run(&path, &lines, &|said| json_to_stdout(said))),
        None => window::open(studio, &pool, &name),
    }
}

fn read_script(path: &Path) -> Result<Vec<u8>> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    file.take(MAX_SCRIPT + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// The scene, watched if it is a file.
fn source(args: &SceneArgs) -> Result<Source> {
    let (name, options) = (args.scene.clone(), args.options.clone());
    let file = (!name.starts_with("builtin:")).then(|| PathBuf::from(&name));
    let meshes = Meshes::default();
    let open = move |settings: &[Setting], before: Option<&dyn Stage>| {
        let set = options.set.iter().chain(settings).cloned().collect();
        let options = SceneOptions { set, ..options.clone() };
        let description = options.load_with(&name, &|path, references| meshes.read(path, references))?;
        if before.is_some_and(|before| before.description().hash == description.hash) {
            return Ok(None);
        }
        match options.precision(&description) {
            Precision::F32 => stage::<f32>(&options, description, before),
            Precision::F64 => stage::<f64>(&options, description, before),
        }
    };
    Source::new(Box::new(open), file.as_deref())
}

fn stage<S: Shades>(
    options: &SceneOptions,
    description: Description,
    before: Option<&dyn Stage>,
) -> Result<Option<Arc<dyn Stage>>>
where
    World<S>: Send + Sync,
{
    let before = before.and_then(|before| before.as_any().downcast_ref::<World<S>>());
    let world = World::<S>::compile_after(&description, options.build(), before)?;
    Ok(Some(Arc::new(Scene { description, world })))
}

fn first(source: &Source) -> Result<Arc<dyn Stage>> {
    source.open(None)?.ok_or_else(|| Error::Usage("the scene cannot be opened".into()))
}

/// The view that the arguments ask for.
fn view(args: &ViewArgs, stage: &dyn Stage) -> Result<View> {
    let (width, height) = args.camera.size.unwrap_or(DEFAULT_SIZE);
    let (description, bounds, size) = (stage.description(), stage.bounds(), (width, height));
    let camera = args.camera.choose(description, bounds, size)?;
    let home = camera.clone();
    let rt = args.camera.rt_view(description, bounds)?.map(|view| (camera.clone(), view));
    match args.scene.options.precision(description) {
        Precision::F32 => args.engine.find::<f32>().map(drop)?,
        Precision::F64 => args.engine.find::<f64>().map(drop)?,
    }
    let engine = match args.engine.engine.as_str() {
        "auto" => EXACT_ENGINE.to_string(),
        name => name.to_string(),
    };
    let (spp, integrator) = (args.spp, args.integrator);
    if integrator == Integrator::Rt {
        check_rt(description, args.scene.options.lenient, &args.output)?;
    }
    let depth = integrator.depth();
    let options = RenderOptions { width, height, spp, integrator, depth, engine, ..Default::default() };
    options.check()?;
    let look = Look { camera, rt, options, start: LARGEST_BLOCK, heat: None };
    Ok(View { look, home, exposure: args.exposure, lenient: args.scene.options.lenient })
}

fn save(args: &ViewArgs, path: &Path, shot: &Shot, exposure: f32) -> Result<()> {
    let target = target(&path.to_string_lossy()).map_err(Error::Usage)?;
    let camera = shot.look.camera()?;
    let info = ImageInfo {
        software: concat!("lanecast ", env!("CARGO_PKG_VERSION")).into(),
        revision: REVISION.into(),
        scene_hash: shot.scene_hash.clone(),
        engine: shot.engine.clone(),
        isa: compiled_isa().into(),
        lanes: shot.lanes,
        batch: shot.batch,
        spp: shot.spp,
        seed: shot.look.options.seed,
        render_seconds: shot.seconds,
        rays: shot.rays,
        world_to_camera: Some(camera.world_to_camera().transpose().to_cols_array_2d()),
        world_to_ndc: Some(camera.world_to_ndc().transpose().to_cols_array_2d()),
    };
    write(&target, &shot.film, &info, exposure)?;
    args.output.say(&format!("{}: saved", path.display()));
    Ok(())
}
