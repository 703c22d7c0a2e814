//! Functions of numbers over lanes, made of exactly rounded operations: every width gives the same bits.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::{Lanes, Real};

/// Largest argument of [`arctangent`]: the tangent of pi / 8.
const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// Taylor's terms of sin(sqrt x) / sqrt x.
const SINE: [f64; 8] = [
    1.0,
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
];

/// Taylor's terms of cos(sqrt x).
const COSINE: [f64; 9] = [
    1.0,
    -0.5,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// The nearest whole number, the even one of two; of numbers up to 2^51 (`f64`) or 2^22 (`f32`) in absolute value.
#[inline(always)]
pub fn round<V: Lanes>(x: V) -> V {
    // 1.5 times the number from which on all numbers are whole: the sum has no digits behind the point.
    let large = V::constant(0.75 / V::Scalar::EPSILON.to_f64());
    (x + large) - large
}

/// `x` less the largest whole number that is not above it, 0 to 1; of numbers as in [`round`].
#[inline(always)]
pub fn fraction<V: Lanes>(x: V) -> V {
    let from_nearest = x - round(x);
    let zero = V::constant(0.0);
    V::select(from_nearest.cmp_lt(zero), from_nearest + V::constant(1.0), from_nearest)
}

/// The nearest multiple of 1 / `steps`, a power of two; of numbers as in [`round`], divided by `steps`.
#[inline(always)]
pub fn to_steps<V: Lanes>(x: V, steps: f64) -> V {
    let large = V::constant(0.75 / V::Scalar::EPSILON.to_f64() / steps);
    (x + large) - large
}

/// Sine of `x` full turns, half a turn at most. Within 4e-9, beside roundings: the polynomial through six Chebyshev nodes of
/// sin(2 pi sqrt u) / (sqrt u (1/4 - u)), so that zeros are exact.
#[inline(always)]
pub fn sine_of_part<V: Lanes>(x: V) -> V {
    let terms = [
        25.132_741_154_710_772,
        -64.835_822_721_475_301,
        67.076_623_066_421_579,
        -38.495_830_637_736_187,
        14.049_443_530_985_525,
        -3.161_249_825_195_937_7,
    ];
    let square = x * x;
    polynomial(square, &terms) * ((V::constant(0.25) - square) * x)
}

/// Sine and cosine of angles up to pi / 4 in absolute value: Taylor polynomials whose first omitted term is below
/// 2^-52 there.
#[inline(always)]
pub fn sin_cos_eighth<V: Lanes>(x: V) -> (V, V) {
    let square = x * x;
    (polynomial(square, &SINE) * x, polynomial(square, &COSINE))
}

/// The angle of the point (`x`, `y`) from the x axis, -pi to pi; 0 at the origin. `|x| + |y|` must not overflow. Good to
/// three roundings.
#[inline(always)]
pub fn angle_of<V: Lanes>(y: V, x: V) -> V {
    let zero = V::constant(0.0);
    let (across, up) = (x.abs(), y.abs());
    let is_steep = across.cmp_lt(up);
    let (small, large) = (V::select(is_steep, across, up), V::select(is_steep, up, across));
    // Beyond an eighth of a half-turn measured from the diagonal: tan(a - pi/4) = (tan a - 1) / (tan a + 1).
    let is_wide = (large * V::constant(TAN_PI_8)).cmp_lt(small);
    let above = V::select(is_wide, small - large, small);
    let below = V::select(is_wide, small + large, large);
    let below = V::select(below.cmp_eq(zero), V::constant(1.0), below);
    let part = arctangent(above / below) + V::select(is_wide, V::constant(FRAC_PI_4), zero);
    let part = V::select(is_steep, V::constant(FRAC_PI_2) - part, part);
    let part = V::select(x.cmp_lt(zero), V::constant(PI) - part, part);
    V::select(y.cmp_lt(zero), -part, part)
}

/// Arctangent of numbers up to tan(pi / 8) in absolute value: the polynomial through twelve Chebyshev nodes of
/// atan(sqrt u) / sqrt u, within 2e-18 of it.
#[inline(always)]
fn arctangent<V: Lanes>(x: V) -> V {
    let terms = [
        1.0,
        -0.333_333_333_333_331_2,
        0.199_999_999_999_408_9,
        -0.142_857_142_792_501_92,
        0.111_111_107_449_170_34,
        -0.090_908_968_089_881_35,
        0.076_920_453_295_390_92,
        -0.066_629_517_979_556_37,
        0.058_468_781_818_920_52,
        -0.050_351_019_300_160_78,
        0.037_965_243_910_971_95,
        -0.017_805_382_196_606_493,
    ];
    polynomial(x * x, &terms) * x
}

/// The sum of `terms[k] * x^k`.
#[inline(always)]
fn polynomial<V: Lanes>(x: V, terms: &[f64]) -> V {
    let (&last, others) = terms.split_last().unwrap_or((&0.0, &[]));
    others.iter().rev().fold(V::constant(last), |sum, &term| sum.mul_add(x, V::constant(term)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{f32x16, f64x8};

    #[test]
    fn whole_numbers_and_fractions() {
        for (x, rounded, part) in
            [(0.0, 0.0, 0.0), (2.25, 2.0, 0.25), (-0.25, 0.0, 0.75), (2.5, 2.0, 0.5), (-7.0, -7.0, 0.0)]
        {
            assert_eq!((round(x), fraction(x)), (rounded, part));
            assert_eq!((round(x as f32), fraction(x as f32)), (rounded as f32, part as f32));
        }
        assert_eq!((round(2.25e15), fraction(2.25e15)), (2.25e15, 0.0));
    }

    #[test]
    fn sines_of_parts_of_turns() {
        for k in -1000..=1000 {
            let x = f64::from(k) / 2000.0;
            let exact = (x * 2.0 * PI).sin();
            assert!((sine_of_part(x) - exact).abs() < 4e-9, "{x}");
            assert!((f64::from(sine_of_part(x as f32)) - exact).abs() < 1e-6, "{x}");
        }
        assert_eq!([-0.5, 0.0, 0.5].map(sine_of_part), [0.0; 3]);
    }

    #[test]
    fn steps_of_a_unit() {
        for k in -5000..5000 {
            let x = f64::from(k) * 0.000_37;
            let exact = (x * 64.0).round_ties_even() / 64.0;
            assert_eq!((to_steps(x, 64.0), f64::from(to_steps(x as f32, 64.0))), (exact, exact), "{x}");
        }
    }

    #[test]
    fn sines_and_cosines() {
        for k in -100..=100 {
            let x = f64::from(k) / 100.0 * FRAC_PI_4;
            let (sin, cos) = sin_cos_eighth(x);
            assert!((sin - x.sin()).abs() < 4e-16 && (cos - x.cos()).abs() < 4e-16, "{x}");
        }
    }

    #[test]
    fn angles_all_around() {
        for k in -1000..=1000 {
            for radius in [1e-20, 0.3, 1.0, 1e12] {
                let angle = f64::from(k) / 1000.0 * PI;
                let (x, y) = (radius * angle.cos(), radius * angle.sin());
                let exact = y.atan2(x);
                assert!((angle_of(y, x) - exact).abs() < 1e-15, "{angle} {radius}");
                let narrow = f64::from(angle_of(y as f32, x as f32));
                let exact = f64::from(y as f32).atan2(f64::from(x as f32));
                assert!((narrow - exact).abs() < 1e-6, "{angle} {radius}");
            }
        }
        for (y, x, exact) in
            [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, PI), (1.0, 0.0, FRAC_PI_2), (-2.0, 0.0, -FRAC_PI_2)]
        {
            assert_eq!(angle_of(y, x), exact);
        }
    }

    #[test]
    fn vectors_give_the_bits_of_scalars() {
        let numbers: [f64; 8] = std::array::from_fn(|k| (k as f64 - 3.7) * 1.3);
        let (x, y) = (f64x8::new(numbers), f64x8::new(numbers.map(|x| x * x - 5.0)));
        let (sines, angles) = (sine_of_part(x).to_array(), angle_of(y, x).to_array());
        for k in 0..8 {
            let (x, y) = (numbers[k], numbers[k] * numbers[k] - 5.0);
            assert_eq!(
                (sines[k].to_bits(), angles[k].to_bits()),
                (sine_of_part(x).to_bits(), angle_of(y, x).to_bits())
            );
        }
        let numbers: [f32; 16] = std::array::from_fn(|k| (k as f32 - 7.7) * 0.3);
        let sines = sine_of_part(f32x16::new(numbers)).to_array();
        (0..16).for_each(|k| assert_eq!(sines[k].to_bits(), sine_of_part(numbers[k]).to_bits()));
    }
}
