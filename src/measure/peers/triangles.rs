//! A world's triangles, f32, as peers want them: all in world space, or, for peers that know instances, objects that are
//! placed several times once in their own space. No shapes.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::scene::assembly::{Assembly, AssemblyObject, Part, PartKind};
use crate::scene::mesh::Mesh;
use crate::scene::world::Names;
use crate::shape::Triangle;

/// Most triangles (counted once per instance, for peers without instances) and instances together that a peer is given:
/// its trees take up to 300 bytes for each.
pub const MAX_TRIANGLES: u64 = 12_000_000;

/// Most triangles with one and the same box centre for builders that cluster neighbours (obvhs, parry's `ploc`): they take
/// time quadratic in this number and make a chain that deep.
pub const MAX_COINCIDENT: usize = 500;

/// Indexed triangles of one space with our numbers for them. Triangles that our engines drop (no area, not finite) are
/// left out.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    /// Vertices: x, y, z and a fourth number that makes the stride 16 bytes, as Embree's vector loads want it.
    pub vertices: Vec<[f32; 4]>,
    /// Vertex numbers of each triangle.
    pub indices: Vec<[u32; 3]>,
    /// Primitive and instance number of each triangle.
    pub ids: Vec<[u32; 2]>,
}

impl Triangles {
    /// All triangles of all instances, in world space.
    ///
    /// # Errors
    /// Why peers cannot have this scene: analytic shapes, no triangles, or more than [`MAX_TRIANGLES`].
    pub fn flatten(assembly: &Assembly) -> Result<Self, String> {
        refuse_shapes(assembly)?;
        let count = assembly.instanced_prims();
        let vertices = assembly.placements.iter().map(|p| vertices_of(&assembly.objects[p.object as usize])).sum();
        refuse_many(count, vertices, "triangles over all instances")?;
        let mut all = Self::default();
        for (inst, placement) in assembly.placements.iter().enumerate() {
            all.add_object(&assembly.objects[placement.object as usize], &placement.to_world, inst as u32);
        }
        if all.indices.is_empty() { Err(NONE.into()) } else { Ok(all) }
    }

    fn add_object(&mut self, object: &AssemblyObject, to_space: &DAffine3, inst: u32) {
        for part in &object.parts {
            if let PartKind::Mesh(mesh) = &part.kind {
                self.add(part, mesh, to_space, inst);
            }
        }
    }

    fn add(&mut self, part: &Part, mesh: &Mesh, to_space: &DAffine3, inst: u32) {
        let base = self.vertices.len() as u32;
        let local = |p: DVec3| placed(&part.to_object, p);
        self.vertices.extend(mesh.positions.iter().map(|&p| rounded(placed(to_space, local(p)))));
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|v| self.vertices[(base + v) as usize]);
            let described = mesh.corners(i);
            let kept = !Triangle::is_flat(described) && Triangle::record::<f32>(described.map(local)).is_ok();
            if kept && corners.iter().flatten().all(|x| x.is_finite()) {
                self.indices.push(triangle.map(|v| base + v));
                self.ids.push([part.first_prim + i as u32, inst]);
            }
        }
    }

    /// Size of the largest group of triangles whose boxes have one centre; see [`MAX_COINCIDENT`].
    pub fn most_coincident(&self) -> usize {
        let mut groups: HashMap<[u32; 3], usize> = HashMap::new();
        for i in 0..self.indices.len() {
            let [a, b, c] = self.corners(i);
            let middle = |k: usize| 0.5 * (a[k].min(b[k]).min(c[k]) + a[k].max(b[k]).max(c[k]));
            // Adding 0 makes -0 and 0 one key.
            *groups.entry([0, 1, 2].map(|k| (middle(k) + 0.0).to_bits())).or_default() += 1;
        }
        groups.into_values().max().unwrap_or(0)
    }

    /// The corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [[f32; 4]; 3] {
        self.indices[i].map(|v| self.vertices[v as usize])
    }
}

