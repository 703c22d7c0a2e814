//! Lowering: the description's nested groups become numbered objects (geometry in one space) and a flat list of
//! placements. This is where primitive and instance numbers are defined, once, for engines and oracle alike.
//!
//! * Only groups that are placed become objects: what is nowhere is to cost nothing, and to say nothing of what the world is made of.
//! * Placement 0 is the root group's own geometry under the identity, if it has any; the others follow in the
//!   order of a depth-first walk over the root's items.
//! * Inside an object, primitive numbers count through its parts in the order they were written; every triangle
//!   of a mesh takes a number, also one that will turn out degenerate. A tree of solids takes one for every leaf: a
//!   hit's number says whose surface is seen, the part it belongs to says which tree.

use std::mem::replace;
use std::sync::Arc;

use glam::DAffine3;

use super::description::{Description, Group, GroupId, ItemKind, MaterialId, Shape};
use super::mesh::Mesh;
use super::solids::flat::{FlatTree, flatten};
use crate::error::{Error, Result};

/// Largest number of placements a description may expand to.
pub const MAX_PLACEMENTS: u64 = 1 << 24;
/// Deepest nesting of groups.
pub const MAX_NESTING: usize = 64;

/// Numbered objects and placements, f64.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// Distinct geometries that are placed, in the order of their groups.
    pub objects: Vec<AssemblyObject>,
    /// Instances of them; the index is the `inst` number of a hit.
    pub placements: Vec<Placement>,
}

/// The geometry of one group, without its instances.
#[derive(Clone, Debug, Default)]
pub struct AssemblyObject {
    /// The group's name.
    pub name: String,
    /// Parts in order of their primitive numbers.
    pub parts: Vec<Part>,
    /// Total number of primitive numbers.
    pub prim_count: u32,
}

/// Consecutive primitives of one kind.
#[derive(Clone, Debug)]
pub struct Part {
    /// First primitive number.
    pub first_prim: u32,
    /// How many.
    pub prim_count: u32,
    /// Part space to object space.
    pub to_object: DAffine3,
    /// Material of the part, before mesh groups are looked at.
    pub material: Option<MaterialId>,
    /// What it is.
    pub kind: PartKind,
}

/// Geometry of a [`Part`].
#[derive(Clone, Debug)]
pub enum PartKind {
    /// Triangles of a mesh.
    Mesh(Arc<Mesh>),
    /// One analytic shape.
    Shape(Shape),
    /// A tree of solids; its leaves are the primitives.
    Solids(Arc<FlatTree>),
}

/// An object placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Index into [`Assembly::objects`].
    pub object: u32,
    /// Object space to world space; invertible and finite.
    pub to_world: DAffine3,
}

impl Placement {
    /// Whether the object's space is the world's.
    pub fn stands(&self) -> bool {
        self.to_world == DAffine3::IDENTITY
    }
}

impl Assembly {
    /// Lowers `description`: what its root group holds and places, however deep. Groups that nothing places are left out.
    ///
    /// # Errors
    /// An item whose group, mesh, solids or material the description does not have, a mesh that [`Mesh::check`] refuses, a
    /// group that contains itself, nesting deeper than [`MAX_NESTING`], more than [`MAX_PLACEMENTS`] placements, more than
    /// 2^32 - 2 primitives in one object, an instance transform that cannot be inverted, or a tree of solids that
    /// [`FlatTree::new`] refuses.
    pub fn new(description: &Description) -> Result<Self> {
        let file = description.source.clone().unwrap_or_else(|| format!("builtin:{}", description.name).into());
        let fail = |what: String| Error::whole(&file, what);
        let is_placed = placed_groups(description).map_err(fail)?;
        let mut objects = Vec::new();
        let mut trees: Vec<Option<Arc<FlatTree>>> = vec![None; description.solids.len()];
        let mut object_of_group = vec![None; description.groups.len()];
        for (g, group) in description.groups.iter().enumerate().filter(|(g, _)| is_placed[*g]) {
            let object = AssemblyObject::of(group, description, &mut trees).map_err(fail)?;
            if object.prim_count > 0 {
                object_of_group[g] = Some(objects.len() as u32);
                objects.push(object);
            }
        }
        let known = vec![None; description.groups.len()];
        let mut counting = Counting { description, object_of_group: &object_of_group, known, path: Vec::new() };
        let extent = counting.group(0).map_err(fail)?;
        let placements = Vec::with_capacity(extent.placements as usize);
        let mut walk = Walk { description, object_of_group: &object_of_group, placements };
        walk.group(0, DAffine3::IDENTITY).map_err(fail)?;
        Ok(Self { placements: walk.placements, objects })
    }

