//! lanecast's own scene format: KDL documents that people write by hand. docs/SCENES.md is its reference.
//!
//! A file passes through `source` (text and errors), `syntax` (nodes), then `settings` (cameras), `lights`,
//! `materials`, `environment`, and `lower` (what is placed where). `fields` reads a statement's values, `expression`
//! computes them.
//!
//! Bounds on any input: [`MAX_BYTES`] of text, `syntax::MAX_NODES` nodes and values, `syntax::MAX_DEPTH`
//! nested blocks, [`MAX_MATERIALS`], `lower::MAX_ITEMS` items after repeats, [`meshes::MAX_GENERATED`] generated
//! triangles, and a step count on repeats. Measured, the worst documents take under 0.5 GiB (generated meshes at most
//! 1 GiB more); pictures have the bounds of [`super::pictures`].

mod cycles;
mod environment;
mod expression;
mod fields;
mod flake;
mod hash;
mod hints;
mod images;
mod keys;
mod lights;
mod lower;
mod materials;
mod mesh_files;
pub mod meshes;
mod metals;
mod number;
mod scope;
mod settings;
mod shapes;
mod sky;
mod solids;
pub(crate) mod source;
pub(crate) mod syntax;
pub mod terrain;
#[cfg(test)]
mod tests;
mod token;
mod transform;
mod twig;

pub use keys::FRAME;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use sha2::{Digest, Sha256};

use self::images::Images;
use self::lower::{Lowering, Place};
use self::materials::Mix;
use self::meshes::{MeshFiles, Store, add_mesh_materials};
use self::scope::Scope;
use self::source::{Source, quote};
use self::syntax::Node;
use crate::error::Result;
use crate::scene::description::{Description, Group, GroupId};

/// Largest scene file, bytes.
pub const MAX_BYTES: u64 = 64 << 20;
/// Most materials of a scene file.
pub const MAX_MATERIALS: usize = 1 << 18;

/// Statements that may stand once in a document.
const ONCE: [&str; 6] = ["scene", "units", "precision", "background", "ambient", "environment"];

/// Reads the scene in `bytes`.
///
/// `file` is the name errors show, `name` is the scene's name unless a `scene` statement gives one, `set` holds the
/// values of `--set` (the last of a name counts), `files` the way to mesh files. Description's `source` is left empty.
///
/// # Errors
/// The first thing that is wrong, with line and column; unknown names in `set`.
pub fn parse(
    file: &Path,
    name: &str,
    bytes: &[u8],
    set: &[(String, String)],
    files: &MeshFiles<'_>,
) -> Result<Description> {
    let source = Source::new(file, bytes)?;
    let nodes = syntax::read(source)?;
    let mut lowering = Lowering {
        scope: Scope::new(source),
        description: Description::new(name),
        materials: HashMap::from([("default", 0)]),
        groups: HashMap::new(),
        definitions: HashMap::new(),
        links: Vec::new(),
        store: Store::default(),
        files,
        metres: None,
        item_count: 0,
        camera_names: HashSet::new(),
    };
    keys::define_frame(&mut lowering.scope, &nodes, set)?;
    for node in nodes.iter().filter(|n| n.name == "parameter") {
        settings::parameter(&mut lowering.scope, node, set)?;
    }
    settings::check_set(&lowering.scope, set)?;
    declare(&mut lowering, &nodes)?;
    for node in &nodes {
        statement(&mut lowering, node)?;
    }
    let names: Vec<&str> = lowering.description.groups.iter().map(|g| g.name.as_str()).collect();
    cycles::check(source, &names, &lowering.links)?;
    let mut description = lowering.description;
    description.parameters = lowering.scope.written;
    description.hash = hash(bytes, &lowering.store.digests, set);
    description.meshes = lowering.store.meshes;
    add_mesh_materials(&mut description);
    Ok(description)
}

