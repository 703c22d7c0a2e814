//! Choice by weights in constant time.

/// All numbers that choose: those of 32 bits.
const ALL: u64 = 1 << 32;

/// Chances of a list of weights, each a whole number of 2^-32: an index is chosen by exactly as many of the numbers of
/// 32 bits as its chance says. A light chosen more or less often than its density claims is too bright or too dark.
/// Source: M. Vose, *A Linear Algorithm for Generating Random Numbers with a Given Distribution*, 1991; here in integers.
#[derive(Clone, Debug, Default)]
pub struct Alias {
    /// Per bin, a run of numbers: the first one that is not its own, and whose those from there on are.
    bins: Vec<(u32, u32)>,
    chances: Vec<f64>,
}

impl Alias {
    /// Chances in proportion to `weights`, none so small that it is never chosen; those that are not positive and finite
    /// count as 0. At most 2^32 weights.
    pub fn new(weights: &[f64]) -> Self {
        let clean: Vec<f64> = weights.iter().map(|&w| if w > 0.0 && w.is_finite() { w } else { 0.0 }).collect();
        let sum: f64 = clean.iter().sum();
        if sum <= 0.0 || !sum.is_finite() {
            return Self::default();
        }
        let shares = shares(&clean, sum);
        let start = |bin: usize| (bin as u64 * ALL).div_ceil(clean.len() as u64);
        let room = |bin: usize| start(bin + 1) - start(bin);
        // What full bins do not own nobody asks for.
        let mut bins: Vec<(u32, u32)> = (0..clean.len() as u32).map(|i| (u32::MAX, i)).collect();
        let mut left = shares.clone();
        let all = 0..clean.len() as u32;
        let mut small: Vec<u32> = all.clone().filter(|&i| left[i as usize] < room(i as usize)).collect();
        let mut large: Vec<u32> = all.filter(|&i| left[i as usize] > room(i as usize)).collect();
        // Shares and bins both add up to all numbers, so both lists end together.
        while let (Some(s), Some(&l)) = (small.pop(), large.last()) {
            let (bin, giver) = (s as usize, l as usize);
            bins[bin] = ((start(bin) + left[bin]) as u32, l);
            left[giver] -= room(bin) - left[bin];
            if left[giver] <= room(giver) {
                large.pop();
                if left[giver] < room(giver) {
                    small.push(l);
                }
            }
        }
        Self { bins, chances: shares.into_iter().map(|share| share as f64 / ALL as f64).collect() }
    }

    /// The index chosen by `number`; `None` if nothing has weight.
    #[inline]
    pub fn choose(&self, number: u32) -> Option<usize> {
        let bin = ((u64::from(number) * self.bins.len() as u64) >> 32) as usize;
        let &(end, other) = self.bins.get(bin)?;
        // Looked up, as nobody can foresee it.
        Some([bin, other as usize][usize::from(number >= end)])
    }

    /// Chance of index `i`.
    pub fn chance(&self, i: usize) -> f64 {
        self.chances.get(i).copied().unwrap_or(0.0)
    }
}

/// How many of all numbers each of `weights` gets, whose sum is `sum`: one for being there, of the rest its part.
fn shares(weights: &[f64], sum: f64) -> Vec<u64> {
    let there = weights.iter().filter(|&&w| w > 0.0).count() as u64;
    let rest = (ALL - there.min(ALL)) as f64;
    let (mut up_to, mut given) = (0.0, 0);
    let of = |&weight: &f64| {
        // Added up in the order of `sum`, so that the last one gets all that is left.
        up_to += weight;
        let before = std::mem::replace(&mut given, (rest * (up_to / sum)).round() as u64);
        given - before + u64::from(weight > 0.0)
    };
    weights.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of all numbers choose each index, found by asking alone.
    fn counted(alias: &Alias, count: usize) -> Vec<u64> {
        let mut numbers = vec![0; count];
        for bin in 0..count as u64 {
            // The numbers k with floor(k * count / 2^32) = bin, found without the table.
            let first = (bin << 32).div_ceil(count as u64);
            let last = ((bin + 1) << 32).div_ceil(count as u64) - 1;
            let chosen = |number: u64| alias.choose(number as u32).unwrap();
            let own = chosen(first);
            // First number of the bin that chooses another index, by bisection: a bin holds at most two.
            let (mut low, mut high) = (first, last + 1);
            while low < high {
                let middle = low.midpoint(high);
                if chosen(middle) == own { low = middle + 1 } else { high = middle }
            }
            numbers[own] += low - first;
            if low <= last {
                numbers[chosen(last)] += last + 1 - low;
            }
        }
        numbers
    }

    /// That as many numbers choose each index as its chance says, to the last one, and that chances go by weights.
    fn check(weights: &[f64]) {
        let alias = Alias::new(weights);
        let numbers = counted(&alias, weights.len());
        assert_eq!(numbers.iter().sum::<u64>(), 1 << 32);
        let sum: f64 = weights.iter().sum();
        for (i, &number) in numbers.iter().enumerate() {
            let chance = alias.chance(i);
            assert!(number as f64 == chance * 4_294_967_296.0, "{i}: {number} numbers, chance {chance}");
            assert_eq!(weights[i] > 0.0, number > 0);
            // One number for each weight that is there comes off the top, one is rounding.
            let (want, one) = (weights[i] / sum, 2f64.powi(-32));
            let off = want * one * weights.len() as f64 + 2.0 * one;
            assert!((chance - want).abs() <= off, "{i}: {chance}, weight {want}");
        }
    }

    #[test]
    fn lights_are_chosen_as_often_as_their_chance_says() {
        check(&[1.0]);
        check(&[3.0, 0.0, 1.0, 4.0]);
        // One far heavier than all others together, whose parts of their bins are a few numbers.
        let mut heavy = vec![1.0; 1 << 16];
        heavy[12_345] = 1e7;
        check(&heavy);
        heavy[12_345] = 1e12;
        check(&heavy);
        // Bins of different length.
        check(&[5.0, 1e-3, 7.0]);
        let uneven: Vec<f64> = (0..3007).map(|i| f64::from(i % 17) * f64::from(i * i % 101)).collect();
        check(&uneven);
    }

    #[test]
    fn chances_are_proportional_to_weights() {
        let alias = Alias::new(&[3.0, 0.0, 1.0, f64::NAN, 4.0, -2.0]);
        for (i, want) in [0.375, 0.0, 0.125, 0.0, 0.5, 0.0, 0.0].into_iter().enumerate() {
            assert!((alias.chance(i) - want).abs() < 1e-9 && (want > 0.0 || alias.chance(i) == 0.0), "{i}");
        }
        assert_eq!(Alias::new(&[1.0, 1.0]).chance(1), 0.5);
        assert_eq!(Alias::new(&[7.0]).chance(0), 1.0);
        assert_eq!(Alias::new(&[0.0]).choose(5), None);
        assert_eq!(Alias::new(&[]).choose(u32::MAX), None);
    }
}
