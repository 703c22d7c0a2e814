//! `environment` statements: a picture of all directions, from a file or made by code.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::fields::Fields;
use super::images::{Images, Use};
use super::meshes::MeshFiles;
use super::scope::Scope;
use super::syntax::Node;
use super::{sky, transform};
use crate::error::Result;
use crate::scene::light::Environment;
use crate::scene::material::TextureRef;
use crate::scene::texture::{Texels, Texture};

/// Most texels that are turned into floats here.
const MAX_TEXELS: u64 = 1 << 25;

/// `environment "sky.exr" { scale 2; rotate y 30 }`, or `environment sky { direction -1 -2 -1 }`; the SHA-256 of the
/// file, if there is one.
///
/// # Errors
/// Fields that do not fit, pictures that cannot be used.
pub fn environment(
    scope: &Scope<'_>,
    node: &Node<'_>,
    files: &MeshFiles<'_>,
) -> Result<(Environment, Option<[u8; 32]>)> {
    let made = node.title().is_some_and(|(title, _)| title == "sky");
    let allowed: &[&str] = if made { &["scale", "direction", "turbidity", "ground"] } else { &["scale"] };
    let fields = Fields::collect(scope, node, allowed, &["rotate"])?;
    let missing = || fields.error("expected `environment \"file.exr\"` or `environment sky`");
    let (written, span) = fields.title()?.ok_or_else(missing)?;
    let mut to_world = DMat3::IDENTITY;
    for &child in &fields.rest {
        if child.name != "rotate" {
            let known: Vec<&str> = allowed.iter().chain(&["rotate"]).copied().collect();
            return Err(fields.unknown_child(child, &known));
        }
        to_world = transform::rotation(scope, child)? * to_world;
    }
    let scale = fields.colour("scale", f64::INFINITY)?.unwrap_or(DVec3::ONE);
    let (texture, digest) = if made {
        let direction = fields.direction("direction")?.unwrap_or(DVec3::new(-1.0, -1.0, -1.0));
        let to_sun = -direction.normalize();
        if to_sun.y <= 0.0 {
            return Err(fields.error_at("direction", "the sun must stand above the horizon: its light travels down"));
        }
        let turbidity = fields.number("turbidity")?.unwrap_or(3.0);
        if !(2.0..=10.0).contains(&turbidity) {
            return Err(fields.error_at("turbidity", format!("`turbidity` lies between 2 and 10, found {turbidity}")));
        }
        let ground = fields.colour("ground", f64::INFINITY)?.unwrap_or(DVec3::splat(0.1));
        (Arc::new(sky::sky(to_sun, turbidity, ground)), None)
    } else {
        let mut images = Images::new(files);
        images.add(scope.source, written, span, Use::Colour)?;
        let (texture, digest) = &images.decode(scope.source)?[0];
        (floats(texture).map_err(|what| scope.source.error(span, what))?, Some(*digest))
    };
    Ok((Environment { texture, scale, to_world }, digest))
}

/// The same picture with floats for texels.
fn floats(texture: &Arc<Texture>) -> std::result::Result<Arc<Texture>, String> {
    if matches!(texture.texels, Texels::Float(_)) {
        return Ok(texture.clone());
    }
    let (width, height) = (texture.width, texture.height);
    if u64::from(width) * u64::from(height) > MAX_TEXELS {
        return Err(format!("{width} x {height} texels are too many for an environment: at most {MAX_TEXELS}"));
    }
    let nearest = TextureRef { nearest: true, ..TextureRef::new(0) };
    let at = |i: u32, size: u32| (f64::from(i) + 0.5) / f64::from(size);
    let rows = (0..height).flat_map(|y| (0..width).map(move |x| [at(x, width), at(y, height)]));
    let texels = Texels::Float(rows.map(|uv| texture.sample(&nearest, uv)).collect());
    Ok(Arc::new(Texture { name: texture.name.clone(), width, height, texels }))
}
