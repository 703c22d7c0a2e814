//! How far an engine's rounding reaches, and which surfaces lie within that reach of a ray.

use glam::{DAffine3, DVec2, DVec3};

use super::nearest::{Outline, to_face};
use super::object::{Prim, Solid};
use super::shapes::{self, Crossing, Crossings};
use super::tree::Bounds;
use super::{Oracle, OracleRay, Placed, magnitude};
use crate::scene::description::{Precision, Shape};

/// K of the rule `delta = K eps scale` (see the module's head): twice what textbook f32 kernels need. Over 40000 rays
/// in each of 15 settings (soups, needles, stretched instances, the edges of a closed sphere, from 1.5 to 10000
/// radii away) they leave up to 1139 answers unexplained at K = 2, up to 98 at 3, one in all at 4; `tests/oracle/margin.rs`
/// repeats this with fewer rays.
pub const MARGIN_FACTOR: f64 = 8.0;
/// Pad of placements' boxes relative to coordinates.
pub(super) const MAP_PAD: f64 = 1.0 / (1u64 << 36) as f64;
/// Directions in which a ray is displaced by the whole margin; half as many by half of it.
const DIRECTIONS: u32 = 32;

/// The rounding of one precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Margin {
    relative: f64,
    floor: f64,
}

impl Margin {
    pub fn new(k: f64, precision: Precision) -> Self {
        let (eps, smallest) = match precision {
            Precision::F32 => (f64::from(f32::EPSILON), f64::from(f32::MIN_POSITIVE)),
            Precision::F64 => (f64::EPSILON, f64::MIN_POSITIVE),
        };
        Self { relative: k * 0.5 * eps, floor: smallest.sqrt() }
    }

    pub fn delta(&self, scale: f64) -> f64 {
        (self.relative * scale).max(self.floor)
    }
}

/// Placement and primitive number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Id {
    pub inst: u32,
    pub prim: u32,
}

#[derive(Clone, Copy, Debug)]
enum Geometry<'a> {
    /// Corners in world space.
    Triangle([DVec3; 3]),
    /// A shape and the map from the world to its canonical space.
    Solid(&'a Solid, DAffine3),
}

/// A primitive in world space, looked at from one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located<'a> {
    pub id: Id,
    placed: &'a Placed,
    geometry: Geometry<'a>,
}