    /// Number of primitives over all placements, also of those that a world drops.
    pub fn instanced_prims(&self) -> u64 {
        self.placements.iter().map(|p| u64::from(self.objects[p.object as usize].prim_count)).sum()
    }

    /// The part that holds primitive `prim` of `object`.
    pub fn part_of(&self, object: u32, prim: u32) -> &Part {
        let parts = &self.objects[object as usize].parts;
        let after = parts.partition_point(|p| p.first_prim <= prim);
        &parts[after - 1]
    }
}

/// By group: whether the root group holds it, itself or through others.
fn placed_groups(description: &Description) -> std::result::Result<Vec<bool>, String> {
    let Description { groups, meshes, solids, materials, .. } = description;
    if groups.is_empty() {
        return Err("a description needs a root group".into());
    }
    let (mut is_placed, mut is_checked) = (vec![false; groups.len()], vec![false; meshes.len()]);
    is_placed[0] = true;
    let mut waiting = vec![0];
    while let Some(g) = waiting.pop() {
        let group: &Group = &groups[g];
        for item in &group.items {
            let (what, number, count) = match item.kind {
                ItemKind::Shape(_) => ("shape", 0, 1),
                ItemKind::Mesh(m) => ("mesh", m, meshes.len()),
                ItemKind::Solids(t) => ("tree of solids", t, solids.len()),
                ItemKind::Instance(child) => ("group", child, groups.len()),
            };
            let material = item.material.map(|m| ("material", m, materials.len()));
            for (what, number, count) in [Some((what, number, count)), material].into_iter().flatten() {
                if number as usize >= count {
                    return Err(format!(
                        "group `{}` has an item of {what} {number}, but there are {count}",
                        group.name
                    ));
                }
            }
            match item.kind {
                ItemKind::Instance(child) if !replace(&mut is_placed[child as usize], true) => {
                    waiting.push(child as usize);
                }
                ItemKind::Mesh(m) if !replace(&mut is_checked[m as usize], true) => {
                    meshes[m as usize].check().map_err(|what| format!("mesh {m}: {what}"))?;
                }
                _ => {}
            }
        }
    }
    Ok(is_placed)
}

impl AssemblyObject {
    /// The geometry of `group`. `trees`: those of the description's solids that are known.
    fn of(
        group: &Group,
        description: &Description,
        trees: &mut [Option<Arc<FlatTree>>],
    ) -> std::result::Result<Self, String> {
        let mut object = Self { name: group.name.clone(), ..Self::default() };
        for item in &group.items {
            let (kind, count) = match &item.kind {
                ItemKind::Instance(_) => continue,
                ItemKind::Shape(shape) => (PartKind::Shape(*shape), 1),
                ItemKind::Mesh(m) => {
                    let mesh = description.meshes[*m as usize].clone();
                    let count = mesh.triangles.len() as u64;
                    (PartKind::Mesh(mesh), count)
                }
                ItemKind::Solids(t) => {
                    let known = &mut trees[*t as usize];
                    let tree = match known {
                        Some(tree) => tree.clone(),
                        None => {
                            let source = &description.solids[*t as usize];
                            let tree = flatten(source).map_err(|e| format!("solid `{}`: {e}", source.name))?;
                            known.insert(tree).clone()
                        }
                    };
                    let count = tree.leaf_count() as u64;
                    (PartKind::Solids(tree), count)
                }
            };
            let total = u64::from(object.prim_count) + count;
            if total >= u64::from(u32::MAX) {
                return Err(format!("group `{}` has more than 2^32 - 2 primitives", group.name));
            }
            object.parts.push(Part {
                first_prim: object.prim_count,
                prim_count: count as u32,
                to_object: item.transform,
                material: item.material,
                kind,
            });
            object.prim_count = total as u32;
        }
        Ok(object)
    }
}

