//! Primitives: vertices and indices become triangle meshes, each distinct one once.

use std::collections::HashMap;
use std::fmt::Display;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::Document;
use super::accessor::{COORDINATES, Expected, INDICES, NORMALS, POSITIONS, TANGENTS, View};
use super::json::{Attributes, Primitive};
use crate::error::Result;
use crate::scene::description::{Description, Item, ItemKind, MaterialId};
use crate::scene::mesh::{Attribute, Mesh};

/// How indices form triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    /// Triangles in the order and winding of glTF 2.0, section 3.7.2.1.
    fn triangles(self, v: &[u32]) -> Vec<[u32; 3]> {
        let fans = v.len().saturating_sub(2);
        match self {
            Self::Triangles => v.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            Self::Strip => (0..fans).map(|i| [v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]]).collect(),
            Self::Fan => (0..fans).map(|i| [v[i + 1], v[i + 2], v[0]]).collect(),
        }
    }

    fn count(self, corners: usize) -> usize {
        match self {
            Self::Triangles => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }
}

/// What makes primitives the same mesh: accessors of attributes and of indices, mode.
type Key = (Attributes, Option<u32>, Mode);

/// The meshes made so far and what was passed over.
#[derive(Debug)]
pub struct Primitives {
    stored: HashMap<Key, u32>,
    /// Number of primitives that take their positions from each accessor.
    users: HashMap<u32, u32>,
    without_triangles: u64,
    incomplete: u64,
    /// Those whose vertices have colours.
    coloured: u64,
}

impl Primitives {
    /// Nothing read yet.
    pub fn new(document: &Document<'_>) -> Self {
        let mut users = HashMap::new();
        for primitive in document.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            if let Some(positions) = primitive.attributes.position {
                *users.entry(positions).or_default() += 1;
            }
        }
        Self { stored: HashMap::new(), users, without_triangles: 0, incomplete: 0, coloured: 0 }
    }

    /// The items that mesh `index` of the document, which must exist, consists of.
    ///
    /// # Errors
    /// What is wrong with its primitives.
    pub fn items(&mut self, document: &Document<'_>, index: u32, description: &mut Description) -> Result<Vec<Item>> {
        let mut items = Vec::new();
        for (p, primitive) in document.root.meshes[index as usize].primitives.iter().enumerate() {
            let path = format!("meshes[{index}].primitives[{p}]");
            let material = material(document, primitive, &path)?;
            let Some(mesh) = self.mesh(document, primitive, &path, description)? else {
                self.without_triangles += 1;
                continue;
            };
            self.coloured += u64::from(primitive.attributes.color_0.is_some());
            items.push(Item { transform: DAffine3::IDENTITY, material, kind: ItemKind::Mesh(mesh) });
        }
        Ok(items)
    }

    /// What was passed over, for the user.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let skipped = format!("{} primitives without triangles (points, lines) are left out", self.without_triangles);
        let cut = format!("{} primitives end in an incomplete triangle, which is left out", self.incomplete);
        let coloured =
            format!("{} primitives have colours at their vertices (COLOR_0), which are not read", self.coloured);
        let all = [(self.without_triangles, skipped), (self.incomplete, cut), (self.coloured, coloured)];
        all.into_iter().filter(|(count, _)| *count > 0).map(|(_, what)| what)
    }

    fn mesh(
        &mut self,
        document: &Document<'_>,
        primitive: &Primitive,
        path: &str,
        description: &mut Description,
    ) -> Result<Option<u32>> {
        let mode = match primitive.mode {
            Some(0..=3) => return Ok(None),
            None | Some(4) => Mode::Triangles,
            Some(5) => Mode::Strip,
            Some(6) => Mode::Fan,
            Some(other) => return Err(document.error(path, format!("expected a mode from 0 to 6, found {other}"))),
        };
        let Some(positions) = primitive.attributes.position else { return Ok(None) };
        // Colours make no mesh another one: they are not read.
        let mut attributes = Attributes { color_0: None, ..primitive.attributes };
        if document.root.textures.is_empty() {
            // Nothing will look at coordinates and tangents.
            (attributes.tangent, attributes.texcoord_0, attributes.texcoord_1) = (None, None, None);
        }
        let key = (attributes, primitive.indices, mode);
        if let Some(&stored) = self.stored.get(&key) {
            return Ok(Some(stored));
        }
        let view = document.view(positions, POSITIONS, format_args!("{path}.attributes.POSITION"))?;
        let draco = primitive.extensions.is_some_and(|e| e.draco.is_some());
        if draco && document.root.accessors[positions as usize].buffer_view.is_none() {
            return Err(document.error(path, "has only data compressed by KHR_draco_mesh_compression, not supported"));
        }
        let corners = corners(document, primitive.indices, &view, path)?;
        self.incomplete += u64::from(mode == Mode::Triangles && corners.len() % 3 != 0);
        let shared = self.users.get(&positions).is_some_and(|&users| users > 1);
        let views = Views::new(document, view, attributes, path)?;
        let mesh = build(document, &views, corners, mode, shared, path)?;
        let stored = description.meshes.len() as u32;
        description.meshes.push(Arc::new(mesh));
        self.stored.insert(key, stored);
        Ok(Some(stored))
    }
}

