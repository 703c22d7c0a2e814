//! The bench: engines and peers x ray classes of a scene, checked before the clock starts, then timed interleaved.

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::measure::agreement::{Agreement, compare_traced};
use crate::measure::answers::Answers;
use crate::measure::explain::{self, Costs, Limit};
use crate::measure::eye::{Framing, View};
use crate::measure::peers::{Guest, Invitation, Peer};
use crate::measure::raysets::{RayKind, calls};
use crate::measure::rows::{Outcome, PeerRow, Row, SceneFacts};
use crate::measure::stats::{median, paired_ratio_median, summary};
use crate::measure::timing::{Load, Series, Tracer, Workers, interleave};
use crate::measure::truth;
use crate::ray::{Counters, Pencil, Rays};
use crate::reference::{MARGIN_FACTOR, Oracle};
use crate::scene::description::Description;
use crate::scene::world::{BuildSettings, World};
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

/// Why peers trace no scattered rays.
const ON_SURFACES: &str = "scattered rays begin or end on surfaces, where no two arithmetics agree";

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
    pub build: BuildSettings,
    /// Other tracers to run beside them.
    pub peers: Invitation,
}

/// Measures one scene; every finished row goes to `report`, class by class.
///
/// An engine whose answers differ from the `scalar` engine's in one bit gets an [`Outcome::Wrong`] row and no figure (one
/// with an arithmetic of its own: if the oracle cannot explain a difference); if the oracle rejects the `scalar` engine's answers, so does every engine. Peers may differ as
/// [`crate::measure::agreement`] says; one that is missing gets an [`Outcome::Skipped`] row per class,
/// all get one for scattered rays.
///
/// # Errors
/// Unknown engines or peers, those of compiling the world and making the rays; [`Error::Interrupted`] when `stop` says so.
pub fn scene<S: Engines>(
    workers: &Workers,
    description: &Description,
    camera: Framing<'_>,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
    report: &mut dyn FnMut(Row),
) -> Result<()> {
    classes::<S>(workers, description, camera, plan, stop, &mut |_, rows| {
        rows.into_iter().for_each(&mut *report);
        Ok(())
    })
}

/// The same, where `report` gets all rows of a class before the next is measured.
///
/// # Errors
/// Those of [`scene`] and of `report`, which end it.
pub fn classes<S: Engines>(
    workers: &Workers,
    description: &Description,
    camera: Framing<'_>,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
    report: &mut dyn FnMut(RayKind, Vec<Row>) -> Result<()>,
) -> Result<()> {
    let engines = chosen::<S>(&plan.engines)?;
    plan.peers.check()?;
    let world = workers.install(|| World::<S>::compile(description, plan.build))?;
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
    let guests = plan.peers.open(&world, workers)?;
    let costs = explain::is_of_triangles(&world).then(|| workers.install(explain::costs::<S>));
    let subject =
        Subject { workers, world: &world, oracle: &oracle, facts, pixels: view.pixels, engines, guests, costs };
    for &kind in &plan.kinds {
        let rows = if kind == RayKind::Camera {
            let batches = workers.install(|| view.made::<S>());
            let maker = |tile: usize, pencil: &mut Pencil, rays: &mut Rays<S>| view.make(tile, pencil, rays);
            let load = Load { batches: &batches, maker: Some(&maker) };
            subject.class(kind, load, plan.repeat, stop)?
        } else {
            let rays = workers.install(|| view.rays(&world, kind))?;
            subject.class(kind, Load::packed(&calls(&rays, workers.threads())), plan.repeat, stop)?
        };
        report(kind, rows)?;
    }
    Ok(())
}

/// The engines called `names`, each once (`auto` is another name of one), or all of precision `S`.
///
/// # Errors
/// A usage error for an unknown name.
pub fn chosen<S: Engines>(names: &[String]) -> Result<Vec<&'static dyn Engine<S>>> {
    if names.is_empty() {
        return Ok(S::engines().to_vec());
    }
    let mut engines: Vec<&'static dyn Engine<S>> = Vec::new();
    for name in names {
        let next = engine::<S>(name)?;
        if engines.iter().all(|engine| engine.name() != next.name()) {
            engines.push(next);
        }
    }
    Ok(engines)
}

