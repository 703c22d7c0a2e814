//! Which part and which material a primitive belongs to.

use crate::scene::assembly::{AssemblyObject, PartKind};
use crate::scene::description::Description;
use crate::scene::solids::flat::FlatLeaf;

/// Consecutive primitives of one part with one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// First primitive.
    pub first: u32,
    /// Index into the description's materials.
    pub material: u32,
    /// Index into the object's parts.
    pub part: u32,
}

/// The runs of an object, found in nearly constant time.
#[derive(Clone, Debug)]
pub struct Runs {
    list: Vec<Run>,
    /// Primitives `k << shift` and above, below `(k + 1) << shift`, belong to runs `starts[k]..=starts[k + 1]`.
    starts: Vec<u32>,
    shift: u32,
}

impl Runs {
    /// The runs of `object`, which has at least one primitive.
    pub fn new(object: &AssemblyObject, description: &Description) -> Self {
        let list = list(object, description);
        let mut shift = 0;
        while (object.prim_count >> shift) as usize > 4 * list.len() {
            shift += 1;
        }
        let cells = (object.prim_count >> shift) + 1;
        let at = |prim: u64| list.partition_point(|run| u64::from(run.first) <= prim).saturating_sub(1) as u32;
        let starts = (0..=cells).map(|cell| at(u64::from(cell) << shift)).collect();
        Self { list, starts, shift }
    }

    /// The run of primitive `prim`.
    #[inline]
    pub fn of(&self, prim: u32) -> Run {
        let cell = (prim >> self.shift) as usize;
        let (low, high) = (self.starts[cell] as usize, self.starts[cell + 1] as usize);
        let after = self.list[low + 1..=high].partition_point(|run| run.first <= prim);
        self.list[low + after]
    }

    /// All of them, in order.
    pub fn list(&self) -> &[Run] {
        &self.list
    }
}

fn list(object: &AssemblyObject, description: &Description) -> Vec<Run> {
    let named = |name: &str| description.materials.iter().position(|m| m.name == name).map(|i| i as u32);
    let mut runs = Vec::new();
    for (number, part) in object.parts.iter().enumerate() {
        let mut push = |first: u32, material: Option<u32>| {
            runs.push(Run { first, material: material.unwrap_or(0), part: number as u32 });
        };
        if part.prim_count == 0 {
            continue;
        }
        push(part.first_prim, part.material);
        if let PartKind::Solids(tree) = &part.kind {
            let own = |leaf: &FlatLeaf| leaf.material.or(part.material);
            tree.leaves.iter().zip(part.first_prim..).for_each(|(leaf, prim)| push(prim, own(leaf)));
        }
        if let (None, PartKind::Mesh(mesh)) = (part.material, &part.kind) {
            mesh.groups.iter().for_each(|group| push(part.first_prim + group.first, named(&group.material)));
        }
    }
    // Where two runs begin at one primitive the later one, the group's, counts.
    runs.reverse();
    runs.sort_by_key(|run| run.first);
    runs.dedup_by_key(|run| run.first);
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::Part;
    use crate::scene::mesh::{Mesh, MeshGroup};

    #[test]
    fn every_primitive_has_the_run_of_a_plain_search() {
        let mut object = AssemblyObject::default();
        for (count, groups) in [(1, 0), (100, 7), (0, 0), (3, 3), (50_000, 2), (1, 0), (1, 0)] {
            let mut mesh = Mesh { triangles: vec![[0; 3]; count as usize], ..Mesh::default() };
            mesh.groups = (0..groups)
                .map(|g| MeshGroup { first: g * count / groups.max(1), count: 0, ..MeshGroup::default() })
                .collect();
            let first_prim = object.prim_count;
            let kind = PartKind::Mesh(mesh.into());
            let to_object = glam::DAffine3::IDENTITY;
            object.parts.push(Part { first_prim, prim_count: count, to_object, material: None, kind });
            object.prim_count += count;
        }
        let runs = Runs::new(&object, &Description::new("runs"));
        for prim in 0..object.prim_count {
            let plain = runs.list()[runs.list().partition_point(|run| run.first <= prim) - 1];
            assert_eq!(runs.of(prim), plain);
            let part = &object.parts[plain.part as usize];
            assert!(part.first_prim <= prim && prim < part.first_prim + part.prim_count);
        }
    }
}
