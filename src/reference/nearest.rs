//! How near a shape comes, measured in the world: of a stretched shape the nearest point is another than in its own space.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::scene::description::Shape;

/// Most steps of the iterations here; they end long before.
const STEPS: u32 = 100;
/// How far points on the outline are pulled inside, as a fraction of the way to the middle.
const INSIDE: f64 = 1e-6;

/// World distance from `p` (canonical space) to a point of a face near it; infinite if there is no such face. Of flat faces it is
/// the nearest point; of others the nearest of some. `to_world`: canonical space to world space.
pub(super) fn to_face(shape: Shape, face: u32, to_world: &DMat3, p: DVec3) -> f64 {
    let off = |q: DVec3| (*to_world * (q - p)).length();
    let flat = |z: f64, radius: f64| off(in_disc(to_world, p.with_z(p.z - z), radius).extend(z));
    match (shape, face) {
        (Shape::Sphere, 0) => {
            off(p.normalize_or(DVec3::X)).min(leaving(p, 1.0, 3).map(off).fold(f64::INFINITY, f64::min))
        }
        (Shape::HalfSpace, 0) => flat(0.0, f64::INFINITY),
        (Shape::Disc, 0) | (Shape::Cylinder | Shape::Cone { .. }, 1) => flat(0.0, 1.0),
        (Shape::Cylinder, 2) => flat(1.0, 1.0),
        (Shape::Cone { top, .. }, 2) => flat(1.0, top),
        (Shape::Cylinder, 0) => to_side(1.0, p, to_world),
        (Shape::Cone { top, .. }, 0) => to_side(1.0 - (1.0 - top) * p.z.clamp(0.0, 1.0), p, to_world),
        (Shape::Cuboid, 0..6) => {
            let axis = face as usize / 2;
            let height = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
            // The face's axes first, its normal last.
            let turn = |v: DVec3| DVec3::new(v[(axis + 1) % 3], v[(axis + 2) % 3], v[axis]);
            let columns = [(axis + 1) % 3, (axis + 2) % 3, axis].map(|k| to_world.col(k));
            in_square(&DMat3::from_cols(columns[0], columns[1], columns[2]), turn(p) - DVec3::Z * height)
        }
        _ => f64::INFINITY,
    }
}

/// World distance from `p` to a point near it of the circle of `radius` around z, at the height of `p` or the nearest.
fn to_side(radius: f64, p: DVec3, to_world: &DMat3) -> f64 {
    let z = p.z.clamp(0.0, 1.0);
    let (flat, way) = (p.with_z(0.0), p.with_z(p.z - z));
    let off = |q: DVec3| (*to_world * (q.with_z(z) - p)).length();
    let outside = in_disc(to_world, way, radius).normalize_or(DVec2::X).extend(0.0) * radius;
    let some = [flat.normalize_or(DVec3::X) * radius, outside].into_iter().chain(leaving(flat, radius, 2));
    some.map(off).fold(f64::INFINITY, f64::min)
}

/// Where the sphere of `radius` is left from inside along each of the first `axes` axes, on the nearer side.
fn leaving(p: DVec3, radius: f64, axes: usize) -> impl Iterator<Item = DVec3> {
    (0..axes).filter_map(move |axis| {
        let square = radius * radius - (p.length_squared() - p[axis] * p[axis]);
        let mut q = p;
        q[axis] = square.max(0.0).sqrt().copysign(p[axis]);
        (square >= 0.0).then_some(q)
    })
}

