//! Two result files side by side: what moved, and whether that is more than noise.
//!
//! Every row of a bench run has a median over interleaved rounds and the median absolute deviation of those rounds.
//! The standard error of a median of n normal samples is about 1.2533 sigma / sqrt(n), and 1.4826 times the deviation
//! estimates sigma (Huber, Ronchetti, "Robust Statistics", 2009). Two runs were not interleaved with each other, so the
//! speed of the machine may have changed between them; where both runs timed `scalar`, ratios to it are compared, and
//! that change cancels.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Standard errors that a difference must exceed.
const SIGMAS: f64 = 3.0;

/// Relative difference that runs of the same binary show beside the rounds' own scatter: caches, pages, placement.
const DRIFT: f64 = 0.02;

/// The same for rates, which move with the load of the machine: nothing cancels.
const DRIFT_OF_RATES: f64 = 0.33;

/// Largest file that is read.
const MAX_BYTES: u64 = 64 << 20;

/// What a row is about. Shape: scene hash, class, query, engine or peer with its mode, precision, threads, rays.
pub type Key = [String; 7];

const KEY_COLUMNS: [&str; 8] = ["scene_hash", "class", "query", "engine", "peer_mode", "precision", "threads", "rays"];

/// One timed row.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Scene name, for people.
    pub scene: String,
    /// Million rays per second, median.
    pub mrays: f64,
    /// Times as fast as `scalar` in the same run.
    pub ratio: Option<f64>,
    /// Relative standard error of the median.
    pub error: f64,
}

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
    /// Million rays per second before.
    pub old: Option<f64>,
    /// Million rays per second now.
    pub new: Option<f64>,
    /// New over old: of the ratios to `scalar` where both have one, else of the rates.
    pub factor: Option<f64>,
    /// Relative difference that noise explains.
    pub noise: Option<f64>,
    /// `faster`, `slower`, `no difference seen`, `only old` or `only new`.
    pub verdict: &'static str,
}

/// Reads the timed rows of `path`: a `bench.csv`, or a folder that holds one.
///
/// # Errors
/// Unreadable files; with line and column: rows that are not CSV, columns that are missing, cells that are no numbers,
/// two rows about the same thing.
pub fn read(path: &Path) -> Result<BTreeMap<Key, Figure>> {
    let path = if path.is_dir() { path.join("bench.csv") } else { PathBuf::from(path) };
    let size = std::fs::metadata(&path).map_err(|e| Error::io(&path, e))?.len();
    if size > MAX_BYTES {
        return Err(Error::whole(&path, format!("expected at most {MAX_BYTES} bytes of results, found {size}")));
    }
    let text = std::fs::read(&path).map_err(|e| Error::io(&path, e))?;
    parse(&path, &text)
}

