//! Result files: the timed rows of one run, and the runs of a folder.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::measure::command::{settings, words};

/// Largest file that is read.
const MAX_BYTES: u64 = 64 << 20;

/// Most runs in a folder.
const MAX_TURNS: usize = 1000;

/// What a row is about. Shape: scene hash (with the number of the scene among those of one hash, from the second on, and with what the
/// command says of camera, seed and scene: [`settings`]), class, query, engine or peer with its mode, precision, threads, rays.
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
    /// Relative standard error of the median, from the median absolute deviation.
    pub error: f64,
    /// Million rays per second of every pass; empty in files of older versions.
    pub rates: Vec<f64>,
    /// Times as fast as `scalar` in the same round, for every pass; empty where `scalar` was not timed, or its passes are not
    /// known.
    pub ratios: Vec<f64>,
}

/// The timed rows of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Turn {
    /// When it began, as in its rows; empty if there is none.
    pub date: String,
    /// The rows.
    pub figures: BTreeMap<Key, Figure>,
}

/// Reads `path`: a `bench.csv`, a folder that holds one, or a folder of such folders: one run (turn) each, in the order of their
/// names.
///
/// # Errors
/// Unreadable files; with line and column: rows that are not CSV, columns that are missing, cells that are no numbers,
/// two rows about the same thing.
pub fn read(path: &Path) -> Result<Vec<Turn>> {
    if !path.is_dir() {
        return Ok(vec![read_file(path)?]);
    }
    let own = path.join("bench.csv");
    if own.exists() {
        return Ok(vec![read_file(&own)?]);
    }
    let entries = std::fs::read_dir(path).map_err(|e| Error::io(path, e))?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path().join("bench.csv")));
    let mut files: Vec<PathBuf> = files.filter(|file| file.exists()).take(MAX_TURNS + 1).collect();
    files.sort();
    if files.is_empty() || files.len() > MAX_TURNS {
        let found = files.len();
        let what = format!("expected a bench.csv, or 1 to {MAX_TURNS} folders that hold one, found {found}");
        return Err(Error::whole(path, what));
    }
    files.iter().map(|file| read_file(file)).collect()
}

fn read_file(path: &Path) -> Result<Turn> {
    let size = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.len();
    if size > MAX_BYTES {
        return Err(Error::whole(path, format!("expected at most {MAX_BYTES} bytes of results, found {size}")));
    }
    parse(path, &std::fs::read(path).map_err(|e| Error::io(path, e))?)
}

/// Columns by name.
struct Columns<'a> {
    path: &'a Path,
    header: &'a csv::StringRecord,
}

impl Columns<'_> {
    fn find(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h == name)
    }

    fn need(&self, name: &str) -> Result<usize> {
        let what = || format!("expected a column `{name}`, as `bench -o` writes it");
        self.find(name).ok_or_else(|| Error::at_line(self.path, 1, 1, what()))
    }

    /// The number `text` in column `i` of a row at `line`.
    fn number(&self, i: usize, text: &str, line: u64) -> Result<f64> {
        let value = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
        let expected = || format!("expected a number in `{}`, found `{}`", &self.header[i], text.escape_debug());
        value.ok_or_else(|| Error::at_line(self.path, line, 1, expected()))
    }
}

/// Names of a run's scenes by hash: files of one content are scenes of one hash, each with its rows.
#[derive(Default)]
struct Scenes(HashMap<String, Vec<String>>);

impl Scenes {
    /// `hash`, with a number behind it if `name` is not the first scene that has it. Not with the name: a file that was renamed between
    /// two runs is the same scene.
    fn hash_of(&mut self, hash: &str, name: &str) -> String {
        let names = self.0.entry(hash.into()).or_default();
        let at = names.iter().position(|known| known == name).unwrap_or(names.len());
        if at == names.len() {
            names.push(name.into());
        }
        if at == 0 { hash.into() } else { format!("{hash} {}", at + 1) }
    }
}

