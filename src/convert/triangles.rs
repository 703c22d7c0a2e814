//! Quadrilaterals into triangles.

use glam::DVec3;
use rayon::prelude::*;

use super::check::area;
use super::measure::{Probe, distances};
use super::nearby::from_triangle;
use super::samples::{Meeting, Samples};
use super::vertices::Vertex;
use super::watch::Watch;
use super::weave::Net;
use crate::error::Result;
use crate::scene::world::World;

/// Quadrilaterals cut together.
const CHUNK: usize = 2048;
/// Triangles whose area is below this share of a cell's face have none.
const NO_AREA: f64 = 1e-9;
/// Triangles that turn away more (see [`turned`]) are turned over.
const OVER: f64 = 1.9;
/// First step, in cells, of a vertex that makes a triangle without area.
const NUDGE: f64 = 1e-4;
/// Steps of such vertices before giving up; each is twice as long as the one before.
const NUDGES: i32 = 8;

/// What became of quadrilaterals.
#[derive(Default)]
pub struct Cut {
    /// Two for each.
    pub triangles: Vec<[u32; 3]>,
    /// The largest distance from the surface of a triangle's middle or the middle of a diagonal.
    pub distance: f64,
    /// Crossings that are not near their own triangles.
    pub far: Vec<DVec3>,
}

/// Cuts each quadrilateral along the diagonal whose middle is nearer to the surface: along an edge, not across it.
/// `enough`: distances that are not worth a second look.
///
/// # Errors
/// Those of `watch`.
pub fn cut(
    world: &World<f64>,
    samples: &Samples,
    net: &Net,
    positions: &[DVec3],
    enough: f64,
    watch: &Watch<'_>,
) -> Result<Cut> {
    let spacing = samples.grid.spacing;
    (watch.more)(net.quads.len().div_ceil(CHUNK) as u64);
    let chunk = |(quads, meetings): (&[[u32; 4]], &[Meeting])| {
        watch.next()?;
        Ok(cut_some(world, quads, meetings, positions, spacing, enough))
    };
    let work = net.quads.par_chunks(CHUNK).zip(samples.meetings.par_chunks(CHUNK));
    let mut all = Cut::default();
    for cut in work.map(chunk).collect::<Result<Vec<_>>>()? {
        all.triangles.extend(cut.triangles);
        all.distance = all.distance.max(cut.distance);
        all.far.extend(cut.far);
    }
    Ok(all)
}

fn cut_some(
    world: &World<f64>,
    quads: &[[u32; 4]],
    meetings: &[Meeting],
    positions: &[DVec3],
    spacing: f64,
    enough: f64,
) -> Cut {
    let place = |i: u32| positions[i as usize];
    let mut middles = Vec::with_capacity(2 * quads.len());
    for (quad, Meeting { normal, .. }) in quads.iter().zip(meetings) {
        let [a, b, c, d] = quad.map(place);
        middles.extend([0.5 * (a + c), 0.5 * (b + d)].map(|point| Probe { point, normal: *normal }));
    }
    let of_middles = distances(world, &middles, 2.0 * spacing, enough);
    let mut found = Cut::default();
    let mut inner = Vec::with_capacity(2 * quads.len());
    for ((quad, meeting), away) in quads.iter().zip(meetings).zip(of_middles.chunks_exact(2)) {
        let [a, b, c, d] = *quad;
        let ways = [[[a, b, c], [a, c, d]], [[b, c, d], [b, d, a]]];
        let cost = |way: usize| {
            let corners = ways[way].map(|t| t.map(place));
            let flat = corners.iter().any(|t| area(*t) < NO_AREA * spacing * spacing);
            let turned = corners.iter().map(|t| turned(*t, meeting.normal)).fold(0.0, f64::max);
            // Distances within a hundredth of what is asked for are the same.
            (flat, turned > OVER, away[way].max(0.01 * enough), turned)
        };
        let way = usize::from(cost(1) < cost(0));
        found.distance = found.distance.max(away[way]);
        let corners = ways[way].map(|t| t.map(place));
        if corners.iter().all(|t| from_triangle(meeting.point, *t) > enough) {
            found.far.push(meeting.point);
        }
        inner.extend(corners.map(|[a, b, c]| Probe { point: (a + b + c) / 3.0, normal: meeting.normal }));
        found.triangles.extend(ways[way]);
    }
    let of_inner = distances(world, &inner, 2.0 * spacing, enough);
    found.distance = of_inner.into_iter().fold(found.distance, f64::max);
    found
}

/// How far a triangle's normal turns away: 0 if it is `normal`, 2 if it is the opposite.
fn turned([a, b, c]: [DVec3; 3], normal: DVec3) -> f64 {
    1.0 - (b - a).cross(c - a).normalize_or_zero().dot(normal)
}

/// Moves vertices that make triangles without area, by as little as helps. Gives the longest way moved.
pub fn mend(vertices: &mut [Vertex], triangles: &[[u32; 3]], positions: &mut [DVec3], spacing: f64) -> f64 {
    let mut longest = 0.0;
    for round in 0..NUDGES {
        let flat = |t: &&[u32; 3]| area(t.map(|v| positions[v as usize])) < NO_AREA * spacing * spacing;
        let mut moved: Vec<u32> =
            triangles.iter().filter(flat).map(|t| t[middle_one(t.map(|v| positions[v as usize]))]).collect();
        if moved.is_empty() {
            break;
        }
        moved.sort_unstable();
        moved.dedup();
        let step = NUDGE * spacing * 2f64.powi(round);
        for v in moved {
            let vertex = &mut vertices[v as usize];
            // Any direction does; neighbours should not take the same.
            let (sin, cos) = (f64::from(v) * 2.399_963).sin_cos();
            let (x, y) = vertex.normal.any_orthonormal_pair();
            vertex.position += step * (0.6 * (x * cos + y * sin) - 0.8 * vertex.normal);
            positions[v as usize] = vertex.position.as_vec3().as_dvec3();
            longest = f64::max(longest, 2.0 * step);
        }
    }
    longest
}

/// The corner opposite to the longest side.
fn middle_one([a, b, c]: [DVec3; 3]) -> usize {
    let sides = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
    (0..3).fold(0, |best, i| if sides[i] > sides[best] { i } else { best })
}
