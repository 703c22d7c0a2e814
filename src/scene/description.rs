//! The description: what a person wrote. Names, groups, units, f64. Engines never see it; [`super::assembly`]
//! lowers it to numbered objects and instances, from which the world (and, independently, the oracle) is built.
//!
//! Space: right-handed, lengths in scene units. Angles are radians here (degrees only in files). An affine map
//! takes points of the item's local space to its parent's.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::brlcad::describe::Looks;
use super::light::Environment;
use super::mesh::Mesh;
use super::parameter::Parameter;
use super::solids::SolidTree;
use super::texture::Texture;

pub use super::light::Light;
pub use super::material::Material;

/// Index into [`Description::groups`].
pub type GroupId = u32;
/// Index into [`Description::materials`].
pub type MaterialId = u32;

/// A whole scene as described.
#[derive(Clone, Debug)]
pub struct Description {
    /// Short name for tables (`sphere-flake`, `sponza_crytek`).
    pub name: String,
    /// The file it came from; `None` for built-in scenes.
    pub source: Option<PathBuf>,
    /// Files that it refers to, by their real names.
    pub files: Vec<PathBuf>,
    /// SHA-256 over everything that determines the scene (file bytes, referenced files, `--set` values), hex.
    pub hash: String,
    /// Groups; index 0 is the root. A group may be instanced by items of other groups; there are no cycles.
    pub groups: Vec<Group>,
    /// Meshes referenced by items.
    pub meshes: Vec<Arc<Mesh>>,
    /// Trees of solids that items place.
    pub solids: Vec<Arc<SolidTree>>,
    /// Materials; index 0 is the default material.
    pub materials: Vec<Material>,
    /// Textures of materials.
    pub textures: Vec<Arc<Texture>>,
    /// Lights; empty means the renderer adds a default light from the camera's side.
    pub lights: Vec<Light>,
    /// Cameras by name; empty means a default camera that frames the scene.
    pub cameras: Vec<CameraDescription>,
    /// Radiance of rays that leave the scene, linear Rec.709.
    pub background: DVec3,
    /// What rays that leave the scene see instead of the background.
    pub environment: Option<Environment>,
    /// Ambient radiance (first-light Whitted model), linear Rec.709.
    pub ambient: DVec3,
    /// Instances are no more than the format's way to place a mesh: they may be traced as one mesh.
    pub joins: bool,
    /// Precision this scene asks for (`None`: f32).
    pub precision: Option<Precision>,
    /// Looks of a BRL-CAD database's regions, which only its own lighting model knows; the object placed first has a part for
    /// each.
    pub looks: Option<Arc<Looks>>,
    /// Numbers of the scene that `--set` changes, in the order they were written.
    pub parameters: Vec<Parameter>,
    /// Things worth telling the user (`info` prints them): ignored statements, unknown properties.
    pub warnings: Vec<String>,
}

/// Arithmetic of the engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32 lanes: meshes.
    F32,
    /// f64 lanes: large or exact models.
    F64,
}

/// A named list of items in one local space.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Name; empty for anonymous groups.
    pub name: String,
    /// The items in the order they were written: this order defines primitive and instance numbers.
    pub items: Vec<Item>,
}

/// Something placed in a group.
#[derive(Clone, Debug)]
pub struct Item {
    /// Local space to the group's space.
    pub transform: DAffine3,
    /// Material; `None` inherits from the mesh's own material names or the default.
    pub material: Option<MaterialId>,
    /// What is placed.
    pub kind: ItemKind,
}

/// What an [`Item`] places.
#[derive(Clone, Debug)]
pub enum ItemKind {
    /// An analytic shape in its canonical local space.
    Shape(Shape),
    /// A mesh: index into [`Description::meshes`].
    Mesh(u32),
    /// A tree of solids: index into [`Description::solids`].
    Solids(u32),
    /// An instance of a group: geometry is shared, not copied.
    Instance(GroupId),
}

/// Analytic shapes, each in one canonical local space; size and place come from the item's transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Unit sphere at the origin.
    Sphere,
    /// The half-space z <= 0; its surface is the plane z = 0 with outward normal +z.
    HalfSpace,
    /// The disc x^2 + y^2 <= 1, z = 0 (a surface: it has no inside).
    Disc,
    /// The box [-1, 1]^3.
    Cuboid,
    /// The capped cylinder x^2 + y^2 <= 1, 0 <= z <= 1.
    Cylinder,
    /// The capped cone: radius 1 at z = 0, radius `top` at z = 1, with 0 <= top <= 1 (0 is a pointed cone).
    Cone {
        /// Radius at z = 1 relative to the base.
        top: f64,
        /// Whether it is the mirror image, z for 1 - z, of one that widens upwards, whose texture coordinates it has.
        is_mirrored: bool,
    },
}

impl Shape {
    /// The cone whose radius at z = 1 is `top`.
    pub const fn cone(top: f64) -> Self {
        Self::Cone { top, is_mirrored: false }
    }
}

/// A camera as written in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraDescription {
    /// Name for `--camera`.
    pub name: String,
    /// Eye point.
    pub eye: DVec3,
    /// Point looked at.
    pub look_at: DVec3,
    /// Up vector, need not be unit or orthogonal.
    pub up: DVec3,
    /// Projection.
    pub projection: Projection,
}

impl CameraDescription {
    /// Whether `up` points along the view from `eye` to `look_at`, either way, and so does not say what is up in the picture. Without
    /// a view (both in one place) it does not.
    pub fn is_along_view(eye: DVec3, look_at: DVec3, up: DVec3) -> bool {
        let views = [look_at - eye, up].map(DVec3::try_normalize);
        matches!(views, [Some(view), Some(up)] if view.cross(up).length() < 1e-9)
    }
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective with the *vertical* field of view in radians.
    Perspective {
        /// Full vertical angle, radians.
        theta: f64,
    },
    /// Parallel with the height of the view volume in scene units.
    Parallel {
        /// Full height, scene units.
        height: f64,
    },
}

impl Description {
    /// All files that it was read from: its own, and those that it refers to.
    pub fn inputs(&self) -> Vec<&Path> {
        self.source.iter().chain(&self.files).map(PathBuf::as_path).collect()
    }

    /// An empty scene with the default material and an empty root group.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            source: None,
            files: Vec::new(),
            hash: String::new(),
            groups: vec![Group::default()],
            meshes: Vec::new(),
            solids: Vec::new(),
            materials: vec![Material::default()],
            textures: Vec::new(),
            lights: Vec::new(),
            cameras: Vec::new(),
            background: DVec3::ZERO,
            environment: None,
            ambient: DVec3::splat(0.1),
            joins: false,
            precision: None,
            looks: None,
            parameters: Vec::new(),
            warnings: Vec::new(),
        }
    }
}
