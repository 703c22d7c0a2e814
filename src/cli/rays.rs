//! `lanecast rays`: a file of rays of one class, for `lanecast trace` and other programs.

use std::path::PathBuf;

use super::common::{CameraArgs, OutputArgs, SceneArgs, ThreadArgs, check_ending, with_pool};
use super::interrupt::stopped;
use super::output::json_to_stdout;
use crate::error::{Error, Result};
use crate::film::{check_file, npy};
use crate::measure::eye::View;
use crate::measure::raysets::RayKind;
use crate::ray::Rays;
use crate::scene::description::{Description, Precision};
use crate::scene::world::World;
use crate::trace::Engines;

/// Picture whose rays are written unless `--size` says otherwise.
const DEFAULT_SIZE: (u32, u32) = (1024, 576);

const EXAMPLES: &str = "\
Examples:
  lanecast rays builtin:sphere-flake --kind primary -o primary.npy
  lanecast rays model.ply --kind ao --size 512x512 --seed 7 -o ao.npy
  lanecast rays model.ply --kind shadow --eye 0,1,5 --look-at 0,1,0 -o shadow.npy

Kinds: primary; shadow (to the scene's first point light, or one just above the eye, which is t = 1); ao (one \
cosine-distributed ray per hit, 5 % of the scene's diagonal long); reflect (mirror); diffuse (cosine); scatter \
(aimed at random primitives from all sides, as many as there are pixels, in no order).
The order is that of 32x32 pixel tiles, Morton order inside. Where a primary ray misses, the others are dead (t_max \
< t_min); so are those that tiles hold beyond the picture where its sides are no multiples of 32, and `trace` counts \
them as rays.";

/// Arguments of `lanecast rays`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct RaysArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Ray class: primary (or camera, which is the same here), shadow, ao, reflect, diffuse, diffuse2, diffuse3 or scatter
    #[arg(long)]
    kind: RayKind,
    #[command(flatten)]
    camera: CameraArgs,
    /// Seed of the random directions
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: ThreadArgs,
    /// File to write: NumPy f4 of shape (N, 8)
    #[arg(short = 'o', long = "output", value_name = "FILE.npy")]
    file: PathBuf,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    kind: &'static str,
    size: (u32, u32),
    seed: u64,
    rays: u64,
    live: u64,
    file: String,
}

/// Runs `lanecast rays`.
///
/// # Errors
/// Bad input, an output that cannot be written, [`Error::Interrupted`].
pub fn run(args: &RaysArgs) -> Result<()> {
    check_ending("-o", &args.file, "npy")?;
    check_file(&args.file)?;
    let description = args.scene.seen_by(&args.camera)?.load(&args.output)?;
    let size = args.camera.size.unwrap_or(DEFAULT_SIZE);
    let rays = with_pool(args.threads.count(), || match args.scene.options.precision(&description) {
        Precision::F32 => rays::<f32>(args, &description, size),
        Precision::F64 => rays::<f64>(args, &description, size),
    })?;
    if stopped() {
        return Err(Error::Interrupted);
    }
    let count = npy::write_rays(&args.file, &rays)?;
    let live = rays.iter().map(|batch| batch.live_count() as u64).sum();
    let (kind, file) = (args.kind.name(), args.file.display().to_string());
    if args.output.json {
        return json_to_stdout(&Report {
            scene: &args.scene.scene,
            kind,
            size,
            seed: args.seed,
            rays: count,
            live,
            file,
        });
    }
    args.output.say(&format!("{file}: {count} {kind} rays, {live} live"));
    Ok(())
}

fn rays<S: Engines>(args: &RaysArgs, description: &Description, size: (u32, u32)) -> Result<Vec<Rays<f32>>> {
    let world = World::<S>::compile(description, args.scene.options.build())?;
    let camera = |bounds, size| args.camera.ready(description, bounds, size);
    let view = View::new(&world, description, &camera, size, args.seed)?;
    view.rays(&world, args.kind)
}
