//! Whether a peer, or an engine with an arithmetic of its own, found what `scalar` found, up to rounding.
//!
//! Two correct tracers with different arithmetic agree on t within a small relative error and on the primitive,
//! except where surfaces share an edge or coincide. Where a triangle is seen edge-on, or a tracer is not watertight,
//! they may differ entirely; such rays are counted and there may only be a handful.

use crate::lanes::Real;
use crate::measure::answers::Answers;
use crate::ray::{Hits, Rays};

/// Largest relative difference of t between two answers that are the same.
pub const TOLERANCE: f64 = 1e-4;

/// How far a peer's hit may lie from ours whatever its distance, in half ulps of the ray's largest starting coordinate: the way into
/// an instance rounds the start by that, and near hits differ by more than [`TOLERANCE`] then.
pub const START_ROUNDINGS: f64 = 8.0;

/// Largest share of rays that may differ in a peer's row that gets a figure; the row says how many do. Peers that are
/// not watertight and take a ray's own surface at t = 0 for a hit differ in 2 to 3 rays of 10^5 on voxels and on hair.
pub const MAX_DIFFERING: f64 = 1e-4;

/// Largest share of rays that may differ in a row that gets a figure although more than [`MAX_DIFFERING`] do, because the oracle
/// explains our answer to each of them and the peer's to all but [`MAX_DIFFERING`]: in instances starts are rounded on the way in, and
/// near hits at a flat angle move far.
pub const MAX_EXPLAINED: f64 = 4e-3;

/// How a peer's answers compare with ours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Rays compared.
    pub rays: u64,
    /// Same t, another primitive: shared edges, coincident surfaces.
    pub ties: u64,
    /// The first difference in words.
    pub first: Option<String>,
    /// Numbers of all rays counted above, ascending.
    pub unlike: Vec<u64>,
    /// Of these, those with another t, or a hit against a miss.
    pub differing: Vec<u64>,
}

impl Agreement {
    /// Rays with another t, or a hit against a miss.
    pub fn differences(&self) -> u64 {
        self.differing.len() as u64
    }

    /// Whether a figure may be quoted.
    pub fn passes(&self) -> bool {
        self.differences() as f64 <= MAX_DIFFERING * self.rays as f64
    }

    /// Whether a figure may be quoted. `rejected`: of the answers to rays that differ, how many of the peer's the oracle does not
    /// explain, or `None` if it is one of ours.
    pub fn passes_if(&self, rejected: impl FnOnce() -> Option<u64>) -> bool {
        let few = |count: u64, share: f64| count as f64 <= share * self.rays as f64;
        self.passes()
            || few(self.differences(), MAX_EXPLAINED) && rejected().is_some_and(|count| few(count, MAX_DIFFERING))
    }
}

/// Compares a peer's answers with ours, ray by ray; answers to different queries differ in every ray.
pub fn compare<S: Real>(ours: &Answers<S>, theirs: &Answers<S>) -> Agreement {
    compare_within(ours, theirs, |_, _| 0.0)
}

/// The same of answers to `batches` of rays, where `t` may also differ by the rounding of a start ([`START_ROUNDINGS`]).
pub fn compare_traced<S: Real>(batches: &[Rays<S>], ours: &Answers<S>, theirs: &Answers<S>) -> Agreement {
    let largest = |v: [S; 3]| v.iter().fold(0.0, |m: f64, x| m.max(x.to_f64().abs()));
    let half_ulp = 0.5 * S::EPSILON.to_f64();
    compare_within(ours, theirs, |batch, i| {
        let rays = &batches[batch];
        START_ROUNDINGS * half_ulp * largest(rays.org(i)) / largest(rays.dir(i))
    })
}

/// The same where `t` of a ray, given by its batch and its number there, may differ by `slack`.
fn compare_within<S: Real>(ours: &Answers<S>, theirs: &Answers<S>, slack: impl Fn(usize, usize) -> f64) -> Agreement {
    let mut result = Agreement::default();
    match (ours, theirs) {
        (Answers::Closest(a), Answers::Closest(b)) => {
            for (batch, (a, b)) in a.iter().zip(b).enumerate() {
                (0..a.len().min(b.len())).for_each(|i| result.closest(a, b, i, || slack(batch, i)));
            }
        }
        (Answers::Any(a), Answers::Any(b)) => {
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                result.count(a == b, || format!("occluded: {a} against {b}"));
            }
        }
        _ => {}
    }
    let rays = ours.ray_count();
    let missing = rays.max(theirs.ray_count()) - result.rays;
    result.unlike.extend(result.rays..result.rays + missing);
    result.differing.extend(result.rays..result.rays + missing);
    Agreement { rays: result.rays + missing, ..result }
}

