//! What a call inherits from those around it: whether it counts, its colour, and whether it is cut away.

use std::collections::HashMap;

use glam::DVec3;

use super::fields::Fields;
use super::syntax::{Node, Source};
use crate::error::Result;
use crate::scene::description::{Description, Material, MaterialId};
use crate::scene::material::Alpha;

/// OpenSCAD's colour of what has none, sRGB.
const DEFAULT: [f64; 3] = [249.0 / 255.0, 215.0 / 255.0, 44.0 / 255.0];
/// Its colour of faces that were cut by what has none, sRGB.
const CUT: [f64; 3] = [157.0 / 255.0, 203.0 / 255.0, 81.0 / 255.0];

/// What each call inherits.
pub(super) struct Looks {
    /// The call that is shown, with those in its braces.
    pub root: u32,
    /// The call around each.
    pub parents: Vec<u32>,
    /// Whether a call counts; those in its braces may not.
    pub is_there: Vec<bool>,
    /// Colour around each, sRGB and alpha, and whether it is cut away.
    around: Vec<(Option<[f64; 4]>, bool)>,
}

/// Materials by their colours.
#[derive(Default)]
pub(super) struct Palette {
    /// In the order they were asked for; those of a scene begin with its default one.
    pub materials: Vec<Material>,
    known: HashMap<[u64; 4], MaterialId>,
}

impl Palette {
    /// The material of what the call `i` makes; none for the default.
    pub fn material(&mut self, looks: &Looks, i: usize) -> Option<MaterialId> {
        match looks.around[i] {
            (Some(color), _) => Some(self.of_color(color)),
            (None, true) => Some(self.of_color([CUT[0], CUT[1], CUT[2], 1.0])),
            (None, false) => None,
        }
    }

    fn of_color(&mut self, color: [f64; 4]) -> MaterialId {
        let Self { materials, known } = self;
        *known.entry(color.map(f64::to_bits)).or_insert_with(|| {
            let [red, green, blue, opacity] = color;
            let percent = if opacity < 1.0 { format!(" {:.0}%", opacity * 100.0) } else { String::new() };
            let name = [red, green, blue].map(|part| format!("{:.0}", part * 255.0)).join("/");
            let alpha = if opacity < 1.0 { Alpha::Blend } else { Alpha::Opaque };
            let diffuse = linear([red, green, blue]);
            let name = format!("color {name}{percent}");
            materials.push(Material { name, diffuse, opacity, alpha, ..Material::default() });
            materials.len() as MaterialId
        })
    }
}

/// sRGB to linear light (IEC 61966-2-1).
fn linear(color: [f64; 3]) -> DVec3 {
    DVec3::from(color.map(|x| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }))
}

/// Looks through all calls, those around others first, and adds warnings to `description`, whose default material gets
/// OpenSCAD's colour.
///
/// # Errors
/// Colours that are none.
pub(super) fn looks(source: &Source<'_>, nodes: &[Node<'_>], description: &mut Description) -> Result<Looks> {
    description.materials[0].diffuse = linear(DEFAULT);
    let mut parents = vec![0; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        node.children.iter().for_each(|&child| parents[child as usize] = i as u32);
    }
    let root = root(source, nodes, description);
    let (is_there, around) = (vec![false; nodes.len()], vec![(None, false); nodes.len()]);
    let mut looks = Looks { root, parents, is_there, around };
    looks.is_there[root as usize] = true;
    let mut backgrounds = 0;
    for i in root as usize..nodes.len() {
        if !looks.is_there[i] {
            continue;
        }
        let node = &nodes[i];
        let (mut color, is_cut) = looks.around[i];
        // The outermost colour counts.
        if node.name == "color" && color.is_none() {
            color = color_of(source, node)?;
        }
        let mut is_first = true;
        for &child in &node.children {
            let marks = nodes[child as usize].marks;
            backgrounds += usize::from(marks.background && !marks.disabled);
            if marks.disabled || marks.background {
                continue;
            }
            looks.is_there[child as usize] = true;
            looks.around[child as usize] = (color, is_cut != (node.name == "difference" && !is_first));
            is_first = false;
        }
    }
    if backgrounds > 0 {
        let what = format!("objects in the background (`%`) are left out: {backgrounds}");
        description.warnings.push(what);
    }
    Ok(looks)
}

/// The call marked with `!`, else the file.
fn root(source: &Source<'_>, nodes: &[Node<'_>], description: &mut Description) -> u32 {
    let mut is_disabled = vec![false; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        is_disabled[i] |= node.marks.disabled;
        if is_disabled[i] {
            node.children.iter().for_each(|&child| is_disabled[child as usize] = true);
        } else if node.marks.root {
            let line = source.line(node.at);
            let file = source.file.display();
            description.warnings.push(format!("{file}:{line}: nothing is shown but what is marked with `!`"));
            return i as u32;
        }
    }
    0
}

/// The colour that a `color` gives; none if it is not valid.
fn color_of(source: &Source<'_>, node: &Node<'_>) -> Result<Option<[f64; 4]>> {
    let fields = Fields::new(source, node, &["c", "alpha"]);
    let Some(value) = fields.get("c") else { return Ok(None) };
    let count = fields.list_of(value, "c")?.len();
    let mut color = fields.vector_of::<4>(value, "c", 3)?;
    if count == 3 {
        color[3] = 1.0;
    }
    color[3] = fields.number_or("alpha", color[3])?;
    // OpenSCAD writes -1 for what it did not understand.
    let is_valid = color.iter().all(|&part| part >= 0.0);
    Ok(is_valid.then(|| color.map(|part| part.min(1.0))))
}
