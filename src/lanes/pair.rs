//! Two vectors side by side: 16 lanes of f64 from two `f64x8`.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{LaneMask, Lanes};

/// Lanes `0..N/2` in the first, `N/2..N` in the second vector (or mask).
#[derive(Clone, Copy, Debug)]
pub struct Pair<V>(pub V, pub V);

/// The masks of a [`Pair`], with the width of one half.
#[derive(Clone, Copy, Debug)]
pub struct PairMask<M, const HALF: usize>(M, M);

macro_rules! by_halves {
    ($trait:ident, $method:ident) => {
        impl<V: Lanes> $trait for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0), $trait::$method(self.1, other.1))
            }
        }
    };
}
by_halves!(Add, add);
by_halves!(Sub, sub);
by_halves!(Mul, mul);
by_halves!(Div, div);

impl<V: Lanes> Neg for Pair<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<M: LaneMask, const HALF: usize> BitAnd for PairMask<M, HALF> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}
impl<M: LaneMask, const HALF: usize> BitOr for PairMask<M, HALF> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}
impl<M: LaneMask, const HALF: usize> Not for PairMask<M, HALF> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}
impl<M: LaneMask, const HALF: usize> LaneMask for PairMask<M, HALF> {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.bits() | self.1.bits() << HALF
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(M::from_bits(bits), M::from_bits(bits >> HALF))
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.any() || self.1.any()
    }
}

macro_rules! pair_lanes {
    ($v:ident, $half:literal) => {
        impl Lanes for Pair<super::$v> {
            type Scalar = <super::$v as Lanes>::Scalar;
            type Mask = PairMask<<super::$v as Lanes>::Mask, $half>;
            const N: usize = 2 * $half;

            #[inline(always)]
            fn splat(x: Self::Scalar) -> Self {
                Self(Lanes::splat(x), Lanes::splat(x))
            }
            #[inline(always)]
            fn load(from: &[Self::Scalar]) -> Self {
                Self(Lanes::load(from), Lanes::load(&from[$half..]))
            }
            #[inline(always)]
            fn store(self, to: &mut [Self::Scalar]) {
                Lanes::store(self.0, to);
                Lanes::store(self.1, &mut to[$half..]);
            }
            #[inline(always)]
            fn lane(self, i: usize) -> Self::Scalar {
                if i < $half { self.0.lane(i) } else { self.1.lane(i - $half) }
            }
            #[inline(always)]
            fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
                Self(Lanes::select(mask.0, if_true.0, if_false.0), Lanes::select(mask.1, if_true.1, if_false.1))
            }
            #[inline(always)]
            fn kept(self, mask: Self::Mask) -> Self {
                Self(Lanes::kept(self.0, mask.0), Lanes::kept(self.1, mask.1))
            }
            #[inline(always)]
            fn fast_min(self, other: Self) -> Self {
                Self(Lanes::fast_min(self.0, other.0), Lanes::fast_min(self.1, other.1))
            }
            #[inline(always)]
            fn fast_max(self, other: Self) -> Self {
                Self(Lanes::fast_max(self.0, other.0), Lanes::fast_max(self.1, other.1))
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                Self(Lanes::mul_add(self.0, b.0, c.0), Lanes::mul_add(self.1, b.1, c.1))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(Lanes::abs(self.0), Lanes::abs(self.1))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(Lanes::sqrt(self.0), Lanes::sqrt(self.1))
            }
            #[inline(always)]
            fn turned_as(self, sign: Self) -> Self {
                Self(Lanes::turned_as(self.0, sign.0), Lanes::turned_as(self.1, sign.1))
            }
            #[inline(always)]
            fn with_bits(self, mask: Self::Mask, bits: Self) -> Self {
                Self(Lanes::with_bits(self.0, mask.0, bits.0), Lanes::with_bits(self.1, mask.1, bits.1))
            }
            #[inline(always)]
            fn cmp_lt(self, other: Self) -> Self::Mask {
                PairMask(self.0.cmp_lt(other.0), self.1.cmp_lt(other.1))
            }
            #[inline(always)]
            fn cmp_le(self, other: Self) -> Self::Mask {
                PairMask(self.0.cmp_le(other.0), self.1.cmp_le(other.1))
            }
            #[inline(always)]
            fn cmp_eq(self, other: Self) -> Self::Mask {
                PairMask(self.0.cmp_eq(other.0), self.1.cmp_eq(other.1))
            }
        }
    };
}

pair_lanes!(f64x8, 8);
