//! How large the numbers were that a hit was computed from.

use glam::{DAffine3, DVec3};

use crate::scene::assembly::{Assembly, PartKind};

/// Bound, per axis of world space, of the coordinates that enter the test of primitive `prim` of instance `inst`:
/// the corners of the triangle (analytic shapes live in the unit box) taken through the part's and the instance's
/// maps, without the cancellations that signs may bring.
pub(super) fn magnitude(assembly: &Assembly, prim: u32, inst: u32) -> DVec3 {
    let placement = &assembly.placements[inst as usize];
    let part = assembly.part_of(placement.object, prim);
    let local = match &part.kind {
        PartKind::Mesh(mesh) => {
            let [a, b, c] = mesh.corners((prim - part.first_prim) as usize);
            a.abs().max(b.abs()).max(c.abs())
        }
        PartKind::Shape(_) => DVec3::ONE,
        PartKind::Solids(tree) => {
            let leaf = &tree.leaves[(prim - part.first_prim) as usize];
            let (lo, hi) = leaf.solid.bounds();
            let size = lo.abs().max(hi.abs());
            through(&leaf.to_tree, if size.is_finite() { size } else { DVec3::ONE })
        }
    };
    through(&placement.to_world, through(&part.to_object, local))
}

/// Largest coordinates of the images under `map` of points with coordinates up to `magnitude`.
fn through(map: &DAffine3, magnitude: DVec3) -> DVec3 {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(DVec3::abs);
    x * magnitude.x + y * magnitude.y + z * magnitude.z + map.translation.abs()
}
