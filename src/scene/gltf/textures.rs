//! Textures: which pictures materials use and how. Each picture is decoded once per meaning of its levels.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};

use super::Document;
use super::buffers::Target;
use super::json_looks::{Sampler, TextureInfo, TextureTransform};
use crate::error::Result;
use crate::scene::material::{TextureId, TextureRef, Wrap};
use crate::scene::pictures::{Content, Curve, Picture, decode_all};
use crate::scene::text;
use crate::scene::texture::Texture;

/// The textures that were met so far.
pub struct Textures<'d, 'a> {
    document: &'d Document<'a>,
    pictures: Vec<Picture<'d>>,
    /// The index of each picture's image in the document.
    images: Vec<u32>,
    known: HashMap<(u32, Curve), TextureId>,
    /// Textures without a picture of a kind that is read.
    without_picture: u64,
    /// Uses of coordinates beyond the second set.
    beyond_sets: u64,
}

impl<'d, 'a> Textures<'d, 'a> {
    /// None yet.
    pub fn new(document: &'d Document<'a>) -> Self {
        let known = HashMap::new();
        Self { document, pictures: Vec::new(), images: Vec::new(), known, without_picture: 0, beyond_sets: 0 }
    }

    /// The texture that `info`, at `path` of the document, asks for, its levels meant as `curve` says. `None`, and
    /// counted, if it has no picture that is read or needs coordinates that are not.
    ///
    /// # Errors
    /// Indices that name nothing, an unknown kind of wrapping, an image without content.
    pub fn reference(&mut self, info: &TextureInfo, curve: Curve, path: &str) -> Result<Option<TextureRef>> {
        let document = self.document;
        let texture = document.get(&document.root.textures, "textures", info.index, path)?;
        let texture_path = format!("textures[{}]", info.index);
        let plain = Sampler::default();
        let sampler = match texture.sampler {
            Some(index) => {
                document.get(&document.root.samplers, "samplers", index, format_args!("{texture_path}.sampler"))?
            }
            None => &plain,
        };
        let transform = info.extensions.as_ref().and_then(|e| e.transform.as_ref());
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        let Some(source) = texture.source else {
            self.without_picture += 1;
            return Ok(None);
        };
        if set > 1 {
            self.beyond_sets += 1;
            return Ok(None);
        }
        let wrap = |code: Option<u32>| match code {
            None | Some(10497) => Ok(Wrap::Repeat),
            Some(33648) => Ok(Wrap::Mirror),
            Some(33071) => Ok(Wrap::Clamp),
            Some(other) => {
                let what = format!("its sampler wraps by {other}: expected 10497, 33071 or 33648");
                Err(document.error(&texture_path, what))
            }
        };
        Ok(Some(TextureRef {
            uv_set: set as u8,
            transform: transform.map_or(DAffine2::IDENTITY, matrix),
            wrap: [wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?],
            nearest: sampler.mag_filter == Some(9728),
            ..TextureRef::new(self.picture(source, curve, &texture_path)?)
        }))
    }

    fn picture(&mut self, source: u32, curve: Curve, path: &str) -> Result<TextureId> {
        if let Some(&known) = self.known.get(&(source, curve)) {
            return Ok(known);
        }
        let document = self.document;
        let image = document.get(&document.root.images, "images", source, format_args!("{path}.source"))?;
        let fail = |what: String| document.error(format_args!("images[{source}]"), what);
        let content = match (image.uri.as_deref(), image.buffer_view) {
            (Some(uri), _) => match document.buffers.target(uri).map_err(fail)? {
                Target::File(file) => Content::File(file),
                Target::Inline(bytes) => Content::Bytes(Cow::Owned(bytes)),
            },
            (None, Some(view)) => Content::Bytes(Cow::Borrowed(document.bytes(view, format!("images[{source}]"))?)),
            (None, None) => return Err(fail("expected a `uri` or a `bufferView`".into())),
        };
        let file = image.uri.as_deref().filter(|_| matches!(content, Content::File(_)));
        let name = [image.name.as_deref(), file].into_iter().flatten().next().map(|n| text::name(n.as_bytes()));
        let name = name.unwrap_or_else(|| format!("image {source}"));
        let id = self.pictures.len() as TextureId;
        self.pictures.push(Picture { name, content, curve });
        self.images.push(source);
        self.known.insert((source, curve), id);
        Ok(id)
    }

    /// Decodes the pictures; textures by their numbers, the SHA-256 of each picture's bytes, and what was passed over.
    ///
    /// # Errors
    /// The first picture that cannot be read.
    pub fn decode(self) -> Result<Decoded> {
        let all = decode_all(&self.pictures).map_err(|wrong| {
            let image = self.images[wrong.index];
            let uri = self.document.root.images[image as usize].uri.as_deref();
            let named = uri.filter(|_| matches!(self.pictures[wrong.index].content, Content::File(_)));
            let named = named.map_or(String::new(), |uri| format!("{}: ", text::shown(uri.as_bytes())));
            self.document.error(format_args!("images[{image}]"), format!("{named}{}", wrong.what))
        })?;
        let (textures, digests) = all.into_iter().map(|(texture, digest)| (Arc::new(texture), digest)).unzip();
        let mut warnings = Vec::new();
        if self.without_picture > 0 {
            warnings.push(format!("{} textures without a PNG or JPEG picture are left out", self.without_picture));
        }
        if self.beyond_sets > 0 {
            warnings.push(format!("{} textures that need TEXCOORD_2 or more are left out", self.beyond_sets));
        }
        Ok(Decoded { textures, digests, warnings })
    }
}

/// What [`Textures::decode`] gives.
pub struct Decoded {
    /// Textures by their numbers.
    pub textures: Vec<Arc<Texture>>,
    /// SHA-256 of their pictures.
    pub digests: Vec<[u8; 32]>,
    /// What was passed over.
    pub warnings: Vec<String>,
}

/// Source: KHR_texture_transform: scale, then rotation, then offset. A rotation is counter-clockwise in a picture whose
/// v points down, which is the transpose of the matrix that the text of the extension long showed (glTF issue 1563).
fn matrix(t: &TextureTransform) -> DAffine2 {
    let (sin, cos) = t.rotation.sin_cos();
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let scale = DMat2::from_diagonal(DVec2::from(t.scale.unwrap_or([1.0; 2])));
    DAffine2::from_mat2_translation(rotation * scale, DVec2::from(t.offset))
}
