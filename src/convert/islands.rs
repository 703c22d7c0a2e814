//! Small surfaces that are only the grid's doing.
//!
//! Near a sharp edge a solid is thinner than any cell, and a corner of the grid may be inside all alone, its
//! neighbours outside. It gets a surface of its own, beside the edge that it belongs to. Such islands are left out if
//! they are within the tolerance of the rest; their crossings are measured against it like all others.

use glam::DVec3;

use super::check::roots;
use super::nearby::Nearby;
use crate::scene::mesh::Mesh;

/// Triangles of the largest island.
const LARGEST: usize = 96;

/// Which triangles are on islands: surfaces of few triangles whose crossings are all within `enough` of larger ones.
/// The crossing of triangle `i` is `crossing(i / 2)`. The largest surface is none.
pub fn islands(mesh: &Nearby<'_>, crossing: impl Fn(usize) -> DVec3, enough: f64) -> Vec<bool> {
    let roots = roots(mesh.triangles, mesh.positions.len());
    let of = |i: usize| roots[mesh.triangles[i][0] as usize] as usize;
    let mut sizes = vec![0usize; mesh.positions.len()];
    (0..mesh.triangles.len()).for_each(|i| sizes[of(i)] += 1);
    let mut is_island: Vec<bool> = sizes.iter().map(|&size| size > 0 && size <= LARGEST).collect();
    if let Some(largest) = (0..sizes.len()).max_by_key(|&root| sizes[root]) {
        is_island[largest] = false;
    }
    if !is_island.contains(&true) {
        return vec![false; mesh.triangles.len()];
    }
    let small = is_island.clone();
    for i in (0..mesh.triangles.len()).step_by(2).filter(|&i| small[of(i)]) {
        is_island[of(i)] &= mesh.distance(crossing(i / 2), |other| !small[of(other as usize)]) <= enough;
    }
    (0..mesh.triangles.len()).map(|i| is_island[of(i)]).collect()
}

/// The mesh without the triangles that are left out.
pub fn without(mesh: &Nearby<'_>, left_out: &[bool]) -> Mesh {
    let kept = mesh.triangles.iter().zip(left_out).filter(|(_, out)| !**out).map(|(triangle, _)| *triangle);
    let mut triangles: Vec<[u32; 3]> = kept.collect();
    let mut number = vec![u32::MAX; mesh.positions.len()];
    triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
    let mut positions = Vec::new();
    for (number, position) in number.iter_mut().zip(mesh.positions).filter(|(n, _)| **n == 0) {
        *number = positions.len() as u32;
        positions.push(*position);
    }
    triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
    Mesh { positions, triangles, ..Mesh::default() }
}
