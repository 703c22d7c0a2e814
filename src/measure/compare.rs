//! Two result files, or two folders of runs, side by side: what moved, and whether that is more than noise.
//!
//! Runs that took turns (old, new, old, new, ..., see `bench --against`) share the machine's mood, so each turn gives one
//! factor, and the bootstrap over turns and rounds says how sure their median is. Two single runs were not interleaved with
//! each other: the machine may have changed its speed between them, which only cancels in ratios to `scalar` of the same
//! rounds; what still differs then (caches, pages, placement) was measured and widens what counts as no difference.
//!
//! Files of older versions have no single passes. There, the standard error of a median of n normal samples is about
//! 1.2533 sigma / sqrt(n), and 1.4826 times the median absolute deviation estimates sigma (Huber, Ronchetti, "Robust
//! Statistics", 2009).

mod read;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::error::{Error, Result};
use crate::measure::intervals::{Estimate, Interval, ratio_of_medians, ratio_over_turns};
pub use read::{Figure, Key, Turn, parse, read};

/// Standard errors that bound the interval of a file without single passes.
const SIGMAS: f64 = 3.0;

/// Fewest turns that are judged as turns.
const MIN_TURNS: usize = 3;

/// Relative difference that does not count between runs that took turns.
const MARGIN: f64 = 0.01;

/// Relative difference that single runs of the same binary show beside the rounds' own scatter: caches, pages, placement.
const DRIFT: f64 = 0.02;

/// The same for rates, which move with the load of the machine: nothing cancels.
const DRIFT_OF_RATES: f64 = 0.33;

/// What became of one row.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Change {
    /// Scene name.
    pub scene: String,
    /// Ray class.
    pub class: String,
    /// `closest` or `any`.
    pub query: String,
    /// Engine or peer, with its mode.
    pub engine: String,
    /// `f32` or `f64`.
    pub precision: String,
    /// Million rays per second before (of several turns: the first).
    pub old: Option<f64>,
    /// Million rays per second now.
    pub new: Option<f64>,
    /// New over old: of the ratios to `scalar` where both have one, else of the rates.
    pub factor: Option<f64>,
    /// Where the true factor is, by the samples alone.
    pub interval: Option<Interval>,
    /// Relative difference that does not count beside.
    pub margin: Option<f64>,
    /// What was compared: `turns`, `ratios to scalar` or `rates`.
    pub basis: Option<&'static str>,
    /// `faster`, `slower`, `no difference seen`, `only old` or `only new`.
    pub verdict: &'static str,
}

/// All rows of either side, and how many of them say what.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Comparison {
    /// Rows that both sides have.
    pub compared: usize,
    /// Of these: faster.
    pub faster: usize,
    /// Of these: slower.
    pub slower: usize,
    /// Rows of the old side alone.
    pub only_old: usize,
    /// Rows of the new side alone.
    pub only_new: usize,
    /// The rows.
    pub rows: Vec<Change>,
}

impl Comparison {
    /// Counts `rows`.
    ///
    /// # Errors
    /// [`Error::Usage`] if no row is on both sides.
    pub fn of(rows: Vec<Change>) -> Result<Self> {
        let count = |is_one: fn(&Change) -> bool| rows.iter().filter(|row| is_one(row)).count();
        let compared = count(|row| row.old.is_some() && row.new.is_some());
        let [only_old, only_new] = [count(|row| row.new.is_none()), count(|row| row.old.is_none())];
        if compared == 0 {
            let what = "nothing to compare: no row of the same scene, rays, engine and threads is on both sides";
            return Err(Error::Usage(format!("{what} (only old: {only_old}, only new: {only_new})")));
        }
        let [faster, slower] = [count(|row| row.verdict == "faster"), count(|row| row.verdict == "slower")];
        Ok(Self { compared, faster, slower, only_old, only_new, rows })
    }
}

/// Every row of either side.
pub fn compare(old: &[Turn], new: &[Turn]) -> Vec<Change> {
    let keys: BTreeSet<&Key> = old.iter().chain(new).flat_map(|turn| turn.figures.keys()).collect();
    let turns = interleaved(old, new);
    let find = |turns: &'_ [Turn], key: &Key| -> Vec<Figure> {
        turns.iter().filter_map(|turn| turn.figures.get(key)).cloned().collect()
    };
    // A turn that lacks a row on one side (wrong hits have no figure) must not pair the others with their neighbours.
    let pairs = |key: &Key| -> (Vec<Figure>, Vec<Figure>) {
        let of_turn = |(old, new): (&Turn, &Turn)| Some((old.figures.get(key)?.clone(), new.figures.get(key)?.clone()));
        old.iter().zip(new).filter_map(of_turn).unzip()
    };
    let one = |key: &Key| match pairs(key) {
        (old, new) if turns && old.len() >= MIN_TURNS => change(key, &old, &new, true),
        _ => change(key, &find(old, key), &find(new, key), false),
    };
    keys.into_iter().map(one).collect()
}

/// Whether the runs took turns: as many on either side, and each pair began before the next.
fn interleaved(old: &[Turn], new: &[Turn]) -> bool {
    let pairs: Vec<[&str; 2]> = old.iter().zip(new).map(|(a, b)| [a.date.as_str(), b.date.as_str()]).collect();
    let in_order = pairs.windows(2).all(|w| w[0].iter().max() <= w[1].iter().min());
    old.len() == new.len() && old.len() >= MIN_TURNS && in_order
}

