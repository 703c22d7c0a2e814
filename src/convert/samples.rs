//! What a grid knows of the solids: which corners are inside, and where its edges meet the surface.
//!
//! Corners are decided by the lines along x alone. An edge whose ends differ has a crossing in any case: the one of
//! its line that turns the right way and is nearest to the edge. So the surface is closed, whatever rounding says
//! about lines that graze it. Planes of lines are traced one by one; nothing is kept but what the surface needs.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::grid::Grid;
use super::lines::{Crossing, Line, Tracer};
use super::rows::{Rows, changes, differences};
use super::watch::Watch;
use crate::error::Result;
use crate::scene::world::World;

/// Where an edge of the grid meets the surface.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Number of the edge: its lower corner's, plus the number of corners times its axis.
    pub edge: u64,
    /// Whether the edge enters: its upper corner is the one inside.
    pub enters: bool,
    /// Where, world space.
    pub point: DVec3,
    /// Unit normal, outward.
    pub normal: DVec3,
}

/// Rows of corners and the crossings of all edges whose ends differ.
#[derive(Debug)]
pub struct Samples {
    /// The grid.
    pub grid: Grid,
    /// Which corners are inside.
    pub rows: Rows,
    /// In order of their edges.
    pub meetings: Vec<Meeting>,
    /// Points of the surface that no edge stands for: the line goes in and out, or out and in, between two corners.
    pub loose: Vec<DVec3>,
}

/// What the lines of one plane gave.
#[derive(Default)]
struct Sheet {
    meetings: Vec<Meeting>,
    loose: Vec<DVec3>,
    /// Changes of each row, for lines along x.
    rows: Vec<Vec<u32>>,
}

impl Samples {
    /// Traces all lines of `grid`. `afford` is told how many crossed edges are known of, more and more.
    ///
    /// # Errors
    /// Those of `afford` and `watch`.
    pub fn new(
        world: &World<f64>,
        grid: Grid,
        afford: &(dyn Fn(u64) -> Result<()> + Sync),
        watch: &Watch<'_>,
    ) -> Result<Self> {
        let [_, ny, nz] = grid.corners();
        (watch.more)((2 * nz + ny) as u64);
        let known = AtomicU64::new(0);
        let along_x = |z| {
            watch.next()?;
            let sheet = sheet_x(world, &grid, z);
            let count = sheet.meetings.len() as u64;
            afford(known.fetch_add(count, Ordering::Relaxed) + count)?;
            Ok(sheet)
        };
        let mut sheets = (0..nz).into_par_iter().map(along_x).collect::<Result<Vec<_>>>()?;
        let rows = Rows::new(&grid, sheets.iter().flat_map(|s| s.rows.iter().map(Vec::as_slice)));
        let along_x: usize = sheets.iter().map(|s| s.meetings.len()).sum();
        afford(along_x as u64 + crossed(&rows, &grid))?;
        let along_y = |z| watch.next().map(|()| sheet(world, &grid, &rows, 1, z));
        let along_z = |y| watch.next().map(|()| sheet(world, &grid, &rows, 2, y));
        sheets.extend((0..nz).into_par_iter().map(along_y).collect::<Result<Vec<_>>>()?);
        sheets.extend((0..ny).into_par_iter().map(along_z).collect::<Result<Vec<_>>>()?);
        let (mut meetings, mut loose) = (Vec::new(), Vec::new());
        for sheet in sheets {
            meetings.extend(sheet.meetings);
            loose.extend(sheet.loose);
        }
        meetings.sort_unstable_by_key(|m| m.edge);
        Ok(Self { grid, rows, meetings, loose })
    }

    /// The crossing of an edge whose ends differ.
    pub fn meeting(&self, edge: u64) -> Option<&Meeting> {
        self.meetings.binary_search_by_key(&edge, |m| m.edge).ok().map(|i| &self.meetings[i])
    }
}

/// The rows alone.
///
/// # Errors
/// Those of `watch`.
pub fn rows_of(world: &World<f64>, grid: &Grid, watch: &Watch<'_>) -> Result<Rows> {
    let nz = grid.corners()[2];
    (watch.more)(nz as u64);
    let rows = |z| watch.next().map(|()| sheet_x(world, grid, z).rows);
    let planes = (0..nz).into_par_iter().map(rows).collect::<Result<Vec<_>>>()?;
    Ok(Rows::new(grid, planes.iter().flatten().map(Vec::as_slice)))
}

/// Number of edges along y and z whose ends differ.
pub fn crossed(rows: &Rows, grid: &Grid) -> u64 {
    let [_, ny, nz] = grid.corners();
    let count = |a: &[u32], b: &[u32]| differences(a, b).iter().map(|d| u64::from(d.x.end - d.x.start)).sum::<u64>();
    let of = |z: usize| {
        let along_y: u64 = (1..ny).map(|y| count(rows.row(y - 1, z), rows.row(y, z))).sum();
        let along_z: u64 = if z > 0 { (0..ny).map(|y| count(rows.row(y, z - 1), rows.row(y, z))).sum() } else { 0 };
        along_y + along_z
    };
    (0..nz).into_par_iter().map(of).sum()
}

