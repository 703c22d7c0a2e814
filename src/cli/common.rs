//! Arguments that several commands share, and what they mean.

use std::path::Path;

use crate::error::{Error, Result};
use crate::measure::timing::MAX_THREADS;
use crate::scene::brlcad::describe::Options;
use crate::scene::description::{Description, Precision};
use crate::scene::load::{LoadOptions, ReadMesh, is_database, load_with, read_mesh};
use crate::scene::world::{BuildSettings, Preset};
use crate::trace::{EXACT_ENGINE, Engine, Engines, engine as engine_called};

pub use super::interrupt::stop_flag;
pub use super::output::OutputArgs;
pub use super::view::{CameraArgs, size};

/// Engine of commands that are not told one.
const DEFAULT_ENGINE: &str = "auto";

/// How trees are built unless `--preset` and `--leaf` say otherwise.
const DEFAULT_PRESET: PresetArg = PresetArg::Balanced;
const DEFAULT_LEAF: u8 = 8;

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
    /// The same, but for pictures by blocks: unless an engine is named, one that knows nothing of a ray's neighbours.
    pub fn for_blocks(&self, by_blocks: bool) -> Self {
        Self { exact: self.exact || by_blocks && self.is_default(), ..self.clone() }
    }

    /// The same, but for pictures of node visits: unless an engine is named, those of single rays, which say what the scene asks of
    /// a ray. Those of a tile are one number for all its rays.
    pub fn for_costs(&self, is_cost: bool) -> Self {
        let engine = if is_cost && self.is_default() { "scalar".into() } else { self.engine.clone() };
        Self { engine, ..self.clone() }
    }

    /// Whether no engine is named.
    pub fn is_default(&self) -> bool {
        self.engine == DEFAULT_ENGINE
    }

    /// The engine asked for.
    ///
    /// # Errors
    /// Unknown engines, and with `--exact` those that are not.
    pub fn find<S: Engines>(&self) -> Result<&'static dyn Engine<S>> {
        let engine = if self.exact && self.is_default() { EXACT_ENGINE } else { &self.engine };
        let engine = engine_called::<S>(engine)?;
        if self.exact && !engine.is_exact() {
            return Err(Error::Usage(format!("--exact: {} has an arithmetic of its own", engine.name())));
        }
        Ok(engine)
    }
}

/// A scene and how to open it.
#[derive(Clone, Debug, clap::Args)]
pub struct SceneArgs {
    /// A scene file (.kdl .gltf .glb), a BRL-CAD database (.asc .g), an OpenSCAD model (.csg), a mesh (.obj .ply .stl) or
    /// builtin:NAME
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
    /// Object of a BRL-CAD database to show; may be given more than once [default: all.g or all, else what no other uses]
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub top: Vec<String>,
    /// Show a BRL-CAD database without what is not supported, instead of refusing it
    #[arg(long, help_heading = "Scene")]
    pub lenient: bool,
    /// Trace each mesh that a glTF file places as an instance, to see what joining them is worth
    #[arg(long, help_heading = "Scene")]
    pub apart: bool,
    /// Time the build may take: how good the tree gets
    #[arg(long, value_enum, default_value_t = DEFAULT_PRESET, help_heading = "Scene")]
    pub preset: PresetArg,
    /// Most primitives in a leaf of the tree, 1 to 8
    #[arg(long, value_name = "N", default_value_t = DEFAULT_LEAF, value_parser = clap::value_parser!(u8).range(1..=8), help_heading = "Scene")]
    pub leaf: u8,
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
    /// Opens the scene; see [`SceneOptions::load`].
    ///
    /// # Errors
    /// Those of [`load_with`].
    pub fn load(&self, output: &OutputArgs) -> Result<Description> {
        self.options.load(&self.scene, output)
    }

    /// What `camera` is to see of it; see [`SceneOptions::seen_by`].
    ///
    /// # Errors
    /// A view script that cannot be read.
    pub fn seen_by(&self, camera: &CameraArgs) -> Result<Self> {
        Ok(Self { scene: self.scene.clone(), options: self.options.seen_by(&self.scene, camera)? })
    }
}

