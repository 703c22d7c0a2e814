//! How sure a figure is: bootstrap intervals of medians and of ratios.
//!
//! Source: B. Efron, "Bootstrap Methods: Another Look at the Jackknife", 1979: the statistic of many samples drawn with
//! replacement from the one that was measured; the interval is from the percentiles of these. Draws are a hash of their
//! number, so the same samples always give the same interval.

use crate::camera::sampling::pcg4d;
use crate::measure::stats::median;

/// Samples drawn per interval.
const DRAWS: u32 = 1000;

/// Share of the draws inside an interval that is shown.
pub const LEVEL: f64 = 0.95;

/// A range that holds the true value with the probability it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A value and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its interval at [`LEVEL`].
    #[serde(flatten)]
    pub interval: Interval,
}

/// What an interval of a speed factor says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Verdict {
    /// The whole interval is beyond 1 and the margin.
    #[serde(rename = "faster")]
    Faster,
    /// The whole interval is below 1 and the margin.
    #[serde(rename = "slower")]
    Slower,
    /// Neither.
    #[serde(rename = "no difference seen")]
    NoDifference,
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Faster => "faster",
            Self::Slower => "slower",
            Self::NoDifference => "no difference seen",
        }
    }
}

impl Interval {
    /// What the interval of a speed factor (new over old) says, if differences up to `margin` (0.01 is one per cent) do
    /// not count.
    pub fn verdict(self, margin: f64) -> Verdict {
        match self {
            Self { low, .. } if low > 1.0 + margin => Verdict::Faster,
            Self { high, .. } if high < 1.0 / (1.0 + margin) => Verdict::Slower,
            _ => Verdict::NoDifference,
        }
    }
}

/// The median of `samples` with its interval; `None` if there is none.
pub fn median_estimate(samples: &[f64]) -> Option<Estimate> {
    let value = median(samples)?;
    let interval = bootstrap(LEVEL, |draw| median(&resampled(samples, draw, 0)))?;
    Some(Estimate { value, interval })
}

/// The median over pairs of `numerator[i] / denominator[i]`, drawing pairs; see
/// [`crate::measure::stats::paired_ratio_median`].
pub fn paired_ratio(numerator: &[f64], denominator: &[f64]) -> Option<Estimate> {
    let ratios: Vec<f64> = numerator.iter().zip(denominator).map(|(a, b)| a / b).collect();
    median_estimate(&ratios)
}

/// The ratio of two medians whose samples have nothing to do with each other, drawing from both.
pub fn ratio_of_medians(numerator: &[f64], denominator: &[f64]) -> Option<Estimate> {
    let ratio = |a: &[f64], b: &[f64]| Some(median(a)? / median(b)?);
    let value = ratio(numerator, denominator)?;
    let drawn = |draw| ratio(&resampled(numerator, draw, 0), &resampled(denominator, draw, 1));
    Some(Estimate { value, interval: bootstrap(LEVEL, drawn)? })
}

/// The median over turns of the ratio of medians within a turn. Each turn holds samples of both sides, taken right after
/// each other; turns are drawn, and samples within them (A. C. Davison, D. V. Hinkley, "Bootstrap Methods and their
/// Application", 1997, on grouped samples).
pub fn ratio_over_turns(turns: &[(Vec<f64>, Vec<f64>)]) -> Option<Estimate> {
    let ratio = |a: &[f64], b: &[f64]| Some(median(a)? / median(b)?);
    let whole: Vec<f64> = turns.iter().filter_map(|(a, b)| ratio(a, b)).collect();
    let value = median(&whole)?;
    let drawn = |draw: u32| {
        let of_turn = |k: u32| {
            let (a, b) = &turns[pick(draw, k, 2, turns.len())];
            ratio(&resampled(a, draw, 4 + 2 * k), &resampled(b, draw, 5 + 2 * k))
        };
        median(&(0..turns.len() as u32).filter_map(of_turn).collect::<Vec<f64>>())
    };
    Some(Estimate { value, interval: bootstrap(LEVEL, drawn)? })
}

/// The middle `level` of the statistic over all draws; `statistic(draw)` draws for itself.
fn bootstrap(level: f64, statistic: impl Fn(u32) -> Option<f64>) -> Option<Interval> {
    let mut drawn: Vec<f64> = (0..DRAWS).map(statistic).collect::<Option<_>>()?;
    drawn.sort_by(f64::total_cmp);
    let tail = 0.5 * (1.0 - level);
    let place = |share: f64| drawn[(share * (drawn.len() - 1) as f64).round() as usize];
    Some(Interval { low: place(tail), high: place(1.0 - tail) })
}

