//! The triangles near a point.

use std::collections::HashSet;

use glam::DVec3;

use super::grid::Grid;
use super::settle::REACH;
use super::weave::Net;

/// Cells around a point in which the nearest triangle is looked for: one more than vertices may be beyond their own.
const AROUND: usize = REACH as usize + 1;

/// The triangles of a net, by their cells.
pub struct Nearby<'a> {
    /// Places of the vertices.
    pub positions: &'a [DVec3],
    /// Numbers of vertices.
    pub triangles: &'a [[u32; 3]],
    grid: &'a Grid,
    net: &'a Net,
    /// First entry of each vertex in `of`.
    starts: Vec<u32>,
    /// The triangles of all vertices.
    of: Vec<u32>,
}

impl<'a> Nearby<'a> {
    /// Sorts triangles by their vertices.
    pub fn new(grid: &'a Grid, net: &'a Net, positions: &'a [DVec3], triangles: &'a [[u32; 3]]) -> Self {
        let mut starts = vec![0u32; positions.len() + 1];
        triangles.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let (mut next, mut of) = (starts.clone(), vec![0u32; 3 * triangles.len()]);
        for (number, triangle) in (0u32..).zip(triangles) {
            for &v in triangle {
                of[next[v as usize] as usize] = number;
                next[v as usize] += 1;
            }
        }
        Self { positions, triangles, grid, net, starts, of }
    }

    /// Distance of a point from the nearest triangle that counts; a few cells if there is none near.
    pub fn distance(&self, point: DVec3, counts: impl Fn(u32) -> bool) -> f64 {
        let Some(at) = self.grid.cell_at(point) else { return 0.0 };
        let mut list = HashSet::new();
        let side = 2 * AROUND + 1;
        for i in 0..side.pow(3) {
            // Numbers of cells on the way round the grid's lower end are too large for it.
            let near = [i % side, i / side % side, i / side / side];
            let near = [0, 1, 2].map(|axis| (at[axis] + near[axis]).wrapping_sub(AROUND));
            if near.iter().zip(self.grid.cells).any(|(&n, count)| n >= count) {
                continue;
            }
            let Some(cell) = self.net.cell(self.grid.corner(near)) else { continue };
            for v in cell.first..cell.first + u32::from(cell.count) {
                list.extend(&self.of[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]);
            }
        }
        let corners = |i: u32| self.triangles[i as usize].map(|v| self.positions[v as usize]);
        let distances = list.into_iter().filter(|&i| counts(i)).map(|i| from_triangle(point, corners(i)));
        distances.fold(AROUND as f64 * self.grid.spacing, f64::min)
    }
}

/// Distance of a point from a triangle.
///
/// Source: C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
pub fn from_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).length();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).length();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / (d4 - d3 + d5 - d6);
        return (bp - (c - b) * w).length();
    }
    let sum = va + vb + vc;
    (ap - ab * (vb / sum) - ac * (vc / sum)).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_and_a_triangle_by_hand() {
        let triangle = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0];
        for (point, want) in [
            ([0.5, 0.5, 3.0], 3.0),
            ([-3.0, -4.0, 0.0], 5.0),
            ([1.0, -1.0, 0.0], 1.0),
            ([-1.0, 1.0, 0.0], 1.0),
            ([2.0, 2.0, 0.0], 2f64.sqrt()),
            ([5.0, -4.0, 0.0], 5.0),
            ([-3.0, 6.0, 0.0], 5.0),
        ] {
            let got = from_triangle(DVec3::from_array(point), triangle);
            assert!((got - want).abs() < 1e-15, "{point:?}: {got}");
        }
    }
}