impl Located<'_> {
    pub fn triangle(&self) -> Option<[DVec3; 3]> {
        match self.geometry {
            Geometry::Triangle(corners) => Some(corners),
            Geometry::Solid(..) => None,
        }
    }

    /// Rounding reach for this primitive seen from `org`; `at` stands for its size if it has none.
    pub fn delta(&self, margin: &Margin, org: DVec3, at: DVec3) -> f64 {
        let placed = self.placed;
        let size = match self.geometry {
            Geometry::Triangle(corners) => Bounds::of(corners).magnitude(),
            Geometry::Solid(solid, _) => placed.bounds(solid.bounds()).magnitude(),
        };
        let raw = org.abs().max(if size.is_finite() { size } else { at.abs() });
        let mut object = magnitude::point_back(&placed.to_world, &placed.to_object, raw);
        if let Geometry::Solid(solid, _) = self.geometry {
            let local = magnitude::point_back(&solid.to_object, &solid.to_local, object);
            object = object.max(magnitude::point(&solid.to_object, local));
        }
        margin.delta(magnitude::point(&placed.to_world, object).max(raw).max_element())
    }

    /// Crossings of the ray's line, in order of t.
    pub fn crossings(&self, ray: &OracleRay) -> Crossings {
        match &self.geometry {
            Geometry::Triangle(corners) => {
                let hit = shapes::triangle(*corners, ray.org, ray.dir);
                [hit.map(|h| Crossing { t: h.t, face: 0 }), None]
            }
            Geometry::Solid(solid, to_local) => {
                let local = ray.transformed(to_local);
                shapes::crossings(solid.shape, local.org, local.dir)
            }
        }
    }

    /// How far the oracle itself may be off beside an edge: what it sees is that much larger than the triangle. Next
    /// to nothing for an f32 engine; an f64 engine's own rounding is of this size. 0 if the line does not cross.
    pub fn blur(&self, ray: &OracleRay) -> f64 {
        let crossed = self.triangle().filter(|_| self.crossings(ray)[0].is_some());
        crossed.map_or(0.0, |corners| shapes::blur(corners, ray.org, ray.dir))
    }

    /// Sine of the angle between the ray and the surface at a crossing.
    pub fn steepness(&self, ray: &OracleRay, crossing: Crossing) -> f64 {
        let ng = match &self.geometry {
            Geometry::Triangle([p0, p1, p2]) => shapes::cross(p1 - p0, p2 - p0),
            Geometry::Solid(solid, to_local) => {
                let local = to_local.transform_point3(ray.at(crossing.t));
                to_local.matrix3.transpose() * shapes::normal(solid.shape, crossing.face, local)
            }
        };
        ng.dot(ray.dir).abs() / (ng.length() * ray.dir.length())
    }

    /// The ray and its displaced copies: circles of `delta` and half of it, and straight at a triangle's centre; of a shape, which may
    /// be thinner than the circles are apart, also its points nearest to all of these, as far as they are within `delta`.
    pub fn displaced(&self, ray: &OracleRay, delta: f64) -> impl Iterator<Item = OracleRay> {
        let forward = ray.dir.normalize();
        let (a, b) = forward.any_orthonormal_pair();
        let circle = |count: u32, radius: f64| {
            (0..count).map(move |i| radius * DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(count)))
        };
        let circles = || circle(DIRECTIONS, delta).chain(circle(DIRECTIONS / 2, 0.5 * delta));
        let across = |v: DVec3| DVec2::new(v.dot(a), v.dot(b));
        let mut offsets = vec![DVec2::ZERO];
        match &self.geometry {
            Geometry::Triangle([p0, p1, p2]) => {
                offsets.push(across((p0 + p1 + p2) / 3.0 - ray.org).clamp_length_max(delta));
                offsets.extend(circles());
            }
            Geometry::Solid(solid, to_local) => {
                let to_world = to_local.inverse();
                let centre = to_world.transform_point3(DVec3::Z * 0.5) - ray.org;
                offsets.push(across(centre).clamp_length_max(delta));
                offsets.extend(circles());
                if let Some(outline) = Outline::new(solid.shape, to_world, ray.org, [a, b]) {
                    let nearest = std::iter::once(DVec2::ZERO).chain(circles()).map(|w| outline.nearest(w));
                    offsets.extend(nearest.filter(|w| w.length() <= delta));
                }
            }
        }
        let ray = *ray;
        offsets.into_iter().map(move |w| OracleRay { org: ray.org + w.x * a + w.y * b, ..ray })
    }

    /// Whether the point of the ray at `t` is within `delta` of the surface. With `order`, only the first (0) or
    /// second (1) crossing of a solid counts.
    pub fn passes(&self, ray: &OracleRay, t: f64, order: Option<usize>, delta: f64) -> bool {
        if !t.is_finite() {
            return false;
        }
        let (solid, to_local) = match &self.geometry {
            Geometry::Triangle(corners) => {
                return point_to_triangle(ray.at(t), *corners) <= delta || passes_beside(ray, t, *corners, delta);
            }
            Geometry::Solid(solid, to_local) => (solid, to_local),
        };
        let orders = order.map_or(0..2, |k| k..k + 1);
        if orders.into_iter().any(|k| self.reach(ray, k, delta).is_some_and(|(lo, hi)| lo <= t && t <= hi)) {
            return true;
        }
        // Rays along a flat shape never cross it, however they are displaced.
        let flat = matches!(solid.shape, Shape::HalfSpace | Shape::Disc);
        flat && off_face(solid.shape, 0, to_local, ray.at(t)) <= delta
    }

    /// Range of t over which displaced rays cross a solid for the `order`-th time, give or take `delta`. The solids
    /// are convex and crossings move continuously with the ray, so each t in between belongs to some displaced ray.
    /// If one of the rays misses, both crossings meet on the way to it, near the middle of the shortest chord.
    fn reach(&self, ray: &OracleRay, order: usize, delta: f64) -> Option<(f64, f64)> {
        let along = delta / ray.dir.length();
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut missed, mut shortest) = (false, None);
        for found in self.displaced(ray, delta).map(|r| self.crossings(&r)) {
            match found[order] {
                Some(c) => (lo, hi) = (lo.min(c.t), hi.max(c.t)),
                None => missed = true,
            }
            if let [Some(enter), Some(leave)] = found {
                let chord = (leave.t - enter.t, 0.5 * enter.t + 0.5 * leave.t);
                shortest = Some(shortest.map_or(chord, |s: (f64, f64)| if chord.0 < s.0 { chord } else { s }));
            }
        }
        if let (true, Some((_, middle))) = (missed, shortest) {
            (lo, hi) = (lo.min(middle), hi.max(middle));
        }
        (lo <= hi).then_some((lo - along, hi + along))
    }

    /// Whether the surface about `t`, where the ray [passes](Self::passes), may be `face`: displaced rays see it there,
    /// or it is within 2 delta of the ray's point, which itself is within delta of the surface (the sides of a plate
    /// thinner than delta are not seen by chance).
    pub fn shows(&self, ray: &OracleRay, t: f64, face: f64, delta: f64) -> bool {
        let Geometry::Solid(solid, to_local) = &self.geometry else { return false };
        let Some(face) = (0..6u32).find(|&f| f64::from(f) == face) else { return false };
        let along = delta / ray.dir.length();
        let seen = self.displaced(ray, delta).flat_map(|r| self.crossings(&r)).flatten();
        let ts = seen.filter(|c| c.face == face).map(|c| c.t);
        let (lo, hi) = ts.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| (lo.min(t), hi.max(t)));
        (lo - along <= t && t <= hi + along) || off_face(solid.shape, face, to_local, ray.at(t)) <= 2.0 * delta
    }

    /// Whether the ray's segment comes within `delta` of the surface.
    pub fn touches(&self, ray: &OracleRay, delta: f64) -> bool {
        if let Geometry::Triangle(corners) = self.geometry {
            return segment_to_triangle(ray, corners) <= delta;
        }
        let meets = |(lo, hi)| lo <= ray.t_max && ray.t_min <= hi;
        (0..2).any(|k| self.reach(ray, k, delta).is_some_and(meets))
            || self.passes(ray, ray.t_min, None, delta)
            || self.passes(ray, ray.t_max, None, delta)
    }
}

