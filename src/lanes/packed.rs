//! Chosen lanes moved to the front of a vector, by one instruction where there is one.

#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::{f32x16, f64x8};

/// See [`super::Lanes::packed`].
#[inline(always)]
pub fn floats(v: f32x16, bits: u32) -> f32x16 {
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
    f32x16::new(portable(v.to_array(), bits))
}

/// The same of eight doubles.
#[inline(always)]
pub fn doubles(v: f64x8, bits: u32) -> f64x8 {
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
    f64x8::new(portable(v.to_array(), bits))
}

#[cfg(any(test, not(target_feature = "avx512f")))]
fn portable<S: Copy + Default, const N: usize>(from: [S; N], bits: u32) -> [S; N] {
    let (mut to, mut count) = ([S::default(); N], 0);
    for (lane, x) in from.into_iter().enumerate() {
        to[count % N] = if bits >> lane & 1 != 0 { x } else { to[count % N] };
        count += (bits >> lane & 1) as usize;
    }
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
            let got = floats(v, bits).to_array();
            assert_eq!(got, portable(v.to_array(), bits));
            let doubles = f64x8::new(std::array::from_fn(|i| i as f64 - 3.5));
            assert_eq!(super::doubles(doubles, bits & 0xff).to_array(), portable(doubles.to_array(), bits & 0xff));
            assert!(got[..want.len()] == want[..] && got[want.len()..].iter().all(|&x| x == 0.0), "{bits:x}");
        }
    }
}
