//! Cameras, and the base colours of materials.

use glam::{DAffine3, DVec3};

use super::Document;
use super::json::Root;
use crate::error::Result;
use crate::scene::description::{CameraDescription, Description, Material, Projection};
use crate::scene::text;

/// Diffuse reflectance behind a base colour of 1: textures are not read, and a scene of pure white has no shading.
const WHITE: f64 = 0.8;

/// Adds the document's materials: number `i` becomes `i + 1`, after the default material.
pub fn add_materials(root: &Root, description: &mut Description) {
    description.materials.reserve_exact(root.materials.len());
    let mut textured = 0;
    for (i, material) in root.materials.iter().enumerate() {
        let pbr = material.pbr_metallic_roughness.as_deref();
        textured += usize::from(pbr.is_some_and(|pbr| pbr.base_color_texture.is_some()));
        let factor = pbr.and_then(|pbr| pbr.base_color_factor).unwrap_or([1.0; 4]);
        let diffuse = DVec3::new(factor[0], factor[1], factor[2]).clamp(DVec3::ZERO, DVec3::ONE) * WHITE;
        let name = material.name.as_deref().map_or_else(|| format!("material {i}"), |n| text::name(n.as_bytes()));
        description.materials.push(Material { name, diffuse, ..Material::default() });
    }
    if textured > 0 {
        description.warnings.push(format!("textures are not read: {textured} materials have their base colour only"));
    }
}

/// Camera `index` as node `node` places it; `None` for a kind that an extension defines.
///
/// # Errors
/// An index that names nothing, an angle or a size that is out of range.
pub fn camera(
    document: &Document<'_>,
    index: u32,
    node: u32,
    to_world: &DAffine3,
) -> Result<Option<CameraDescription>> {
    let path = format_args!("nodes[{node}].camera");
    let camera = document.get(&document.root.cameras, "cameras", index, path)?;
    let projection = if let Some(perspective) = &camera.perspective {
        let theta = perspective.yfov;
        if !(theta > 0.0 && theta < std::f64::consts::PI) {
            let what = format!("expected an angle above 0 and below pi, found {theta}");
            return Err(document.error(format_args!("cameras[{index}].perspective.yfov"), what));
        }
        Projection::Perspective { theta }
    } else if let Some(orthographic) = &camera.orthographic {
        // The sign of a magnification only mirrors the picture.
        let height = 2.0 * orthographic.ymag.abs();
        if !(height > 0.0 && height.is_finite()) {
            let what = format!("expected a number other than 0, found {}", orthographic.ymag);
            return Err(document.error(format_args!("cameras[{index}].orthographic.ymag"), what));
        }
        Projection::Parallel { height }
    } else {
        return Ok(None);
    };
    // A camera looks along -z with y up; scales of its node do not count (glTF 2.0, section 3.10.1).
    let forward = to_world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    let up = to_world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
    let names = [document.root.nodes[node as usize].name.as_deref(), camera.name.as_deref()];
    let name = names.into_iter().flatten().next().map(|n| text::name(n.as_bytes()));
    let eye = to_world.translation;
    let name = name.unwrap_or_else(|| format!("camera {index}"));
    Ok(Some(CameraDescription { name, eye, look_at: eye + forward, up, projection }))
}
