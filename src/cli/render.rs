//! `lanecast render`: a picture of a scene.

mod effect;
mod frames;
mod kept;
mod plain;
mod report;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use self::kept::{keeper, say};
use self::report::{Holds, Made, report, samples_per_pixel, tell};
use super::common::{CameraArgs, EngineArgs, OutputArgs, SceneArgs, ThreadArgs, finite, stop_flag, with_pool};
use super::picture::{Format, Target, files, target, write_each};
use super::preview::{Job, PreviewArgs};
use crate::camera::Filter;
use crate::error::{Error, Result};
use crate::film::exr::ImageInfo;
use crate::film::{Window, check_apart, check_distinct, check_file};
use crate::lanes::compiled_isa;
use crate::measure::env::REVISION;
use crate::render::{Aov, Progress, RenderOptions};
use crate::scene::description::{Description, Precision};
use crate::scene::world::World;
use crate::shade::{Integrator, Shades, unaimed, unknown_shaders};

/// Picture size unless `--size` says otherwise.
const DEFAULT_SIZE: (u32, u32) = (960, 540);

/// Samples per pixel of path tracing unless `--spp` says otherwise.
const PATH_SAMPLES: u32 = 64;
/// Samples per pixel at most where time or noise decides.
const MOST_SAMPLES: u32 = 1 << 16;

/// The same with `--rt-compat`.
const RT_SIZE: (u32, u32) = (512, 512);

const EXAMPLES: &str = "\
Examples:
  lanecast render builtin:sphere-flake -o flake.png
  lanecast render model.ply -o model.exr --aov Z,N,id.primitive --spp 16
  lanecast render builtin:cornell --integrator path --spp 256 -o box.exr -o box.png --stats
  lanecast render scene.glb --integrator path --noise 0.02 --time-limit 60 -o scene.exr --filter blackman-harris
  lanecast render model.ply -o ao.png --integrator ao --ao-samples 64 --exposure 0.5
  lanecast render scene.kdl -o cut.exr --size 1920x1080 --crop 100,100,400,300 --camera side
  lanecast render model.obj -o near.png --eye 0,1,5 --look-at 0,1,0 --fov 35
  lanecast render moss.asc --top all.g --view moss.rt --rt-compat --size 512x512 -o moss.pix
  lanecast render m35.asc --az 90 --el 0 --lenient -o front.png
  lanecast render builtin:forest -o forest.exr --spp 64 --preview tev
  lanecast render turn.kdl -o turn.exr --frames 1..48 --resume

The file's extension chooses the format: .exr (float, all planes, attributes), .png (sRGB, 8 bits), .npy (R G B A as \
float, shape (height, width, 4); each further plane in a file beside it, NAME.PLANE.npy), .pix (BRL-CAD's: linear, 8 \
bits, no header). Ctrl-C writes the finished tiles and exits with 130.";

