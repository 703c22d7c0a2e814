//! From samples to a closed, manifold net.
//!
//! Every loop of every cell (see [`super::cell`]) gets a vertex, every crossed edge of the grid a quadrilateral
//! between the four cells around it. A face with two inside corners across from each other connects them if a ray
//! from one to the other stays inside. Such a mesh is a manifold unless two cells share a face on which one and the
//! same loop of both passes twice; then the face is joined the other way, which parts the loop in both (the idea of
//! R. Wenger, "Isosurfaces: Geometry, Topology, and Algorithms", 2013, section 3.5). Loops are only ever parted, so
//! one pass is enough.

use std::collections::HashSet;

use glam::DVec3;

use super::cell::{NONE, face_corners, face_pairs, is_ambiguous, loops, lower_corner};
use super::lines::{Line, Tracer};
use super::samples::{Meeting, Samples};
use crate::scene::world::World;

/// A cell that the surface passes.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Number of its lower corner.
    pub corner: u64,
    /// Number of loops.
    pub count: u8,
    /// A bit for each corner inside.
    inside: u8,
    /// Loop of each edge.
    loops: [u8; 12],
    /// Vertex of its first loop.
    pub first: u32,
}

/// Cells with their vertices, and four vertices for each crossed edge.
#[derive(Debug)]
pub struct Net {
    /// In order of their corners.
    pub cells: Vec<Cell>,
    /// Numbers of vertices around each crossed edge, counter-clockwise from outside, in order of the edges.
    pub quads: Vec<[u32; 4]>,
    /// Number of vertices.
    pub vertices: u32,
}

impl Net {
    /// The net of `samples`. Without a world no face connects its inside corners if it need not.
    pub fn new(samples: &Samples, world: Option<&World<f64>>) -> Self {
        let mut cells = active(samples);
        part(samples, world, &mut cells);
        let mut vertices = 0;
        for cell in &mut cells {
            cell.first = vertices;
            vertices += u32::from(cell.count);
        }
        let quads = samples.meetings.iter().filter_map(|meeting| around(samples, &cells, meeting)).collect();
        Self { cells, quads, vertices }
    }

    /// The cell with a number, if the surface passes it.
    pub fn cell(&self, corner: u64) -> Option<&Cell> {
        find(&self.cells, corner).map(|i| &self.cells[i])
    }
}

impl Cell {
    /// The crossings of the edges of one of its loops.
    pub fn meetings<'a>(&self, samples: &'a Samples, number: u8) -> impl Iterator<Item = &'a Meeting> {
        let (grid, cell) = (&samples.grid, *self);
        let at = grid.corner_at(cell.corner);
        (0..12).filter(move |&edge| cell.loops[edge] == number).filter_map(move |edge| {
            let low = lower_corner(edge);
            let corner = grid.corner([at[0] + (low & 1), at[1] + (low >> 1 & 1), at[2] + (low >> 2)]);
            samples.meeting(corner + (edge / 4) as u64 * grid.corner_count())
        })
    }
}

/// Bits of a cell's corners.
fn bits(samples: &Samples, at: [usize; 3]) -> u8 {
    let inside = |c: usize| samples.rows.is_inside([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)]);
    (0..8).fold(0, |bits, c| bits | u8::from(inside(c)) << c)
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

/// Faces, by the number of the corner of the cell above them and their axis.
type Faces = HashSet<(u64, usize)>;

/// Joins the loops of all cells and parts those that meet another loop twice.
fn part(samples: &Samples, world: Option<&World<f64>>, cells: &mut [Cell]) {
    let grid = &samples.grid;
    let mut ambiguous = Vec::new();
    for (i, cell) in cells.iter().enumerate() {
        for axis in (0..3).filter(|axis| is_ambiguous(cell.inside, 2 * axis)) {
            let mut below = grid.corner_at(cell.corner);
            // The outermost corners are outside, so an ambiguous face has a cell below.
            below[axis] = below[axis].saturating_sub(1);
            ambiguous.extend(find(cells, grid.corner(below)).map(|j| (i, j, axis)));
        }
    }
    let mut connecting = world.map_or_else(Faces::new, |world| connected(samples, world, cells, &ambiguous));
    let join = |cell: &mut Cell, connecting: &Faces| {
        let at = grid.corner_at(cell.corner);
        let connects = (0..6).filter(|&face| {
            let mut upper = at;
            upper[face / 2] += face % 2;
            connecting.contains(&(grid.corner(upper), face / 2))
        });
        (cell.loops, cell.count) = loops(cell.inside, connects.fold(0, |bits, face| bits | 1 << face));
    };
    for &(i, j, _) in &ambiguous {
        join(&mut cells[i], &connecting);
        join(&mut cells[j], &connecting);
    }
    for &(i, j, axis) in &ambiguous {
        let face = (cells[i].corner, axis);
        let twice = |cell: &Cell, side: usize| {
            let [[a, _], [b, _]] = face_pairs(cell.inside, 2 * axis + side, connecting.contains(&face));
            cell.loops[a] == cell.loops[b]
        };
        if twice(&cells[i], 0) && twice(&cells[j], 1) {
            if !connecting.remove(&face) {
                connecting.insert(face);
            }
            join(&mut cells[i], &connecting);
            join(&mut cells[j], &connecting);
        }
    }
}

/// The ambiguous faces, lower ones of their first cells, whose inside corners see each other through the inside.
fn connected(samples: &Samples, world: &World<f64>, cells: &[Cell], ambiguous: &[(usize, usize, usize)]) -> Faces {
    let line = |&(i, _, axis): &(usize, usize, usize)| {
        let at = samples.grid.corner_at(cells[i].corner);
        let ends = face_corners(2 * axis).into_iter().filter(|c| cells[i].inside >> c & 1 != 0);
        let mut ends = ends.map(|c| samples.grid.position([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)]));
        let (from, to) = (ends.next().unwrap_or_default(), ends.next().unwrap_or_default());
        Line { org: from, dir: (to - from).normalize_or(DVec3::Z), length: from.distance(to) }
    };
    let lines: Vec<Line> = ambiguous.iter().map(line).collect();
    let mut faces = Faces::new();
    Tracer::default().each(world, &lines, |n, found| {
        let (i, _, axis) = ambiguous[n];
        if found.is_empty() {
            faces.insert((cells[i].corner, axis));
        }
    });
    faces
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
    if meeting.enters {
        quad.reverse();
    }
    Some(quad)
}
