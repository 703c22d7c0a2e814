//! Words that are sets of bits, several in a vector: what may be with which.

use wide::u64x8;

use super::{Lanes, MAX_LANES, Real};

/// Words that have some of the set bits of `bits`, as bits.
#[inline(always)]
pub fn words_with(words: &[u64; 16], bits: u64) -> u32 {
    let [low, high]: [[u64; 8]; 2] = bytemuck::cast(*words);
    let has = |words: [u64; 8]| !(u64x8::new(words) & u64x8::splat(bits)).simd_eq(u64x8::splat(0)).to_bitmask() & 0xff;
    has(low) | has(high) << 8
}

/// Words that have some bit set, as bits; their number is a multiple of 8, up to 32.
#[inline(always)]
pub fn marked<const W: usize>(words: &[u64; W]) -> u32 {
    let eights = words.as_chunks::<8>().0.iter().enumerate();
    eights.fold(0, |marked, (k, eight)| {
        let empty = u64x8::new(*eight).simd_eq(u64x8::splat(0)).to_bitmask();
        marked | (!empty & 0xff) << (8 * k)
    })
}

/// A word of 64 bits for each of `E`'s lanes.
#[derive(Clone, Copy, Debug)]
pub struct Marks<E: Lanes> {
    /// In the lanes' own bits; the second vector has the upper halves where a lane has 32.
    words: [E; 2],
}

impl<E: Lanes> Marks<E> {
    /// No bit set.
    #[inline(always)]
    pub fn none() -> Self {
        Self { words: [E::splat(E::Scalar::ZERO); 2] }
    }

    /// Sets bit `bit`, below 64, in the words whose lane is set in `lanes`.
    #[inline(always)]
    #[must_use]
    pub fn with(self, lanes: E::Mask, bit: usize) -> Self {
        let [low, high] = self.words;
        let bits = E::Scalar::marks(bit);
        Self { words: [low.with_bits(lanes, E::splat(bits[0])), high.with_bits(lanes, E::splat(bits[1]))] }
    }

    /// The words of the first `N` lanes.
    #[inline(always)]
    pub fn words<const N: usize>(self) -> [u64; N] {
        let mut halves = [[E::Scalar::ZERO; MAX_LANES]; 2];
        let [low, high] = self.words;
        low.store(&mut halves[0]);
        high.store(&mut halves[1]);
        let mut words = [0; N];
        words.iter_mut().enumerate().for_each(|(i, word)| *word = E::Scalar::word([halves[0][i], halves[1][i]]));
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LaneMask, Pair, f32x8, f32x16, f64x8};

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

    fn check<E: Lanes, const N: usize>() {
        let (mut marks, mut want) = (Marks::<E>::none(), [0u64; N]);
        assert_eq!(marks.words(), want);
        for (lanes, bit) in [(0b1010_0110u32, 63), (0xff, 0), (0, 5), (1, 40), (0xd00f, 17), (0x8000, 31), (2, 32)] {
            let lanes = lanes & E::ALL;
            marks = marks.with(E::Mask::from_bits(lanes), bit);
            want.iter_mut().enumerate().for_each(|(i, word)| *word |= u64::from(lanes >> i & 1) << bit);
            assert_eq!(marks.words(), want);
            let some = want.iter().rev().fold(0, |bits, &word| bits << 1 | u32::from(word != 0));
            assert!(N < 8 || marked(&want) == some);
        }
    }

    #[test]
    fn marks_are_set_where_they_are_wanted() {
        check::<f32x16, 16>();
        check::<f32x8, 8>();
        check::<f64x8, 8>();
        check::<Pair<f64x8>, 16>();
        check::<f32, 1>();
    }
}
