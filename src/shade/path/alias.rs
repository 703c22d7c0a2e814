//! Choice by weights in constant time.

/// Chances of a list of weights.
/// Source: M. Vose, *A Linear Algorithm for Generating Random Numbers with a Given Distribution*, 1991.
#[derive(Clone, Debug, Default)]
pub struct Alias {
    /// Per bin: the share of the bin that is its own, and whose the rest is.
    bins: Vec<(f64, u32)>,
    chances: Vec<f64>,
}

impl Alias {
    /// Chances in proportion to `weights`; those that are not positive and finite count as 0.
    pub fn new(weights: &[f64]) -> Self {
        let clean: Vec<f64> = weights.iter().map(|&w| if w > 0.0 && w.is_finite() { w } else { 0.0 }).collect();
        let sum: f64 = clean.iter().sum();
        if sum <= 0.0 || !sum.is_finite() {
            return Self::default();
        }
        let count = clean.len() as f64;
        let chances: Vec<f64> = clean.iter().map(|w| w / sum).collect();
        let mut left: Vec<f64> = chances.iter().map(|c| c * count).collect();
        let mut bins: Vec<(f64, u32)> = (0..clean.len() as u32).map(|i| (1.0, i)).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..clean.len() as u32).partition(|&i| left[i as usize] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s as usize] = (left[s as usize], l);
            left[l as usize] -= 1.0 - left[s as usize];
            if left[l as usize] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // What rounding leaves over is full; but what has no weight is never chosen.
        for i in small {
            if chances[i as usize] == 0.0 {
                let heaviest = (0..chances.len()).fold(0, |best, k| if chances[k] > chances[best] { k } else { best });
                bins[i as usize] = (0.0, heaviest as u32);
            }
        }
        Self { bins, chances }
    }

    /// The index chosen by `u` in [0, 1); `None` if nothing has weight.
    #[inline]
    pub fn choose(&self, u: f64) -> Option<usize> {
        let last = self.bins.len().checked_sub(1)?;
        let place = u * self.bins.len() as f64;
        let bin = (place as usize).min(last);
        let (own, other) = self.bins[bin];
        // Looked up, as nobody can foresee it.
        Some([bin, other as usize][usize::from(place - bin as f64 >= own)])
    }

    /// Chance of index `i`.
    pub fn chance(&self, i: usize) -> f64 {
        self.chances.get(i).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_are_proportional_to_weights() {
        let weights = [3.0, 0.0, 1.0, f64::NAN, 4.0, -2.0];
        let alias = Alias::new(&weights);
        let mut counts = [0; 6];
        let n = 80_000;
        for i in 0..n {
            counts[alias.choose((f64::from(i) + 0.5) / f64::from(n)).unwrap()] += 1;
        }
        // One falls on the other side of a bin's boundary by rounding.
        for (count, expected) in counts.into_iter().zip([30_000i32, 0, 10_000, 0, 40_000, 0]) {
            assert!(i32::abs(count - expected) <= if expected > 0 { 2 } else { 0 }, "{counts:?}");
        }
        assert_eq!([alias.chance(0), alias.chance(1), alias.chance(4), alias.chance(9)], [0.375, 0.0, 0.5, 0.0]);
        assert_eq!(Alias::new(&[0.0]).choose(0.5), None);
        assert_eq!(Alias::new(&[]).choose(0.5), None);
    }
}
