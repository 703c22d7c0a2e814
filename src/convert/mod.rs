//! Solids as closed triangle meshes and as voxels.
//!
//! A uniform grid is laid around the solids; the rays along its lines say where they are inside, with the exact
//! place and normal of every crossing (`samples`). The mesh is the grid's dual: a vertex in each cell the surface
//! passes, several where several pieces pass (G. M. Nielson, "Dual Marching Cubes", 2004; `cell`), woven to a
//! manifold (`weave`; S. Schaefer, T. Ju, J. Warren, "Manifold Dual Contouring", 2007, have the same aim). A vertex
//! is at the point nearest to the tangent planes of its piece's crossings, so that edges and corners stay sharp
//! (T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data", 2002; `qef`); more rays bring it
//! onto the surface itself (the idea of L. Kobbelt, M. Botsch, U. Schwanecke, H.-P. Seidel, "Feature Sensitive Surface
//! Extraction from Volume Data", 2001; `settle`). Quadrilaterals are cut along the diagonal that is nearer to the
//! true surface (`triangles`), distances are measured with rays ([`measure`]), and what leaves this module was
//! checked to be closed and a manifold ([`mod@check`]).
//!
//! The first grid has cells of four times the tolerance, but no more than 64 along the longest side; cells are halved
//! until the distances measured are within the tolerance. Memory goes with the surface, not with the volume. What
//! is thinner than a cell and missed by all lines is lost, and triangles may pass through each other where the
//! surface turns more than once within a cell. The mesh is closed and a manifold in any case.

pub mod check;
pub mod grid;
pub mod measure;
pub mod nearby;
pub mod placed;
pub mod select;
pub mod voxels;
pub mod watch;

mod cell;
mod hint;
mod islands;
mod lines;
mod qef;
mod rows;
mod samples;
mod settle;
mod snap;
mod triangles;
mod vertices;
mod weave;

use glam::DVec3;
use rayon::prelude::*;

pub use check::Topology;
pub use grid::Grid;
pub use measure::Distances;
pub use placed::Placed;
pub use select::Solids;
pub use voxels::{Voxels, Wanted};
pub use watch::Watch;

use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;
use hint::{COARSE, Sampled, hinted, largest};
use nearby::Nearby;
use rows::Rows;
use samples::Samples;
use weave::Net;

/// Tolerances in a cell of the first grid.
const CELL: f64 = 4.0;
/// Cells along the longest side of the first grid: at least, at most.
const FIRST: (f64, f64) = (16.0, COARSE);
/// Cells of this share of the tolerance are the last: what is further away then is thinner than a cell.
const LAST: f64 = 0.25;
/// Where the grid's planes are between its cells' edges and the box of the solids: no simple fraction, so that flat
/// faces do not lie in them.
const SHIFT: DVec3 = DVec3::new(std::f64::consts::FRAC_1_PI, 0.367_879_441, 0.414_213_562);
/// Bytes for a crossed edge: its meeting, cells, vertices, quadrilateral, triangles and what checks them.
const BYTES_PER_MEETING: u64 = 640;

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
    /// Largest distances measured between the mesh and the true surface.
    pub distances: Distances,
    /// How it hangs together.
    pub topology: Topology,
}

