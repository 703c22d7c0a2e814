//! Structural similarity.
//!
//! Source: Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image Quality Assessment: From Error Visibility to
//! Structural Similarity", 2004: a Gaussian window of 11x11 pixels, standard deviation 1.5; K1 = 0.01, K2 = 0.03. Means are
//! over all windows that lie inside the picture, then over the three colours.

use rayon::prelude::*;

use super::Rgb;
use crate::error::Result;

/// Width and height of the window.
pub const WINDOW: usize = 11;

const SIGMA: f64 = 1.5;
const K1: f64 = 0.01;
const K2: f64 = 0.03;

/// Mean structural similarity of two pictures whose values span `range` (1 for values from 0 to 1): 1 for the same
/// pictures. `None` for pictures smaller than the window. A sample that is NaN or the same infinity in both counts as 0 in both;
/// NaN if one is not finite otherwise.
///
/// # Errors
/// Pictures of different sizes.
pub fn ssim(a: &Rgb<'_>, b: &Rgb<'_>, range: f64) -> Result<Option<f64>> {
    a.check_same_size(b)?;
    if a.width < WINDOW || a.height < WINDOW {
        return Ok(None);
    }
    let channels = (0..3).map(|c| channel(a.planes[c], b.planes[c], a.width, range));
    Ok(Some(channels.sum::<f64>() / 3.0))
}

/// Weights of the window along one axis; their sum is 1.
fn weights() -> [f64; WINDOW] {
    let weight = |i: usize| (-(i as f64 - 5.0).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    let raw: [f64; WINDOW] = std::array::from_fn(weight);
    let sum: f64 = raw.iter().sum();
    raw.map(|w| w / sum)
}

fn channel(a: &[f32], b: &[f32], width: usize, range: f64) -> f64 {
    let rows = a.len() / width;
    // Along x first: the five moments of every row of windows.
    let along_x: Vec<[f64; 5]> = a
        .par_chunks(width)
        .zip(b.par_chunks(width))
        .flat_map_iter(|(a, b)| (0..=width - WINDOW).map(move |x| moments(&a[x..x + WINDOW], &b[x..x + WINDOW])))
        .collect();
    let columns = width + 1 - WINDOW;
    let weights = weights();
    let (c1, c2) = ((K1 * range).powi(2), (K2 * range).powi(2));
    let row_sums: Vec<f64> = (0..=rows - WINDOW)
        .into_par_iter()
        .map(|y| {
            let one = |x: usize| {
                let mut m = [0.0; 5];
                for (k, w) in weights.iter().enumerate() {
                    let part = &along_x[(y + k) * columns + x];
                    m.iter_mut().zip(part).for_each(|(to, from)| *to += w * from);
                }
                let [ma, mb, aa, bb, ab] = m;
                let (va, vb, cov) = (aa - ma * ma, bb - mb * mb, ab - ma * mb);
                (2.0 * ma * mb + c1) * (2.0 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
            };
            (0..columns).map(one).sum()
        })
        .collect();
    // Summed in row order, so that the number of threads does not change it.
    row_sums.iter().sum::<f64>() / (columns * (rows + 1 - WINDOW)) as f64
}

/// Weighted means of a, b, a^2, b^2 and a b over one row of a window.
fn moments(a: &[f32], b: &[f32]) -> [f64; 5] {
    let mut m = [0.0; 5];
    for ((w, &a), &b) in weights().iter().zip(a).zip(b) {
        // What is the same in both tells them not apart, though nothing can be computed of it.
        let is_same = !a.is_finite() && (a == b || a.is_nan() && b.is_nan());
        let (a, b) = if is_same { (0.0, 0.0) } else { (f64::from(a), f64::from(b)) };
        m.iter_mut().zip([a, b, a * a, b * b, a * b]).for_each(|(to, x)| *to += w * x);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(a: &[f32], b: &[f32], width: usize) -> Option<f64> {
        let rgb = |plane| Rgb { width, height: a.len() / width, planes: [plane; 3] };
        ssim(&rgb(a), &rgb(b), 1.0).unwrap()
    }

    /// Flat pictures have no variance: (2 a b + C1) / (a^2 + b^2 + C1).
    #[test]
    fn flat_pictures_by_hand() {
        let got = of(&[0.2; 400], &[0.4; 400], 20).unwrap();
        let want = (2.0 * 0.2 * 0.4 + 1e-4) / (0.04 + 0.16 + 1e-4);
        assert!((got - want).abs() < 1e-6, "{got} {want}");
    }

    #[test]
    fn same_is_one_inverted_is_negative_small_is_none() {
        let a: Vec<f32> = (0..400).map(|i| ((i * 37 + i / 20 * 11) % 16) as f32 / 15.0).collect();
        let inverse: Vec<f32> = a.iter().map(|x| 1.0 - x).collect();
        assert!((of(&a, &a, 20).unwrap() - 1.0).abs() < 1e-12);
        assert!(of(&a, &inverse, 20).unwrap() < -0.5);
        assert_eq!(of(&[0.0; 100], &[0.0; 100], 10), None);
    }
    /// What is not finite in both says nothing; in one only, it is beyond every limit.
    #[test]
    fn samples_that_are_no_numbers() {
        let mut a: Vec<f32> = (0..400).map(|i| ((i * 37 + i / 20 * 11) % 16) as f32 / 15.0).collect();
        let whole = a.clone();
        (a[3], a[205], a[399]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
        assert!((of(&a, &a, 20).unwrap() - 1.0).abs() < 1e-12);
        assert!(of(&a, &whole, 20).unwrap().is_nan() && of(&whole, &a, 20).unwrap().is_nan());
    }
}
