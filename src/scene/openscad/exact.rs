//! On which side of a plane a point is, exactly.
//!
//! Source: J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! Discrete & Computational Geometry 18, 1997. Here is no step between the rounded determinant and the sum of all its
//! terms.

use std::cmp::Ordering;

use glam::DVec3;

/// The paper's bound of what rounding does to the determinant.
const BOUND: f64 = (7.0 + 56.0 * f64::EPSILON) * f64::EPSILON / 2.0;

/// `Greater` if `p` is on the side of the plane through `a`, `b` and `c` from where they go counter-clockwise, `Equal`
/// if it is in the plane. Products of three coordinates must be neither infinite nor subnormal.
pub(super) fn side(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> Ordering {
    let (u, v, w) = (a - p, b - p, c - p);
    let (m, n) = (v.cross(w), DVec3::new(v.y.abs(), v.z.abs(), v.x.abs()));
    let o = DVec3::new(v.z.abs(), v.x.abs(), v.y.abs());
    let rounded = u.dot(m);
    // The products without their signs.
    let permanent = n * DVec3::new(w.z.abs(), w.x.abs(), w.y.abs()) + o * DVec3::new(w.y.abs(), w.z.abs(), w.x.abs());
    // Turned about: (a - p) x (b - p) . (c - p) is positive for points behind.
    if rounded.abs() > BOUND * permanent.dot(u.abs()) {
        return if rounded < 0.0 { Ordering::Greater } else { Ordering::Less };
    }
    exactly([a, b, c, p]).reverse()
}

/// The sign of the determinant of the points, each with a 1 behind it.
fn exactly(points: [DVec3; 4]) -> Ordering {
    let mut sum = Sum::default();
    for (i, skipped) in [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].into_iter().enumerate() {
        // The minor of the ones' column, whose signs begin with - and alternate.
        let [u, v, w] = skipped.map(|k| points[k]);
        let sign = if i % 2 == 0 { -1.0 } else { 1.0 };
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            sum.add_product(sign * u[axis], v[next], w[last]);
            sum.add_product(-sign * u[axis], v[last], w[next]);
        }
    }
    sum.sign()
}

/// A sum without any rounding, as numbers whose digits do not overlap, the largest last.
#[derive(Default)]
struct Sum {
    parts: Vec<f64>,
}

impl Sum {
    fn add(&mut self, mut more: f64) {
        for part in &mut self.parts {
            (more, *part) = two_sum(more, *part);
        }
        self.parts.push(more);
        self.parts.retain(|&part| part != 0.0);
    }

    fn add_product(&mut self, x: f64, y: f64, z: f64) {
        let (high, low) = two_product(x, y);
        for factor in [low, high] {
            let (product, rest) = two_product(factor, z);
            self.add(rest);
            self.add(product);
        }
    }

    fn sign(&self) -> Ordering {
        self.parts.last().map_or(Ordering::Equal, |last| last.partial_cmp(&0.0).unwrap_or(Ordering::Equal))
    }
}

/// The rounded product, and what rounding took from it.
fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

/// The rounded sum, and what rounding took from it (D. E. Knuth, "The Art of Computer Programming", volume 2).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_those_of_whole_numbers() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as i64 % 5 - 2
        };
        for round in 0..20_000 {
            let p: [[i64; 3]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
            let [u, v, w] = [0, 1, 2].map(|i| [0, 1, 2].map(|k| p[i][k] - p[3][k]));
            let det = u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
                + u[2] * (v[0] * w[1] - v[1] * w[0]);
            // Numbers with digits far apart, all scaled alike: the rounded determinant alone would not do.
            let far = [1.0, 0.1, 1e-3 / 3.0][round % 3];
            let [a, b, c, d] = p.map(|q| DVec3::from(q.map(|x| x as f64 * far)));
            if round % 3 == 0 {
                assert_eq!(side(a, b, c, d), 0.cmp(&det), "{p:?}");
            }
            assert_eq!(side(a, b, c, d), side(b, c, a, d));
            assert_eq!(side(a, b, c, d), side(b, a, c, d).reverse());
            assert_eq!(side(a, b, c, d), side(a, b, d, c).reverse());
        }
        // Above the plane z = 0, by the least there is.
        let above = side(DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.3, 0.3, 1e-200));
        assert_eq!(above, Ordering::Greater);
    }
}
