//! Balls, cylinders and polyhedra as OpenSCAD cuts them into faces.
//!
//! Meshes wind counter-clockwise seen from outside; OpenSCAD's own polyhedra are written clockwise.

use glam::DVec3;

use super::fields::Fields;
use super::fragments::{circle, direction};
use crate::error::Result;
use crate::scene::mesh::Mesh;
use crate::scene::polygon::{self, Polygons};

/// A ball: rings of `pieces` corners at the middles of equal parts of the half circle from pole to pole, flat at both.
pub(super) fn sphere(radius: f64, pieces: usize) -> Mesh {
    let rings = pieces.div_ceil(2);
    let mut positions = Vec::with_capacity(rings * pieces);
    for ring in 0..rings {
        let along = direction(180.0 * (ring as f64 + 0.5) / rings as f64);
        positions.extend(circle(radius * along.y, pieces).map(|p| p.extend(radius * along.x)));
    }
    let mut mesh = Mesh { positions, ..Mesh::default() };
    cap(&mut mesh, 0, pieces, true);
    for ring in 1..rings {
        band(&mut mesh, (ring * pieces) as u32, ((ring - 1) * pieces) as u32, pieces);
    }
    cap(&mut mesh, (rings - 1) * pieces, pieces, false);
    mesh
}

/// A cylinder or cone from z = `low` to z = `high`; one of its radii may be 0.
pub(super) fn cylinder([low, high]: [f64; 2], radii: [f64; 2], pieces: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let mut first = [0; 2];
    for (end, z) in [low, high].into_iter().enumerate() {
        first[end] = mesh.positions.len();
        match radii[end] == 0.0 {
            true => mesh.positions.push(DVec3::Z * z),
            false => mesh.positions.extend(circle(radii[end], pieces).map(|p| p.extend(z))),
        }
    }
    let [below, above] = first.map(|i| i as u32);
    let n = pieces as u32;
    if radii[0] == 0.0 {
        cap(&mut mesh, above as usize, pieces, true);
        mesh.triangles.extend((0..n).map(|i| [below, above + (i + 1) % n, above + i]));
    } else if radii[1] == 0.0 {
        cap(&mut mesh, below as usize, pieces, false);
        mesh.triangles.extend((0..n).map(|i| [below + i, below + (i + 1) % n, above]));
    } else {
        cap(&mut mesh, below as usize, pieces, false);
        band(&mut mesh, below, above, pieces);
        cap(&mut mesh, above as usize, pieces, true);
    }
    mesh
}

/// The polygon of the `count` corners from `first` on, seen from above or from below.
fn cap(mesh: &mut Mesh, first: usize, count: usize, is_top: bool) {
    let first = first as u32;
    mesh.triangles.extend((1..count as u32 - 1).map(|i| match is_top {
        true => [first, first + i, first + i + 1],
        false => [first, first + i + 1, first + i],
    }));
}

/// The faces between two rings of `count` corners that begin at `below` and `above`.
fn band(mesh: &mut Mesh, below: u32, above: u32, count: usize) {
    let n = count as u32;
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.push([below + i, below + j, above + j]);
        mesh.triangles.push([below + i, above + j, above + i]);
    }
}

/// A polyhedron by its points and faces, which may be polygons with notches; and how many of them are too large to be
/// cut well.
///
/// # Errors
/// Points that are not three finite numbers, faces that name others, more corners than u32 counts.
pub(super) fn polyhedron(fields: &Fields<'_, '_>) -> Result<(Mesh, u64)> {
    let points = fields.list("points")?.unwrap_or_default();
    let faces = fields.list("faces")?.or(fields.list("triangles")?).unwrap_or_default();
    let mut mesh = Mesh { positions: Vec::with_capacity(points.len()), ..Mesh::default() };
    for point in points {
        mesh.positions.push(DVec3::from(fields.vector_of::<3>(point, "points", 2)?));
    }
    let mut polygons = Polygons::default();
    let mut corners = Vec::new();
    for face in faces {
        corners.clear();
        for corner in fields.list_of(face, "faces")? {
            corners.push(fields.index_of(corner, "faces", points.len())?);
        }
        corners.reverse();
        let start = mesh.triangles.len();
        mesh.triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
        let fan = &mut mesh.triangles[start..];
        if let Some(cut) = (!fan.is_empty()).then(|| polygons.cut(fan, &mesh.positions)).flatten() {
            polygon::apply(&cut, fan);
        }
    }
    Ok((mesh, polygons.large))
}
