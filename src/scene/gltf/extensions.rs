//! Which extensions a document may require, and what is said about the others.

use std::path::Path;

use super::json::Root;
use crate::error::{Error, Result};
use crate::scene::text;

/// Extensions that are read.
const READ: [&str; 8] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_texture_transform",
];
/// Beginnings of the names of extensions without which surfaces look different, but are where they are.
const LOOKS: [&str; 2] = ["KHR_materials_", "EXT_materials_"];
/// Most names of unknown extensions that a warning lists.
const LISTED: usize = 8;

/// Refuses documents that cannot be shown rightly; warnings about what is not read.
///
/// # Errors
/// A required extension that is not supported and could change geometry, or without which there are no pictures.
pub fn check(file: &Path, root: &Root) -> Result<Vec<String>> {
    for (i, name) in root.extensions_required.iter().enumerate() {
        if !is_harmless(name) {
            let shown = text::shown(name.as_bytes());
            let what = format!("extensionsRequired[{i}]: the extension {shown} is not supported");
            let error = Error::whole(file, what);
            return Err(if name.contains("compression") {
                error.with_help("write the file again without compression")
            } else if name.contains("_texture_") {
                error.with_help("write the file again with its pictures as PNG or JPEG")
            } else {
                error
            });
        }
    }
    let mut warnings = Vec::new();
    let unknown: Vec<_> = root.extensions_used.iter().filter(|name| !READ.contains(&&***name)).collect();
    if !unknown.is_empty() {
        let names: Vec<_> = unknown.iter().take(LISTED).map(|name| text::shown(name.as_bytes())).collect();
        let more = if unknown.len() > LISTED { ", ..." } else { "" };
        warnings.push(format!("extensions that are not read: {}{more}", names.join(", ")));
    }
    if !root.skins.is_empty() || !root.animations.is_empty() {
        warnings.push("skins and animations are not applied".into());
    }
    if root.meshes.iter().any(|mesh| mesh.is_morphed) || root.nodes.iter().any(|node| node.is_morphed) {
        warnings.push("morph targets are not applied, though they have weights other than 0".into());
    }
    Ok(warnings)
}

fn is_harmless(name: &str) -> bool {
    READ.contains(&name) || LOOKS.iter().any(|beginning| name.starts_with(beginning))
}
