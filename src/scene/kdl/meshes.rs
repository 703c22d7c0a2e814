//! Meshes of a scene: files, generated ones, polygons. Each distinct one is stored once.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::Result;
use crate::scene::description::{Description, Material};
use crate::scene::mesh::Mesh;
use crate::scene::obj::looks::{Looks, NAMED};
use crate::scene::reference::{Found, References};
use crate::scene::solids::flat::closed;
use crate::scene::text::shown;

/// Most triangles that generators and polygons of one document may make.
pub const MAX_GENERATED: u64 = 1 << 24;

/// A mesh read from a file.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// Its triangles.
    pub mesh: Mesh,
    /// SHA-256 of the file's bytes.
    pub digest: [u8; 32],
    /// What the file says of the looks of its materials.
    pub looks: Looks,
}

/// How mesh references become meshes.
pub struct MeshFiles<'a> {
    /// Folder that references are relative to; `None` if the scene has no folder and refers to no files.
    pub folder: Option<&'a Path>,
    /// Whether references may leave the folder.
    pub allow_outside: bool,
    /// Who keeps which files were meant.
    pub found: Option<&'a Found>,
    /// Reads and parses a mesh file.
    pub read: &'a dyn Fn(&Path) -> Result<MeshFile>,
}

impl MeshFiles<'_> {
    /// The file that a scene means by `written`.
    ///
    /// # Errors
    /// Those of [`References::resolve`].
    pub fn resolve(&self, written: &str) -> std::result::Result<PathBuf, String> {
        References { folder: self.folder, allow_outside: self.allow_outside, found: self.found }.resolve(written)
    }
}

/// What makes a stored mesh the same as another.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Key {
    /// The file it was read from, resolved.
    File(PathBuf),
    /// The name by which the scene refers to it.
    Written(String),
    /// Terrain of a size and seed.
    Terrain(u32, u32),
    /// Twig of a number of leaves and a seed.
    Twig(u32, u32),
}

/// The meshes found so far.
#[derive(Debug, Default)]
pub struct Store {
    /// Meshes in order of their first use.
    pub meshes: Vec<Arc<Mesh>>,
    /// Digests of the files among them, in the same order.
    pub digests: Vec<[u8; 32]>,
    by_key: HashMap<Key, u32>,
    generated: u64,
    /// Meshes that were seen to be closed.
    closed: HashSet<u32>,
}

impl Store {
    /// The stored mesh with `key`.
    pub fn find(&self, key: &Key) -> Option<u32> {
        self.by_key.get(key).copied()
    }

    /// Refuses mesh `index` if it has no inside; each is looked at once.
    ///
    /// # Errors
    /// In words, where it is open.
    pub fn check_closed(&mut self, index: u32) -> std::result::Result<(), String> {
        if !self.closed.contains(&index) {
            closed(&self.meshes[index as usize])?;
            self.closed.insert(index);
        }
        Ok(())
    }

    /// Takes `triangles` from the allowance of generated triangles; false if it does not suffice.
    pub fn allow(&mut self, triangles: u64) -> bool {
        self.generated = self.generated.saturating_add(triangles);
        self.generated <= MAX_GENERATED
    }

    /// Makes `key` find mesh `index` too.
    pub fn alias(&mut self, key: Key, index: u32) {
        self.by_key.insert(key, index);
    }

    /// Stores a mesh, under `key` if it may be used again.
    pub fn add(&mut self, key: Option<Key>, mesh: Mesh) -> u32 {
        let index = self.meshes.len() as u32;
        self.meshes.push(Arc::new(mesh));
        if let Some(key) = key {
            self.by_key.insert(key, index);
        }
        index
    }
}

/// The polygon with corners `positions`, fanned from its first corner, with texture coordinates if there are any.
pub fn polygon(positions: Vec<glam::DVec3>, uvs: Vec<[f32; 2]>) -> Mesh {
    let triangles = (2..positions.len() as u32).map(|i| [0, i - 1, i]).collect();
    let mut mesh = Mesh { positions, triangles, ..Mesh::default() };
    mesh.uvs[0].values = uvs;
    mesh
}

/// Adds the materials and textures of `file`, whose mesh is `mesh`. Those that `declared` knows by name look as the
/// scene says; a name that another file took is written with the file's name behind it, in the mesh too.
pub fn add_looks(
    description: &mut Description,
    mesh: &mut Mesh,
    looks: Looks,
    file: &Path,
    declared: impl Fn(&str) -> bool,
) {
    let first = description.textures.len() as u32;
    let file_name = file.file_name().unwrap_or_default().to_string_lossy();
    let mut taken: HashSet<String> = description.materials.iter().map(|m| m.name.clone()).collect();
    let mut renamed = HashMap::new();
    for mut material in looks.materials {
        if declared(&material.name) {
            continue;
        }
        if taken.contains(&material.name) {
            let own = format!("{} ({file_name})", material.name);
            let numbered = (2..).map(|n| format!("{own} {n}"));
            let free = std::iter::once(own.clone()).chain(numbered).find(|name| !taken.contains(name)).unwrap_or(own);
            renamed.insert(std::mem::replace(&mut material.name, free.clone()), free);
        }
        material.textures.uses_mut().for_each(|used| used.texture += first);
        taken.insert(material.name.clone());
        description.materials.push(material);
    }
    if !renamed.is_empty() {
        for group in &mut mesh.groups {
            if let Some(name) = renamed.get(&group.material) {
                group.material.clone_from(name);
            }
        }
    }
    description.textures.extend(looks.textures);
    let unknown = looks.unknown.iter().filter(|name| !declared(name) && !taken.contains(*name));
    let warnings = looks.warnings.into_iter().chain(unknown_materials(unknown.map(String::as_str).collect()));
    description.warnings.extend(warnings.map(|what| format!("{file_name}: {what}")));
}

/// The warning about materials called `names`; none if there are none.
fn unknown_materials(names: Vec<&str>) -> Option<String> {
    let shown: Vec<_> = names.iter().take(NAMED).map(|name| shown(name.as_bytes())).collect();
    let more = match names.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} others"),
    };
    let what = format!("no library has the materials {}{more}; done with the default one", shown.join(", "));
    (!names.is_empty()).then_some(what)
}

/// Gives every material name that meshes use and `description` lacks the default look.
pub fn add_mesh_materials(description: &mut Description) {
    let mut known: BTreeSet<&str> = description.materials.iter().map(|m| m.name.as_str()).collect();
    let mut missing = Vec::new();
    for name in description.meshes.iter().flat_map(|m| &m.groups).map(|g| g.material.as_str()) {
        if !name.is_empty() && known.insert(name) {
            missing.push(Material { name: name.into(), ..Material::default() });
        }
    }
    description.materials.extend(missing);
}
