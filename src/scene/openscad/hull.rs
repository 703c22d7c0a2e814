//! Convex hulls of points in space and in the plane.
//!
//! Source: C. B. Barber, D. P. Dobkin, H. Huhdanpaa, "The Quickhull Algorithm for Convex Hulls", ACM Transactions on
//! Mathematical Software 22(4), 1996. Departures: what is above a face is decided exactly, so faces need no thickness
//! and points in the plane of a face are never above it; in the plane A. M. Andrew's chains ("Another efficient
//! algorithm for convex hulls in two dimensions", Information Processing Letters 9, 1979).

use std::cmp::Ordering;
use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::exact::side;
use super::work::Work;
use crate::scene::mesh::Mesh;

/// Coordinates beyond this overflow where three are multiplied; those below its reciprocal count as 0.
const FARTHEST: f64 = 1e90;

/// Edges, by a face and the corner they begin at.
type Rim = Vec<(u32, usize)>;

/// A face on its way.
struct Face {
    corners: [u32; 3],
    /// The faces beyond the edges from each corner to the next.
    beyond: [u32; 3],
    /// Points above it that no other face has.
    above: Vec<u32>,
    is_left: bool,
}

/// The hull of `points` as a closed mesh of the points that are its corners; `None` if they are in one plane.
///
/// # Errors
/// Coordinates that are too large, too much work.
pub(super) fn hull(points: &[DVec3], work: &mut Work) -> Result<Option<Mesh>, String> {
    if !points.iter().all(|p| p.abs().max_element() <= FARTHEST) {
        return Err(format!("a point of it is farther than {FARTHEST:e} from the origin"));
    }
    let least = |x: f64| if x.abs() < 1.0 / FARTHEST { 0.0 } else { x };
    let points: Vec<DVec3> = points.iter().map(|p| DVec3::from(p.to_array().map(least))).collect();
    let Some(first) = simplex(&points) else { return Ok(None) };
    let mut hull = Hull { points: &points, faces: Vec::new(), waiting: Vec::new() };
    hull.begin(first, work)?;
    while let Some(face) = hull.waiting.pop() {
        if hull.faces[face as usize].is_left && !hull.faces[face as usize].above.is_empty() {
            hull.grow(face, work)?;
        }
    }
    Ok(Some(hull.mesh()))
}

/// Four points that are not in one plane, the last one below the others, which go counter-clockwise.
fn simplex(points: &[DVec3]) -> Option<[u32; 4]> {
    let farthest = |of: &dyn Fn(DVec3) -> f64| {
        let distances = points.iter().map(|&p| of(p));
        distances.zip(0..).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i): (f64, u32)| i)
    };
    let at = |i: u32| points[i as usize];
    let a = farthest(&|p| -p.x)?;
    let b = farthest(&|p| p.distance_squared(at(a)))?;
    let c = farthest(&|p| (p - at(a)).cross(at(b) - at(a)).length_squared())?;
    let normal = (at(b) - at(a)).cross(at(c) - at(a));
    let d = farthest(&|p| (p - at(a)).dot(normal).abs())?;
    match side(at(a), at(b), at(c), at(d)) {
        Ordering::Less => Some([a, b, c, d]),
        Ordering::Greater => Some([a, c, b, d]),
        // Rounding may hide the only one that is off the plane.
        Ordering::Equal => {
            let off = (0..points.len() as u32).find(|&d| side(at(a), at(b), at(c), at(d)) != Ordering::Equal);
            off.map(|d| if side(at(a), at(b), at(c), at(d)) == Ordering::Less { [a, b, c, d] } else { [a, c, b, d] })
        }
    }
}

struct Hull<'p> {
    points: &'p [DVec3],
    faces: Vec<Face>,
    /// Faces that may have points above them.
    waiting: Vec<u32>,
}

