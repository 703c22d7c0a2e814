//! Transform statements: `translate`, `scale`, `rotate`, `shear`, `matrix`.
//!
//! They act in the order they are written: the first acts on the shape, the next on the result. In a product of
//! matrices that take column vectors the last statement stands leftmost.

use glam::{DAffine3, DMat3, DVec3};

use super::expression::sin_degrees;
use super::fields::{Fields, NO_REST, numbers_of};
use super::scope::Scope;
use super::source::{Span, quote};
use super::syntax::{Node, Value};
use crate::error::Result;

/// The statements of this file.
pub const NAMES: [&str; 5] = ["translate", "scale", "rotate", "shear", "matrix"];

const SHEARS: [&str; 6] = ["xy", "xz", "yx", "yz", "zx", "zy"];

/// The transform of the statements `nodes`, all of which are named in [`NAMES`].
///
/// # Errors
/// Wrong arguments, transforms that flatten space.
pub fn product(scope: &Scope<'_>, nodes: &[&Node<'_>]) -> Result<DAffine3> {
    let mut product = DAffine3::IDENTITY;
    for node in nodes {
        product = one(scope, node)? * product;
        check_invertible(scope, product, node.span)?;
    }
    Ok(product)
}

/// Refuses transforms that have no finite inverse.
///
/// # Errors
/// Says so at `span`.
pub fn check_invertible(scope: &Scope<'_>, transform: DAffine3, span: Span) -> Result<()> {
    let determinant = transform.matrix3.determinant();
    let usable = determinant != 0.0 && determinant.is_finite() && transform.is_finite();
    if usable && transform.inverse().is_finite() {
        return Ok(());
    }
    Err(scope.source.error(span, "this transform flattens or overflows space: it cannot be inverted"))
}

/// The rotation of the statement `node`: as a transform, or `rotate 30` about y.
///
/// # Errors
/// Wrong arguments.
pub fn rotation(scope: &Scope<'_>, node: &Node<'_>) -> Result<DMat3> {
    let fields = Fields::collect(scope, node, &[], NO_REST)?;
    if let [only] = node.entries.as_slice() {
        return match *numbers_of(scope, std::slice::from_ref(only))?.as_slice() {
            [degrees] => Ok(turn(DVec3::Y, degrees).matrix3),
            _ => Err(fields.error("expected `rotate 30`, or an axis and degrees")),
        };
    }
    Ok(rotate(scope, &fields)?.matrix3)
}

fn one(scope: &Scope<'_>, node: &Node<'_>) -> Result<DAffine3> {
    if node.name == "shear" {
        return shear(scope, node);
    }
    let fields = Fields::collect(scope, node, &[], NO_REST)?;
    if node.name == "rotate" {
        return rotate(scope, &fields);
    }
    let v = numbers_of(scope, &node.entries)?;
    let wrong = |wanted: &str| Err(fields.error(format!("`{}` takes {wanted}, found {}", node.name, v.len())));
    match (node.name.as_ref(), v.as_slice()) {
        ("translate", &[x, y, z]) => Ok(DAffine3::from_translation(DVec3::new(x, y, z))),
        ("translate", _) => wrong("three numbers"),
        ("scale", &[s]) => Ok(DAffine3::from_scale(DVec3::splat(s))),
        ("scale", &[x, y, z]) => Ok(DAffine3::from_scale(DVec3::new(x, y, z))),
        ("scale", _) => wrong("one number or three"),
        (_, &[a, b, c, x, d, e, f, y, g, h, i, z]) => {
            let rows = DMat3::from_cols_array(&[a, b, c, d, e, f, g, h, i]);
            Ok(DAffine3::from_mat3_translation(rows.transpose(), DVec3::new(x, y, z)))
        }
        _ => wrong("12 numbers (three rows of four)"),
    }
}

/// `rotate x 30` about an axis of the space, or `rotate 1 1 0 30` about any axis; degrees, counter-clockwise when
/// the axis points at the viewer.
fn rotate(scope: &Scope<'_>, fields: &Fields<'_, '_, '_>) -> Result<DAffine3> {
    let entries = &fields.node.entries;
    if let [axis, angle] = entries.as_slice() {
        let axis = match &axis.value {
            Value::Text(name) if name == "x" => DVec3::X,
            Value::Text(name) if name == "y" => DVec3::Y,
            Value::Text(name) if name == "z" => DVec3::Z,
            Value::Text(name) => {
                return Err(scope
                    .source
                    .error(axis.span, format!("expected the axis x, y or z, found {}", quote(name))));
            }
            _ => return Err(scope.source.error(axis.span, "expected the axis x, y or z")),
        };
        let angle = numbers_of(scope, std::slice::from_ref(angle))?;
        if let [degrees] = angle.as_slice() {
            return Ok(turn(axis, *degrees));
        }
    } else if let &[x, y, z, degrees] = numbers_of(scope, entries)?.as_slice() {
        let axis = DVec3::new(x, y, z);
        return match axis.try_normalize() {
            Some(axis) => Ok(turn(axis, degrees)),
            None => Err(fields.error("the axis of this rotation has no direction")),
        };
    }
    Err(fields.error("expected `rotate y 30` or `rotate 1 1 0 30`: an axis, then degrees"))
}

/// Rotation about the unit vector `axis`; quarter turns about the axes of the space are exact.
fn turn(axis: DVec3, degrees: f64) -> DAffine3 {
    let (sin, cos) = (sin_degrees(degrees), sin_degrees(degrees + 90.0));
    // Rodrigues' formula, column by column.
    let column = |e: DVec3| e * cos + axis.cross(e) * sin + axis * (axis.dot(e) * (1.0 - cos));
    DAffine3::from_mat3(DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z)))
}

/// `shear xy=0.5`: x grows by half of y.
fn shear(scope: &Scope<'_>, node: &Node<'_>) -> Result<DAffine3> {
    let fields = Fields::collect(scope, node, &SHEARS, NO_REST)?;
    fields.no_arguments()?;
    let mut matrix = DMat3::IDENTITY;
    for name in SHEARS {
        let axis = |letter: u8| usize::from(letter - b'x');
        let (row, column) = (axis(name.as_bytes()[0]), axis(name.as_bytes()[1]));
        if let Some(amount) = fields.number(name)? {
            matrix.col_mut(column)[row] = amount;
        }
    }
    Ok(DAffine3::from_mat3(matrix))
}

/// The rotation that takes +z to the unit vector `axis`; the identity for +z itself.
///
/// Source: T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
pub fn frame_along(axis: DVec3) -> DMat3 {
    let sign = 1.0_f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let first = DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let second = DVec3::new(b, sign + axis.y * axis.y * a, -axis.y);
    DMat3::from_cols(first, second, axis)
}
