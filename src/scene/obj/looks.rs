//! The looks of an OBJ file's materials: its libraries, and the textures that these name.
//!
//! Libraries and pictures travel badly with OBJ files, so one that is missing, or of a format that is not read, is a
//! warning; one that is there and damaged is an error.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};
use sha2::{Digest, Sha256};

use super::{ObjFile, heights};
use crate::error::{Error, Result};
use crate::scene::material::{Material, TextureId, TextureRef, Wrap};
use crate::scene::mesh::COLOURS;
use crate::scene::mtl::{self, Entry, Map};
use crate::scene::pictures::{Content, Curve, Picture, decode_all, is_known};
use crate::scene::polygon;
use crate::scene::reference::References;
use crate::scene::text;
use crate::scene::texture::{Texels, Texture};

/// Most missing files, or materials, that warnings name.
pub(in crate::scene) const NAMED: usize = 8;

/// Materials by name, with their textures.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    /// Those that the mesh uses and a library has.
    pub materials: Vec<Material>,
    /// Their textures.
    pub textures: Vec<Arc<Texture>>,
    /// SHA-256 of each library and picture read.
    pub digests: Vec<[u8; 32]>,
    /// Materials that the mesh uses and no library has, where libraries are named; a scene may have them.
    pub unknown: Vec<String>,
    /// What is missing or was passed over.
    pub warnings: Vec<String>,
}

/// Reads the looks of the materials that `obj`, read from `file`, uses.
///
/// # Errors
/// A library that cannot be read or is malformed, a picture that is damaged or too large.
pub fn read(file: &Path, obj: &ObjFile, references: &References<'_>) -> Result<Looks> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut reader = Reader { folder, references, out: Looks::default(), missing: BTreeMap::new() };
    let used: HashSet<&str> = obj.mesh.groups.iter().map(|g| g.material.as_str()).collect();
    let mut textures = Images::default();
    let (mut known, mut seen, mut ignored) = (HashSet::new(), HashSet::new(), 0);
    for written in obj.material_libs.iter().filter(|written| seen.insert(written.as_str())) {
        let Some(library) = reader.materials_of(written)? else { continue };
        ignored += library.ignored;
        for entry in &library.entries {
            // The first definition counts, as the first library that has one does.
            if used.contains(entry.name.as_str()) && known.insert(entry.name.clone()) {
                let material = reader.material(entry, &mut textures);
                reader.out.materials.push(material);
            }
        }
    }
    if !obj.material_libs.is_empty() {
        // In the order of their first use, each once; no name is the default look.
        known.insert(String::new());
        let names = obj.mesh.groups.iter().map(|group| &group.material);
        reader.out.unknown.extend(names.filter(|name| known.insert((*name).clone())).cloned());
    }
    if let Some((first, line)) = &obj.first_ignored {
        let what = format!("{} statements of the file are not read, the first is {first} (line {line})", obj.ignored);
        reader.out.warnings.push(what);
    }
    reader.out.warnings.extend(obj.has_colours.then(|| COLOURS.to_owned()));
    if obj.dangling > 0 {
        let what = format!("{} corners name texture coordinates or normals that are not there", obj.dangling);
        reader.out.warnings.push(what);
    }
    reader.out.warnings.extend(polygon::warning(obj.large_polygons));
    if ignored > 0 {
        reader.out.warnings.push(format!("{ignored} statements or options of material libraries are not read"));
    }
    reader.finish(textures)
}

struct Reader<'a> {
    folder: &'a Path,
    references: &'a References<'a>,
    out: Looks,
    /// Files that are missing, each with the reason.
    missing: BTreeMap<String, String>,
}

/// How the texels of a picture are to be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Use {
    Colour,
    Opacity,
    Normals,
    Roughness,
    Metallic,
    /// Heights times this number (its bits), or normals.
    Bump(u64),
}

/// Pictures to be decoded.
#[derive(Default)]
struct Images {
    list: Vec<Picture<'static>>,
    uses: Vec<Use>,
    known: HashMap<(PathBuf, Use), TextureId>,
}

