//! Picture files that a scene file names.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::meshes::MeshFiles;
use super::source::{Source, Span};
use crate::error::Result;
use crate::scene::material::TextureId;
use crate::scene::pictures::{Content, Curve, Picture, decode_all};
use crate::scene::text;
use crate::scene::texture::Texture;

/// What the numbers of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Use {
    /// Colours.
    Colour,
    /// Plain numbers.
    Numbers,
    /// Opacity, see [`Texture::into_opacity`].
    Opacity,
}

/// Pictures met so far, to be decoded together.
pub struct Images<'f> {
    files: &'f MeshFiles<'f>,
    list: Vec<Picture<'static>>,
    spans: Vec<Span>,
    uses: Vec<Use>,
    known: HashMap<(PathBuf, Use), TextureId>,
}

impl<'f> Images<'f> {
    /// None yet; `files` leads to them.
    pub fn new(files: &'f MeshFiles<'f>) -> Self {
        Self { files, list: Vec::new(), spans: Vec::new(), uses: Vec::new(), known: HashMap::new() }
    }

    /// The number of the texture that `written`, at `span`, will be.
    ///
    /// # Errors
    /// A file that does not exist or may not be used.
    pub fn add(&mut self, source: Source<'_>, written: &str, span: Span, usage: Use) -> Result<TextureId> {
        let path = self.files.resolve(written).map_err(|what| source.error(span, what))?;
        if let Some(&known) = self.known.get(&(path.clone(), usage)) {
            return Ok(known);
        }
        let id = self.list.len() as TextureId;
        let curve = if usage == Use::Colour { Curve::Srgb } else { Curve::Linear };
        self.list.push(Picture { name: text::name(written.as_bytes()), content: Content::File(path.clone()), curve });
        self.spans.push(span);
        self.uses.push(usage);
        self.known.insert((path, usage), id);
        Ok(id)
    }

    /// The textures by their numbers, each with the SHA-256 of its picture.
    ///
    /// # Errors
    /// The first picture that cannot be read, where the scene names it.
    pub fn decode(self, source: Source<'_>) -> Result<Vec<(Arc<Texture>, [u8; 32])>> {
        let all = decode_all(&self.list).map_err(|wrong| {
            let name = text::shown(self.list[wrong.index].name.as_bytes());
            source.error(self.spans[wrong.index], format!("{name}: {}", wrong.what))
        })?;
        let used = all.into_iter().zip(self.uses).map(|((texture, digest), usage)| match usage {
            Use::Opacity => (Arc::new(texture.into_opacity()), digest),
            Use::Colour | Use::Numbers => (Arc::new(texture), digest),
        });
        Ok(used.collect())
    }
}
