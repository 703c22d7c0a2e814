//! Solids as closed triangle meshes and as voxels.
//!
//! A uniform grid is laid around the solids; the rays along its lines say where they are inside, with the exact
//! place and normal of every crossing ([`samples`]). The mesh is the grid's dual: a vertex in each cell the surface
//! passes, at the point nearest to the tangent planes of the cell's crossings, so that edges and corners stay sharp
//! (T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data", 2002; [`qef`]), several vertices
//! where several pieces pass (G. M. Nielson, "Dual Marching Cubes", 2004; [`cell`]), woven to a manifold
//! ([`weave`]). Departures from these: crossings are exact instead of bisected, faces that would make a mesh meet
//! itself are joined the other way, and quadrilaterals are cut along the diagonal that is nearer to the true
//! surface.
//!
//! What is thinner than a cell and missed by all lines is lost, and triangles may pass through each other where the
//! surface turns more than once within a cell. The mesh is closed and a manifold in any case.

pub mod grid;
pub mod select;

mod cell;
mod lines;
mod qef;
mod samples;
mod snap;
mod triangles;
mod weave;

use glam::DVec3;
use rayon::prelude::*;

pub use grid::Grid;
pub use select::Solids;

use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;
use lines::Line;
use samples::Samples;

/// Cells along the longest side of the first grid.
const COARSEST: f64 = 32.0;
/// Where the grid's planes are between its cells' edges and the box of the solids: no simple fraction, so that flat
/// faces do not lie in them.
const SHIFT: DVec3 = DVec3::new(0.318_309_886, 0.367_879_441, 0.414_213_562);
/// Shares of a voxel that are rounding.
const ROUNDING: f64 = 1e-6;
/// Bytes for a crossed edge: its meeting, up to four cells, vertices, triangles and the lines that measure them.
const BYTES_PER_MEETING: u64 = 1200;

/// How fine.
#[derive(Clone, Copy, Debug)]
pub struct Fineness {
    /// Largest distance from the true surface, scene units: the grid is made finer until it holds.
    pub tolerance: f64,
    /// Cells along the longest side; then there is one grid and the tolerance is only reported against.
    pub cells: Option<u32>,
    /// Bytes that may be used.
    pub memory: u64,
}

/// A mesh of the surface, and how good it is.
#[derive(Debug)]
pub struct Surface {
    /// Closed; every edge is in two triangles, once each way. Positions are `f32` numbers.
    pub mesh: Mesh,
    /// The grid it was made on.
    pub grid: Grid,
    /// Largest distance of a vertex from the true surface, scene units.
    pub at_vertices: f64,
    /// Largest distance of the middle of a quadrilateral from the true surface.
    pub at_middles: f64,
    /// Parts that begin and end between two corners of the grid.
    pub unresolved: u64,
}

/// Flags of voxels.
#[derive(Debug)]
pub struct Voxels {
    /// Middle of voxel (0, 0, 0).
    pub origin: DVec3,
    /// Edge of a voxel.
    pub spacing: f64,
    /// Number of voxels along x, y and z.
    pub size: [usize; 3],
    /// 1 where a voxel's middle is inside; x runs fastest, then y.
    pub inside: Vec<u8>,
}

/// The surface of `solids`. `stop` is asked between grids.
///
/// # Errors
/// A grid that needs more memory than allowed, cells below the digits of `f32`, [`Error::Interrupted`].
pub fn surface(solids: &Solids, fineness: &Fineness, stop: &(dyn Fn() -> bool + Sync)) -> Result<Surface> {
    let side = (solids.hi - solids.lo).max_element();
    let mut count = fineness.cells.map_or(COARSEST, f64::from);
    loop {
        if stop() {
            return Err(Error::Interrupted);
        }
        let grid = Grid::around(solids.lo, solids.hi, side / count, SHIFT)?;
        let found = on_grid(solids, grid, fineness)?;
        if fineness.cells.is_some() || found.at_vertices.max(found.at_middles) <= fineness.tolerance {
            return Ok(found);
        }
        count *= 2.0;
    }
}

fn on_grid(solids: &Solids, grid: Grid, fineness: &Fineness) -> Result<Surface> {
    // Before sampling nothing is known but that a surface of about the box's own passes the grid.
    let [x, y, z] = grid.cells.map(|n| n as u64);
    let surface = 2 * (x * y + y * z + z * x);
    afford(grid.corner_count() + surface / 2 * BYTES_PER_MEETING, &grid, fineness)?;
    let samples = Samples::new(&solids.world, grid);
    afford(grid.corner_count() + samples.meetings.len() as u64 * BYTES_PER_MEETING, &grid, fineness)?;
    let quads = weave::weave(&samples);
    let cut = triangles::cut(&solids.world, &quads, grid.spacing, fineness.tolerance);
    let positions = snap::snap(&quads.vertices).map_err(Error::Usage)?;
    let positions = positions.into_iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let mesh = Mesh { positions, triangles: cut.triangles, groups: Vec::new() };
    let (at_vertices, at_middles) = (cut.at_vertices, cut.at_middles);
    Ok(Surface { mesh, grid, at_vertices, at_middles, unresolved: samples.unresolved })
}

/// Refuses what needs more memory than allowed.
fn afford(bytes: u64, grid: &Grid, fineness: &Fineness) -> Result<()> {
    if bytes <= fineness.memory {
        return Ok(());
    }
    let [x, y, z] = grid.cells;
    let (need, have) = (bytes.div_ceil(1 << 20), fineness.memory >> 20);
    Err(Error::Usage(format!(
        "a grid of {x} x {y} x {z} cells needs about {need} MiB, more than --memory {have}; give more, or a larger \
         --tolerance, or fewer --cells"
    )))
}

/// Which voxels of edge `spacing` have their middles inside.
///
/// # Errors
/// A grid that needs more memory than allowed.
pub fn voxels(solids: &Solids, spacing: f64, fineness: &Fineness) -> Result<Voxels> {
    // Boxes are a few roundings wider than what is in them.
    let counts = ((solids.hi - solids.lo) / spacing - ROUNDING).ceil().max(DVec3::ONE);
    let around = Grid::around(solids.lo, solids.hi, spacing, DVec3::ZERO)?;
    afford(around.corner_count() * 2, &around, fineness)?;
    let size = counts.to_array().map(|n| n as usize);
    // The voxels are in the middle of the box where its sides are no multiples of theirs.
    let origin = 0.5 * (solids.lo + solids.hi) - 0.5 * spacing * (counts - 1.0);
    let [nx, ny, _] = size;
    let mut inside = vec![0; size.iter().product()];
    inside.par_chunks_mut(nx * ny).enumerate().for_each(|(z, flags)| {
        let start = origin - DVec3::X * spacing;
        let length = (nx + 1) as f64 * spacing;
        let line = |y: usize| start + spacing * DVec3::new(0.0, y as f64, z as f64);
        let lines: Vec<Line> = (0..ny).map(|y| Line { org: line(y), dir: DVec3::X, length }).collect();
        for (found, row) in lines::crossings(&solids.world, &lines).iter().zip(flags.chunks_exact_mut(nx)) {
            lines::fill(found, spacing, row);
        }
    });
    Ok(Voxels { origin, spacing, size, inside })
}
