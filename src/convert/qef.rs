//! The point nearest to several planes.

use glam::{DMat3, DVec3};

/// Directions in which the planes' normals spread less than this share of the most (squared) are not fixed by them.
/// At the scale it is asked (see [`super::settle`]) what is less is curvature, or an edge of less than about 8
/// degrees.
const FLAT: f64 = 0.005;

/// A point of the surface and the unit normal there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Where.
    pub point: DVec3,
    /// Unit normal, outward.
    pub normal: DVec3,
}

/// The quadratic error of some planes: the sum of squared distances from them.
///
/// Source: T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data", 2002, section 2.3; here
/// with the eigenvectors of the normal equations.
#[derive(Clone, Copy, Debug)]
pub struct Qef {
    /// Mean of the points.
    pub middle: DVec3,
    /// Directions, the one that is fixed best first.
    pub axes: [DVec3; 3],
    /// How well each is fixed.
    pub values: [f64; 3],
    /// What is left to do along each.
    steps: [f64; 3],
}

impl Qef {
    /// Of `planes`, not empty.
    pub fn new(planes: &[Plane]) -> Self {
        let middle = planes.iter().map(|p| p.point).sum::<DVec3>() / planes.len().max(1) as f64;
        let (mut ata, mut atb) = (DMat3::ZERO, DVec3::ZERO);
        for Plane { point, normal } in planes {
            let column = |x: f64| *normal * x;
            ata += DMat3::from_cols(column(normal.x), column(normal.y), column(normal.z));
            atb += *normal * normal.dot(*point - middle);
        }
        let mut found = eigen(ata);
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let axes = found.map(|(_, axis)| axis);
        Self { middle, axes, values: found.map(|(value, _)| value), steps: axes.map(|axis| axis.dot(atb)) }
    }

    /// How many directions the planes fix: 1 for a surface, 2 for an edge, 3 for a corner.
    pub fn rank(&self) -> usize {
        1 + self.values[1..].iter().filter(|value| **value > FLAT * self.values[0]).count()
    }

    /// Whether all normals are the same.
    pub fn is_flat(&self) -> bool {
        self.values[1] <= 1e-9 * self.values[0]
    }

    /// The point with the least error in the first `rank` directions; in the others that of the middle.
    pub fn point(&self, rank: usize) -> DVec3 {
        let step =
            |i: usize| if self.values[i] > 0.0 { self.axes[i] * (self.steps[i] / self.values[i]) } else { DVec3::ZERO };
        self.middle + (0..rank).map(step).sum::<DVec3>()
    }
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi's rotations (1846).
fn eigen(symmetric: DMat3) -> [(f64, DVec3); 3] {
    let (mut a, mut axes) = (symmetric.to_cols_array_2d(), DMat3::IDENTITY.to_cols_array_2d());
    // Convergence is quadratic: a few rounds reach the last digit.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                (axes[p][k], axes[q][k]) = (c * axes[p][k] - s * axes[q][k], s * axes[p][k] + c * axes[q][k]);
            }
        }
    }
    [0, 1, 2].map(|i| (a[i][i], DVec3::from_array(axes[i])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_of_a_turned_diagonal() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
        let matrix = turn * DMat3::from_diagonal(DVec3::new(3.0, 0.5, 1e-4)) * turn.transpose();
        for (value, axis) in eigen(matrix) {
            assert!((matrix * axis - axis * value).length() < 1e-15 && (axis.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn corners_edges_and_planes() {
        let corner = DVec3::new(0.3, 0.6, 0.2);
        let plane = |n: &DVec3| Plane { point: corner + n.any_orthogonal_vector() * 0.2, normal: *n };
        let of = |n: &[DVec3]| Qef::new(&n.iter().map(plane).collect::<Vec<_>>());
        let got = of(&[DVec3::X, DVec3::Y, DVec3::Z]);
        assert!(got.rank() == 3 && (got.point(3) - corner).length() < 1e-15, "{got:?}");
        let got = of(&[DVec3::X, DVec3::Y, DVec3::Y]);
        let point = got.point(2);
        assert!(got.rank() == 2 && !got.is_flat(), "{got:?}");
        assert!((point.x - 0.3).abs() < 1e-15 && (point.y - 0.6).abs() < 1e-15, "{point}");
        assert!((point.z - got.middle.z).abs() < 1e-15, "along the edge, the middle's");
        let got = of(&[DVec3::Y, DVec3::Y]);
        assert!(got.rank() == 1 && got.is_flat() && (got.point(1).y - 0.6).abs() < 1e-15);
    }
}
