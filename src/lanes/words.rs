//! Words of the machine that [`super::Lanes`] does not have: what the tile engine needs beside arithmetic. Each has
//! one meaning; where a build has an instruction for it, that instruction is used, and a test compares it with the
//! portable form bit by bit.
#![allow(unsafe_code, reason = "instructions no crate offers as safe functions")]

use super::{LaneMask, Lanes, Real};
use wide::{f32x4, f32x8, f32x16, u8x16, u16x8, u32x16};

/// The lower and the upper half.
#[inline(always)]
fn halves(v: f32x16) -> [f32x8; 2] {
    bytemuck::cast(v.to_array())
}

/// The sign bits, bit `i` for lane `i`; also of zeros and NaNs.
#[inline(always)]
pub fn signs(v: f32x16) -> u32 {
    v.to_bitmask()
}

/// Positions that hold `wanted`, as bits.
#[inline(always)]
pub fn positions(list: &[u32; 16], wanted: u32) -> u32 {
    u32x16::new(*list).simd_eq(u32x16::splat(wanted)).to_bitmask()
}

/// Positions that hold more than `number`, as bits.
#[inline(always)]
pub fn below(number: u32, list: &[u32; 16]) -> u32 {
    u32x16::splat(number).simd_lt(u32x16::new(*list)).to_bitmask()
}

/// Positions of zeros among at most sixteen bytes, as bits.
#[inline(always)]
pub fn zeros<const N: usize>(bytes: &[u8; N]) -> u32 {
    const { assert!(N <= 16) };
    let mut all = [u8::MAX; 16];
    all[..N].copy_from_slice(bytes);
    u8x16::new(all).simd_eq(u8x16::ZERO).to_bitmask()
}

/// Asks the memory for element `i` of a list, which is wanted soon. Changes nothing but the time that takes.
#[inline(always)]
pub fn prefetch<T>(list: &[T], i: usize) {
    ask::<T, false>(list, i);
}

/// The same of what is wanted later: as far as the second cache, so that it drives nothing out of the first.
#[inline(always)]
pub fn prefetch_for_later<T>(list: &[T], i: usize) {
    ask::<T, true>(list, i);
}