/// What a group expands to, itself included.
#[derive(Clone, Copy)]
struct Extent {
    /// Placements of groups that have geometry.
    placements: u64,
    /// Placements of all groups.
    visits: u64,
    /// Levels of groups.
    levels: usize,
}

/// Counts what groups expand to, each group once however often it is placed: what is too much is refused before any of it is made.
struct Counting<'a> {
    description: &'a Description,
    object_of_group: &'a [Option<u32>],
    known: Vec<Option<Extent>>,
    path: Vec<GroupId>,
}

impl Counting<'_> {
    fn group(&mut self, id: GroupId) -> std::result::Result<Extent, String> {
        if let Some(known) = self.known[id as usize] {
            return Ok(known);
        }
        let group = &self.description.groups[id as usize];
        if self.path.contains(&id) {
            return Err(format!("group `{}` contains an instance of itself", group.name));
        }
        let too_deep = || format!("groups nest deeper than {MAX_NESTING} levels at `{}`", group.name);
        if self.path.len() >= MAX_NESTING {
            return Err(too_deep());
        }
        self.path.push(id);
        let placements = u64::from(self.object_of_group[id as usize].is_some());
        let mut extent = Extent { placements, visits: 1, levels: 1 };
        for item in &group.items {
            let ItemKind::Instance(child) = item.kind else { continue };
            let inner = self.group(child)?;
            extent.placements = extent.placements.saturating_add(inner.placements);
            extent.visits = extent.visits.saturating_add(inner.visits);
            extent.levels = extent.levels.max(1 + inner.levels);
        }
        self.path.pop();
        if extent.levels > MAX_NESTING {
            return Err(too_deep());
        }
        if extent.placements > MAX_PLACEMENTS {
            return Err(format!("more than {MAX_PLACEMENTS} instances"));
        }
        // Groups without geometry place nothing, but doubling them is as endless as doubling instances.
        if extent.visits > 2 * MAX_PLACEMENTS {
            return Err(format!("groups expand to more than {} instances", 2 * MAX_PLACEMENTS));
        }
        self.known[id as usize] = Some(extent);
        Ok(extent)
    }
}

/// Places what was counted.
struct Walk<'a> {
    description: &'a Description,
    object_of_group: &'a [Option<u32>],
    placements: Vec<Placement>,
}

