//! Answers judged by the f64 oracle: where this floor touches `reference`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::lanes::Real;
use crate::measure::agreement::{Agreement, compare};
use crate::measure::answers::Answers;
use crate::ray::{Hits, Rays};
use crate::reference::{EngineHit, MARGIN_FACTOR, Oracle, OracleRay, Tally, Verdict, Why};
use crate::scene::description::Precision;
use crate::trace::{Engine, Engines};

/// A [`Tally`] in words, for tables and JSON.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Same as the oracle.
    pub agree: u64,
    /// Different where the oracle's margin allows it, by reason; reasons that did not occur are left out.
    pub explained: BTreeMap<String, u64>,
    /// Different for no good reason: must be 0.
    pub unexplained: u64,
    /// The first unexplained rays, with both answers.
    pub samples: Vec<String>,
}

impl From<Tally> for Counts {
    fn from(tally: Tally) -> Self {
        let kinds = Why::ALL.iter().zip(tally.explained).filter(|(_, count)| *count > 0);
        let explained = kinds.map(|(why, count)| (why.to_string(), count)).collect();
        Self { agree: tally.agree, explained, unexplained: tally.unexplained, samples: tally.samples }
    }
}

impl Counts {
    /// Rays judged.
    pub fn total(&self) -> u64 {
        self.agree + self.explained_total() + self.unexplained
    }

    /// Explained differences of all kinds.
    pub fn explained_total(&self) -> u64 {
        self.explained.values().sum()
    }
}

/// Margin factor (see [`crate::reference`]) for engines with an arithmetic of their own: three times the common one.
/// Their rays and corners go through a rotation each, and edges are met a little outside so that nothing passes between
/// them.
pub const OWN_MARGIN_FACTOR: f64 = 3.0 * MARGIN_FACTOR;

/// How far the answers of `engine` may be from the oracle's.
pub fn margin_factor<S: Engines>(engine: &dyn Engine<S>) -> f64 {
    if engine.is_exact() { MARGIN_FACTOR } else { OWN_MARGIN_FACTOR }
}

/// Judges every `stride`-th ray of `batches`, on the current rayon pool. Dead rays are judged too: their answer must
/// be a miss. `margin_factor`: see [`margin_factor`].
pub fn judge<S: Engines>(
    oracle: &Oracle,
    margin_factor: f64,
    batches: &[Rays<S>],
    answers: &Answers<S>,
    stride: usize,
) -> Counts {
    judge_these(oracle, margin_factor, batches, answers, places(batches).enumerate().step_by(stride.max(1)).collect())
}

/// Whether the answers of `engine` are those of `scalar`: bit for bit, or, for an engine with an arithmetic of its own,
/// up to rounding (the agreement is returned), where the oracle must explain each that is not. `oracle` is asked for
/// only then.
///
/// # Errors
/// The first answer that is neither, in words.
pub fn admit<'o, S: Engines>(
    engine: &dyn Engine<S>,
    batches: &[Rays<S>],
    scalar: &Answers<S>,
    answers: &Answers<S>,
    oracle: impl FnOnce() -> Cow<'o, Oracle>,
) -> Result<Agreement, String> {
    if engine.is_exact() {
        return match answers.difference(scalar) {
            None => Ok(Agreement::default()),
            Some(d) => Err(format!("{} rays differ from scalar, ray {}: {}", d.count, d.first, d.text)),
        };
    }
    let agreement = compare(scalar, answers);
    if agreement.unlike.is_empty() {
        return Ok(agreement);
    }
    let counts = judge_rays(&oracle(), OWN_MARGIN_FACTOR, batches, answers, &agreement.unlike);
    match counts.samples.first() {
        None => Ok(agreement),
        Some(first) => Err(format!("the oracle rejects {} answers, {first}", counts.unexplained)),
    }
}