fn change(key: &Key, old: &[Figure], new: &[Figure], turns: bool) -> Change {
    let [_, class, query, engine, precision, ..] = key.clone();
    let scene = old.iter().chain(new).next().map_or(String::new(), |f| f.scene.clone());
    let mut change = Change {
        scene,
        class,
        query,
        engine,
        precision,
        old: old.first().map(|f| f.mrays),
        new: new.first().map(|f| f.mrays),
        factor: None,
        interval: None,
        margin: None,
        basis: None,
        verdict: if new.is_empty() { "only old" } else { "only new" },
    };
    if old.is_empty() || new.is_empty() {
        return change;
    }
    // `scalar` itself has the ratio 1 in every run: only its rate can tell.
    let ratios = change.engine != "scalar";
    let passes = old.iter().chain(new).all(|f| !f.rates.is_empty());
    let (estimate, margin, basis) = match turns && passes {
        true => {
            let every = |side: &[Figure]| side.iter().all(|f| !f.ratios.is_empty());
            let by_ratio = ratios && every(old) && every(new);
            let samples = |f: &Figure| if by_ratio { f.ratios.clone() } else { f.rates.clone() };
            let pairs: Vec<_> = new.iter().zip(old).map(|(n, o)| (samples(n), samples(o))).collect();
            (ratio_over_turns(&pairs), MARGIN, "turns")
        }
        false => single(pooled(old), pooled(new), ratios),
    };
    if let Some(Estimate { value, interval }) = estimate {
        change.verdict = interval.verdict(margin).name();
        (change.factor, change.interval) = (Some(value), Some(interval));
        (change.margin, change.basis) = (Some(margin), Some(basis));
    }
    change
}

/// All passes of one side as if of one run.
fn pooled(figures: &[Figure]) -> Figure {
    let mut all = figures[0].clone();
    for figure in &figures[1..] {
        all.rates.extend(&figure.rates);
        all.ratios.extend(&figure.ratios);
    }
    all
}

/// Two runs that were not interleaved with each other.
fn single(old: Figure, new: Figure, may_use_ratios: bool) -> (Option<Estimate>, f64, &'static str) {
    let both = old.ratio.zip(new.ratio).filter(|_| may_use_ratios);
    let (basis, margin) = if both.is_some() { ("ratios to scalar", DRIFT) } else { ("rates", DRIFT_OF_RATES) };
    let [samples_old, samples_new] = if both.is_some() { [&old.ratios, &new.ratios] } else { [&old.rates, &new.rates] };
    if !samples_old.is_empty() && !samples_new.is_empty() {
        return (ratio_of_medians(samples_new, samples_old), margin, basis);
    }
    let (before, after) = both.unwrap_or((old.mrays, new.mrays));
    let value = if before > 0.0 { after / before } else { f64::INFINITY };
    let noise = 1.0 + SIGMAS * old.error.hypot(new.error);
    (Some(Estimate { value, interval: Interval { low: value / noise, high: value * noise } }), margin, basis)
}

/// The comparison for people.
pub fn table(comparison: &Comparison) -> String {
    let changes = &comparison.rows;
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.2}"));
    let width = changes.iter().map(|c| c.engine.len()).max().unwrap_or(0).max(6);
    let mut text = String::new();
    let mut scene = None;
    for c in changes {
        if scene != Some(&c.scene) {
            scene = Some(&c.scene);
            let _infallible = writeln!(
                text,
                "{}\n  {:<8} {:<7} {:<width$} {:<3} {:>9} {:>9} {:>8} {:>17} {:>7}  verdict",
                c.scene, "rays", "query", "engine", "", "old", "new", "factor", "interval", "margin"
            );
        }
        let factor = c.factor.map_or("-".into(), |f| format!("{f:.3}"));
        let interval = c.interval.map_or("-".into(), |i| format!("{:.3} to {:.3}", i.low, i.high));
        let margin = c.margin.map_or("-".into(), |m| format!("{:.0} %", 100.0 * m));
        let _infallible = writeln!(
            text,
            "  {:<8} {:<7} {:<width$} {:<3} {:>9} {:>9} {factor:>8} {interval:>17} {margin:>7}  {}",
            c.class,
            c.query,
            c.engine,
            c.precision,
            number(c.old),
            number(c.new),
            c.verdict
        );
    }
    text.push_str(&summary(comparison));
    text.push_str(LEGEND);
    text
}

/// The line of counts.
fn summary(comparison: &Comparison) -> String {
    let Comparison { compared, faster, slower, only_old, only_new, .. } = *comparison;
    let nothing = if faster + slower == 0 { "; no difference seen" } else { "" };
    let left_out = [(only_old, "old"), (only_new, "new")].map(|(count, side)| match count {
        0 => String::new(),
        _ => format!("; {count} only {side}"),
    });
    format!("{compared} rows compared: {faster} faster, {slower} slower{nothing}{}\n", left_out.concat())
}

const LEGEND: &str = "old, new: million rays per second, median; factor: new over old, of the ratios to `scalar` of the same rounds where\n\
     both runs have them; interval: 95 % bootstrap; a row is faster or slower if its whole interval is beyond the margin:\n\
     1 % for runs that took turns (bench --against), 2 % between two single runs, 33 % where only rates can be compared.\n";

#[cfg(test)]
mod tests;
