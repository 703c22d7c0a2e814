//! The point nearest to several planes, inside a box.

use glam::{DMat3, DVec3};

/// Directions in which the planes' normals spread less than this share of the most (squared) are left to the middle
/// of the points: on a curved surface they say nothing, an edge of less than about 4 degrees is taken for curved.
const FLAT: f64 = 1e-3;
/// Points this much outside of the box, in its edges, count as inside.
const SLACK: f64 = 1e-9;

/// The point in the box `lo..hi` with the least sum of squared distances from the planes `(point, unit normal)`;
/// where they do not fix it, the one nearest to the middle of their points. If it is outside of the box, the
/// direction that is fixed least is given up, and so on: a corner, an edge, a surface.
///
/// Source: T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data", 2002, section 2.3; here
/// with the eigenvectors of the normal equations.
pub fn nearest(planes: &[(DVec3, DVec3)], lo: DVec3, hi: DVec3) -> DVec3 {
    let middle = planes.iter().map(|p| p.0).sum::<DVec3>() / planes.len().max(1) as f64;
    let (mut ata, mut atb) = (DMat3::ZERO, DVec3::ZERO);
    for (point, normal) in planes {
        let column = |x: f64| *normal * x;
        ata += DMat3::from_cols(column(normal.x), column(normal.y), column(normal.z));
        atb += *normal * normal.dot(*point - middle);
    }
    let mut axes = eigen(ata);
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fixed = axes.iter().filter(|(value, _)| *value > FLAT * axes[0].0).count();
    let slack = SLACK * (hi - lo);
    for rank in (1..=fixed).rev() {
        let step = |(value, axis): &(f64, DVec3)| *axis * (axis.dot(atb) / value);
        let point = middle + axes[..rank].iter().map(step).sum::<DVec3>();
        if point.cmpge(lo - slack).all() && point.cmple(hi + slack).all() {
            return point.clamp(lo, hi);
        }
    }
    middle.clamp(lo, hi)
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
        let (lo, hi) = (DVec3::ZERO, DVec3::ONE);
        let corner = DVec3::new(0.3, 0.6, 0.2);
        let planes = |n: &[DVec3]| n.iter().map(|n| (corner + n.any_orthogonal_vector() * 0.2, *n)).collect::<Vec<_>>();
        let got = nearest(&planes(&[DVec3::X, DVec3::Y, DVec3::Z]), lo, hi);
        assert!((got - corner).length() < 1e-15, "{got}");
        let got = nearest(&planes(&[DVec3::X, DVec3::Y]), lo, hi);
        assert!((got.x - 0.3).abs() < 1e-15 && (got.y - 0.6).abs() < 1e-15, "{got}");
        // Two planes that meet outside of the box: on neither of them, between their points.
        let far = [(DVec3::new(0.5, 0.0, 0.0), DVec3::X), (DVec3::new(0.6, 1.0, 0.0), DVec3::new(0.9, -0.1, 0.0))];
        let got = nearest(&far.map(|(p, n)| (p, n.normalize())), lo, hi);
        assert!((0.5..0.6).contains(&got.x), "{got}");
    }
}
