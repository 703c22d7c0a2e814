//! `light` statements.

use super::fields::{Fields, NO_REST};
use super::scope::Scope;
use super::source::quote;
use super::syntax::{Node, Value};
use crate::error::Result;
use crate::scene::description::Light;

const KINDS: [&str; 4] = ["point", "directional", "spot", "sun"];
/// Angle from the centre of the real sun to its rim as seen from the earth, degrees.
const SUN: f64 = 0.2666;

/// `light point { position ..; intensity .. }`, `light directional { direction ..; irradiance .. }`, `light spot
/// { position ..; direction ..; intensity ..; inner 20; outer 30 }`, `light sun { direction ..; irradiance ..;
/// angle 1 }`.
///
/// # Errors
/// Other kinds, fields that do not fit.
pub fn light(scope: &Scope<'_>, node: &Node<'_>) -> Result<Light> {
    let kind = node.entries.iter().find(|e| e.name.is_none());
    let Some(Value::Text(name)) = kind.map(|e| &e.value) else {
        let all: Vec<String> = KINDS.iter().map(|kind| format!("`light {kind}`")).collect();
        return Err(scope.source.error(node.span, format!("expected one of {}", all.join(", "))));
    };
    let allowed: &[&str] = match name.as_ref() {
        "point" => &["position", "intensity"],
        "directional" => &["direction", "irradiance"],
        "spot" => &["position", "intensity", "direction", "inner", "outer"],
        "sun" => &["direction", "irradiance", "angle"],
        _ => {
            let span = kind.map_or(node.span, |e| e.span);
            let what = format!("unknown light {}: expected one of {}", quote(name), KINDS.join(", "));
            return Err(scope.source.error_near(span, what, name, KINDS));
        }
    };
    let fields = Fields::collect(scope, node, allowed, NO_REST)?;
    fields.title()?;
    let strength = fields.colour(allowed[1], f64::INFINITY)?.unwrap_or(glam::DVec3::ONE);
    let missing = |what: &str| fields.error(format!("a {name} light needs a `{what}`"));
    let position = || fields.vector("position")?.ok_or_else(|| missing("position"));
    let direction = || fields.direction("direction")?.ok_or_else(|| missing("direction"));
    Ok(match name.as_ref() {
        "point" => Light::Point { position: position()?, intensity: strength },
        "directional" => Light::Directional { direction: direction()?, irradiance: strength },
        "spot" => {
            let outer = fields.number("outer")?.unwrap_or(45.0);
            let inner = fields.number("inner")?.unwrap_or(0.0);
            if !(inner >= 0.0 && inner < outer && outer < 180.0) {
                let what = format!("expected 0 <= `inner` < `outer` < 180 degrees, found {inner} and {outer}");
                return Err(fields.error_at("outer", what));
            }
            let (position, direction) = (position()?, direction()?);
            let (inner, outer) = (inner.to_radians(), outer.to_radians());
            Light::Spot { position, direction, intensity: strength, inner, outer }
        }
        _ => {
            let angle = fields.positive("angle", SUN)?;
            if angle >= 90.0 {
                let what = format!("`angle` is from the centre to the rim, below 90 degrees, found {angle}");
                return Err(fields.error_at("angle", what));
            }
            Light::Sun { direction: direction()?, irradiance: strength, radius: angle.to_radians() }
        }
    })
}
