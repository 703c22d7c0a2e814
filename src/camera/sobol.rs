//! Low-discrepancy points: Sobol pairs, scrambled and shuffled by hashing, as a function of place.
//!
//! A path needs many dimensions; here each pair of them has the first two dimensions of Sobol's sequence for
//! itself, in an order and with a scrambling of its own ("padding"), so every pair is a (0, 2)-sequence and pairs
//! are independent of each other.
//!
//! Sources: I. Sobol, *On the Distribution of Points in a Cube*, 1967; A. Owen, *Randomly Permuted (t,m,s)-Nets and
//! (t,s)-Sequences*, 1995; B. Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020; the hash is
//! S. Laine's and T. Karras's (*Stratified Sampling for Stochastic Transparency*, 2011) with the constants that
//! N. Vegdahl found (*Building a Better LK Hash*, 2021).

use super::sampling::pcg4d;

/// The points of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelPoints {
    key: u32,
}

impl PixelPoints {
    /// Points of pixel (x, y) under `seed`.
    pub fn new(x: u32, y: u32, seed: u64) -> Self {
        Self { key: pcg4d([x, y, seed as u32, (seed >> 32) as u32])[0] }
    }

    /// Point `index` of the pair of dimensions called `pair`: 32 bits of a fraction each.
    #[inline(always)]
    pub fn bits(self, index: u32, pair: u32) -> [u32; 2] {
        let [order, first, second] = [0x9e37_79b9, 0x85eb_ca6b, 0xc2b2_ae35]
            .map(|name: u32| mixed(self.key ^ mixed(pair.wrapping_mul(name).wrapping_add(name))));
        let shuffled = scrambled(index.reverse_bits(), order).reverse_bits();
        [scrambled(shuffled, first).reverse_bits(), scrambled(pascal(shuffled), second).reverse_bits()]
    }

    /// The same as numbers in [0, 1), multiples of 2^-24: exact in f32 too.
    #[inline(always)]
    pub fn point(self, index: u32, pair: u32) -> [f64; 2] {
        self.bits(index, pair).map(fraction)
    }
}

/// The number in [0, 1) that the highest 24 bits are.
#[inline(always)]
pub fn fraction(bits: u32) -> f64 {
    f64::from(bits >> 8) / 16_777_216.0
}

/// Every bit of the result depends on every bit of `x`.
/// Source: the finalizer of MurmurHash3 (A. Appleby, public domain).
#[inline(always)]
fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x85eb_ca6b);
    x ^= x >> 13;
    x = x.wrapping_mul(0xc2b2_ae35);
    x ^ x >> 16
}

/// A hash each bit of which depends on lower bits only: on reversed fractions it is an Owen scrambling.
#[inline(always)]
fn scrambled(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The second dimension of Sobol's sequence at index `x`, bits reversed: `x` as a polynomial p over GF(2) becomes
/// p(z + 1), block by block, since (z + 1)^s = z^s + 1 for powers of two.
#[inline(always)]
fn pascal(mut x: u32) -> u32 {
    x ^= x >> 16 & 0x0000_ffff;
    x ^= x >> 8 & 0x00ff_00ff;
    x ^= x >> 4 & 0x0f0f_0f0f;
    x ^= x >> 2 & 0x3333_3333;
    x ^ x >> 1 & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sobol's second dimension by its direction numbers.
    fn by_direction_numbers(index: u32) -> u32 {
        let mut direction = 1u32 << 31;
        let mut sum = 0;
        for k in 0..32 {
            if index >> k & 1 == 1 {
                sum ^= direction;
            }
            direction ^= direction >> 1;
        }
        sum
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        for index in (0..5000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            assert_eq!(pascal(index).reverse_bits(), by_direction_numbers(index), "{index}");
        }
    }

    /// The first 2^m points lie one in each of the 2^m boxes of every shape, and those of the next 2^m too.
    #[test]
    fn every_elementary_interval_holds_one_point() {
        for pixel in 0..20 {
            let points = PixelPoints::new(pixel, 3, 7);
            for m in [4u32, 6] {
                for columns in 0..=m {
                    for block in 0..2 {
                        let mut seen = vec![false; 1 << m];
                        for i in 0..1 << m {
                            let [x, y] = points.bits(block * (1 << m) + i, pixel);
                            let cell = |bits: u32, n: u32| if n == 0 { 0 } else { bits >> (32 - n) };
                            let at = cell(x, columns) << (m - columns) | cell(y, m - columns);
                            assert!(!std::mem::replace(&mut seen[at as usize], true));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn pairs_and_pixels_are_independent() {
        // The correlation of 4096 independent uniform pairs has standard deviation 1/64.
        let correlation = |f: &dyn Fn(u32) -> (f64, f64)| {
            (0..4096).map(f).map(|(a, b)| (a - 0.5) * (b - 0.5) * 12.0).sum::<f64>() / 4096.0
        };
        let p = PixelPoints::new(1, 2, 3);
        let pairs = correlation(&|i| (p.point(i, 4)[0], p.point(i, 5)[0]));
        let pixels = correlation(&|i| {
            let [a, b] = [0, 1].map(|dx| PixelPoints::new(i % 64 * 2 + dx, i / 64, 3).point(0, 4)[0]);
            (a, b)
        });
        assert!(pairs.abs() < 5.0 / 64.0 && pixels.abs() < 5.0 / 64.0, "{pairs} {pixels}");
        assert_ne!(PixelPoints::new(1, 2, 3), PixelPoints::new(1, 2, 4));
    }
}
