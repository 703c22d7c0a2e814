//! Arguments that several commands share, and what they mean.

use glam::DVec3;

use crate::camera::{CameraOverrides, framing};
use crate::error::{Error, Result, nearest_name};
use crate::measure::timing::MAX_THREADS;
use crate::scene::description::{CameraDescription, Description, Precision};
use crate::scene::load::{LoadOptions, load};
use crate::scene::world::Preset;
use crate::trace::{EXACT_ENGINE, Engine, Engines, engine as engine_called};

pub use super::interrupt::stop_flag;
pub use super::output::OutputArgs;

/// Engine of commands that are not told one.
const DEFAULT_ENGINE: &str = "auto";

/// Which engine traces.
#[derive(Clone, Debug, clap::Args)]
pub struct EngineArgs {
    /// Engine
    #[arg(long, value_name = "NAME", default_value = DEFAULT_ENGINE)]
    pub engine: String,
    /// Only engines with the hits of `scalar`, bit for bit (`tile` has an arithmetic of its own)
    #[arg(long)]
    pub exact: bool,
}

impl Default for EngineArgs {
    fn default() -> Self {
        Self { engine: DEFAULT_ENGINE.into(), exact: false }
    }
}

impl EngineArgs {
    /// The engine asked for.
    ///
    /// # Errors
    /// Unknown engines, and with `--exact` those that are not.
    pub fn find<S: Engines>(&self) -> Result<&'static dyn Engine<S>> {
        let engine = if self.exact && self.engine == DEFAULT_ENGINE { EXACT_ENGINE } else { &self.engine };
        let engine = engine_called::<S>(engine)?;
        if self.exact && !engine.is_exact() {
            return Err(Error::Usage(format!("--exact: {} has an arithmetic of its own", engine.name())));
        }
        Ok(engine)
    }
}

/// Largest width or height of a picture.
const MAX_SIDE: u32 = 1 << 16;

/// A scene and how to open it.
#[derive(Clone, Debug, clap::Args)]
pub struct SceneArgs {
    /// A scene file (.kdl .gltf .glb), a mesh (.obj .ply .stl) or builtin:NAME
    pub scene: String,
    #[command(flatten)]
    /// How to open it.
    pub options: SceneOptions,
}

/// How to open and compile a scene.
#[derive(Clone, Debug, clap::Args)]
pub struct SceneOptions {
    /// Change a parameter of the scene file; may be given more than once
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting, help_heading = "Scene")]
    pub set: Vec<(String, String)>,
    /// Let the scene file name other files outside its own folder
    #[arg(long, help_heading = "Scene")]
    pub allow_outside: bool,
    /// Time the build may take: how good the tree gets
    #[arg(long, value_enum, default_value_t = PresetArg::Balanced, help_heading = "Scene")]
    pub preset: PresetArg,
    /// Arithmetic of the engines [default: what the scene asks for, else f32]
    #[arg(long, value_enum, help_heading = "Scene")]
    pub precision: Option<PrecisionArg>,
}

/// Values of `--preset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PresetArg {
    /// Quick build, slower rays
    Fast,
    /// Between the two
    Balanced,
    /// Slow build, fastest rays
    Best,
}

/// Values of `--precision`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PrecisionArg {
    /// Single precision: meshes
    F32,
    /// Double precision: large or exact models
    F64,
}

impl SceneArgs {
    /// Opens the scene.
    ///
    /// # Errors
    /// Those of [`load`].
    pub fn load(&self) -> Result<Description> {
        self.options.load(&self.scene)
    }
}

impl SceneOptions {
    /// Opens `scene` with these options.
    ///
    /// # Errors
    /// Those of [`load`].
    pub fn load(&self, scene: &str) -> Result<Description> {
        load(scene, &LoadOptions { set: self.set.clone(), allow_outside: self.allow_outside })
    }

    /// The precision asked for here, else by the scene, else f32.
    pub fn precision(&self, description: &Description) -> Precision {
        let asked = self.precision.map(|p| match p {
            PrecisionArg::F32 => Precision::F32,
            PrecisionArg::F64 => Precision::F64,
        });
        asked.or(description.precision).unwrap_or(Precision::F32)
    }

    /// The tree quality asked for.
    pub fn preset(&self) -> Preset {
        match self.preset {
            PresetArg::Fast => Preset::Fast,
            PresetArg::Balanced => Preset::Balanced,
            PresetArg::Best => Preset::Best,
        }
    }
}

fn setting(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

/// Which rays look at the scene.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct CameraArgs {
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = "Camera")]
    pub size: Option<(u32, u32)>,
    /// A camera of the scene file [default: its first; without one, a view that frames the scene]
    #[arg(long, value_name = "NAME", help_heading = "Camera")]
    pub camera: Option<String>,
    /// Eye point
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, help_heading = "Camera")]
    pub eye: Option<DVec3>,
    /// Point looked at
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, help_heading = "Camera")]
    pub look_at: Option<DVec3>,
    /// Up vector
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, help_heading = "Camera")]
    pub up: Option<DVec3>,
    /// Vertical field of view
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view, help_heading = "Camera")]
    pub fov: Option<f64>,
}