/// Arguments of `lanecast render`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// File to write: .exr, .png, .npy or .pix; several -o write the same picture in several formats
    #[arg(short = 'o', long = "output", value_name = "FILE", required = true, value_parser = target)]
    files: Vec<Target>,
    #[command(flatten)]
    camera: CameraArgs,
    /// Part of the picture to render, pixels, y down, half open
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop, help_heading = "Camera")]
    crop: Option<Window>,
    /// What to show: whitted, path (all light), ao, normals, depth, cost or rt (BRL-CAD databases as BRL-CAD's own rt shades
    /// them) [default: whitted]
    #[arg(long, value_name = "NAME")]
    integrator: Option<Integrator>,
    /// Show a BRL-CAD database as BRL-CAD's own `rt -B -J0` does: --integrator rt with its default view and 512x512 pixels
    #[arg(long)]
    rt_compat: bool,
    /// Samples per pixel [default: 1; 64 with path, as many as needed with --time-limit or --noise]
    #[arg(long, value_name = "N")]
    spp: Option<u32>,
    /// Stop adding samples after that many seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time_limit: Option<f64>,
    /// Stop adding samples to a tile when its relative error is estimated below this, for example 0.02
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true)]
    noise: Option<f64>,
    /// How samples are placed around a pixel's centre: box, tent or blackman-harris
    #[arg(long, value_name = "NAME", default_value = Filter::Box.name())]
    filter: Filter,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Mirror reflections followed by whitted [default: 4]; scatterings of a path [default: 16]
    #[arg(long, value_name = "N")]
    depth: Option<u32>,
    /// Print rays and time of each bounce or level of recursion
    #[arg(long)]
    stats: bool,
    /// Occlusion rays per hit of ao [default: 16]
    #[arg(long, value_name = "N")]
    ao_samples: Option<u32>,
    /// Length of occlusion rays of ao as a fraction of the scene's diagonal [default: 0.2]
    #[arg(long, value_name = "FRACTION", allow_negative_numbers = true)]
    ao_radius: Option<f64>,
    /// Extra planes: Z, N, Ns, P, albedo, id.instance, id.primitive, id.material, variance, samples, direct and indirect (path
    /// only), cost.nodes (neither path nor rt), all of these that the integrator has, or cryptomatte
    #[arg(long, value_name = "LIST", default_value = "")]
    aov: String,
    /// Brightness of PNG and .pix files: colours times 2^STOPS
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = finite)]
    exposure: f32,
    #[command(flatten)]
    engine: EngineArgs,
    /// Tile edge: 8, 16 or 32 pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 32)]
    tile: u32,
    /// Frames of an animation, both ends included: the scene's parameter `frame` is set to each, and NAME.0001.exr and so
    /// on are written; a frame that is stopped is not. --json says in one object, when all are done, what was said of each
    #[arg(long, value_name = "A..B", value_parser = frames::frames)]
    frames: Option<frames::Frames>,
    /// Keep finished tiles beside the picture, in NAME.tiles, until it is whole, and go on from those that the same command left there
    /// when it was stopped or killed; with --frames also leave out frames of which all files exist
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    preview: PreviewArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// A bar that shows tiles, and Ctrl-C.
struct Watch {
    bar: ProgressBar,
    stop: &'static AtomicBool,
}

