//! Statements about the whole scene: its name and units, cameras, background.

use glam::DVec3;

use super::fields::{Fields, NO_REST, colour_from, numbers_of};
use super::scope::Scope;
use super::source::{Span, near, quote};
use super::syntax::{Entry, Node, Value};
use crate::error::{Error, Result};
use crate::scene::description::{CameraDescription, Precision, Projection};
use crate::scene::parameter::Parameter;

/// Statements that belong to the top level.
pub const NAMES: [&str; 10] =
    ["scene", "units", "precision", "parameter", "camera", "light", "background", "ambient", "environment", "material"];

/// Names of units and their length in metres.
pub const UNITS: [(&str, f64); 8] = [
    ("m", 1.0),
    ("dm", 0.1),
    ("cm", 0.01),
    ("mm", 0.001),
    ("um", 1e-6),
    ("km", 1000.0),
    ("in", 0.0254),
    ("ft", 0.3048),
];

/// `units mm`: metres per scene unit.
///
/// # Errors
/// An unknown unit.
pub fn units(scope: &Scope<'_>, node: &Node<'_>) -> Result<f64> {
    let (name, span) = only_name(scope, node)?;
    match metres_per(name) {
        Some(metres) => Ok(metres),
        None => Err(scope.source.error(span, unknown_unit(name))),
    }
}

/// Metres per unit `name`.
pub fn metres_per(name: &str) -> Option<f64> {
    UNITS.iter().find(|u| u.0 == name).map(|u| u.1)
}

/// What to say about a unit that does not exist.
pub fn unknown_unit(name: &str) -> String {
    let all: Vec<&str> = UNITS.iter().map(|u| u.0).collect();
    format!("unknown unit {}: expected one of {}", quote(name), all.join(", "))
}

/// `precision f64`.
///
/// # Errors
/// Anything but f32 and f64.
pub fn precision(scope: &Scope<'_>, node: &Node<'_>) -> Result<Precision> {
    match only_name(scope, node)? {
        ("f32", _) => Ok(Precision::F32),
        ("f64", _) => Ok(Precision::F64),
        (_, span) => Err(scope.source.error(span, "expected f32 or f64")),
    }
}

/// The one name after a statement that has nothing else.
///
/// # Errors
/// Anything but one name.
pub fn only_name<'n, 'a>(scope: &Scope<'a>, node: &'n Node<'a>) -> Result<(&'n str, Span)> {
    let fields = Fields::collect(scope, node, &[], NO_REST)?;
    match fields.title()? {
        Some((name, span)) if !name.is_empty() => Ok((name, span)),
        _ => Err(fields.error(format!("expected `{}` and a name", node.name))),
    }
}

/// `background 0.1 0.2 0.3`: the colour after a statement that has nothing else.
///
/// # Errors
/// Anything but a colour.
pub fn only_colour(scope: &Scope<'_>, node: &Node<'_>) -> Result<DVec3> {
    let fields = Fields::collect(scope, node, &[], NO_REST)?;
    let numbers = numbers_of(scope, &node.entries)?;
    colour_from(&numbers, f64::INFINITY).map_err(|what| fields.error(format!("`{}` {what}", node.name)))
}

/// What a parameter must say.
pub const NO_NUMBER: &str = "expected `parameter name value` or `parameter name { key FRAME VALUE; ... }`";

/// The value that `set` gives to `name`.
///
/// # Errors
/// A value that is no number or expression.
pub fn set_value(scope: &Scope<'_>, name: &str, set: &[(String, String)]) -> Result<Option<f64>> {
    let Some((_, text)) = set.iter().rev().find(|(n, _)| n == name) else { return Ok(None) };
    let value = super::expression::evaluate(text, scope);
    value.map(Some).map_err(|fault| Error::Usage(format!("--set {name}={text}: {}", fault.what)))
}

