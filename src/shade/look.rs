//! Materials made ready: what a point of one scatters with, from constants and textures.

use std::sync::Arc;

use glam::DVec3;

use super::glow::Glows;
use super::path::Rough;
use super::path::fresnel::dielectric_mean;
use crate::scene::description::{Description, Material};
use crate::scene::material::{Alpha, Scattering, TextureRef};
use crate::scene::texture::Texture;
use crate::scene::world::Surface;

/// Widths of GGX below this are perfect mirrors.
const SMOOTH: f64 = 1e-3;
/// The least width of [`Scattering::MetallicRoughness`], which has no smooth form.
const LEAST_WIDTH: f64 = 2e-3;

/// Kernels of scattering, and the lists of points they work on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Lambert and mirror.
    Matte,
    /// Smooth metal.
    SmoothConductor,
    /// Rough metal.
    RoughConductor,
    /// Smooth glass.
    SmoothDielectric,
    /// Rough glass.
    RoughDielectric,
    /// Thin pane.
    Thin,
    /// Smooth plastic.
    SmoothCoat,
    /// Rough plastic.
    RoughCoat,
    /// glTF's.
    MetalRough,
}

impl Model {
    /// All models, each at its own number.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Matte,
        Self::SmoothConductor,
        Self::RoughConductor,
        Self::SmoothDielectric,
        Self::RoughDielectric,
        Self::Thin,
        Self::SmoothCoat,
        Self::RoughCoat,
        Self::MetalRough,
    ];
    /// Number of models.
    pub const COUNT: usize = 9;
}

/// What a point scatters with.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// The kernel.
    pub model: Model,
    /// Base colour.
    pub base: DVec3,
    /// The kernel's parameters.
    pub param: [f64; 7],
}

/// A material made ready.
#[derive(Debug)]
struct Ready {
    /// What a point without textures scatters with, light from the front.
    front: Look,
    /// The same from behind.
    back: Look,
    /// Whether a texture changes the look.
    is_textured: bool,
    /// Whether all points of it look the same, and shine not.
    is_even: bool,
}

/// The materials of a scene made ready.
#[derive(Debug)]
pub struct Looks<'a> {
    materials: Vec<(Material, Ready)>,
    textures: &'a [Arc<Texture>],
    glows: Glows,
    /// The rough surfaces that parameters number.
    pub rough: Vec<Rough>,
    /// Whether some material lets rays pass by its opacity.
    pub has_holes: bool,
    /// Whether some material is a mixture.
    pub has_mixtures: bool,
    /// Whether some material is glass ([`Self::is_glass`]).
    pub has_glass: bool,
}

impl<'a> Looks<'a> {
    /// Those of `description`; a number beyond the list means the default material.
    pub fn new(description: &'a Description) -> Self {
        let mut rough = Vec::new();
        let ready = |m: &Material| (m.clone(), Ready::new(m, &mut rough));
        let mut materials: Vec<_> = description.materials.iter().map(ready).collect();
        if materials.is_empty() {
            materials.push((Material::default(), Ready::new(&Material::default(), &mut rough)));
        }
        let glows = Glows::new(&materials.iter().map(|(material, _)| material).collect::<Vec<_>>());
        let has_holes = materials.iter().any(|(m, _)| m.alpha != Alpha::Opaque);
        let has_mixtures = materials.iter().any(|(m, _)| matches!(m.scattering, Scattering::Mix { .. }));
        let has_glass = materials.iter().any(|(m, _)| lets_pass(m));
        Self { materials, textures: &description.textures, glows, rough, has_holes, has_mixtures, has_glass }
    }

    /// Material number `id`.
    pub fn material(&self, id: u32) -> &Material {
        &self.entry(id).0
    }

    fn entry(&self, id: u32) -> &(Material, Ready) {
        self.materials.get(id as usize).unwrap_or(&self.materials[0])
    }

    /// The material that a mixture shows where `choice` in [0, 1) falls, `id` itself if it is none.
    pub fn resolve(&self, mut id: u32, mut choice: f64) -> u32 {
        // A mixture of mixtures ends: chains longer than the list of materials would be cycles.
        for _ in 0..self.materials.len() {
            let Scattering::Mix { first, second, amount } = self.material(id).scattering else { return id };
            let amount = amount.clamp(0.0, 1.0);
            // What is left of the number is as good as a new one.
            (id, choice) =
                if choice < amount { (second, choice / amount) } else { (first, (choice - amount) / (1.0 - amount)) };
        }
        id
    }

    /// Whether all points of material `id` look the same, from both sides, none shines, and no normal map bends the surface.
    pub fn is_alike(&self, id: u32) -> bool {
        let (material, ready) = self.entry(id);
        ready.is_even && !matches!(material.scattering, Scattering::Dielectric { .. })
    }

    /// Whether all points of material `id` look the same from one side, none shines, and no normal map bends the surface.
    #[inline]
    pub fn is_even(&self, id: u32) -> bool {
        self.entry(id).1.is_even
    }