/// As many of `samples` as there are, drawn with replacement.
fn resampled(samples: &[f64], draw: u32, stream: u32) -> Vec<f64> {
    (0..samples.len() as u32).map(|i| samples[pick(draw, i, stream, samples.len())]).collect()
}

/// A number below `count` (which is not 0) for the `i`-th pick of a draw.
fn pick(draw: u32, i: u32, stream: u32, count: usize) -> usize {
    let [bits, ..] = pcg4d([draw, i, stream, 0x1a9e]);
    ((u64::from(bits) * count as u64) >> 32) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(samples: &[f64], level: f64) -> (f64, f64) {
        let Interval { low, high } = bootstrap(level, |draw| median(&resampled(samples, draw, 0))).unwrap();
        (low, high)
    }

    /// Two samples 1 and 3: a draw's median is 1, 2 or 3 with probability 1/4, 1/2, 1/4. So the middle 40 % are 2, the middle
    /// 60 % reach from 1 to 3.
    #[test]
    fn two_samples_by_hand() {
        assert_eq!(interval(&[1.0, 3.0], 0.4), (2.0, 2.0));
        assert_eq!(interval(&[3.0, 1.0], 0.6), (1.0, 3.0));
    }

    /// Three samples 1, 2, 4: the median of a draw is 1 if at least two of three picks are, 7/27 = 26 %; the same for 4. The
    /// middle 40 % are 2, the middle 60 % reach from 1 to 4.
    #[test]
    fn three_samples_by_hand() {
        assert_eq!(interval(&[4.0, 1.0, 2.0], 0.4), (2.0, 2.0));
        assert_eq!(interval(&[4.0, 1.0, 2.0], 0.6), (1.0, 4.0));
    }

    #[test]
    fn estimates_by_hand() {
        let same = median_estimate(&[2.0; 7]).unwrap();
        assert_eq!((same.value, same.interval), (2.0, Interval { low: 2.0, high: 2.0 }));
        assert_eq!(median_estimate(&[]), None);
        // Every pair is 2, however the machine's mood changes.
        let (a, b) = ([2.0, 4.0, 20.0, 6.0], [1.0, 2.0, 10.0, 3.0]);
        assert_eq!(paired_ratio(&a, &b).unwrap().interval, Interval { low: 2.0, high: 2.0 });
        let loose = ratio_of_medians(&a, &b).unwrap();
        assert_eq!(loose.value, 2.0);
        assert!(loose.interval.low < 1.0 && loose.interval.high > 4.0, "{loose:?}");
        let turns: Vec<_> = a.iter().zip(b).map(|(&a, b)| (vec![a; 3], vec![b; 3])).collect();
        assert_eq!(ratio_over_turns(&turns).unwrap().interval, Interval { low: 2.0, high: 2.0 });
    }

    #[test]
    fn verdicts_need_the_whole_interval() {
        let verdict = |low, high| Interval { low, high }.verdict(0.02);
        assert_eq!(verdict(1.03, 1.2), Verdict::Faster);
        assert_eq!(verdict(1.01, 1.2), Verdict::NoDifference);
        assert_eq!(verdict(0.9, 0.97), Verdict::Slower);
        assert_eq!(verdict(0.9, 0.99), Verdict::NoDifference);
        assert_eq!(verdict(f64::NAN, f64::NAN), Verdict::NoDifference);
    }

    /// Coverage on sets of 15 samples of a known distribution (uniform, median 0.5). Percentile intervals of few samples are
    /// known to be a little too narrow.
    #[test]
    fn intervals_hold_the_truth_about_as_often_as_they_say() {
        let sample = |set: u32, i: u32| f64::from(pcg4d([set, i, 77, 1])[0]) / 4_294_967_296.0;
        let holds = |set: &u32| {
            let samples: Vec<f64> = (0..15).map(|i| sample(*set, i)).collect();
            let Interval { low, high } = median_estimate(&samples).unwrap().interval;
            (low..=high).contains(&0.5)
        };
        let share = (0..400).filter(holds).count() as f64 / 400.0;
        assert!((0.88..0.99).contains(&share), "{share}");
    }
}
