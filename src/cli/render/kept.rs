//! `render --resume`: finished tiles beside the picture.

use super::RenderArgs;
use crate::camera::Camera;
use crate::lanes::compiled_isa;
use crate::measure::env::REVISION;
use crate::render::{Keeper, RenderOptions};
use crate::scene::description::Description;
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
        let (isa, hash, name, precision) = (compiled_isa(), &description.hash, engine.name(), S::PRECISION);
        let build = args.scene.options.build();
        // Whatever decides about bits, and what is counted.
        let of = format!("{REVISION} {isa} {hash} {name} {precision} {build:?} {camera:?} {options:?}");
        Keeper::new(format!("{}.tiles", args.file()).into(), &of)
    })
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
