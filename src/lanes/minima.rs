//! Least values of many vectors at once: trees of shuffles instead of a reduction for each. No NaNs.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use wide::f32x16;

/// Lane `i` of the result is the least value of row `i`.
#[inline(always)]
pub fn row_minima(rows: &[f32x16; 16]) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        avx512::row_minima(rows)
    }
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        avx2::row_minima(rows)
    }
    #[cfg(not(target_feature = "avx2"))]
    portable::row_minima(rows)
}

/// The same of rows that lie apart. One by one: a loop over them would copy them into memory first.
#[inline(always)]
pub fn row_minima_of(row: impl Fn(usize) -> f32x16) -> f32x16 {
    row_minima(&[
        row(0),
        row(1),
        row(2),
        row(3),
        row(4),
        row(5),
        row(6),
        row(7),
        row(8),
        row(9),
        row(10),
        row(11),
        row(12),
        row(13),
        row(14),
        row(15),
    ])
}

/// Four vectors in one: quarter `k` holds four numbers, the least of which is the least of vector `k`.
#[inline(always)]
pub fn quarters(vectors: [f32x16; 4]) -> f32x16 {
    #[cfg(target_feature = "avx512f")]
    {
        avx512::quarters(vectors)
    }
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        avx2::quarters(vectors)
    }
    #[cfg(not(target_feature = "avx2"))]
    portable::quarters(vectors)
}

/// Lane `i` of result `k` is the least value of quarter `k` of row `i`.
#[inline(always)]
pub fn quarter_minima(rows: &[f32x16; 16]) -> [f32x16; 4] {
    #[cfg(target_feature = "avx512f")]
    {
        avx512::quarter_minima(rows)
    }
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        avx2::quarter_minima(rows)
    }
    #[cfg(not(target_feature = "avx2"))]
    portable::quarter_minima(rows)
}

#[cfg(any(test, not(target_feature = "avx2")))]
mod portable {
    use wide::f32x16;

    #[inline(always)]
    fn less(a: f32, b: f32) -> f32 {
        if a < b { a } else { b }
    }

    #[inline(always)]
    pub fn row_minima(rows: &[f32x16; 16]) -> f32x16 {
        f32x16::new(std::array::from_fn(|i| {
            let mut half = rows[i].to_array();
            for step in [8, 4, 2, 1] {
                (0..step).for_each(|k| half[k] = less(half[k], half[k + step]));
            }
            half[0]
        }))
    }

    #[inline(always)]
    pub fn quarters(vectors: [f32x16; 4]) -> f32x16 {
        let mut quarters = [0.0; 16];
        for (quarter, vector) in quarters.chunks_exact_mut(4).zip(vectors) {
            let v = vector.to_array();
            let half: [f32; 8] = std::array::from_fn(|k| less(v[k], v[k + 8]));
            (0..4).for_each(|k| quarter[k] = less(half[k], half[k + 4]));
        }
        f32x16::new(quarters)
    }

    #[inline(always)]
    pub fn quarter_minima(rows: &[f32x16; 16]) -> [f32x16; 4] {
        let mut minima = [[0.0; 16]; 4];
        for (i, row) in rows.iter().enumerate() {
            let row = row.to_array();
            for (minima, of) in minima.iter_mut().zip(row.chunks_exact(4)) {
                minima[i] = less(less(of[0], of[1]), less(of[2], of[3]));
            }
        }
        minima.map(f32x16::new)
    }
}

#[cfg(target_feature = "avx512f")]
mod avx512 {
    use std::arch::x86_64::{__m512, _mm512_loadu_ps, _mm512_min_ps, _mm512_shuffle_f32x4, _mm512_shuffle_ps};
    use std::arch::x86_64::{_mm512_storeu_ps, _mm512_unpackhi_ps, _mm512_unpacklo_ps};
    use wide::f32x16;

    /// Pairs of quarters of two registers folded into one: 0 and 1 from the first, 2 and 3 from the second.
    #[inline(always)]
    fn fold(a: __m512, b: __m512) -> __m512 {
        // SAFETY: compiled only where the whole build has AVX-512F; the instructions touch registers only. So below.
        unsafe { _mm512_min_ps(_mm512_shuffle_f32x4::<0x44>(a, b), _mm512_shuffle_f32x4::<0xee>(a, b)) }
    }

