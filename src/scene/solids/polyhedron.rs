//! Convex polyhedra by their planes: BRL-CAD's arb4..arb8 and arbn.

use glam::DVec3;

/// Most planes of a polyhedron.
pub const MAX_PLANES: usize = 4096;

/// Faces of an arb8 by its points, in BRL-CAD's order.
const ARB8_FACES: [[usize; 4]; 6] =
    [[3, 2, 1, 0], [4, 5, 6, 7], [4, 7, 3, 0], [2, 6, 5, 1], [1, 5, 4, 0], [7, 6, 2, 3]];

/// The half-space `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Outward normal, unit.
    pub normal: DVec3,
    /// Distance of the plane from the origin along the normal.
    pub offset: f64,
}

/// A convex polyhedron: where all half-spaces meet. Face numbers are indices of planes.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    planes: Vec<Plane>,
    lo: DVec3,
    hi: DVec3,
}

impl Polyhedron {
    /// The polyhedron of some planes, whose normals need not be unit.
    ///
    /// # Errors
    /// Fewer than four planes or more than [`MAX_PLANES`], numbers that are not finite, nothing inside, or no bounds.
    pub fn from_planes(planes: &[(DVec3, f64)]) -> Result<Self, String> {
        if !(4..=MAX_PLANES).contains(&planes.len()) {
            return Err(format!("it takes 4 to {MAX_PLANES} planes, found {}", planes.len()));
        }
        let mut unit = Vec::with_capacity(planes.len());
        for (i, (normal, offset)) in planes.iter().enumerate() {
            let length = normal.length();
            let plane = Plane { normal: *normal / length, offset: offset / length };
            if !(plane.normal.is_finite() && plane.normal != DVec3::ZERO && plane.offset.is_finite()) {
                return Err(format!("plane {i} has no direction or is not finite"));
            }
            unit.push(plane);
        }
        let (lo, hi) = bounds(&unit)?;
        Ok(Self { planes: unit, lo, hi })
    }

    /// BRL-CAD's arb8, with arb4..arb7 as arb8s some of whose points coincide: points closer than `tolerance` are one,
    /// faces with fewer than three distinct points that span an area are dropped, planes are turned away from
    /// the mean of the points. Planes follow the order of BRL-CAD's faces.
    ///
    /// # Errors
    /// Points that span no volume, or not finite.
    pub fn from_arb8(points: &[DVec3; 8], tolerance: f64) -> Result<Self, String> {
        if !points.iter().all(|p| p.is_finite()) {
            return Err("its points are not finite".into());
        }
        let mean = points.iter().sum::<DVec3>() / 8.0;
        let mut planes: Vec<Plane> = Vec::new();
        for face in ARB8_FACES {
            let Some(plane) = face_plane(&face.map(|i| points[i]), mean, tolerance) else { continue };
            if !planes.iter().any(|p| p.normal.dot(plane.normal) > 1.0 - 1e-12 && p.offset == plane.offset) {
                planes.push(plane);
            }
        }
        if planes.len() < 4 {
            return Err(format!("its points span {} faces, at least 4 make a solid", planes.len()));
        }
        // The points bound it even where a face that is not flat leaves its plane.
        let (lo, hi) = bounds(&planes)?;
        Ok(Self { planes, lo, hi })
    }

    /// The planes.
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// Lower and upper corner of its box.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.lo, self.hi)
    }
}

/// Plane of the first three distinct points of a face that do not lie on a line, turned away from `mean`.
fn face_plane(points: &[DVec3; 4], mean: DVec3, tolerance: f64) -> Option<Plane> {
    let mut distinct: Vec<DVec3> = Vec::with_capacity(4);
    for &p in points {
        if distinct.iter().all(|q| q.distance(p) > tolerance) {
            distinct.push(p);
        }
    }
    let &[a, b, ref others @ ..] = distinct.as_slice() else { return None };
    for &c in others {
        let (e, f) = (b - a, c - a);
        let cross = e.cross(f);
        if cross.length() > 1e-9 * e.length() * f.length() {
            let normal = cross.normalize();
            let normal = if normal.dot(mean - a) > 0.0 { -normal } else { normal };
            return Some(Plane { normal, offset: normal.dot(a) });
        }
    }
    None
}

