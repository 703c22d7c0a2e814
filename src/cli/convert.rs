//! `lanecast convert`: solids as a closed mesh or as voxels; meshes in another format.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::common::{OutputArgs, SceneArgs, ThreadArgs, with_pool};
use super::interrupt::stopped;
use super::output::{json_to_stdout, to_stdout};
use crate::convert::{Distances, Fineness, Grid, Placed, Solids, Topology, Voxels, Wanted, Watch, surface, voxels};
use crate::error::{Error, Result};
use crate::film::mesh::{MeshKind, write_mesh};
use crate::film::{check_apart, check_file, npy};
use crate::scene::mesh::Mesh;

/// Tolerance unless `--tolerance` says otherwise: this part of the box's diagonal.
const DEFAULT_TOLERANCE: f64 = 1.0 / 256.0;
/// Steps of the last digit that solids must be wide: as many as the first grid has cells.
const FEWEST_DIGITS: f64 = 16.0;

const EXAMPLES: &str = "\
Examples:
  lanecast convert builtin:bolt --solid bolt -o bolt.stl
  lanecast convert builtin:die --solid first -o die.obj --tolerance 0.002
  lanecast convert builtin:rook --solid \"white rook\" -o rook.ply --cells 200
  lanecast convert builtin:bolt --solid plate -o plate.npy --voxels 256 --json
  lanecast convert builtin:bolt --solid bolt -o blocks.ply --voxels 64
  lanecast convert moss.asc --top all.g -o moss.stl
  lanecast render bolt.stl -o bolt.png          the mesh, to compare with the solid
  lanecast convert model.ply -o model.stl       triangles as they are, in another format

What is converted: trees of solids (union, intersection, difference, xor), spheres, boxes, cylinders and cones, all \
of them together as one solid; with --solid only those trees and `define`s. Loose meshes and discs have no inside \
and are left out; planes have no bounds and are refused, so scenes with a ground plane want --solid.

A scene of nothing but meshes is written as it is, without --solid, --tolerance, --cells and --voxels: all triangles, \
those of instances in their places, as positions only (no normals, texture coordinates or materials), closed or not.

A mesh of solids is closed and a manifold, which is checked before it is written: every edge is in two triangles. Edges and \
corners stay sharp. The first grid has cells of four times the tolerance (16 to 64 along the longest side); they are \
halved until no distance measured between mesh and solid, either way, is larger than the tolerance; the largest ones \
are printed. Parts thinner than a cell can be missed: a smaller --tolerance or more --cells finds them. Vertices are \
written as f32.

Voxels (.npy) are u1 flags of shape (nz, ny, nx), 1 where the voxel's middle is inside; origin (the middle of voxel \
0 0 0) and spacing are printed. The tolerance is half a voxel's diagonal. With --voxels, .stl, .obj and .ply get the \
outer faces of the voxels inside, as a closed mesh: the same voxels as a picture.

docs/CONVERT.md compares ray-traced CSG, its mesh and its voxels in pictures and in a table.";

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
    /// Largest distance from the true surface, scene units [default: 1/256 of the diagonal of the solids' box, or what f32
    /// tells apart where they are]
    #[arg(long, value_name = "LENGTH", conflicts_with_all = ["cells", "voxels"])]
    tolerance: Option<f64>,
    /// Cells along the longest side, instead of a tolerance: a mesh from one grid
    #[arg(long, value_name = "N", conflicts_with = "voxels", value_parser = clap::value_parser!(u32).range(1..=60_000))]
    cells: Option<u32>,
    /// Voxels along the longest side; .stl, .obj and .ply get their outer faces
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=60_000))]
    voxels: Option<u32>,
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
    area: f64,
    euler: i64,
    shells: usize,
    cells: [usize; 3],
    spacing: f64,
    tolerance: f64,
    /// Largest distances between mesh and solid, scene units; voxels have none measured.
    distance_of_mesh: Option<f64>,
    distance_of_solid: Option<f64>,
}

/// The object of `--json` for meshes that are written as they are.
#[derive(Serialize)]
struct PlacedReport<'a> {
    scene: &'a str,
    output: &'a Path,
    /// Meshes placed, also of the same one.
    meshes: usize,
    triangles: usize,
    vertices: usize,
    area: f64,
}

