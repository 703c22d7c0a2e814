//! Comparisons in some lanes only: one instruction with mask registers, two without.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::f32x16;

/// `a < b` in the lanes of `mask`, all bits of a lane set or clear.
#[inline(always)]
pub fn lt_in(a: f32x16, b: f32x16, mask: f32x16) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        avx512::compare::<{ std::arch::x86_64::_CMP_LT_OQ }>(a, b, mask)
    }
    #[cfg(not(target_feature = "avx512f"))]
    {
        mask & a.simd_lt(b)
    }
}

/// `a <= b` in the lanes of `mask`.
#[inline(always)]
pub fn le_in(a: f32x16, b: f32x16, mask: f32x16) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        avx512::compare::<{ std::arch::x86_64::_CMP_LE_OQ }>(a, b, mask)
    }
    #[cfg(not(target_feature = "avx512f"))]
    {
        mask & a.simd_le(b)
    }
}

#[cfg(target_feature = "avx512f")]
mod avx512 {
    use std::arch::x86_64::{
        __m512, _mm512_castps_si512, _mm512_castsi512_ps, _mm512_loadu_ps, _mm512_mask_cmp_ps_mask,
        _mm512_maskz_set1_epi32, _mm512_storeu_ps, _mm512_test_epi32_mask,
    };

    use wide::f32x16;

    #[inline(always)]
    fn lanes(v: &f32x16) -> __m512 {
        // SAFETY: compiled only where the whole build has AVX-512F; the load reads the 64 bytes of `v`.
        unsafe { _mm512_loadu_ps(std::ptr::from_ref(v).cast()) }
    }

    #[inline(always)]
    pub fn compare<const HOW: i32>(a: f32x16, b: f32x16, mask: f32x16) -> f32x16 {
        let (a, b, mask) = (lanes(&a), lanes(&b), lanes(&mask));
        let mut met = [0.0; 16];
        // SAFETY: compiled only where the whole build has AVX-512F; the store fills `met`.
        unsafe {
            let mask = _mm512_castps_si512(mask);
            let of_both = _mm512_mask_cmp_ps_mask::<HOW>(_mm512_test_epi32_mask(mask, mask), a, b);
            _mm512_storeu_ps(met.as_mut_ptr(), _mm512_castsi512_ps(_mm512_maskz_set1_epi32(of_both, -1)));
        }
        f32x16::new(met)
    }
}
