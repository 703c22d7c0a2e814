//! Every width computes what the scalar computes, to the bit, also for NaN, infinities and zeros of both signs.

use super::*;

/// A small linear congruential generator: enough to shuffle bits.
pub(super) fn numbers() -> impl FnMut() -> u32 {
    let mut state = 12345u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 32) as u32
    }
}

/// Numbers that find the traps: signs, zeros, denormals, infinities, NaN.
const HARD: [f64; 12] =
    [0.0, -0.0, 1.0, -1.0, 1.5, -3.25, 1e-40, -1e-40, 3e38, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

fn bits<S: Real>(x: S) -> u64 {
    // All NaNs count as one: their payloads are not specified.
    let wide = x.to_f64();
    if wide.is_nan() { u64::MAX } else { wide.to_bits() }
}

type Operation<S> = fn(S, S, S) -> S;
type Comparison<S> = fn(S, S) -> bool;

fn check_width<V: Lanes>() {
    let hard: Vec<V::Scalar> = HARD.iter().map(|&x| V::Scalar::from_f64(x)).collect();
    for start in 0..hard.len() {
        for shift in 0..hard.len() {
            let a: Vec<V::Scalar> = (0..V::N).map(|i| hard[(start + i) % hard.len()]).collect();
            let b: Vec<V::Scalar> = (0..V::N).map(|i| hard[(start + 5 * i + shift) % hard.len()]).collect();
            let c: Vec<V::Scalar> = (0..V::N).map(|i| hard[(start + 7 * i + 3 * shift) % hard.len()]).collect();
            let (va, vb, vc) = (V::load(&a), V::load(&b), V::load(&c));
            let pairs: [(V, Operation<V::Scalar>); 14] = [
                (va + vb, |a, b, _| a + b),
                (va - vb, |a, b, _| a - b),
                (va * vb, |a, b, _| a * b),
                (va / vb, |a, b, _| a / b),
                (-va, |a, _, _| -a),
                (va.abs(), |a, _, _| a.abs()),
                (va.sqrt(), |a, _, _| a.sqrt()),
                (va.fast_min(vb), |a, b, _| a.fast_min(b)),
                (va.fast_max(vb), |a, b, _| a.fast_max(b)),
                (va.mul_add(vb, vc), |a, b, c| a.mul_add(b, c)),
                (V::select(va.cmp_lt(vb), va, vc), |a, b, c| if a < b { a } else { c }),
                (va.kept(va.cmp_lt(vb)), |a, b, _| if a < b { a } else { V::Scalar::ZERO }),
                (va.turned_as(vb), |a, b, _| if b.to_f64().is_sign_negative() { -a } else { a }),
                (finite_rcp(va), |a, _, _| finite_rcp(a)),
            ];
            for (op, (vector, scalar)) in pairs.into_iter().enumerate() {
                for i in 0..V::N {
                    let (got, want) = (vector.lane(i), scalar(a[i], b[i], c[i]));
                    assert_eq!(bits(got), bits(want), "op {op} lane {i}/{}: {:?} {:?} {:?}", V::N, a[i], b[i], c[i]);
                }
            }
            let masks: [(V::Mask, Comparison<V::Scalar>); 5] = [
                (va.cmp_lt(vb), |a, b| a < b),
                (va.cmp_le(vb), |a, b| a <= b),
                (va.cmp_eq(vb), |a, b| a == b),
                (va.cmp_gt(vb), |a, b| a > b),
                (va.cmp_ge(vb), |a, b| a >= b),
            ];
            for (mask, scalar) in masks {
                let want = (0..V::N).fold(0, |m, i| m | u32::from(scalar(a[i], b[i])) << i);
                assert_eq!(mask.bits(), want);
                assert_eq!(mask.any(), want != 0);
                assert_eq!((!mask).bits() & V::ALL, !want & V::ALL);
            }
            let among = V::Mask::from_bits(0b0110_1101_1010_0101 & V::ALL);
            assert_eq!(va.cmp_lt_in(vb, among).bits(), va.cmp_lt(vb).bits() & among.bits());
            assert_eq!(va.cmp_le_in(vb, among).bits(), va.cmp_le(vb).bits() & among.bits());
            assert_eq!(va.cmp_le_in(vb, vb.cmp_lt(vc)).bits(), va.cmp_le(vb).bits() & vb.cmp_lt(vc).bits());
        }
    }
    let numbers: Vec<V::Scalar> =
        (0..V::N).map(|i| V::Scalar::from_f64(f64::from((i * 7 % 16) as u32) - 6.0)).collect();
    for mask in 1..=V::ALL.min(0xfff) {
        let of = |pick: fn(V::Scalar, V::Scalar) -> V::Scalar| {
            (0..V::N).filter(|i| mask >> i & 1 != 0).map(|i| numbers[i]).reduce(pick).unwrap()
        };
        let want = (of(|a, b| if b < a { b } else { a }), of(|a, b| if b > a { b } else { a }));
        assert!(V::load(&numbers).range(mask) == want, "mask {mask:b}");
    }
    for bits in [0, 1, V::ALL, V::ALL & 0x5555, V::ALL & 0xaaaa, V::ALL >> 1] {
        assert_eq!(V::Mask::from_bits(bits).bits(), bits);
        assert_eq!((V::Mask::from_bits(bits) & V::Mask::from_bits(3)).bits(), bits & 3 & V::ALL);
        assert_eq!((V::Mask::from_bits(bits) | V::Mask::from_bits(3)).bits(), bits | 3 & V::ALL);
    }
}

#[test]
fn f32_widths_equal_the_scalar() {
    check_width::<f32>();
    check_width::<f32x4>();
    check_width::<f32x8>();
    check_width::<f32x16>();
}

#[test]
fn f64_widths_equal_the_scalar() {
    check_width::<f64>();
    check_width::<f64x2>();
    check_width::<f64x4>();
    check_width::<f64x8>();
    check_width::<Pair<f64x8>>();
}

#[test]
fn fast_min_and_max_return_the_second_operand_on_nan() {
    fn check<V: Lanes>() {
        let (nan, one) = (V::constant(f64::NAN), V::constant(1.0));
        assert_eq!(nan.fast_min(one).lane(0).to_f64(), 1.0);
        assert_eq!(nan.fast_max(one).lane(V::N - 1).to_f64(), 1.0);
        assert!(one.fast_min(nan).lane(0).to_f64().is_nan());
        assert!(one.fast_max(nan).lane(V::N - 1).to_f64().is_nan());
    }
    check::<f32>();
    check::<f32x4>();
    check::<f32x8>();
    check::<f32x16>();
    check::<f64x2>();
    check::<f64x4>();
    check::<f64x8>();
    check::<Pair<f64x8>>();
}

#[test]
fn division_is_exact_where_the_crate_offers_an_estimate() {
    // 1/3 from a 12-bit reciprocal estimate would differ in the last bits.
    for x in [3.0f32, 7.0, 1e-3, 12345.678] {
        let want = (1.0 / x).to_bits();
        assert_eq!((f32x8::constant(1.0) / f32x8::splat(x)).lane(3).to_bits(), want);
        assert_eq!((f32x16::constant(1.0) / f32x16::splat(x)).lane(9).to_bits(), want);
        assert_eq!(finite_rcp(f32x4::splat(x)).lane(0).to_bits(), want);
    }
}

#[test]
fn finite_rcp_is_finite() {
    for x in [0.0f32, -0.0, 1e-45, -1e-45, f32::MIN_POSITIVE, -f32::MIN_POSITIVE, f32::MAX] {
        assert!(finite_rcp(x).is_finite(), "{x}");
    }
}
