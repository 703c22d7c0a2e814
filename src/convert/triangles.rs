//! Quadrilaterals into triangles, and how far they are from the surface.

use glam::DVec3;

use super::lines::{Line, crossings};
use super::weave::Quads;
use crate::scene::world::World;

/// Quadrilaterals flatter than this share of their size have no better diagonal.
const PLANE: f64 = 1e-9;

/// Triangles, and the largest distances from the surface that were seen. Distances are measured along up to four
/// lines through each point, so the true ones are not larger.
#[derive(Debug)]
pub struct Triangles {
    /// Numbers of vertices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Of a vertex, scene units.
    pub at_vertices: f64,
    /// Of the middle of a quadrilateral that is not flat, scene units.
    pub at_middles: f64,
}

/// Distances of points from the surface, looked for up to `reach` away: first along the lines given, then, where
/// that gave more than `enough`, along the axes.
fn distances(world: &World<f64>, points: &[(DVec3, DVec3)], reach: f64, enough: f64) -> Vec<f64> {
    let along = |(point, dir): (DVec3, DVec3)| Line { org: point - dir * reach, dir, length: 2.0 * reach };
    let nearest = |lines: &[Line]| -> Vec<f64> {
        let near =
            |list: &Vec<_>| list.iter().map(|c: &super::lines::Crossing| (c.t - reach).abs()).fold(reach, f64::min);
        crossings(world, lines).iter().map(near).collect()
    };
    let lines: Vec<Line> = points.iter().map(|(p, n)| along((*p, n.normalize_or(DVec3::Z)))).collect();
    let mut found = nearest(&lines);
    let far: Vec<usize> = (0..points.len()).filter(|&i| found[i] > enough).collect();
    for axis in DVec3::AXES {
        let lines: Vec<Line> = far.iter().map(|&i| along((points[i].0, axis))).collect();
        for (&i, distance) in far.iter().zip(nearest(&lines)) {
            found[i] = found[i].min(distance);
        }
    }
    found
}

/// Cuts each quadrilateral along the diagonal whose middle is nearer to the surface: along an edge, not across it.
pub fn cut(world: &World<f64>, quads: &Quads, spacing: f64, tolerance: f64) -> Triangles {
    let reach = 2.0 * spacing;
    let vertices: Vec<_> = quads.vertices.iter().map(|v| (v.position, v.normal)).collect();
    let at_vertices = distances(world, &vertices, reach, 0.5 * tolerance).into_iter().fold(0.0, f64::max);
    let place = |q: &[u32; 4]| q.map(|v| quads.vertices[v as usize].position);
    let bent: Vec<bool> = quads
        .quads
        .iter()
        .map(|quad| {
            let [a, b, c, d] = place(quad);
            (b - a).dot((c - a).cross(d - a)).abs() > PLANE * spacing.powi(3)
        })
        .collect();
    let mut middles = Vec::new();
    for (i, quad) in quads.quads.iter().enumerate().filter(|(i, _)| bent[*i]) {
        let [a, b, c, d] = place(quad);
        middles.extend([(0.5 * (a + c), quads.normals[i]), (0.5 * (b + d), quads.normals[i])]);
    }
    let found = distances(world, &middles, reach, 0.5 * tolerance);
    let mut of_bent = found.chunks_exact(2);
    let mut cut = Triangles { triangles: Vec::with_capacity(2 * quads.quads.len()), at_vertices, at_middles: 0.0 };
    for (i, quad) in quads.quads.iter().enumerate() {
        let other = match bent[i] {
            // As many pairs as bent quadrilaterals: one is left for each.
            true => of_bent.next().is_some_and(|pair| {
                cut.at_middles = cut.at_middles.max(pair[0].min(pair[1]));
                pair[1] < pair[0]
            }),
            false => folds(place(quad), quads.normals[i]),
        };
        let [a, b, c, d] = *quad;
        cut.triangles.extend(if other { [[b, c, d], [b, d, a]] } else { [[a, b, c], [a, c, d]] });
    }
    cut
}

/// Whether the first diagonal of a flat quadrilateral would turn one of its triangles over.
fn folds([a, b, c, d]: [DVec3; 4], normal: DVec3) -> bool {
    let side = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal);
    side(a, b, c).min(side(a, c, d)) < side(b, c, d).min(side(b, d, a))
}
