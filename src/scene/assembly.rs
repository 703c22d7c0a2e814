//! Lowering: the description's nested groups become numbered objects (geometry in one space) and a flat list of
//! placements. This is where primitive and instance numbers are defined, once, for engines and oracle alike.
//!
//! * Placement 0 is the root group's own geometry under the identity, if it has any; the others follow in the
//!   order of a depth-first walk over the root's items.
//! * Inside an object, primitive numbers count through its parts in the order they were written; every triangle
//!   of a mesh takes a number, also one that will turn out degenerate. A tree of solids takes one for every leaf: a
//!   hit's number says whose surface is seen, the part it belongs to says which tree.

use std::sync::Arc;

use glam::DAffine3;

use super::description::{Description, GroupId, ItemKind, MaterialId, Shape};
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
    /// Distinct geometries.
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
    /// Lowers `description`.
    ///
    /// # Errors
    /// A group that contains itself, nesting deeper than [`MAX_NESTING`], more than [`MAX_PLACEMENTS`] placements,
    /// more than 2^32 - 2 primitives in one object, an instance transform that cannot be inverted,
    /// or a tree of solids that [`FlatTree::new`] refuses.
    pub fn new(description: &Description) -> Result<Self> {
        let file = description.source.clone().unwrap_or_else(|| format!("builtin:{}", description.name).into());
        let fail = |what: String| Error::whole(&file, what);
        let mut objects = Vec::new();
        let mut trees: Vec<Option<Arc<FlatTree>>> = vec![None; description.solids.len()];
        let mut object_of_group = vec![None; description.groups.len()];
        for (g, group) in description.groups.iter().enumerate() {
            let mut object = AssemblyObject { name: group.name.clone(), ..Default::default() };
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
                                let tree =
                                    flatten(source).map_err(|e| fail(format!("solid `{}`: {e}", source.name)))?;
                                known.insert(tree).clone()
                            }
                        };
                        let count = tree.leaf_count() as u64;
                        (PartKind::Solids(tree), count)
                    }
                };
                let total = u64::from(object.prim_count) + count;
                if total >= u64::from(u32::MAX) {
                    return Err(fail(format!("group `{}` has more than 2^32 - 2 primitives", group.name)));
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
            if object.prim_count > 0 {
                object_of_group[g] = Some(objects.len() as u32);
                objects.push(object);
            }
        }
        let mut walk = Walk {
            description,
            object_of_group: &object_of_group,
            placements: Vec::new(),
            path: Vec::new(),
            visits: 0,
        };
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

struct Walk<'a> {
    description: &'a Description,
    object_of_group: &'a [Option<u32>],
    placements: Vec<Placement>,
    path: Vec<GroupId>,
    visits: u64,
}

impl Walk<'_> {
    fn group(&mut self, id: GroupId, to_world: DAffine3) -> std::result::Result<(), String> {
        let group = &self.description.groups[id as usize];
        if self.path.contains(&id) {
            return Err(format!("group `{}` contains an instance of itself", group.name));
        }
        if self.path.len() >= MAX_NESTING {
            return Err(format!("groups nest deeper than {MAX_NESTING} levels at `{}`", group.name));
        }
        // Groups without geometry place nothing, but doubling them is as endless as doubling instances.
        self.visits += 1;
        if self.visits > 2 * MAX_PLACEMENTS {
            return Err(format!("groups expand to more than {} instances", 2 * MAX_PLACEMENTS));
        }
        if let Some(object) = self.object_of_group[id as usize] {
            let determinant = to_world.matrix3.determinant();
            let finite = to_world.is_finite() && to_world.inverse().is_finite();
            if determinant == 0.0 || !finite {
                return Err(format!("an instance of `{}` has a transform that cannot be inverted", group.name));
            }
            if self.placements.len() as u64 >= MAX_PLACEMENTS {
                return Err(format!("more than {MAX_PLACEMENTS} instances"));
            }
            self.placements.push(Placement { object, to_world });
        }
        self.path.push(id);
        for item in &group.items {
            if let ItemKind::Instance(child) = item.kind {
                self.group(child, to_world * item.transform)?;
            }
        }
        self.path.pop();
        Ok(())
    }
}
