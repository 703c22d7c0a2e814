//! `material` statements: fields, one model of scattering, textures.

use glam::{DAffine2, DMat2, DVec2, DVec3};

use super::expression::sin_degrees;
use super::fields::{Fields, NO_REST};
use super::images::{Images, Use};
use super::metals;
use super::scope::Scope;
use super::source::{Span, quote};
use super::syntax::{Node, Value};
use crate::error::Result;
use crate::scene::description::{Material, MaterialId};
use crate::scene::material::{Alpha, Scattering, TextureRef, Wrap};

/// Fields of a material.
const FIELDS: [&str; 6] = ["diffuse", "mirror", "emission", "one-sided", "opacity", "mask"];
/// Statements that say how it scatters, of which it has one at most.
const MODELS: [&str; 6] = ["conductor", "dielectric", "thin-glass", "plastic", "metal-rough", "mix"];
/// What a texture may be of.
const PURPOSES: [&str; 6] = ["base", "emission", "opacity", "normal", "metal-rough", "transmission"];
/// Index of refraction where none is given.
const IOR: f64 = 1.5;
/// Deepest nesting of mixes in mixes.
const MAX_MIXES: usize = 8;

/// A mix, whose materials may be defined later.
pub struct Mix<'n> {
    /// The material that is the mix.
    pub material: MaterialId,
    /// The names it mixes, where they stand.
    names: [(&'n str, Span); 2],
    amount: f64,
}

/// `material "red" { diffuse ..; plastic roughness=0.2; texture "a.png" }`, number `id` of the scene, and what it
/// mixes.
///
/// # Errors
/// Fields that do not fit, reflectances above 1, several models, files that cannot be used.
pub fn material<'n, 'a>(
    scope: &Scope<'a>,
    node: &'n Node<'a>,
    id: MaterialId,
    images: &mut Images<'_>,
) -> Result<(Material, Option<Mix<'n>>)> {
    let fields = Fields::collect(scope, node, &FIELDS, &MODELS)?;
    let (name, _) = fields.title()?.ok_or_else(|| fields.error("a material needs a name"))?;
    let mut material = Material { name: name.into(), ..Material::default() };
    material.textures.normal_scale = 1.0;
    let (mut model, mut mix): (Option<&str>, _) = (None, None);
    for &child in &fields.rest {
        match child.name.as_ref() {
            "texture" => texture(scope, child, &mut material, images)?,
            kind if MODELS.contains(&kind) => {
                if let Some(first) = model.replace(kind) {
                    let what = format!("a material has one of {}; this one has `{first}`", MODELS.join(", "));
                    return Err(scope.source.error(child.span, what));
                }
                match kind {
                    "mix" => mix = Some(mixed(scope, child, id)?),
                    _ => (material.scattering, material.multiple_scattering) = scattering(scope, child, kind)?,
                }
            }
            _ => {
                let known: Vec<&str> = FIELDS.iter().chain(&MODELS).chain(&["texture"]).copied().collect();
                return Err(fields.unknown_child(child, &known));
            }
        }
    }
    // A texture multiplies its number: alone, it should be seen as it is.
    let unless = |textured: Option<TextureRef>, plain: DVec3| if textured.is_some() { DVec3::ONE } else { plain };
    let (base, glow) = (material.textures.base, material.textures.emission);
    let plain = unless(base, material.diffuse);
    (material.diffuse, material.mirror) = reflectances(&fields, plain, model.is_none())?;
    material.emission = fields.colour("emission", f64::INFINITY)?.unwrap_or(unless(glow, material.emission));
    material.one_sided = fields.flag("one-sided")?;
    material.opacity = fields.share("opacity", 1.0)?;
    material.alpha = match fields.has("mask") {
        true => Alpha::Mask { cutoff: fields.share("mask", 0.5)? },
        false if material.opacity < 1.0 || material.textures.opacity.is_some() => Alpha::Blend,
        false => Alpha::Opaque,
    };
    Ok((material, mix))
}

/// `diffuse`, which is `plain` if it is not given, and `mirror`. What `is_matte` reflects both ways; of light that is mirrored the
/// base gets nothing.
fn reflectances(fields: &Fields<'_, '_, '_>, plain: DVec3, is_matte: bool) -> Result<(DVec3, DVec3)> {
    let mirror = fields.colour("mirror", 1.0)?.unwrap_or(DVec3::ZERO);
    let diffuse = fields.colour("diffuse", 1.0)?;
    let left = if is_matte { plain.min(DVec3::ONE - mirror) } else { plain };
    Ok((diffuse.unwrap_or(left), mirror))
}

/// What is to be said of a material that reflects more than it gets; numbers like 0.7 and 0.3 need not add up to 1 exactly.
pub fn warning(material: &Material) -> Option<String> {
    let most = (material.diffuse + material.mirror).max_element();
    let is_bright = material.scattering == Scattering::Matte && most > 1.0 + 1e-9;
    is_bright.then(|| {
        let name = &material.name;
        format!("material \"{name}\": `diffuse` and `mirror` add up to {most}: it reflects more light than it gets")
    })
}

/// How `node` of `kind` scatters, and whether facets throw light at each other.
fn scattering(scope: &Scope<'_>, node: &Node<'_>, kind: &str) -> Result<(Scattering, bool)> {
    let allowed: &[&str] = match kind {
        "conductor" => &["eta", "k", "roughness", "single-scattering"],
        "dielectric" => &["ior", "roughness", "tint", "single-scattering"],
        "thin-glass" => &["ior", "tint"],
        "plastic" => &["ior", "roughness"],
        _ => &["metallic", "roughness", "ior", "transmission"],
    };
    let fields = Fields::collect(scope, node, allowed, NO_REST)?;
    let is_multiple = !fields.flag("single-scattering")?;
    if kind == "conductor" {
        let (eta, k) = conductor(scope, &fields)?;
        return Ok((Scattering::Conductor { eta, k, roughness: fields.share("roughness", 0.0)? }, is_multiple));
    }
    fields.no_arguments()?;
    let ior = fields.positive("ior", IOR)?;
    let tint = || Ok::<_, crate::error::Error>(fields.colour("tint", 1.0)?.unwrap_or(DVec3::ONE));
    let model = match kind {
        "dielectric" => Scattering::Dielectric { ior, roughness: fields.share("roughness", 0.0)?, tint: tint()? },
        "thin-glass" => Scattering::ThinGlass { ior, tint: tint()? },
        "plastic" => Scattering::Plastic { ior, roughness: fields.share("roughness", 0.0)? },
        _ => Scattering::MetallicRoughness {
            metallic: fields.share("metallic", 0.0)?,
            roughness: fields.share("roughness", 0.5)?,
            ior,
            transmission: fields.share("transmission", 0.0)?,
        },
    };
    Ok((model, is_multiple))
}

/// `conductor gold`, or `conductor { eta 0.2 0.9 1.1; k 3.9 2.4 2.1 }`.
fn conductor(scope: &Scope<'_>, fields: &Fields<'_, '_, '_>) -> Result<(DVec3, DVec3)> {
    let numbers = (fields.colour("eta", f64::INFINITY)?, fields.colour("k", f64::INFINITY)?);
    match (fields.title()?, numbers) {
        (Some((name, span)), (None, None)) => metals::index_of(name).ok_or_else(|| {
            let all: Vec<_> = metals::names().collect();
            let what = format!("unknown metal {}: expected one of {}", quote(name), all.join(", "));
            scope.source.error_near(span, what, name, metals::names())
        }),
        (None, (Some(eta), Some(k))) if eta.min_element() > 0.0 => Ok((eta, k)),
        (None, (Some(_), Some(_))) => Err(fields.error_at("eta", "`eta` must be above zero")),
        _ => Err(fields.error("expected a metal (`conductor gold`), or both `eta` and `k`")),
    }
}

/// `mix "a" "b" 0.3`: of b with a chance of 0.3, else of a.
fn mixed<'n, 'a>(scope: &Scope<'a>, node: &'n Node<'a>, material: MaterialId) -> Result<Mix<'n>> {
    let fields = Fields::collect(scope, node, &[], NO_REST)?;
    let [first, second, amount] = node.entries.as_slice() else {
        return Err(fields.error("expected `mix \"a\" \"b\" 0.3`: two materials, and how much of the second"));
    };
    let name = |entry: &'n super::syntax::Entry<'_>| match &entry.value {
        Value::Text(text) => Ok((text.as_ref(), entry.span)),
        _ => Err(scope.source.error(entry.span, "expected the name of a material")),
    };
    let mut numbers = Vec::new();
    scope.numbers(amount, &mut numbers)?;
    match numbers.as_slice() {
        &[amount] if (0.0..=1.0).contains(&amount) => {
            Ok(Mix { material, names: [name(first)?, name(second)?], amount })
        }
        _ => Err(scope.source.error(amount.span, "expected a number from 0 to 1")),
    }
}

/// Gives the materials that are mixes what they mix; `find` knows all by name.
///
/// # Errors
/// Names that no material has, mixes that contain themselves or nest deeper than [`MAX_MIXES`].
pub fn resolve<'k>(
    scope: &Scope<'_>,
    mixes: &[Mix<'_>],
    materials: &mut [Material],
    find: impl Fn(&str) -> Option<MaterialId>,
    known: impl Iterator<Item = &'k str> + Clone,
) -> Result<()> {
    for mix in mixes {
        let id = |(name, span): (&str, Span)| {
            let what = format!("no material is called {}", quote(name));
            find(name).ok_or_else(|| scope.source.error_near(span, what, name, known.clone()))
        };
        let [first, second] = mix.names;
        let (first, second) = (id(first)?, id(second)?);
        materials[mix.material as usize].scattering = Scattering::Mix { first, second, amount: mix.amount };
    }
    // The depth of each grows by rounds; one that is in itself never stops.
    let mut depth = vec![0; materials.len()];
    for _ in 0..=MAX_MIXES {
        let mut is_settled = true;
        for mix in mixes {
            let Scattering::Mix { first, second, .. } = materials[mix.material as usize].scattering else { continue };
            let deeper = 1 + depth[first as usize].max(depth[second as usize]);
            if deeper > MAX_MIXES {
                let what = format!("mixes contain themselves, or nest deeper than {MAX_MIXES} levels");
                return Err(scope.source.error(mix.names[0].1, what));
            }
            if deeper > depth[mix.material as usize] {
                depth[mix.material as usize] = deeper;
                is_settled = false;
            }
        }
        if is_settled {
            break;
        }
    }
    Ok(())
}

/// `texture "a.png" { of base; scale 2; offset 0.5 0; rotate 30; wrap clamp; nearest }`.
fn texture(scope: &Scope<'_>, node: &Node<'_>, material: &mut Material, images: &mut Images<'_>) -> Result<()> {
    const ALLOWED: [&str; 7] = ["of", "scale", "offset", "rotate", "wrap", "nearest", "strength"];
    let fields = Fields::collect(scope, node, &ALLOWED, NO_REST)?;
    let (written, span) = fields.title()?.ok_or_else(|| fields.error("expected `texture \"file.png\"`"))?;
    let (purpose, purpose_span) = fields.name("of")?.unwrap_or(("base", span));
    let usage = match purpose {
        "base" | "emission" => Use::Colour,
        "opacity" => Use::Opacity,
        _ => Use::Numbers,
    };
    let strength = fields.number("strength")?;
    if strength.is_some() && purpose != "normal" {
        return Err(fields.error_at("strength", "`strength` is of normals: it goes with `of normal`"));
    }
    let looks = &mut material.textures;
    let slot = match purpose {
        "base" => &mut looks.base,
        "emission" => &mut looks.emission,
        "opacity" => &mut looks.opacity,
        "normal" => &mut looks.normal,
        "metal-rough" => &mut looks.metallic_roughness,
        "transmission" => &mut looks.transmission,
        _ => {
            let what = format!("unknown use {} of a texture: expected one of {}", quote(purpose), PURPOSES.join(", "));
            return Err(scope.source.error_near(purpose_span, what, purpose, PURPOSES));
        }
    };
    if slot.is_some() {
        return Err(fields.error(format!("a texture of {purpose} is given twice")));
    }
    let wrap = match fields.name("wrap")? {
        None | Some(("repeat", _)) => Wrap::Repeat,
        Some(("mirror", _)) => Wrap::Mirror,
        Some(("clamp", _)) => Wrap::Clamp,
        Some((_, span)) => return Err(scope.source.error(span, "expected repeat, mirror or clamp")),
    };
    let nearest = fields.flag("nearest")?;
    let transform = transform(&fields)?;
    let id = images.add(scope.source, written, span, usage)?;
    *slot = Some(TextureRef { transform, wrap: [wrap; 2], nearest, ..TextureRef::new(id) });
    if let Some(strength) = strength {
        looks.normal_scale = strength;
    }
    Ok(())
}

/// Scale, then rotation, then offset of coordinates whose v points up, as scene files have them, for coordinates whose
/// v points down, as meshes and pictures have them.
fn transform(fields: &Fields<'_, '_, '_>) -> Result<DAffine2> {
    let pair = |name: &str, absent: f64| match fields.numbers(name)?.as_deref() {
        None => Ok(DVec2::splat(absent)),
        Some(&[both]) if name == "scale" => Ok(DVec2::splat(both)),
        Some(&[u, v]) => Ok(DVec2::new(u, v)),
        Some(v) => Err(fields.error_at(name, format!("`{name}` takes two numbers, found {}", v.len()))),
    };
    let degrees = fields.number("rotate")?.unwrap_or(0.0);
    let (sin, cos) = (sin_degrees(degrees), sin_degrees(degrees + 90.0));
    let rotation = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
    let scaled = rotation * DMat2::from_diagonal(pair("scale", 1.0)?);
    let upwards = DAffine2::from_mat2_translation(scaled, pair("offset", 0.0)?);
    let turn = DAffine2::from_mat2_translation(DMat2::from_diagonal(DVec2::new(1.0, -1.0)), DVec2::Y);
    Ok(turn * upwards * turn)
}
