//! Materials: the metallic-roughness model of glTF 2.0 (section 3.9) and the extensions that are named in `gltf`.

use glam::DVec3;

use super::Document;
use super::json_looks::{Material as Written, TextureInfo};
use super::textures::Textures;
use crate::error::Result;
use crate::scene::description::{Description, Material};
use crate::scene::material::{Alpha, Scattering, TextureRef};
use crate::scene::pictures::Curve;
use crate::scene::text;

/// Index of refraction of what is not metal, unless KHR_materials_ior says another.
const IOR: f64 = 1.5;
/// Stands for infinity, which KHR_materials_ior writes as 0: 0.9996 of the light is reflected at right angles.
const INFINITE_IOR: f64 = 1e4;

/// Adds the document's materials (number `i` becomes `i + 1`, after the default material) and their textures; the
/// SHA-256 of each picture.
///
/// # Errors
/// What is wrong with materials, textures, samplers, images and their pictures.
pub fn add(document: &Document<'_>, description: &mut Description) -> Result<Vec<[u8; 32]>> {
    let list = &document.root.materials;
    document.spend((list.len() as u64).saturating_mul(size_of::<Material>() as u64), "materials")?;
    description.materials.reserve_exact(list.len());
    let mut textures = Textures::new(document);
    for (i, material) in list.iter().enumerate() {
        description.materials.push(read(document, material, i, &mut textures)?);
    }
    let decoded = textures.decode()?;
    description.textures = decoded.textures;
    description.warnings.extend(decoded.warnings);
    Ok(decoded.digests)
}

fn read(document: &Document<'_>, written: &Written, i: usize, textures: &mut Textures<'_, '_>) -> Result<Material> {
    let mut texture = |info: Option<&TextureInfo>, curve: Curve, what: &str| -> Result<Option<TextureRef>> {
        info.map_or(Ok(None), |info| textures.reference(info, curve, &format!("materials[{i}].{what}.index")))
    };
    let name = written.name.as_deref().map_or_else(|| format!("material {i}"), |n| text::name(n.as_bytes()));
    let pbr = written.pbr_metallic_roughness.as_deref();
    let extensions = written.extensions.as_deref();
    let [r, g, b, a] = pbr.and_then(|p| p.base_color_factor).unwrap_or([1.0; 4]);
    let base = DVec3::new(r, g, b).clamp(DVec3::ZERO, DVec3::ONE);
    let part = |number: Option<f64>, absent: f64| number.unwrap_or(absent).clamp(0.0, 1.0);

    let mut material = Material { name, diffuse: base, ..Material::default() };
    let base_info = pbr.and_then(|p| p.base_color_texture.as_deref());
    material.textures.base = texture(base_info, Curve::Srgb, "pbrMetallicRoughness.baseColorTexture")?;
    material.alpha = alpha(document, written, i)?;
    if material.alpha != Alpha::Opaque {
        material.opacity = a.clamp(0.0, 1.0);
    }
    if extensions.is_some_and(|e| e.unlit.is_some()) {
        // A surface that looks its base colour whatever the light: it emits it, and reflects nothing.
        material.emission = base;
        material.textures.emission = material.textures.base;
        material.diffuse = DVec3::ZERO;
        material.one_sided = !written.double_sided;
        return Ok(material);
    }

    let transmission = extensions.and_then(|e| e.transmission.as_ref());
    material.scattering = Scattering::MetallicRoughness {
        metallic: part(pbr.and_then(|p| p.metallic_factor), 1.0),
        roughness: part(pbr.and_then(|p| p.roughness_factor), 1.0),
        ior: ior(document, written, i)?,
        transmission: part(transmission.and_then(|t| t.transmission_factor), 0.0),
    };
    let info = pbr.and_then(|p| p.metallic_roughness_texture.as_deref());
    let metallic_roughness = texture(info, Curve::Linear, "pbrMetallicRoughness.metallicRoughnessTexture")?;
    let info = transmission.and_then(|t| t.transmission_texture.as_ref());
    let transmission = texture(info, Curve::Linear, "extensions.KHR_materials_transmission.transmissionTexture")?;
    let normal = written.normal_texture.as_deref();
    let occlusion = written.occlusion_texture.as_deref();
    let looks = &mut material.textures;
    looks.metallic_roughness = metallic_roughness;
    looks.transmission = transmission;
    looks.normal = texture(normal, Curve::Linear, "normalTexture")?;
    looks.normal_scale = normal.and_then(|n| n.scale).unwrap_or(1.0);
    looks.occlusion = texture(occlusion, Curve::Linear, "occlusionTexture")?;
    looks.occlusion_strength = part(occlusion.and_then(|o| o.strength), 1.0);
    looks.emission = texture(written.emissive_texture.as_deref(), Curve::Srgb, "emissiveTexture")?;

    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).and_then(|e| e.emissive_strength);
    let factor = written.emissive_factor.as_deref().map_or(DVec3::ZERO, |f| DVec3::from_array(*f));
    let emission = factor.max(DVec3::ZERO) * strength.unwrap_or(1.0).max(0.0);
    if !emission.is_finite() {
        let what = "emissiveFactor times emissiveStrength is beyond all numbers";
        return Err(document.error(format_args!("materials[{i}]"), what));
    }
    material.emission = emission;
    material.one_sided = !written.double_sided && emission != DVec3::ZERO;
    Ok(material)
}

fn alpha(document: &Document<'_>, written: &Written, i: usize) -> Result<Alpha> {
    match written.alpha_mode.as_deref() {
        None | Some("OPAQUE") => Ok(Alpha::Opaque),
        Some("MASK") => Ok(Alpha::Mask { cutoff: written.alpha_cutoff.as_deref().copied().unwrap_or(0.5) }),
        Some("BLEND") => Ok(Alpha::Blend),
        Some(other) => {
            let found = text::shown(other.as_bytes());
            let what = format!("expected OPAQUE, MASK or BLEND, found {found}");
            Err(document.error(format_args!("materials[{i}].alphaMode"), what))
        }
    }
}

fn ior(document: &Document<'_>, written: &Written, i: usize) -> Result<f64> {
    let ior = written.extensions.as_ref().and_then(|e| e.ior.as_ref()).and_then(|e| e.ior);
    match ior {
        None => Ok(IOR),
        Some(0.0) => Ok(INFINITE_IOR),
        Some(ior) if ior >= 1.0 => Ok(ior.min(INFINITE_IOR)),
        Some(ior) => {
            let path = format_args!("materials[{i}].extensions.KHR_materials_ior");
            Err(document.error(path, format!("expected an index of refraction of 1 or more, or 0, found {ior}")))
        }
    }
}
