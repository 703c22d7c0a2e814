//! Materials of regions from their shader strings.

use glam::DVec3;

use super::parameters::Face;
use super::pattern::Pattern;
use crate::scene::brlcad::describe::{Look, Looks};
use crate::scene::brlcad::shader::Shader;

/// How a Phong surface answers light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Finish {
    /// Narrowness of highlights.
    pub shine: f64,
    pub specular: f64,
    pub diffuse: f64,
    pub transmit: f64,
    pub reflect: f64,
    /// Refractive index.
    pub index: f64,
}

impl Finish {
    /// Whether it mirrors some of the light and lets none pass.
    pub fn is_plain_mirror(&self) -> bool {
        self.transmit <= 0.0 && self.reflect > 0.0 && self.reflect < 1.0
    }
}

const PLASTIC: Finish = Finish { shine: 10.0, specular: 0.7, diffuse: 0.3, transmit: 0.0, reflect: 0.0, index: 1.0 };
const MIRROR: Finish = Finish { shine: 4.0, specular: 0.6, diffuse: 0.4, transmit: 0.0, reflect: 0.75, index: 1.65 };
const GLASS: Finish = Finish { shine: 4.0, specular: 0.7, diffuse: 0.3, transmit: 0.8, reflect: 0.1, index: 1.65 };

/// How a region looks.
#[derive(Clone, Debug)]
pub(super) struct RtMaterial {
    /// Its colour, without a pattern.
    pub base: DVec3,
    /// What its colour is instead.
    pub pattern: Option<Pattern>,
    /// How it is lit; `None` shows its colour as it is.
    pub finish: Option<Finish>,
    /// Whether it is a light.
    pub is_light: bool,
    /// For regions of one arb with a pattern: its faces.
    faces: Vec<Face>,
}

impl RtMaterial {
    pub fn of(look: &Look) -> Self {
        let base = look.color.unwrap_or(DVec3::ONE);
        let mut material = Self { base, pattern: None, finish: Some(PLASTIC), is_light: false, faces: Vec::new() };
        let Some(shader) = &look.shader else { return material };
        let layers = if shader.name == "stack" { shader.layers.as_slice() } else { std::slice::from_ref(shader) };
        material.finish = None;
        for layer in layers {
            match Pattern::of(layer) {
                Some(pattern) => material.pattern = Some(pattern),
                None => material.finish = finish(layer).or(material.finish),
            }
            material.is_light |= layer.name == "light";
        }
        if let (Some(_), Some(corners)) = (&material.pattern, &look.arb) {
            material.faces = Face::of_arb(corners);
        }
        // Unknown shaders are plastic.
        if material.finish.is_none() && material.pattern.is_none() && !material.is_light {
            material.finish = Some(PLASTIC);
        }
        material
    }

    /// Faces of the arb that it is, if it has a pattern.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }
}

/// The finish of a Phong shader.
fn finish(shader: &Shader) -> Option<Finish> {
    let base = match shader.name.as_str() {
        "plastic" | "default" | "phong" | "" => PLASTIC,
        "mirror" => MIRROR,
        "glass" => GLASS,
        _ => return None,
    };
    let number = |names: &[&str], default: f64| shader.number(names).unwrap_or(default);
    Some(Finish {
        shine: number(&["shine", "sh"], base.shine),
        specular: number(&["specular", "sp"], base.specular),
        diffuse: number(&["diffuse", "di"], base.diffuse),
        transmit: number(&["transmit", "tr"], base.transmit),
        reflect: number(&["reflect", "re"], base.reflect),
        index: number(&["ri"], base.index),
    })
}

/// Regions with shaders that this model does not know (they show as plastic): shader and path, each shader once.
pub fn unknown_shaders(looks: &Looks) -> Vec<(String, String)> {
    let mut unknown: Vec<(String, String)> = Vec::new();
    for look in &looks.regions {
        let Some(shader) = &look.shader else { continue };
        let layers = if shader.name == "stack" { shader.layers.as_slice() } else { std::slice::from_ref(shader) };
        for layer in layers {
            let known = layer.name == "light" || finish(layer).is_some() || Pattern::of(layer).is_some();
            if !known && !unknown.iter().any(|(name, _)| *name == layer.name) {
                unknown.push((layer.name.clone(), look.path.clone()));
            }
        }
    }
    unknown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(text: &str) -> RtMaterial {
        RtMaterial::of(&Look { shader: Some(Shader::parse(text)), ..Look::default() })
    }

    #[test]
    fn shaders_become_finishes_and_patterns() {
        assert_eq!(RtMaterial::of(&Look::default()).finish, Some(PLASTIC));
        let mirror = material("mirror sh=50 sp=.7 di=.3 re=.5").finish.unwrap();
        assert_eq!((mirror.shine, mirror.specular, mirror.reflect, mirror.index), (50.0, 0.7, 0.5, 1.65));
        let stack = material("stack checker; plastic sh=20 sp=.1 di=.9");
        assert!(stack.pattern.is_some() && stack.finish.unwrap().shine == 20.0);
        let checker = material("checker a=0/0/150 b=0/0/150");
        assert!(checker.finish.is_none());
        assert_eq!(checker.pattern.unwrap().color([0.1, 0.9]), [0.0, 0.0, 150.0 / 255.0]);
        assert!(material("light").is_light && material("light").finish.is_none());
        assert_eq!(material("camo s=3").finish, Some(PLASTIC));
    }

    #[test]
    fn unknown_shaders_are_named_once() {
        let look = |text: &str| Look { path: format!("/{text}"), shader: Some(Shader::parse(text)), ..Look::default() };
        let regions = vec![look("camo"), look("plastic"), look("camo s=2"), look("stack checker; wood")];
        let names: Vec<_> = unknown_shaders(&Looks { regions, ..Looks::default() }).into_iter().map(|u| u.0).collect();
        assert_eq!(names, ["camo", "wood"]);
    }
}
