//! How far two pictures are apart: per sample (errors, units in the last place, classes), and as people see them (PSNR,
//! SSIM, FLIP).
//!
//! Why these are written here: the well-kept crates either work on 8-bit pictures with another window than the one
//! that was published (`image-compare`) or need a C++ compiler (`nv-flip`), and none knows HDR-FLIP. The tests compare with
//! scikit-image and with the authors' own FLIP.

mod flip;
mod samples;
mod ssim;

pub use flip::{FlipMap, Viewing, hdr_flip, ldr_flip};
pub use samples::{Classes, Errors, PlaneDifference, Sums, level_classes, plane_difference, ulp_distance};
pub use ssim::{WINDOW as SSIM_WINDOW, ssim};

use crate::error::{Error, Result};

/// Red, green and blue of a picture, row-major, top row first.
#[derive(Clone, Copy, Debug)]
pub struct Rgb<'a> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// One value per pixel each.
    pub planes: [&'a [f32]; 3],
}

impl Rgb<'_> {
    /// Whether every plane has a value per pixel and there is a pixel.
    fn check(&self) -> Result<()> {
        let pixels = self.width * self.height;
        if pixels == 0 || self.planes.iter().any(|plane| plane.len() != pixels) {
            return Err(Error::Usage(format!("planes do not cover a picture of {}x{}", self.width, self.height)));
        }
        Ok(())
    }

    /// Checks that `other` has the same size.
    ///
    /// # Errors
    /// [`Error::Usage`] that names both sizes.
    fn check_same_size(&self, other: &Rgb<'_>) -> Result<()> {
        self.check()?;
        other.check()?;
        if (self.width, self.height) != (other.width, other.height) {
            let Rgb { width, height, .. } = other;
            return Err(Error::Usage(format!("pictures of {}x{} and {width}x{height}", self.width, self.height)));
        }
        Ok(())
    }
}

/// Peak signal-to-noise ratio in decibels: 10 log10(`peak`^2 / mean squared error); infinite for equal pictures, whatever the peak.
pub fn psnr(mean_squared_error: f64, peak: f64) -> f64 {
    if mean_squared_error == 0.0 {
        return f64::INFINITY;
    }
    10.0 * (peak * peak / mean_squared_error).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An error of 0.1 at a peak of 1 is 20 dB, half of it 6.02 dB more; 255 levels scale the peak.
    #[test]
    fn psnr_by_hand() {
        assert!((psnr(0.01, 1.0) - 20.0).abs() < 1e-12);
        assert!((psnr(0.0025, 1.0) - 26.020_599_913).abs() < 1e-8);
        assert!((psnr(25.5f64.powi(2), 255.0) - 20.0).abs() < 1e-12);
        assert_eq!([psnr(0.0, 1.0), psnr(0.0, 0.0)], [f64::INFINITY; 2]);
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        let plane = [0.0; 6];
        let rgb = |width, height| Rgb { width, height, planes: [&plane; 3] };
        assert!(rgb(2, 3).check_same_size(&rgb(2, 3)).is_ok());
        let text = rgb(2, 3).check_same_size(&rgb(3, 2)).unwrap_err().to_string();
        assert_eq!(text, "pictures of 2x3 and 3x2");
        assert!(rgb(2, 2).check().is_err() && rgb(0, 0).check().is_err());
    }
}