/// The point of the disc of `radius` in the plane z = 0 that `to_world` brings nearest to where it brings `p`: a least squares
/// problem within a circle, solved by its secular equation (Moré, Sorensen, "Computing a Trust Region Step", 1983).
fn in_disc(to_world: &DMat3, p: DVec3, radius: f64) -> DVec2 {
    let (u, v, b) = (to_world.x_axis, to_world.y_axis, *to_world * p);
    // Principal axes of the two columns, by one rotation.
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let tau = (vv - uu) / (2.0 * uv);
    let tan = if uv == 0.0 { 0.0 } else { 1f64.copysign(tau) / (tau.abs() + tau.hypot(1.0)) };
    let cos = 1.0 / tan.hypot(1.0);
    let sin = tan * cos;
    let squares = DVec2::new(uu - tan * uv, vv + tan * uv).max(DVec2::splat(f64::MIN_POSITIVE));
    let sides = DVec2::new((cos * u - sin * v).dot(b), (sin * u + cos * v).dot(b));
    let mut lambda = 0.0;
    let mut best = sides / squares;
    for _ in 0..STEPS {
        let length = best.length();
        if length <= radius * (1.0 + 1e-13) {
            break;
        }
        let sum = squares + lambda;
        lambda += (length - radius) / radius * length * length / (best * best / sum).element_sum();
        best = sides / (squares + lambda);
    }
    let best = best.clamp_length_max(radius);
    DVec2::new(cos * best.x + sin * best.y, cos * best.y - sin * best.x)
}

/// World distance from `p` to the square of two units in the plane z = 0.
fn in_square(to_world: &DMat3, p: DVec3) -> f64 {
    let (axes, b) = ([to_world.x_axis, to_world.y_axis], *to_world * p);
    let off = |q: DVec2| (axes[0] * q.x + axes[1] * q.y - b).length();
    let inner = in_disc(to_world, p, f64::INFINITY);
    if inner.abs().max_element() <= 1.0 {
        return off(inner);
    }
    let edges = [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)].map(|(axis, at)| {
        let (fixed, free) = (axes[axis], axes[1 - axis]);
        let along = (free.dot(b - fixed * at) / free.dot(free)).clamp(-1.0, 1.0);
        off(if axis == 0 { DVec2::new(at, along) } else { DVec2::new(along, at) })
    });
    edges.into_iter().fold(f64::INFINITY, f64::min)
}

/// A convex shape, seen along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    shape: Shape,
    to_world: DAffine3,
    org: DVec3,
    /// Across the ray.
    axes: [DVec3; 2],
}

impl Outline {
    /// `shape`, placed by `to_world`, as a ray from `org` sees it, which has the orthogonal unit vectors `axes` across; `None` if it is
    /// unbounded.
    pub fn new(shape: Shape, to_world: DAffine3, org: DVec3, axes: [DVec3; 2]) -> Option<Self> {
        (!matches!(shape, Shape::HalfSpace)).then_some(Self { shape, to_world, org, axes })
    }

    /// Where a point of the shape's own space is seen.
    fn seen(&self, local: DVec3) -> DVec2 {
        let p = self.to_world.transform_point3(local) - self.org;
        DVec2::new(p.dot(self.axes[0]), p.dot(self.axes[1]))
    }

    /// The seen point that is the farthest in a direction.
    fn support(&self, towards: DVec2) -> DVec2 {
        let world = self.axes[0] * towards.x + self.axes[1] * towards.y;
        let d = self.to_world.matrix3.transpose() * world;
        let rim = DVec3::new(d.x, d.y, 0.0).normalize_or(DVec3::X);
        let up = if d.z > 0.0 { DVec3::Z } else { DVec3::ZERO };
        self.seen(match self.shape {
            Shape::Sphere => d.normalize_or(DVec3::X),
            Shape::Cuboid => d.map(|x| 1f64.copysign(x)),
            Shape::Cylinder => rim + up,
            Shape::Cone { top, .. } => {
                let (low, high) = (rim, rim * top + DVec3::Z);
                if low.dot(d) < high.dot(d) { high } else { low }
            }
            Shape::Disc | Shape::HalfSpace => rim,
        })
    }

