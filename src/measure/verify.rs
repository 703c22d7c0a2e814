//! Verification: every engine, query and ray class against the f64 oracle, and bit for bit against `scalar`, or, where
//! an engine has an arithmetic of its own, against itself in another order.

use crate::error::{Error, Result};
use crate::measure::answers::Answers;
use crate::measure::eye::{Framing, View};
use crate::measure::raysets::{Query, RayKind, convert};
use crate::measure::timing::Workers;
use crate::measure::truth::{self, Counts};
use crate::ray::Rays;
use crate::reference::{MARGIN_FACTOR, Oracle};
use crate::scene::description::Description;
use crate::scene::world::{BuildSettings, World};
use crate::trace::{Engine, Engines, engine};

/// Largest number of ray-primitive tests an engine or oracle without a tree may take on in one pass (about a
/// second).
pub const BRUTE_LIMIT: u64 = 400_000_000;

/// Most rays per class, about (2 GB): all engines' answers to them are held at once.
pub const MAX_RAYS: u64 = 10_000_000;

/// What to verify.
#[derive(Clone, Debug)]
pub struct Options {
    /// Rays per class, about; `None` picks a number that takes seconds.
    pub rays: Option<u64>,
    /// Width and height of the picture whose rays are traced; `None` follows from `rays`.
    pub size: Option<(u32, u32)>,
    /// Ray classes.
    pub kinds: Vec<RayKind>,
    /// Seed of the random directions.
    pub seed: u64,
    /// Tree quality.
    pub build: BuildSettings,
}

/// One engine on one ray class.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Line {
    /// `f32` or `f64`.
    pub precision: &'static str,
    /// Ray class.
    pub class: &'static str,
    /// `closest` or `any`.
    pub query: &'static str,
    /// Engine.
    pub engine: &'static str,
    /// Rays traced, dead ones included.
    pub rays: u64,
    /// Rays that hit.
    pub hits: u64,
    /// Judged by the oracle.
    pub oracle: Counts,
    /// Rays whose bits differ from the `scalar` engine's, which none may; `None` for engines with an arithmetic of their own.
    pub bit_differences: Option<u64>,
    /// The first of them, with both answers.
    pub first_difference: Option<String>,
    /// The same of engines with an arithmetic of their own, whose bits may differ: what is wrong among them, the oracle finds. `None`
    /// for the others.
    pub own_differences: Option<u64>,
    /// Rays whose bits change when the same rays come in another order and in other batches (engines with an arithmetic
    /// of their own: the same batches in another order).
    pub order_differences: u64,
    /// Why the engine was not run.
    pub skipped: Option<String>,
}

impl Line {
    /// Whether nothing is wrong.
    pub fn passes(&self) -> bool {
        self.oracle.unexplained == 0 && self.bit_differences.unwrap_or(0) == 0 && self.order_differences == 0
    }
}

/// Rays per class that keep the oracle (brute force up to 10^5 primitives) within seconds.
pub fn default_rays(instanced_prims: u64) -> u64 {
    (4_000_000 / instanced_prims.clamp(1, 100_000)).clamp(256, 4096)
}

/// Width and height of a picture of about `rays` pixels, 4:3.
pub fn picture_of(rays: u64) -> (u32, u32) {
    let width = (rays as f64 * 4.0 / 3.0).sqrt().round().clamp(1.0, 16384.0);
    let height = (rays as f64 / width).round().clamp(1.0, 16384.0);
    (width as u32, height as u32)
}

/// Verifies all engines of precision `S` on `description` seen by `camera`; each finished line goes to `report`.
///
/// # Errors
/// A picture of more than [`MAX_RAYS`] pixels; those of compiling the world and making the rays; [`Error::Interrupted`] when `stop` says so.
pub fn verify<S: Engines>(
    workers: &Workers,
    description: &Description,
    camera: Framing<'_>,
    options: &Options,
    stop: &dyn Fn() -> bool,
    report: &mut dyn FnMut(Line),
) -> Result<()> {
    if let Some((width, height)) = options.size.filter(|&(w, h)| u64::from(w) * u64::from(h) > MAX_RAYS) {
        return Err(Error::Usage(format!("{width}x{height} rays per class: verify takes at most {MAX_RAYS}")));
    }
    let world = workers.install(|| World::<S>::compile(description, options.build))?;
    let rays = options.rays.unwrap_or_else(|| default_rays(world.assembly.instanced_prims()));
    let size = options.size.unwrap_or_else(|| picture_of(rays));
    let view = workers.install(|| View::new(&world, description, camera, size, options.seed))?;
    let oracle = Oracle::new(&world.assembly);
    let bench = Bench { workers, world: &world, oracle: &oracle };
    for &kind in &options.kinds {
        let rays = workers.install(|| view.rays(&world, kind))?;
        let batches = convert::<S>(&rays);
        for query in [Query::Closest, Query::Any] {
            bench.query(kind, query, &batches, stop, report)?;
        }
    }
    Ok(())
}

struct Bench<'a, S> {
    workers: &'a Workers,
    world: &'a World<S>,
    oracle: &'a Oracle,
}

