//! Opening a scene by what the user typed: a file (by extension) or `builtin:NAME`.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;
use sha2::{Digest, Sha256};

use super::description::{Description, Item, ItemKind};
use super::kdl::meshes::{MeshFile, MeshFiles, add_looks, add_mesh_materials};
use super::obj::looks::Looks;
use super::reference::{Found, References};
use super::unpack::UnpackLimit;
use super::{brlcad, builtin, gltf, kdl, obj, openscad, ply, stl, unmapped, unpack};
use crate::error::{Error, Result, nearest_name};

/// Extensions that [`load`] reads; files may also be packed (`.ply.gz`, `.glb.zst`).
pub const EXTENSIONS: [&str; 9] = ["kdl", "obj", "ply", "stl", "gltf", "glb", "asc", "g", "csg"];

/// Kind of our own scene files, which the built-in ones are too.
const SCENE_FILE: &str = "kdl";
/// A packed one is no larger than one that is not.
const SCENE_FILE_LIMIT: UnpackLimit = UnpackLimit { floor: kdl::MAX_BYTES, ratio: 0, cap: kdl::MAX_BYTES };
/// Kinds of BRL-CAD databases.
const DATABASES: [&str; 2] = ["asc", "g"];

/// How to open a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `--set NAME=VALUE` pairs, applied to the parameters of a scene file.
    pub set: Vec<(String, String)>,
    /// Of a BRL-CAD database: what to show.
    pub brlcad: brlcad::describe::Options,
    /// Allow references to files that leave the scene file's folder.
    pub allow_outside: bool,
    /// Of a glTF file: trace each mesh that it places as an instance.
    pub apart: bool,
}

/// How a mesh file is read.
pub type ReadMesh<'a> = dyn Fn(&Path, &References<'_>) -> Result<MeshFile> + 'a;

/// Opens `scene`: `builtin:NAME` or a path.
///
/// # Errors
/// Unknown built-in names and extensions, unreadable or malformed files, unknown `--set` names, options that mean
/// nothing to a scene of its kind.
pub fn load(scene: &str, options: &LoadOptions) -> Result<Description> {
    load_with(scene, options, &read_mesh)
}

/// Checks what can be told of `scene` without opening it: that it is there, is a scene by its name, and takes such `options`.
///
/// # Errors
/// As [`load`].
pub fn check(scene: &str, options: &LoadOptions) -> Result<()> {
    check_options(scene, &kind(scene)?, options)?;
    match scene.strip_prefix("builtin:") {
        Some(name) if builtin::text(name).is_none() => builtin::load(name, &[]).map(drop),
        Some(_) => Ok(()),
        None => std::fs::metadata(scene).map(drop).map_err(|e| Error::io(scene, e)),
    }
}

/// As [`load`], with meshes read by `read` (see [`read_mesh`]) instead: for who remembers them.
///
/// # Errors
/// As [`load`], and those of `read`.
pub fn load_with(scene: &str, options: &LoadOptions, read: &ReadMesh<'_>) -> Result<Description> {
    let kind = kind(scene)?;
    check_options(scene, &kind, options)?;
    if let Some(name) = scene.strip_prefix("builtin:") {
        return builtin::load(name, &options.set);
    }
    let path = Path::new(scene);
    let found = Found::default();
    let folder = path.parent().unwrap_or(Path::new(""));
    let references = References { folder: Some(folder), allow_outside: options.allow_outside, found: Some(&found) };
    let mut description = match kind.as_str() {
        "kdl" => scene_file(path, options, &references, read)?,
        "gltf" | "glb" => gltf_scene(path, options, &references)?,
        "asc" | "g" => database(path, options)?,
        "csg" => openscad_model(path, &references, read)?,
        _ => mesh_scene(path, &references, read)?,
    };
    description.source = Some(path.to_path_buf());
    description.files = found.into_files();
    unmapped::warn(&mut description);
    Ok(description)
}

fn scene_file(
    path: &Path,
    options: &LoadOptions,
    references: &References<'_>,
    read: &ReadMesh<'_>,
) -> Result<Description> {
    let bytes = unpack::read_file_within(path, SCENE_FILE_LIMIT)?;
    let read = |path: &Path| read(path, references);
    let References { folder, allow_outside, found } = *references;
    let files = MeshFiles { folder, allow_outside, found, read: &read };
    kdl::parse(path, &stem(path), &bytes, &options.set, &files)
}

fn gltf_scene(path: &Path, options: &LoadOptions, references: &References<'_>) -> Result<Description> {
    let bytes = unpack::read_file(path)?;
    let mut description = gltf::parse(path, &stem(path), &bytes, references)?;
    description.joins &= !options.apart;
    Ok(description)
}

fn database(path: &Path, options: &LoadOptions) -> Result<Description> {
    let bytes = unpack::read_file(path)?;
    let database = brlcad::parse(path, &bytes)?;
    let mut description = brlcad::describe::describe(path, &stem(path), &database, &options.brlcad)?;
    let mut digest = Sha256::new_with_prefix(&bytes);
    options.brlcad.tops.iter().for_each(|top| digest.update(format!("\0{top}")));
    description.hash = digest.finalize().iter().map(|b| format!("{b:02x}")).collect();
    Ok(description)
}

