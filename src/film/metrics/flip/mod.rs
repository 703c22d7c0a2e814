//! FLIP: the difference that a person sees who flips between two pictures, per pixel from 0 to 1.
//!
//! Sources: P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", 2020 (LDR); P. Andersson, J. Nilsson, P. Shirley, T. Akenine-Möller, "Visualizing
//! Errors in Rendered High Dynamic Range Images", 2021 (HDR). Filters are applied one axis after the other, which is
//! the same sum in another order.

mod color;
mod exposure;
mod filter;

use rayon::prelude::*;

use self::color::{hunt, hyab, linear_to_opponent, opponent_to_linear};
use self::filter::{Raster, Separable};
use super::Rgb;
use crate::error::Result;

/// Exponent of the colour difference.
const COLOR_EXPONENT: f32 = 0.7;
/// Share of the largest colour difference that maps to [`SHARE_OF_RESULT`] of the result.
const SHARE_OF_MAXIMUM: f32 = 0.4;
const SHARE_OF_RESULT: f32 = 0.95;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f32 = 0.5;

/// How the picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewing {
    /// Pixels that one degree of the visual field holds.
    pub pixels_per_degree: f64,
}

impl Default for Viewing {
    /// A monitor 0.7 m wide with 3840 pixels, seen from 0.7 m: the authors' own choice, about 67 pixels per degree.
    fn default() -> Self {
        Self { pixels_per_degree: 0.7 * (3840.0 / 0.7) * (std::f64::consts::PI / 180.0) }
    }
}

/// A value from 0 (same) to 1 per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Row-major, top row first.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// The mean, which is what FLIP is quoted as.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&x| f64::from(x)).sum::<f64>() / self.values.len().max(1) as f64
    }

    /// The largest value.
    pub fn max(&self) -> f64 {
        self.values.iter().fold(0.0f32, |most, &x| most.max(x)).into()
    }
}

/// FLIP of two pictures in linear light; what lies outside 0..1 is clamped, NaN is black.
///
/// # Errors
/// Pictures of different sizes.
pub fn ldr_flip(reference: &Rgb<'_>, test: &Rgb<'_>, viewing: Viewing) -> Result<FlipMap> {
    reference.check_same_size(test)?;
    Ok(Evaluator::new(viewing).flip(&clamped(reference, 1.0, |x| x), &clamped(test, 1.0, |x| x)))
}

/// HDR-FLIP: the largest FLIP over the exposures at which the reference can be looked at, each tone mapped by the
/// ACES curve that the authors use.
///
/// # Errors
/// Pictures of different sizes.
pub fn hdr_flip(reference: &Rgb<'_>, test: &Rgb<'_>, viewing: Viewing) -> Result<FlipMap> {
    reference.check_same_size(test)?;
    let evaluator = Evaluator::new(viewing);
    let mut most = FlipMap { values: vec![0.0; reference.width * reference.height] };
    for gain in exposure::gains(reference) {
        let [a, b] = [reference, test].map(|picture| clamped(picture, gain, exposure::aces));
        let flip = evaluator.flip(&a, &b);
        most.values.iter_mut().zip(flip.values).for_each(|(most, x)| *most = most.max(x));
    }
    Ok(most)
}

/// The picture times `gain` through `curve`, clamped to 0..1.
fn clamped(picture: &Rgb<'_>, gain: f32, curve: impl Fn(f32) -> f32 + Sync) -> Raster {
    let value = |x: f32| {
        let y = curve(x * gain);
        if y > 0.0 { y.min(1.0) } else { 0.0 }
    };
    let [r, g, b] = picture.planes;
    let pixels = (0..r.len()).into_par_iter().map(|i| [r[i], g[i], b[i]].map(value)).collect();
    Raster { width: picture.width, height: picture.height, pixels }
}

/// The filters for one way of looking.
struct Evaluator {
    /// Contrast sensitivity: achromatic, red-green, and the two parts of blue-yellow.
    sensitivity: [Separable; 4],
    edge: Separable,
    point: Separable,
    /// The colour difference of green and blue, the largest on a monitor.
    largest: f32,
}

