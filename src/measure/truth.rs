//! Answers judged by the f64 oracle: where this floor touches `reference`.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::lanes::Real;
use crate::measure::answers::Answers;
use crate::ray::{Hits, Rays};
use crate::reference::{EngineHit, Oracle, OracleRay, Verdict};
use crate::scene::description::Precision;

/// Verdicts counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Same as the oracle.
    pub agree: u64,
    /// Different where the oracle's margin allows it, by reason.
    pub explained: BTreeMap<String, u64>,
    /// Different for no good reason: must be 0.
    pub unexplained: u64,
    /// The first unexplained ray, with both answers.
    pub first_unexplained: Option<String>,
}

impl Counts {
    fn add(&mut self, ray: usize, verdict: Verdict) {
        match verdict {
            Verdict::Agree => self.agree += 1,
            Verdict::Explained(why) => *self.explained.entry(format!("{why:?}").to_lowercase()).or_default() += 1,
            Verdict::Unexplained(text) => {
                self.unexplained += 1;
                self.first_unexplained.get_or_insert_with(|| format!("ray {ray}: {text}"));
            }
        }
    }

    /// Rays judged.
    pub fn total(&self) -> u64 {
        self.agree + self.explained_total() + self.unexplained
    }

    /// Explained differences of all kinds.
    pub fn explained_total(&self) -> u64 {
        self.explained.values().sum()
    }
}

/// Judges every `stride`-th live ray of `batches`, on the current rayon pool. Rays that an engine may not hit (dead
/// ones) are judged too: their answer must be a miss.
pub fn judge<S: Real>(
    oracle: &Oracle,
    precision: Precision,
    batches: &[Rays<S>],
    answers: &Answers<S>,
    stride: usize,
) -> Counts {
    let places = batches.iter().enumerate().flat_map(|(b, rays)| (0..rays.len()).map(move |i| (b, i)));
    let chosen: Vec<(usize, (usize, usize))> = places.enumerate().step_by(stride.max(1)).collect();
    let verdicts: Vec<(usize, Verdict)> = chosen
        .into_par_iter()
        .map(|(number, (b, i))| {
            let ray = oracle_ray(&batches[b], i);
            let verdict = match answers {
                Answers::Closest(hits) => oracle.judge(&ray, engine_hit(&hits[b], i), precision),
                Answers::Any(flags) => oracle.judge_occluded(&ray, flags[b][i] != 0, precision),
            };
            (number, verdict)
        })
        .collect();
    let mut counts = Counts::default();
    verdicts.into_iter().for_each(|(number, verdict)| counts.add(number, verdict));
    counts
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
