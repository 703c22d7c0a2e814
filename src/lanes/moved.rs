//! Values moved between lanes, by one instruction where there is one.

#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::{f32x16, f64x8};

use super::MAX_LANES;

/// See [`super::Lanes::packed`].
#[inline(always)]
pub fn packed_floats(v: f32x16, bits: u32) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{_mm512_loadu_ps, _mm512_maskz_compress_ps, _mm512_storeu_ps};
        let mut front = [0.0; 16];
        // SAFETY: compiled only where the whole build has AVX-512F; the load reads the 64 bytes of `v`, the store fills
        // those of `front`.
        unsafe {
            let lanes = _mm512_loadu_ps((&raw const v).cast::<f32>());
            _mm512_storeu_ps(front.as_mut_ptr(), _mm512_maskz_compress_ps(bits as u16, lanes));
        }
        f32x16::new(front)
    }
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        avx2::packed(v, bits)
    }
    #[cfg(not(target_feature = "avx2"))]
    f32x16::new(packed(v.to_array(), bits))
}

/// The same of eight doubles.
#[inline(always)]
pub fn packed_doubles(v: f64x8, bits: u32) -> f64x8 {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{_mm512_loadu_pd, _mm512_maskz_compress_pd, _mm512_storeu_pd};
        let mut front = [0.0; 8];
        // SAFETY: as above.
        unsafe {
            let lanes = _mm512_loadu_pd((&raw const v).cast::<f64>());
            _mm512_storeu_pd(front.as_mut_ptr(), _mm512_maskz_compress_pd(bits as u8, lanes));
        }
        f64x8::new(front)
    }
    #[cfg(not(target_feature = "avx512f"))]
    f64x8::new(packed(v.to_array(), bits))
}

/// See [`super::Lanes::near`].
#[inline(always)]
pub fn near_floats(from: &[f32; 32], at: &[u32; MAX_LANES]) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{_mm512_loadu_ps, _mm512_loadu_si512, _mm512_permutex2var_ps, _mm512_storeu_ps};
        let mut found = [0.0; 16];
        // SAFETY: compiled only where the whole build has AVX-512F; the loads read the two halves of `from` and the 64 bytes
        // of the sixteen places, the store fills `found`; of a place the instruction takes the lowest five bits.
        unsafe {
            let (low, high) = (_mm512_loadu_ps(from.as_ptr()), _mm512_loadu_ps(from.as_ptr().add(16)));
            let at = _mm512_loadu_si512(at.as_ptr().cast());
            _mm512_storeu_ps(found.as_mut_ptr(), _mm512_permutex2var_ps(low, at, high));
        }
        f32x16::new(found)
    }
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        avx2::near(from, at)
    }
    #[cfg(not(target_feature = "avx2"))]
    f32x16::new(near(from, at))
}

/// The same of eight doubles.
#[inline(always)]
pub fn near_doubles(from: &[f64; 16], at: &[u32; MAX_LANES]) -> f64x8 {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{
            _mm256_loadu_si256, _mm512_cvtepu32_epi64, _mm512_loadu_pd, _mm512_permutex2var_pd, _mm512_storeu_pd,
        };
        let mut found = [0.0; 8];
        // SAFETY: as above, with the first eight places and their lowest four bits.
        unsafe {
            let (low, high) = (_mm512_loadu_pd(from.as_ptr()), _mm512_loadu_pd(from.as_ptr().add(8)));
            let at = _mm512_cvtepu32_epi64(_mm256_loadu_si256(at.as_ptr().cast()));
            _mm512_storeu_pd(found.as_mut_ptr(), _mm512_permutex2var_pd(low, at, high));
        }
        f64x8::new(found)
    }
    #[cfg(not(target_feature = "avx512f"))]
    f64x8::new(near(from, at))
}

#[cfg(any(test, not(target_feature = "avx512f")))]
fn packed<S: Copy + Default, const N: usize>(from: [S; N], bits: u32) -> [S; N] {
    let (mut to, mut count) = ([S::default(); N], 0);
    for (lane, x) in from.into_iter().enumerate() {
        to[count % N] = if bits >> lane & 1 != 0 { x } else { to[count % N] };
        count += (bits >> lane & 1) as usize;
    }
    to
}

#[cfg(any(test, not(target_feature = "avx512f")))]
fn near<S: Copy + Default, const N: usize, const M: usize>(from: &[S; M], at: &[u32; MAX_LANES]) -> [S; N] {
    let mut to = [S::default(); N];
    to.iter_mut().zip(at).for_each(|(to, &at)| *to = from[at as usize % M]);
    to
}

#[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
mod avx2 {
    use std::arch::x86_64::{__m128i, __m256, __m256i, _mm256_and_ps, _mm256_blendv_ps, _mm256_castsi256_ps};
    use std::arch::x86_64::{_mm256_cmpgt_epi32, _mm256_cvtepu8_epi32, _mm256_permutevar8x32_ps, _mm256_set1_epi32};
    use std::arch::x86_64::{_mm256_slli_epi32, _mm256_sub_epi32};
    use wide::f32x16;

