//! Which of a scene's things are solids to convert.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::scene::description::{Description, ItemKind, Shape};
use crate::scene::world::{Preset, World};

/// The solids of a scene, compiled.
#[derive(Debug)]
pub struct Solids {
    /// Their world.
    pub world: World<f64>,
    /// Lower corner of the box they are in.
    pub lo: DVec3,
    /// Upper corner.
    pub hi: DVec3,
    /// Surfaces without an inside that were left out: meshes and discs.
    pub left_out: usize,
}

impl Solids {
    /// Those of `description`; with `names`, only trees of solids and groups that are called so.
    ///
    /// # Errors
    /// No solids, names that nothing has, solids without bounds, and what [`World::compile`] refuses.
    pub fn new(description: &Description, names: &[String]) -> Result<Self> {
        let mut kept = description.clone();
        let mut left_out = 0;
        let mut met = vec![false; names.len()];
        let mut wanted = |name: &str| {
            // A name may be given twice.
            let same: Vec<usize> = (0..names.len()).filter(|&i| names[i] == name).collect();
            same.iter().for_each(|&i| met[i] = true);
            names.is_empty() || !same.is_empty()
        };
        let whole = with_children(description, description.groups.iter().map(|g| wanted(&g.name)).collect());
        for (group, whole) in kept.groups.iter_mut().zip(whole) {
            group.items.retain(|item| match &item.kind {
                ItemKind::Instance(_) => true,
                ItemKind::Solids(tree) => wanted(&description.solids[*tree as usize].name) || whole,
                ItemKind::Shape(Shape::Disc) | ItemKind::Mesh(_) => {
                    left_out += usize::from(whole);
                    false
                }
                ItemKind::Shape(_) => whole,
            });
        }
        if let Some(missing) = names.iter().zip(&met).find(|(_, met)| !**met) {
            return Err(Error::Usage(format!("no solid is called `{}`; {}", missing.0, known(description))));
        }
        let world = World::<f64>::compile(&kept, Preset::Balanced)?;
        if let Some(i) = world.instances.iter().position(|i| !i.bounds.is_bounded() && !i.bounds.is_empty()) {
            let name = &world.traced.objects[world.instances[i].object as usize].name;
            let place = if name.is_empty() { String::new() } else { format!(" in `{name}`") };
            return Err(Error::Usage(format!(
                "a plane, a half-space or a complement{place} has no bounds, so no closed surface; choose others with \
                 --solid NAME: {}",
                known(description)
            )));
        }
        let Some((lo, hi)) = world.bounds() else {
            let hint = "closed shapes and union, intersection, difference or xor of them are";
            let but = "alone and without --solid, --tolerance, --cells or --voxels they become .stl, .obj or .ply as they are";
            return Err(Error::Usage(format!(
                "nothing in the scene is a solid: {hint}, loose triangles are not ({but})"
            )));
        };
        Ok(Self { world, lo, hi, left_out })
    }
}

/// Groups chosen, and all groups that have instances in them.
fn with_children(description: &Description, mut chosen: Vec<bool>) -> Vec<bool> {
    let mut open: Vec<usize> = (0..chosen.len()).filter(|&g| chosen[g]).collect();
    while let Some(group) = open.pop() {
        for item in &description.groups[group].items {
            if let ItemKind::Instance(child) = item.kind
                && !std::mem::replace(&mut chosen[child as usize], true)
            {
                open.push(child as usize);
            }
        }
    }
    chosen
}

/// The names there are.
fn known(description: &Description) -> String {
    let trees = description.solids.iter().map(|t| t.name.as_str());
    let groups = description.groups.iter().map(|g| g.name.as_str());
    let mut names: Vec<&str> = trees.chain(groups).filter(|n| !n.is_empty()).collect();
    names.sort_unstable();
    names.dedup();
    match names.len() {
        0 => "nothing in the scene has a name".into(),
        1..=20 => format!("the names are {}", names.join(", ")),
        n => format!("the first of {n} names are {}", names[..20].join(", ")),
    }
}