#[inline(always)]
fn ask<T, const LATER: bool>(list: &[T], i: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(element) = list.get(i) {
        use std::arch::x86_64::{_MM_HINT_T0, _MM_HINT_T1, _mm_prefetch};
        let first = (&raw const *element).cast::<i8>();
        for line in (0..size_of::<T>()).step_by(64) {
            // SAFETY: the address lies within `element`; a prefetch reads nothing the program can see.
            unsafe {
                let line = first.add(line);
                if LATER { _mm_prefetch::<_MM_HINT_T1>(line) } else { _mm_prefetch::<_MM_HINT_T0>(line) }
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, i);
}

/// [`prefetch`] from either of two lists, without a branch: which one is usually a surprise.
#[inline(always)]
pub fn prefetch_either<A, B>(first: &[A], second: &[B], from_second: bool, i: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let (list, len, size) = if from_second {
            (second.as_ptr().cast::<i8>(), second.len(), size_of::<B>())
        } else {
            (first.as_ptr().cast::<i8>(), first.len(), size_of::<A>())
        };
        let element = list.wrapping_add(i.min(len) * size);
        let lines = const { if size_of::<A>() > size_of::<B>() { size_of::<A>() } else { size_of::<B>() } };
        for line in (0..lines).step_by(64) {
            // What the shorter of the two lacks is its first line once more: nothing else is driven out of the cache for it.
            let line = if line < size { line } else { 0 };
            // SAFETY: a prefetch reads nothing the program can see and does not fault, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(element.wrapping_add(line)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (first, second, from_second, i);
}

/// The least of `N` keys, eight or sixteen, and its first position.
#[inline(always)]
pub fn least_key<const N: usize>(keys: &[u16; N]) -> (u16, usize) {
    let eight = |k: usize| {
        let mut some = [u16::MAX; 8];
        some.copy_from_slice(&keys[8 * k..8 * k + 8]);
        least_of_eight(&some)
    };
    let mut best = eight(0);
    for k in 1..N / 8 {
        let (least, at) = eight(k);
        best = if least < best.0 { (least, at + 8 * k) } else { best };
    }
    best
}

#[inline(always)]
fn least_of_eight(keys: &[u16; 8]) -> (u16, usize) {
    #[cfg(target_feature = "sse4.1")]
    {
        use std::arch::x86_64::{__m128i, _mm_cvtsi128_si32, _mm_minpos_epu16};
        let keys = bytemuck::cast::<[u16; 8], __m128i>(*keys);
        // SAFETY: compiled only where the whole build has SSE4.1; the instruction touches registers only.
        let found = unsafe { _mm_cvtsi128_si32(_mm_minpos_epu16(keys)) } as u32;
        (found as u16, (found >> 16) as usize & 7)
    }
    #[cfg(not(target_feature = "sse4.1"))]
    least_key_portable(keys)
}

/// The keys with the one at `position` made the greatest possible. Written as vectors: the next look for the
/// least key would have to wait for a single lane's store.
#[inline(always)]
pub fn without_key<const N: usize>(keys: &[u16; N], position: usize) -> [u16; N] {
    const OWN: u16x8 = u16x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
    let mut rest = *keys;
    for k in 0..N / 8 {
        let mut some = [0; 8];
        some.copy_from_slice(&keys[8 * k..8 * k + 8]);
        let own = u16x8::splat(position as u16).simd_eq(OWN + u16x8::splat(8 * k as u16));
        rest[8 * k..8 * k + 8].copy_from_slice(&(u16x8::new(some) | own).to_array());
    }
    rest
}

/// The upper halves of the bits of the numbers in `wanted`, all ones elsewhere: keys in the order of the numbers, if
/// none is negative. `N`: the vector's lanes.
#[inline(always)]
pub fn upper_halves<V: Lanes<Scalar = f32>, const N: usize>(v: V, wanted: u32) -> [u16; N] {
    let (mut marked, mut keys) = ([0.0f32; N], [0; N]);
    V::select(V::Mask::from_bits(wanted), v, V::splat(f32::from_bits(u32::MAX))).store(&mut marked);
    for (key, x) in keys.iter_mut().zip(marked) {
        *key = (x.to_bits() >> 16) as u16;
    }
    keys
}

/// The least lane. No NaNs.
#[inline(always)]
pub fn least(v: f32x16) -> f32 {
    let [a, b] = halves(v);
    let [a, b]: [f32x4; 2] = bytemuck::cast(a.fast_min(b).to_array());
    let [x, y, z, w] = a.fast_min(b).to_array();
    let lesser = |x: f32, y: f32| if x < y { x } else { y };
    lesser(lesser(x, z), lesser(y, w))
}

/// The greatest lane. No NaNs.
#[inline(always)]
pub fn greatest(v: f32x16) -> f32 {
    -least(-v)
}

#[cfg(any(test, not(target_feature = "sse4.1")))]
fn least_key_portable(keys: &[u16; 8]) -> (u16, usize) {
    let mut best = 0;
    for i in 1..8 {
        if keys[i] < keys[best] {
            best = i;
        }
    }
    (keys[best], best)
}

/// Writes the positions of the set bits of a 16-bit mask, counted from `base` on, to the front of `list`, ascending; what
/// follows them is unspecified. Returns how many there are. `base` is at most 240.
#[inline(always)]
pub fn list_bits(mask: u32, base: u8, list: &mut [u8; 16]) -> usize {
    #[cfg(all(target_feature = "avx512vbmi2", target_feature = "avx512vl"))]
    {
        use std::arch::x86_64::{__m128i, _mm_maskz_compress_epi8};
        const POSITIONS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        let all = bytemuck::cast::<[u8; 16], __m128i>(POSITIONS.map(|i| i + base));
        // SAFETY: compiled only where the whole build has VBMI2 and VL; the instruction touches registers only.
        *list = bytemuck::cast(unsafe { _mm_maskz_compress_epi8(mask as u16, all) });
        (mask & 0xffff).count_ones() as usize
    }
    #[cfg(not(all(target_feature = "avx512vbmi2", target_feature = "avx512vl")))]
    list_bits_portable(mask, base, list)
}

#[cfg(any(test, not(all(target_feature = "avx512vbmi2", target_feature = "avx512vl"))))]
fn list_bits_portable(mask: u32, base: u8, list: &mut [u8; 16]) -> usize {
    let mut rest = mask & 0xffff;
    let mut count = 0;
    while rest != 0 {
        list[count] = base + rest.trailing_zeros() as u8;
        rest &= rest - 1;
        count += 1;
    }
    count
}

/// Which of 64 numbers `x` does not exceed, as bits.
#[inline(always)]
pub fn reached(x: f32, of: &[f32; 64]) -> u64 {
    #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
    {
        use std::arch::x86_64::{_CMP_LE_OQ, _mm256_castps_si256, _mm256_cmp_ps, _mm256_movemask_epi8};
        use std::arch::x86_64::{_mm256_packs_epi16, _mm256_packs_epi32, _mm256_permutevar8x32_epi32, _mm256_set1_ps};
        // Packing goes by halves of registers: the first halves of four comparisons, then the second ones.
        const PLACES: [u32; 8] = [0, 4, 1, 5, 2, 6, 3, 7];
        let eight = |i: usize| {
            let of = f32x8::new(*of[8 * i..].first_chunk().expect("eight of 64"));
            // SAFETY: compiled only where the whole build has AVX2; the instructions touch registers only. So below.
            unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_set1_ps(x), bytemuck::cast(of))) }
        };
        let half = |i: usize| {
            // SAFETY: as above.
            unsafe {
                let first = _mm256_packs_epi32(eight(i), eight(i + 1));
                let bytes = _mm256_packs_epi16(first, _mm256_packs_epi32(eight(i + 2), eight(i + 3)));
                _mm256_movemask_epi8(_mm256_permutevar8x32_epi32(bytes, bytemuck::cast(PLACES))) as u32
            }
        };
        u64::from(half(0)) | u64::from(half(4)) << 32
    }
    #[cfg(not(all(target_feature = "avx2", not(target_feature = "avx512f"))))]
    reached_by_vectors(x, of)
}

