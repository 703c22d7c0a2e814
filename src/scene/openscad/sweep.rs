//! What a figure leaves behind that moves, turns and grows: rings of its corners, walls between rings, ends.

use glam::{DVec2, DVec3};

use super::cover::covered;
use super::flat::Flat;
use super::work::Work;
use crate::scene::mesh::Mesh;
use crate::scene::solids::flat::closed;

/// A figure to be moved, and where it has been.
pub(super) struct Sweep {
    /// Number of the first corner of each contour in a ring, and the one after its last.
    ranges: Vec<[u32; 2]>,
    /// Whether a contour is that of a hole.
    is_hole: Vec<bool>,
    /// Corners of the figure.
    pub points: Vec<DVec2>,
    /// Triangles that cover it, counter-clockwise.
    pub cover: Vec<[u32; 3]>,
    mesh: Mesh,
}

impl Sweep {
    /// Of `flat`, which will be in `rings` places; `is_open`: with ends.
    ///
    /// # Errors
    /// Too many triangles, too much work.
    pub fn new(flat: &Flat, rings: usize, is_open: bool, work: &mut Work) -> Result<Self, String> {
        let mut ranges = Vec::new();
        let mut points: Vec<DVec2> = Vec::new();
        for contour in flat.contours() {
            let first = points.len() as u32;
            points.extend(contour.iter().map(|&p| DVec2::from(p)));
            ranges.push([first, points.len() as u32]);
        }
        work.triangles(2 * (points.len().saturating_mul(rings)))?;
        let is_hole = flat.shapes.iter().flat_map(|shape| (0..shape.len()).map(|i| i > 0)).collect();
        let mut cover = Vec::new();
        let mut first = 0;
        for shape in flat.shapes.iter().filter(|_| is_open) {
            cover.extend(covered(shape, work)?.into_iter().map(|triangle| triangle.map(|i| first + i)));
            first += shape.iter().map(|contour| contour.len() as u32).sum::<u32>();
        }
        Ok(Self { ranges, is_hole, points, cover, mesh: Mesh::default() })
    }

    /// Puts the figure at the next place.
    pub fn ring(&mut self, place: impl Fn(DVec2) -> DVec3) {
        self.mesh.positions.extend(self.points.iter().map(|&p| place(p)));
    }

    /// Walls from ring `below` to ring `above`. Of the two ways to cut the one between a corner and the next in two,
    /// `is_rising` says whether it is the one from the corner below to the next above: it is given both corners, and
    /// whether they are of a hole.
    pub fn walls(&mut self, [below, above]: [usize; 2], is_rising: impl Fn(DVec2, DVec2, bool) -> bool) {
        let count = self.points.len() as u32;
        let (below, above) = (below as u32 * count, above as u32 * count);
        let Self { ranges, is_hole, points, mesh, .. } = self;
        for (&[first, end], &is_hole) in ranges.iter().zip(&*is_hole) {
            for i in first..end {
                let next = if i + 1 == end { first } else { i + 1 };
                let [a, b, c, d] = [below + i, below + next, above + next, above + i];
                let [p, q] = [i, next].map(|i| points[i as usize]);
                let pair = if is_rising(p, q, is_hole) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                for triangle in pair {
                    push(mesh, triangle);
                }
            }
        }
    }

    /// Covers ring `ring`, seen from before it, or from behind.
    pub fn end(&mut self, ring: usize, is_front: bool) {
        let first = (ring * self.points.len()) as u32;
        let turned = |&[a, b, c]: &[u32; 3]| if is_front { [a, b, c] } else { [a, c, b] };
        self.mesh.triangles.extend(self.cover.iter().map(|triangle| turned(triangle).map(|i| first + i)));
    }

    /// The mesh, turned outwards.
    ///
    /// # Errors
    /// It is not closed: parts of the figure fell together.
    pub fn finish(self) -> Result<Mesh, String> {
        let mut mesh = self.mesh;
        closed(&mesh)?;
        if mesh.volume() < 0.0 {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        Ok(mesh)
    }
}

/// Adds a triangle, unless two of its corners are in one place.
fn push(mesh: &mut Mesh, triangle: [u32; 3]) {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    if a != b && b != c && c != a {
        mesh.triangles.push(triangle);
    }
}
