//! `mesh` statements: files that are placed, with what they say of their materials.

use std::path::Path;

use glam::DAffine3;

use super::lower::{Lowering, Place};
use super::meshes::{Key, MeshFile, add_looks};
use super::source::{Span, quote};
use super::syntax::Node;
use super::{settings, transform};
use crate::error::{Error, Result};
use crate::scene::description::{ItemKind, Material};

impl<'a, 'n> Lowering<'a, 'n> {
    /// `mesh "file.ply" units=mm`.
    ///
    /// # Errors
    /// The first thing that is wrong in the statement or the file.
    pub fn mesh_file(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let (mesh, scale, place) = self.mesh_of(node, place, true)?;
        self.add(ItemKind::Mesh(mesh), scale, place, node.span)
    }

    /// The mesh of a `mesh` statement, the scale of its unit, where it goes; `has_names` says whether the file's names of materials
    /// matter where the statement gives none.
    ///
    /// # Errors
    /// The first thing that is wrong in the statement or the file.
    pub fn mesh_of(&mut self, node: &'n Node<'a>, place: Place, has_names: bool) -> Result<(u32, DAffine3, Place)> {
        const ALLOWED: [&str; 2] = ["units", "material"];
        let fields = self.fields(node, &ALLOWED, &transform::NAMES)?;
        let (written, span) = fields.title()?.ok_or_else(|| fields.error("expected `mesh \"file.ply\"`"))?;
        let place = self.place(&fields, &fields.rest, &ALLOWED, place)?;
        let scale = match fields.name("units")? {
            None => 1.0,
            Some((name, span)) => {
                let fail = |what: String| self.scope.source.error(span, what);
                let metres = settings::metres_per(name).ok_or_else(|| fail(settings::unknown_unit(name)))?;
                let unit = self.metres.ok_or_else(|| fail("the scene must say its own `units` first".into()))?;
                metres / unit
            }
        };
        drop(fields);
        let mesh = match self.store.find(&Key::Written(written.into())) {
            Some(mesh) => mesh,
            None => self.read_mesh(written, span, has_names && place.parts().1.is_none())?,
        };
        Ok((mesh, DAffine3::from_scale(glam::DVec3::splat(scale)), place))
    }

    fn read_mesh(&mut self, written: &str, span: Span, has_names: bool) -> Result<u32> {
        let source = self.scope.source;
        let file = self.files.resolve(written).map_err(|what| source.error(span, what))?;
        let key = Key::File(file.clone());
        let mesh = match self.store.find(&key) {
            Some(mesh) => mesh,
            None => {
                let mut read = (self.files.read)(&file).map_err(|e| match e {
                    Error::Io { source: e, .. } => source.error(span, format!("cannot read {}: {e}", quote(written))),
                    other => other,
                })?;
                if !has_names {
                    read.looks.unknown.clear();
                }
                self.add_mesh(key, &file, read)
            }
        };
        self.store.alias(Key::Written(written.into()), mesh);
        Ok(mesh)
    }

    /// Stores the mesh of `file` and takes over its materials, unless the scene itself says how they look.
    fn add_mesh(&mut self, key: Key, file: &Path, read: MeshFile) -> u32 {
        let MeshFile { mut mesh, digest, looks } = read;
        self.store.digests.push(digest);
        self.store.digests.extend(&looks.digests);
        let (materials, description) = (&self.materials, &mut self.description);
        let has_default = description.materials[0] != Material::default();
        let declared = |name: &str| materials.contains_key(name) && (name != "default" || has_default);
        add_looks(description, &mut mesh, looks, file, declared);
        self.store.add(Some(key), mesh)
    }
}
