//! How a number is spread over packets or rays.

/// Quantiles and a histogram of some values.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Arithmetic mean.
    pub mean: f64,
    /// A tenth of the values is at most this.
    pub p10: f64,
    /// Half of them.
    pub median: f64,
    /// Nine tenths.
    pub p90: f64,
    /// All but one in a hundred.
    pub p99: f64,
    /// The largest.
    pub max: f64,
    /// Values in [`Spread::BINS`] even steps from 0 to the largest.
    pub histogram: Vec<u64>,
}

impl Spread {
    /// Steps of the histogram.
    pub const BINS: usize = 32;

    /// The spread of `values`; all zero if there is none.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let Some(&max) = values.last() else { return Self::default() };
        let last = values.len() - 1;
        let quantile = |share: f64| values[(share * last as f64).round() as usize];
        let mut histogram = vec![0; Self::BINS];
        for value in &values {
            let bin = if max > 0.0 { (value / max * Self::BINS as f64) as usize } else { 0 };
            histogram[bin.min(Self::BINS - 1)] += 1;
        }
        Self {
            mean: values.iter().sum::<f64>() / values.len() as f64,
            p10: quantile(0.1),
            median: quantile(0.5),
            p90: quantile(0.9),
            p99: quantile(0.99),
            max,
            histogram,
        }
    }

    /// The histogram as a line of blocks, one per step.
    pub fn bars(&self) -> String {
        const BLOCKS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
        let most = self.histogram.iter().copied().max().unwrap_or(0).max(1) as f64;
        // Square roots keep the rare, dear packets visible.
        self.histogram.iter().map(|&n| BLOCKS[(8.0 * (n as f64 / most).sqrt()).ceil() as usize]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_bins_by_hand() {
        let spread = Spread::of((0..=100).rev().map(f64::from).collect());
        let Spread { mean, p10, median, p90, p99, max, .. } = spread;
        assert_eq!((mean, p10, median, p90, p99, max), (50.0, 10.0, 50.0, 90.0, 99.0, 100.0));
        assert_eq!(spread.histogram.iter().sum::<u64>(), 101);
        // 100 / 32 = 3.125: the values 0 to 3 are in the first step, 97 to 100 in the last.
        assert_eq!((spread.histogram[0], spread.histogram[31]), (4, 4));
        assert_eq!(spread.bars().chars().count(), 32);
        assert_eq!(Spread::of(Vec::new()), Spread::default());
        assert_eq!(Spread::of(vec![0.0; 3]).histogram[0], 3);
    }
}