/// A world for peers that know instances: what is placed once stands in world space, as in a world without instances;
/// what is placed several times is kept once, in its own space.
#[derive(Clone, Debug, Default)]
pub struct PlacedTriangles {
    /// Triangles of all objects that are placed once, in world space.
    pub world: Triangles,
    /// Objects that are placed several times, in object space; their instance numbers mean nothing.
    pub objects: Vec<Triangles>,
    /// Where those are placed.
    pub instances: Vec<PlacedObject>,
}

/// One of several placements of an object.
#[derive(Clone, Copy, Debug)]
pub struct PlacedObject {
    /// Index into [`PlacedTriangles::objects`].
    pub object: u32,
    /// Our instance number.
    pub inst: u32,
    /// Object space to world space: three columns and the translation.
    pub to_world: [f32; 12],
}

impl PlacedTriangles {
    /// The triangles of what a world traces, `assembly`, with the numbers that `names` says.
    ///
    /// # Errors
    /// Those of [`Triangles::flatten`], where [`MAX_TRIANGLES`] is for stored triangles and instances together.
    pub fn of(assembly: &Assembly, names: Option<&Names>) -> Result<Self, String> {
        refuse_shapes(assembly)?;
        let mut placements = vec![0u64; assembly.objects.len()];
        assembly.placements.iter().for_each(|p| placements[p.object as usize] += 1);
        let used = || assembly.objects.iter().zip(&placements).filter(|(_, count)| **count > 0);
        let repeated: u64 = placements.iter().filter(|count| **count > 1).sum();
        let count = used().map(|(object, _)| u64::from(object.prim_count)).sum::<u64>() + repeated;
        refuse_many(count, used().map(|(object, _)| vertices_of(object)).sum(), "triangles and instances")?;
        let mut all = Self::default();
        let mut kept = vec![None; assembly.objects.len()];
        for (inst, placement) in assembly.placements.iter().enumerate() {
            let at = placement.object as usize;
            let object = &assembly.objects[at];
            if placements[at] == 1 {
                all.world.add_object(object, &placement.to_world, inst as u32);
                continue;
            }
            let number = *kept[at].get_or_insert_with(|| {
                let mut triangles = Triangles::default();
                triangles.add_object(object, &DAffine3::IDENTITY, 0);
                all.objects.push(triangles);
                all.objects.len() as u32 - 1
            });
            let to_world = placement.to_world.to_cols_array().map(|x| x as f32);
            let finite = to_world.iter().all(|x| x.is_finite());
            if finite && !all.objects[number as usize].indices.is_empty() {
                all.instances.push(PlacedObject { object: number, inst: inst as u32, to_world });
            }
        }
        if let Some(names) = names {
            all.world.ids.iter_mut().for_each(|id| *id = names.of(id[0], id[1]));
            all.instances.iter_mut().for_each(|placed| placed.inst = names.of(0, placed.inst)[1]);
        }
        if all.world.indices.is_empty() && all.instances.is_empty() { Err(NONE.into()) } else { Ok(all) }
    }
}

/// Why there is nothing to trace.
const NONE: &str = "the scene has no triangles";

fn refuse_shapes(assembly: &Assembly) -> Result<(), String> {
    let parts = assembly.objects.iter().flat_map(|object| &object.parts);
    match parts.filter(|part| !matches!(part.kind, PartKind::Mesh(_))).count() {
        0 => Ok(()),
        shapes => Err(format!("the scene has {shapes} analytic shapes, peers get triangles only")),
    }
}

fn refuse_many(count: u64, vertices: u64, what: &str) -> Result<(), String> {
    if count <= MAX_TRIANGLES && vertices <= 3 * MAX_TRIANGLES {
        return Ok(());
    }
    Err(format!("{count} {what} with {vertices} vertices, peers get at most {MAX_TRIANGLES} and three times as many"))
}

fn vertices_of(object: &AssemblyObject) -> u64 {
    let of_part = |part: &Part| match &part.kind {
        PartKind::Mesh(mesh) => mesh.positions.len() as u64,
        PartKind::Shape(_) | PartKind::Solids(_) => 0,
    };
    object.parts.iter().map(of_part).sum()
}

