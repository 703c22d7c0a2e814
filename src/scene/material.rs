//! Materials as described: how a surface scatters, emits and lets light through.
//!
//! Colours are linear Rec.709. A texture multiplies the number it belongs to.

use glam::{DAffine2, DVec3};

use super::description::MaterialId;

/// Index into [`super::description::Description::textures`].
pub type TextureId = u32;

/// A surface material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Base colour: diffuse reflectance, 0..1; what metals reflect at normal incidence in
    /// [`Scattering::MetallicRoughness`].
    pub diffuse: DVec3,
    /// Mirror reflectance of [`Scattering::Matte`], 0..1.
    pub mirror: DVec3,
    /// Emitted radiance.
    pub emission: DVec3,
    /// Light leaves only the side that the geometric normal points to.
    pub one_sided: bool,
    /// How light is scattered.
    pub scattering: Scattering,
    /// Whether light that facets of rough metal or glass throw at each other is there, as it is in nature; without it,
    /// as the models were published, rough surfaces are a little dark.
    pub multiple_scattering: bool,
    /// Opacity, 0..1, as [`Self::alpha`] uses it.
    pub opacity: f64,
    /// What opacity means.
    pub alpha: Alpha,
    /// Textures.
    pub textures: Textures,
}

/// How a surface scatters light. Roughness is 0 (smooth) to 1; the width of the GGX distribution is its square.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Scattering {
    /// Lambert reflection by the base colour, plus a perfect mirror.
    #[default]
    Matte,
    /// A metal, by its complex index of refraction eta + i k for red, green and blue.
    Conductor {
        /// Real part.
        eta: DVec3,
        /// Imaginary part (extinction).
        k: DVec3,
        /// Roughness.
        roughness: f64,
    },
    /// The boundary of a solid body of glass or liquid: the geometric normal points out of it.
    Dielectric {
        /// Index of refraction inside, relative to outside; positive.
        ior: f64,
        /// Roughness.
        roughness: f64,
        /// Colour of what goes through, once per boundary.
        tint: DVec3,
    },
    /// A pane so thin that light goes straight through, with all reflections between its two sides.
    ThinGlass {
        /// Index of refraction.
        ior: f64,
        /// Colour of what goes through.
        tint: DVec3,
    },
    /// A dielectric coat on a diffuse base of the base colour.
    Plastic {
        /// Index of refraction of the coat.
        ior: f64,
        /// Roughness of the coat.
        roughness: f64,
    },
    /// glTF 2.0's model: a blend of a metal of the base colour and a coated diffuse base, part of which may be
    /// glass of the base colour.
    MetallicRoughness {
        /// Share of metal.
        metallic: f64,
        /// Roughness.
        roughness: f64,
        /// Index of refraction of what is not metal.
        ior: f64,
        /// Share of the non-metal that is glass.
        transmission: f64,
    },
    /// One of two other materials at each point, by chance.
    Mix {
        /// The one.
        first: MaterialId,
        /// The other.
        second: MaterialId,
        /// Share of the other, 0..1.
        amount: f64,
    },
}

/// What opacity means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Nothing: the surface is opaque.
    #[default]
    Opaque,
    /// The surface is there where opacity is at least the cut-off.
    Mask {
        /// The cut-off.
        cutoff: f64,
    },
    /// That share of the light meets the surface, the rest passes it.
    Blend,
}

/// Textures of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Textures {
    /// Base colour (R, G, B) and, without a texture of opacity, opacity (A).
    pub base: Option<TextureRef>,
    /// Opacity (R).
    pub opacity: Option<TextureRef>,
    /// Emitted radiance (R, G, B).
    pub emission: Option<TextureRef>,
    /// Roughness (G) and metallic share (B).
    pub metallic_roughness: Option<TextureRef>,
    /// Metallic share (R), where a file has a picture of its own for it.
    pub metallic: Option<TextureRef>,
    /// Share of transmission (R).
    pub transmission: Option<TextureRef>,
    /// Normals in tangent space, 0.5 + 0.5 n.
    pub normal: Option<TextureRef>,
    /// Factor of the x and y of such normals.
    pub normal_scale: f64,
    /// Ambient light that arrives (R); only models with ambient light look at it.
    pub occlusion: Option<TextureRef>,
    /// How much of the occlusion counts, 0..1.
    pub occlusion_strength: f64,
}

/// Use of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Which.
    pub texture: TextureId,
    /// Set of texture coordinates of the mesh, 0 or 1.
    pub uv_set: u8,
    /// Texture coordinates of the mesh to those of the picture, whose first row begins at v = 0.
    pub transform: DAffine2,
    /// What is beyond the edges, in u and v.
    pub wrap: [Wrap; 2],
    /// The nearest texel instead of bilinear interpolation.
    pub nearest: bool,
}

/// What is beyond a texture's edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// Its mirror image.
    Mirror,
    /// Its outermost texels.
    Clamp,
}

impl Textures {
    /// All uses of textures.
    pub fn uses(&self) -> impl Iterator<Item = TextureRef> {
        let light = [self.base, self.opacity, self.emission, self.occlusion];
        let form = [self.metallic_roughness, self.metallic, self.transmission, self.normal];
        light.into_iter().chain(form).flatten()
    }

    /// All uses of textures, to renumber them.
    pub fn uses_mut(&mut self) -> impl Iterator<Item = &mut TextureRef> {
        let all = [
            &mut self.base,
            &mut self.opacity,
            &mut self.emission,
            &mut self.metallic_roughness,
            &mut self.metallic,
            &mut self.transmission,
            &mut self.normal,
            &mut self.occlusion,
        ];
        all.into_iter().flatten()
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            diffuse: DVec3::splat(0.7),
            mirror: DVec3::ZERO,
            emission: DVec3::ZERO,
            one_sided: false,
            scattering: Scattering::Matte,
            multiple_scattering: true,
            opacity: 1.0,
            alpha: Alpha::Opaque,
            textures: Textures::default(),
        }
    }
}

impl TextureRef {
    /// Plain use of `texture` with the first set of coordinates.
    pub fn new(texture: TextureId) -> Self {
        Self { texture, uv_set: 0, transform: DAffine2::IDENTITY, wrap: [Wrap::Repeat; 2], nearest: false }
    }
}
