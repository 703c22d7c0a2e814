//! Scenes of nothing but meshes: their triangles where they are placed, in one mesh. There is nothing to convert but the format.

use crate::error::{Error, Result};
use crate::scene::assembly::{Assembly, AssemblyObject, PartKind};
use crate::scene::description::Description;
use crate::scene::mesh::Mesh;

/// Bytes of a vertex and of a triangle of a [`Mesh`].
const BYTES: [u64; 2] = [24, 12];

/// The triangles of a scene in the scene's own space.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// All of them, instance by instance, in the order of their numbers there. Those of mirrored instances have two corners exchanged:
    /// they wind as seen from the same side of the surface. No normals, texture coordinates or materials.
    pub mesh: Mesh,
    /// Meshes placed, also of the same one.
    pub meshes: usize,
}

impl Placed {
    /// Those of `description`; `None` if anything else than meshes is placed in it, or nothing. `memory`: bytes they may take.
    ///
    /// # Errors
    /// Those of [`Assembly::new`]; more than `memory`, or than 2^32 - 1 vertices.
    pub fn new(description: &Description, memory: u64) -> Result<Option<Self>> {
        let assembly = Assembly::new(description)?;
        let placements = assembly.placements.iter().map(|p| (&assembly.objects[p.object as usize], p.to_world));
        let only_meshes = |(object, _): (&AssemblyObject, _)| meshes(object).count() == object.parts.len();
        if assembly.placements.is_empty() || !placements.clone().all(only_meshes) {
            return Ok(None);
        }
        // Counted before they are made: a small file may place a mesh many times.
        let each = placements.clone().flat_map(|(object, _)| meshes(object));
        let counts = each.fold([0u64; 3], |[vertices, triangles, meshes], (mesh, _)| {
            [vertices + mesh.positions.len() as u64, triangles + mesh.triangles.len() as u64, meshes + 1]
        });
        let bytes = BYTES[0].saturating_mul(counts[0]).saturating_add(BYTES[1].saturating_mul(counts[1]));
        if bytes > memory {
            let need = bytes.div_ceil(1 << 20);
            return Err(Error::Usage(format!("{} triangles need {need} MiB: more than --memory allows", counts[1])));
        }
        if counts[0] > u64::from(u32::MAX) {
            return Err(Error::Usage(format!("{} vertices are too many for a file of meshes", counts[0])));
        }
        let mut all = Mesh::default();
        all.positions.reserve_exact(counts[0] as usize);
        all.triangles.reserve_exact(counts[1] as usize);
        for (object, to_world) in placements {
            for (mesh, to_object) in meshes(object) {
                let (place, first) = (to_world * *to_object, all.positions.len() as u32);
                let mirrored = place.matrix3.determinant() < 0.0;
                all.positions.extend(mesh.positions.iter().map(|p| place.transform_point3(*p)));
                all.triangles.extend(mesh.triangles.iter().map(|t| {
                    let [a, b, c] = t.map(|i| first + i);
                    if mirrored { [a, c, b] } else { [a, b, c] }
                }));
            }
        }
        Ok(Some(Self { mesh: all, meshes: counts[2] as usize }))
    }
}

/// The meshes of an object, and where they are in its space.
fn meshes(object: &AssemblyObject) -> impl Iterator<Item = (&Mesh, &glam::DAffine3)> {
    object.parts.iter().filter_map(|part| match &part.kind {
        PartKind::Mesh(mesh) => Some((&**mesh, &part.to_object)),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::scene::description::{Group, Item, ItemKind, Shape};

    /// A triangle at the origin, and a mirrored instance of it.
    fn twice() -> Description {
        let mut d = Description::new("twice");
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        d.meshes = vec![Arc::new(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() })];
        let item = |transform, kind| Item { transform, material: None, kind };
        let mirror = DAffine3::from_scale_rotation_translation(
            DVec3::new(1.0, 1.0, -1.0),
            glam::DQuat::IDENTITY,
            DVec3::new(5.0, 0.0, 0.0),
        );
        let own = item(DAffine3::IDENTITY, ItemKind::Mesh(0));
        d.groups[0].items = vec![own.clone(), item(mirror, ItemKind::Instance(1))];
        d.groups.push(Group { name: "again".into(), items: vec![own] });
        d
    }

    #[test]
    fn instances_are_placed_and_mirrored_ones_keep_their_side() {
        let placed = Placed::new(&twice(), 1 << 20).unwrap().unwrap();
        assert_eq!((placed.meshes, placed.mesh.positions.len()), (2, 6));
        assert_eq!(placed.mesh.triangles, [[0, 1, 2], [3, 5, 4]]);
        assert_eq!(placed.mesh.positions[4], DVec3::new(6.0, 0.0, 0.0));
    }

    #[test]
    fn what_is_too_large_or_no_mesh_is_not_made() {
        let text = Placed::new(&twice(), 6 * 24 + 2 * 12 - 1).unwrap_err().to_string();
        assert!(text.contains("2 triangles need 1 MiB"), "{text}");
        assert!(Placed::new(&twice(), 6 * 24 + 2 * 12).unwrap().is_some());
        let mut d = twice();
        let kind = ItemKind::Shape(Shape::Sphere);
        d.groups[1].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind });
        assert_eq!(Placed::new(&d, u64::MAX).unwrap(), None);
        assert_eq!(Placed::new(&Description::new("nothing"), u64::MAX).unwrap(), None);
    }
}
