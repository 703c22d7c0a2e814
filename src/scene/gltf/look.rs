//! Cameras and lights, as their nodes place them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DAffine3, DVec3};

use super::Document;
use super::json_looks::Light as Written;
use crate::error::Result;
use crate::scene::description::{CameraDescription, Light, Projection};
use crate::scene::text;

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

/// Light `index` of KHR_lights_punctual as node `node` places it: candela are radiant intensity here, lux irradiance,
/// both without conversion. Its range is not read: light falls with the square of the distance, however far.
///
/// # Errors
/// An index that names nothing, an unknown kind, negative numbers, cones that do not open or open beyond a half-space.
pub fn light(document: &Document<'_>, index: u32, node: u32, to_world: &DAffine3) -> Result<Light> {
    let all: &[Written] = document.root.extensions.as_ref().and_then(|e| e.lights.as_ref()).map_or(&[], |l| &l.lights);
    let written = document.get(all, "lights", index, format_args!("nodes[{node}].extensions.KHR_lights_punctual"))?;
    let path = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let strength = DVec3::from_array(written.color.unwrap_or([1.0; 3])) * written.intensity.unwrap_or(1.0);
    if strength.min_element() < 0.0 || !strength.is_finite() {
        return Err(document.error(path, format!("expected a color and an intensity of 0 or more, found {strength}")));
    }
    // A light shines along -z; scales of its node do not count.
    let direction = to_world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    let position = to_world.translation;
    match &*written.kind {
        "point" => Ok(Light::Point { position, intensity: strength }),
        "directional" => Ok(Light::Directional { direction, irradiance: strength }),
        "spot" => {
            let cone = written.spot.as_deref();
            let inner = cone.and_then(|c| c.inner_cone_angle).unwrap_or(0.0);
            let outer = cone.and_then(|c| c.outer_cone_angle).unwrap_or(FRAC_PI_4);
            // Exporters round a right angle to f32.
            if !(inner >= 0.0 && inner < outer && outer <= FRAC_PI_2 + 1e-6) {
                let what =
                    format!("expected 0 <= innerConeAngle < outerConeAngle <= pi / 2, found {inner} and {outer}");
                return Err(document.error(format_args!("{path}.spot"), what));
            }
            Ok(Light::Spot { position, direction, intensity: strength, inner, outer })
        }
        other => {
            let found = text::shown(other.as_bytes());
            Err(document
                .error(format_args!("{path}.type"), format!("expected point, spot or directional, found {found}")))
        }
    }
}