/// The object of `--json` for voxels.
#[derive(Serialize)]
struct VoxelReport<'a> {
    scene: &'a str,
    output: &'a Path,
    shape: [usize; 3],
    origin: [f64; 3],
    spacing: f64,
    tolerance: f64,
    inside: u64,
    volume: f64,
}

/// Runs `lanecast convert`.
///
/// # Errors
/// Bad input, solids without bounds, too little memory, files that cannot be written; [`Error::Interrupted`].
pub fn run(args: &ConvertArgs) -> Result<()> {
    let kind = MeshKind::of(&args.file);
    let is_npy = args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    if kind.is_none() && !is_npy {
        let file = args.file.display();
        return Err(Error::Usage(format!("-o {file}: expected a name that ends in .stl, .obj, .ply or .npy")));
    }
    if is_npy && args.cells.is_some() {
        return Err(Error::Usage("--cells is for meshes; voxels want --voxels or --tolerance".into()));
    }
    check_file(&args.file)?;
    check_apart(&args.file, &[Path::new(&args.scene.scene)])?;
    let description = args.scene.load(&args.output)?;
    check_apart(&args.file, &description.inputs())?;
    let as_it_is = args.solid.is_empty() && args.tolerance.is_none() && args.cells.is_none() && args.voxels.is_none();
    if let Some(kind) = kind.filter(|_| as_it_is)
        && let Some(found) = Placed::new(&description, args.memory.saturating_mul(1 << 20))?
    {
        return placed(args, kind, &found);
    }
    with_pool(args.threads.count(), || {
        let solids = Solids::new(&description, &args.solid)?;
        if solids.left_out > 0 {
            args.output.say(&format!("warning: {} meshes and discs have no inside and are left out", solids.left_out));
        }
        let side = (solids.hi - solids.lo).max_element();
        let tolerance = tolerance(args, &solids, kind.is_some())?;
        let fineness = Fineness { tolerance, cells: args.cells, memory: args.memory.saturating_mul(1 << 20) };
        let bar = args.output.progress_bar(0, "converting");
        let watch = Watch { stop: &stopped, more: &|steps| bar.inc_length(steps), step: &|| bar.inc(1) };
        let spacing = args.voxels.map_or(voxels::spacing_for(tolerance), |n| side / f64::from(n));
        match kind {
            Some(kind) if args.voxels.is_none() => {
                let found = surface(&solids, &fineness, &watch)?;
                bar.finish_and_clear();
                let made = Made { grid: found.grid, topology: found.topology, distances: Some(found.distances) };
                mesh(args, kind, &found.mesh, &made, tolerance)
            }
            Some(kind) => {
                let found = Voxels::new(&solids, spacing, Wanted::Faces, &fineness, &watch)?;
                let grid = Grid { origin: found.origin, spacing, cells: found.size };
                let (faces, topology) = found.mesh(&fineness)?;
                bar.finish_and_clear();
                let made = Made { grid, topology, distances: None };
                mesh(args, kind, &faces, &made, voxels::tolerance_of(spacing))
            }
            None => {
                let found = Voxels::new(&solids, spacing, Wanted::Flags, &fineness, &watch)?;
                bar.finish_and_clear();
                flags(args, &found)
            }
        }
    })
}

/// The tolerance, given or not. Where vertices are written, the digits of `f32` must tell them apart: that bounds what was
/// asked for, whether it is a tolerance, cells or voxels. Flags are computed in `f64`.
fn tolerance(args: &ConvertArgs, solids: &Solids, has_vertices: bool) -> Result<f64> {
    let fail = |what: String| Err(Error::Usage(what));
    let (epsilon, name) = if has_vertices { (f64::from(f32::EPSILON), "f32") } else { (f64::EPSILON, "f64") };
    let extent = solids.lo.abs().max(solids.hi.abs()).max_element();
    let (side, digit) = ((solids.hi - solids.lo).max_element(), epsilon * extent);
    if let Some(tolerance) = args.tolerance.filter(|x| !(*x >= 2.0 * digit && x.is_finite())) {
        return fail(format!("--tolerance: expected a number of at least {:e}, found {tolerance}", 2.0 * digit));
    }
    if side < FEWEST_DIGITS * digit {
        let what = format!("the solids are {side:e} wide, but their coordinates go to {extent:e}");
        return fail(format!("{what}: the digits of {name} do not tell them apart; move them to the origin"));
    }
    let counts = [("--cells", args.cells), ("--voxels", args.voxels)];
    for (option, count) in counts.into_iter().filter_map(|(option, count)| Some((option, count?))) {
        let most = side / digit;
        if f64::from(count) > most {
            let what = format!("{option} {count}: finer than the digits of {name} where the solids are");
            return fail(format!("{what}; expected at most {}", most.floor()));
        }
    }
    let default = DEFAULT_TOLERANCE * (solids.hi - solids.lo).length();
    Ok(args.tolerance.unwrap_or(default.max(2.0 * digit)))
}