/// The description's number of a primitive's material.
fn material(document: &Document<'_>, primitive: &Primitive, path: &str) -> Result<Option<MaterialId>> {
    let Some(index) = primitive.material else { return Ok(None) };
    document.get(&document.root.materials, "materials", index, format_args!("{path}.material"))?;
    // Number 0 is the default material.
    Ok(Some(index + 1))
}

/// The vertex indices of a primitive in order, all below the number of vertices.
fn corners(document: &Document<'_>, indices: Option<u32>, positions: &View<'_>, path: &str) -> Result<Vec<u32>> {
    let path = format!("{path}.indices");
    let Some(indices) = indices else {
        spend(document, positions.count, size_of::<u32>(), path)?;
        return Ok((0..positions.count as u32).collect());
    };
    let view = document.view(indices, INDICES, &path)?;
    spend(document, view.count, size_of::<u32>(), &path)?;
    let corners: Vec<u32> = (0..view.count).map(|i| view.index(i)).collect();
    match corners.iter().position(|&v| v as usize >= positions.count) {
        Some(at) => {
            let (index, count) = (corners[at], positions.count);
            Err(document.error(path, format!("index {index} (number {at}) names no vertex: there are {count}")))
        }
        None => Ok(corners),
    }
}

/// The accessors of a primitive's attributes.
struct Views<'a> {
    positions: View<'a>,
    normals: Option<View<'a>>,
    tangents: Option<View<'a>>,
    uvs: [Option<View<'a>>; 2],
}

impl<'a> Views<'a> {
    /// Those of `attributes`, the primitive at `path`.
    ///
    /// # Errors
    /// What is wrong with the accessors; another number of elements than there are `positions`.
    fn new(document: &'a Document<'_>, positions: View<'a>, attributes: Attributes, path: &str) -> Result<Self> {
        let view = |accessor: Option<u32>, expected: Expected, name: &str| {
            let Some(accessor) = accessor else { return Ok(None) };
            let path = format!("{path}.attributes.{name}");
            let view = document.view(accessor, expected, &path)?;
            if view.count != positions.count {
                let what = format!("expected as many as of POSITION, {}, found {}", positions.count, view.count);
                return Err(document.error(path, what));
            }
            Ok(Some(view))
        };
        Ok(Self {
            positions,
            normals: view(attributes.normal, NORMALS, "NORMAL")?,
            tangents: view(attributes.tangent, TANGENTS, "TANGENT")?,
            uvs: [
                view(attributes.texcoord_0, COORDINATES, "TEXCOORD_0")?,
                view(attributes.texcoord_1, COORDINATES, "TEXCOORD_1")?,
            ],
        })
    }

    /// Bytes of one vertex in memory.
    fn vertex_bytes(&self) -> usize {
        let uvs = self.uvs.iter().flatten().count() * size_of::<[f32; 2]>();
        let normal = self.normals.map_or(0, |_| size_of::<[f32; 3]>());
        let tangent = self.tangents.map_or(0, |_| size_of::<[f32; 4]>());
        size_of::<DVec3>() + uvs + normal + tangent
    }

    /// The mesh of `triangles` whose vertices are the `vertices` of the accessors.
    fn mesh(&self, vertices: impl Iterator<Item = usize> + Clone, triangles: Vec<[u32; 3]>) -> Mesh {
        Mesh {
            positions: vertices.clone().map(|v| DVec3::from_array(self.positions.numbers(v))).collect(),
            triangles,
            groups: Vec::new(),
            normals: attribute(self.normals, vertices.clone()),
            uvs: self.uvs.map(|uv| attribute(uv, vertices.clone())),
            tangents: attribute(self.tangents, vertices),
        }
    }
}

/// The numbers of `view` at `vertices`, none without a view.
fn attribute<const N: usize>(view: Option<View<'_>>, vertices: impl Iterator<Item = usize>) -> Attribute<[f32; N]> {
    let values = view.map(|view| vertices.map(|v| view.numbers::<N>(v).map(|x| x as f32)).collect());
    Attribute { values: values.unwrap_or_default(), indices: Vec::new() }
}

/// The mesh of `corners`. Vertices keep the file's order; of those that several primitives share, each mesh has the
/// ones that it uses: it could be few of very many.
fn build(
    document: &Document<'_>,
    views: &Views<'_>,
    mut corners: Vec<u32>,
    mode: Mode,
    shared: bool,
    path: &str,
) -> Result<Mesh> {
    spend(document, mode.count(corners.len()), size_of::<[u32; 3]>(), path)?;
    let mut triangles = mode.triangles(&corners);
    if shared {
        corners.sort_unstable();
        corners.dedup();
        spend(document, corners.len(), views.vertex_bytes(), path)?;
        for corner in triangles.iter_mut().flatten() {
            *corner = corners.partition_point(|v| v < corner) as u32;
        }
        Ok(views.mesh(corners.iter().map(|&v| v as usize), triangles))
    } else {
        spend(document, views.positions.count, views.vertex_bytes(), path)?;
        Ok(views.mesh(0..views.positions.count, triangles))
    }
}

fn spend(document: &Document<'_>, count: usize, size: usize, path: impl Display) -> Result<()> {
    document.spend((count as u64).saturating_mul(size as u64), path)
}
