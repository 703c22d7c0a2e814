//! Which part and which material a primitive belongs to, and where shapes stand.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::lanes::{Lanes, Lanes3, dot, each};
use crate::math::NormalMap;
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

/// Most places of shapes that an object keeps; shapes of larger ones are placed anew for each hit.
const MAX_PLACES: usize = 1 << 16;

/// A shape's own space seen from another.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    to_local: DAffine3,
    normals: NormalMap,
}

impl Place {
    /// Of a shape that `map` takes to the other space.
    pub fn new(map: &DAffine3) -> Self {
        Self { to_local: map.inverse(), normals: NormalMap::new(map) }
    }

    /// A point of the other space in the shape's own.
    #[inline]
    pub fn local(&self, point: DVec3) -> DVec3 {
        self.to_local.transform_point3(point)
    }

    /// The same of the points of lanes.
    #[inline]
    pub fn local_lanes<V: Lanes>(&self, point: Lanes3<V>) -> Lanes3<V> {
        let (rows, from) = (self.to_local.matrix3.transpose(), self.to_local.translation);
        each(|k| {
            let row = rows.col(k);
            dot(each(|axis| V::constant(row[axis])), point) + V::constant(from[k])
        })
    }

    /// Normals of the shape's space in the other one, not unit.
    #[inline]
    pub fn normal_lanes<V: Lanes>(&self, local: Lanes3<V>) -> Lanes3<V> {
        let rows = self.normals.matrix().transpose();
        // Numbers of about one, whatever the map's scale.
        let scale = 1.0 / rows.to_cols_array().iter().fold(0.0f64, |most, x| most.max(x.abs()));
        each(|k| dot(each(|axis| V::constant(rows.col(k)[axis] * scale)), local))
    }

    /// A normal of the shape's space in the other one, unit.
    #[inline]
    pub fn normal(&self, local: DVec3) -> DVec3 {
        self.normals.apply(local)
    }
}

/// The runs of an object, found in nearly constant time.
#[derive(Clone, Debug)]
pub struct Runs {
    list: Vec<Run>,
    /// Parallel to the list: places of shapes and leaves of solids in the object's space; empty where they are too many.
    places: Vec<Option<Place>>,
    /// Primitives `k << shift` and above, below `(k + 1) << shift`, belong to runs `starts[k]..=starts[k + 1]`.
    starts: Vec<u32>,
    shift: u32,
}

impl Runs {
    /// The runs of `object`, which has at least one primitive; `materials` are those that meshes name ([`by_name`]).
    pub fn new(object: &AssemblyObject, materials: &HashMap<&str, u32>) -> Self {
        let list = list(object, materials);
        let mut shift = 0;
        while (object.prim_count >> shift) as usize > 4 * list.len() {
            shift += 1;
        }
        let cells = (object.prim_count >> shift) + 1;
        let at = |prim: u64| list.partition_point(|run| u64::from(run.first) <= prim).saturating_sub(1) as u32;
        let starts = (0..=cells).map(|cell| at(u64::from(cell) << shift)).collect();
        let places =
            if list.len() > MAX_PLACES { Vec::new() } else { list.iter().map(|run| place(object, run)).collect() };
        Self { list, places, starts, shift }
    }

    /// The run of primitive `prim`.
    #[inline]
    pub fn of(&self, prim: u32) -> Run {
        self.find(prim).1
    }

    /// The same, and of a shape or a leaf of solids its place in the object's space, if that is kept.
    #[inline]
    pub fn placed(&self, prim: u32) -> (Run, Option<&Place>) {
        let (at, run) = self.find(prim);
        (run, self.places.get(at).and_then(Option::as_ref))
    }

    /// The run of primitive `prim` and its number.
    #[inline(always)]
    pub fn find(&self, prim: u32) -> (usize, Run) {
        let cell = (prim >> self.shift) as usize;
        let low = self.starts[cell] as usize;
        if self.shift == 0 {
            return (low, self.list[low]);
        }
        let high = self.starts[cell + 1] as usize;
        let after = self.list[low + 1..=high].partition_point(|run| run.first <= prim);
        (low + after, self.list[low + after])
    }

    /// All of them, in order.
    pub fn list(&self) -> &[Run] {
        &self.list
    }
}

/// The place of the only shape of `run` in the object's space; `None` of triangles.
pub fn place(object: &AssemblyObject, run: &Run) -> Option<Place> {
    let part = &object.parts[run.part as usize];
    match &part.kind {
        PartKind::Mesh(_) => None,
        PartKind::Shape(_) => Some(Place::new(&part.to_object)),
        PartKind::Solids(tree) => {
            let leaf = tree.leaves.get((run.first - part.first_prim) as usize)?;
            Some(Place::new(&(part.to_object * leaf.to_tree)))
        }
    }
}

/// The materials of `description` by name, of several with one name the first.
pub fn by_name(description: &Description) -> HashMap<&str, u32> {
    let mut found = HashMap::with_capacity(description.materials.len());
    for (material, number) in description.materials.iter().zip(0..) {
        found.entry(material.name.as_str()).or_insert(number);
    }
    found
}

fn list(object: &AssemblyObject, materials: &HashMap<&str, u32>) -> Vec<Run> {
    let named = |name: &str| materials.get(name).copied();
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
    use crate::scene::material::Material;
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
        let runs = Runs::new(&object, &by_name(&Description::new("runs")));
        for prim in 0..object.prim_count {
            let plain = runs.list()[runs.list().partition_point(|run| run.first <= prim) - 1];
            assert_eq!(runs.of(prim), plain);
            let part = &object.parts[plain.part as usize];
            assert!(part.first_prim <= prim && prim < part.first_prim + part.prim_count);
        }
    }

    #[test]
    fn groups_find_the_first_material_of_their_name_in_linear_time() {
        const COUNT: u32 = 200_000;
        let mut description = Description::new("named");
        let named = |i: u32| Material { name: format!("m{i}"), ..Material::default() };
        description.materials.extend((0..COUNT).chain([0, 1]).map(named));
        let group = |i: u32| MeshGroup { first: i, count: 1, material: format!("m{i}"), ..MeshGroup::default() };
        let triangles = vec![[0; 3]; COUNT as usize + 1];
        let mesh = Mesh { triangles, groups: (0..=COUNT).map(group).collect(), ..Mesh::default() };
        let (prim_count, to_object, kind) = (COUNT + 1, DAffine3::IDENTITY, PartKind::Mesh(mesh.into()));
        let parts = vec![Part { first_prim: 0, prim_count, to_object, material: None, kind }];
        let object = AssemblyObject { parts, prim_count, ..AssemblyObject::default() };
        let start = std::time::Instant::now();
        let runs = Runs::new(&object, &by_name(&description));
        assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
        // Behind the default material; the last name is nobody's.
        let first = description.materials.len() as u32 - COUNT - 2;
        assert!((0..COUNT).all(|i| runs.of(i).material == first + i));
        assert_eq!(runs.of(COUNT).material, 0);
    }
}
