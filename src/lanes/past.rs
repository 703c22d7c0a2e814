//! Stores past the caches: for answers that nobody reads soon, so that their lines need not be fetched first.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

/// Writes `x` to `to`, past the caches where the machine can and `to` begins where a vector of it does: a whole line at
/// once with AVX-512, in halves or quarters without.
///
/// Before another thread may read what was written, or anything is done that it could learn of the writing by,
/// [`arrived`] must be called.
#[inline(always)]
pub fn store_past(x: &[u32; 16], to: &mut [u32; 16]) {
    #[cfg(target_feature = "avx512f")]
    {
        use std::arch::x86_64::{_mm512_loadu_si512, _mm512_stream_si512};
        if to.as_ptr().addr().is_multiple_of(64) {
            // SAFETY: compiled only where the whole build has AVX-512F; both arrays have 64 bytes, and `to` is aligned to as many.
            unsafe { _mm512_stream_si512(to.as_mut_ptr().cast(), _mm512_loadu_si512(x.as_ptr().cast())) };
            return;
        }
    }
    #[cfg(all(target_feature = "avx", not(target_feature = "avx512f")))]
    {
        use std::arch::x86_64::{__m256i, _mm256_loadu_si256, _mm256_stream_si256};
        if to.as_ptr().addr().is_multiple_of(32) {
            let (from, to): (*const __m256i, *mut __m256i) = (x.as_ptr().cast(), to.as_mut_ptr().cast());
            for half in 0..2 {
                // SAFETY: compiled only where the whole build has AVX; both arrays have twice 32 bytes, and `to` is aligned to
                // 32 bytes.
                unsafe { _mm256_stream_si256(to.add(half), _mm256_loadu_si256(from.add(half))) };
            }
            return;
        }
    }
    #[cfg(all(target_arch = "x86_64", not(target_feature = "avx")))]
    {
        use std::arch::x86_64::{__m128i, _mm_loadu_si128, _mm_stream_si128};
        if to.as_ptr().addr().is_multiple_of(16) {
            let (from, to): (*const __m128i, *mut __m128i) = (x.as_ptr().cast(), to.as_mut_ptr().cast());
            for quarter in 0..4 {
                // SAFETY: both arrays have four times 16 bytes; `to` is aligned to 16 bytes.
                unsafe { _mm_stream_si128(to.add(quarter), _mm_loadu_si128(from.add(quarter))) };
            }
            return;
        }
    }
    *to = *x;
}

/// Waits until all that [`store_past`] wrote in this thread is where other threads find it.
#[inline(always)]
pub fn arrived() {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: SSE is part of x86-64; a fence changes no memory.
    unsafe {
        std::arch::x86_64::_mm_sfence();
    }
}

#[cfg(test)]
mod tests {
    use super::super::Column;
    use super::*;

    #[test]
    fn everything_arrives_wherever_it_lies() {
        let x = std::array::from_fn(|i| (i as u32).wrapping_mul(0x9e37_79b9));
        let mut column = Column::<u32>::default();
        column.resize(48);
        for first in 0..32 {
            column.fill(7);
            store_past(&x, column[first..].first_chunk_mut().unwrap());
            arrived();
            assert_eq!(column[first..first + 16], x);
            assert!(column[..first].iter().chain(&column[first + 16..]).all(|y| *y == 7));
        }
    }
}