/// The same of any scalars.
#[inline(always)]
pub fn reached_by_vectors<S: Real>(x: S, of: &[S; 64]) -> u64 {
    let reach = |at: usize| u64::from(S::Wide::splat(x).cmp_le(S::Wide::load(&of[at..])).bits()) << at;
    (0..64).step_by(S::Wide::N).fold(0, |all, at| all | reach(at))
}

/// Bit planes as numbers: bit `k` of number `i` is bit `i` of `planes[k]`.
#[inline(always)]
pub fn transpose_bits<const K: usize>(planes: [u32; K]) -> [u8; 16] {
    const { assert!(K <= 8) };
    #[cfg(all(target_feature = "avx512bw", target_feature = "avx512vl"))]
    {
        use std::arch::x86_64::{_mm_maskz_set1_epi8, _mm_or_si128, _mm_setzero_si128};
        // SAFETY: compiled only where the whole build has BW and VL; the instructions touch registers only.
        let all = unsafe {
            planes.iter().enumerate().fold(_mm_setzero_si128(), |all, (k, &plane)| {
                _mm_or_si128(all, _mm_maskz_set1_epi8(plane as u16, (1u8 << k) as i8))
            })
        };
        bytemuck::cast(all)
    }
    #[cfg(not(all(target_feature = "avx512bw", target_feature = "avx512vl")))]
    transpose_bits_by_bytes(planes)
}

/// One plane after the other, in all bytes at once.
#[cfg(any(test, not(all(target_feature = "avx512bw", target_feature = "avx512vl"))))]
#[inline(always)]
fn transpose_bits_by_bytes<const K: usize>(planes: [u32; K]) -> [u8; 16] {
    const PLACES: u8x16 = u8x16::new([1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128]);
    let eight = |byte: u32| u64::from(byte & 0xff) * 0x0101_0101_0101_0101;
    let numbers = planes.iter().enumerate().fold(u8x16::ZERO, |all, (k, &plane)| {
        let own = u8x16::new(bytemuck::cast([eight(plane), eight(plane >> 8)]));
        all | (own & PLACES).simd_eq(PLACES) & u8x16::splat(1 << k)
    });
    numbers.to_array()
}

