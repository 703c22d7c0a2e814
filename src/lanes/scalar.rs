//! Width 1: the scalars themselves.

use super::{LaneMask, Lanes, Real, rows, words};

impl LaneMask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits & 1 != 0
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

macro_rules! scalar_lanes {
    ($t:ident, $octo:ident, $wide:ident, $children:ident, $marks:path, $word:path $(, $transposed:path, $reached:path)?) => {
        impl Lanes for $t {
            type Scalar = $t;
            type Mask = bool;
            const N: usize = 1;

            #[inline(always)]
            fn splat(x: $t) -> Self {
                x
            }
            #[inline(always)]
            fn load(from: &[$t]) -> Self {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$t]) {
                to[0] = self;
            }
            #[inline(always)]
            fn lane(self, _: usize) -> $t {
                self
            }
            #[inline(always)]
            fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
                if mask { if_true } else { if_false }
            }
            #[inline(always)]
            fn kept(self, mask: bool) -> Self {
                if mask { self } else { 0.0 }
            }
            #[inline(always)]
            fn fast_min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn fast_max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                // Without the instruction, `f32::mul_add` is a slow library call that still rounds once; the
                // vectors then round twice, so the scalar must too.
                if cfg!(any(target_feature = "fma", target_feature = "neon")) {
                    $t::mul_add(self, b, c)
                } else {
                    self * b + c
                }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $t::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn turned_as(self, sign: Self) -> Self {
                $t::from_bits(self.to_bits() ^ sign.to_bits() & (-0.0 as $t).to_bits())
            }
            #[inline(always)]
            fn with_bits(self, mask: bool, bits: Self) -> Self {
                $t::from_bits(if mask { self.to_bits() | bits.to_bits() } else { self.to_bits() })
            }
            #[inline(always)]
            fn cmp_lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn cmp_le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn cmp_eq(self, other: Self) -> bool {
                self == other
            }
        }

        impl Real for $t {
            type Octo = super::$octo;
            type Wide = super::$wide;
            type Children = super::$children;
            const EPSILON: Self = $t::EPSILON / 2.0;
            const MIN_POSITIVE: Self = $t::MIN_POSITIVE;
            const MAX: Self = $t::MAX;
            const INFINITY: Self = $t::INFINITY;
            const LOWEST: Self = $t::NEG_INFINITY;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                $t::is_finite(self)
            }
            fn next_down(self) -> Self {
                $t::next_down(self)
            }
            fn next_up(self) -> Self {
                $t::next_up(self)
            }
            #[inline(always)]
            fn marks(bit: usize) -> [Self; 2] {
                // Tables: a vector of one number is read faster than made of a register's.
                static LOW: [$t; 64] = $marks(0);
                static HIGH: [$t; 64] = $marks(1);
                [LOW[bit % 64], HIGH[bit % 64]]
            }
            #[inline(always)]
            fn word(halves: [Self; 2]) -> u64 {
                $word(halves)
            }
            $(
                #[inline(always)]
                fn transposed(block: &[[Self; rows::ROW]; rows::ROW]) -> [[Self; rows::ROW]; rows::ROW] {
                    $transposed(block)
                }
                #[inline(always)]
                fn reached(self, of: &[Self; 64]) -> u64 {
                    $reached(self, of)
                }
            )?
        }
    };
}

/// The lower (0) or upper (1) half of words of which each has another bit set.
const fn marks32(half: usize) -> [f32; 64] {
    let (mut marks, mut bit) = ([0.0; 64], 0);
    while bit < 32 {
        marks[32 * half + bit] = f32::from_bits(1 << bit);
        bit += 1;
    }
    marks
}

/// All of them; there is no second half.
const fn marks64(half: usize) -> [f64; 64] {
    let (mut marks, mut bit) = ([0.0; 64], 0);
    while bit < 64 && half == 0 {
        marks[bit] = f64::from_bits(1 << bit);
        bit += 1;
    }
    marks
}

#[inline(always)]
fn word32([low, high]: [f32; 2]) -> u64 {
    u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32
}

#[inline(always)]
fn word64([word, _]: [f64; 2]) -> u64 {
    word.to_bits()
}

#[cfg(target_feature = "avx512f")]
scalar_lanes!(f32, f32x8, f32x16, f32x16, marks32, word32, rows::transposed_floats, words::reached);
#[cfg(not(target_feature = "avx512f"))]
scalar_lanes!(f32, f32x8, f32x16, f32x8, marks32, word32, rows::transposed_floats, words::reached);
scalar_lanes!(f64, f64x8, f64x8, f64x8, marks64, word64);
