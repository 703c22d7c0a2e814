//! The bench: engines x ray classes of a scene, checked before the clock starts, then timed interleaved.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::measure::answers::Answers;
use crate::measure::eye::{Framing, View};
use crate::measure::raysets::{RayKind, convert};
use crate::measure::rows::{Outcome, Row, SceneFacts};
use crate::measure::stats::{paired_ratio_median, summary};
use crate::measure::timing::{Series, Workers, interleave};
use crate::measure::truth;
use crate::ray::Rays;
use crate::reference::Oracle;
use crate::scene::description::{Description, Precision};
use crate::scene::world::{Preset, World};
use crate::trace::{Engine, Engines, engine};

/// Rounds that are run and thrown away before the timed ones: caches, page tables and clocks settle.
pub const WARM_UP: u32 = 1;

/// Most ray-primitive tests an engine without a tree may take on in one pass (some tens of milliseconds; a run makes
/// a dozen passes).
pub const BRUTE_LIMIT: u64 = 20_000_000;

/// Most ray-primitive tests the oracle may take on per ray class; the rays it judges are spread evenly.
pub const ORACLE_LIMIT: u64 = 20_000_000;

/// Most rays per class that the oracle judges, whatever they cost.
pub const ORACLE_RAYS: u64 = 1000;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Ray classes.
    pub kinds: Vec<RayKind>,
    /// Engines by name; empty means all.
    pub engines: Vec<String>,
    /// Width and height of the picture whose rays are traced.
    pub size: (u32, u32),
    /// Timed rounds.
    pub repeat: u32,
    /// Seed of the random directions.
    pub seed: u64,
    /// Tree quality.
    pub preset: Preset,
}

/// Measures one scene; every finished row goes to `report`, class by class.
///
/// An engine whose answers differ from the `scalar` engine's in one bit gets an [`Outcome::Wrong`] row and no figure;
/// if the oracle rejects the `scalar` engine's answers, so does every engine.
///
/// # Errors
/// Unknown engines, those of compiling the world and making the rays; [`Error::Interrupted`] when `stop` says so.
pub fn scene<S: Engines>(
    workers: &Workers,
    description: &Description,
    camera: Framing<'_>,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
    report: &mut dyn FnMut(Row),
) -> Result<()> {
    let engines = chosen::<S>(&plan.engines)?;
    let world = workers.install(|| World::<S>::compile(description, plan.preset))?;
    let view = workers.install(|| View::new(&world, description, camera, plan.size, plan.seed))?;
    let oracle = Oracle::new(&world.assembly);
    let stats = world.stats();
    let facts = SceneFacts {
        name: description.name.clone(),
        hash: description.hash.clone(),
        prims: stats.prims,
        build_seconds: stats.build_seconds,
        bytes: stats.node_bytes + stats.prim_bytes,
    };
    let subject = Subject { workers, world: &world, oracle: &oracle, facts, engines };
    for &kind in &plan.kinds {
        let rays = workers.install(|| view.rays(&world, kind));
        subject.class(kind, &convert(&rays), plan.repeat, stop, report)?;
    }
    Ok(())
}

/// The engines called `names`, or all of precision `S`.
fn chosen<S: Engines>(names: &[String]) -> Result<Vec<&'static dyn Engine<S>>> {
    if names.is_empty() { Ok(S::engines().to_vec()) } else { names.iter().map(|name| engine(name)).collect() }
}

struct Subject<'a, S: 'static> {
    workers: &'a Workers,
    world: &'a World<S>,
    oracle: &'a Oracle,
    facts: SceneFacts,
    engines: Vec<&'static dyn Engine<S>>,
}