/// How a mesh was made.
struct Made {
    grid: Grid,
    topology: Topology,
    distances: Option<Distances>,
}

fn placed(args: &ConvertArgs, kind: MeshKind, found: &Placed) -> Result<()> {
    let Placed { mesh, meshes } = found;
    write_mesh(&args.file, kind, mesh, &format!("lanecast convert {}", args.scene.scene))?;
    let report = PlacedReport {
        scene: &args.scene.scene,
        output: &args.file,
        meshes: *meshes,
        triangles: mesh.triangles.len(),
        vertices: mesh.positions.len(),
        area: mesh.area(),
    };
    if args.output.json {
        return json_to_stdout(&report);
    }
    let PlacedReport { triangles, vertices, area, .. } = report;
    let name = args.file.display();
    to_stdout(&format!("{name}\ntriangles {triangles}, vertices {vertices}; of {meshes} meshes, area {area:.6e}\n"))
}

fn mesh(args: &ConvertArgs, kind: MeshKind, mesh: &Mesh, made: &Made, tolerance: f64) -> Result<()> {
    let comment = format!("lanecast convert {}, spacing {:e}", args.scene.scene, made.grid.spacing);
    write_mesh(&args.file, kind, mesh, &comment)?;
    let report = MeshReport {
        scene: &args.scene.scene,
        output: &args.file,
        triangles: mesh.triangles.len(),
        vertices: mesh.positions.len(),
        volume: mesh.volume(),
        area: mesh.area(),
        euler: made.topology.euler,
        shells: made.topology.shells,
        cells: made.grid.cells,
        spacing: made.grid.spacing,
        tolerance,
        distance_of_mesh: made.distances.map(|d| d.mesh),
        distance_of_solid: made.distances.map(|d| d.solid),
    };
    // Who asks for cells asks for no tolerance: a grid may be as coarse as it is, and is off by less than a cell.
    let (limit, name) = if args.cells.is_some() { (report.spacing, "a cell") } else { (tolerance, "the tolerance") };
    if made.distances.is_some_and(|d| d.largest() > limit) {
        args.output.say(&format!("warning: the distance is larger than {name}: some parts are thinner than a cell"));
    }
    if args.output.json {
        return json_to_stdout(&report);
    }
    let [x, y, z] = report.cells;
    let distance = made.distances.map_or_else(String::new, |d| {
        format!(
            "distance  {:.3e} of mesh from solid, {:.3e} of solid from mesh; tolerance {tolerance:.3e}\n",
            d.mesh, d.solid
        )
    });
    to_stdout(&format!(
        "{}\n\
         triangles {}, vertices {}; closed, {} shells, Euler characteristic {}\n\
         volume    {:.6e}, area {:.6e}\n\
         grid      {x} x {y} x {z} cells of {:.6e}\n\
         {distance}",
        args.file.display(),
        report.triangles,
        report.vertices,
        report.shells,
        report.euler,
        report.volume,
        report.area,
        report.spacing,
    ))
}

fn flags(args: &ConvertArgs, found: &Voxels) -> Result<()> {
    let [nx, ny, nz] = found.size;
    npy::write_voxels(&args.file, [nx, ny], found.planes())?;
    let (spacing, inside) = (found.spacing, found.count());
    let report = VoxelReport {
        scene: &args.scene.scene,
        output: &args.file,
        shape: [nz, ny, nx],
        origin: found.origin.to_array(),
        spacing,
        tolerance: voxels::tolerance_of(spacing),
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
