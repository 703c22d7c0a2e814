//! The vertices of a net.

use std::collections::HashMap;

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

/// Where a vertex is.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where, world space.
    pub position: DVec3,
    /// Unit normal of the surface there, or nearly.
    pub normal: DVec3,
}

/// Vertices on the surface, on its edges and corners where the cell has some. A corner or edge that ends in a cell
/// which no edge of the grid tells of is taken by the nearest cell whose planes lead there.
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
    let mut vertices: Vec<Vertex> = settled.iter().map(|s| Vertex { position: s.position, normal: s.normal }).collect();
    for (vertex, position) in claims(samples, net, &settled) {
        vertices[vertex].position = position;
    }
    Ok(vertices)
}

fn piece(samples: &Samples, cell: &Cell, number: u8) -> Piece {
    let at = samples.grid.corner_at(cell.corner);
    let planes = cell.meetings(samples, number).map(|m| Plane { point: m.point, normal: m.normal });
    Piece { planes: planes.collect(), lo: samples.grid.position(at), hi: samples.grid.position(at.map(|n| n + 1)) }
}

/// Which vertices go beyond their cells: one for each cell without a vertex of its own, the one that has least to go.
fn claims(samples: &Samples, net: &Net, settled: &[Settled]) -> Vec<(usize, DVec3)> {
    let grid = &samples.grid;
    let mut best: HashMap<u64, (f64, usize, DVec3)> = HashMap::new();
    for (vertex, s) in settled.iter().enumerate() {
        let Some(position) = s.beyond else { continue };
        let Some(at) = grid.cell_at(position) else { continue };
        let cell = grid.corner(at);
        let far = position.distance(s.position);
        if net.cell(cell).is_none() && best.get(&cell).is_none_or(|b| far < b.0) {
            best.insert(cell, (far, vertex, position));
        }
    }
    best.into_values().map(|(_, vertex, position)| (vertex, position)).collect()
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