/// Box of the corners, a little wider than they are known. A first round from far away finds about where it is, a second from
/// there keeps the digits.
fn bounds(planes: &[Plane]) -> Result<(DVec3, DVec3), String> {
    let largest = planes.iter().fold(0.0, |m: f64, p| m.max(p.offset.abs()));
    let far = 1e6 * if largest > 0.0 { largest } else { 1.0 };
    let nothing = || "there is nothing on the inner side of all its planes".to_string();
    let (lo, hi) = corners(planes, DVec3::ZERO, far);
    if !(hi - lo).cmpgt(DVec3::ZERO).all() {
        return Err(nothing());
    }
    if lo.abs().max(hi.abs()).max_element() > 1e-2 * far {
        return Err("its planes do not enclose it".into());
    }
    let (lo, hi) = corners(planes, (lo + hi) * 0.5, 2.0 * (hi - lo).length());
    if !(hi - lo).cmpgt(DVec3::ZERO).all() {
        return Err(nothing());
    }
    let pad = DVec3::splat(1e-13 * lo.abs().max(hi.abs()).max_element());
    Ok((lo - pad, hi + pad))
}

/// Lower and upper end of the planes' polygons: each a square about `centre`, `far` in every direction, cut by all other planes
/// (Sutherland, Hodgman, "Reentrant polygon clipping", 1974).
fn corners(planes: &[Plane], centre: DVec3, far: f64) -> (DVec3, DVec3) {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (i, plane) in planes.iter().enumerate() {
        let (x, y) = plane.normal.any_orthonormal_pair();
        let middle = centre + plane.normal * (plane.offset - plane.normal.dot(centre));
        let mut polygon: Vec<DVec3> =
            [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(u, v)| middle + (x * u + y * v) * far).into();
        for (j, other) in planes.iter().enumerate() {
            // Parallel planes that coincide would cut each other away.
            if i != j && !(other.normal.dot(plane.normal) > 1.0 - 1e-12 && other.offset >= plane.offset) {
                polygon = clipped(&polygon, other);
            }
        }
        for p in polygon {
            (lo, hi) = (lo.min(p), hi.max(p));
        }
    }
    (lo, hi)
}

fn clipped(polygon: &[DVec3], plane: &Plane) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (dp, dq) = (plane.normal.dot(p) - plane.offset, plane.normal.dot(q) - plane.offset);
        if dp <= 0.0 {
            kept.push(p);
        }
        if (dp < 0.0 && dq > 0.0) || (dp > 0.0 && dq < 0.0) {
            kept.push(p + (q - p) * (dp / (dp - dq)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_points() -> [DVec3; 8] {
        // BRL-CAD's order: the face x = 1 counter-clockwise, then x = -1.
        let f = |x: f64| [(-2.0, -3.0), (2.0, -3.0), (2.0, 3.0), (-2.0, 3.0)].map(|(y, z)| DVec3::new(x, y, z));
        let (a, b) = (f(1.0), f(-1.0));
        [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
    }

    #[test]
    fn arb8_is_a_box_and_arb4_a_tetrahedron() {
        let cuboid = Polyhedron::from_arb8(&box_points(), 5e-4).unwrap();
        assert_eq!(cuboid.planes().len(), 6);
        assert!((cuboid.bounds().1 - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-11);
        // BRL-CAD writes an arb4's points as 0 1 2 0 3 3 3 3.
        let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
        let tetrahedron = Polyhedron::from_arb8(&[o, x, y, o, z, z, z, z], 5e-4).unwrap();
        assert_eq!(tetrahedron.planes().len(), 4);
        assert!((tetrahedron.bounds().1 - DVec3::ONE).length() < 1e-11);
        let inside = DVec3::splat(0.2);
        assert!(tetrahedron.planes().iter().all(|p| p.normal.dot(inside) < p.offset));
        assert!(Polyhedron::from_arb8(&[o; 8], 5e-4).is_err());
        assert!(Polyhedron::from_arb8(&[o, x, x + y, y, o, x, x + y, y], 5e-4).is_err(), "flat");
    }

    #[test]
    fn planes_must_enclose_something() {
        let mut planes = vec![(DVec3::X, 1.0), (-DVec3::X, 1.0), (DVec3::Y, 1.0), (-DVec3::Y, 1.0), (DVec3::Z, 2.0)];
        assert!(Polyhedron::from_planes(&planes).unwrap_err().contains("enclose"));
        planes.push((DVec3::NEG_Z * 4.0, 2.0));
        let solid = Polyhedron::from_planes(&planes).unwrap();
        let (lo, hi) = (DVec3::new(-1.0, -1.0, -0.5), DVec3::new(1.0, 1.0, 2.0));
        assert!(solid.bounds().0.distance(lo) < 1e-11 && solid.bounds().1.distance(hi) < 1e-11);
        assert!(solid.bounds().0.cmple(lo).all() && solid.bounds().1.cmpge(hi).all());
        planes[5].1 = -12.0;
        assert!(Polyhedron::from_planes(&planes).unwrap_err().contains("nothing"));
        planes[5].0 = DVec3::NAN;
        assert!(Polyhedron::from_planes(&planes).is_err());
    }
}
