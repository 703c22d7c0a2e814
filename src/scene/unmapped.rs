//! Materials with textures on meshes that have no texture coordinates: one texel colours all of them.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::description::{Description, ItemKind};
use super::text;

/// Most materials that warnings name.
const NAMED: usize = 8;

/// Adds a warning for each material of `description` of which this is true, as a picture that is not seen looks like one
/// that was not found.
pub(super) fn warn(description: &mut Description) {
    let (materials, meshes) = (&description.materials, &description.meshes);
    // The first of a name counts; triangles without a material's name have the default one.
    let mut named: HashMap<&str, usize> = HashMap::from([("", 0)]);
    for (i, material) in materials.iter().enumerate() {
        named.entry(&material.name).or_insert(i);
    }
    let (mut seen, mut found) = (HashSet::new(), BTreeSet::new());
    for item in description.groups.iter().flat_map(|group| &group.items) {
        let ItemKind::Mesh(index) = item.kind else { continue };
        let mesh = &meshes[index as usize];
        let lacks = |set: u8| mesh.uvs.get(usize::from(set)).is_none_or(|uvs| uvs.values.is_empty());
        // A mesh of many runs may be placed very often.
        if !(lacks(0) || lacks(1)) || !seen.insert((index, item.material)) {
            continue;
        }
        let of_runs = mesh.groups.iter().map(|run| named.get(run.material.as_str()).copied().unwrap_or(0));
        let of_item = item.material.map(|id| id as usize).or(mesh.groups.is_empty().then_some(0));
        let used = of_item.into_iter().chain(of_runs.filter(|_| item.material.is_none()));
        found.extend(used.filter(|&i| materials.get(i).is_some_and(|m| m.textures.uses().any(|u| lacks(u.uv_set)))));
    }
    let name = |&i: &usize| text::shown(materials[i].name.as_bytes());
    let what = "stands on a mesh without the texture coordinates that its textures need: one texel colours all of it";
    let mut warnings: Vec<_> = found.iter().take(NAMED).map(|i| format!("the material {} {what}", name(i))).collect();
    if found.len() > NAMED {
        warnings.push(format!("{} other materials stand on such meshes too", found.len() - NAMED));
    }
    description.warnings.extend(warnings);
}