    /// What every point of material `id` scatters with that is seen from the side of its normal (`from_front`) or from
    /// behind, if that is the same everywhere, none shines, and no normal map bends the surface.
    #[inline]
    pub fn even(&self, id: u32, from_front: bool) -> Option<&Look> {
        let ready = &self.entry(id).1;
        ready.is_even.then_some(if from_front { &ready.front } else { &ready.back })
    }

    /// What points without textures scatter with, material by material from the front and from behind.
    pub fn sides(&self) -> impl Iterator<Item = &Look> {
        self.materials.iter().flat_map(|(_, ready)| [&ready.front, &ready.back])
    }

    /// [`Self::even`] as its place in [`Self::sides`], with the model.
    #[inline]
    pub fn even_side(&self, id: u32, from_front: bool) -> Option<(u32, Model)> {
        let look = self.even(id, from_front)?;
        let id = if (id as usize) < self.materials.len() { id } else { 0 };
        Some((2 * id + u32::from(!from_front), look.model))
    }

    /// What material `id` (no mixture) scatters with at `surface`; `from_front`: seen from the side of its normal.
    pub fn look(&self, id: u32, surface: &Surface, from_front: bool) -> Look {
        let (material, ready) = self.entry(id);
        let mut look = if from_front { ready.front } else { ready.back };
        if ready.is_textured {
            let textures = &material.textures;
            if let Some(color) = self.sample(textures.base.as_ref(), surface) {
                look.base *= rgb(color);
            }
            if look.model == Model::MetalRough {
                if let Some([_, g, b, _]) = self.sample(textures.metallic_roughness.as_ref(), surface) {
                    look.param[0] *= f64::from(b);
                    if let Scattering::MetallicRoughness { roughness, .. } = material.scattering {
                        look.param[1] = (roughness * f64::from(g)).powi(2).clamp(LEAST_WIDTH, 1.0);
                    }
                }
                if let Some([r, ..]) = self.sample(textures.metallic.as_ref(), surface) {
                    look.param[0] *= f64::from(r);
                }
                if let Some([r, ..]) = self.sample(textures.transmission.as_ref(), surface) {
                    look.param[3] *= f64::from(r);
                }
            }
        }
        look
    }

    /// Radiance that material `id` emits at `surface` to the side of its normal (`from_front`) or the other one;
    /// mixtures emit what their materials do, by their shares.
    #[inline]
    pub fn emission(&self, id: u32, surface: &Surface, from_front: bool) -> DVec3 {
        self.emission_by(id, from_front, |texture| self.sample(texture, surface))
    }

    /// The same without textures.
    pub fn plain_emission(&self, id: u32, from_front: bool) -> DVec3 {
        self.emission_by(id, from_front, |_| None)
    }

    #[inline]
    fn emission_by(
        &self,
        id: u32,
        from_front: bool,
        sample: impl Fn(Option<&TextureRef>) -> Option<[f32; 4]>,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for &(id, share) in self.glows.of(id) {
            let material = self.material(id);
            if from_front || !material.one_sided {
                sum += material.emission * share * sample(material.textures.emission.as_ref()).map_or(DVec3::ONE, rgb);
            }
        }
        sum
    }

    /// Whether what material `id` emits differs from point to point.
    pub fn has_pictured_emission(&self, id: u32) -> bool {
        self.glows.of(id).iter().any(|&(id, _)| self.material(id).textures.emission.is_some())
    }

    /// Whether material `id` emits anything.
    pub fn shines(&self, id: u32) -> bool {
        !self.glows.of(id).is_empty()
    }

    /// Whether material `id` may let rays pass.
    pub fn is_holed(&self, id: u32) -> bool {
        self.material(id).alpha != Alpha::Opaque
    }

    /// Whether material `id` is a pane or a body of glass, or has some of it.
    pub fn is_glass(&self, id: u32) -> bool {
        lets_pass(self.material(id))
    }

    /// Share of ambient light that reaches material `id` at `surface`.
    pub fn ambient(&self, id: u32, surface: &Surface<'_>) -> f64 {
        let textures = &self.material(id).textures;
        let open = self.sample(textures.occlusion.as_ref(), surface).map_or(1.0, |c| f64::from(c[0]));
        1.0 + (open - 1.0) * textures.occlusion_strength
    }