impl Agreement {
    fn closest<S: Real>(&mut self, a: &Hits<S>, b: &Hits<S>, i: usize, slack: impl FnOnce() -> f64) {
        let (hit, t) = ([a.is_hit(i), b.is_hit(i)], [a.t[i].to_f64(), b.t[i].to_f64()]);
        let apart = (t[0] - t[1]).abs();
        let near = apart <= TOLERANCE * t[0].abs().max(t[1].abs()) || hit == [true; 2] && apart <= slack();
        // What is no number is near nothing, but it is what it is.
        let equal = t[0].to_bits() == t[1].to_bits() && (a.prim[i], a.inst[i]) == (b.prim[i], b.inst[i]);
        let same = equal || hit == [false; 2] || hit == [true; 2] && near;
        if same && (a.prim[i], a.inst[i]) != (b.prim[i], b.inst[i]) {
            self.ties += 1;
            self.unlike.push(self.rays);
        }
        self.count(same, || {
            let one = |h: &Hits<S>| match h.is_hit(i) {
                true => format!("t {} prim {} inst {}", h.t[i].to_f64(), h.prim[i], h.inst[i]),
                false => "a miss".into(),
            };
            format!("{} against {}", one(a), one(b))
        });
    }

    fn count(&mut self, same: bool, text: impl FnOnce() -> String) {
        if !same {
            self.unlike.push(self.rays);
            self.differing.push(self.rays);
            let number = self.rays;
            self.first.get_or_insert_with(|| format!("ray {number}: {}", text()));
        }
        self.rays += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hits(list: &[(f32, u32)]) -> Answers<f32> {
        let mut hits = Hits::new(list.len());
        for (i, &(t, prim)) in list.iter().enumerate() {
            if t.is_finite() {
                (hits.t[i], hits.prim[i], hits.inst[i]) = (t, prim, 0);
            }
        }
        Answers::Closest(vec![hits])
    }

    const MISS: (f32, u32) = (f32::INFINITY, 0);

    #[test]
    fn ties_and_differences_are_told_apart() {
        let ours = hits(&[(1.0, 1), (1.0, 1), (1.0, 1), MISS, MISS, (1000.0, 1)]);
        let theirs = hits(&[(1.00005, 1), (1.0, 2), (1.001, 1), MISS, (1.0, 1), (1000.05, 1)]);
        let agreement = compare(&ours, &theirs);
        assert_eq!((agreement.rays, agreement.ties, agreement.differences()), (6, 1, 2));
        assert!(agreement.first.as_ref().is_some_and(|text| text.contains("ray 2: t 1 prim 1")), "{agreement:?}");
        assert!(!agreement.passes());
        assert_eq!((agreement.unlike, agreement.differing), (vec![1, 2, 4], vec![2, 4]));
    }

    #[test]
    fn equal_bits_are_the_same_even_of_no_number() {
        let mut bad = Hits::new(2);
        for (i, t) in [f32::NAN, 1.0].into_iter().enumerate() {
            (bad.t[i], bad.prim[i], bad.inst[i]) = (t, 3, 0);
        }
        let bad = Answers::Closest(vec![bad]);
        assert_eq!(compare(&bad, &bad).differences(), 0);
        assert_eq!(compare(&bad, &hits(&[(1.0, 3), (1.0, 3)])).differing, [0]);
    }

    #[test]
    fn near_hits_may_differ_by_the_rounding_of_their_start() {
        let (ours, theirs) =
            (hits(&[(0.03, 1), (0.03, 1), (0.03, 1)]), hits(&[(0.03001, 1), (0.0304, 1), (0.03001, 1)]));
        let mut rays = Rays::<f32>::new(3);
        rays.set(0, [100.0, 0.0, 1.0], [0.0, 0.0, 1.0], 0.0, 1.0);
        rays.set(1, [100.0, 0.0, 1.0], [0.0, 0.0, 1.0], 0.0, 1.0);
        rays.set(2, [100.0, 0.0, 1.0], [0.0, 0.0, -9.0], 0.0, 1.0);
        assert_eq!(compare(&ours, &theirs).unlike, [0, 1, 2]);
        assert_eq!(compare_traced(&[rays], &ours, &theirs).unlike, [1, 2]);
    }

    #[test]
    fn one_ray_in_ten_thousand_may_differ() {
        let at = |differing| Agreement { rays: 20_000, differing: (0..differing).collect(), ..Default::default() };
        assert!(at(0).passes() && at(2).passes() && !at(3).passes());
    }

    #[test]
    fn four_in_a_thousand_may_differ_if_the_oracle_explains_it() {
        let at = |differing| Agreement { rays: 20_000, differing: (0..differing).collect(), ..Default::default() };
        assert!(at(3).passes_if(|| Some(0)) && at(80).passes_if(|| Some(0)));
        assert!(!at(3).passes_if(|| None) && !at(81).passes_if(|| Some(0)));
        // No more that it does not explain than may differ anyway.
        assert!(at(20).passes_if(|| Some(2)) && !at(20).passes_if(|| Some(3)));
        assert!(at(2).passes_if(|| unreachable!("nobody asks the oracle for what passes anyway")));
    }

    #[test]
    fn flags_and_missing_answers_count() {
        let any = |flags: &[u8]| Answers::<f32>::Any(vec![flags.to_vec()]);
        assert_eq!(compare(&any(&[0, 1, 1]), &any(&[0, 1, 0])).differences(), 1);
        assert_eq!(compare(&any(&[0, 1, 1]), &any(&[0])).differences(), 2);
        assert_eq!(compare(&any(&[0, 1, 1]), &hits(&[MISS])).differences(), 3);
    }
}