/// The line along `axis` through the corner `at`, one cell longer at both ends: corner i is at (i + 1) spacing.
pub fn grid_line(grid: &Grid, axis: usize, mut at: [usize; 3]) -> Line {
    at[axis] = 0;
    let dir = DVec3::AXES[axis];
    let length = (grid.cells[axis] + 2) as f64 * grid.spacing;
    Line { org: grid.position(at) - dir * grid.spacing, dir, length }
}

/// The lines along x of plane `z`. Outermost corners stay outside: all solids are within the grid.
fn sheet_x(world: &World<f64>, grid: &Grid, z: usize) -> Sheet {
    let [nx, ny, nz] = grid.corners();
    let mut sheet = Sheet { rows: vec![Vec::new(); ny], ..Sheet::default() };
    if z == 0 || z == nz - 1 {
        return sheet;
    }
    let lines: Vec<Line> = (1..ny - 1).map(|y| grid_line(grid, 0, [0, y, z])).collect();
    Tracer::default().each(world, &lines, |i, found| {
        let row = changes(found, grid.spacing, nx);
        let needed = row.iter().enumerate().map(|(k, &x)| (x as usize - 1, k % 2 == 0));
        sheet.take(grid, &lines[i], found, (0, [0, i + 1, z]), needed);
        sheet.rows[i + 1] = row;
    });
    sheet
}

/// The lines along `axis`, 1 or 2, whose corners have the number `level` on the third axis, which is not x.
fn sheet(world: &World<f64>, grid: &Grid, rows: &Rows, axis: usize, level: usize) -> Sheet {
    let corners = grid.corners();
    let mut sheet = Sheet::default();
    if level == 0 || level == corners[3 - axis] - 1 {
        return sheet;
    }
    let at = |step: usize| if axis == 1 { (step, level) } else { (level, step) };
    // Crossed edges: of which line, which edge of it, whether it enters.
    let mut needed: Vec<(u32, u32, bool)> = Vec::new();
    for step in 0..corners[axis] - 1 {
        let [(y, z), (next_y, next_z)] = [at(step), at(step + 1)];
        for difference in differences(rows.row(y, z), rows.row(next_y, next_z)) {
            needed.extend(difference.x.map(|x| (x, step as u32, difference.enters)));
        }
    }
    needed.sort_unstable();
    let place = |x: usize| if axis == 1 { [x, 0, level] } else { [x, level, 0] };
    let lines: Vec<Line> = (1..corners[0] - 1).map(|x| grid_line(grid, axis, place(x))).collect();
    Tracer::default().each(world, &lines, |i, found| {
        let of_line =
            needed.partition_point(|n| (n.0 as usize) < i + 1)..needed.partition_point(|n| n.0 as usize <= i + 1);
        let of_line = needed[of_line].iter().map(|n| (n.1 as usize, n.2));
        sheet.take(grid, &lines[i], found, (axis, place(i + 1)), of_line);
    });
    sheet
}

impl Sheet {
    /// The meetings of the edges that a line needs, and the crossings that none stands for.
    fn take(
        &mut self,
        grid: &Grid,
        line: &Line,
        found: &[Crossing],
        (axis, mut at): (usize, [usize; 3]),
        needed: impl Iterator<Item = (usize, bool)>,
    ) {
        for (step, enters) in needed {
            at[axis] = step;
            let edge = grid.corner(at) + axis as u64 * grid.corner_count();
            self.meetings.push(meeting(grid, line, found, axis, (step, edge), enters));
        }
        let cell = |c: &Crossing| (c.t / grid.spacing).floor();
        for pair in found.windows(2).filter(|pair| cell(&pair[0]) == cell(&pair[1])) {
            self.loose.extend(pair.iter().map(|c| line.org + line.dir * c.t));
        }
    }
}

/// The crossing nearest to the edge that enters or leaves as its ends do, moved onto the edge.
fn meeting(
    grid: &Grid,
    line: &Line,
    found: &[Crossing],
    axis: usize,
    (step, edge): (usize, u64),
    enters: bool,
) -> Meeting {
    let (low, high) = ((step + 1) as f64 * grid.spacing, (step + 2) as f64 * grid.spacing);
    let away = |c: &Crossing| (low - c.t).max(c.t - high).max(0.0);
    let best = found.iter().filter(|c| c.enters == enters).min_by(|a, b| away(a).total_cmp(&away(b)));
    // Without any crossing the line only grazes the surface: then the middle of the edge is as good as any point on
    // it.
    let facing = if enters { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
    let (t, normal) = best.map_or((0.5 * (low + high), facing), |c| (c.t.clamp(low, high), c.normal));
    let normal = if normal == DVec3::ZERO { facing } else { normal };
    Meeting { edge, enters, point: line.org + line.dir * t, normal }
}
