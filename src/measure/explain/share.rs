//! Where time goes: the batches' times as a sum of costs per ray, per node visit and per primitive test.
//!
//! Batches differ in what they hold (sky, walls, foliage), so least squares over them tells the costs apart without touching
//! the kernels. Costs cannot be negative (C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems", 1974; with three
//! costs all subsets are tried). The fit says how much of the times' variance it explains; where counts go hand in hand, it
//! cannot tell them apart, and then it should not be believed.

use crate::ray::Counters;

/// Fewest batches that are fitted.
const MIN_BATCHES: usize = 12;

/// Costs in nanoseconds and shares of the time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Shares {
    /// Set-up, commit and whatever else is done once per ray, nanoseconds.
    pub ns_per_ray: f64,
    /// A node visit with its box tests.
    pub ns_per_node: f64,
    /// A primitive test, with what its leaf costs.
    pub ns_per_prim: f64,
    /// Share of the time per ray.
    pub rays: f64,
    /// Share of node visits.
    pub nodes: f64,
    /// Share of primitive tests.
    pub prims: f64,
    /// Share of the variance of the batches' times that the fit explains, at most 1.
    pub explained: f64,
}

/// Fits `seconds` of batches to their counts.
pub fn fit(seconds: &[f64], counts: &[Counters]) -> Option<Shares> {
    let live: Vec<(f64, [f64; 3])> = seconds
        .iter()
        .zip(counts)
        .filter(|(_, c)| c.rays > 0)
        .map(|(s, c)| (1e9 * s, [c.rays as f64, c.nodes as f64, c.prims as f64]))
        .collect();
    if live.len() < MIN_BATCHES {
        return None;
    }
    let error = |costs: &[f64; 3]| -> f64 {
        live.iter().map(|(t, x)| (t - x.iter().zip(costs).map(|(x, c)| x * c).sum::<f64>()).powi(2)).sum()
    };
    let subsets = (1u32..8).filter_map(|subset| least_squares(&live, subset));
    let costs = subsets.filter(|c| c.iter().all(|&c| c >= 0.0)).min_by(|a, b| error(a).total_cmp(&error(b)))?;
    let mean = live.iter().map(|(t, _)| t).sum::<f64>() / live.len() as f64;
    let variance: f64 = live.iter().map(|(t, _)| (t - mean).powi(2)).sum();
    let parts: [f64; 3] = std::array::from_fn(|i| live.iter().map(|(_, x)| x[i] * costs[i]).sum());
    let whole: f64 = parts.iter().sum();
    if whole <= 0.0 || variance <= 0.0 {
        return None;
    }
    let [ns_per_ray, ns_per_node, ns_per_prim] = costs;
    let [rays, nodes, prims] = parts.map(|part| part / whole);
    Some(Shares { ns_per_ray, ns_per_node, ns_per_prim, rays, nodes, prims, explained: 1.0 - error(&costs) / variance })
}

/// The costs in `subset` (a bit each) that fit best; the others are 0. `None` if they cannot be told apart.
fn least_squares(live: &[(f64, [f64; 3])], subset: u32) -> Option<[f64; 3]> {
    let chosen: Vec<usize> = (0..3).filter(|i| subset >> i & 1 == 1).collect();
    let n = chosen.len();
    // Normal equations with the right side as last column, solved by elimination with pivots.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for &i in &chosen {
        let mut row: Vec<f64> = chosen.iter().map(|&j| live.iter().map(|(_, x)| x[i] * x[j]).sum()).collect();
        row.push(live.iter().map(|(t, x)| t * x[i]).sum());
        rows.push(row);
    }
    let scale = rows.iter().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs()))?;
        rows.swap(k, pivot);
        if rows[k][k].abs() <= 1e-12 * scale {
            return None;
        }
        for i in (0..n).filter(|&i| i != k) {
            let factor = rows[i][k] / rows[k][k];
            for j in k..=n {
                rows[i][j] -= factor * rows[k][j];
            }
        }
    }
    let mut costs = [0.0; 3];
    chosen.iter().enumerate().for_each(|(k, &i)| costs[i] = rows[k][n] / rows[k][k]);
    Some(costs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn batches(costs: [f64; 3]) -> (Vec<f64>, Vec<Counters>) {
        let counts: Vec<Counters> = (0..40u64)
            .map(|i| Counters {
                rays: 1024,
                nodes: 100 + i * 37 % 900,
                prims: 50 + i * i * 13 % 700,
                ..Default::default()
            })
            .collect();
        let time =
            |c: &Counters| 1e-9 * (costs[0] * c.rays as f64 + costs[1] * c.nodes as f64 + costs[2] * c.prims as f64);
        (counts.iter().map(time).collect(), counts)
    }

    #[test]
    fn known_costs_are_found() {
        let (seconds, counts) = batches([2.0, 15.0, 7.0]);
        let s = fit(&seconds, &counts).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * b;
        assert!(near(s.ns_per_ray, 2.0) && near(s.ns_per_node, 15.0) && near(s.ns_per_prim, 7.0), "{s:?}");
        assert!((s.rays + s.nodes + s.prims - 1.0).abs() < 1e-12 && s.explained > 0.999_999);
    }

    /// Times that fall with the primitives: their cost is not negative but 0.
    #[test]
    fn costs_are_not_negative_and_few_batches_say_nothing() {
        let (seconds, counts) = batches([30.0, 10.0, -4.0]);
        let s = fit(&seconds, &counts).unwrap();
        assert!(s.ns_per_prim == 0.0 && s.ns_per_node > 0.0 && s.explained < 1.0, "{s:?}");
        assert!(fit(&seconds[..5], &counts[..5]).is_none());
        assert!(fit(&[0.0; 40], &counts).is_none());
    }
}
