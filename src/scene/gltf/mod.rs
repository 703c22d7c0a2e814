//! glTF 2.0, text and binary: geometry, nodes as instances, cameras, lights, materials and their textures.
//!
//! Source: Khronos Group, "glTF 2.0 Specification", revision 2.0.1, 2021, and the extensions that are named below.
//! serde_json reads the JSON into structs of our own, because the `gltf` crate slices buffers at positions that it
//! does not check, and panics where a document lies.
//!
//! * `container` splits a binary file, `json` and `json_looks` read the document, `buffers` finds the bytes, `accessor`
//!   views them as numbers, `primitive` makes meshes, `tree` checks the nodes, `walk` places them, `look` reads cameras
//!   and lights, `materials` and `textures` what surfaces look like.
//! * Each primitive is stored once; a mesh is a group of its primitives, which the nodes that use it place, as do the
//!   instances of EXT_mesh_gpu_instancing. Nodes with children are groups.
//! * Read besides: KHR_mesh_quantization, KHR_lights_punctual, KHR_texture_transform, and of KHR_materials_*:
//!   emissive_strength, ior, transmission and unlit (as emission). Skins and animations are not read; a warning says
//!   so.
//!
//! Memory and time: decoded data (vertices, triangles, instances) stay below [`DECODED_PER_BYTE`] bytes per byte of
//! the document and of the files it refers to, however often the same bytes are named; counts are compared with
//! buffers before anything is allocated. The JSON itself takes less than 64 bytes per byte. Pictures have the bounds of
//! [`super::pictures`].

mod accessor;
mod budget;
mod buffers;
mod container;
mod extensions;
mod instances;
mod json;
mod json_looks;
mod look;
mod materials;
mod primitive;
mod textures;
mod tree;
mod walk;

use std::fmt::Display;
use std::path::Path;

use sha2::{Digest, Sha256};

use self::budget::Budget;
use self::buffers::Buffers;
use self::json::Root;
use super::description::Description;
use super::reference::References;
use crate::error::{Error, Result};

pub use self::budget::DECODED_PER_BYTE;

/// Reads the scene in `bytes`: the document's default scene, else its first, else all nodes without a parent.
///
/// `file` is the name errors show (a name that ends in `.glb`, packed or not, asks for a binary file), `name` becomes
/// the scene's name, `references` leads to the files of buffers. Description's `source` is left empty.
///
/// # Errors
/// In JSON text, at line and column, and in a binary file, at the byte: what is not JSON or not of glTF's shape. Else
/// with the path in the document (`meshes[3].primitives[0].indices`): indices that name nothing, ranges beyond a
/// buffer, types that do not fit, nodes that are no tree, required extensions that are not supported, decoded data
/// beyond [`DECODED_PER_BYTE`].
pub fn parse(file: &Path, name: &str, bytes: &[u8], references: &References<'_>) -> Result<Description> {
    let parts = container::split(file, bytes)?;
    let root = json::read(file, &parts)?;
    let mut description = Description::new(name);
    description.joins = true;
    description.warnings = extensions::check(file, &root)?;
    let document = Document {
        file,
        root: &root,
        buffers: Buffers::new(&root.buffers, parts.bin, *references),
        budget: Budget::new(bytes.len() as u64),
    };
    let pictures = materials::add(&document, &mut description)?;
    let roots = tree::roots(&document)?;
    walk::place(&document, &roots, &mut description)?;
    description.hash = hash(bytes, &[document.buffers.digests(), pictures].concat());
    Ok(description)
}

/// A document and what it refers to.
struct Document<'a> {
    file: &'a Path,
    root: &'a Root,
    buffers: Buffers<'a>,
    budget: Budget,
}

impl Document<'_> {
    /// The error that `what` is wrong at `path` in the document.
    fn error(&self, path: impl Display, what: impl Display) -> Error {
        Error::whole(self.file, format!("{path}: {what}"))
    }

    /// Element `index` of the top-level list called `name`, which `path` refers to.
    fn get<'l, T>(&self, list: &'l [T], name: &str, index: u32, path: impl Display) -> Result<&'l T> {
        list.get(index as usize).ok_or_else(|| {
            let what = match list.len() {
                0 => format!("names {name}[{index}], but there are no {name}"),
                n => format!("names {name}[{index}], but the last one is {name}[{}]", n - 1),
            };
            self.error(path, what)
        })
    }

    /// Takes `bytes` of decoded data from the allowance; `path` is what needs them.
    fn spend(&self, bytes: u64, path: impl Display) -> Result<()> {
        self.budget.spend(bytes, self.buffers.external_bytes()).map_err(|what| self.error(path, what))
    }
}

/// SHA-256, hex, over the document, the files of its buffers and its pictures.
fn hash(bytes: &[u8], files: &[[u8; 32]]) -> String {
    let mut digest: [u8; 32] = Sha256::digest(bytes).into();
    if !files.is_empty() {
        let mut hasher = Sha256::new_with_prefix(digest);
        files.iter().for_each(|file| hasher.update(file));
        digest = hasher.finalize().into();
    }
    digest.iter().map(|b| format!("{b:02x}")).collect()
}