/// Judges what `scalar` and a peer answered to each of the rays called `numbers`, on which they differ by more than they should: what
/// the oracle explains is not wrong, and what differs is the rounding of either. A peer's arithmetic is its own, so its margin is
/// that of such engines.
pub fn judge_both<S: Engines>(
    oracle: &Oracle,
    batches: &[Rays<S>],
    [scalar, peer]: [&Answers<S>; 2],
    numbers: &[u64],
) -> [Counts; 2] {
    [(scalar, MARGIN_FACTOR), (peer, OWN_MARGIN_FACTOR)]
        .map(|(answers, factor)| judge_rays(oracle, factor, batches, answers, numbers))
}

/// Judges the rays called `numbers` (counted through the batches, ascending), see [`judge`].
pub fn judge_rays<S: Engines>(
    oracle: &Oracle,
    margin_factor: f64,
    batches: &[Rays<S>],
    answers: &Answers<S>,
    numbers: &[u64],
) -> Counts {
    judge_these(oracle, margin_factor, batches, answers, chosen(batches, numbers))
}

/// Number, batch and slot of the rays called `numbers`, ascending.
fn chosen<S: Real>(batches: &[Rays<S>], numbers: &[u64]) -> Vec<(usize, (usize, usize))> {
    let mut numbers = numbers.iter().copied().peekable();
    places(batches).enumerate().filter(|(n, _)| numbers.next_if_eq(&(*n as u64)).is_some()).collect()
}

/// Batch and slot of every ray, in order.
pub(super) fn places<S: Real>(batches: &[Rays<S>]) -> impl Iterator<Item = (usize, usize)> {
    batches.iter().enumerate().flat_map(|(b, rays)| (0..rays.len()).map(move |i| (b, i)))
}

fn judge_these<S: Engines>(
    oracle: &Oracle,
    factor: f64,
    batches: &[Rays<S>],
    answers: &Answers<S>,
    chosen: Vec<(usize, (usize, usize))>,
) -> Counts {
    let precision = if S::PRECISION == "f64" { Precision::F64 } else { Precision::F32 };
    let judge_one = |(number, (b, i)): (usize, (usize, usize))| {
        let ray = oracle_ray(&batches[b], i);
        let (hit, verdict) = match answers {
            Answers::Closest(hits) => {
                let answer = engine_hit(&hits[b], i);
                (answer.is_some(), oracle.judge_within(&ray, answer, precision, factor))
            }
            Answers::Any(flags) => {
                let occluded = flags[b][i] != 0;
                (occluded, oracle.judge_occluded_within(&ray, occluded, precision, factor))
            }
        };
        (hit, with_number(verdict, number))
    };
    let verdicts: Vec<(bool, Verdict)> = chosen.into_par_iter().map(judge_one).collect();
    let mut tally = Tally::default();
    verdicts.iter().for_each(|(hit, verdict)| tally.add(*hit, verdict));
    tally.into()
}

/// A fault that says which ray of the set it is about, so that it can be found in a ray file.
fn with_number(verdict: Verdict, number: usize) -> Verdict {
    match verdict {
        Verdict::Unexplained(fault) => Verdict::Unexplained(format!("ray {number}: {fault}")),
        fine => fine,
    }
}

fn oracle_ray<S: Real>(rays: &Rays<S>, i: usize) -> OracleRay {
    let wide = |v: [S; 3]| DVec3::from_array(v.map(S::to_f64));
    OracleRay {
        org: wide(rays.org(i)),
        dir: wide(rays.dir(i)),
        t_min: rays.t_min[i].to_f64(),
        t_max: rays.t_max[i].to_f64(),
    }
}

