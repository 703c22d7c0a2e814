//! Functions of a cosine in tables: directional albedos of facets, found by quadrature.
//!
//! Facets of width alpha change their ways where the cosine is about alpha, glass at its critical angle: cells are
//! narrow in both places.

use rayon::prelude::*;

use super::conductor::reflected;
use super::fresnel;
use super::ggx::Ggx;
use crate::lanes::{Lanes, MAX_LANES, Real, dot};

/// Cells of a table.
const CELLS: usize = 128;
/// Points of a Fibonacci lattice, and the number before.
const LATTICE: [u32; 2] = [2584, 1597];
/// The least cosine that is looked at.
const LEAST: f64 = 1e-6;

/// A function of the cosine between a direction and the normal, linear between its knots.
#[derive(Clone, Debug)]
pub struct Curve {
    alpha: f64,
    knots: Vec<f64>,
}

/// Which knot is before a cosine, as a number whose fraction is the way to the next.
#[inline(always)]
pub fn place<V: Lanes>(cos: V, alpha: V) -> V {
    let (one, half) = (V::constant(1.0), V::constant(0.5));
    let cos = cos.abs().fast_min(one).fast_max(V::constant(LEAST));
    let twice = alpha + alpha;
    let near = (cos * (one + twice) / (cos + twice)).sqrt();
    V::constant(CELLS as f64) * half * (near + cos)
}

/// Of each lane of `place` (see [`place`]), `value` of the lane, the knot before and the way from it.
#[inline(always)]
pub fn look_up<V: Lanes>(place: V, value: impl Fn(usize, usize, f64) -> f64) -> V {
    let mut column = [V::Scalar::ZERO; MAX_LANES];
    place.store(&mut column);
    for (lane, x) in column.iter_mut().enumerate().take(V::N) {
        let at = x.to_f64();
        let cell = (at as usize).min(CELLS - 1);
        *x = V::Scalar::from_f64(value(lane, cell, at - cell as f64));
    }
    V::load(&column)
}

/// The cosine at `place`: by halving, since [`place`] rises with it.
fn cosine(target: f64, alpha: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if place(middle, alpha) < target { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

impl Curve {
    /// `f` of the cosine, for facets of width `alpha`.
    pub fn new(alpha: f64, f: impl Fn(f64) -> f64 + Sync) -> Self {
        let knots = (0..=CELLS).into_par_iter().map(|i| f(cosine(i as f64, alpha).max(LEAST))).collect();
        Self { alpha, knots }
    }

    /// Two functions, worked out together.
    pub fn pair(alpha: f64, f: impl Fn(f64) -> [f64; 2] + Sync) -> [Self; 2] {
        let both: Vec<[f64; 2]> = (0..=CELLS).into_par_iter().map(|i| f(cosine(i as f64, alpha).max(LEAST))).collect();
        [0, 1].map(|k| Self { alpha, knots: both.iter().map(|values| values[k]).collect() })
    }

    /// Nothing.
    pub fn zero(alpha: f64) -> Self {
        Self { alpha, knots: vec![0.0; CELLS + 1] }
    }

    /// Width of the facets.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The value `rest` of the way from knot `cell` to the next.
    #[inline(always)]
    pub fn at(&self, cell: usize, rest: f64) -> f64 {
        let [a, b] = [self.knots[cell], self.knots[cell + 1]];
        (b - a).mul_add(rest, a)
    }

    /// The value at cosine `cos`.
    #[cfg(test)]
    pub fn of(&self, cos: f64) -> f64 {
        look_up(place(cos, self.alpha), |_, cell, rest| self.at(cell, rest))
    }

    /// Mean over the hemisphere, weighted by the cosine, of just what the table says.
    pub fn mean(&self) -> f64 {
        const PARTS: usize = 8;
        let square = |part: usize| cosine(part as f64 / PARTS as f64, self.alpha).powi(2);
        let mut last = square(0);
        let mut sum = 0.0;
        for part in 0..CELLS * PARTS {
            let next = square(part + 1);
            let rest = ((part % PARTS) as f64 + 0.5) / PARTS as f64;
            sum += self.at(part / PARTS, rest) * (next - last);
            last = next;
        }
        sum
    }
}

/// Mean over the facets of width `alpha` that are visible under the cosine `cos` of `f`: of the cosine on the facet,
/// the share of what it mirrors that gets away, and the share of what it refracts into index `eta`.
pub fn by_facets(alpha: f64, eta: f64, cos: f64, f: impl Fn(f64, f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    each_facet(alpha, eta, cos, |met, up, down| sum += f(met, up, down));
    sum / f64::from(LATTICE[0])
}

/// The same of two functions of the cosine on the facet and the share of what it mirrors that gets away.
pub fn two_by_facets(alpha: f64, cos: f64, f: impl Fn(f64, f64) -> [f64; 2]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    each_facet(alpha, 1.5, cos, |met, up, _| {
        let [a, b] = f(met, up);
        sum = [sum[0] + a, sum[1] + b];
    });
    sum.map(|x| x / f64::from(LATTICE[0]))
}

fn each_facet(alpha: f64, eta: f64, cos: f64, mut visit: impl FnMut(f64, f64, f64)) {
    let ggx = Ggx::new(alpha);
    let wo = [(1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos];
    let [count, step] = LATTICE;
    for k in 0..count {
        let second = f64::from((u64::from(k) * u64::from(step) % u64::from(count)) as u32);
        let h = ggx.visible(wo, [f64::from(k), second].map(|x| (x + 0.5) / f64::from(count)));
        let (up, kept, _) = reflected(&ggx, wo, h);
        let met = dot(wo, h);
        let (_, cos_t) = fresnel::dielectric(met, eta);
        let down_z = h[2] * (met / eta - cos_t) - wo[2] / eta;
        let down = [(1.0 - down_z * down_z).max(0.0).sqrt(), 0.0, -down_z];
        let passed = if down_z < 0.0 { ggx.masking_both(wo, down) / ggx.masking(wo) } else { 0.0 };
        visit(met, if up[2] > 0.0 { kept } else { 0.0 }, passed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_hold_what_they_are_made_of() {
        for alpha in [1e-3, 0.1, 1.0] {
            let curve = Curve::new(alpha, |cos| cos * cos);
            for i in 1..100 {
                let cos = f64::from(i) / 100.0;
                assert!((curve.of(cos) - cos * cos).abs() < 2e-4, "{alpha} {cos}");
            }
            assert!((curve.of(1.0) - 1.0).abs() < 1e-12 && curve.of(0.0) < 1e-7);
            // The integral of cos^2 2 cos.
            assert!((curve.mean() - 0.5).abs() < 2e-4);
        }
    }

    /// Perfectly smooth facets lose nothing; those of a boundary that is none let all through.
    #[test]
    fn smooth_facets_keep_all() {
        for cos in [0.1, 0.5, 1.0] {
            let kept = by_facets(1e-4, 1.5, cos, |_, up, down| 0.5 * (up + down));
            assert!((kept - 1.0).abs() < 1e-5, "{cos}: {kept}");
        }
    }
}