/// Takes up what later statements refer to, wherever it stands: units, materials, the names of groups.
fn declare<'a, 'n>(lowering: &mut Lowering<'a, 'n>, nodes: &'n [Node<'a>]) -> Result<()> {
    let source = lowering.scope.source;
    let mut seen = HashSet::new();
    let (mut images, mut mixes) = (Images::new(lowering.files), Vec::new());
    for node in nodes {
        let name = node.name.as_ref();
        if ONCE.contains(&name) && !seen.insert(name) {
            return Err(source.error(node.span, format!("`{name}` is given twice")));
        }
        match name {
            "units" => lowering.metres = Some(settings::units(&lowering.scope, node)?),
            "material" => mixes.extend(material(lowering, node, &mut images)?),
            "define" => {
                let Some((title, span)) = node.title() else {
                    return Err(source.error(node.span, "expected `define \"name\" { ... }`"));
                };
                let group = lowering.description.groups.len() as GroupId;
                if lowering.groups.insert(title, group).is_some() {
                    return Err(source.error(span, format!("group {} is defined twice", quote(title))));
                }
                lowering.definitions.insert(title, node);
                lowering.description.groups.push(Group { name: title.to_string(), items: Vec::new() });
            }
            _ => {}
        }
    }
    let known = &lowering.materials;
    let find = |name: &str| known.get(name).copied();
    materials::resolve(&lowering.scope, &mixes, &mut lowering.description.materials, find, known.keys().copied())?;
    let (textures, digests): (_, Vec<[u8; 32]>) = images.decode(source)?.into_iter().unzip();
    lowering.description.textures = textures;
    lowering.store.digests.extend(digests);
    Ok(())
}

fn material<'a, 'n>(
    lowering: &mut Lowering<'a, 'n>,
    node: &'n Node<'a>,
    images: &mut Images<'_>,
) -> Result<Option<Mix<'n>>> {
    let materials = &lowering.description.materials;
    let (name, span) = node.title().unwrap_or(("", node.span));
    let is_default = name == "default" && materials[0] == Default::default();
    let id = if is_default { 0 } else { materials.len() as u32 };
    let (material, mix) = materials::material(&lowering.scope, node, id, images)?;
    lowering.description.warnings.extend(materials::warning(&material));
    let materials = &mut lowering.description.materials;
    if is_default {
        materials[0] = material;
        return Ok(mix);
    }
    if lowering.materials.contains_key(name) {
        return Err(lowering.scope.source.error(span, format!("material {} is defined twice", quote(name))));
    }
    if materials.len() > MAX_MATERIALS {
        return Err(lowering.scope.source.error(node.span, format!("more than {MAX_MATERIALS} materials")));
    }
    lowering.materials.insert(name, id);
    materials.push(material);
    Ok(mix)
}

/// Carries out one statement of the top level.
fn statement<'a, 'n>(lowering: &mut Lowering<'a, 'n>, node: &'n Node<'a>) -> Result<()> {
    let scope = &lowering.scope;
    let description = &mut lowering.description;
    match node.name.as_ref() {
        "parameter" | "units" | "material" => {}
        "scene" => description.name = settings::only_name(scope, node)?.0.into(),
        "precision" => description.precision = Some(settings::precision(scope, node)?),
        "background" => description.background = settings::only_colour(scope, node)?,
        "ambient" => description.ambient = settings::only_colour(scope, node)?,
        "light" => description.lights.push(lights::light(scope, node)?),
        "environment" => {
            let (environment, digest) = environment::environment(scope, node, lowering.files)?;
            description.environment = Some(environment);
            lowering.store.digests.extend(digest);
        }
        "camera" => {
            let camera = settings::camera(scope, node)?;
            if !lowering.camera_names.insert(camera.name.clone()) {
                let what = format!("camera {} is defined twice", quote(&camera.name));
                return Err(scope.source.error(node.span, what));
            }
            description.cameras.push(camera);
        }
        "define" => {
            let (name, _) = node.title().unwrap_or(("", node.span));
            let group = lowering.groups.get(name).copied().unwrap_or(0);
            lowering.define(node, group)?;
        }
        _ => lowering.item(node, Place::root_of(0))?,
    }
    Ok(())
}

/// SHA-256, hex, over the file, the referenced files and the values set; each part with its length before it. Of the values only what
/// makes the scene counts: the last of a name, whatever the order of names.
fn hash(bytes: &[u8], digests: &[[u8; 32]], set: &[(String, String)]) -> String {
    let mut hasher = Sha256::new();
    let mut part = |bytes: &[u8]| {
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    part(bytes);
    digests.iter().for_each(|d| part(d));
    let values: BTreeMap<&str, &str> = set.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
    values.into_iter().flat_map(|(name, value)| [name, value]).for_each(|word| part(word.as_bytes()));
    hasher.finalize().iter().map(|b| format!("{b:02x}")).collect()
}