impl Evaluator {
    fn new(viewing: Viewing) -> Self {
        let ppd = viewing.pixels_per_degree;
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt);
        Self {
            sensitivity: filter::sensitivity(ppd),
            edge: filter::edge(ppd),
            point: filter::point(ppd),
            largest: hyab(green, blue).powf(COLOR_EXPONENT),
        }
    }

    /// FLIP of two pictures of linear values from 0 to 1.
    fn flip(&self, a: &Raster, b: &Raster) -> FlipMap {
        let [a, b] = [a, b].map(|picture| picture.map(linear_to_opponent));
        let [seen_a, seen_b] = [&a, &b].map(|picture| self.seen(picture));
        let [features_a, features_b] = [&a, &b].map(|picture| self.features(picture));
        let pixel = |i: usize| {
            let color = self.redistributed(hyab(seen_a.pixels[i], seen_b.pixels[i]).powf(COLOR_EXPONENT));
            let [[edge_a, point_a], [edge_b, point_b]] = [features_a[i], features_b[i]];
            let feature = (edge_a - edge_b).abs().max((point_a - point_b).abs());
            let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
            color.powf(1.0 - feature)
        };
        FlipMap { values: (0..a.pixels.len()).into_par_iter().map(pixel).collect() }
    }

    /// What of the opponent colours the eye resolves, in Hunt-adjusted CIELAB.
    fn seen(&self, opponent: &Raster) -> Raster {
        let filtered = filter::apply_sensitivity(&self.sensitivity, opponent);
        filtered.map(|pixel| hunt(opponent_to_linear(pixel).map(|x| x.clamp(0.0, 1.0))))
    }

    /// Strength of edges and points of the achromatic channel.
    fn features(&self, opponent: &Raster) -> Vec<[f32; 2]> {
        // Lightness from -16 to 100 becomes 0 to 1.
        let lightness = opponent.map(|[y, _, _]| [(y + 16.0) / 116.0; 3]);
        let [edges, points] = [&self.edge, &self.point].map(|filter| filter.gradient(&lightness));
        edges.into_iter().zip(points).map(|(edge, point)| [edge, point]).collect()
    }

    /// Colour differences from 0 to 1: small ones get most of the range.
    fn redistributed(&self, difference: f32) -> f32 {
        let knee = SHARE_OF_MAXIMUM * self.largest;
        if difference < knee {
            SHARE_OF_RESULT / knee * difference
        } else {
            SHARE_OF_RESULT + (difference - knee) / (self.largest - knee) * (1.0 - SHARE_OF_RESULT)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(planes: &[Vec<f32>; 3], width: usize) -> Rgb<'_> {
        Rgb { width, height: planes[0].len() / width, planes: [&planes[0], &planes[1], &planes[2]] }
    }

    fn flat(color: [f32; 3]) -> [Vec<f32>; 3] {
        color.map(|x| vec![x; 64])
    }

    /// Flat pictures have no features; green against blue is the largest colour difference, so FLIP is 1 everywhere.
    #[test]
    fn the_extremes_are_zero_and_one() {
        let (green, blue) = (flat([0.0, 1.0, 0.0]), flat([0.0, 0.0, 1.0]));
        let viewing = Viewing::default();
        let same = ldr_flip(&picture(&green, 8), &picture(&green, 8), viewing).unwrap();
        assert!(same.max() < 1e-6, "{same:?}");
        let most = ldr_flip(&picture(&green, 8), &picture(&blue, 8), viewing).unwrap();
        assert!((most.mean() - 1.0).abs() < 1e-3 && most.max() <= 1.0 + 1e-5, "{most:?}");
        assert!((viewing.pixels_per_degree - 67.0206).abs() < 1e-4);
    }

    #[test]
    fn a_highlight_that_is_clipped_differs_only_in_hdr() {
        let (mut a, b) = (flat([0.5, 0.5, 0.5]), flat([0.5, 0.5, 0.5]));
        (a[0][27], a[1][27], a[2][27]) = (40.0, 40.0, 40.0);
        let mut c = a.clone();
        (c[0][27], c[1][27], c[2][27]) = (80.0, 80.0, 80.0);
        let viewing = Viewing::default();
        let (ldr, hdr) = (ldr_flip, hdr_flip);
        assert!(ldr(&picture(&a, 8), &picture(&c, 8), viewing).unwrap().max() < 1e-6);
        assert!(hdr(&picture(&a, 8), &picture(&c, 8), viewing).unwrap().max() > 0.05);
        assert!(hdr(&picture(&b, 8), &picture(&b, 8), viewing).unwrap().max() < 1e-6);
    }
}