impl CameraArgs {
    /// The camera asked for: the named one, else the scene's first, else one that frames `bounds` (lower and upper
    /// corner) in a picture of `size`; then `--eye`, `--look-at`, `--up` and `--fov` change it.
    ///
    /// # Errors
    /// A usage error for an unknown name.
    pub fn choose(
        &self,
        description: &Description,
        bounds: Option<(DVec3, DVec3)>,
        size: (u32, u32),
    ) -> Result<CameraDescription> {
        let camera = match (&self.camera, description.cameras.first()) {
            (Some(name), _) => named(description, name)?,
            (None, Some(first)) => first.clone(),
            (None, None) => framing(bounds, f64::from(size.0) / f64::from(size.1)),
        };
        let theta = self.fov.map(f64::to_radians);
        Ok(CameraOverrides { eye: self.eye, look_at: self.look_at, up: self.up, theta }.apply(&camera))
    }
}

fn named(description: &Description, name: &str) -> Result<CameraDescription> {
    description.cameras.iter().find(|c| c.name == name).cloned().ok_or_else(|| {
        let names: Vec<&str> = description.cameras.iter().map(|c| c.name.as_str()).collect();
        let near = nearest_name(name, names.iter().copied()).map(|n| format!(" (did you mean `{n}`?)"));
        let list = if names.is_empty() { "none".into() } else { names.join(", ") };
        Error::Usage(format!("no camera `{name}`{}; the scene has: {list}", near.unwrap_or_default()))
    })
}

/// Parses `WxH`, 1 to 65536 pixels each way.
pub fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    let sides = text.split_once('x').and_then(|(w, h)| Some((side(w)?, side(h)?)));
    sides.ok_or_else(|| format!("expected WIDTHxHEIGHT, each 1 to {MAX_SIDE}, for example 1280x720"))
}

fn point(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|s| s.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|c: &f64| c.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three finite numbers X,Y,Z, for example 0,1.5,-4".into()),
    }
}

fn field_of_view(text: &str) -> std::result::Result<f64, String> {
    let degrees = text.parse().ok().filter(|&d: &f64| d > 0.0 && d < 180.0);
    degrees.ok_or_else(|| "expected degrees between 0 and 180".into())
}

/// Threads to use.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct ThreadArgs {
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_THREADS as i64))]
    pub threads: Option<u32>,
}

impl ThreadArgs {
    /// The number for [`with_pool`]: 0 means one per core.
    pub fn count(self) -> usize {
        self.threads.map_or(0, |n| n as usize)
    }
}

/// Runs `work` on a pool of `threads` threads; 0 means one per core.
///
/// # Errors
/// A usage error if the system refuses the threads; those of `work`.
pub fn with_pool<R: Send>(threads: usize, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))?.install(work)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::Projection;

    #[test]
    fn arguments_parse_or_say_what_is_expected() {
        assert_eq!(setting("n=3=4"), Ok(("n".into(), "3=4".into())));
        assert!(setting("n").is_err() && setting("=3").is_err());
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        for wrong in ["1280", "0x5", "5x", "70000x1", "-1x1", "1x1x1"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        assert_eq!(point("0, -1.5,2e3"), Ok(DVec3::new(0.0, -1.5, 2000.0)));
        for wrong in ["1,2", "1,2,3,4", "a,b,c", "1,2,inf", ""] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
        assert_eq!(field_of_view("45"), Ok(45.0));
        assert!(field_of_view("180").is_err() && field_of_view("nan").is_err());
    }

    fn camera(name: &str) -> CameraDescription {
        let projection = Projection::Parallel { height: 2.0 };
        CameraDescription { name: name.into(), eye: DVec3::X, look_at: DVec3::ZERO, up: DVec3::Y, projection }
    }

    #[test]
    fn cameras_are_found_by_name_and_changed_by_arguments() {
        let mut scene = Description::new("s");
        scene.cameras = vec![camera("front"), camera("side")];
        let size = (4, 3);
        let choose = |args: &CameraArgs| args.choose(&scene, None, size);
        assert_eq!(choose(&CameraArgs::default()).unwrap().name, "front");
        let mut args = CameraArgs { camera: Some("side".into()), ..Default::default() };
        args.eye = Some(DVec3::Z);
        args.fov = Some(90.0);
        let chosen = choose(&args).unwrap();
        assert_eq!((chosen.name.as_str(), chosen.eye, chosen.up), ("side", DVec3::Z, DVec3::Y));
        assert_eq!(chosen.projection, Projection::Perspective { theta: std::f64::consts::FRAC_PI_2 });
        args.camera = Some("sid".into());
        let text = choose(&args).unwrap_err().to_string();
        assert!(text.contains("did you mean `side`") && text.contains("front, side"), "{text}");
    }

    #[test]
    fn a_scene_without_cameras_is_framed() {
        let bounds = Some((DVec3::splat(9.0), DVec3::splat(11.0)));
        let camera = CameraArgs::default().choose(&Description::new("s"), bounds, (4, 3)).unwrap();
        assert_eq!(camera.look_at, DVec3::splat(10.0));
    }

    #[test]
    fn the_pool_has_the_threads_asked_for() {
        assert_eq!(with_pool(3, || Ok(rayon::current_num_threads())).unwrap(), 3);
        assert!(matches!(with_pool(1, || Err::<(), _>(Error::Interrupted)), Err(Error::Interrupted)));
    }
}