/// An identity must not cost the file's last bits.
fn placed(map: &DAffine3, p: DVec3) -> DVec3 {
    if *map == DAffine3::IDENTITY { p } else { map.transform_point3(p) }
}

fn rounded(p: DVec3) -> [f32; 4] {
    [p.x as f32, p.y as f32, p.z as f32, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::{Description, Group, Item, ItemKind, Shape};
    use std::sync::Arc;

    fn item(kind: ItemKind, transform: DAffine3) -> Item {
        Item { transform, material: None, kind }
    }

    /// Two triangles, the first without area, in a part moved by (1, 0, 0), once as they are and once twice as large.
    fn scene() -> Description {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 0, 1], [0, 1, 2]],
            groups: Vec::new(),
            ..Mesh::default()
        };
        let mut scene = Description::new("two");
        scene.meshes.push(Arc::new(mesh));
        let part = item(ItemKind::Mesh(0), DAffine3::from_translation(DVec3::X));
        scene.groups = vec![Group::default(), Group { items: vec![part], ..Default::default() }];
        scene.groups[0].items = vec![
            item(ItemKind::Instance(1), DAffine3::IDENTITY),
            item(ItemKind::Instance(1), DAffine3::from_scale(DVec3::splat(2.0))),
        ];
        scene
    }

    #[test]
    fn instances_become_triangles_with_their_numbers() {
        let all = Triangles::flatten(&Assembly::new(&scene()).unwrap()).unwrap();
        assert_eq!(all.ids, [[1, 0], [1, 1]]);
        assert_eq!(all.corners(0), [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]]);
        assert_eq!(all.corners(1), [[2.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0]]);
    }

    /// Placed twice, so kept once: our numbers, the corners as they are in the object, two maps.
    #[test]
    fn what_is_placed_twice_is_kept_once() {
        let mut scene = scene();
        scene.groups[0].items.push(item(ItemKind::Mesh(0), DAffine3::from_translation(DVec3::Z)));
        let all = PlacedTriangles::of(&Assembly::new(&scene).unwrap(), None).unwrap();
        assert_eq!((&all.world.ids[..], all.objects.len()), (&[[1, 0]][..], 1), "the root's own is placed once");
        assert_eq!(all.world.corners(0)[1], [1.0, 0.0, 1.0, 0.0]);
        assert_eq!((all.objects[0].ids.len(), all.objects[0].corners(0)[0]), (1, [1.0, 0.0, 0.0, 0.0]));
        assert_eq!(all.instances.iter().map(|i| (i.object, i.inst)).collect::<Vec<_>>(), [(0, 1), (0, 2)]);
        assert_eq!(all.instances[1].to_world, [2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn shapes_are_refused_in_words() {
        let mut scene = scene();
        scene.groups[1].items.push(item(ItemKind::Shape(Shape::Sphere), DAffine3::IDENTITY));
        let why = Triangles::flatten(&Assembly::new(&scene).unwrap()).unwrap_err();
        assert!(why.contains("1 analytic shapes"), "{why}");
    }

    #[test]
    fn too_many_instances_are_refused_before_they_are_made() {
        let mut scene = scene();
        for level in 2..26 {
            let twice = [0, 1].map(|_| item(ItemKind::Instance(level - 1), DAffine3::IDENTITY));
            scene.groups.push(Group { items: twice.into(), ..Default::default() });
        }
        scene.groups[0].items = vec![item(ItemKind::Instance(24), DAffine3::IDENTITY)];
        let assembly = Assembly::new(&scene).unwrap();
        let why = Triangles::flatten(&assembly).unwrap_err();
        assert!(why.contains("at most 12000000"), "{why}");
        // Where instances are kept, each counts as one.
        assert!(refuse_many(MAX_TRIANGLES, 3, "triangles and instances").is_ok());
        assert!(refuse_many(MAX_TRIANGLES + 1, 3, "triangles and instances").is_err());
    }
}
