//! From samples to a closed, manifold mesh.
//!
//! Every loop of every cell (see [`super::cell`]) gets a vertex, every crossed edge of the grid a quadrilateral
//! between the four cells around it. Such a mesh is a manifold unless two cells share a face on which one and the
//! same loop of both passes twice; then the face is joined the other way, which parts the loop in both (the idea of
//! R. Wenger, "Isosurfaces: Geometry, Topology, and Algorithms", 2013, section 3.5). Loops are only ever parted, so
//! one pass is enough.

use std::collections::HashSet;

use glam::DVec3;

use super::cell::{NONE, face_pairs, is_ambiguous, loops};
use super::qef;
use super::samples::{Meeting, Samples};

/// A cell that the surface passes.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Number of its lower corner.
    corner: u64,
    /// A bit for each corner inside.
    inside: u8,
    /// Loop of each edge.
    loops: [u8; 12],
    /// Number of loops.
    count: u8,
    /// Vertex of its first loop.
    first: u32,
}

/// A vertex for each loop.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where.
    pub position: DVec3,
    /// Mean of its loop's normals, not unit.
    pub normal: DVec3,
    /// Middle of its cell.
    pub middle: DVec3,
}

/// Vertices, and four of them for each crossed edge, counter-clockwise from outside, with the normal there.
#[derive(Debug, Default)]
pub struct Quads {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// Numbers of vertices around each crossed edge.
    pub quads: Vec<[u32; 4]>,
    /// Normal of the surface where the edge crosses it.
    pub normals: Vec<DVec3>,
}

/// Makes the mesh.
pub fn weave(samples: &Samples) -> Quads {
    let mut cells = active(samples);
    part(samples, &mut cells);
    let mut quads = Quads::default();
    for cell in &mut cells {
        cell.first = quads.vertices.len() as u32;
        quads.vertices.extend((0..cell.count).map(|number| vertex(samples, cell, number)));
    }
    for meeting in &samples.meetings {
        if let Some(quad) = around(samples, &cells, meeting) {
            quads.quads.push(quad);
            quads.normals.push(meeting.normal);
        }
    }
    quads
}

/// Bits of a cell's corners.
fn bits(samples: &Samples, at: [usize; 3]) -> u8 {
    let corner = |c: usize| samples.grid.corner([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)]);
    (0..8).fold(0, |bits, c| bits | u8::from(samples.is_inside(corner(c))) << c)
}

/// The cells around crossed edges, in order of their corners.
fn active(samples: &Samples) -> Vec<Cell> {
    let grid = &samples.grid;
    let count = grid.corner_count();
    let mut corners: Vec<u64> = Vec::with_capacity(samples.meetings.len() * 4);
    for meeting in &samples.meetings {
        let (axis, at) = ((meeting.edge / count) as usize, grid.corner_at(meeting.edge % count));
        corners.extend(cells_around(axis, at).map(|(cell, _)| grid.corner(cell)));
    }
    corners.sort_unstable();
    corners.dedup();
    let cell = |corner: u64| {
        let inside = bits(samples, grid.corner_at(corner));
        let (loops, count) = loops(inside, 0);
        Cell { corner, inside, loops, count, first: 0 }
    };
    corners.into_iter().map(cell).collect()
}

/// The four cells around the edge along `axis` from corner `at`, counter-clockwise seen against the axis, each with
/// the number of the edge in it.
fn cells_around(axis: usize, at: [usize; 3]) -> [([usize; 3], usize); 4] {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    // Outermost corners are outside, so a crossed edge has cells on all sides.
    [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(db, dc)| {
        let mut cell = at;
        cell[b] -= db;
        cell[c] -= dc;
        (cell, 4 * axis + db + 2 * dc)
    })
}

fn find(cells: &[Cell], corner: u64) -> Option<usize> {
    cells.binary_search_by_key(&corner, |cell| cell.corner).ok()
}

/// Parts loops that meet another loop twice.
fn part(samples: &Samples, cells: &mut [Cell]) {
    let grid = &samples.grid;
    // Faces by the number of the upper cell's corner and their axis.
    let mut connecting: HashSet<(u64, usize)> = HashSet::new();
    let relabelled = |cell: &Cell, connecting: &HashSet<(u64, usize)>| {
        let at = grid.corner_at(cell.corner);
        let connects = (0..6).filter(|&face| {
            let mut upper = at;
            upper[face / 2] += face % 2;
            connecting.contains(&(grid.corner(upper), face / 2))
        });
        loops(cell.inside, connects.fold(0, |bits, face| bits | 1 << face))
    };
    for i in 0..cells.len() {
        for axis in 0..3 {
            let (face, cell) = (2 * axis, cells[i]);
            let mut below = grid.corner_at(cell.corner);
            if !is_ambiguous(cell.inside, face) || below[axis] == 0 {
                continue;
            }
            below[axis] -= 1;
            let Some(j) = find(cells, grid.corner(below)) else { continue };
            let twice = |cell: &Cell, face: usize| {
                let [[a, _], [b, _]] = face_pairs(cell.inside, face, false);
                cell.loops[a] == cell.loops[b]
            };
            if twice(&cell, face) && twice(&cells[j], face + 1) {
                connecting.insert((cell.corner, axis));
                for k in [i, j] {
                    (cells[k].loops, cells[k].count) = relabelled(&cells[k], &connecting);
                }
            }
        }
    }
}

/// The vertex of a loop.
fn vertex(samples: &Samples, cell: &Cell, number: u8) -> Vertex {
    let grid = &samples.grid;
    let at = grid.corner_at(cell.corner);
    let mut planes = [(DVec3::ZERO, DVec3::ZERO); 12];
    let mut count = 0;
    for edge in (0..12).filter(|&e| cell.loops[e] == number) {
        let low = super::cell::lower_corner(edge);
        let corner = grid.corner([at[0] + (low & 1), at[1] + (low >> 1 & 1), at[2] + (low >> 2)]);
        if let Some(meeting) = samples.meeting(corner + (edge / 4) as u64 * grid.corner_count()) {
            planes[count] = (meeting.point, meeting.normal);
            count += 1;
        }
    }
    let planes = &planes[..count];
    let (lo, hi) = (grid.position(at), grid.position(at.map(|n| n + 1)));
    let normal = planes.iter().map(|p| p.1).sum();
    Vertex { position: qef::nearest(planes, lo, hi), normal, middle: 0.5 * (lo + hi) }
}

/// The quadrilateral of a crossed edge.
fn around(samples: &Samples, cells: &[Cell], meeting: &Meeting) -> Option<[u32; 4]> {
    let count = samples.grid.corner_count();
    let (axis, low) = ((meeting.edge / count) as usize, meeting.edge % count);
    let mut quad = [0; 4];
    for (slot, (cell, edge)) in quad.iter_mut().zip(cells_around(axis, samples.grid.corner_at(low))) {
        let cell = &cells[find(cells, samples.grid.corner(cell))?];
        debug_assert_ne!(cell.loops[edge], NONE, "a crossed edge is in a loop of each cell around it");
        *slot = cell.first + u32::from(cell.loops[edge]);
    }
    // From inside to outside along the axis, the outward side is the one the order is counter-clockwise from.
    if !samples.is_inside(low) {
        quad.reverse();
    }
    Some(quad)
}
