//! `lanecast convert`: solids as a closed mesh or as voxels.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::common::{OutputArgs, SceneArgs, ThreadArgs, with_pool};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use crate::convert::{Fineness, Solids, surface, voxels};
use crate::error::{Error, Result};
use crate::film::mesh::{MeshKind, write_mesh};
use crate::film::npy;

/// Tolerance unless `--tolerance` says otherwise, as a share of the box's diagonal.
const DEFAULT_TOLERANCE: f64 = 1e-3;

const EXAMPLES: &str = "\
Examples:
  lanecast convert builtin:bolt --solid bolt -o bolt.stl
  lanecast convert builtin:die --solid first -o die.obj --tolerance 0.002
  lanecast convert builtin:rook -o rooks.ply --cells 200
  lanecast convert builtin:bolt --solid plate -o plate.npy --cells 256 --json
  lanecast render bolt.stl -o bolt.png          the mesh, to compare with the solid

What is converted: trees of solids (union, intersection, difference, xor), spheres, boxes, cylinders and cones, all
of them together as one solid; with --solid only those trees and `define`s. Loose meshes and discs have no inside and
are left out; planes have no bounds and are refused, so scenes with a ground plane want --solid.

A mesh is closed: every edge is in two triangles. Edges and corners stay sharp. The grid is made finer (32 cells along
the longest side, 64, 128, ...) until no vertex and no middle of a bent facet is further from the true surface
than the tolerance; the largest distances are printed. Parts thinner than a cell can be missed. Vertices are
written as f32.

Voxels (.npy) are u1 flags of shape (nz, ny, nx), 1 where the voxel's middle is inside; origin (the middle of
voxel 0 0 0) and spacing are printed. The tolerance is half a voxel's diagonal.";

/// Arguments of `lanecast convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ConvertArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// File to write: .stl, .obj or .ply for a mesh, .npy for voxels
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    file: PathBuf,
    /// Convert only the solid or `define` of this name; may be given more than once
    #[arg(long, value_name = "NAME")]
    solid: Vec<String>,
    /// Largest distance from the true surface, scene units [default: 0.001 of the diagonal]
    #[arg(long, value_name = "LENGTH", conflicts_with = "cells")]
    tolerance: Option<f64>,
    /// Cells along the longest side, instead of a tolerance
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=60_000))]
    cells: Option<u32>,
    /// Refuse grids that need more memory than this
    #[arg(long, value_name = "MIB", default_value_t = 2048)]
    memory: u64,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// The object of `--json` for a mesh.
#[derive(Serialize)]
struct MeshReport<'a> {
    scene: &'a str,
    output: &'a Path,
    triangles: usize,
    vertices: usize,
    volume: f64,
    cells: [usize; 3],
    spacing: f64,
    tolerance: f64,
    /// Largest distances from the true surface, scene units.
    distance_of_vertices: f64,
    distance_of_middles: f64,
    unresolved: u64,
}

/// The object of `--json` for voxels.
#[derive(Serialize)]
struct VoxelReport<'a> {
    scene: &'a str,
    output: &'a Path,
    shape: [usize; 3],
    origin: [f64; 3],
    spacing: f64,
    inside: u64,
    volume: f64,
}

/// Runs `lanecast convert`.
///
/// # Errors
/// Bad input, solids without bounds, too little memory, files that cannot be written.
pub fn run(args: &ConvertArgs) -> Result<()> {
    let kind = MeshKind::of(&args.file);
    let is_voxels = args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    if kind.is_none() && !is_voxels {
        let file = args.file.display();
        return Err(Error::Usage(format!("-o {file}: expected a name that ends in .stl, .obj, .ply or .npy")));
    }
    let description = args.scene.load()?;
    with_pool(args.threads.count(), || {
        let solids = Solids::new(&description, &args.solid)?;
        if solids.left_out > 0 {
            args.output.say(&format!("warning: {} meshes and discs have no inside and are left out", solids.left_out));
        }
        let tolerance = args.tolerance.unwrap_or(DEFAULT_TOLERANCE * (solids.hi - solids.lo).length());
        // Below this the digits of f32, in which vertices are written, do not suffice.
        let least = 2.0 * f64::from(f32::EPSILON) * solids.lo.abs().max(solids.hi.abs()).max_element();
        if !(tolerance >= least && tolerance.is_finite()) {
            return Err(Error::Usage(format!(
                "--tolerance: expected a number of at least {least:e}, found {tolerance}"
            )));
        }
        let fineness = Fineness { tolerance, cells: args.cells, memory: args.memory.saturating_mul(1 << 20) };
        match kind {
            Some(kind) => mesh(args, &solids, &fineness, kind),
            None => grid(args, &solids, &fineness),
        }
    })
}

fn mesh(args: &ConvertArgs, solids: &Solids, fineness: &Fineness, kind: MeshKind) -> Result<()> {
    let found = surface(solids, fineness, &stopped)?;
    let comment = format!("lanecast convert {}, spacing {:e}", args.scene.scene, found.grid.spacing);
    write_mesh(&args.file, kind, &found.mesh, &comment)?;
    let report = MeshReport {
        scene: &args.scene.scene,
        output: &args.file,
        triangles: found.mesh.triangles.len(),
        vertices: found.mesh.positions.len(),
        volume: found.mesh.volume(),
        cells: found.grid.cells,
        spacing: found.grid.spacing,
        tolerance: fineness.tolerance,
        distance_of_vertices: found.at_vertices,
        distance_of_middles: found.at_middles,
        unresolved: found.unresolved,
    };
    if found.unresolved > 0 {
        let count = found.unresolved;
        args.output.detail(&format!("{count} parts are thinner along a line of the grid than its cells"));
    }
    if args.output.json {
        return json_to_stdout(&report);
    }
    let [x, y, z] = report.cells;
    to_stdout(&format!(
        "{}\n\
         triangles {}, vertices {}\n\
         volume    {:.6e}\n\
         grid      {x} x {y} x {z} cells of {:.6e}\n\
         distance  {:.3e} of vertices, {:.3e} of middles of facets, tolerance {:.3e}\n",
        args.file.display(),
        report.triangles,
        report.vertices,
        report.volume,
        report.spacing,
        report.distance_of_vertices,
        report.distance_of_middles,
        report.tolerance,
    ))
}

fn grid(args: &ConvertArgs, solids: &Solids, fineness: &Fineness) -> Result<()> {
    let side = (solids.hi - solids.lo).max_element();
    let half_diagonal = 0.5 * 3.0_f64.sqrt();
    let spacing = args.cells.map_or(fineness.tolerance / half_diagonal, |n| side / f64::from(n));
    let found = voxels(solids, spacing, fineness)?;
    npy::write_voxels(&args.file, found.size, &found.inside)?;
    let inside = found.inside.iter().map(|&flag| u64::from(flag)).sum::<u64>();
    let [nx, ny, nz] = found.size;
    let report = VoxelReport {
        scene: &args.scene.scene,
        output: &args.file,
        shape: [nz, ny, nx],
        origin: found.origin.to_array(),
        spacing,
        inside,
        volume: inside as f64 * spacing.powi(3),
    };
    if args.output.json {
        return json_to_stdout(&report);
    }
    let [x, y, z] = report.origin;
    to_stdout(&format!(
        "{}\n\
         shape     {nz} x {ny} x {nx} (z, y, x)\n\
         origin    {x:.9e} {y:.9e} {z:.9e}, the middle of voxel 0 0 0\n\
         spacing   {spacing:.9e}\n\
         inside    {inside}, volume {:.6e}\n",
        args.file.display(),
        report.volume,
    ))
}