fn openscad_model(path: &Path, references: &References<'_>, read: &ReadMesh<'_>) -> Result<Description> {
    let bytes = unpack::read_file_within(path, openscad::LIMIT)?;
    openscad::parse(path, &stem(path), &bytes, references, &|path| read(path, references))
}

/// Refuses options that mean nothing to a scene of kind `kind`: whoever gave them meant another one.
fn check_options(scene: &str, kind: &str, options: &LoadOptions) -> Result<()> {
    let unknown = |option: &str, why: &str| Err(Error::Usage(format!("{option}: {scene} {why}")));
    if let (Some((name, _)), false) = (options.set.first(), kind == SCENE_FILE) {
        return unknown(&format!("--set {name}"), "has no parameters");
    }
    if options.apart && !["gltf", "glb"].contains(&kind) {
        return unknown("--apart", "is no glTF file");
    }
    if DATABASES.contains(&kind) {
        return Ok(());
    }
    match options.brlcad.tops.first() {
        Some(top) => unknown(&format!("--top {top}"), "is no BRL-CAD database"),
        None if options.brlcad.lenient => unknown("--lenient", "is no BRL-CAD database"),
        None => Ok(()),
    }
}

/// A scene of one mesh.
fn mesh_scene(path: &Path, references: &References<'_>, read: &ReadMesh<'_>) -> Result<Description> {
    let MeshFile { mut mesh, digest, looks } = read(path, references)?;
    let mut description = Description::new(stem(path));
    let digest = match looks.digests.as_slice() {
        [] => digest,
        others => {
            others.iter().fold(Sha256::new_with_prefix(digest), |all, one| all.chain_update(one)).finalize().into()
        }
    };
    description.hash = digest.iter().map(|b| format!("{b:02x}")).collect();
    add_looks(&mut description, &mut mesh, looks, path, |_| false);
    description.meshes.push(Arc::new(mesh));
    description.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
    add_mesh_materials(&mut description);
    Ok(description)
}

/// Reads the mesh in `path`, told by its extension, and the material libraries that an OBJ file names; `references` is
/// the scene's folder, out of which no library and no texture may be.
///
/// # Errors
/// Unknown extensions, unreadable or malformed files.
pub fn read_mesh(path: &Path, references: &References<'_>) -> Result<MeshFile> {
    let inner = unpack::inner_extension(path).unwrap_or_default();
    if !["obj", "ply", "stl"].contains(&inner.as_str()) {
        return Err(match inner.as_str() {
            "gltf" | "glb" => {
                let error = Error::whole(path, "expected a mesh file (.obj, .ply or .stl): glTF holds a whole scene");
                error.with_help("open the glTF file by itself")
            }
            _ => Error::whole(path, "expected a mesh file: .obj, .ply or .stl"),
        });
    }
    let bytes = unpack::read_file(path)?;
    let digest = Sha256::digest(&bytes).into();
    let (mesh, looks) = match inner.as_str() {
        "obj" => {
            let file = obj::parse(path, &bytes)?;
            drop(bytes);
            let looks = obj::looks::read(path, &file, references)?;
            (file.mesh, looks)
        }
        "ply" => {
            let file = ply::read(path, &bytes)?;
            (file.mesh, Looks { warnings: file.warnings, ..Looks::default() })
        }
        _ => (stl::parse(path, &bytes)?, Looks::default()),
    };
    Ok(MeshFile { mesh, digest, looks })
}

/// Whether `scene` is a BRL-CAD database, by its name.
pub fn is_database(scene: &str) -> bool {
    kind(scene).is_ok_and(|kind| DATABASES.contains(&kind.as_str()))
}

/// Whether `scene` can have parameters, by its name: built-in scenes and scene files of our own.
pub fn has_parameters(scene: &str) -> bool {
    kind(scene).is_ok_and(|kind| kind == SCENE_FILE)
}

/// The kind of file that `scene` is: one of [`EXTENSIONS`].
fn kind(scene: &str) -> Result<String> {
    if scene.starts_with("builtin:") { Ok(SCENE_FILE.into()) } else { extension(Path::new(scene)) }
}

/// The known extension of `path`, lower case, without the packing's.
fn extension(path: &Path) -> Result<String> {
    let inner = unpack::inner_extension(path).unwrap_or_default();
    if EXTENSIONS.contains(&inner.as_str()) {
        return Ok(inner);
    }
    let all: Vec<String> = EXTENSIONS.iter().map(|e| format!(".{e}")).collect();
    let what = format!("expected a scene ({}, also .gz or .zst) or builtin:NAME", all.join(" "));
    let error = Error::whole(path, what);
    // Of one letter, or of none, any other letter is near.
    let near = if inner.len() > 1 { nearest_name(&inner, EXTENSIONS) } else { None };
    Err(match near.or(nearest_name(&path.to_string_lossy(), builtin::NAMES)) {
        Some(near) if builtin::NAMES.contains(&near) => error.with_help(format!("did you mean `builtin:{near}`?")),
        Some(near) => error.with_help(format!("did you mean `.{near}`?")),
        None => error,
    })
}

/// The file's name up to its first dot.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.trim_start_matches('.').split('.').next().unwrap_or_default().to_string()
}
