//! Linear light to display levels, fast enough for every frame: the levels of [`crate::film::srgb::encode_level`], looked up.

use crate::film::srgb;

/// Bits of an f32 that choose a slot: sign, exponent and seven bits of the mantissa. A slot spans at most 1/128 of its value.
const SHIFT: u32 = 16;
/// Slots of numbers from 0 to 1: the bits of 1.0 shifted, and one more.
const SLOTS: usize = (0x3f80_0000 >> SHIFT) + 1;

/// The curve as a table.
pub struct Levels {
    /// Level at the start of each slot.
    first: Vec<u8>,
    /// `from[k]` is the least number shown as level k or above.
    from: [f32; 257],
}

impl Default for Levels {
    fn default() -> Self {
        let mut from = [f32::INFINITY; 257];
        for (level, least) in from.iter_mut().enumerate().take(256) {
            *least = least_of(level as u8);
        }
        let first = (0..SLOTS as u32).map(|slot| exact(f32::from_bits(slot << SHIFT))).collect();
        Self { first, from }
    }
}

fn exact(x: f32) -> u8 {
    srgb::encode_level(f64::from(x))
}

/// The least number from 0 on that is shown as `level` or above. Bits of positive numbers are ordered as they are.
fn least_of(level: u8) -> f32 {
    let (mut low, mut high) = (0u32, 1f32.to_bits());
    while low < high {
        let middle = low + (high - low) / 2;
        if exact(f32::from_bits(middle)) >= level {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    f32::from_bits(low)
}

impl Levels {
    /// The level that shows `x`; below 0 and NaN give 0, above 1 gives 255.
    #[inline]
    pub fn level(&self, x: f32) -> u8 {
        if x >= 1.0 {
            return 255;
        }
        // Also what is not a number or negative.
        if x.is_nan() || x <= 0.0 {
            return 0;
        }
        let mut level = self.first[(x.to_bits() >> SHIFT) as usize];
        while x >= self.from[usize::from(level) + 1] {
            level += 1;
        }
        level
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_curve() {
        let levels = Levels::default();
        let mut tried = 0u32;
        let mut check = |x: f32| {
            assert_eq!(levels.level(x), exact(x), "{x:e}");
            tried += 1;
        };
        for special in [0.0, -0.0, -1.0, 1.0, 1.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE, 1e-40]
        {
            check(special);
        }
        // Around every threshold and slot, and across the range.
        for level in 0..=255u8 {
            let at = least_of(level).to_bits();
            (at.saturating_sub(3)..at + 4).for_each(|bits| check(f32::from_bits(bits)));
        }
        (0..1f32.to_bits() + 100_000).step_by(4_001).for_each(|bits| check(f32::from_bits(bits)));
        assert!(tried > 200_000);
    }
}
