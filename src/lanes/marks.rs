//! Words that are sets of bits, several in a vector: what may be with which.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::{u16x16, u64x8};

/// Words that have bit `bit`, as bits.
#[inline(always)]
pub fn words_with_bit(words: &[u64; 16], bit: u32) -> u32 {
    let [low, high]: [[u64; 8]; 2] = bytemuck::cast(*words);
    let has =
        |words: [u64; 8]| !(u64x8::new(words) & u64x8::splat(1 << bit)).simd_eq(u64x8::splat(0)).to_bitmask() & 0xff;
    has(low) | has(high) << 8
}

/// Eight words of 64 bits.
#[derive(Clone, Copy, Debug)]
pub struct Marks(u64x8);

impl Marks {
    /// No bit set.
    #[inline(always)]
    pub fn none() -> Self {
        Self(u64x8::splat(0))
    }

    /// Sets bit `bit` in the words whose bit is set in `words`.
    #[inline(always)]
    #[must_use]
    pub fn with(self, words: u32, bit: u32) -> Self {
        #[cfg(target_feature = "avx512f")]
        {
            use std::arch::x86_64::{_mm512_maskz_set1_epi64, _mm512_storeu_si512};
            let mut set = [0; 8];
            // SAFETY: compiled only where the whole build has AVX-512F; the store fills the 64 bytes of `set`.
            unsafe {
                let own = _mm512_maskz_set1_epi64(words as u8, 1 << bit);
                _mm512_storeu_si512(set.as_mut_ptr().cast(), own);
            }
            Self(self.0 | u64x8::new(set))
        }
        #[cfg(not(target_feature = "avx512f"))]
        self.with_portable(words, bit)
    }

    #[cfg(any(test, not(target_feature = "avx512f")))]
    fn with_portable(self, words: u32, bit: u32) -> Self {
        const PLACES: u64x8 = u64x8::new([1, 2, 4, 8, 16, 32, 64, 128]);
        let wanted = (u64x8::splat(words.into()) & PLACES).simd_eq(PLACES);
        Self(self.0 | u64x8::splat(1 << bit) & wanted)
    }

    /// Words that are not zero, as bits.
    #[inline(always)]
    pub fn not_zero(self) -> u32 {
        !self.0.simd_eq(u64x8::splat(0)).to_bitmask() & 0xff
    }

    /// The words.
    #[inline(always)]
    pub fn words(self) -> [u64; 8] {
        self.0.to_array()
    }
}

/// Sixteen words of 16 bits.
#[derive(Clone, Copy, Debug)]
pub struct Columns(u16x16);

impl Columns {
    /// No bit set.
    #[inline(always)]
    pub fn none() -> Self {
        Self(u16x16::splat(0))
    }

    /// Sets bit `bit` in the words whose bit is set in `words`.
    #[inline(always)]
    #[must_use]
    pub fn with(self, words: u32, bit: u32) -> Self {
        #[cfg(all(target_feature = "avx512bw", target_feature = "avx512vl"))]
        {
            use std::arch::x86_64::_mm256_maskz_set1_epi16;
            // SAFETY: compiled only where the whole build has BW and VL; the instruction touches registers only.
            let own = unsafe { _mm256_maskz_set1_epi16(words as u16, (1u16 << (bit & 15)) as i16) };
            Self(self.0 | u16x16::new(bytemuck::cast(own)))
        }
        #[cfg(not(all(target_feature = "avx512bw", target_feature = "avx512vl")))]
        self.with_portable(words, bit)
    }

    #[cfg(any(test, not(all(target_feature = "avx512bw", target_feature = "avx512vl"))))]
    fn with_portable(self, words: u32, bit: u32) -> Self {
        const PLACES: u16x16 = {
            let mut places = [0; 16];
            let mut i = 0;
            while i < 16 {
                places[i] = 1 << i;
                i += 1;
            }
            u16x16::new(places)
        };
        let wanted = (u16x16::splat(words as u16) & PLACES).simd_eq(PLACES);
        Self(self.0 | u16x16::splat(1 << (bit & 15)) & wanted)
    }

    /// Words that are not zero, as bits.
    #[inline(always)]
    pub fn not_zero(self) -> u32 {
        !self.0.simd_eq(u16x16::splat(0)).to_bitmask() & 0xffff
    }

    /// The words.
    #[inline(always)]
    pub fn words(self) -> [u16; 16] {
        self.0.to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::numbers;

    #[test]
    fn columns_are_set_where_they_are_wanted() {
        let mut next = numbers();
        let (mut columns, mut portable, mut want) = (Columns::none(), Columns::none(), [0u16; 16]);
        for bit in [0, 7, 15, 3] {
            let words = next() & 0x7fff;
            (columns, portable) = (columns.with(words, bit), portable.with_portable(words, bit));
            want.iter_mut().enumerate().for_each(|(i, want)| *want |= ((words >> i & 1) << bit) as u16);
            assert_eq!((columns.words(), portable.words()), (want, want));
        }
        let not_zero = (0..16).fold(0, |bits, i| bits | u32::from(want[i] != 0) << i);
        assert_eq!((columns.not_zero(), Columns::none().not_zero()), (not_zero, 0));
        assert!(not_zero >> 15 == 0 && not_zero != 0);
    }

    #[test]
    fn words_that_have_a_bit() {
        let words = std::array::from_fn(|i| 1u64 << (4 * i) | 1 << 63);
        for bit in 0..64 {
            let want = if bit == 63 { 0xffff } else { u32::from(bit % 4 == 0) << (bit / 4) };
            assert_eq!(words_with_bit(&words, bit), want);
        }
    }

    #[test]
    fn marks_are_set_where_they_are_wanted() {
        let marks = Marks(u64x8::new([0, 1, 2, 3, 4, 5, 6, 7]));
        for (words, bit) in [(0b1010_0110, 63), (0xff, 0), (0, 5), (1, 40)] {
            let want: [u64; 8] = std::array::from_fn(|i| i as u64 | u64::from(words >> i & 1) << bit);
            assert_eq!((marks.with(words, bit).words(), marks.with_portable(words, bit).words()), (want, want));
        }
        assert_eq!((marks.not_zero(), Marks::none().not_zero()), (0xfe, 0));
    }
}