    use crate::lanes::MAX_LANES;

    /// The numbers of the set bits of each byte, in order.
    static NUMBERS: [[u8; 8]; 256] = {
        let (mut all, mut bits) = ([[0; 8]; 256], 0);
        while bits < 256 {
            let (mut count, mut bit) = (0, 0);
            while bit < 8 {
                if bits >> bit & 1 != 0 {
                    all[bits][count] = bit as u8;
                    count += 1;
                }
                bit += 1;
            }
            bits += 1;
        }
        all
    };

    const PLACES: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

    /// Where in each half the lanes to be moved are.
    #[inline(always)]
    fn numbers(bits: u32) -> __m256i {
        let [low, high]: [u64; 2] = [bytemuck::cast(NUMBERS[bits as usize & 0xff]), 0];
        // SAFETY: compiled only where the whole build has AVX2; the instructions touch registers only. So below.
        unsafe { _mm256_cvtepu8_epi32(bytemuck::cast::<[u64; 2], __m128i>([low, high])) }
    }

    /// The first `count` lanes, as a mask.
    #[inline(always)]
    fn first(count: i32) -> __m256 {
        // SAFETY: see `numbers`.
        unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(count), bytemuck::cast(PLACES))) }
    }

    #[inline(always)]
    pub fn packed(v: f32x16, bits: u32) -> f32x16 {
        let [low, high]: [__m256; 2] = bytemuck::cast(v.to_array());
        let (in_low, in_high) = ((bits & 0xff).count_ones() as i32, (bits >> 8 & 0xff).count_ones() as i32);
        // SAFETY: see `numbers`.
        let both: [__m256; 2] = unsafe {
            let low = _mm256_permutevar8x32_ps(low, numbers(bits));
            let high = _mm256_permutevar8x32_ps(high, numbers(bits >> 8));
            // Behind those of the lower half; what does not fit comes to the front of the next vector.
            let behind = _mm256_sub_epi32(bytemuck::cast(PLACES), _mm256_set1_epi32(in_low));
            let high = _mm256_permutevar8x32_ps(high, behind);
            [
                _mm256_and_ps(_mm256_blendv_ps(high, low, first(in_low)), first(in_low + in_high)),
                _mm256_and_ps(high, first(in_low + in_high - 8)),
            ]
        };
        f32x16::new(bytemuck::cast(both))
    }

    #[inline(always)]
    pub fn near(from: &[f32; 32], at: &[u32; MAX_LANES]) -> f32x16 {
        let from: [__m256; 4] = bytemuck::cast(*from);
        let at: [__m256i; 2] = bytemuck::cast(*at);
        let half = |at: __m256i| {
            // SAFETY: see `numbers`. Of a place a permutation takes the lowest three bits; the fourth and the fifth choose between
            // vectors, as signs.
            unsafe {
                let [a, b, c, d] = from.map(|from| _mm256_permutevar8x32_ps(from, at));
                let fourth = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(at));
                let (low, high) = (_mm256_blendv_ps(a, b, fourth), _mm256_blendv_ps(c, d, fourth));
                _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32::<27>(at)))
            }
        };
        f32x16::new(bytemuck::cast([half(at[0]), half(at[1])]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_are_packed_in_order() {
        let v = f32x16::new(std::array::from_fn(|i| i as f32 - 3.5));
        for bits in [0u32, 1, 0x8000, 0b1010_0110_0001, 0xffff, 0x7ffe] {
            let want: Vec<f32> = (0..16).filter(|i| bits >> i & 1 != 0).map(|i| i as f32 - 3.5).collect();
            let got = packed_floats(v, bits).to_array();
            assert_eq!(got, packed(v.to_array(), bits));
            let doubles = f64x8::new(std::array::from_fn(|i| i as f64 - 3.5));
            assert_eq!(packed_doubles(doubles, bits & 0xff).to_array(), packed(doubles.to_array(), bits & 0xff));
            assert!(got[..want.len()] == want[..] && got[want.len()..].iter().all(|&x| x == 0.0), "{bits:x}");
        }
    }

    #[test]
    fn near_values_come_to_their_lanes() {
        let from: [f32; 32] = std::array::from_fn(|i| i as f32 * 0.5);
        let at: [u32; MAX_LANES] = std::array::from_fn(|i| (i as u32 * 7 + 3) % 32);
        let want: [f32; 16] = std::array::from_fn(|i| at[i] as f32 * 0.5);
        assert_eq!(near_floats(&from, &at).to_array(), want);
        assert_eq!(near::<f32, 16, 32>(&from, &at), want);
        let from: [f64; 16] = std::array::from_fn(|i| i as f64 * 0.5);
        let at = at.map(|at| at % 16);
        let want: [f64; 8] = std::array::from_fn(|i| f64::from(at[i]) * 0.5);
        assert_eq!(near_doubles(&from, &at).to_array(), want);
        assert_eq!(near::<f64, 8, 16>(&from, &at), want);
    }
}
