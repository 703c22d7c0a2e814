//! Statistics of repeated timings. Every function that makes a published number has a hand-worked test.
//!
//! Timings are skewed to the right (a pass can be disturbed, never hurried), so the median and the median absolute
//! deviation describe them, not the mean and the standard deviation.

/// Middle of `samples`: the mean of the two middle ones for an even count. `None` if there is none.
///
/// Samples are ordered by [`f64::total_cmp`], so a NaN sorts last instead of breaking the order.
pub fn median(samples: &[f64]) -> Option<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[half]),
        _ => Some(sorted[half - 1] + 0.5 * (sorted[half] - sorted[half - 1])),
    }
}

/// Median absolute deviation from the median, in the samples' unit, not scaled to a standard deviation.
pub fn mad(samples: &[f64]) -> Option<f64> {
    let centre = median(samples)?;
    let deviations: Vec<f64> = samples.iter().map(|x| (x - centre).abs()).collect();
    median(&deviations)
}

/// Arithmetic mean, or `None` if there is no sample.
pub fn mean(samples: &[f64]) -> Option<f64> {
    (!samples.is_empty()).then(|| samples.iter().sum::<f64>() / samples.len() as f64)
}

/// Geometric mean, the right average of ratios. `None` if there is no sample or one is not positive.
pub fn geometric_mean(samples: &[f64]) -> Option<f64> {
    if samples.iter().any(|&x| x.is_nan() || x <= 0.0) {
        return None;
    }
    let logarithms: Vec<f64> = samples.iter().map(|x| x.ln()).collect();
    mean(&logarithms).map(f64::exp)
}

/// Median over the pairs of `numerator[i] / denominator[i]`.
///
/// In an interleaved run, the i-th passes of two engines share the machine's mood, so the ratio of each pair is
/// steadier than the ratio of the medians. Extra samples of the longer list are ignored; `None` if there is no pair.
pub fn paired_ratio_median(numerator: &[f64], denominator: &[f64]) -> Option<f64> {
    let ratios: Vec<f64> = numerator.iter().zip(denominator).map(|(a, b)| a / b).collect();
    median(&ratios)
}

/// What a table says about one list of timings.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Smallest sample: for seconds, the best pass.
    pub min: f64,
    /// Largest sample.
    pub max: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// See [`median`].
    pub median: f64,
    /// See [`mad`].
    pub mad: f64,
    /// Relative spread: `(max - min) / median`, without unit. A disturbed run shows here.
    pub spread: f64,
}

/// All of [`Summary`] for `samples`, or `None` if there is none.
pub fn summary(samples: &[f64]) -> Option<Summary> {
    let (median, mad, mean) = (median(samples)?, mad(samples)?, mean(samples)?);
    let min = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let max = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(Summary { min, max, mean, median, mad, spread: (max - min) / median })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_of_odd_even_and_unsorted() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[7.0]), Some(7.0));
        assert_eq!(median(&[9.0, 1.0, 5.0]), Some(5.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
    }

    /// 1 1 2 2 4 6 9 has median 2 and deviations 1 1 0 0 2 4 7, sorted 0 0 1 1 2 4 7: MAD 1. Forgetting to sort the
    /// deviations would give 0.
    #[test]
    fn mad_sorts_its_deviations() {
        assert_eq!(mad(&[1.0, 1.0, 2.0, 2.0, 4.0, 6.0, 9.0]), Some(1.0));
        assert_eq!(mad(&[5.0]), Some(0.0));
        assert_eq!(mad(&[]), None);
    }

    #[test]
    fn means() {
        assert_eq!(mean(&[1.0, 2.0, 6.0]), Some(3.0));
        assert_eq!(mean(&[]), None);
        // 2 * 4 * 8 = 64, and its cube root is 4.
        assert!((geometric_mean(&[2.0, 4.0, 8.0]).unwrap() - 4.0).abs() < 1e-12);
        assert_eq!(geometric_mean(&[1.0, 0.0]), None);
        assert_eq!(geometric_mean(&[1.0, f64::NAN]), None);
        assert_eq!(geometric_mean(&[]), None);
    }

    /// Pairs 2/1, 9/3, 8/2 are 2, 3, 4: median 3. The ratio of the medians would be 8/2 = 4.
    #[test]
    fn ratios_are_taken_pair_by_pair() {
        assert_eq!(paired_ratio_median(&[2.0, 9.0, 8.0], &[1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(paired_ratio_median(&[2.0, 9.0], &[1.0]), Some(2.0));
        assert_eq!(paired_ratio_median(&[], &[1.0]), None);
    }

    #[test]
    fn summary_of_a_worked_list() {
        let s = summary(&[0.5, 0.25, 1.0, 0.5, 0.75]).unwrap();
        assert_eq!((s.min, s.max, s.median, s.mean), (0.25, 1.0, 0.5, 0.6));
        // Deviations 0 0.25 0.5 0 0.25: median 0.25. Spread (1 - 0.25) / 0.5.
        assert_eq!((s.mad, s.spread), (0.25, 1.5));
        assert_eq!(summary(&[]), None);
    }
}