impl Reader<'_> {
    /// The file that the OBJ file or its libraries mean by `written`; Windows' separators are as good as ours.
    fn resolve(&mut self, written: &str) -> Option<PathBuf> {
        match self.references.resolve_from(self.folder, &written.replace('\\', "/")) {
            Ok(file) => Some(file),
            Err(what) => {
                self.missing.insert(written.into(), what);
                None
            }
        }
    }

    fn materials_of(&mut self, written: &str) -> Result<Option<mtl::Library>> {
        let Some(path) = self.resolve(written) else { return Ok(None) };
        // Asked before it is opened: opening a pipe waits for its writer.
        if !path.is_file() {
            self.missing.insert(written.into(), format!("{} is not a file", text::shown(written.as_bytes())));
            return Ok(None);
        }
        let shown = self.folder.join(written);
        let mut bytes = Vec::new();
        let file = File::open(&path).map_err(|e| Error::io(&shown, e))?;
        file.take(mtl::MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| Error::io(&shown, e))?;
        if bytes.len() as u64 > mtl::MAX_BYTES {
            let limit = mtl::MAX_BYTES >> 20;
            return Err(Error::whole(&shown, format!("larger than {limit} MiB, the limit for material libraries")));
        }
        self.out.digests.push(Sha256::digest(&bytes).into());
        mtl::parse(&shown, &bytes).map(Some)
    }

    fn material(&mut self, entry: &Entry, images: &mut Images) -> Material {
        let mut material = entry.material();
        let mut texture =
            |map: &Option<Box<Map>>, usage: Use| map.as_ref().and_then(|m| self.texture(m, usage, images));
        let looks = &mut material.textures;
        looks.normal_scale = entry.normal_map.as_ref().map_or(1.0, |map| map.multiplier);
        looks.base = texture(&entry.base_map, Use::Colour);
        looks.emission = texture(&entry.emission_map, Use::Colour);
        if looks.emission.is_none() {
            // A picture that is missing is no lamp.
            material.emission = entry.emission();
        }
        looks.opacity = texture(&entry.opacity_map, Use::Opacity);
        looks.metallic_roughness = texture(&entry.roughness_map, Use::Roughness);
        looks.metallic = texture(&entry.metallic_map, Use::Metallic);
        looks.normal = texture(&entry.normal_map, Use::Normals);
        if let (None, Some(bump)) = (looks.normal, &entry.bump_map) {
            looks.normal = texture(&entry.bump_map, Use::Bump(bump.multiplier.to_bits()));
            looks.normal_scale = bump.multiplier;
        }
        material
    }

    fn texture(&mut self, map: &Map, usage: Use, images: &mut Images) -> Option<TextureRef> {
        let path = self.resolve(&map.file)?;
        if !is_known(&path) {
            let what = format!("{} is not a PNG, JPEG, Radiance HDR or EXR picture", text::shown(map.file.as_bytes()));
            self.missing.insert(map.file.clone(), what);
            return None;
        }
        let id = images.add(path, &map.file, usage);
        // The format's v points up, the mesh's and the picture's down.
        let [u, v] = map.scale;
        let offset = DVec2::new(map.offset[0], 1.0 - v - map.offset[1]);
        let transform = DAffine2::from_mat2_translation(DMat2::from_diagonal(DVec2::new(u, v)), offset);
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        Some(TextureRef { transform, wrap: [wrap; 2], ..TextureRef::new(id) })
    }

    fn finish(mut self, images: Images) -> Result<Looks> {
        let decoded = decode_all(&images.list).map_err(|wrong| {
            let picture = &images.list[wrong.index];
            let file = if let Content::File(path) = &picture.content { path.clone() } else { PathBuf::new() };
            Error::whole(file, wrong.what)
        })?;
        let mut is_relief = Vec::with_capacity(decoded.len());
        for ((texture, digest), usage) in decoded.into_iter().zip(images.uses) {
            let (texture, relief) = match usage {
                Use::Colour | Use::Normals | Use::Metallic => (texture, false),
                Use::Opacity => (texture.into_opacity(), false),
                Use::Roughness => (roughness(texture), false),
                Use::Bump(bits) if heights::is_heights(&texture) => {
                    (heights::normals(&texture, f64::from_bits(bits)), true)
                }
                Use::Bump(_) => (texture, false),
            };
            is_relief.push(relief);
            self.out.textures.push(Arc::new(texture));
            self.out.digests.push(digest);
        }
        for looks in self.out.materials.iter_mut().map(|m| &mut m.textures) {
            if looks.normal.is_some_and(|used| is_relief[used.texture as usize]) {
                // The heights were multiplied already.
                looks.normal_scale = 1.0;
            }
        }
        let more = self.missing.len().saturating_sub(NAMED);
        self.out.warnings.extend(self.missing.into_values().take(NAMED).map(|what| format!("{what}; done without")));
        if more > 0 {
            self.out.warnings.push(format!("{more} other libraries or textures are missing"));
        }
        Ok(self.out)
    }
}

impl Images {
    fn add(&mut self, path: PathBuf, written: &str, usage: Use) -> TextureId {
        if let Some(&known) = self.known.get(&(path.clone(), usage)) {
            return known;
        }
        let id = self.list.len() as TextureId;
        let curve = if usage == Use::Colour { Curve::Srgb } else { Curve::Linear };
        let name = text::name(written.as_bytes());
        self.list.push(Picture { name, content: Content::File(path.clone()), curve });
        self.uses.push(usage);
        self.known.insert((path, usage), id);
        id
    }
}

/// A grey picture as roughness alone, in glTF's channels: green, with no say on metal in blue.
fn roughness(mut texture: Texture) -> Texture {
    fn from_grey<T: Copy>(texels: &mut [[T; 4]], full: T) {
        texels.iter_mut().for_each(|t| *t = [full, t[0], full, full]);
    }
    match &mut texture.texels {
        Texels::Srgb8(t) | Texels::Linear8(t) => from_grey(t, u8::MAX),
        Texels::Linear16(t) => from_grey(t, u16::MAX),
        Texels::Float(t) => from_grey(t, 1.0),
    }
    texture
}