impl<S: Engines> Bench<'_, S> {
    fn query(
        &self,
        kind: RayKind,
        query: Query,
        batches: &[Rays<S>],
        stop: &dyn Fn() -> bool,
        report: &mut dyn FnMut(Line),
    ) -> Result<()> {
        let scalar = self.answers(engine::<S>("scalar")?, query, batches);
        let judged = self.judge(MARGIN_FACTOR, batches, &scalar);
        let rays: u64 = batches.iter().map(|b| b.len() as u64).sum();
        let shuffled = Shuffled::new(batches);
        for &engine in S::engines() {
            if stop() {
                return Err(Error::Interrupted);
            }
            let mut line = Line {
                precision: S::PRECISION,
                class: kind.name(),
                query: query.name(),
                engine: engine.name(),
                rays,
                hits: 0,
                oracle: Counts::default(),
                bit_differences: engine.is_exact().then_some(0),
                first_difference: None,
                own_differences: None,
                order_differences: 0,
                skipped: None,
            };
            let tests = rays.saturating_mul(self.world.assembly.instanced_prims());
            if engine.name() == "brute" && tests > BRUTE_LIMIT {
                line.skipped = Some(format!("{tests} ray-primitive tests, limit {BRUTE_LIMIT}"));
                report(line);
                continue;
            }
            let answers = self.answers(engine, query, batches);
            let difference = answers.difference(&scalar);
            line.hits = answers.hit_count();
            // The same bits get the same verdicts; only an engine that differs is judged anew.
            line.oracle = match difference {
                None => judged.clone(),
                Some(_) => self.judge(truth::margin_factor(engine), batches, &answers),
            };
            let count = difference.as_ref().map_or(0, |d| d.count);
            if engine.is_exact() {
                line.bit_differences = Some(count);
                line.first_difference = difference.map(|d| format!("ray {}: {}", d.first, d.text));
                let reordered = self.answers(engine, query, &shuffled.batches);
                line.order_differences = shuffled.differences(&answers, &reordered);
            } else {
                line.own_differences = Some(count);
                line.order_differences = self.backwards(engine, query, batches, &answers);
            }
            report(line);
        }
        Ok(())
    }

    fn answers(&self, engine: &dyn Engine<S>, query: Query, batches: &[Rays<S>]) -> Answers<S> {
        let mut answers = Answers::new(query, batches);
        self.workers.pass(engine, self.world, batches, &mut answers);
        answers
    }

    /// Rays whose answers change when the same batches come in reverse.
    fn backwards(&self, engine: &dyn Engine<S>, query: Query, batches: &[Rays<S>], answers: &Answers<S>) -> u64 {
        let reversed: Vec<Rays<S>> = batches.iter().rev().cloned().collect();
        let again = self.answers(engine, query, &reversed);
        let last = batches.len().saturating_sub(1);
        truth::places(batches).filter(|&(b, i)| !answers.same_as(b, i, &again, last - b, i)).count() as u64
    }

    fn judge(&self, margin_factor: f64, batches: &[Rays<S>], answers: &Answers<S>) -> Counts {
        self.workers.install(|| truth::judge(self.oracle, margin_factor, batches, answers, 1))
    }
}

/// The same rays in another order and in batches of an odd size: answers must not depend on a ray's neighbours.
struct Shuffled<S> {
    batches: Vec<Rays<S>>,
    /// For each shuffled ray in order: batch and slot of the original.
    origin: Vec<(usize, usize)>,
}

impl<S: Engines> Shuffled<S> {
    const BATCH: usize = 37;

    fn new(batches: &[Rays<S>]) -> Self {
        let places: Vec<_> = truth::places(batches).collect();
        // Steps of a stride without a common factor with the length visit every place once, far apart.
        let count = places.len();
        let stride = (count * 5 / 8..).find(|&s| gcd(s, count) == 1).unwrap_or(1);
        let origin: Vec<_> = (0..count).map(|k| places[k * stride % count]).collect();
        let shuffled = origin.chunks(Self::BATCH).map(|chunk| {
            let mut rays = Rays::new(chunk.len());
            for (slot, &(b, i)) in chunk.iter().enumerate() {
                let from = &batches[b];
                rays.set(slot, from.org(i), from.dir(i), from.t_min[i], from.t_max[i]);
            }
            rays
        });
        Self { batches: shuffled.collect(), origin }
    }

    fn differences(&self, original: &Answers<S>, shuffled: &Answers<S>) -> u64 {
        let places = self.origin.iter().enumerate();
        let wrong = places.filter(|&(k, &(b, i))| !original.same_as(b, i, shuffled, k / Self::BATCH, k % Self::BATCH));
        wrong.count() as u64
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::testing::falling_rays;

    #[test]
    fn default_sizes_keep_the_oracle_affordable() {
        assert_eq!(default_rays(10), 4096);
        assert_eq!(default_rays(10_000), 400);
        assert_eq!(default_rays(100_000), 256);
        assert_eq!(default_rays(50_000_000), 256);
        assert_eq!(default_rays(0), 4096);
        assert_eq!(picture_of(12), (4, 3));
        assert_eq!(picture_of(0), (1, 1));
        let (width, height) = picture_of(4096);
        assert!((3900..4300).contains(&(width * height)), "{width}x{height}");
    }

    #[test]
    fn shuffling_visits_every_ray_once_and_finds_a_dependence_on_order() {
        let batches = falling_rays::<f64>(&[50, 3, 0, 61]);
        let shuffled = Shuffled::new(&batches);
        let mut seen = shuffled.origin.clone();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 114);
        let flags = |b: usize, i: usize| u8::from((b * 7 + i).is_multiple_of(3));
        let original = Answers::<f64>::Any(
            batches.iter().enumerate().map(|(b, r)| (0..r.len()).map(|i| flags(b, i)).collect()).collect(),
        );
        let mut again: Vec<Vec<u8>> =
            shuffled.origin.chunks(37).map(|c| c.iter().map(|&(b, i)| flags(b, i)).collect()).collect();
        assert_eq!(shuffled.differences(&original, &Answers::Any(again.clone())), 0);
        again[1][5] ^= 1;
        assert_eq!(shuffled.differences(&original, &Answers::Any(again)), 1);
        assert_eq!(Shuffled::<f64>::new(&[]).batches.len(), 0);
    }
}