    /// The same of registers whose quarters belong together in pairs: one quarter of each pair.
    #[inline(always)]
    fn fold_pairs(a: __m512, b: __m512) -> __m512 {
        // SAFETY: see `fold`.
        unsafe { _mm512_min_ps(_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xdd>(a, b)) }
    }

    /// Of every quarter of four registers the least of its four numbers; those of a quarter lie together.
    #[inline(always)]
    fn within_quarters([a, b, c, d]: [__m512; 4]) -> __m512 {
        // SAFETY: see `fold`.
        unsafe {
            let pairs = |a, b| _mm512_min_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (a, b) = (pairs(a, b), pairs(c, d));
            _mm512_min_ps(_mm512_shuffle_ps::<0x44>(a, b), _mm512_shuffle_ps::<0xee>(a, b))
        }
    }

    #[inline(always)]
    fn load(v: &f32x16) -> __m512 {
        // SAFETY: compiled only where the whole build has AVX-512F; a vector is 64 bytes of floats.
        unsafe { _mm512_loadu_ps((&raw const *v).cast()) }
    }

    #[inline(always)]
    fn store(v: __m512) -> f32x16 {
        let mut to = [0.0; 16];
        // SAFETY: compiled only where the whole build has AVX-512F; the store fills the 64 bytes of `to`.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), v) };
        f32x16::new(to)
    }

    #[inline(always)]
    pub fn row_minima(rows: &[f32x16; 16]) -> f32x16 {
        let fold = |i: usize| fold(load(&rows[i]), load(&rows[i + 8]));
        // One quarter each of rows i, i + 8, i + 4, i + 12.
        let one_each = |i: usize| fold_pairs(fold(i), fold(i + 4));
        let all = within_quarters([one_each(0), one_each(1), one_each(2), one_each(3)]);
        // Rows 0..4, 8..12, 4..8, 12..16 to their places.
        // SAFETY: see `fold`.
        store(unsafe { _mm512_shuffle_f32x4::<0xd8>(all, all) })
    }

    #[inline(always)]
    pub fn quarters([a, b, c, d]: [f32x16; 4]) -> f32x16 {
        store(fold_pairs(fold(load(&a), load(&b)), fold(load(&c), load(&d))))
    }

    #[inline(always)]
    pub fn quarter_minima(rows: &[f32x16; 16]) -> [f32x16; 4] {
        let four = |i: usize| within_quarters([0, 1, 2, 3].map(|k| load(&rows[4 * i + k])));
        let (a, b, c, d) = (four(0), four(1), four(2), four(3));
        // SAFETY: see `fold`.
        unsafe {
            let (low, high) = (_mm512_shuffle_f32x4::<0x44>(a, b), _mm512_shuffle_f32x4::<0xee>(a, b));
            let (low_2, high_2) = (_mm512_shuffle_f32x4::<0x44>(c, d), _mm512_shuffle_f32x4::<0xee>(c, d));
            [
                store(_mm512_shuffle_f32x4::<0x88>(low, low_2)),
                store(_mm512_shuffle_f32x4::<0xdd>(low, low_2)),
                store(_mm512_shuffle_f32x4::<0x88>(high, high_2)),
                store(_mm512_shuffle_f32x4::<0xdd>(high, high_2)),
            ]
        }
    }
}

#[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
mod avx2 {
    use std::arch::x86_64::{__m256, _mm256_min_ps, _mm256_permute2f128_ps, _mm256_shuffle_ps};
    use std::arch::x86_64::{_mm256_unpackhi_ps, _mm256_unpacklo_ps};
    use wide::f32x16;

    /// Both halves of each vector.
    #[inline(always)]
    fn halves(v: f32x16) -> [__m256; 2] {
        bytemuck::cast(v.to_array())
    }

    #[inline(always)]
    fn joined(low: __m256, high: __m256) -> f32x16 {
        f32x16::new(bytemuck::cast([low, high]))
    }