impl Oracle {
    /// A primitive by its numbers; `None` if there is none or it is degenerate.
    pub(super) fn locate(&self, id: Id) -> Option<Located<'_>> {
        let placed = self.placements.get(id.inst as usize)?;
        let object = &self.objects[placed.object as usize];
        let geometry = match object.prim(id.prim) {
            Prim::Triangle(corners) => {
                Geometry::Triangle(object.corners(corners).map(|p| placed.to_world.transform_point3(p)))
            }
            Prim::Solid(i) => Geometry::Solid(object.solid(i), object.solid(i).to_local * placed.to_object),
            Prim::Leaf(_) | Prim::Dropped => return None,
        };
        Some(Located { id, placed, geometry })
    }

    /// All primitives that the segment passes within their own margin or within `at_least`.
    pub(super) fn near(&self, ray: &OracleRay, margin: &Margin, at_least: f64) -> Vec<Located<'_>> {
        let mut found = Vec::new();
        let org = ray.org.abs().max_element();
        let reach = margin.delta(self.reach.per_org * org + self.reach.constant).max(at_least);
        self.tree.visit(
            ray,
            ray.t_max,
            |_| reach,
            |inst, end| {
                let placed = &self.placements[inst as usize];
                let object = &self.objects[placed.object as usize];
                let shrink = magnitude::norm(&placed.to_object);
                let pad = |b: &Bounds| match b.is_finite() {
                    true => {
                        let scale = placed.scale(b.magnitude(), ray.org, object.solid_growth);
                        margin.delta(scale).max(at_least) * shrink
                    }
                    false => f64::INFINITY,
                };
                object.near(&ray.transformed(&placed.to_object), pad, |prim| {
                    let near = self.locate(Id { inst, prim }).filter(|located| {
                        let delta = located.delta(margin, ray.org, ray.org).max(at_least);
                        located.touches(ray, delta)
                    });
                    found.extend(near);
                });
                end
            },
        );
        found
    }
}

impl Placed {
    /// Upper bound of the scale of any primitive within `size` (object space), seen from `org` (world space).
    pub(super) fn scale(&self, size: DVec3, org: DVec3, solid_growth: f64) -> f64 {
        let raw = magnitude::point(&self.to_world, size).max(org.abs());
        let object = magnitude::point_back(&self.to_world, &self.to_object, raw) * solid_growth;
        magnitude::point(&self.to_world, object).max(raw).max_element()
    }

    /// How much [`Placed::scale`] grows with the origin, at most.
    pub(super) fn growth(&self) -> f64 {
        magnitude::vector(&self.to_world, magnitude::vector(&self.to_object, DVec3::ONE)).max_element().max(1.0)
    }
}

/// World distance from `p` to a solid's face: see [`to_face`].
fn off_face(shape: Shape, face: u32, to_local: &DAffine3, p: DVec3) -> f64 {
    to_face(shape, face, &to_local.matrix3.inverse(), to_local.transform_point3(p))
}