    /// The point of the outline or inside of it that is nearest to `w`, pulled a little inside. Source: Gilbert, Johnson, Keerthi, "A
    /// Fast Procedure for Computing the Distance Between Complex Objects in Three-Dimensional Space", 1988, in two.
    pub fn nearest(&self, w: DVec2) -> DVec2 {
        let middle = self.seen(match self.shape {
            Shape::Cylinder | Shape::Cone { .. } => DVec3::Z * 0.5,
            _ => DVec3::ZERO,
        });
        // Seen from `w`: an edge, and its point nearest to there.
        let mut edge = [middle - w; 2];
        let mut best = edge[0];
        for _ in 0..STEPS {
            let next = self.support(-best) - w;
            if best.length_squared() - best.dot(next) <= 1e-12 * best.length_squared() {
                break;
            }
            let [a, b] = edge;
            let turns = [a.perp_dot(b), b.perp_dot(next), next.perp_dot(a)];
            if turns.iter().all(|x| *x > 0.0) || turns.iter().all(|x| *x < 0.0) {
                return w;
            }
            let [on_a, on_b] = [a, b].map(|from| on_edge(from, next));
            let is_a = on_a.length_squared() <= on_b.length_squared();
            let (found, from) = if is_a { (on_a, a) } else { (on_b, b) };
            if found.length_squared() >= best.length_squared() {
                break;
            }
            (best, edge) = (found, [from, next]);
        }
        let found = w + best;
        found + (middle - found) * INSIDE
    }
}

