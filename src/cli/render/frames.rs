//! `render --frames A..B`: the pictures of an animation, one file per frame.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde_json::Value;

use super::{RenderArgs, check_rt, options, picture, report};
use crate::cli::common::{SceneArgs, with_pool};
use crate::cli::output::json_to_stdout;
use crate::error::{Error, Result, locked};
use crate::scene::description::{Description, Precision};
use crate::scene::kdl::FRAME;
use crate::scene::load::has_parameters;
use crate::scene::world::World;
use crate::shade::Shades;
use crate::view::meshes::Meshes;

/// Largest frame number.
const MAX_FRAME: u32 = 999_999;

/// Frames from the first to the last one, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    first: u32,
    last: u32,
}

/// Parses `A..B`.
pub(super) fn frames(text: &str) -> std::result::Result<Frames, String> {
    let number = |s: &str| s.parse().ok().filter(|n: &u32| *n <= MAX_FRAME);
    let ends = text.split_once("..").and_then(|(a, b)| Some((number(a)?, number(b)?)));
    match ends {
        Some((first, last)) if first <= last => Ok(Frames { first, last }),
        _ => Err(format!("expected A..B with 0 <= A <= B <= {MAX_FRAME}, for example 1..48 (48 frames)")),
    }
}

/// `out.exr` and frame 7 give `out.0007.exr`.
fn numbered(path: &Path, frame: u32) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_extension(format!("{frame:04}.{extension}"))
}

/// Renders all frames, and says in one object what was done.
///
/// # Errors
/// As [`super::run`]; a frame that is stopped is not written.
pub(super) fn run(args: &RenderArgs, frames: Frames) -> Result<()> {
    let (mut told, kept) = (Vec::new(), Mutex::new(Vec::new()));
    let done = each(args, frames, &mut told, &kept);
    if args.output.json && matches!(done, Ok(()) | Err(Error::Interrupted)) {
        let kept = kept.into_inner().unwrap_or_default();
        json_to_stdout(&report::Frames { scene: &args.scene.scene, kept: &kept, frames: &told })?;
    }
    done
}

/// Renders all frames. Meshes are read once, and objects that do not change from one frame to the next are built once.
///
/// # Errors
/// As [`run`].
fn each(args: &RenderArgs, frames: Frames, told: &mut Vec<Value>, kept: &Mutex<Vec<String>>) -> Result<()> {
    let options = options(args)?;
    let SceneArgs { scene, options: of_scene } = &args.scene;
    if !has_parameters(scene) {
        return Err(Error::Usage(format!("--frames: {scene} has no parameters, so no `{FRAME}` that could change it")));
    }
    if of_scene.set.iter().any(|(name, _)| name == FRAME) {
        return Err(Error::Usage(format!("--set {FRAME}: --frames sets it")));
    }
    let meshes = Meshes::default();
    let scene = args.scene.seen_by(&args.camera)?;
    let of_frame = |frame: u32| {
        let mut of_frame = RenderArgs { frames: None, scene: scene.clone(), ..args.clone() };
        of_frame.files.iter_mut().for_each(|file| file.path = numbered(&file.path, frame));
        of_frame.scene.options.set.push((FRAME.into(), frame.to_string()));
        of_frame
    };
    // A file that one frame is read from is not to be replaced by the picture of another one, either. Nearly always the files are
    // those of the frame before.
    let mut known = HashSet::new();
    let mut describe = |this: RenderArgs| {
        let SceneArgs { scene, options: of_scene } = &this.scene;
        let description = of_scene.load_with(scene, &|path, references| meshes.read(path, references))?;
        let new: Vec<&Path> =
            description.inputs().into_iter().filter(|file| known.insert(file.to_path_buf())).collect();
        if !new.is_empty() {
            (frames.first..=frames.last).map(of_frame).try_for_each(|any| any.check_apart(&new, &options))?;
        }
        Ok::<_, Error>((this, description))
    };
    let is_wanted = |of_frame: &RenderArgs| {
        let is_there = args.resume && of_frame.all_files(&options).iter().all(|file| file.exists());
        if is_there {
            args.output.say(&format!("{}: there already", of_frame.file()));
            locked(kept).push(of_frame.file());
        }
        !is_there
    };
    let mut wanted = (frames.first..=frames.last).map(of_frame).filter(is_wanted);
    let Some(first) = wanted.next() else { return Ok(()) };
    first.check_files(&options)?;
    let (of_first, description) = describe(first)?;
    args.output.warn(&description.warnings);
    if options.integrator == crate::shade::Integrator::Rt {
        check_rt(&description, args.scene.options.lenient, &args.output)?;
    }
    let rest = wanted.map(describe);
    with_pool(args.threads.count(), || match args.scene.options.precision(&description) {
        Precision::F32 => all::<f32>((of_first, description), rest, &options, told),
        Precision::F64 => all::<f64>((of_first, description), rest, &options, told),
    })
}

type Frame = (RenderArgs, Description);

fn all<S: Shades>(
    first: Frame,
    rest: impl Iterator<Item = Result<Frame>>,
    options: &crate::render::RenderOptions,
    told: &mut Vec<Value>,
) -> Result<()> {
    let mut before: Option<World<S>> = None;
    for frame in std::iter::once(Ok(first)).chain(rest) {
        let (args, description) = frame?;
        let world = World::<S>::compile_after(&description, args.scene.options.build(), before.as_ref())?;
        picture(&args, &description, options, &world, Some(&mut *told))?;
        before = Some(world);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_parse_or_say_what_is_expected() {
        assert_eq!(frames("1..48"), Ok(Frames { first: 1, last: 48 }));
        assert_eq!(frames("7..7"), Ok(Frames { first: 7, last: 7 }));
        for wrong in ["", "3", "..", "5..4", "-1..4", "1..1000000", "1...4"] {
            assert!(frames(wrong).is_err(), "{wrong}");
        }
        assert_eq!(numbered(Path::new("d/out.exr"), 7), Path::new("d/out.0007.exr"));
        assert_eq!(numbered(Path::new("a.b.png"), 12345), Path::new("a.b.12345.png"));
    }
}
