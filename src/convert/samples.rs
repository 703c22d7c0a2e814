//! What a grid knows of the solids: which corners are inside, and where its edges meet the surface.
//!
//! Corners are decided by the lines along x alone. An edge whose ends differ has a crossing in any case: the one of
//! its line that turns the right way and is nearest to the edge. So the surface is closed, whatever rounding says
//! about lines that graze it.

use glam::DVec3;
use rayon::prelude::*;

use super::grid::Grid;
use super::lines::{Crossing, Line, crossings, fill};
use crate::scene::world::World;

/// Where an edge of the grid meets the surface.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Number of the edge: its lower corner's, plus the number of corners times its axis.
    pub edge: u64,
    /// Where, world space.
    pub point: DVec3,
    /// Unit normal, outward.
    pub normal: DVec3,
}

/// Flags of all corners and the crossings of all edges whose ends differ.
#[derive(Debug)]
pub struct Samples {
    /// The grid.
    pub grid: Grid,
    /// 1 for corners inside, by [`Grid::corner`].
    pub inside: Vec<u8>,
    /// In order of their edges.
    pub meetings: Vec<Meeting>,
    /// Stretches inside or outside that begin and end between two neighbouring corners: parts of the solid that
    /// the grid is too coarse for.
    pub unresolved: u64,
}

impl Samples {
    /// Traces all lines of `grid`.
    pub fn new(world: &World<f64>, grid: Grid) -> Self {
        let [nx, ny, nz] = grid.corners();
        let mut inside = vec![0; nx * ny * nz];
        let plane = nx * ny;
        inside.par_chunks_mut(plane).enumerate().for_each(|(z, flags)| flag_plane(world, &grid, z, flags));
        let mut samples = Self { grid, inside, meetings: Vec::new(), unresolved: 0 };
        for axis in 0..3 {
            let rows = grid.corners()[(axis + 2) % 3];
            let found: Vec<(Vec<Meeting>, u64)> =
                (0..rows).into_par_iter().map(|row| samples.row(world, axis, row)).collect();
            for (list, unresolved) in found {
                samples.meetings.extend(list);
                samples.unresolved += unresolved;
            }
        }
        samples.meetings.sort_unstable_by_key(|m| m.edge);
        samples
    }

    /// The crossing of an edge whose ends differ.
    pub fn meeting(&self, edge: u64) -> Option<&Meeting> {
        self.meetings.binary_search_by_key(&edge, |m| m.edge).ok().map(|i| &self.meetings[i])
    }

    /// Whether corner `number` is inside.
    pub fn is_inside(&self, number: u64) -> bool {
        self.inside[number as usize] != 0
    }

    /// The meetings of the edges along `axis` whose corners have the number `row` on the second axis after it.
    fn row(&self, world: &World<f64>, axis: usize, row: usize) -> (Vec<Meeting>, u64) {
        let (grid, corners) = (&self.grid, self.grid.corners());
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        let lines: Vec<Line> = (0..corners[second]).map(|i| grid_line(grid, axis, i, row)).collect();
        let (mut list, mut unresolved) = (Vec::new(), 0);
        for (i, found) in crossings(world, &lines).iter().enumerate() {
            let mut at = [0; 3];
            (at[second], at[third]) = (i, row);
            // Distances start one cell before the first corner.
            let cell = |c: &Crossing| (c.t / grid.spacing).floor();
            unresolved += found.windows(2).filter(|pair| cell(&pair[0]) == cell(&pair[1])).count() as u64;
            for step in 0..corners[axis] - 1 {
                at[axis] = step;
                let low = grid.corner(at);
                at[axis] = step + 1;
                let (is, will) = (self.is_inside(low), self.is_inside(grid.corner(at)));
                if is != will {
                    let edge = low + axis as u64 * grid.corner_count();
                    list.push(meeting(grid, &lines[i], found, axis, (step, edge), will));
                }
            }
        }
        (list, unresolved)
    }
}

/// The line along `axis` through corners with numbers `i` and `row` on the axes after it, one cell longer at both
/// ends.
fn grid_line(grid: &Grid, axis: usize, i: usize, row: usize) -> Line {
    let mut at = [0; 3];
    (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (i, row);
    let dir = DVec3::AXES[axis];
    let length = (grid.cells[axis] + 2) as f64 * grid.spacing;
    Line { org: grid.position(at) - dir * grid.spacing, dir, length }
}

/// Flags of the corners of plane `z`. Outermost corners stay outside: all solids are within the grid.
fn flag_plane(world: &World<f64>, grid: &Grid, z: usize, flags: &mut [u8]) {
    let [nx, ny, nz] = grid.corners();
    if z == 0 || z == nz - 1 {
        return;
    }
    let lines: Vec<Line> = (1..ny - 1).map(|y| grid_line(grid, 0, y, z)).collect();
    for (y, found) in crossings(world, &lines).iter().enumerate() {
        let row = &mut flags[nx * (y + 1)..nx * (y + 2)];
        fill(found, grid.spacing, row);
        (row[0], row[nx - 1]) = (0, 0);
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
    Meeting { edge, point: line.org + line.dir * t, normal }
}
