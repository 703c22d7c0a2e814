//! Heat maps: one number per pixel as a colour that gets brighter with it.
//!
//! The colours are `magma` by S. van der Walt, N. Smith (matplotlib, 2015), from the crate `colorous`: even steps look
//! even, also in print and to the colour-blind.

use std::path::Path;

use super::planes::{COLOR, Film, PlaneData, Window};
use super::{png, srgb};
use crate::error::Result;

/// sRGB levels of `value` from 0 (black) to 1 (pale yellow); what lies outside is clamped, NaN is white.
pub fn color(value: f64) -> [u8; 3] {
    if value.is_nan() {
        return [255; 3];
    }
    let color = colorous::MAGMA.eval_continuous(value.clamp(0.0, 1.0));
    [color.r, color.g, color.b]
}

/// `values` over `window` of a picture of `width` x `height`, as linear colours; `full` is the value of the brightest.
///
/// # Errors
/// [`crate::error::Error::Usage`] if the values do not cover the window.
pub fn film(width: u32, height: u32, window: Window, values: &[f32], full: f32) -> Result<Film> {
    let mut film = Film::new(width, height, window)?;
    let scale = if full > 0.0 { 1.0 / f64::from(full) } else { 0.0 };
    let colors: Vec<[u8; 3]> = values.iter().map(|&x| color(f64::from(x) * scale)).collect();
    for (channel, name) in COLOR.into_iter().enumerate() {
        let linear = |c: &[u8; 3]| srgb::decode(f64::from(c[channel]) / 255.0) as f32;
        film.push(name, PlaneData::F32(colors.iter().map(linear).collect()))?;
    }
    Ok(film)
}

/// Writes [`film`] as a PNG.
///
/// # Errors
/// As [`film`], and [`crate::error::Error::Io`].
pub fn write_png(path: &Path, window: Window, values: &[f32], full: f32) -> Result<()> {
    let (width, height) = (window.width(), window.height());
    png::write(path, &film(width, height, Window::full(width, height), values, full)?, 0.0)
}

/// The value below which `share` of the finite `values` lie: a full scale that a few hot pixels do not spoil. 0 if there is
/// none.
pub fn quantile(values: &[f32], share: f64) -> f32 {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    let place = (share.clamp(0.0, 1.0) * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(place).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_is_more() {
        let light = |x: f64| color(x).iter().map(|&c| u32::from(c)).sum::<u32>();
        let steps: Vec<u32> = (0..=10).map(|i| light(f64::from(i) / 10.0)).collect();
        assert!(steps.windows(2).all(|w| w[0] < w[1]), "{steps:?}");
        assert_eq!((color(-1.0), color(2.0), color(f64::NAN)), (color(0.0), color(1.0), [255; 3]));
    }

    #[test]
    fn maps_scale_and_survive_the_levels() {
        let film = film(2, 1, Window::full(2, 1), &[0.0, 8.0], 8.0).unwrap();
        let levels = png::to_srgb8(&film, 0.0).unwrap().bytes;
        assert_eq!([levels[..3].to_vec(), levels[3..].to_vec()], [color(0.0).to_vec(), color(1.0).to_vec()]);
        assert!(super::film(2, 1, Window::full(2, 1), &[0.0], 1.0).is_err());
    }

    #[test]
    fn quantiles_by_hand() {
        assert_eq!(quantile(&[3.0, f32::NAN, 1.0, 2.0, 4.0, f32::INFINITY, 5.0], 0.5), 3.0);
        assert_eq!((quantile(&[3.0, 1.0], 1.0), quantile(&[], 0.5)), (3.0, 0.0));
    }
}