#[cfg(test)]
fn transpose_bits_portable<const K: usize>(planes: [u32; K]) -> [u8; 16] {
    std::array::from_fn(|i| planes.iter().enumerate().fold(0, |all, (k, plane)| all | ((plane >> i & 1) << k) as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::numbers;

    #[test]
    fn zeros_are_where_bytes_are_zero() {
        let mut next = numbers();
        for _ in 0..100 {
            let bytes: [u8; 16] = std::array::from_fn(|_| (next() % 3) as u8 * 127);
            let want = |bytes: &[u8]| bytes.iter().rev().fold(0, |bits, &b| bits << 1 | u32::from(b == 0));
            assert_eq!(zeros(&bytes), want(&bytes));
            let eight: [u8; 8] = bytes[4..12].try_into().unwrap();
            assert_eq!(zeros(&eight), want(&eight));
        }
    }

    #[test]
    fn the_least_key_is_the_first_of_the_least() {
        let mut next = numbers();
        for _ in 0..1000 {
            let keys: [u16; 16] = std::array::from_fn(|_| (next() % 19) as u16 * 3449);
            let least = |keys: &[u16]| {
                let least = *keys.iter().min().unwrap();
                (least, keys.iter().position(|&k| k == least).unwrap())
            };
            let (want, mut rest) = (least(&keys), keys);
            rest[want.1] = u16::MAX;
            assert_eq!((least_key(&keys), without_key(&keys, want.1)), (want, rest));
            let keys: [u16; 8] = keys[8..].try_into().unwrap();
            let (want, mut rest) = (least(&keys), keys);
            rest[want.1] = u16::MAX;
            assert_eq!((least_key(&keys), least_key_portable(&keys)), (want, want));
            assert_eq!(without_key(&keys, want.1), rest);
        }
    }

    #[test]
    fn upper_halves_keep_the_order() {
        let v = f32x8::new([0.0, 1.0, 2.5, 1e-30, 7e30, f32::INFINITY, 1.0, 3.0]);
        assert_eq!(upper_halves::<f32x8, 8>(v, 0x6f), [0, 0x3f80, 0x4020, 0x0da2, 0xffff, 0x7f80, 0x3f80, 0xffff]);
    }

    #[test]
    fn set_bits_are_listed_in_order() {
        for mask in (0..0x1_0000u32).step_by(7).chain([0xffff, 0x8000]) {
            let base = mask as u8 % 241;
            let want: Vec<u8> = (0..16).filter(|i| mask >> i & 1 != 0).map(|i| base + i).collect();
            for list_bits in [list_bits, list_bits_portable] {
                let mut list = [0xff; 16];
                let count = list_bits(mask, base, &mut list);
                assert_eq!(list[..count], want);
            }
        }
    }

    #[test]
    fn bit_planes_become_numbers() {
        let mut next = numbers();
        for _ in 0..200 {
            let planes: [u32; 5] = std::array::from_fn(|_| next());
            let got = transpose_bits(planes);
            assert_eq!(got, transpose_bits_portable(planes));
            assert_eq!(got, transpose_bits_by_bytes(planes));
            for (i, number) in got.into_iter().enumerate() {
                let want: String = (0..5).rev().map(|k| if planes[k] >> i & 1 != 0 { '1' } else { '0' }).collect();
                assert_eq!(format!("{number:05b}"), want);
            }
        }
    }

    #[test]
    fn numbers_that_are_reached() {
        let mut next = numbers();
        for _ in 0..200 {
            let of: [f32; 64] = std::array::from_fn(|_| match next() % 8 {
                0 => f32::INFINITY,
                1 => f32::NAN,
                2 => 0.5,
                _ => next() as f32 / u32::MAX as f32,
            });
            for x in [0.5, f32::NEG_INFINITY, f32::INFINITY, f32::NAN] {
                let want = (0..64).filter(|&i| x <= of[i]).fold(0u64, |bits, i| bits | 1 << i);
                assert_eq!((reached(x, &of), reached_by_vectors(x, &of)), (want, want));
                assert_eq!(f64::from(x).reached(&of.map(f64::from)), want);
            }
        }
    }

    #[test]
    fn signs_positions_and_halves() {
        let list = std::array::from_fn(|i| if i % 5 == 1 { u32::MAX } else { i as u32 });
        assert_eq!((positions(&list, u32::MAX), positions(&list, 10), positions(&list, 1)), (0x0842, 1 << 10, 0));
        let v = f32x16::new(std::array::from_fn(|i| if i % 3 == 0 { -0.0 } else { f32::INFINITY }));
        assert_eq!(signs(v), 0b1001_0010_0100_1001);
        let v = f32x16::new(std::array::from_fn(|i| i as f32));
        assert_eq!(halves(v).map(|half| half.to_array()[0]), [0.0, 8.0]);
    }
}