/// `parameter radius 1.5` or `parameter radius { key FRAME VALUE; ... }`, unless `set` gives another value: defines the
/// name in `scope`. `from=0.5 to=3 step=0.1` say what a slider offers.
///
/// # Errors
/// Names that are taken or not names, values that are not one number, ranges that are none.
pub fn parameter(scope: &mut Scope<'_>, node: &Node<'_>, set: &[(String, String)]) -> Result<()> {
    let fields = Fields::collect(scope, node, &["from", "to", "step"], &["key"])?;
    let values: Vec<&Entry<'_>> = node.entries.iter().filter(|entry| entry.name.is_none()).collect();
    let (name_entry, value) = match (values.as_slice(), fields.rest.is_empty()) {
        (&[name, value], true) => (name, Some(value)),
        (&[name], false) => (name, None),
        _ => return Err(fields.error(NO_NUMBER)),
    };
    let Value::Text(name) = &name_entry.value else {
        return Err(scope.source.error(name_entry.span, "expected the parameter's name"));
    };
    if !super::expression::is_free_name(name) {
        let what = format!(
            "{} cannot name a parameter: words of letters, digits and _ with dots between them, not a function",
            quote(name)
        );
        return Err(scope.source.error(name_entry.span, what));
    }
    if scope.parameters.contains_key(name.as_ref()) {
        return Err(scope.source.error(name_entry.span, format!("parameter {} is defined twice", quote(name))));
    }
    let number = match value {
        None => super::keys::value(scope, node)?,
        Some(value) => match numbers_of(scope, std::slice::from_ref(value))?.as_slice() {
            &[number] => number,
            _ => return Err(scope.source.error(value.span, "a parameter has one value")),
        },
    };
    // What the file says sets the range where nothing else does: it stays when the value is changed.
    let mut parameter = Parameter::new(name, number);
    let (low, high) = parameter.range;
    parameter.range = (fields.number("from")?.unwrap_or(low), fields.number("to")?.unwrap_or(high));
    if parameter.range.0 >= parameter.range.1 {
        let (low, high) = parameter.range;
        return Err(fields.error(format!("a slider from {low} to {high}: expected `from` below `to`")));
    }
    if fields.has("step") {
        parameter.step = fields.positive("step", 1.0)?;
    }
    parameter.value = set_value(scope, name, set)?.unwrap_or(number);
    scope.parameters.insert(name.to_string(), parameter.value);
    scope.written.push(parameter);
    Ok(())
}

/// Refuses `--set` names that are no parameters.
///
/// # Errors
/// The first such name, with the names there are.
pub fn check_set(scope: &Scope<'_>, set: &[(String, String)]) -> Result<()> {
    let Some((name, _)) = set.iter().find(|(n, _)| !scope.parameters.contains_key(n)) else { return Ok(()) };
    let names: Vec<&str> = scope.parameters.keys().map(String::as_str).filter(|n| *n != super::keys::FRAME).collect();
    let file = scope.source.file.display();
    let mut what = format!("--set {name}: {file} has no parameter {}", quote(name));
    match near(name, names.iter().copied()) {
        Some(n) => what += &format!("; did you mean `{n}`?"),
        None if names.is_empty() => what += "; it has none",
        None => what += &format!("; it has {}", quote(&names.join(", "))),
    }
    Err(Error::Usage(what))
}

/// `camera "main" { eye ..; look-at ..; up ..; fov 45 }` or `parallel 4` instead of `fov`.
///
/// # Errors
/// Fields that do not fit, an eye in the point looked at, an up vector along the view.
pub fn camera(scope: &Scope<'_>, node: &Node<'_>) -> Result<CameraDescription> {
    let fields = Fields::collect(scope, node, &["eye", "look-at", "up", "fov", "parallel"], NO_REST)?;
    let name = fields.title()?.map_or("main", |(name, _)| name);
    let eye = fields.vector("eye")?.ok_or_else(|| fields.error("a camera needs an `eye`"))?;
    let look_at = fields.vector("look-at")?.unwrap_or(DVec3::ZERO);
    let up = fields.direction("up")?.unwrap_or(DVec3::Y);
    if (look_at - eye).try_normalize().is_none() {
        return Err(fields.error_at("look-at", "`eye` and `look-at` must differ"));
    }
    if CameraDescription::is_along_view(eye, look_at, up) {
        return Err(fields.error_at("up", "`up` must not point along the view"));
    }
    let projection = match (fields.number("fov")?, fields.has("parallel")) {
        (Some(_), true) => return Err(fields.error_at("parallel", "a camera has `fov` or `parallel`, not both")),
        (_, true) => Projection::Parallel { height: fields.positive("parallel", 1.0)? },
        (degrees, false) => {
            let degrees = degrees.unwrap_or(45.0);
            if !(degrees > 0.0 && degrees < 180.0) {
                return Err(fields.error_at("fov", format!("`fov` lies between 0 and 180 degrees, found {degrees}")));
            }
            Projection::Perspective { theta: degrees.to_radians() }
        }
    };
    Ok(CameraDescription { name: name.into(), eye, look_at, up, projection })
}
