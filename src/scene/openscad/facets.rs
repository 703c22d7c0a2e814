//! Convex meshes of few faces as the planes of their faces, which are traced faster.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use crate::scene::mesh::Mesh;
use crate::scene::solids::{NodeKind, Polyhedron, Solid, SolidTree};

/// Most faces of a mesh that becomes planes. In solids of 64 prisms or balls `stream` traced planes 1.4 to 2 times as
/// fast as a mesh at 422 faces, 5 times at 66; at 926 they were even.
const MAX_PLANES: usize = 512;
/// So many triangles have polyhedra of that many faces if three edges meet at each corner.
const MAX_TRIANGLES: usize = 2 * (2 * MAX_PLANES - 4) - 4;
/// Most pairs of triangles that are looked at: what is left stays meshes, which only costs speed.
const MAX_PAIRS: usize = 1 << 24;
/// How far a corner may be above a face, relative to the size of the mesh: what rounding lifts.
const ROUNDING: f64 = 1e-10;

/// Turns the meshes of `tree` that are convex and have few faces into polyhedra, those with fewest first.
pub(super) fn simplify(tree: &mut SolidTree) {
    let address = |mesh: &Arc<Mesh>| Arc::as_ptr(mesh) as usize;
    let (mut seen, mut meshes) = (HashSet::new(), Vec::new());
    for node in &tree.nodes {
        if let NodeKind::Solid(Solid::Mesh(mesh)) = &node.kind
            && mesh.triangles.len() <= MAX_TRIANGLES
            && seen.insert(address(mesh))
        {
            meshes.push(mesh.clone());
        }
    }
    meshes.sort_by_key(|mesh| mesh.triangles.len());
    let (mut known, mut pairs) = (HashMap::new(), 0);
    for mesh in &meshes {
        pairs += mesh.triangles.len() * mesh.triangles.len();
        if pairs > MAX_PAIRS {
            break;
        }
        known.extend(polyhedron(mesh).map(|polyhedron| (address(mesh), Arc::new(polyhedron))));
    }
    for node in &mut tree.nodes {
        if let NodeKind::Solid(solid) = &mut node.kind
            && let Solid::Mesh(mesh) = solid
            && let Some(planes) = known.get(&address(mesh))
        {
            *solid = Solid::Polyhedron(planes.clone());
        }
    }
}

/// The polyhedron that `mesh` is, if it is one of at most [`MAX_PLANES`] faces.
fn polyhedron(mesh: &Mesh) -> Option<Polyhedron> {
    if !is_convex(mesh) {
        return None;
    }
    let tolerance = tolerance(mesh);
    let mut planes: Vec<(DVec3, f64)> = Vec::new();
    let mut triangles: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
    // The largest triangle of a face knows its plane best.
    let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length_squared();
    triangles.sort_by(|a, b| area(b).total_cmp(&area(a)));
    for [a, b, c] in triangles {
        let is_known = planes
            .iter()
            .any(|(normal, offset)| [a, b, c].iter().all(|corner| (normal.dot(*corner) - offset).abs() <= tolerance));
        if let (Some(normal), false) = ((b - a).cross(c - a).try_normalize(), is_known) {
            if planes.len() >= MAX_PLANES {
                return None;
            }
            planes.push((normal, normal.dot(a)));
        }
    }
    Polyhedron::from_planes(&planes).ok()
}

fn tolerance(mesh: &Mesh) -> f64 {
    mesh.bounds().map_or(0.0, |(lo, hi)| ROUNDING * lo.abs().max(hi.abs()).max_element())
}

/// Whether a closed mesh is convex: one piece that is nowhere bent inwards.
pub(super) fn is_convex(mesh: &Mesh) -> bool {
    let first_at = Mesh::first_at_place(&mesh.positions);
    let tolerance = tolerance(mesh);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|i| first_at[i as usize])).collect();
    let mut across: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * triangles.len());
    for (triangle, number) in triangles.iter().zip(0..) {
        for k in 0..3 {
            if across.insert((triangle[k], triangle[(k + 1) % 3]), number).is_some() {
                return false;
            }
        }
    }
    let at = |i: u32| mesh.positions[i as usize];
    let (mut seen, mut reached) = (vec![false; triangles.len()], Vec::new());
    if let Some(first) = seen.first_mut() {
        (*first, reached) = (true, vec![0]);
    }
    let mut next = 0;
    while next < reached.len() {
        let [a, b, c] = triangles[reached[next]];
        next += 1;
        let normal = (at(b) - at(a)).cross(at(c) - at(a)).normalize_or_zero();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let Some(&other) = across.get(&(to, from)) else { return false };
            let corners = triangles[other as usize];
            if corners.iter().any(|&corner| normal.dot(at(corner) - at(a)) > tolerance) {
                return false;
            }
            if !std::mem::replace(&mut seen[other as usize], true) {
                reached.push(other as usize);
            }
        }
    }
    !reached.is_empty() && reached.len() == triangles.len()
}
