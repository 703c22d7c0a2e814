//! How far a mesh and a surface are apart.

use glam::DVec3;
use rayon::prelude::*;

use super::lines::{Line, Tracer};
use crate::scene::world::World;

/// Points measured together.
const CHUNK: usize = 4096;
/// How far lines pass beside a point, as a share of the distance that is near enough.
const BESIDE: f64 = 0.25;

/// Largest distances, scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Of points of the mesh from the surface: its vertices, middles of diagonals and triangles. Measured along up to
    /// four lines through each point, so the true ones are not larger.
    pub mesh: f64,
    /// Of points of the surface from the mesh: where the lines of the grid cross it. What is nearer than half the
    /// tolerance counts as half.
    pub solid: f64,
}

impl Distances {
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
