//! Filters of FLIP, one axis after the other; the picture's border pixels go on beyond it.

use std::f64::consts::PI;

use rayon::prelude::*;

/// Width of a feature, degrees: the standard deviation of the feature filters is half of it.
const FEATURE_WIDTH: f64 = 0.082;

/// Contrast sensitivity as sums of Gaussians (weight a, scale b): achromatic, red-green, blue-yellow in two parts.
const SENSITIVITY: [(f64, f64); 4] = [(1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025)];
/// The largest scale, which sets the radius of all.
const LARGEST_SCALE: f64 = 0.04;

/// Pixels with three values each.
pub struct Raster {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Row-major, top row first.
    pub pixels: Vec<[f32; 3]>,
}

impl Raster {
    /// The same picture with `f` of every pixel.
    pub fn map(&self, f: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        let pixels = self.pixels.par_iter().map(|&pixel| f(pixel)).collect();
        Self { width: self.width, height: self.height, pixels }
    }

    /// Weighted sums along rows: `weights` has an odd length and its middle on the pixel.
    fn along_x(&self, weights: &[f32]) -> Self {
        self.filtered(weights, |x, y, k, radius| (clamp(x, k, radius, self.width), y))
    }

    /// Weighted sums along columns.
    fn along_y(&self, weights: &[f32]) -> Self {
        self.filtered(weights, |x, y, k, radius| (x, clamp(y, k, radius, self.height)))
    }

    fn filtered(&self, weights: &[f32], from: impl Fn(usize, usize, usize, usize) -> (usize, usize) + Sync) -> Self {
        let radius = weights.len() / 2;
        let row = |y: usize| {
            let from = &from;
            (0..self.width).map(move |x| {
                let mut sum = [0.0f32; 3];
                for (k, w) in weights.iter().enumerate() {
                    let (x, y) = from(x, y, k, radius);
                    let pixel = self.pixels[y * self.width + x];
                    (0..3).for_each(|c| sum[c] += w * pixel[c]);
                }
                sum
            })
        };
        let pixels = (0..self.height).into_par_iter().flat_map_iter(row).collect();
        Self { width: self.width, height: self.height, pixels }
    }
}

/// Place of weight `k` around `at`, kept inside `0..size`.
fn clamp(at: usize, k: usize, radius: usize, size: usize) -> usize {
    (at + k).saturating_sub(radius).min(size - 1)
}

/// A filter that is a product of one factor along each axis.
pub struct Separable {
    /// Along the axis of interest.
    main: Vec<f32>,
    /// Across it.
    across: Vec<f32>,
}

impl Separable {
    /// Length of the filter's answers along x and along y, of the first channel.
    pub fn gradient(&self, picture: &Raster) -> Vec<f32> {
        let x = picture.along_x(&self.main).along_y(&self.across);
        let y = picture.along_x(&self.across).along_y(&self.main);
        x.pixels.iter().zip(&y.pixels).map(|(x, y)| x[0].hypot(y[0])).collect()
    }
}

fn gaussian(radius: usize, exponent: f64) -> Vec<f64> {
    let offsets = (0..=2 * radius).map(|i| i as f64 - radius as f64);
    offsets.map(|x| (exponent * x * x).exp()).collect()
}

fn narrow(weights: impl IntoIterator<Item = f64>) -> Vec<f32> {
    weights.into_iter().map(|w| w as f32).collect()
}

/// The sensitivity filters: achromatic, red-green, and the two parts whose sum is blue-yellow; each of the three sums
/// to 1.
pub fn sensitivity(ppd: f64) -> [Separable; 4] {
    let radius = (3.0 * (LARGEST_SCALE / (2.0 * PI * PI)).sqrt() * ppd).ceil() as usize;
    let parts = SENSITIVITY.map(|(a, b)| (a * (PI / b).sqrt(), gaussian(radius, -PI * PI / (b * ppd * ppd))));
    let total = |(weight, line): &(f64, Vec<f64>)| weight * line.iter().sum::<f64>().powi(2);
    let totals: [f64; 4] = std::array::from_fn(|i| total(&parts[i]));
    let norms = [totals[0], totals[1], totals[2] + totals[3], totals[2] + totals[3]];
    std::array::from_fn(|i| {
        let (weight, line) = &parts[i];
        Separable { main: narrow(line.iter().map(|x| weight / norms[i] * x)), across: narrow(line.iter().copied()) }
    })
}

/// Each opponent colour through its own filter.
pub fn apply_sensitivity(filters: &[Separable; 4], opponent: &Raster) -> Raster {
    let [a, rg, by1, by2] = filters.each_ref().map(|f| opponent.along_x(&f.main).along_y(&f.across));
    let pixel = |i: usize| [a.pixels[i][0], rg.pixels[i][1], by1.pixels[i][2] + by2.pixels[i][2]];
    let pixels = (0..opponent.pixels.len()).into_par_iter().map(pixel).collect();
    Raster { width: opponent.width, height: opponent.height, pixels }
}

/// Derivative of a Gaussian: positive weights sum to 1, negative ones to -1.
pub fn edge(ppd: f64) -> Separable {
    feature(ppd, |x, _| -x)
}

/// Second derivative of a Gaussian, normalised the same way.
pub fn point(ppd: f64) -> Separable {
    feature(ppd, |x, sigma| x * x / (sigma * sigma) - 1.0)
}

fn feature(ppd: f64, factor: impl Fn(f64, f64) -> f64) -> Separable {
    let sigma = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * sigma).ceil() as usize;
    let line = gaussian(radius, -0.5 / (sigma * sigma));
    let main: Vec<f64> = line.iter().enumerate().map(|(i, g)| g * factor(i as f64 - radius as f64, sigma)).collect();
    let positive: f64 = main.iter().filter(|x| **x > 0.0).sum();
    let negative: f64 = -main.iter().filter(|x| **x < 0.0).sum::<f64>();
    let sum: f64 = line.iter().sum();
    Separable {
        main: narrow(main.iter().map(|x| if *x > 0.0 { x / positive } else { x / negative })),
        across: narrow(line.iter().map(|g| g / sum)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_keep_flat_pictures_and_features_ignore_them() {
        let flat = Raster { width: 5, height: 3, pixels: vec![[0.5, -0.25, 2.0]; 15] };
        let seen = apply_sensitivity(&sensitivity(67.0), &flat);
        for pixel in &seen.pixels {
            assert!(pixel.iter().zip([0.5, -0.25, 2.0]).all(|(a, b)| (a - b).abs() < 1e-5), "{pixel:?}");
        }
        for filter in [edge(67.0), point(67.0)] {
            assert!(filter.gradient(&flat).iter().all(|x| *x < 1e-6));
        }
    }

    /// A step from 0 to 1 meets the positive half of the edge filter: 1 at the step (up to the middle weight, which is 0).
    #[test]
    fn a_step_is_an_edge_of_full_strength() {
        let pixels = (0..64 * 3).map(|i| [if i % 64 < 32 { 1.0 } else { 0.0 }; 3]).collect();
        let step = Raster { width: 64, height: 3, pixels };
        let strength = edge(67.0).gradient(&step);
        let most = strength.iter().copied().fold(0.0, f32::max);
        assert!((most - 1.0).abs() < 1e-4, "{most}");
        assert!(strength[0] < 1e-4 && strength[63] < 1e-4);
    }
}