impl SceneOptions {
    /// The same for `scene` as `camera` looks at it: of a database the objects that the view script names, unless `--top`
    /// names some.
    ///
    /// # Errors
    /// A view script that cannot be read.
    pub fn seen_by(&self, scene: &str, camera: &CameraArgs) -> Result<Self> {
        let mut options = self.clone();
        if options.top.is_empty() && is_database(scene) {
            options.top = camera.script()?.map(|view| view.tops).unwrap_or_default();
        }
        Ok(options)
    }

    /// Opens `scene` with these options and says what it is shown without.
    ///
    /// # Errors
    /// Those of [`load_with`].
    pub fn load(&self, scene: &str, output: &OutputArgs) -> Result<Description> {
        let description = self.load_with(scene, &read_mesh)?;
        output.warn(&description.warnings);
        Ok(description)
    }

    /// Opens it with meshes read by `read`; what it is shown without is left to the caller to say.
    ///
    /// # Errors
    /// Those of [`load_with`].
    pub fn load_with(&self, scene: &str, read: &ReadMesh<'_>) -> Result<Description> {
        let brlcad = Options { tops: self.top.clone(), lenient: self.lenient };
        let (set, allow_outside, apart) = (self.set.clone(), self.allow_outside, self.apart);
        load_with(scene, &LoadOptions { set, brlcad, allow_outside, apart }, read)
    }

    /// The first of these options that asks for something: for commands that open no scene after all.
    pub fn first_given(&self) -> Option<&'static str> {
        let options = [
            (!self.set.is_empty(), "--set"),
            (self.allow_outside, "--allow-outside"),
            (!self.top.is_empty(), "--top"),
            (self.lenient, "--lenient"),
            (self.apart, "--apart"),
            (self.preset != DEFAULT_PRESET, "--preset"),
            (self.leaf != DEFAULT_LEAF, "--leaf"),
            (self.precision.is_some(), "--precision"),
        ];
        options.iter().find(|(is_given, _)| *is_given).map(|(_, name)| *name)
    }

    /// The precision asked for here, else by the scene, else f32.
    pub fn precision(&self, description: &Description) -> Precision {
        let asked = self.precision.map(|p| match p {
            PrecisionArg::F32 => Precision::F32,
            PrecisionArg::F64 => Precision::F64,
        });
        asked.or(description.precision).unwrap_or(Precision::F32)
    }

    /// The trees asked for.
    pub fn build(&self) -> BuildSettings {
        let preset = match self.preset {
            PresetArg::Fast => Preset::Fast,
            PresetArg::Balanced => Preset::Balanced,
            PresetArg::Best => Preset::Best,
        };
        BuildSettings { preset, leaf: usize::from(self.leaf) }
    }
}

fn setting(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

/// Parses a finite number.
pub fn finite(text: &str) -> std::result::Result<f32, String> {
    text.parse().ok().filter(|x: &f32| x.is_finite()).ok_or_else(|| "expected a number".into())
}

/// Checks that `file`, what `option` writes, is named as what it will hold: a name that ends otherwise is a mistake, and the file of
/// that name perhaps an input.
///
/// # Errors
/// [`Error::Usage`] if its name does not end in `.ENDING`.
pub fn check_ending(option: &str, file: &Path, ending: &str) -> Result<()> {
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    Err(Error::Usage(format!("{option} {}: expected a name that ends in .{ending}", file.display())))
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

    #[test]
    fn arguments_parse_or_say_what_is_expected() {
        assert_eq!(setting("n=3=4"), Ok(("n".into(), "3=4".into())));
        assert!(setting("n").is_err() && setting("=3").is_err());
        assert_eq!(finite("-2.5"), Ok(-2.5));
        assert!(["nan", "inf", "-inf", "1e99", ""].iter().all(|wrong| finite(wrong).is_err()));
    }

    #[test]
    fn the_pool_has_the_threads_asked_for() {
        assert_eq!(with_pool(3, || Ok(rayon::current_num_threads())).unwrap(), 3);
        assert!(matches!(with_pool(1, || Err::<(), _>(Error::Interrupted)), Err(Error::Interrupted)));
    }
}
