//! Stores past the caches: for answers that nobody reads soon, so that their lines need not be fetched first.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

/// Writes `x` to `to`, past the caches where the machine can and `to` lies at a multiple of 16 bytes.
///
/// Before another thread may read what was written, or anything is done that it could learn of the writing by,
/// [`arrived`] must be called.
#[inline(always)]
pub fn store_past(x: &[u32; 16], to: &mut [u32; 16]) {
    #[cfg(target_arch = "x86_64")]
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
    use super::*;

    #[test]
    fn everything_arrives_wherever_it_lies() {
        let x = std::array::from_fn(|i| (i as u32).wrapping_mul(0x9e37_79b9));
        for first in 0..8 {
            let mut list = [7; 40];
            store_past(&x, list[first..].first_chunk_mut().unwrap());
            arrived();
            assert_eq!(list[first..first + 16], x);
            assert!(list[..first].iter().chain(&list[first + 16..]).all(|y| *y == 7));
        }
    }
}
