//! The vertices of a net.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;
use rayon::prelude::*;

use super::qef::Plane;
use super::samples::Samples;
use super::settle::{Piece, Settled, settle};
use super::watch::Watch;
use super::weave::{Cell, Net};
use crate::error::Result;
use crate::scene::world::World;

/// Cells settled together.
const CHUNK: usize = 2048;

/// Share of the way back from an edge or a corner that is another vertex's.
const BACK: f64 = 0.05;

/// Where a vertex is.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where, world space.
    pub position: DVec3,
    /// Unit normal of the surface there, or nearly.
    pub normal: DVec3,
}

/// Vertices on the surface, on its edges and corners where the cell has some. See [`moves`] for those that the edges
/// of their cells do not tell of.
///
/// # Errors
/// Those of `watch`.
pub fn settled(world: &World<f64>, samples: &Samples, net: &Net, watch: &Watch<'_>) -> Result<Vec<Vertex>> {
    let spacing = samples.grid.spacing;
    (watch.more)(net.cells.len().div_ceil(CHUNK) as u64);
    let chunk = |cells: &[Cell]| {
        watch.next()?;
        let pieces = cells.iter().flat_map(|cell| (0..cell.count).map(move |number| piece(samples, cell, number)));
        Ok(settle(world, &pieces.collect::<Vec<_>>(), spacing))
    };
    let chunks = net.cells.par_chunks(CHUNK).map(chunk).collect::<Result<Vec<_>>>()?;
    let settled = chunks.concat();
    let mut vertices: Vec<Vertex> = settled.iter().map(Settled::near).collect();
    for (vertex, position) in moves(samples, net, &settled) {
        vertices[vertex].position = position;
    }
    Ok(vertices)
}

impl Settled {
    /// The vertex in its cell or, where the piece runs to an edge or a corner beyond, nearly there: all faces that the
    /// cell sees meet only there. On the way back to the cell, which is on one of these faces, so that it shares its
    /// place with no other vertex.
    fn near(&self) -> Vertex {
        let far = self.beyond.map_or(self.position, |(far, _)| far + BACK * (self.position - far));
        Vertex { position: far, normal: self.normal }
    }
}

fn piece(samples: &Samples, cell: &Cell, number: u8) -> Piece {
    let at = samples.grid.corner_at(cell.corner);
    let planes = cell.meetings(samples, number).map(|m| Plane { point: m.point, normal: m.normal });
    Piece { planes: planes.collect(), lo: samples.grid.position(at), hi: samples.grid.position(at.map(|n| n + 1)) }
}

/// Corners and edges found beyond the cells whose planes lead there. In a cell that has vertices the nearest of them
/// moves there unless it is on as much already; in one that has none, of the vertices that found it the one with
/// the least way.
fn moves(samples: &Samples, net: &Net, settled: &[Settled]) -> HashMap<usize, DVec3> {
    let grid = &samples.grid;
    // For each cell the best found: corners before edges, then the nearest to who found it.
    let mut best: BTreeMap<u64, (usize, f64, usize, DVec3)> = BTreeMap::new();
    for (vertex, s) in settled.iter().enumerate() {
        let Some((position, rank)) = s.beyond else { continue };
        let Some(at) = grid.cell_at(position) else { continue };
        let far = position.distance(s.position);
        let entry = best.entry(grid.corner(at)).or_insert((rank, far, vertex, position));
        if rank > entry.0 || rank == entry.0 && far < entry.1 {
            *entry = (rank, far, vertex, position);
        }
    }
    let mut moves = HashMap::new();
    for (&corner, &(rank, _, _, position)) in &best {
        let Some(cell) = net.cell(corner) else { continue };
        let own = (cell.first..cell.first + u32::from(cell.count)).map(|v| v as usize);
        let far = |v: &usize| settled[*v].position.distance(position);
        if let Some(vertex) = own.min_by(|a, b| far(a).total_cmp(&far(b))).filter(|v| settled[*v].rank < rank) {
            moves.insert(vertex, position);
        }
    }
    for (&corner, &(_, _, vertex, position)) in &best {
        if net.cell(corner).is_none() {
            moves.entry(vertex).or_insert(position);
        }
    }
    moves
}

/// Vertices in the middles of their cells: with samples at the middles of voxels, the voxels' corners.
pub fn in_the_middle(samples: &Samples, net: &Net) -> Vec<Vertex> {
    let vertex = |cell: &Cell, number| {
        let normal: DVec3 = cell.meetings(samples, number).map(|m| m.normal).sum();
        let at = samples.grid.corner_at(cell.corner);
        let position = samples.grid.position(at) + 0.5 * samples.grid.spacing;
        Vertex { position, normal: normal.normalize_or(DVec3::Z) }
    };
    net.cells.iter().flat_map(|cell| (0..cell.count).map(move |number| vertex(cell, number))).collect()
}