impl Progress for Watch {
    fn tile_done(&self, total: u64) {
        self.bar.set_length(total);
        self.bar.inc(1);
    }
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl RenderArgs {
    /// The first file to write.
    fn file(&self) -> String {
        self.files.first().map(|file| file.path.display().to_string()).unwrap_or_default()
    }

    /// Whether finished tiles are kept: those of pictures that are made tile by tile.
    fn keeps_tiles(&self) -> bool {
        self.resume && self.noise.is_none() && self.time_limit.is_none() && !self.preview.by_blocks()
    }

    /// All files of the picture, those of further planes, too.
    fn all_files(&self, options: &RenderOptions) -> Vec<PathBuf> {
        let planes = options.planes();
        self.files.iter().flat_map(|file| files(file, &planes)).collect()
    }

    /// Checks that they can be written, each one beside the others.
    fn check_files(&self, options: &RenderOptions) -> Result<()> {
        let all = self.all_files(options);
        all.iter().try_for_each(|file| check_file(file))?;
        check_distinct(&all)
    }

    /// Checks that they replace none of `inputs`, files that a scene is read from.
    fn check_apart(&self, inputs: &[&Path], options: &RenderOptions) -> Result<()> {
        self.all_files(options).iter().try_for_each(|file| check_apart(file, inputs))
    }

    /// Whether all that is wanted of the picture are the levels of `.pix` files.
    fn holds_levels(&self) -> bool {
        !self.preview.by_blocks() && self.files.iter().all(|file| file.format == Format::Pix)
    }
}

/// Runs `lanecast render`.
///
/// # Errors
/// Bad input or options, an output that cannot be written; [`Error::Interrupted`] after Ctrl-C, when the finished
/// tiles have been written.
pub fn run(args: &RenderArgs) -> Result<()> {
    if let Some(frames) = args.frames {
        return frames::run(args, frames);
    }
    let options = options(args)?;
    args.check_files(&options)?;
    still(args, &args.scene.seen_by(&args.camera)?.load(&args.output)?, &options)
}

/// The picture of a scene that is open.
///
/// # Errors
/// As [`run`].
pub(super) fn of_scene(args: &RenderArgs, description: &Description) -> Result<()> {
    still(args, description, &options(args)?)
}

fn still(args: &RenderArgs, description: &Description, options: &RenderOptions) -> Result<()> {
    args.check_apart(&description.inputs(), options)?;
    if options.integrator == Integrator::Rt {
        check_rt(description, args.scene.options.lenient, &args.output)?;
    }
    with_pool(args.threads.count(), || match args.scene.options.precision(description) {
        Precision::F32 => compiled::<f32>(args, description, options),
        Precision::F64 => compiled::<f64>(args, description, options),
    })
}

fn compiled<S: Shades>(args: &RenderArgs, description: &Description, options: &RenderOptions) -> Result<()> {
    args.engine.find::<S>()?;
    let world = World::<S>::compile(description, args.scene.options.build())?;
    picture(args, description, options, &world, None)
}

/// Whether `rt`'s lighting model knows all that the scene asks of it; if `lenient`, what it does not know is said.
///
/// # Errors
/// [`Error::Usage`] for scenes of other kinds and, unless `lenient`, shaders that are not known.
pub(super) fn check_rt(description: &Description, lenient: bool, output: &OutputArgs) -> Result<()> {
    let Some(looks) = &description.looks else {
        let what =
            "rt (--integrator rt, --rt-compat) shows BRL-CAD databases: expected a scene file that ends in .asc or .g";
        return Err(Error::Usage(what.into()));
    };
    for (shader, region) in unknown_shaders(looks) {
        let what = format!("the shader `{shader}` of region {region} is not supported");
        if !lenient {
            return Err(Error::Usage(format!("{what}; --lenient shows it as plastic")));
        }
        output.warn([&format!("{what}: shown as plastic")]);
    }
    Ok(())
}

/// Says that `count` emitting surfaces are too many to be aimed at, and what helps.
fn warn_of_unaimed(args: &RenderArgs, count: u64) {
    let what = format!(
        "{count} emitting triangles and shapes are copies beyond those that paths aim at: their light is found by chance only, with \
         more noise; place fewer of them"
    );
    args.output.warn((count > 0).then_some(&what));
}

/// The options, checked before a long build starts.
fn options(args: &RenderArgs) -> Result<RenderOptions> {
    let (width, height) = args.camera.size.unwrap_or(if args.rt_compat { RT_SIZE } else { DEFAULT_SIZE });
    let integrator = match args.integrator {
        Some(other) if args.rt_compat && other != Integrator::Rt => {
            return Err(Error::Usage(format!("--rt-compat is --integrator rt: it cannot be {}, too", other.name())));
        }
        None if args.rt_compat => Integrator::Rt,
        chosen => chosen.unwrap_or_default(),
    };
    args.warn_of_effect(integrator);
    let is_path = integrator == Integrator::Path;
    let spp = match args.spp {
        Some(spp) => spp,
        None if args.time_limit.is_some() || args.noise.is_some() => MOST_SAMPLES,
        None if is_path => PATH_SAMPLES,
        None => 1,
    };
    let plain = RenderOptions::default();
    let options = RenderOptions {
        width,
        height,
        crop: args.crop,
        spp,
        filter: args.filter,
        time_limit: args.time_limit,
        noise: args.noise,
        seed: args.seed,
        integrator,
        engine: args.engine.engine.clone(),
        tile: args.tile,
        depth: args.depth.unwrap_or(integrator.depth()),
        ao_samples: args.ao_samples.unwrap_or(plain.ao_samples),
        ao_radius: args.ao_radius.unwrap_or(plain.ao_radius),
        aovs: Aov::parse_list_of(&args.aov, integrator)?,
        levels: args.holds_levels().then_some(args.exposure),
        count: args.output.verbose > 0,
    };
    options.check()?;
    if args.resume && args.frames.is_none() && !args.keeps_tiles() {
        let what = "--resume goes with a fixed number of samples, and without previews: expected no --noise, --time-limit, --preview \
                    or --blocks";
        return Err(Error::Usage(what.into()));
    }
    let holds_planes = |file: &Target| !matches!(file.format, Format::Png | Format::Pix);
    if !options.aovs.is_empty() && !args.files.iter().any(holds_planes) {
        return Err(Error::Usage("PNG and .pix hold colours only: --aov needs .exr or .npy".into()));
    }
    Ok(options)
}

/// Renders and writes one picture, also one that was stopped, as far as it got; of the `frames` of an animation only whole ones.
fn picture<S: Shades>(
    args: &RenderArgs,
    description: &Description,
    options: &RenderOptions,
    world: &World<S>,
    frames: Option<&mut Vec<serde_json::Value>>,
) -> Result<()> {
    let is_cost = options.integrator == Integrator::Cost;
    let engine = args.engine.for_costs(is_cost).for_blocks(args.preview.by_blocks()).find::<S>()?;
    let (width, height) = (options.width, options.height);
    let camera_args = if args.rt_compat { args.camera.or_default_view() } else { args.camera.clone() };
    let camera = camera_args.ready(description, world.bounds(), (width, height))?.camera;
    if options.integrator == Integrator::Path {
        warn_of_unaimed(args, unaimed(world, description));
    }
    let watch = Watch { bar: args.output.progress_bar(0, "rendering"), stop: stop_flag() };
    let keeper = keeper(args, description, engine, &camera, options);
    let job = Job {
        engine,
        world,
        description,
        camera: &camera,
        options,
        keeper: keeper.as_ref(),
        exposure: args.exposure,
        name: &args.file(),
        output: &args.output,
    };
    let (output, window) = job.render(&args.preview, &watch)?;
    watch.bar.finish_and_clear();
    keeper.iter().for_each(|keeper| say(args, keeper, output.tiles_total));
    let info = ImageInfo {
        software: concat!("lanecast ", env!("CARGO_PKG_VERSION")).into(),
        revision: REVISION.into(),
        scene_hash: description.hash.clone(),
        engine: engine.name().into(),
        isa: compiled_isa().into(),
        lanes: engine.width() as u32,
        batch: engine.lanes() as u32,
        // With a limit of noise or time the number asked for is only the most there may be.
        spp: if args.noise.is_none() && args.time_limit.is_none() && output.is_complete() {
            options.spp
        } else {
            samples_per_pixel(&output).round().max(1.0) as u32
        },
        seed: options.seed,
        render_seconds: output.seconds,
        rays: output.rays.total(),
        // glam's arrays are lists of columns.
        world_to_camera: Some(camera.world_to_camera().transpose().to_cols_array_2d()),
        world_to_ndc: Some(camera.world_to_ndc().transpose().to_cols_array_2d()),
    };
    // Without a finished tile there is nothing to show, and an older picture is worth more.
    let written = output.is_complete() || frames.is_none() && output.tiles_done > 0;
    if written {
        write_each(&args.files, &output.film, &info, args.exposure)?;
    }
    if let (true, Some(keeper)) = (output.is_complete(), &keeper) {
        keeper.remove()?;
    }
    let stats = world.stats();
    let (engine, precision, build_seconds) = (engine.name(), S::PRECISION, stats.build_seconds);
    let made = Made { engine, precision, build_seconds, holds: Holds::new(&stats, description), written };
    tell(args, &report(args, options, &output, &made), &output, frames)?;
    if let Some(window) = window {
        window.wait(|| watch.stopped());
    }
    if output.is_complete() { Ok(()) } else { Err(Error::Interrupted) }
}

fn crop(text: &str) -> std::result::Result<Window, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|s| s.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Window { x0, y0, x1, y1 }),
        _ => Err("expected X0,Y0,X1,Y1 in pixels with X0 < X1 and Y0 < Y1, for example 100,50,200,150".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_parse_or_say_what_is_expected() {
        assert_eq!(crop("1,2,3,4"), Ok(Window { x0: 1, y0: 2, x1: 3, y1: 4 }));
        for wrong in ["1,2,1,4", "1,2,3", "-1,2,3,4", "a,b,c,d", "1,2,3,4,5"] {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }
}
