//! Opening a scene by what the user typed: a file (by extension) or `builtin:NAME`. (being built)

use super::description::Description;
use crate::error::Result;

/// How to open a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `--set NAME=VALUE` pairs, applied to the parameters of a scene file.
    pub set: Vec<(String, String)>,
    /// Allow mesh references that leave the scene file's folder.
    pub allow_outside: bool,
}

/// Opens `scene`: `builtin:NAME` or a path.
///
/// # Errors
/// Unknown built-in names and extensions, unreadable or malformed files, unknown `--set` names.
pub fn load(scene: &str, options: &LoadOptions) -> Result<Description> {
    let _ = (scene, options);
    unimplemented!()
}