/// Whether the line passes a triangle within `delta` and meets its plane near `t`: beside a steep triangle the plane
/// runs away from it, by up to the triangle's size.
fn passes_beside(ray: &OracleRay, t: f64, corners: [DVec3; 3], delta: f64) -> bool {
    let Some(plane) = shapes::triangle_plane(corners, ray.org, ray.dir) else { return false };
    let off = (t - plane.t).abs() * ray.dir.dot(plane.ng).abs() / plane.ng.length();
    let line = OracleRay { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, ..*ray };
    let longest = edges(corners).map(|(a, b)| (b - a).length()).into_iter().fold(0.0, f64::max);
    off <= delta && point_to_triangle(ray.at(t), corners) <= longest && segment_to_triangle(&line, corners) <= delta
}

/// Range of t of the points of the ray nearest to the points of a triangle.
fn depth_range(ray: &OracleRay, corners: [DVec3; 3]) -> (f64, f64) {
    let ts = corners.map(|p| (p - ray.org).dot(ray.dir) / ray.dir.dot(ray.dir));
    ts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &t| (lo.min(t), hi.max(t)))
}

fn point_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let ab = b - a;
    let s = ((p - a).dot(ab) / ab.dot(ab)).clamp(0.0, 1.0);
    (p - (a + s * ab)).length()
}

fn edges([p0, p1, p2]: [DVec3; 3]) -> [(DVec3, DVec3); 3] {
    [(p0, p1), (p1, p2), (p2, p0)]
}

/// Distance of a point to a proper triangle.
pub(super) fn point_to_triangle(p: DVec3, corners: [DVec3; 3]) -> f64 {
    let ng = shapes::cross(corners[1] - corners[0], corners[2] - corners[0]);
    let rim = edges(corners).map(|(a, b)| point_to_segment(p, a, b)).into_iter().fold(f64::INFINITY, f64::min);
    let above = edges(corners).iter().all(|&(a, b)| shapes::cross(b - a, p - a).dot(ng) >= 0.0);
    if above { rim.min((p - corners[0]).dot(ng).abs() / ng.length()) } else { rim }
}

fn segment_to_segment((a, b): (DVec3, DVec3), (c, d): (DVec3, DVec3)) -> f64 {
    let (u, v, r) = (b - a, d - c, c - a);
    let n = shapes::cross(u, v);
    let nn = n.dot(n);
    let inside = |x: f64| 0.0 < x && x < nn;
    let ends =
        if u == DVec3::ZERO { (a - c).length() } else { point_to_segment(c, a, b).min(point_to_segment(d, a, b)) };
    let ends = ends.min(point_to_segment(a, c, d)).min(point_to_segment(b, c, d));
    let crossing = inside(shapes::cross(r, v).dot(n)) && inside(shapes::cross(r, u).dot(n));
    if crossing { ends.min(r.dot(n).abs() / nn.sqrt()) } else { ends }
}

/// Distance of the ray's segment to a proper triangle.
fn segment_to_triangle(ray: &OracleRay, corners: [DVec3; 3]) -> f64 {
    let crosses = shapes::triangle(corners, ray.org, ray.dir).is_some_and(|h| ray.t_min <= h.t && h.t <= ray.t_max);
    if crosses {
        return 0.0;
    }
    // The nearest point of the segment lies beside the triangle.
    let (lo, hi) = depth_range(ray, corners);
    let segment = (ray.at(lo.clamp(ray.t_min, ray.t_max)), ray.at(hi.clamp(ray.t_min, ray.t_max)));
    let rim = edges(corners).map(|edge| segment_to_segment(segment, edge)).into_iter().fold(f64::INFINITY, f64::min);
    rim.min(point_to_triangle(segment.0, corners)).min(point_to_triangle(segment.1, corners))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_by_hand() {
        let corners = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 3.0];
        assert_eq!(point_to_triangle(DVec3::new(1.0, 1.0, 2.0), corners), 2.0);
        assert_eq!(point_to_triangle(DVec3::new(-3.0, 1.0, 4.0), corners), 5.0);
        // The hypotenuse is 3x + 4y = 12; (4, 3) is 12/5 away from it.
        assert!((point_to_triangle(DVec3::new(4.0, 3.0, 0.0), corners) - 2.4).abs() < 1e-15);
        let ray = |org, dir, t_max| OracleRay { org, dir, t_min: 0.0, t_max };
        let through = ray(DVec3::new(1.0, 1.0, 5.0), DVec3::NEG_Z, f64::INFINITY);
        assert_eq!(segment_to_triangle(&through, corners), 0.0);
        assert_eq!(segment_to_triangle(&OracleRay { t_max: 3.0, ..through }, corners), 2.0);
        // Crosses the plane at (2, -1): nearest is the edge y = 0; the ray leans, so the distance is 1 / sqrt 2.
        let leaning = ray(DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, -1.0, -1.0), f64::INFINITY);
        assert!((segment_to_triangle(&leaning, corners) - 0.5f64.sqrt()).abs() < 1e-15);
    }
}
