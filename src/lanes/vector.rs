//! The vectors of `wide` as [`Lanes`].
#![allow(unsafe_code, reason = "what the compiler makes of a choice that is stored")]

use bytemuck::cast;
use wide::{f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use wide::{u32x4, u32x8, u32x16, u64x2, u64x4, u64x8};

use super::masked::{le_in, lt_in};
use super::moved::{near_doubles, near_floats, packed_doubles, packed_floats};
use super::{LaneMask, Lanes, MAX_LANES};

/// A full-width mask in registers (all bits of a lane set or clear). AVX-512 builds keep it in a mask register.
#[derive(Clone, Copy, Debug)]
pub struct VectorMask<V>(V);

/// `v`, in a way that hides from the compiler where it comes from.
///
/// A choice between a number and what memory holds that is stored there again becomes a store under a mask otherwise, which took a
/// Zen 3 six times as long as choosing and storing (results/NOTES.md, "Registers of eight").
#[inline(always)]
fn hidden<V: bytemuck::Pod>(v: V) -> V {
    #[cfg(all(target_feature = "avx", not(target_feature = "avx512f"), not(miri)))]
    {
        use std::arch::asm;
        use std::arch::x86_64::{__m128, __m256};
        let one = |mut v: __m256| {
            // SAFETY: no instruction at all; compiled only where the whole build has AVX and with it the register.
            unsafe { asm!("/* {0} */", inout(ymm_reg) v, options(pure, nomem, nostack, preserves_flags)) };
            v
        };
        match size_of::<V>() {
            16 => {
                let mut v: __m128 = cast(v);
                // SAFETY: as above.
                unsafe { asm!("/* {0} */", inout(xmm_reg) v, options(pure, nomem, nostack, preserves_flags)) };
                return cast(v);
            }
            32 => return cast(one(cast(v))),
            64 => {
                let [low, high]: [__m256; 2] = cast(v);
                return cast([one(low), one(high)]);
            }
            _ => {}
        }
    }
    v
}

macro_rules! vector_lanes {
    ($v:ident, $s:ident, $n:literal, $int:ident, $bits:expr $(, { $($own:item)* })?) => {
        impl std::ops::BitAnd for VectorMask<$v> {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }
        }
        impl std::ops::BitOr for VectorMask<$v> {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }
        impl std::ops::Not for VectorMask<$v> {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(!self.0)
            }
        }
        impl LaneMask for VectorMask<$v> {
            #[inline(always)]
            fn bits(self) -> u32 {
                self.0.to_bitmask() as u32
            }
            #[inline(always)]
            fn from_bits(bits: u32) -> Self {
                // Test each lane's own bit: one broadcast, one and, one compare.
                let own = $int::new($bits);
                let set = ($int::splat(bits.into()) & own).simd_eq(own);
                Self(cast::<$int, $v>(set))
            }
            #[inline(always)]
            fn any(self) -> bool {
                self.bits() != 0
            }
        }

        impl Lanes for $v {
            type Scalar = $s;
            type Mask = VectorMask<$v>;
            const N: usize = $n;

            #[inline(always)]
            fn splat(x: $s) -> Self {
                $v::splat(x)
            }
            #[inline(always)]
            fn load(from: &[$s]) -> Self {
                let lanes: &[$s; $n] = from.first_chunk().expect("a vector's worth of values");
                $v::new(*lanes)
            }
            #[inline(always)]
            fn store(self, to: &mut [$s]) {
                *to.first_chunk_mut().expect("room for a vector") = self.to_array();
            }
            #[inline(always)]
            fn lane(self, i: usize) -> $s {
                self.to_array()[i]
            }
            #[inline(always)]
            fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
                hidden(mask.0.select(if_true, if_false))
            }
            #[inline(always)]
            fn kept(self, mask: Self::Mask) -> Self {
                if cfg!(target_feature = "avx512f") { mask.0.select(self, Self::splat(0.0)) } else { self & mask.0 }
            }
            #[inline(always)]
            fn fast_min(self, other: Self) -> Self {
                $v::fast_min(self, other)
            }
            #[inline(always)]
            fn fast_max(self, other: Self) -> Self {
                $v::fast_max(self, other)
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                $v::mul_add(self, b, c)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $v::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $v::sqrt(self)
            }
            #[inline(always)]
            fn turned_as(self, sign: Self) -> Self {
                self ^ sign & $v::splat(-0.0)
            }
            #[inline(always)]
            fn with_bits(self, mask: Self::Mask, bits: Self) -> Self {
                // One instruction with mask registers, two without.
                if cfg!(target_feature = "avx512f") { mask.0.select(self | bits, self) } else { self | mask.0 & bits }
            }
            #[inline(always)]
            fn cmp_lt(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_lt(other))
            }
            #[inline(always)]
            fn cmp_le(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_le(other))
            }
            #[inline(always)]
            fn cmp_eq(self, other: Self) -> Self::Mask {
                VectorMask(self.simd_eq(other))
            }
            $($($own)*)?
        }
    };
}

const fn powers32<const N: usize>() -> [u32; N] {
    let mut bits = [0; N];
    let mut i = 0;
    while i < N {
        bits[i] = 1 << i;
        i += 1;
    }
    bits
}

const fn powers64<const N: usize>() -> [u64; N] {
    let mut bits = [0; N];
    let mut i = 0;
    while i < N {
        bits[i] = 1 << i;
        i += 1;
    }
    bits
}

vector_lanes!(f32x4, f32, 4, u32x4, const { powers32() });
vector_lanes!(f32x8, f32, 8, u32x8, const { powers32() });
vector_lanes!(f32x16, f32, 16, u32x16, const { powers32() }, {
    #[inline(always)]
    fn packed(self, bits: u32) -> Self {
        packed_floats(self, bits)
    }
    #[inline(always)]
    fn near(from: &[f32], at: &[u32; MAX_LANES]) -> Self {
        near_floats(from.first_chunk().expect("two vectors' worth of values"), at)
    }
    #[inline(always)]
    fn cmp_lt_in(self, other: Self, mask: VectorMask<Self>) -> VectorMask<Self> {
        VectorMask(lt_in(self, other, mask.0))
    }
    #[inline(always)]
    fn cmp_le_in(self, other: Self, mask: VectorMask<Self>) -> VectorMask<Self> {
        VectorMask(le_in(self, other, mask.0))
    }
});
vector_lanes!(f64x2, f64, 2, u64x2, const { powers64() });
vector_lanes!(f64x4, f64, 4, u64x4, const { powers64() });
vector_lanes!(f64x8, f64, 8, u64x8, const { powers64() }, {
    #[inline(always)]
    fn packed(self, bits: u32) -> Self {
        packed_doubles(self, bits)
    }
    #[inline(always)]
    fn near(from: &[f64], at: &[u32; MAX_LANES]) -> Self {
        near_doubles(from.first_chunk().expect("two vectors' worth of values"), at)
    }
});