struct Subject<'a, S: 'static> {
    workers: &'a Workers,
    world: &'a World<S>,
    oracle: &'a Oracle,
    facts: SceneFacts,
    /// Of the picture.
    pixels: u64,
    engines: Vec<&'static dyn Engine<S>>,
    guests: Vec<Guest<S>>,
    /// Of single tests, if the scene is of triangles.
    costs: Option<Costs>,
}

/// Answers that may be timed and, for a peer, how they compare with ours.
type Admission<S> = std::result::Result<(Answers<S>, Agreement), Box<Outcome>>;

impl<S: Engines> Subject<'_, S> {
    fn class(&self, kind: RayKind, load: Load<'_, S>, repeat: u32, stop: &dyn Fn() -> bool) -> Result<Vec<Row>> {
        let (query, batches) = (kind.query(), load.batches);
        let slots: u64 = batches.iter().map(|b| b.len() as u64).sum();
        // Tiles go beyond the picture where its sides are no multiples of theirs; what they hold there is no ray of anybody's.
        let rays = if kind == RayKind::Scatter { slots } else { self.pixels };
        let mut scalar = Answers::new(query, batches);
        self.workers.pass(engine::<S>("scalar")?, self.world, batches, &mut scalar);
        let rejected = self.rejected(batches, &scalar, slots);

        let (mut series, mut entries) = (Vec::new(), Vec::new());
        for (workers, tracer) in self.tracers() {
            if stop() {
                return Err(Error::Interrupted);
            }
            let admission = match tracer {
                Tracer::Engine(engine) => self.admit(workers, engine, load, &scalar, rejected.as_deref()),
                // Whether a segment that begins or ends on a surface meets it there is decided by roundings, each tracer's own.
                Tracer::Peer(_) if kind == RayKind::Scatter => Err(Box::new(Outcome::Skipped(ON_SURFACES.into()))),
                Tracer::Peer(peer) => self.admit_peer(peer, batches, &scalar, rays),
            };
            entries.push(Entry {
                workers,
                tracer,
                place: admission.map(|(answers, agreement)| {
                    series.push(Series::new(workers, tracer, answers));
                    (series.len() - 1, agreement)
                }),
            });
        }
        interleave(self.world, load, &mut series, (WARM_UP, repeat), stop)?;
        Ok(self.rows(kind, batches, rays, entries, &series))
    }

    /// Our engines, the same on fewer threads, then all modes of all peers that are there.
    fn tracers(&self) -> Vec<(&Workers, Tracer<'_, S>)> {
        let teams = [self.workers].into_iter().chain(self.workers.fewer());
        let engines =
            teams.flat_map(|workers| self.engines.iter().map(move |&engine| (workers, Tracer::Engine(engine))));
        let modes = self.guests.iter().filter_map(|guest| guest.modes.as_ref().ok()).flatten();
        engines.chain(modes.map(|peer| (self.workers, Tracer::Peer(&**peer)))).collect()
    }

    /// One row per entry, and one for each peer that is missing.
    fn rows(
        &self,
        kind: RayKind,
        batches: &[Rays<S>],
        rays: u64,
        entries: Vec<Entry<'_, S>>,
        series: &[Series<'_, S>],
    ) -> Vec<Row> {
        let of_engines = series.iter().filter(|s| matches!(s.tracer, Tracer::Engine(_)));
        let engine_on = |engine: &str, threads: usize| {
            let is_it = |s: &&Series<'_, S>| s.workers.threads() == threads && name(s.tracer) == engine;
            of_engines.clone().find(is_it).map(|s| &s.seconds[..])
        };
        let efficiency = |one: &Series<'_, S>| {
            let ratio = paired_ratio_median(engine_on(name(one.tracer), 1)?, &one.seconds)?;
            Some(ratio / one.workers.threads() as f64)
        };
        let of_all_threads = of_engines.clone().filter(|s| s.workers.threads() == self.workers.threads());
        let best = of_all_threads.min_by(|a, b| mid(a).total_cmp(&mid(b))).map(|s| &s.seconds[..]);
        let fastest = |name_of_peer: &str| {
            let modes = (0..series.len()).filter(|&i| name(series[i].tracer) == name_of_peer);
            modes.min_by(|&a, &b| mid(&series[a]).total_cmp(&mid(&series[b])))
        };
        let row = |engine, scene, (threads, efficiency), peer, agreement: &Agreement, outcome| {
            let (ties, differences) = (agreement.ties, agreement.differences());
            let (class, query, precision) = (kind.name(), kind.query().name(), S::PRECISION);
            Row { scene, class, query, engine, precision, threads, rays, ties, differences, efficiency, peer, outcome }
        };
        let mut rows = Vec::new();
        for Entry { workers, tracer, place } in entries {
            let one = place.as_ref().ok().map(|(place, _)| (&series[*place], *place));
            let peer = match tracer {
                Tracer::Engine(_) => None,
                Tracer::Peer(peer) => Some(PeerRow {
                    mode: peer.facts().mode,
                    description: peer.facts().description.clone(),
                    quoted: one.is_none_or(|(_, place)| fastest(peer.facts().name) == Some(place)),
                    lead: one.and_then(|(one, _)| paired_ratio_median(&one.seconds, best?)),
                }),
            };
            let threads = workers.threads();
            let efficiency = match tracer {
                Tracer::Engine(_) if !self.workers.fewer().is_empty() => one.and_then(|(one, _)| efficiency(one)),
                _ => None,
            };
            let (agreement, outcome) = match place {
                Ok((place, agreement)) => {
                    (agreement, self.outcome(&series[place], engine_on("scalar", threads), batches, kind))
                }
                Err(outcome) => (Agreement::default(), Some(*outcome)),
            };
            let on = (threads, efficiency);
            let row = |outcome| row(name(tracer), self.facts_of(tracer), on, peer, &agreement, outcome);
            rows.extend(outcome.map(row));
        }
        for guest in &self.guests {
            if let Err(why) = &guest.modes {
                let peer = PeerRow { quoted: true, ..Default::default() };
                let scene = SceneFacts { build_seconds: 0.0, bytes: 0, ..self.facts.clone() };
                let on = (self.workers.threads(), None);
                rows.push(row(guest.name, scene, on, Some(peer), &Agreement::default(), Outcome::Skipped(why.clone())));
            }
        }
        rows
    }

    /// The scene's facts, with the build time and memory of whoever traces it.
    fn facts_of(&self, tracer: Tracer<'_, S>) -> SceneFacts {
        match tracer {
            Tracer::Engine(_) => self.facts.clone(),
            Tracer::Peer(peer) => {
                let (build_seconds, bytes) = (peer.facts().build_seconds, peer.facts().bytes);
                SceneFacts { build_seconds, bytes, ..self.facts.clone() }
            }
        }
    }

    /// A peer's answers, if all but a handful are ours up to rounding, or the oracle explains ours and all but a handful of them where
    /// they are not; a handful is a share of `rays`.
    fn admit_peer(&self, peer: &dyn Peer<S>, batches: &[Rays<S>], scalar: &Answers<S>, rays: u64) -> Admission<S> {
        let mut answers = scalar.clone();
        self.workers.peer_pass(peer, batches, &mut answers);
        let agreement = Agreement { rays, ..compare_traced(batches, scalar, &answers) };
        let mut why = String::new();
        let passes = agreement.passes_if(|| {
            let both = [scalar, &answers];
            let judged = self.workers.install(|| truth::judge_both(self.oracle, batches, both, &agreement.differing));
            let [ours, theirs] = judged.each_ref().map(|counts| counts.unexplained);
            if let Some(first) = judged.iter().find_map(|counts| counts.samples.first()) {
                why = format!("; the oracle rejects {ours} of our answers and {theirs} of the peer's to them, {first}");
            }
            (ours == 0).then_some(theirs)
        });
        match &agreement.first {
            Some(first) if !passes => {
                let (count, rays) = (agreement.differences(), agreement.rays);
                Err(Box::new(Outcome::Wrong(format!("{count} of {rays} rays differ from scalar, {first}{why}"))))
            }
            _ => Ok((answers, agreement)),
        }
    }

    /// The oracle's objection to a sample of the `scalar` engine's answers.
    fn rejected(&self, batches: &[Rays<S>], scalar: &Answers<S>, slots: u64) -> Option<String> {
        // Above 10^5 primitives the oracle has a tree of its own.
        let cost = self.world.assembly.instanced_prims().clamp(1, 100_000);
        let sample = (ORACLE_LIMIT / cost).clamp(1, ORACLE_RAYS);
        let stride = slots.div_ceil(sample).max(1) as usize;
        let counts = self.workers.install(|| truth::judge(self.oracle, MARGIN_FACTOR, batches, scalar, stride));
        let total = counts.total();
        let first = counts.samples.first()?;
        Some(format!("the oracle rejects {} of {total} sampled rays, {first}", counts.unexplained))
    }

    /// Answers that may be timed, or why there will be no figure.
    fn admit(
        &self,
        workers: &Workers,
        engine: &dyn Engine<S>,
        load: Load<'_, S>,
        scalar: &Answers<S>,
        rejected: Option<&str>,
    ) -> Admission<S> {
        let rays: u64 = load.batches.iter().map(|b| b.len() as u64).sum();
        let tests = rays.saturating_mul(self.world.assembly.instanced_prims());
        if engine.name() == "brute" && tests > BRUTE_LIMIT {
            let why = format!("{tests} ray-primitive tests per pass, limit {BRUTE_LIMIT}");
            return Err(Box::new(Outcome::Skipped(why)));
        }
        if let Some(why) = rejected {
            return Err(Box::new(Outcome::Wrong(why.into())));
        }
        let mut answers = scalar.clone();
        Tracer::Engine(engine).pass(workers, self.world, load, &mut answers);
        let oracle = || Cow::Borrowed(self.oracle);
        let admitted = self.workers.install(|| truth::admit(engine, load.batches, scalar, &answers, oracle));
        admitted.map(|agreement| (answers, agreement)).map_err(|why| Box::new(Outcome::Wrong(why)))
    }

    fn outcome(
        &self,
        one: &Series<'_, S>,
        baseline: Option<&[f64]>,
        batches: &[Rays<S>],
        kind: RayKind,
    ) -> Option<Outcome> {
        let seconds = summary(&one.seconds)?;
        let counters = match one.tracer {
            Tracer::Engine(engine) => self.workers.count(engine, self.world, batches, kind.query()),
            Tracer::Peer(_) => Counters::default(),
        };
        let lane_use = |active: u64, total: u64| (total > 0).then(|| active as f64 / total as f64);
        // Every thread has the time of the pass.
        let of_limit = |costs: &Costs| Limit::of(costs, &counters, seconds.median * one.workers.threads() as f64);
        let percent_of_limit = self.costs.as_ref().and_then(of_limit).map(|limit| limit.percent);
        Some(Outcome::Timed {
            seconds,
            repeat: one.seconds.len(),
            passes: one.seconds.clone(),
            hits: one.answers.hit_count(),
            checksum: one.answers.checksum(),
            ratio: baseline.and_then(|b| paired_ratio_median(b, &one.seconds)),
            node_lane_use: lane_use(counters.node_lanes_active, counters.node_lanes_total),
            prim_lane_use: lane_use(counters.prim_lanes_active, counters.prim_lanes_total),
            percent_of_limit,
        })
    }
}

/// One tracer's place among the series with how its answers compare, or why it has none.
struct Entry<'a, S> {
    workers: &'a Workers,
    tracer: Tracer<'a, S>,
    place: std::result::Result<(usize, Agreement), Box<Outcome>>,
}

fn name<S: Engines>(tracer: Tracer<'_, S>) -> &'static str {
    match tracer {
        Tracer::Engine(engine) => engine.name(),
        Tracer::Peer(peer) => peer.facts().name,
    }
}

/// Median seconds; infinite without passes.
fn mid<S>(series: &Series<'_, S>) -> f64 {
    median(&series.seconds).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests;
