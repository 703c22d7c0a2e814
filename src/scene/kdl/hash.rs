//! Integer hashing: the same random numbers on every machine.

/// Mixes the bits of `x` (a bijection).
///
/// Source: Chris Wellons, "Prospecting for Hash Functions", 2018: `lowbias32`.
pub fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A hash of three numbers; different orders give different values.
pub fn mix3(a: u32, b: u32, c: u32) -> u32 {
    mix(mix(mix(a.wrapping_add(0x9e37_79b9)).wrapping_add(b)).wrapping_add(c))
}

/// A hash as a number in 0..1, 1 excluded.
pub fn unit(hash: u32) -> f64 {
    f64::from(hash) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mix_matches_hand_worked_bits() {
        assert_eq!(mix(0), 0);
        // Worked out with Python's unbounded integers.
        assert_eq!(mix(1), 0x6889_90c0);
        assert_eq!(mix(0xdead_beef), 0xe628_c683);
    }

    #[test]
    fn random_numbers_fill_the_interval_evenly() {
        let mut bins = [0_u32; 16];
        for i in 0..16_000 {
            bins[(unit(mix3(i, 7, 0)) * 16.0) as usize] += 1;
        }
        // Standard deviation of a bin is about 31.
        assert!(bins.iter().all(|&n| (850..1150).contains(&n)), "{bins:?}");
        assert_ne!(mix3(1, 2, 3), mix3(3, 2, 1));
    }
}