/// The point of an edge that is nearest to the origin.
fn on_edge(a: DVec2, b: DVec2) -> DVec2 {
    let ab = b - a;
    let share = -a.dot(ab) / ab.length_squared();
    if share.is_nan() { a } else { a + ab * share.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014: the oracle shares nothing with the engines, so it has its
    /// own here.
    struct Random(u64);

    impl Random {
        /// In [0, 1).
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }

        /// In [-1, 1).
        fn signed(&mut self) -> f64 {
            2.0 * self.unit() - 1.0
        }

        fn cube(&mut self) -> DVec3 {
            DVec3::new(self.signed(), self.signed(), self.signed())
        }
    }

    const SHAPES: [(Shape, u32); 6] = [
        (Shape::Sphere, 1),
        (Shape::Disc, 1),
        (Shape::Cuboid, 6),
        (Shape::Cylinder, 3),
        (Shape::cone(0.4), 3),
        (Shape::cone(0.0), 2),
    ];

    /// Points all over a face, or inside of a shape where `face` is `None`.
    fn points(shape: Shape, face: Option<u32>, r: &mut Random, n: usize) -> Vec<DVec3> {
        let points = (0..n).map(|_| {
            let p = r.cube();
            let round = DVec2::from_angle(3.2 * p.x) * (0.5 + 0.5 * p.y).sqrt();
            let (rim, z) = (DVec2::from_angle(3.2 * p.x), 0.5 + 0.5 * p.z);
            match (shape, face) {
                (Shape::Sphere, Some(_)) => p.normalize_or(DVec3::X),
                (Shape::Sphere, None) => p.normalize_or(DVec3::X) * r.unit(),
                (Shape::Cuboid, Some(face)) => {
                    let mut q = p;
                    q[face as usize / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
                    q
                }
                (Shape::Cuboid, None) => p,
                (Shape::Disc, _) | (_, Some(1)) => round.extend(0.0),
                (Shape::Cone { top, .. }, Some(2)) => (round * top).extend(1.0),
                (Shape::Cone { top, .. }, Some(_)) => (rim * (1.0 - (1.0 - top) * z)).extend(z),
                (Shape::Cone { top, .. }, None) => (round * (1.0 - (1.0 - top) * z)).extend(z),
                (_, Some(2)) => round.extend(1.0),
                (_, Some(_)) => rim.extend(z),
                (_, None) => round.extend(z),
            }
        });
        points.collect()
    }

    fn some_map(r: &mut Random, round: usize) -> DMat3 {
        let stretch = [DVec3::ONE, DVec3::new(30.0, 0.1, 1.0), DVec3::new(1.0, 20.0, 0.05)][round % 3];
        let mut turn = || {
            let DVec3 { x, y, z } = 3.0 * r.cube();
            DMat3::from_euler(glam::EulerRot::XYZ, x, y, z)
        };
        turn() * DMat3::from_diagonal(stretch) * turn()
    }

    /// No point of a face is nearer than is said of a flat one, and of every face some are about as near.
    #[test]
    fn distances_to_faces_are_those_of_the_nearest_points() {
        let mut r = Random(5);
        for round in 0..30 {
            let map = some_map(&mut r, round);
            for (shape, faces) in SHAPES {
                for face in 0..faces {
                    let size = if round % 2 == 0 { 2.0 } else { 0.9 };
                    let p = r.cube() * size;
                    let got = to_face(shape, face, &map, p);
                    let away = |q: &DVec3| (map * (*q - p)).length();
                    let all = points(shape, Some(face), &mut r, 3000);
                    let nearest = all.iter().map(away).fold(f64::INFINITY, f64::min);
                    let is_flat =
                        shape != Shape::Sphere && !(face == 0 && matches!(shape, Shape::Cylinder | Shape::Cone { .. }));
                    assert!(!is_flat || got <= nearest * (1.0 + 1e-9), "{shape:?} {face} {p}: {got} {nearest}");
                    // Some point is there: the sampled ones are within the spacing of the samples, here in world space.
                    let spacing = 0.25 * map.x_axis.length().max(map.y_axis.length()).max(map.z_axis.length());
                    assert!(!is_flat || nearest <= got + spacing, "{shape:?} {face} {p}: {got} {nearest}");
                }
                assert_eq!(to_face(shape, 6, &map, DVec3::ZERO), f64::INFINITY);
            }
        }
    }

    /// A point of the side stays at no distance, and one beside a stretched disc has that of the rim, not of the centre.
    #[test]
    fn stretched_shapes_by_hand() {
        let map = DMat3::from_diagonal(DVec3::new(1000.0, 0.1, 1.0));
        let beside = DVec3::new(0.5, 2.0, 0.0);
        // In world space y = 0.2, and the rim at x = 500 has y = 0.0866.
        let near = to_face(Shape::Disc, 0, &map, beside);
        assert!((near - (0.2 - 0.1 * 0.75f64.sqrt())).abs() < 1e-4, "{near}");
        for shape in [Shape::Cylinder, Shape::cone(1.0)] {
            let inside = to_face(shape, 0, &map, DVec3::new(0.5, 0.5, 0.5));
            let want = 0.1 * (0.75f64.sqrt() - 0.5);
            assert!((inside - want).abs() < 1e-4 * want, "{shape:?} {inside} {want}");
        }
        let inside = to_face(Shape::Sphere, 0, &map, DVec3::new(0.5, 0.5, 0.0));
        assert!((inside - 0.1 * (0.75f64.sqrt() - 0.5)).abs() < 1e-5, "{inside}");
    }

    #[test]
    fn the_nearest_point_of_an_outline_is_in_it_and_none_is_nearer() {
        let mut r = Random(9);
        let (mut outside, mut inside) = (0, 0);
        for round in 0..300 {
            let map = DAffine3 { matrix3: some_map(&mut r, round), translation: DVec3::new(1.0, -2.0, 0.5) };
            let (a, b) = DVec3::new(r.unit(), r.unit() - 0.5, 0.7).normalize().any_orthonormal_pair();
            let (shape, _) = SHAPES[round % SHAPES.len()];
            let outline = Outline::new(shape, map, DVec3::new(0.5, 0.5, 0.0), [a, b]).unwrap();
            let all: Vec<_> = points(shape, None, &mut r, 2000).into_iter().map(|p| outline.seen(p)).collect();
            let w = DVec2::new(r.signed(), r.signed()) * if round % 2 == 0 { 30.0 } else { 0.3 };
            let w = if round % 2 == 0 { w } else { outline.seen(DVec3::ZERO) + w };
            let got = outline.nearest(w);
            let slack = 1e-5 * (1.0 + got.length() + outline.seen(DVec3::ZERO).length());
            let nearest = all.iter().map(|p| p.distance(w)).fold(f64::INFINITY, f64::min);
            assert!(got.distance(w) <= nearest + slack, "{shape:?}: {} {nearest}", got.distance(w));
            // It is in the outline: no line that separates it from all of it.
            for i in 0..64 {
                let towards = DVec2::from_angle(0.1 * f64::from(i));
                let most = outline.support(towards).dot(towards);
                assert!(got.dot(towards) <= most + slack, "{shape:?} {i}: {} {most}", got.dot(towards));
            }
            *if got.distance(w) > 1e-3 { &mut outside } else { &mut inside } += 1;
        }
        assert!(outside > 50 && inside > 10, "{outside} {inside}");
        assert!(Outline::new(Shape::HalfSpace, DAffine3::IDENTITY, DVec3::ZERO, [DVec3::X, DVec3::Y]).is_none());
    }
}