/// The surface of `solids`.
///
/// # Errors
/// A grid that needs more memory than allowed, cells below the digits of `f32`, [`Error::Interrupted`].
pub fn surface(solids: &Solids, fineness: &Fineness, watch: &Watch<'_>) -> Result<Surface> {
    let side = (solids.hi - solids.lo).max_element();
    let first = (side / (CELL * fineness.tolerance)).clamp(FIRST.0, FIRST.1);
    let mut count = fineness.cells.map_or(first, f64::from);
    let grid_of = |count: f64| Grid::around(solids.lo, solids.hi, side / count, SHIFT);
    let sampled = |cells: f64| -> Result<Sampled> {
        let coarse = Samples::new(&solids.world, grid_of(cells)?, &|_| Ok(()), watch)?;
        Ok(Sampled { cells, crossed: coarse.meetings.len() as u64 })
    };
    // Of a grid that tells what a finer one needs, and the distance that was reached with it.
    let mut known: Option<(Sampled, Option<f64>)> = if count > COARSE { Some((sampled(COARSE)?, None)) } else { None };
    loop {
        let grid = grid_of(count)?;
        let least = Rows::least_bytes(&grid);
        let enough = |crossed: u64| {
            let [x, y, z] = grid.cells;
            let what = || format!("a grid of {x} x {y} x {z} cells needs");
            afford(least + crossed * BYTES_PER_MEETING, fineness, what)
        };
        let told = enough(known.map_or(0, |(sampled, _)| sampled.crossed_of(count)));
        let samples = told.and_then(|()| Samples::new(&solids.world, grid, &enough, watch));
        let samples = hinted(samples, || {
            if let Some((Sampled { cells, .. }, Some(reached))) = known {
                let cells = cells.floor();
                return Ok(format!("--cells {cells} fits, with distances of about {reached:.2e}"));
            }
            let sampled = known.map_or_else(|| sampled(count.min(COARSE)), |(sampled, _)| Ok(sampled))?;
            let bytes = |n: u64| Some(Rows::least_bytes(&grid_of(n as f64).ok()?) + sampled.bytes_of(n as f64));
            Ok(match largest(count.ceil() as u64, fineness, bytes) {
                0 => "no coarser one fits".into(),
                n if n as f64 <= sampled.cells => format!("--cells {n} fits"),
                n => format!("--cells {n} should fit"),
            })
        })?;
        let found = on_grid(solids, &samples, fineness, watch)?;
        let is_last = fineness.cells.is_some() || grid.spacing <= LAST * fineness.tolerance;
        if is_last || found.distances.largest() <= fineness.tolerance {
            let what = || format!("no corner of a grid with cells of {:.2e} is inside the solids", grid.spacing);
            return if found.mesh.triangles.is_empty() { Err(empty(what())) } else { Ok(found) };
        }
        let crossed = samples.meetings.len() as u64;
        known = Some((Sampled { cells: count, crossed }, Some(found.distances.largest())));
        count *= 2.0;
    }
}

/// The surface on one grid.
fn on_grid(solids: &Solids, samples: &Samples, fineness: &Fineness, watch: &Watch<'_>) -> Result<Surface> {
    let (world, grid) = (&solids.world, samples.grid);
    let net = Net::new(samples, Some(world));
    let mut vertices = vertices::settled(world, samples, &net, watch)?;
    let mut positions = snap::snap(&vertices).map_err(Error::Usage)?;
    // Nearer than this nobody asks.
    let ignored = 0.5 * fineness.tolerance;
    let cut = triangles::cut(world, samples, &net, &positions, ignored, watch)?;
    let moved = triangles::mend(&mut vertices, &cut.triangles, &mut positions, grid.spacing);
    let probes: Vec<_> =
        vertices.iter().zip(&positions).map(|(v, p)| measure::Probe { point: *p, normal: v.normal }).collect();
    let of_vertices = measure::all_distances(world, &probes, 2.0 * grid.spacing, ignored);
    let nearby = Nearby::new(&grid, &net, &positions, &cut.triangles);
    let crossing = |quad: usize| samples.meetings[quad].point;
    let left_out = islands::islands(&nearby, crossing, fineness.tolerance);
    let of_islands = (0..net.quads.len()).filter(|&quad| left_out[2 * quad]).map(crossing);
    let far: Vec<DVec3> = cut.far.iter().chain(&samples.loose).copied().chain(of_islands).collect();
    let away = |point: &DVec3| nearby.distance(*point, |triangle| !left_out[triangle as usize]);
    // Crossings that are near enough were not looked at again.
    let near = if samples.meetings.is_empty() { 0.0 } else { ignored };
    let distances = Distances {
        mesh: cut.distance.max(of_vertices) + moved,
        solid: far.par_iter().map(away).reduce(|| near, f64::max),
    };
    let mesh = islands::without(&nearby, &left_out);
    let topology =
        check::check(&mesh).map_err(|what| Error::Mismatch(format!("the mesh made is not closed: {what}")))?;
    Ok(Surface { mesh, grid, distances, topology })
}

/// Nothing is left to write.
fn empty(what: String) -> Error {
    Error::Usage(format!("{what}: they are empty, or thinner than that everywhere"))
}

/// Refuses what needs more memory than allowed; `what` says what.
fn afford(bytes: u64, fineness: &Fineness, what: impl Fn() -> String) -> Result<()> {
    if bytes <= fineness.memory {
        return Ok(());
    }
    let (need, have) = (bytes.div_ceil(1 << 20), fineness.memory >> 20);
    Err(Error::Usage(format!("{} about {need} MiB, more than --memory {have}", what())))
}
