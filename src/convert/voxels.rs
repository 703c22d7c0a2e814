//! Solids as voxels: which of a grid's small cubes have their middles inside, and the cubes' outer faces as a mesh.
//!
//! The mesh is the cuberille of G. T. Herman, H. K. Liu, "Three-dimensional display of human organs from computed
//! tomograms", 1979: the dual of a grid whose corners are the voxels' middles, so it is woven like any other surface
//! and is a manifold even where voxels touch at an edge or a corner.

use glam::DVec3;
use rayon::prelude::*;

use super::check::{self, Topology};
use super::grid::Grid;
use super::hint::{COARSE, Sampled, hinted, largest};
use super::rows::{Rows, differences};
use super::samples::{Meeting, Samples, crossed, rows_of};
use super::select::Solids;
use super::snap::snap;
use super::vertices::in_the_middle;
use super::watch::Watch;
use super::weave::Net;
use super::{BYTES_PER_MEETING, Fineness, afford, empty};
use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;

/// Shares of a voxel that are rounding.
const ROUNDING: f64 = 1e-6;

/// Most voxels along the longest side that a hint names.
const MOST: u64 = 60_000;

/// Said where no hint helps.
const NONE_FITS: &str = "no coarser ones fit";

/// What is made of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Their flags: [`Voxels::planes`].
    Flags,
    /// Their outer faces: [`Voxels::mesh`], which needs memory for each.
    Faces,
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
    /// The voxels' middles, with a layer around them.
    grid: Grid,
    rows: Rows,
}

impl Voxels {
    /// Those of edge `spacing` in the box of `solids`; the box is in the middle of them. `wanted` is what an error's hint must fit.
    ///
    /// # Errors
    /// More voxels than the memory allowed has bytes; those of `watch`.
    pub fn new(solids: &Solids, spacing: f64, wanted: Wanted, fineness: &Fineness, watch: &Watch<'_>) -> Result<Self> {
        let (origin, grid) = middles(solids, spacing)?;
        let size = grid.cells.map(|n| n - 1);
        let [x, y, z] = size;
        let affordable = afford(least_bytes(&grid), fineness, || format!("{x} x {y} x {z} voxels need"));
        hinted(affordable, || what_fits(solids, wanted, fineness, watch))?;
        let rows = rows_of(&solids.world, &grid, watch)?;
        Ok(Self { origin, spacing, size, grid, rows })
    }

    /// Number of voxels inside.
    pub fn count(&self) -> u64 {
        let row = |y: usize, z: usize| self.rows.row(y, z).chunks_exact(2).map(|c| u64::from(c[1] - c[0])).sum::<u64>();
        (1..=self.size[2]).flat_map(|z| (1..=self.size[1]).map(move |y| (y, z))).map(|(y, z)| row(y, z)).sum()
    }

    /// Planes of flags, z after z: 1 where a voxel's middle is inside; x runs fastest, then y.
    pub fn planes(&self) -> impl Iterator<Item = Vec<u8>> {
        let [nx, ny, nz] = self.size;
        (1..=nz).map(move |z| {
            let mut plane = vec![0; nx * ny];
            for (y, row) in plane.chunks_exact_mut(nx).enumerate() {
                for run in self.rows.row(y + 1, z).chunks_exact(2) {
                    row[run[0] as usize - 1..run[1] as usize - 1].fill(1);
                }
            }
            plane
        })
    }

    /// The outer faces of the voxels inside, closed and a manifold.
    ///
    /// # Errors
    /// More faces than the memory allowed holds; voxels below the digits of `f32`.
    pub fn mesh(self, fineness: &Fineness) -> Result<(Mesh, Topology)> {
        let crossed = self.rows.count() + crossed(&self.rows, &self.grid);
        let affordable = afford(crossed * BYTES_PER_MEETING, fineness, || format!("{crossed} faces of voxels need"));
        hinted(affordable, || {
            let count = self.size.into_iter().max().unwrap_or(0);
            let known = Sampled { cells: count as f64, crossed };
            Ok(match largest(count as u64, fineness, |n| Some(known.bytes_of(n as f64))) {
                0 => NONE_FITS.into(),
                most => format!("--voxels {most} should fit"),
            })
        })?;
        let meetings = faces(&self.grid, &self.rows);
        if meetings.is_empty() {
            return Err(empty(format!("no voxel of {:.2e} has its middle inside the solids", self.spacing)));
        }
        let samples = Samples { grid: self.grid, rows: self.rows, meetings, loose: Vec::new() };
        let net = Net::new(&samples, None);
        let positions = snap(&in_the_middle(&samples, &net)).map_err(Error::Usage)?;
        let triangles = net.quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let topology = check::check(&mesh).map_err(|what| Error::Mismatch(format!("the voxels' mesh: {what}")))?;
        Ok((mesh, topology))
    }
}

