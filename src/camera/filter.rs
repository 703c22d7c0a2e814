//! Pixel filters, by importance: samples are placed with the filter's density and all count the same.
//!
//! Source: M. Ernst, M. Stamminger, G. Greiner, *Filter Importance Sampling*, IEEE Symposium on Interactive Ray
//! Tracing, 2006.

use std::sync::LazyLock;

use crate::error::{Error, Result, by_name};

/// Weight of a sample by its distance from the pixel's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The pixel's square.
    #[default]
    Box,
    /// A tent one pixel wide to each side.
    Tent,
    /// The four-term window of Blackman and Harris, 1.5 pixels to each side.
    /// Source: F. Harris, *On the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform*, 1978.
    BlackmanHarris,
}

/// Half width of [`Filter::BlackmanHarris`], pixels.
const REACH: f64 = 1.5;
/// Cells of its table.
const CELLS: usize = 1024;

impl Filter {
    /// All filters.
    pub const ALL: [Self; 3] = [Self::Box, Self::Tent, Self::BlackmanHarris];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::BlackmanHarris => "blackman-harris",
        }
    }

    /// Place relative to the pixel's centre, pixels, of the number `u` in [0, 1) along one axis.
    pub fn place(self, u: f64) -> f64 {
        match self {
            Self::Box => u - 0.5,
            Self::Tent if u < 0.5 => (2.0 * u).sqrt() - 1.0,
            Self::Tent => 1.0 - (2.0 - 2.0 * u).sqrt(),
            Self::BlackmanHarris => {
                let table = &*TABLE;
                let cell = table.partition_point(|&sum| sum <= u).clamp(1, CELLS);
                let (below, above) = (table[cell - 1], table[cell]);
                let inside = (cell - 1) as f64 + (u - below) / (above - below);
                REACH * (2.0 * inside / CELLS as f64 - 1.0)
            }
        }
    }
}

/// Integral of the window up to the end of each cell, from 0 to 1.
static TABLE: LazyLock<[f64; CELLS + 1]> = LazyLock::new(|| {
    let window = |x: f64| {
        let turn = std::f64::consts::TAU * x;
        0.35875 - 0.48829 * turn.cos() + 0.14128 * (2.0 * turn).cos() - 0.01168 * (3.0 * turn).cos()
    };
    let mut table = [0.0; CELLS + 1];
    for cell in 0..CELLS {
        table[cell + 1] = table[cell] + window((cell as f64 + 0.5) / CELLS as f64);
    }
    let all = table[CELLS];
    table.map(|sum| sum / all)
});

impl std::str::FromStr for Filter {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("filter", &Self::ALL, Self::name, name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_symmetric_and_have_the_filters_variance() {
        // Variance: box 1/12, tent 1/6; of the window by quadrature.
        let window = |x: f64| {
            let a = std::f64::consts::TAU * (x / 3.0 + 0.5);
            0.35875 - 0.48829 * a.cos() + 0.14128 * (2.0 * a).cos() - 0.01168 * (3.0 * a).cos()
        };
        let xs = (0..3000).map(|i| (f64::from(i) + 0.5) / 1000.0 - 1.5);
        let (mass, second) = xs.fold((0.0, 0.0), |(m, s), x| (m + window(x), s + window(x) * x * x));
        for (filter, variance) in
            [(Filter::Box, 1.0 / 12.0), (Filter::Tent, 1.0 / 6.0), (Filter::BlackmanHarris, second / mass)]
        {
            let n = 10_000;
            let places: Vec<f64> = (0..n).map(|i| filter.place((f64::from(i) + 0.5) / f64::from(n))).collect();
            assert!(places.windows(2).all(|w| w[0] < w[1]), "{}", filter.name());
            let mean = places.iter().sum::<f64>() / f64::from(n);
            let square = places.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
            assert!(mean.abs() < 1e-9 && (square / variance - 1.0).abs() < 2e-3, "{} {square}", filter.name());
            assert!(filter.place(0.0) >= -1.5 && filter.place(0.999_999_99) < 1.5);
        }
    }
}
