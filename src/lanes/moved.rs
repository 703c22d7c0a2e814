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
    #[cfg(not(target_feature = "avx512f"))]
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
    #[cfg(not(target_feature = "avx512f"))]
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
