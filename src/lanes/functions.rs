//! Functions of numbers over lanes, made of exactly rounded operations: every width gives the same bits.

use super::{Lanes, Real};

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

/// The nearest multiple of 1 / `steps`, a power of two, to `x * factor`, another one, less the nearest whole number: half at
/// most. The product may be as large as numbers in [`round`], divided by `steps`.
#[inline(always)]
pub fn steps_of_part<V: Lanes>(x: V, factor: f64, steps: f64) -> V {
    let whole = 0.75 / V::Scalar::EPSILON.to_f64();
    let large = V::constant(whole / steps);
    let scaled = if factor == 1.0 { x + large } else { x.mul_add(V::constant(factor), large) };
    // There and back again: on the way the steps behind the point get lost.
    let further = V::constant(whole - whole / steps);
    scaled - ((scaled + further) - further)
}

/// `amplitude` times the sine of `x` full turns, half a turn at most. Within 4e-9 of `amplitude`, beside roundings: the polynomial
/// through six Chebyshev nodes of sin(2 pi sqrt u) / (sqrt u (1/4 - u)), so that zeros are exact.
#[inline(always)]
pub fn sine_of_part<V: Lanes>(x: V, amplitude: f64) -> V {
    let terms = [
        25.132_741_154_710_772,
        -64.835_822_721_475_301,
        67.076_623_066_421_579,
        -38.495_830_637_736_187,
        14.049_443_530_985_525,
        -3.161_249_825_195_937_7,
    ]
    .map(|term: f64| term * amplitude);
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

/// The angle of the point (`x`, `up`), `up >= 0`, from the x axis, in full turns: 0 to a half; 0 at the origin. Within 3e-10,
/// beside roundings: the polynomial through ten Chebyshev nodes of atan(sqrt u) / (2 pi sqrt u).
#[inline(always)]
pub fn half_turn_of<V: Lanes>(up: V, x: V) -> V {
    let terms = [
        0.159_154_942_639_982_1,
        -0.053_051_556_913_169_07,
        0.031_827_925_333_186_62,
        -0.022_695_520_481_508_733,
        0.017_399_361_895_010_594,
        -0.013_289_000_021_630_19,
        0.009_086_085_022_529_458,
        -0.004_830_649_312_713_904,
        0.001_669_161_220_339_215_3,
        -0.000_270_749_624_736_473_5,
    ];
    let zero = V::constant(0.0);
    let across = x.abs();
    let (small, large) = (across.fast_min(up), across.fast_max(up));
    let ratio = small / V::select(large.cmp_eq(zero), V::constant(1.0), large);
    let part = polynomial(ratio * ratio, &terms) * ratio;
    let part = V::select(across.cmp_lt(up), V::constant(0.25) - part, part);
    V::select(x.cmp_lt(zero), V::constant(0.5) - part, part)
}

/// The sum of `terms[k] * x^k`.
#[inline(always)]
fn polynomial<V: Lanes>(x: V, terms: &[f64]) -> V {
    let (&last, others) = terms.split_last().unwrap_or((&0.0, &[]));
    others.iter().rev().fold(V::constant(last), |sum, &term| sum.mul_add(x, V::constant(term)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_4, PI, TAU};

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
            assert!((sine_of_part(x, 1.0) - exact).abs() < 4e-9, "{x}");
            assert!((f64::from(sine_of_part(x as f32, 1.0)) - exact).abs() < 1e-6, "{x}");
        }
        assert_eq!([-0.5, 0.0, 0.5].map(|x| sine_of_part(x, 1.0)), [0.0; 3]);
    }

    #[test]
    fn steps_of_parts() {
        for k in -5000..5000 {
            let x = f64::from(k) * 0.000_37;
            for factor in [0.5, 1.0, 4.0] {
                let steps = (x * factor * 64.0).round_ties_even() / 64.0;
                let exact = steps - steps.round_ties_even();
                let found = [steps_of_part(x, factor, 64.0), f64::from(steps_of_part(x as f32, factor, 64.0))];
                assert_eq!(found, [exact; 2], "{x} {factor}");
            }
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
    fn angles_of_half_a_turn() {
        for k in 0..=1000 {
            for radius in [1e-20, 0.3, 1.0, 1e12] {
                let turn = f64::from(k) / 2000.0;
                let (x, up) = (radius * (turn * TAU).cos(), radius * (turn * TAU).sin().abs());
                assert!((half_turn_of(up, x) - turn).abs() < 3e-10, "{turn} {radius}");
                assert!((f64::from(half_turn_of(up as f32, x as f32)) - turn).abs() < 2e-7, "{turn} {radius}");
            }
        }
        for (up, x, exact) in [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.5), (3.0, 0.0, 0.25)] {
            assert_eq!(half_turn_of(up, x), exact);
        }
    }

    #[test]
    fn vectors_give_the_bits_of_scalars() {
        let numbers: [f64; 8] = std::array::from_fn(|k| (k as f64 - 3.7) * 1.3);
        let (x, up) = (f64x8::new(numbers), f64x8::new(numbers.map(|x| x * x)));
        let (sines, turns) = (sine_of_part(x, 1.0).to_array(), half_turn_of(up, x).to_array());
        for k in 0..8 {
            let x = numbers[k];
            let one = (sine_of_part(x, 1.0), half_turn_of(x * x, x));
            assert_eq!((sines[k].to_bits(), turns[k].to_bits()), (one.0.to_bits(), one.1.to_bits()));
        }
        let numbers: [f32; 16] = std::array::from_fn(|k| (k as f32 - 7.7) * 0.3);
        let sines = sine_of_part(f32x16::new(numbers), 1.0).to_array();
        (0..16).for_each(|k| assert_eq!(sines[k].to_bits(), sine_of_part(numbers[k], 1.0).to_bits()));
    }
}
