//! Exposures of HDR-FLIP: from the one that keeps the brightest pixel below white to the one that shows the median
//! pixel bright.
//!
//! The tone curve is the fit to the ACES reference by K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016, with its input
//! scaled by 0.6 as the authors of HDR-FLIP do.

use super::Rgb;

/// Numerator and denominator of the curve: (n0 x^2 + n1 x + n2) / (d0 x^2 + d1 x + d2).
const NUMERATOR: [f32; 3] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0];
const DENOMINATOR: [f32; 3] = [0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

/// Signal at which a pixel counts as bright but not white.
const BRIGHT: f64 = 0.85;

/// Darkest luminance that sets an exposure.
const DARKEST: f64 = 1e-10;

/// Most exposures that are looked at: 2^64 of range is beyond any camera.
const MOST: usize = 64;

/// The tone curve; 0 to about 1.
pub fn aces(x: f32) -> f32 {
    let polynomial = |[a, b, c]: [f32; 3]| (a * x + b) * x + c;
    if x.is_infinite() { NUMERATOR[0] / DENOMINATOR[0] } else { polynomial(NUMERATOR) / polynomial(DENOMINATOR) }
}

/// The luminance that the curve maps to [`BRIGHT`].
fn bright_luminance() -> f64 {
    let [a, b, c]: [f64; 3] = std::array::from_fn(|i| f64::from(NUMERATOR[i]) - BRIGHT * f64::from(DENOMINATOR[i]));
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// Factors of the exposures for `reference`: at least two, one per stop of the range.
pub fn gains(reference: &Rgb<'_>) -> Vec<f32> {
    let [r, g, b] = reference.planes;
    // Luminance of Rec. 709 primaries.
    let luminance = |i: usize| 0.212_639 * f64::from(r[i]) + 0.715_169 * f64::from(g[i]) + 0.072_192 * f64::from(b[i]);
    let mut luminances: Vec<f64> = (0..r.len()).map(luminance).filter(|y| y.is_finite()).collect();
    luminances.sort_by(f64::total_cmp);
    let Some(&brightest) = luminances.last() else { return vec![1.0] };
    let median = luminances[luminances.len() / 2].max(DARKEST);
    let stops = |y: f64| (bright_luminance() / y).log2();
    let (start, stop) = (stops(brightest.max(DARKEST)), stops(median));
    let count = ((stop - start).ceil().max(2.0) as usize).min(MOST);
    let step = (stop - start) / (count - 1) as f64;
    (0..count).map(|i| (start + i as f64 * step).exp2() as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_and_its_inverse_agree() {
        let x = bright_luminance();
        assert!((f64::from(aces(x as f32)) - BRIGHT).abs() < 1e-6, "{x}");
        assert!(aces(0.0) == 0.0 && aces(f32::INFINITY) > 1.0);
    }

    /// Brightest 8 and median 1 are three stops apart: three exposures, the first makes 8 bright, the last 1.
    #[test]
    fn exposures_span_from_the_brightest_to_the_median() {
        let plane = [0.5, 1.0, 1.0, 8.0];
        let gains = gains(&Rgb { width: 4, height: 1, planes: [&plane; 3] });
        assert_eq!(gains.len(), 3, "{gains:?}");
        let bright = bright_luminance() as f32;
        assert!((gains[0] - bright / 8.0).abs() < 1e-4 && (gains[2] - bright).abs() < 1e-3, "{gains:?}");
        let black = [0.0; 4];
        assert!(super::gains(&Rgb { width: 4, height: 1, planes: [&black; 3] }).iter().all(|g| g.is_finite()));
    }
}