fn parse(path: &Path, text: &[u8]) -> Result<BTreeMap<Key, Figure>> {
    let mut reader = csv::Reader::from_reader(text);
    let wrong = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Error::at_line(path, line, 1, format!("expected a row of results: {e}"))
    };
    let header = reader.headers().map_err(wrong)?.clone();
    let column = |name: &str| {
        let found = header.iter().position(|h| h == name);
        found.ok_or_else(|| Error::at_line(path, 1, 1, format!("expected a column `{name}`, as `bench -o` writes it")))
    };
    let mut keys = [0; KEY_COLUMNS.len()];
    for (to, name) in keys.iter_mut().zip(KEY_COLUMNS) {
        *to = column(name)?;
    }
    let [status, scene, repeat, mrays] = ["status", "scene", "repeat", "median_mrays_per_s"].map(column);
    let (status, scene, repeat, mrays) = (status?, scene?, repeat?, mrays?);
    let (mad, ratio) = (column("mad_seconds")?, column("ratio_to_scalar")?);
    let mut figures = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(1, csv::Position::line);
        let cell = |i: usize| record.get(i).unwrap_or_default();
        if cell(status) != "ok" {
            continue;
        }
        let number = |i: usize| {
            let value = cell(i).parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
            let expected = || format!("expected a number in `{}`, found `{}`", &header[i], cell(i));
            value.ok_or_else(|| Error::at_line(path, line, 1, expected()))
        };
        let rays = number(keys[7])?;
        let figure = Figure {
            scene: cell(scene).into(),
            mrays: number(mrays)?,
            ratio: if cell(ratio).is_empty() { None } else { Some(number(ratio)?) },
            error: 1.2533 * 1.4826 * number(mad)? * number(mrays)? * 1e6
                / rays.max(1.0)
                / number(repeat)?.max(1.0).sqrt(),
        };
        let [hash, class, query, engine, mode, precision, threads, rays] = keys.map(|i| cell(i).to_string());
        let engine = if mode.is_empty() { engine } else { format!("{engine} [{mode}]") };
        if figures.insert([hash, class, query, engine, precision, threads, rays], figure).is_some() {
            return Err(Error::at_line(path, line, 1, "a second row about the same rays and engine"));
        }
    }
    Ok(figures)
}

/// Every row of either run.
pub fn compare(old: &BTreeMap<Key, Figure>, new: &BTreeMap<Key, Figure>) -> Vec<Change> {
    let keys: std::collections::BTreeSet<&Key> = old.keys().chain(new.keys()).collect();
    keys.into_iter().map(|key| change(key, old.get(key), new.get(key))).collect()
}

fn change(key: &Key, old: Option<&Figure>, new: Option<&Figure>) -> Change {
    let [_, class, query, engine, precision, ..] = key.clone();
    let scene = old.or(new).map_or(String::new(), |f| f.scene.clone());
    let mut change = Change {
        scene,
        class,
        query,
        engine,
        precision,
        old: old.map(|f| f.mrays),
        new: new.map(|f| f.mrays),
        factor: None,
        noise: None,
        verdict: if old.is_some() { "only old" } else { "only new" },
    };
    if let (Some(old), Some(new)) = (old, new) {
        // `scalar` itself has the ratio 1 in every run: only its rate can tell.
        let ratios = old.ratio.zip(new.ratio).filter(|_| change.engine != "scalar");
        let (before, after) = ratios.unwrap_or((old.mrays, new.mrays));
        let factor = if before > 0.0 { after / before } else { f64::INFINITY };
        let drift = if ratios.is_some() { DRIFT } else { DRIFT_OF_RATES };
        let noise = drift + SIGMAS * old.error.hypot(new.error);
        change.verdict = match factor {
            f if f > 1.0 + noise => "faster",
            f if f < 1.0 / (1.0 + noise) => "slower",
            _ => "no difference seen",
        };
        (change.factor, change.noise) = (Some(factor), Some(noise));
    }
    change
}

