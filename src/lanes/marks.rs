//! Words that are sets of bits, several in a vector: what may be with which.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::u64x8;

/// Words that have some of the set bits of `bits`, as bits.
#[inline(always)]
pub fn words_with(words: &[u64; 16], bits: u64) -> u32 {
    let [low, high]: [[u64; 8]; 2] = bytemuck::cast(*words);
    let has = |words: [u64; 8]| !(u64x8::new(words) & u64x8::splat(bits)).simd_eq(u64x8::splat(0)).to_bitmask() & 0xff;
    has(low) | has(high) << 8
}

/// `N` words of 64 bits, eight or sixteen.
#[derive(Clone, Copy, Debug)]
pub struct Marks<const N: usize>([u64x8; 2]);

impl<const N: usize> Marks<N> {
    /// No bit set.
    #[inline(always)]
    pub fn none() -> Self {
        Self([u64x8::splat(0); 2])
    }

    /// Sets bit `bit` in the words whose bit is set in `words`.
    #[inline(always)]
    #[must_use]
    pub fn with(self, words: u32, bit: u32) -> Self {
        let Self([low, high]) = self;
        Self([with(low, words, bit), if N > 8 { with(high, words >> 8, bit) } else { high }])
    }

    /// Words that are not zero, as bits.
    #[inline(always)]
    pub fn not_zero(self) -> u32 {
        let not_zero = |words: u64x8| !words.simd_eq(u64x8::splat(0)).to_bitmask() & 0xff;
        let Self([low, high]) = self;
        if N > 8 { not_zero(low) | not_zero(high) << 8 } else { not_zero(low) }
    }

    /// The words.
    #[inline(always)]
    pub fn words(self) -> [u64; N] {
        let mut words = [0; N];
        for (to, from) in words.chunks_exact_mut(8).zip(self.0) {
            to.copy_from_slice(&from.to_array());
        }
        words
    }
}

/// Sets bit `bit` in those of eight words whose bit is set in `wanted`.
#[inline(always)]
fn with(words: u64x8, wanted: u32, bit: u32) -> u64x8 {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{_mm512_maskz_set1_epi64, _mm512_storeu_si512};
        let mut set = [0; 8];
        // SAFETY: compiled only where the whole build has AVX-512F; the store fills the 64 bytes of `set`.
        unsafe {
            let own = _mm512_maskz_set1_epi64(wanted as u8, 1 << bit);
            _mm512_storeu_si512(set.as_mut_ptr().cast(), own);
        }
        words | u64x8::new(set)
    }
    #[cfg(not(target_feature = "avx512f"))]
    with_portable(words, wanted, bit)
}

#[cfg(any(test, not(target_feature = "avx512f")))]
fn with_portable(words: u64x8, wanted: u32, bit: u32) -> u64x8 {
    const PLACES: u64x8 = u64x8::new([1, 2, 4, 8, 16, 32, 64, 128]);
    let wanted = (u64x8::splat(wanted.into()) & PLACES).simd_eq(PLACES);
    words | u64x8::splat(1 << bit) & wanted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_have_some_bit() {
        let words = std::array::from_fn(|i| 1u64 << (4 * i) | 1 << 63);
        for bit in 0..64 {
            let want = if bit == 63 { 0xffff } else { u32::from(bit % 4 == 0) << (bit / 4) };
            assert_eq!(words_with(&words, 1 << bit), want);
        }
        for q in 0..4 {
            let want = if q == 3 { 0xffff } else { 0xf << (4 * q) };
            assert_eq!(words_with(&words, 0xffff << (16 * q)), want, "some of the bits of set {q}");
        }
    }

    #[test]
    fn marks_are_set_where_they_are_wanted() {
        let eight = u64x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
        for (words, bit) in [(0b1010_0110, 63), (0xff, 0), (0, 5), (1, 40), (0xd00f, 17)] {
            let want: [u64; 8] = std::array::from_fn(|i| i as u64 | u64::from(words >> i & 1) << bit);
            assert_eq!(with_portable(eight, words, bit).to_array(), want);
            assert_eq!(Marks::<8>([eight; 2]).with(words, bit).words(), want);
            let want: [u64; 16] = std::array::from_fn(|i| (i % 8) as u64 | u64::from(words >> i & 1) << bit);
            assert_eq!(Marks::<16>([eight; 2]).with(words, bit).words(), want);
        }
        assert_eq!((Marks::<8>([eight; 2]).not_zero(), Marks::<8>::none().not_zero()), (0xfe, 0));
        let marks = Marks::<16>([eight, eight << 7]).with(0x100, 5);
        assert_eq!((marks.not_zero(), Marks::<16>::none().not_zero()), (0xfffe, 0));
    }
}