/// The middle of the first voxel, and the grid of all middles with a layer around them.
fn middles(solids: &Solids, spacing: f64) -> Result<(DVec3, Grid)> {
    // Boxes are a few roundings wider than what is in them.
    let counts = ((solids.hi - solids.lo) / spacing - ROUNDING).ceil().max(DVec3::ONE);
    let origin = 0.5 * (solids.lo + solids.hi) - 0.5 * spacing * (counts - 1.0);
    Ok((origin, Grid::new(origin - spacing, spacing, counts + 1.0)?))
}

/// Bytes of voxels before anything is known of the surface.
fn least_bytes(grid: &Grid) -> u64 {
    grid.corner_count() + Rows::least_bytes(grid)
}

/// What would fit instead of voxels that do not; faces are counted on a coarse grid.
fn what_fits(solids: &Solids, wanted: Wanted, fineness: &Fineness, watch: &Watch<'_>) -> Result<String> {
    let side = (solids.hi - solids.lo).max_element();
    let mut known = Sampled { cells: COARSE, crossed: 0 };
    if wanted == Wanted::Faces {
        let (_, grid) = middles(solids, side / COARSE)?;
        let rows = rows_of(&solids.world, &grid, watch)?;
        known.crossed = rows.count() + crossed(&rows, &grid);
    }
    let most = largest(MOST, fineness, |n| {
        let (_, grid) = middles(solids, side / n as f64).ok()?;
        Some(least_bytes(&grid).max(known.bytes_of(n as f64)))
    });
    // A half per cent more than exact, as digits are left out.
    let tolerance = 1.006 * tolerance_of(side / most as f64);
    Ok(match wanted {
        _ if most == 0 => NONE_FITS.into(),
        Wanted::Flags => format!("--voxels {most} or --tolerance {tolerance:.2e} fits"),
        // A tolerance would ask for another kind of mesh.
        Wanted::Faces if most as f64 <= COARSE => format!("--voxels {most} fits"),
        Wanted::Faces => format!("--voxels {most} should fit"),
    })
}

/// Edge of voxels whose corners are `tolerance` away from their middles.
pub fn spacing_for(tolerance: f64) -> f64 {
    tolerance * 2.0 / 3f64.sqrt()
}

/// Half the diagonal of a voxel: how far the surface is from the faces of voxels, at most.
pub fn tolerance_of(spacing: f64) -> f64 {
    spacing * 0.5 * 3f64.sqrt()
}

/// A meeting in the middle of each edge between a voxel inside and one outside.
fn faces(grid: &Grid, rows: &Rows) -> Vec<Meeting> {
    let [_, ny, nz] = grid.corners();
    let meeting = |at: [usize; 3], axis: usize, enters: bool| {
        let edge = grid.corner(at) + axis as u64 * grid.corner_count();
        let dir = DVec3::AXES[axis];
        let point = grid.position(at) + 0.5 * grid.spacing * dir;
        Meeting { edge, enters, point, normal: if enters { -dir } else { dir } }
    };
    let plane = |z: usize| {
        let mut list = Vec::new();
        for y in 0..ny {
            let row = rows.row(y, z);
            list.extend(row.iter().enumerate().map(|(k, &x)| meeting([x as usize - 1, y, z], 0, k % 2 == 0)));
            for (axis, next) in [(1, (y + 1, z)), (2, (y, z + 1))] {
                if next.0 < ny && next.1 < nz {
                    for change in differences(row, rows.row(next.0, next.1)) {
                        list.extend(change.x.map(|x| meeting([x as usize, y, z], axis, change.enters)));
                    }
                }
            }
        }
        list
    };
    let planes: Vec<Vec<Meeting>> = (0..nz).into_par_iter().map(plane).collect();
    let mut list = planes.concat();
    list.sort_unstable_by_key(|m| m.edge);
    list
}
