//! The sRGB transfer function, both ways, exactly as published.
//!
//! Source: IEC 61966-2-1:1999 "Colour management - Default RGB colour space - sRGB": linear up to 0.0031308, then a
//! power of 1/2.4 with offset. Computed in f64, so an 8-bit level never depends on the rounding of f32.

/// Linear light (0 to 1) to the sRGB signal (0 to 1).
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The sRGB signal (0 to 1) to linear light (0 to 1).
pub fn decode(signal: f64) -> f64 {
    if signal <= 0.040_45 { signal / 12.92 } else { ((signal + 0.055) / 1.055).powf(2.4) }
}

/// A number to the nearest of 256 levels from 0 to 1; what lies outside is clamped, NaN is 0.
pub fn level(value: f64) -> u8 {
    (unit(value) * 255.0).round() as u8
}

/// Linear light to its 8-bit sRGB level; clamped, NaN is 0, infinity 255.
pub fn encode_level(linear: f64) -> u8 {
    level(encode(unit(linear)))
}

/// Clamped to 0..1; unlike `clamp`, NaN becomes 0.
fn unit(x: f64) -> f64 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values worked out from the formula of the standard to 40 decimal digits, not with this code.
    #[test]
    fn published_values() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(encode(0.001), 0.012_92);
        near(encode(0.18), 0.461_356_129_500_441);
        near(encode(0.5), 0.735_356_983_052_449);
        near(encode(1.0), 1.0);
        near(decode(0.5), 0.214_041_140_482_233);
        near(decode(0.04), 0.003_095_975_232_198);
        assert_eq!([0.0, 0.001, 0.18, 0.5, 1.0].map(encode_level), [0, 3, 118, 188, 255]);
    }

    #[test]
    fn the_two_pieces_meet() {
        let gap = encode(0.003_130_8 + 1e-12) - encode(0.003_130_8);
        assert!(gap.abs() < 1e-7, "{gap}");
    }

    #[test]
    fn levels_survive_the_round_trip() {
        for signal in 0..=255u8 {
            let linear = f64::from(decode(f64::from(signal) / 255.0) as f32);
            assert_eq!(encode_level(linear), signal);
        }
    }

    #[test]
    fn numbers_that_are_no_light() {
        assert_eq!([f64::NAN, -1.0, f64::NEG_INFINITY, -0.0].map(encode_level), [0; 4]);
        assert_eq!([2.0, f64::INFINITY, f64::MAX].map(encode_level), [255; 3]);
    }
}
