//! How far a mesh and a surface are apart.

use std::collections::HashSet;

use glam::DVec3;
use rayon::prelude::*;

use super::lines::{Line, Tracer};
use super::samples::Samples;
use super::weave::Net;
use crate::scene::world::World;

/// Points measured together.
const CHUNK: usize = 4096;
/// How far lines pass beside a point, as a share of the distance that is near enough.
const BESIDE: f64 = 0.25;
/// Cells around a point in which the nearest triangle is looked for.
const AROUND: usize = 2;

/// Largest distances, scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Of points of the mesh from the surface: its vertices, middles of diagonals and triangles. Measured along up to
    /// four lines through each point, so the true ones are not larger.
    pub mesh: f64,
    /// Of points of the surface from the mesh: where the lines of the grid cross it.
    pub solid: f64,
}

impl Distances {
    /// The larger ones.
    pub fn max(self, o: Self) -> Self {
        Self { mesh: self.mesh.max(o.mesh), solid: self.solid.max(o.solid) }
    }

    /// The largest.
    pub fn largest(&self) -> f64 {
        self.mesh.max(self.solid)
    }
}

/// A point, and the direction in which the surface is looked for first.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Where.
    pub point: DVec3,
    /// Unit normal of the surface nearby.
    pub normal: DVec3,
}

/// Distances of points from the surface, looked for up to `reach` away: first along the normals; where that gave more
/// than `enough`, along other lines, and along lines beside the point, which its distance from them is added to: a
/// line that is to meet a corner may just miss it.
pub fn distances(world: &World<f64>, probes: &[Probe], reach: f64, enough: f64) -> Vec<f64> {
    let mut tracer = Tracer::default();
    let mut found = vec![reach; probes.len()];
    let mut look = |found: &mut [f64], beside: f64, line: &dyn Fn(&Probe) -> (DVec3, DVec3)| {
        let far: Vec<usize> = (0..probes.len()).filter(|&i| found[i] > enough).collect();
        let lines = far.iter().map(|&i| line(&probes[i])).map(|(point, dir)| Line::through(point, dir, reach));
        let lines: Vec<Line> = lines.collect();
        for (&i, crossing) in far.iter().zip(tracer.nearest(world, &lines)) {
            let away = crossing.map_or(reach, |c| beside + (c.t - reach).abs());
            found[i] = found[i].min(away);
        }
    };
    look(&mut found, 0.0, &|p| (p.point, p.normal));
    for axis in DVec3::AXES {
        look(&mut found, 0.0, &|p| (p.point, axis));
    }
    let beside = BESIDE * enough;
    for i in 0..6 {
        let step = DVec3::AXES[i % 3] * if i < 3 { beside } else { -beside };
        for axis in DVec3::AXES {
            look(&mut found, beside, &|p| (p.point + step, axis));
        }
    }
    found
}

/// The largest of [`distances`], on all threads.
pub fn all_distances(world: &World<f64>, probes: &[Probe], reach: f64, enough: f64) -> f64 {
    let largest = |probes: &[Probe]| distances(world, probes, reach, enough).into_iter().fold(0.0, f64::max);
    probes.par_chunks(CHUNK).map(largest).reduce(|| 0.0, f64::max)
}

/// The largest distance of `points` of the surface from the triangles nearby.
pub fn from_mesh(samples: &Samples, net: &Net, positions: &[DVec3], triangles: &[[u32; 3]], points: &[DVec3]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
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
    let grid = &samples.grid;
    let away = |point: &DVec3| {
        let Some(at) = grid.cell_at(*point) else { return 0.0 };
        let mut list = HashSet::new();
        let side = 2 * AROUND + 1;
        for i in 0..side.pow(3) {
            // Numbers of cells on the way round the grid's lower end are too large for it.
            let near = [i % side, i / side % side, i / side / side];
            let near = [0, 1, 2].map(|axis| (at[axis] + near[axis]).wrapping_sub(AROUND));
            if near.iter().zip(grid.cells).any(|(&n, count)| n >= count) {
                continue;
            }
            let Some(cell) = net.cell(grid.corner(near)) else { continue };
            for v in cell.first..cell.first + u32::from(cell.count) {
                list.extend(&of[starts[v as usize] as usize..starts[v as usize + 1] as usize]);
            }
        }
        let distance = |i: &u32| from_triangle(*point, triangles[*i as usize].map(|v| positions[v as usize]));
        list.iter().map(distance).fold(AROUND as f64 * grid.spacing, f64::min)
    };
    points.par_iter().map(away).reduce(|| 0.0, f64::max)
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