    /// The lesser of each lane's two halves.
    #[inline(always)]
    fn folded(v: f32x16) -> __m256 {
        let [low, high] = halves(v);
        // SAFETY: compiled only where the whole build has AVX2; the instructions touch registers only. So below.
        unsafe { _mm256_min_ps(low, high) }
    }

    /// The lower quarters of both, and the upper ones.
    #[inline(always)]
    fn quarters_of(a: __m256, b: __m256) -> (__m256, __m256) {
        // SAFETY: see `folded`.
        unsafe { (_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b)) }
    }

    /// The lesser quarter of `a`, then that of `b`.
    #[inline(always)]
    fn fold(a: __m256, b: __m256) -> __m256 {
        let (low, high) = quarters_of(a, b);
        // SAFETY: see `folded`.
        unsafe { _mm256_min_ps(low, high) }
    }

    /// Each quarter's least values of `a`, `b`, `c`, `d`, in its lanes.
    #[inline(always)]
    fn within_quarters([a, b, c, d]: [__m256; 4]) -> __m256 {
        // SAFETY: see `folded`.
        unsafe {
            let pairs = |a, b| _mm256_min_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (a, b) = (pairs(a, b), pairs(c, d));
            _mm256_min_ps(_mm256_shuffle_ps::<0x44>(a, b), _mm256_shuffle_ps::<0xee>(a, b))
        }
    }

    #[inline(always)]
    pub fn row_minima(rows: &[f32x16; 16]) -> f32x16 {
        let four = |i: usize| within_quarters([0, 1, 2, 3].map(|k| folded(rows[i + k])));
        joined(fold(four(0), four(4)), fold(four(8), four(12)))
    }

    #[inline(always)]
    pub fn quarters([a, b, c, d]: [f32x16; 4]) -> f32x16 {
        joined(fold(folded(a), folded(b)), fold(folded(c), folded(d)))
    }

    #[inline(always)]
    pub fn quarter_minima(rows: &[f32x16; 16]) -> [f32x16; 4] {
        let four = |i: usize, half: usize| within_quarters([0, 1, 2, 3].map(|k| halves(rows[i + k])[half]));
        let of = |half: usize| {
            let (a, b) = quarters_of(four(0, half), four(4, half));
            let (c, d) = quarters_of(four(8, half), four(12, half));
            [joined(a, c), joined(b, d)]
        };
        let ([a, b], [c, d]) = (of(0), of(1));
        [a, b, c, d]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::numbers;
    use crate::lanes::words::least;

    fn minimum(of: &[f32]) -> u32 {
        of.iter().copied().fold(f32::INFINITY, f32::min).to_bits()
    }

    #[test]
    fn minima_are_those_of_each_row_and_quarter() {
        let mut next = numbers();
        for _ in 0..200 {
            let rows: [[f32; 16]; 16] = std::array::from_fn(|_| {
                std::array::from_fn(|_| match next() % 8 {
                    0 => f32::INFINITY,
                    1 => f32::NEG_INFINITY,
                    _ => next() as i32 as f32 * 1e-3,
                })
            });
            let vectors = rows.map(f32x16::new);
            let want = rows.map(|row| minimum(&row));
            assert_eq!(row_minima(&vectors).to_array().map(f32::to_bits), want);
            assert_eq!(vectors.map(least).map(f32::to_bits), want);
            assert_eq!(portable::row_minima(&vectors).to_array().map(f32::to_bits), want);
            for quarter_minima in [quarter_minima, portable::quarter_minima] {
                for (k, minima) in quarter_minima(&vectors).into_iter().enumerate() {
                    let want = rows.map(|row| minimum(&row[4 * k..4 * k + 4]));
                    assert_eq!(minima.to_array().map(f32::to_bits), want);
                }
            }
            let four: [f32x16; 4] = std::array::from_fn(|k| vectors[k]);
            for quarters in [quarters(four), portable::quarters(four)] {
                let quarters = quarters.to_array();
                (0..4).for_each(|k| assert_eq!(minimum(&quarters[4 * k..4 * k + 4]), want[k]));
            }
        }
    }
}
