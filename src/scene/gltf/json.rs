//! The JSON of a glTF document: only what the importer reads, as plain structs.
//!
//! Every field that most objects lack is boxed: a document of millions of empty objects stays small.

use std::path::Path;

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};

use super::container::Parts;
use super::json_looks::{Image, Material, NodeLight, RootExtensions, Sampler, Texture};
use crate::error::{Error, Result};
use crate::scene::text;

/// Longest message of the JSON reader that is shown: it quotes strings of the file in full.
const MAX_MESSAGE: usize = 160;

/// The top level.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Root {
    pub asset: Asset,
    #[serde(default)]
    pub extensions_used: Vec<Box<str>>,
    #[serde(default)]
    pub extensions_required: Vec<Box<str>>,
    pub scene: Option<u32>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub textures: Vec<Texture>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
    #[serde(default)]
    pub images: Vec<Image>,
    #[serde(default)]
    pub skins: Vec<IgnoredAny>,
    #[serde(default)]
    pub animations: Vec<IgnoredAny>,
    pub extensions: Option<Box<RootExtensions>>,
}

#[derive(Debug, Deserialize)]
pub struct Asset {
    pub version: Box<str>,
}

#[derive(Debug, Deserialize)]
pub struct Scene {
    #[serde(default)]
    pub nodes: Box<[u32]>,
}

#[derive(Debug, Deserialize)]
pub struct Node {
    pub name: Option<Box<str>>,
    #[serde(default)]
    pub children: Box<[u32]>,
    pub mesh: Option<u32>,
    pub camera: Option<u32>,
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<Box<[f64; 3]>>,
    pub rotation: Option<Box<[f64; 4]>>,
    pub scale: Option<Box<[f64; 3]>>,
    pub extensions: Option<Box<NodeExtensions>>,
    #[serde(default, rename = "weights", deserialize_with = "any_but_zero")]
    pub is_morphed: bool,
}

#[derive(Debug, Deserialize)]
pub struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
}

#[derive(Debug, Deserialize)]
pub struct Instancing {
    #[serde(default)]
    pub attributes: InstanceAttributes,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub struct InstanceAttributes {
    pub translation: Option<u32>,
    pub rotation: Option<u32>,
    pub scale: Option<u32>,
}

#[derive(Debug, Deserialize)]
pub struct Mesh {
    pub name: Option<Box<str>>,
    #[serde(default)]
    pub primitives: Box<[Primitive]>,
    #[serde(default, rename = "weights", deserialize_with = "any_but_zero")]
    pub is_morphed: bool,
}

/// Of the weights of morph targets, whether any of them shows: that takes no room in objects without.
fn any_but_zero<'de, D: Deserializer<'de>>(weights: D) -> std::result::Result<bool, D::Error> {
    let weights = Option::<Vec<f64>>::deserialize(weights)?;
    Ok(weights.is_some_and(|weights| weights.iter().any(|&weight| weight != 0.0)))
}

#[derive(Debug, Deserialize)]
pub struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    pub mode: Option<u32>,
    pub extensions: Option<PrimitiveExtensions>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub struct Attributes {
    pub position: Option<u32>,
    pub normal: Option<u32>,
    pub tangent: Option<u32>,
    pub texcoord_0: Option<u32>,
    pub texcoord_1: Option<u32>,
    pub color_0: Option<u32>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Accessor {
    pub buffer_view: Option<u32>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: Box<str>,
    pub sparse: Option<Box<Sparse>>,
}

#[derive(Debug, Deserialize)]
pub struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BufferView {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Buffer {
    pub uri: Option<Box<str>>,
    pub byte_length: u64,
}

#[derive(Debug, Deserialize)]
pub struct Camera {
    pub name: Option<Box<str>>,
    pub perspective: Option<Box<Perspective>>,
    pub orthographic: Option<Box<Orthographic>>,
}

#[derive(Debug, Deserialize)]
pub struct Perspective {
    pub yfov: f64,
}

#[derive(Debug, Deserialize)]
pub struct Orthographic {
    pub ymag: f64,
}

/// What tells a document of version 1 from this one: there, lists are maps and the rest cannot be read at all.
#[derive(Deserialize)]
struct Head {
    asset: Asset,
}

/// Reads the JSON of `parts`.
///
/// # Errors
/// Text that is not JSON, or not of this shape: at line and column, or at the byte of a binary file.
pub fn read(file: &Path, parts: &Parts<'_>) -> Result<Root> {
    let text = parts.json;
    let wrong = match serde_json::from_slice::<Root>(text) {
        Ok(root) if is_version_2(&root.asset.version) => return Ok(root),
        Ok(root) => return Err(other_version(file, &root.asset.version)),
        Err(wrong) => wrong,
    };
    if let Ok(head) = serde_json::from_slice::<Head>(text)
        && !is_version_2(&head.asset.version)
    {
        return Err(other_version(file, &head.asset.version));
    }
    let what = wrong.to_string();
    let end = what.rfind(" at line ").unwrap_or(what.len());
    let mut what: String = what[..end].chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if let Some((cut, _)) = what.char_indices().nth(MAX_MESSAGE) {
        what.replace_range(cut.., "…");
    }
    let start = start_of_line(text, wrong.line());
    let at = (start + wrong.column().saturating_sub(1)).min(text.len());
    Err(match parts.json_at {
        Some(json_at) => Error::at_byte(file, (json_at + at) as u64, what),
        None => text::error_at(file, text, at, what),
    })
}

fn is_version_2(version: &str) -> bool {
    version.split('.').next() == Some("2")
}

fn other_version(file: &Path, version: &str) -> Error {
    let found = text::shown(version.as_bytes());
    Error::whole(file, format!("asset.version: expected glTF 2.0, found {found}"))
}

/// The byte at which the 1-based `line` begins, lines as the JSON reader counts them.
fn start_of_line(text: &[u8], line: usize) -> usize {
    let ends = text.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(at, _)| at + 1);
    line.checked_sub(2).map_or(0, |before| ends.into_iter().nth(before).unwrap_or(text.len()))
}
