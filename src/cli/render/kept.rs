//! `render --resume`: finished tiles beside the picture.

use super::RenderArgs;
use crate::camera::Camera;
use crate::lanes::compiled_isa;
use crate::measure::env::REVISION;
use crate::render::{Keeper, RenderOptions};
use crate::scene::description::Description;
use crate::scene::world::BuildSettings;
use crate::shade::Shades;
use crate::trace::Engine;

/// Where the finished tiles of a picture are kept, if they are.
pub(super) fn keeper<S: Shades>(
    args: &RenderArgs,
    description: &Description,
    engine: &dyn Engine<S>,
    camera: &Camera,
    options: &RenderOptions,
) -> Option<Keeper> {
    args.keeps_tiles().then(|| {
        let of = subject(args.scene.options.build(), description, engine, camera, options);
        Keeper::new(format!("{}.tiles", args.file()).into(), &of)
    })
}

/// Whatever decides about a picture's bits, and what is counted.
fn subject<S: Shades>(
    build: BuildSettings,
    description: &Description,
    engine: &dyn Engine<S>,
    camera: &Camera,
    options: &RenderOptions,
) -> String {
    let (isa, hash, name, precision) = (compiled_isa(), &description.hash, engine.name(), S::PRECISION);
    // The hash is that of the files: `--apart` is not in it.
    let joins = description.joins;
    format!("{REVISION} {isa} {hash} {joins} {name} {precision} {build:?} {camera:?} {options:?}")
}

/// Says how many of `total` tiles were there already, and why none are kept any more, if so.
pub(super) fn say(args: &RenderArgs, keeper: &Keeper, total: u64) {
    if keeper.found() > 0 {
        args.output.say(&format!("{} of {total} tiles were kept from before", keeper.found()));
    }
    if let Some(trouble) = keeper.trouble() {
        args.output.warn([&format!("finished tiles are not kept any more: {trouble}")]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::framing;
    use crate::trace::engine;

    #[test]
    fn tiles_of_joined_meshes_are_not_those_of_meshes_apart() {
        let camera = Camera::new(&framing(None, 1.0), 1.0).unwrap();
        let engine = engine::<f32>("scalar").unwrap();
        let [joined, apart, again] = [true, false, true].map(|joins| {
            let description = Description { joins, ..Description::new("a") };
            subject(BuildSettings::default(), &description, engine, &camera, &RenderOptions::default())
        });
        assert_ne!(joined, apart);
        assert_eq!(joined, again);
    }
}