    /// Share of light that material `id` stops at `surface`.
    pub fn opacity(&self, id: u32, surface: &Surface) -> f64 {
        let material = self.material(id);
        let opacity = || {
            // A picture of opacity says it all: it is often that of the base colour again, whose alpha would count twice.
            let own = self.sample(material.textures.opacity.as_ref(), surface).map(|c| c[0]);
            let base = || self.sample(material.textures.base.as_ref(), surface).map(|c| c[3]);
            let share = own.or_else(base).map_or(1.0, f64::from);
            (material.opacity * share).clamp(0.0, 1.0)
        };
        match material.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Mask { cutoff } => f64::from(u8::from(opacity() >= cutoff)),
            Alpha::Blend => opacity(),
        }
    }

    /// Normal of `surface` by the normal map of material `id`; the shading normal without one.
    pub fn bumped(&self, id: u32, surface: &Surface) -> DVec3 {
        let textures = &self.material(id).textures;
        let Some(map) = &textures.normal else { return surface.ns };
        let (Some(tangents), Some([x, y, z, _])) =
            (surface.tangents(map.uv_set, &map.transform.matrix2), self.sample(Some(map), surface))
        else {
            return surface.ns;
        };
        let part = |level: f32| 2.0 * f64::from(level) - 1.0;
        let scale = textures.normal_scale;
        let n = tangents[0] * (part(x) * scale) + tangents[1] * (part(y) * scale) + surface.ns * part(z);
        n.try_normalize().unwrap_or(surface.ns)
    }

    fn sample(&self, use_of: Option<&TextureRef>, surface: &Surface) -> Option<[f32; 4]> {
        let r = use_of?;
        Some(self.textures.get(r.texture as usize)?.sample(r, surface.uv(r.uv_set)))
    }
}

fn lets_pass(material: &Material) -> bool {
    match material.scattering {
        Scattering::Dielectric { .. } | Scattering::ThinGlass { .. } => true,
        Scattering::MetallicRoughness { transmission, .. } => transmission > 0.0,
        _ => false,
    }
}

fn rgb(color: [f32; 4]) -> DVec3 {
    DVec3::new(f64::from(color[0]), f64::from(color[1]), f64::from(color[2]))
}

impl Ready {
    fn new(material: &Material, rough: &mut Vec<Rough>) -> Self {
        let t = &material.textures;
        let is_textured = [t.base, t.metallic_roughness, t.metallic, t.transmission].iter().any(Option::is_some);
        let is_even = !is_textured
            && t.normal.is_none()
            && t.occlusion.is_none()
            && material.emission == DVec3::ZERO
            && !matches!(material.scattering, Scattering::Mix { .. });
        let (front, back) = (constant(material, true, rough), constant(material, false, rough));
        Self { front, back, is_textured, is_even }
    }
}

/// What `material` scatters with where no texture changes it; rough surfaces are added to the list `rough`.
fn constant(material: &Material, from_front: bool, rough: &mut Vec<Rough>) -> Look {
    let base = material.diffuse;
    let mut param = [0.0; 7];
    let width = |roughness: f64| (roughness * roughness).clamp(0.0, 1.0);
    let is_multiple = material.multiple_scattering;
    let mut number = |surface: Rough| {
        let known = rough.iter().position(|other| *other == surface);
        known.unwrap_or_else(|| {
            rough.push(surface);
            rough.len() - 1
        }) as f64
    };
    let (model, base) = match material.scattering {
        Scattering::Matte | Scattering::Mix { .. } => {
            param[..3].copy_from_slice(&material.mirror.to_array());
            (Model::Matte, base)
        }
        Scattering::Conductor { eta, k, roughness } => {
            param[..3].copy_from_slice(&eta.to_array());
            param[3..6].copy_from_slice(&k.to_array());
            let alpha = width(roughness);
            if alpha < SMOOTH {
                (Model::SmoothConductor, base)
            } else {
                param[6] = number(Rough::Metal { alpha, index: [eta.to_array(), k.to_array()], is_multiple });
                (Model::RoughConductor, base)
            }
        }
        Scattering::Dielectric { ior, roughness, tint } => {
            param[0] = if from_front { ior } else { 1.0 / ior };
            param[1] = width(roughness);
            // Facets without a change of the medium would bend light for no reason.
            let is_smooth = param[1] < SMOOTH || (ior - 1.0).abs() < 1e-6;
            if is_smooth {
                (Model::SmoothDielectric, tint)
            } else {
                param[2] = number(Rough::Glass { alpha: param[1], eta: param[0], is_multiple });
                (Model::RoughDielectric, tint)
            }
        }
        Scattering::ThinGlass { ior, tint } => {
            param[0] = ior;
            (Model::Thin, tint)
        }
        Scattering::Plastic { ior, roughness } => {
            param[0] = ior;
            param[1] = dielectric_mean(1.0 / ior);
            param[2] = width(roughness);
            if param[2] < SMOOTH {
                (Model::SmoothCoat, base)
            } else {
                param[3] = number(Rough::Coat { alpha: param[2], eta: ior });
                (Model::RoughCoat, base)
            }
        }
        Scattering::MetallicRoughness { metallic, roughness, ior, transmission } => {
            param[0] = metallic;
            param[1] = width(roughness).max(LEAST_WIDTH);
            param[2] = ((ior - 1.0) / (ior + 1.0)).powi(2);
            param[3] = transmission;
            (Model::MetalRough, base)
        }
    };
    Look { model, base, param }
}