impl<S: Engines> Subject<'_, S> {
    fn class(
        &self,
        kind: RayKind,
        batches: &[Rays<S>],
        repeat: u32,
        stop: &dyn Fn() -> bool,
        report: &mut dyn FnMut(Row),
    ) -> Result<()> {
        let query = kind.query();
        let rays: u64 = batches.iter().map(|b| b.len() as u64).sum();
        let mut scalar = Answers::new(query, batches);
        self.workers.pass(engine::<S>("scalar")?, self.world, batches, &mut scalar);
        let rejected = self.rejected(batches, &scalar, rays);

        let mut outcomes = BTreeMap::new();
        let mut series = Vec::new();
        for &engine in &self.engines {
            if stop() {
                return Err(Error::Interrupted);
            }
            match self.admit(engine, batches, &scalar, rays, rejected.as_deref()) {
                Ok(answers) => series.push(Series::new(engine, answers)),
                Err(outcome) => {
                    outcomes.insert(engine.name(), outcome);
                }
            }
        }
        interleave(self.workers, self.world, batches, &mut series, (WARM_UP, repeat), stop)?;
        let baseline = series.iter().find(|s| s.engine.name() == "scalar").map(|s| s.seconds.clone());
        for one in &series {
            if let Some(outcome) = self.outcome(one, baseline.as_deref(), batches, kind) {
                outcomes.insert(one.engine.name(), outcome);
            }
        }
        for &engine in &self.engines {
            if let Some(outcome) = outcomes.remove(engine.name()) {
                let (class, precision) = (kind.name(), S::PRECISION);
                let (scene, engine) = (self.facts.clone(), engine.name());
                report(Row { scene, class, query: query.name(), engine, precision, rays, outcome });
            }
        }
        Ok(())
    }

    /// The oracle's objection to a sample of the `scalar` engine's answers.
    fn rejected(&self, batches: &[Rays<S>], scalar: &Answers<S>, rays: u64) -> Option<String> {
        // Above 10^5 primitives the oracle has a tree of its own.
        let cost = self.world.assembly.instanced_prims().clamp(1, 100_000);
        let sample = (ORACLE_LIMIT / cost).clamp(1, ORACLE_RAYS);
        let stride = rays.div_ceil(sample).max(1) as usize;
        let precision = if S::PRECISION == "f64" { Precision::F64 } else { Precision::F32 };
        let counts = self.workers.install(|| truth::judge(self.oracle, precision, batches, scalar, stride));
        let total = counts.total();
        let first = counts.samples.first()?;
        Some(format!("the oracle rejects {} of {total} sampled rays, {first}", counts.unexplained))
    }

    /// Answers that may be timed, or why there will be no figure.
    fn admit(
        &self,
        engine: &dyn Engine<S>,
        batches: &[Rays<S>],
        scalar: &Answers<S>,
        rays: u64,
        rejected: Option<&str>,
    ) -> std::result::Result<Answers<S>, Outcome> {
        let tests = rays.saturating_mul(self.world.assembly.instanced_prims());
        if engine.name() == "brute" && tests > BRUTE_LIMIT {
            return Err(Outcome::Skipped(format!("{tests} ray-primitive tests per pass, limit {BRUTE_LIMIT}")));
        }
        if let Some(why) = rejected {
            return Err(Outcome::Wrong(why.into()));
        }
        let mut answers = scalar.clone();
        self.workers.pass(engine, self.world, batches, &mut answers);
        match answers.difference(scalar) {
            None => Ok(answers),
            Some(d) => Err(Outcome::Wrong(format!("{} rays differ from scalar, ray {}: {}", d.count, d.first, d.text))),
        }
    }

    fn outcome(
        &self,
        one: &Series<'_, S>,
        baseline: Option<&[f64]>,
        batches: &[Rays<S>],
        kind: RayKind,
    ) -> Option<Outcome> {
        let seconds = summary(&one.seconds)?;
        let counters = self.workers.count(one.engine, self.world, batches, kind.query());
        let lane_use = |active: u64, total: u64| (total > 0).then(|| active as f64 / total as f64);
        Some(Outcome::Timed {
            seconds,
            repeat: one.seconds.len(),
            hits: one.answers.hit_count(),
            checksum: one.answers.checksum(),
            ratio: baseline.and_then(|b| paired_ratio_median(b, &one.seconds)),
            node_lane_use: lane_use(counters.node_lanes_active, counters.node_lanes_total),
            prim_lane_use: lane_use(counters.prim_lanes_active, counters.prim_lanes_total),
        })
    }
}