/// [`read`] of one file in memory; `path` is only for messages.
///
/// # Errors
/// With line and column, as [`read`].
pub fn parse(path: &Path, text: &[u8]) -> Result<Turn> {
    let mut reader = csv::Reader::from_reader(text);
    let wrong = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Error::at_line(path, line, 1, format!("expected a row of results: {e}"))
    };
    let header = reader.headers().map_err(wrong)?.clone();
    let columns = Columns { path, header: &header };
    let mut keys = [0; KEY_COLUMNS.len()];
    for (to, name) in keys.iter_mut().zip(KEY_COLUMNS) {
        *to = columns.need(name)?;
    }
    let needed = ["status", "scene", "repeat", "median_mrays_per_s", "mad_seconds", "ratio_to_scalar"];
    let mut places = [0; 6];
    for (to, name) in places.iter_mut().zip(needed) {
        *to = columns.need(name)?;
    }
    let [status, scene, repeat, mrays, mad, ratio] = places;
    let [date, seconds, command] = ["date", "seconds", "command"].map(|name| columns.find(name));
    let mut turn = Turn::default();
    let mut scenes = Scenes::default();
    for record in reader.records() {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(1, csv::Position::line);
        let cell = |i: usize| record.get(i).unwrap_or_default();
        if turn.date.is_empty() {
            turn.date = date.map_or("", cell).into();
        }
        // Scenes without a timed row count, too: the numbers of the others must not hang on what was timed.
        let numbered = scenes.hash_of(cell(keys[0]), cell(scene));
        if cell(status) != "ok" {
            continue;
        }
        let number = |i: usize| columns.number(i, cell(i), line);
        let rays = number(keys[7])?;
        let mut passes = Vec::new();
        if let Some(i) = seconds {
            for word in cell(i).split_ascii_whitespace() {
                passes.push(columns.number(i, word, line)?);
            }
        }
        let rate = |seconds: &f64| rays / seconds.max(f64::MIN_POSITIVE) / 1e6;
        let figure = Figure {
            scene: cell(scene).into(),
            mrays: number(mrays)?,
            ratio: if cell(ratio).is_empty() { None } else { Some(number(ratio)?) },
            error: 1.2533 * 1.4826 * number(mad)? * number(mrays)? * 1e6
                / rays.max(1.0)
                / number(repeat)?.max(1.0).sqrt(),
            rates: passes.iter().map(rate).collect(),
            ratios: Vec::new(),
        };
        let [_, class, query, engine, mode, precision, threads, rays] = keys.map(|i| cell(i).to_string());
        let engine = if mode.is_empty() { engine } else { format!("{engine} [{mode}]") };
        let numbered = [numbered, settings(&words(command.map_or("", cell)))].join(" ").trim_end().to_string();
        if turn.figures.insert([numbered, class, query, engine, precision, threads, rays], figure).is_some() {
            return Err(Error::at_line(path, line, 1, "a second row about the same rays and engine"));
        }
    }
    add_ratios(&mut turn.figures);
    Ok(turn)
}

/// Fills in the ratios to `scalar`, round by round.
fn add_ratios(figures: &mut BTreeMap<Key, Figure>) {
    let same_rays = |key: &Key| -> Key {
        let mut key = key.clone();
        key[3].clear();
        key
    };
    let scalars: HashMap<Key, Vec<f64>> = figures
        .iter()
        .filter(|(key, _)| key[3] == "scalar")
        .map(|(key, f)| (same_rays(key), f.rates.clone()))
        .collect();
    for (key, figure) in figures.iter_mut() {
        let scalar = scalars.get(&same_rays(key)).filter(|rates| rates.len() == figure.rates.len());
        figure.ratios = scalar.map_or(Vec::new(), |s| figure.rates.iter().zip(s).map(|(x, s)| x / s).collect());
    }
}