impl Hull<'_> {
    fn is_above(&self, [a, b, c]: [u32; 3], point: u32) -> bool {
        let [a, b, c, p] = [a, b, c, point].map(|i| self.points[i as usize]);
        side(a, b, c, p) == Ordering::Greater
    }

    fn begin(&mut self, [a, b, c, d]: [u32; 4], work: &mut Work) -> Result<(), String> {
        let sides = [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])];
        let faces = sides.map(|(corners, beyond)| Face { corners, beyond, above: Vec::new(), is_left: true });
        self.faces.extend(faces);
        self.share((0..self.points.len() as u32).collect(), 0, work)
    }

    /// Gives each of `points` to the first face from number `first` on that it is above; those that are above none are
    /// inside.
    fn share(&mut self, points: Vec<u32>, first: usize, work: &mut Work) -> Result<(), String> {
        for point in points {
            let found = (first..self.faces.len()).find(|&f| self.is_above(self.faces[f].corners, point));
            work.steps(1 + found.map_or(self.faces.len(), |f| f + 1).saturating_sub(first) as u64)?;
            if let Some(face) = found {
                self.faces[face].above.push(point);
            }
        }
        self.waiting.extend(first as u32..self.faces.len() as u32);
        Ok(())
    }

    /// Takes the point farthest above `face` into the hull.
    fn grow(&mut self, face: u32, work: &mut Work) -> Result<(), String> {
        let [a, b, c] = self.faces[face as usize].corners.map(|i| self.points[i as usize]);
        let normal = (b - a).cross(c - a);
        let height = |&point: &u32| (self.points[point as usize] - a).dot(normal);
        let above = &self.faces[face as usize].above;
        let Some(&apex) = above.iter().max_by(|p, q| height(p).total_cmp(&height(q))) else { return Ok(()) };
        let (seen, rim) = self.seen_from(apex, face, work)?;
        let mut orphans = Vec::new();
        for &face in &seen {
            self.faces[face as usize].is_left = false;
            orphans.append(&mut self.faces[face as usize].above);
        }
        orphans.retain(|&point| point != apex);
        let first = self.faces.len();
        // Each edge of the rim begins once and ends once.
        let mut beginning: HashMap<u32, u32> = HashMap::with_capacity(rim.len());
        for (&(face, edge), number) in rim.iter().zip(first as u32..) {
            let outside = &mut self.faces[face as usize];
            let [from, to] = [outside.corners[(edge + 1) % 3], outside.corners[edge]];
            outside.beyond[edge] = number;
            beginning.insert(from, number);
            let corners = [from, to, apex];
            self.faces.push(Face { corners, beyond: [face, 0, 0], above: Vec::new(), is_left: true });
        }
        for number in first..self.faces.len() {
            let next = beginning.get(&self.faces[number].corners[1]).copied();
            let next = next.ok_or("its hull has no rim")?;
            self.faces[number].beyond[1] = next;
            self.faces[next as usize].beyond[2] = number as u32;
        }
        self.share(orphans, first, work)
    }

    /// Faces that `apex` is above, found from `face` on, and the edges around them, by the face outside and its edge.
    fn seen_from(&self, apex: u32, face: u32, work: &mut Work) -> Result<(Vec<u32>, Rim), String> {
        let mut verdicts = HashMap::from([(face, true)]);
        let (mut seen, mut rim) = (vec![face], Vec::new());
        let mut next = 0;
        while next < seen.len() {
            let own = seen[next];
            next += 1;
            work.steps(3)?;
            for edge in 0..3 {
                let beyond = self.faces[own as usize].beyond[edge];
                let corners = self.faces[beyond as usize].corners;
                let is_new = !verdicts.contains_key(&beyond);
                let is_seen = *verdicts.entry(beyond).or_insert_with(|| self.is_above(corners, apex));
                if is_seen {
                    seen.extend(is_new.then_some(beyond));
                } else if let Some(edge) = self.faces[beyond as usize].beyond.iter().position(|&other| other == own) {
                    rim.push((beyond, edge));
                }
            }
        }
        Ok((seen, rim))
    }

    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        let mut number_of = HashMap::new();
        for face in self.faces.iter().filter(|face| face.is_left) {
            let triangle = face.corners.map(|corner| {
                *number_of.entry(corner).or_insert_with(|| {
                    mesh.positions.push(self.points[corner as usize]);
                    mesh.positions.len() as u32 - 1
                })
            });
            mesh.triangles.push(triangle);
        }
        mesh
    }
}

/// The hull of points in the plane, counter-clockwise; nothing if they are on one line.
pub(super) fn flat_hull(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut points: Vec<DVec2> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let mut chain: Vec<DVec2> = Vec::new();
    for half in 0..2 {
        let start = chain.len();
        for &p in &points {
            while chain.len() >= start + 2 {
                let [a, b] = [chain[chain.len() - 2], chain[chain.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        // Its last point begins the other half.
        chain.pop();
        if half == 0 {
            points.reverse();
        }
    }
    if chain.len() < 3 { Vec::new() } else { chain }
}
