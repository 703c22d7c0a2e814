//! A world's triangles in world space, f32, as peers want them: no instances, no shapes.

use glam::{DAffine3, DVec3};

use crate::scene::assembly::{Assembly, Part, PartKind, Placement};
use crate::scene::mesh::Mesh;
use crate::shape::Triangle;

/// Most triangles, counted once per instance, that a peer is given: its trees take up to 300 bytes for each.
pub const MAX_TRIANGLES: u64 = 12_000_000;

/// Indexed triangles with our numbers for them. Triangles that our engines drop (no area, not finite) are left out.
#[derive(Clone, Debug, Default)]
pub struct WorldTriangles {
    /// Vertices: x, y, z and a fourth number that makes the stride 16 bytes, as Embree's vector loads want it.
    pub vertices: Vec<[f32; 4]>,
    /// Vertex numbers of each triangle.
    pub indices: Vec<[u32; 3]>,
    /// Primitive and instance number of each triangle.
    pub ids: Vec<[u32; 2]>,
}

impl WorldTriangles {
    /// All triangles of all instances.
    ///
    /// # Errors
    /// Why peers cannot have this scene: analytic shapes, no triangles, or more than [`MAX_TRIANGLES`].
    pub fn flatten(assembly: &Assembly) -> Result<Self, String> {
        let parts = || assembly.objects.iter().flat_map(|object| &object.parts);
        let shapes = parts().filter(|part| !matches!(part.kind, PartKind::Mesh(_))).count();
        if shapes > 0 {
            return Err(format!("the scene has {shapes} analytic shapes, peers get triangles only"));
        }
        let count = assembly.instanced_prims();
        let vertices: u64 = assembly.placements.iter().map(|p| vertices_of(assembly, p)).sum();
        if count > MAX_TRIANGLES || vertices > 3 * MAX_TRIANGLES {
            let what = format!("{count} triangles with {vertices} vertices over all instances");
            return Err(format!("{what}, peers get at most {MAX_TRIANGLES} and three times as many"));
        }
        let mut all = Self::default();
        for (inst, placement) in assembly.placements.iter().enumerate() {
            for part in &assembly.objects[placement.object as usize].parts {
                if let PartKind::Mesh(mesh) = &part.kind {
                    all.add(part, mesh, placement, inst as u32);
                }
            }
        }
        if all.indices.is_empty() { Err("the scene has no triangles".into()) } else { Ok(all) }
    }

    fn add(&mut self, part: &Part, mesh: &Mesh, placement: &Placement, inst: u32) {
        let base = self.vertices.len() as u32;
        let local = |p: DVec3| placed(&part.to_object, p);
        self.vertices.extend(mesh.positions.iter().map(|&p| rounded(placed(&placement.to_world, local(p)))));
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|v| self.vertices[(base + v) as usize]);
            let kept = Triangle::record::<f32>(mesh.corners(i).map(local)).is_ok();
            if kept && corners.iter().flatten().all(|x| x.is_finite()) {
                self.indices.push(triangle.map(|v| base + v));
                self.ids.push([part.first_prim + i as u32, inst]);
            }
        }
    }

    /// The corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [[f32; 4]; 3] {
        self.indices[i].map(|v| self.vertices[v as usize])
    }
}

fn vertices_of(assembly: &Assembly, placement: &Placement) -> u64 {
    let parts = &assembly.objects[placement.object as usize].parts;
    let of_part = |part: &Part| match &part.kind {
        PartKind::Mesh(mesh) => mesh.positions.len() as u64,
        PartKind::Shape(_) | PartKind::Solids(_) => 0,
    };
    parts.iter().map(of_part).sum()
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
        let all = WorldTriangles::flatten(&Assembly::new(&scene()).unwrap()).unwrap();
        assert_eq!(all.ids, [[1, 0], [1, 1]]);
        assert_eq!(all.corners(0), [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]]);
        assert_eq!(all.corners(1), [[2.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0]]);
    }

    #[test]
    fn shapes_are_refused_in_words() {
        let mut scene = scene();
        scene.groups[1].items.push(item(ItemKind::Shape(Shape::Sphere), DAffine3::IDENTITY));
        let why = WorldTriangles::flatten(&Assembly::new(&scene).unwrap()).unwrap_err();
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
        let why = WorldTriangles::flatten(&Assembly::new(&scene).unwrap()).unwrap_err();
        assert!(why.contains("at most 12000000"), "{why}");
    }
}