impl Walk<'_> {
    fn group(&mut self, id: GroupId, to_world: DAffine3) -> std::result::Result<(), String> {
        let group = &self.description.groups[id as usize];
        if let Some(object) = self.object_of_group[id as usize] {
            let determinant = to_world.matrix3.determinant();
            let finite = to_world.is_finite() && to_world.inverse().is_finite();
            if determinant == 0.0 || !finite {
                return Err(format!("an instance of `{}` has a transform that cannot be inverted", group.name));
            }
            self.placements.push(Placement { object, to_world });
        }
        for item in &group.items {
            if let ItemKind::Instance(child) = item.kind {
                self.group(child, to_world * item.transform)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::Item;

    /// Groups in a row, each of which holds `copies` instances of the next; the last holds a sphere, if `has_sphere`.
    fn chain(groups: u32, copies: usize, has_sphere: bool) -> Description {
        let mut d = Description::new("chain");
        let item = |kind| Item { transform: DAffine3::IDENTITY, material: None, kind };
        let holding = |next| vec![item(ItemKind::Instance(next)); copies];
        d.groups = (1..groups).map(|next| Group { name: format!("g{next}"), items: holding(next) }).collect();
        let last = has_sphere.then(|| item(ItemKind::Shape(Shape::Sphere)));
        d.groups.push(Group { name: "last".into(), items: last.into_iter().collect() });
        d
    }

    #[test]
    fn what_expands_too_far_is_refused_before_it_is_made() {
        let made = |d: &Description| Assembly::new(d).map(|a| a.placements.len()).map_err(|e| e.to_string());
        assert_eq!(made(&chain(4, 3, true)), Ok(27));
        assert_eq!(made(&chain(4, 3, false)), Ok(0));
        assert_eq!(made(&chain(MAX_NESTING as u32, 1, true)), Ok(1));
        // Made one by one, these would take gigabytes, or longer than anybody waits.
        let start = std::time::Instant::now();
        for (d, what) in [
            (chain(20, 20, true), "more than 16777216 instances"),
            (chain(26, 2, true), "more than 16777216 instances"),
            (chain(64, 100, false), "expand to more than 33554432 instances"),
            (chain(MAX_NESTING as u32 + 1, 1, true), "nest deeper than 64 levels"),
        ] {
            let text = made(&d).unwrap_err();
            assert!(text.contains(what), "{text}");
        }
        assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
        let mut circle = chain(3, 2, true);
        let back = circle.groups[0].items[0].clone();
        circle.groups[2].items.push(back);
        assert!(made(&circle).unwrap_err().contains("contains an instance of itself"));
    }

    #[test]
    fn only_what_is_placed_becomes_an_object() {
        let item = |kind| Item { transform: DAffine3::IDENTITY, material: None, kind };
        let group = |name: &str, kinds: &[ItemKind]| Group {
            name: name.into(),
            items: kinds.iter().cloned().map(item).collect(),
        };
        let mut d = Description::new("some");
        let sphere = ItemKind::Shape(Shape::Sphere);
        d.groups.extend([
            group("nowhere", &[sphere.clone(), ItemKind::Instance(2)]),
            group("inner", &[sphere.clone(), sphere.clone()]),
            group("lost", &[sphere.clone(), ItemKind::Instance(1)]),
            group("outer", &[sphere, ItemKind::Instance(2), ItemKind::Instance(2)]),
        ]);
        assert_eq!(Assembly::new(&d).unwrap().objects.len(), 0);
        d.groups[0].items.push(item(ItemKind::Instance(4)));
        let made = Assembly::new(&d).unwrap();
        let objects: Vec<_> = made.objects.iter().map(|o| (o.name.as_str(), o.prim_count)).collect();
        assert_eq!(objects, [("inner", 2), ("outer", 1)]);
        assert_eq!(made.placements.iter().map(|p| p.object).collect::<Vec<_>>(), [1, 0, 0]);
    }

    #[test]
    fn items_of_what_is_not_there_are_refused() {
        let refusal = |kind, material| {
            let mut d = Description::new("some");
            d.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material, kind });
            Assembly::new(&d).unwrap_err().to_string()
        };
        for (kind, material, what) in [
            (ItemKind::Mesh(0), None, "mesh 0, but there are 0"),
            (ItemKind::Solids(2), None, "tree of solids 2, but there are 0"),
            (ItemKind::Instance(1), None, "group 1, but there are 1"),
            (ItemKind::Shape(Shape::Disc), Some(1), "material 1, but there are 1"),
        ] {
            let text = refusal(kind, material);
            assert!(text.contains(what), "{text}");
        }
        let mut broken = Description::new("broken");
        broken.meshes.push(Arc::new(Mesh { triangles: vec![[0; 3]], ..Mesh::default() }));
        broken.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) });
        let text = Assembly::new(&broken).unwrap_err().to_string();
        assert!(text.contains("mesh 0: triangles name positions up to 0, but there are 0"), "{text}");
        let none = Description { groups: Vec::new(), ..Description::new("none") };
        assert!(Assembly::new(&none).is_err());
    }
}