fn engine_hit<S: Real>(hits: &Hits<S>, i: usize) -> Option<EngineHit> {
    hits.is_hit(i).then(|| EngineHit {
        t: hits.t[i].to_f64(),
        u: hits.u[i].to_f64(),
        v: hits.v[i].to_f64(),
        prim: hits.prim[i],
        inst: hits.inst[i],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::raysets::Query;
    use crate::scene::assembly::Assembly;
    use crate::scene::description::{Description, Item, ItemKind, Shape};

    /// The half-space below z = 0.
    fn floor() -> Oracle {
        let mut scene = Description::new("floor");
        let kind = ItemKind::Shape(Shape::HalfSpace);
        scene.groups[0].items.push(Item { transform: glam::DAffine3::IDENTITY, material: None, kind });
        Oracle::new(&Assembly::new(&scene).unwrap())
    }

    /// Rays that fall on it from z = 1, 2, 3: t = 1, 2, 3.
    #[test]
    fn a_wrong_answer_is_counted_with_its_ray() {
        let oracle = floor();
        let batches = crate::measure::testing::falling_rays::<f32>(&[2, 1]);
        let mut hits = [Hits::new(2), Hits::new(1)];
        for (b, i, t) in [(0, 0, 1.0), (0, 1, 2.0), (1, 0, 3.0)] {
            (hits[b].t[i], hits[b].prim[i], hits[b].inst[i]) = (t, 0, 0);
        }
        let count = |hits: &[Hits<f32>], stride| {
            judge(&oracle, MARGIN_FACTOR, &batches, &Answers::Closest(hits.to_vec()), stride)
        };
        let right = count(&hits, 1);
        assert_eq!((right.agree, right.unexplained, right.total()), (3, 0, 3), "{right:?}");
        hits[1].t[0] = 2.5;
        let wrong = count(&hits, 1);
        assert_eq!((wrong.agree, wrong.unexplained), (2, 1));
        assert!(wrong.samples[0].starts_with("ray 2: "), "{wrong:?}");
        assert_eq!(count(&hits, 2).total(), 2, "every second ray");
        let none = Answers::new(Query::Any, &batches);
        assert_eq!(judge(&oracle, MARGIN_FACTOR, &batches, &none, 1).unexplained, 3);
    }

    /// As above: the third ray's answer is a rounding off in one list and wrong in the other.
    #[test]
    fn both_answers_are_judged() {
        let oracle = floor();
        let batches = crate::measure::testing::falling_rays::<f32>(&[2, 1]);
        let answers = |third: f32| {
            let mut hits = [Hits::new(2), Hits::new(1)];
            for (b, i, t) in [(0, 0, 1.0), (0, 1, 2.0), (1, 0, third)] {
                (hits[b].t[i], hits[b].prim[i], hits[b].inst[i]) = (t, 0, 0);
            }
            Answers::Closest(hits.to_vec())
        };
        let (right, rounded, wrong) = (answers(3.0), answers(3.0f32.next_up()), answers(3.001));
        let judged = |pair: [&Answers<f32>; 2], numbers: &[u64]| judge_both(&oracle, &batches, pair, numbers);
        let rejected =
            |pair: [&Answers<f32>; 2], numbers: &[u64]| judged(pair, numbers).map(|counts| counts.unexplained);
        assert_eq!(rejected([&right, &rounded], &[2]), [0, 0]);
        for (pair, want) in [([&right, &wrong], [0, 1]), ([&wrong, &right], [1, 0])] {
            assert_eq!(rejected(pair, &[0, 2]), want);
            let counts = judged(pair, &[0, 2]);
            let why = counts.iter().find_map(|counts| counts.samples.first()).unwrap();
            assert!(why.starts_with("ray 2: "), "{why}");
            assert_eq!(rejected(pair, &[0, 1]), [0, 0], "only the rays that are asked for");
        }
        // How many ulps either may be off.
        let off = |n: u32| answers(f32::from_bits(3.0f32.to_bits() + n));
        let ours = (1..1000).take_while(|&n| rejected([&off(n), &right], &[2]) == [0, 0]).count();
        let theirs = (1..1000).take_while(|&n| rejected([&right, &off(n)], &[2]) == [0, 0]).count();
        assert!(ours > 0 && (2 * ours..=4 * ours).contains(&theirs), "{ours} and {theirs} ulps");
    }
}
