//! Shape statements: size and place as a person gives them, lowered to a canonical shape and a transform.

use glam::{DAffine3, DMat3, DVec3};

use super::fields::Fields;
use super::transform::frame_along;
use crate::error::Result;
use crate::scene::description::Shape;

/// The statements of this file.
pub const NAMES: [&str; 7] = ["sphere", "box", "cylinder", "cone", "disc", "plane", "half-space"];

/// The fields of shape statement `name`.
pub fn fields_of(name: &str) -> &'static [&'static str] {
    match name {
        "sphere" => &["center", "radius", "material"],
        "box" => &["center", "size", "min", "max", "material"],
        "cylinder" => &["from", "to", "radius", "material"],
        "cone" => &["from", "to", "radius", "top", "material"],
        "disc" => &["center", "normal", "radius", "material"],
        _ => &["point", "normal", "material"],
    }
}

/// The canonical shape of a statement and the transform that gives it size and place.
///
/// # Errors
/// Fields that do not fit, sizes that are not above zero.
pub fn canonical(fields: &Fields<'_, '_, '_>) -> Result<(Shape, DAffine3)> {
    fields.no_arguments()?;
    match fields.node.name.as_ref() {
        "sphere" => {
            let radius = fields.positive("radius", 1.0)?;
            let center = fields.vector("center")?.unwrap_or(DVec3::ZERO);
            Ok((Shape::Sphere, placed(DMat3::from_diagonal(DVec3::splat(radius)), center)))
        }
        "box" => cuboid(fields),
        "cylinder" => {
            let radius = fields.positive("radius", 1.0)?;
            let (from, to) = ends(fields)?;
            Ok((Shape::Cylinder, along(from, to, radius)))
        }
        "cone" => cone(fields),
        "disc" => {
            let radius = fields.positive("radius", 1.0)?;
            let center = fields.vector("center")?.unwrap_or(DVec3::ZERO);
            let turn = frame_along(normal(fields)?);
            Ok((Shape::Disc, placed(turn * DMat3::from_diagonal(DVec3::splat(radius)), center)))
        }
        _ => {
            let point = fields.vector("point")?.unwrap_or(DVec3::ZERO);
            Ok((Shape::HalfSpace, placed(frame_along(normal(fields)?), point)))
        }
    }
}

fn placed(matrix: DMat3, origin: DVec3) -> DAffine3 {
    DAffine3::from_mat3_translation(matrix, origin)
}

fn normal(fields: &Fields<'_, '_, '_>) -> Result<DVec3> {
    Ok(fields.direction("normal")?.map_or(DVec3::Z, DVec3::normalize))
}

fn cuboid(fields: &Fields<'_, '_, '_>) -> Result<(Shape, DAffine3)> {
    let corners = fields.vector("min")?.zip(fields.vector("max")?);
    let by_corners = fields.has("min") || fields.has("max");
    let (center, half) = match corners {
        Some((low, high)) if !fields.has("center") && !fields.has("size") => ((low + high) / 2.0, (high - low) / 2.0),
        _ if by_corners => return Err(fields.error("a box takes both min and max, or center and size")),
        _ => {
            let size = match fields.numbers("size")?.as_deref() {
                None => DVec3::ONE,
                Some(&[s]) => DVec3::splat(s),
                Some(&[x, y, z]) => DVec3::new(x, y, z),
                Some(v) => {
                    return Err(fields.error_at("size", format!("`size` takes one number or three, found {}", v.len())));
                }
            };
            (fields.vector("center")?.unwrap_or(DVec3::ZERO), size / 2.0)
        }
    };
    if half.min_element() <= 0.0 {
        let field = if by_corners { "max" } else { "size" };
        return Err(fields.error_at(field, "the sides of a box must be above zero"));
    }
    Ok((Shape::Cuboid, placed(DMat3::from_diagonal(half), center)))
}

fn cone(fields: &Fields<'_, '_, '_>) -> Result<(Shape, DAffine3)> {
    let radius = fields.positive("radius", 1.0)?;
    let top = fields.number("top")?.unwrap_or(0.0);
    if top < 0.0 {
        return Err(fields.error_at("top", format!("`top` must not be negative, found {top}")));
    }
    let (from, to) = ends(fields)?;
    if top <= radius {
        return Ok((Shape::cone(top / radius), along(from, to, radius)));
    }
    // The canonical cone does not widen upwards: it is the mirror image of this one.
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    let shape = Shape::Cone { top: radius / top, is_mirrored: true };
    Ok((shape, placed(along(from, to, top).matrix3 * mirror, to)))
}

fn ends(fields: &Fields<'_, '_, '_>) -> Result<(DVec3, DVec3)> {
    let from = fields.vector("from")?.unwrap_or(DVec3::ZERO);
    let to = fields.vector("to")?.unwrap_or(DVec3::Z);
    match (to - from).try_normalize() {
        Some(_) => Ok((from, to)),
        None => Err(fields.error_at("to", "the ends `from` and `to` must differ")),
    }
}

/// Takes the unit cylinder along z to the one of `radius` between `from` and `to`.
fn along(from: DVec3, to: DVec3, radius: f64) -> DAffine3 {
    let axis = to - from;
    let size = DMat3::from_diagonal(DVec3::new(radius, radius, axis.length()));
    placed(frame_along(axis.normalize()) * size, from)
}
