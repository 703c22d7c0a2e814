//! Built-in scenes: the files of scenes/, embedded, so that `builtin:NAME` works from anywhere and shows how a
//! scene file is written. Whatever is too big to write by hand comes from the format's generators.

use std::path::PathBuf;

use super::description::Description;
use super::kdl::{self, meshes::MeshFiles};
use crate::error::{Error, Result, nearest_name};

/// Names for `builtin:NAME`, in the order they are listed.
pub const NAMES: [&str; 15] = [
    "teaching",
    "sphere-flake",
    "cornell",
    "gallery",
    "terrain",
    "forest",
    "bolt",
    "die",
    "rook",
    "sponge",
    "cornell-box",
    "still-life",
    "materials",
    "furnace",
    "csg-lit",
];

/// The text of built-in scene `name`, in lanecast's scene format.
pub fn text(name: &str) -> Option<&'static str> {
    Some(match name {
        "teaching" => include_str!("../../../scenes/teaching.kdl"),
        "sphere-flake" => include_str!("../../../scenes/sphere-flake.kdl"),
        "cornell" => include_str!("../../../scenes/cornell.kdl"),
        "gallery" => include_str!("../../../scenes/gallery.kdl"),
        "terrain" => include_str!("../../../scenes/terrain.kdl"),
        "forest" => include_str!("../../../scenes/forest.kdl"),
        "bolt" => include_str!("../../../scenes/bolt.kdl"),
        "die" => include_str!("../../../scenes/die.kdl"),
        "rook" => include_str!("../../../scenes/rook.kdl"),
        "sponge" => include_str!("../../../scenes/sponge.kdl"),
        "cornell-box" => include_str!("../../../scenes/cornell-box.kdl"),
        "still-life" => include_str!("../../../scenes/still-life.kdl"),
        "materials" => include_str!("../../../scenes/materials.kdl"),
        "furnace" => include_str!("../../../scenes/furnace.kdl"),
        "csg-lit" => include_str!("../../../scenes/csg-lit.kdl"),
        _ => return None,
    })
}

/// Built-in scene `name` with the parameters `set` changed.
///
/// # Errors
/// Unknown names of scenes or parameters (with the nearest known one), values that are not expressions.
pub fn load(name: &str, set: &[(String, String)]) -> Result<Description> {
    let Some(text) = text(name) else {
        let hint = nearest_name(name, NAMES).map_or(String::new(), |n| format!("; did you mean `builtin:{n}`?"));
        let all = NAMES.join(", ");
        return Err(Error::Usage(format!("no built-in scene is called `{name}`: there are {all}{hint}")));
    };
    let file = PathBuf::from(format!("builtin:{name}"));
    let read = |path: &std::path::Path| Err(Error::whole(path, "built-in scenes read no files"));
    let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read };
    kdl::parse(&file, name, text.as_bytes(), set, &files)
}