/// The changes for people.
pub fn table(changes: &[Change]) -> String {
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.2}"));
    let width = changes.iter().map(|c| c.engine.len()).max().unwrap_or(0).max(6);
    let mut text = String::new();
    let mut scene = None;
    for c in changes {
        if scene != Some(&c.scene) {
            scene = Some(&c.scene);
            let _infallible = writeln!(
                text,
                "{}\n  {:<8} {:<7} {:<width$} {:<3} {:>9} {:>9} {:>8} {:>8}  verdict",
                c.scene, "rays", "query", "engine", "", "old", "new", "factor", "noise"
            );
        }
        let noise = c.noise.map_or("-".into(), |n| format!("{:.1} %", 100.0 * n));
        let factor = c.factor.map_or("-".into(), |f| format!("{f:.3}"));
        let _infallible = writeln!(
            text,
            "  {:<8} {:<7} {:<width$} {:<3} {:>9} {:>9} {factor:>8} {noise:>8}  {}",
            c.class,
            c.query,
            c.engine,
            c.precision,
            number(c.old),
            number(c.new),
            c.verdict
        );
    }
    text.push_str(
        "old, new: million rays per second, median; factor: new over old, of the ratios to `scalar` where both runs have\n\
         them; noise: three standard errors of both medians, and 2 % (rates: 33 %) for what differs between two runs.\n",
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "threads,scene,scene_hash,class,query,engine,precision,rays,status,repeat,median_mrays_per_s,\
        mad_seconds,ratio_to_scalar,peer_mode\n";

    fn parsed(rows: &str) -> Result<BTreeMap<Key, Figure>> {
        parse(Path::new("a.csv"), format!("{HEADER}{rows}").as_bytes())
    }

    fn row(engine: &str, mrays: f64, mad: f64, ratio: &str) -> String {
        format!("1,box,abc,primary,closest,{engine},f32,1000000,ok,9,{mrays},{mad},{ratio},\n")
    }

    /// A million rays at 2 Mrays/s take 0.5 s; 0.001 s deviation over 9 rounds: 1.2533 1.4826 0.001 / 0.5 / 3.
    #[test]
    fn errors_by_hand() {
        let figures = parsed(&row("tile", 2.0, 0.001, "3")).unwrap();
        let figure = figures.values().next().unwrap();
        assert!((figure.error - 1.2533 * 1.4826 * 0.001 / 0.5 / 3.0).abs() < 1e-12, "{figure:?}");
        assert_eq!((figure.mrays, figure.ratio), (2.0, Some(3.0)));
    }

    #[test]
    fn what_moved_and_what_did_not() {
        let old = row("scalar", 2.0, 0.0, "1") + &row("tile", 20.0, 0.0, "10") + &row("gone", 1.0, 0.0, "0.5");
        // The machine became half as fast; tile gained a tenth on top, packet is new.
        let new = row("scalar", 1.0, 0.0, "1") + &row("tile", 11.0, 0.0, "11") + &row("packet", 4.0, 0.0, "4");
        let changes = compare(&parsed(&old).unwrap(), &parsed(&new).unwrap());
        let of = |engine: &str| changes.iter().find(|c| c.engine == engine).unwrap();
        assert_eq!((of("tile").verdict, of("tile").factor), ("faster", Some(1.1)));
        assert_eq!(
            (of("scalar").verdict, of("gone").verdict, of("packet").verdict),
            ("slower", "only old", "only new")
        );
        let text = table(&changes);
        assert!(text.contains("1.100    2.0 %  faster"), "{text}");
    }

    #[test]
    fn noise_is_no_difference() {
        let (old, new) = (row("tile", 20.0, 0.002, "10"), row("tile", 21.0, 0.002, "10.5"));
        let changes = compare(&parsed(&old).unwrap(), &parsed(&new).unwrap());
        assert_eq!(changes[0].verdict, "no difference seen", "{changes:?}");
        assert_eq!(compare(&parsed(&old).unwrap(), &parsed(&old).unwrap())[0].verdict, "no difference seen");
    }

    #[test]
    fn faults_say_where() {
        let text = |result: Result<BTreeMap<Key, Figure>>| result.unwrap_err().to_string();
        assert!(text(parse(Path::new("a.csv"), b"threads,scene\n")).contains("`scene_hash`"));
        let word = text(parsed(&row("tile", 1.0, 0.0, "1").replace("ok,9", "ok,nine")));
        assert!(word.contains("a.csv:2:") && word.contains("`nine`"), "{word}");
        let short = text(parsed("1,box\n"));
        assert!(short.contains("a.csv:2:"), "{short}");
        let twice = row("tile", 1.0, 0.0, "1").repeat(2);
        assert!(text(parsed(&twice)).contains("a.csv:3:"));
        assert!(parsed("1,box,abc,primary,closest,brute,f32,1,skipped: why,,,,,\n").unwrap().is_empty());
    }
}
