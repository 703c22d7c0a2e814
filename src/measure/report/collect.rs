//! What a folder of results holds: rows, facts about machines, pictures.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::film::picture;
use crate::measure::intervals::{Estimate, Interval, median_estimate, paired_ratio};

/// Largest file of rows.
const MAX_BYTES: u64 = 64 << 20;
/// Most files of rows, and most pictures.
const MAX_FILES: usize = 4096;
/// Deepest folder.
const MAX_DEPTH: usize = 12;
/// Most rows.
const MAX_ROWS: usize = 200_000;

/// All that was found.
#[derive(Debug, Default)]
pub struct Found {
    /// Result files, oldest first.
    pub runs: Vec<Run>,
    /// Rows of all runs, in the order of runs.
    pub rows: Vec<Row>,
    /// Pictures, by path.
    pub pictures: Vec<PathBuf>,
}

/// One result file.
#[derive(Debug)]
pub struct Run {
    /// Where it lies, seen from the folder.
    pub place: String,
    /// When it began.
    pub date: String,
    /// Lines of the file of facts beside it, name and value.
    pub facts: Vec<(String, String)>,
}

/// One row, by column. Besides the file's columns there are `preset`, `leaf` and `set`: what its command says of them, empty
/// if it says nothing.
#[derive(Debug)]
pub struct Row {
    /// Which of the runs.
    pub run: usize,
    cells: BTreeMap<String, String>,
}

impl Row {
    /// The text in a column; empty where the file has none.
    pub fn text(&self, column: &str) -> &str {
        self.cells.get(column).map_or("", String::as_str)
    }

    /// The number in a column, if there is one.
    pub fn number(&self, column: &str) -> Option<f64> {
        self.text(column).parse().ok().filter(|x: &f64| x.is_finite())
    }

    /// Whether it has figures.
    pub fn is_timed(&self) -> bool {
        self.text("status") == "ok" && self.number("median_mrays_per_s").is_some()
    }

    /// The engine, or the peer with its mode.
    pub fn engine(&self) -> String {
        let (engine, mode) = (self.text("engine"), self.text("peer_mode"));
        if mode.is_empty() { engine.into() } else { format!("{engine} [{mode}]") }
    }

    /// Whether this is one of our engines, or the fastest mode of a peer.
    pub fn is_quoted(&self) -> bool {
        self.text("quoted") != "false"
    }

    /// Several columns as one key.
    pub fn key<const N: usize>(&self, columns: [&str; N]) -> [String; N] {
        columns.map(|column| self.text(column).to_string())
    }

    /// Seconds of every pass; empty in files of older versions.
    fn passes(&self) -> Vec<f64> {
        let words = self.text("seconds").split_ascii_whitespace();
        words.filter_map(|word| word.parse().ok().filter(|s: &f64| s.is_finite() && *s > 0.0)).collect()
    }

    /// Million rays per second, median with its interval (from the median absolute deviation where single passes are not known).
    pub fn rate(&self) -> Option<Estimate> {
        let (value, rays) = (self.number("median_mrays_per_s")?, self.number("rays")?);
        let rates: Vec<f64> = self.passes().iter().map(|s| rays / s / 1e6).collect();
        if let Some(estimate) = median_estimate(&rates) {
            return Some(Estimate { value, ..estimate });
        }
        let (mad, repeat) = (self.number("mad_seconds")?, self.number("repeat")?.max(1.0));
        // See `measure::compare` for the factors; 1.96 standard errors are 95 %.
        let error = 1.96 * 1.2533 * 1.4826 * mad * value * 1e6 / rays.max(1.0) / repeat.sqrt();
        Some(Estimate { value, interval: Interval { low: value / (1.0 + error), high: value * (1.0 + error) } })
    }

    /// Times as fast as `other` in the same rounds, with its interval.
    pub fn ratio_to(&self, other: &Row) -> Option<Estimate> {
        let (own, other) = (self.passes(), other.passes());
        if own.len() == other.len() { paired_ratio(&other, &own) } else { None }
    }
}

/// Reads all results and notes all pictures below `folder`.
///
/// # Errors
/// As [`super::html`].
pub fn collect(folder: &Path) -> Result<Found> {
    let (mut tables, mut pictures) = (Vec::new(), Vec::new());
    walk(folder, 0, &mut tables, &mut pictures)?;
    if tables.is_empty() {
        return Err(Error::whole(folder, "expected a bench.csv, as `bench -o` writes it, here or in a folder below"));
    }
    let mut files = tables.iter().map(|path| Ok((path, read(path)?))).collect::<Result<Vec<_>>>()?;
    files.sort_by(|(a, ra), (b, rb)| {
        let date = |rows: &[BTreeMap<String, String>]| rows.first().and_then(|r| r.get("date").cloned());
        date(ra).cmp(&date(rb)).then_with(|| a.cmp(b))
    });
    let mut found = Found { pictures, ..Default::default() };
    for (path, rows) in files {
        let run = found.runs.len();
        let place =
            path.parent().and_then(|p| p.strip_prefix(folder).ok()).map_or(".".into(), |p| p.display().to_string());
        let place = if place.is_empty() { ".".into() } else { place };
        let date = rows.first().and_then(|row| row.get("date")).cloned().unwrap_or_default();
        found.runs.push(Run { place, date, facts: facts(&path.with_file_name("bench.env.txt")) });
        found.rows.extend(rows.into_iter().map(|cells| Row { run, cells: with_options(cells) }));
        if found.rows.len() > MAX_ROWS {
            return Err(Error::whole(folder, format!("expected at most {MAX_ROWS} rows of results")));
        }
    }
    Ok(found)
}

/// Adds what the command says.
fn with_options(mut cells: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let command = cells.get("command").cloned().unwrap_or_default();
    for name in ["preset", "leaf"] {
        cells.insert(name.into(), options(&command, name).last().copied().unwrap_or_default().into());
    }
    cells.insert("set".into(), options(&command, "set").join(", "));
    cells
}

/// The values of `--name` in a command.
fn options<'a>(command: &'a str, name: &str) -> Vec<&'a str> {
    let (mut words, mut values) = (command.split_ascii_whitespace(), Vec::new());
    while let Some(word) = words.next() {
        match word.strip_prefix("--").and_then(|word| word.strip_prefix(name)) {
            Some("") => values.extend(words.next()),
            Some(rest) => values.extend(rest.strip_prefix('=')),
            None => {}
        }
    }
    values
}

fn walk(folder: &Path, depth: usize, tables: &mut Vec<PathBuf>, pictures: &mut Vec<PathBuf>) -> Result<()> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    for path in paths {
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if hidden || path.is_symlink() {
            continue;
        }
        if path.is_dir() {
            if depth < MAX_DEPTH {
                walk(&path, depth + 1, tables, pictures)?;
            }
        } else if path.file_name().is_some_and(|name| name == "bench.csv") {
            tables.push(path);
        } else if picture::is_named(&path) && path.extension().is_some_and(|e| e != "npy") {
            pictures.push(path);
        }
        if tables.len() > MAX_FILES || pictures.len() > MAX_FILES {
            return Err(Error::whole(folder, format!("expected at most {MAX_FILES} files of results")));
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<BTreeMap<String, String>>> {
    let size = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.len();
    if size > MAX_BYTES {
        return Err(Error::whole(path, format!("expected at most {MAX_BYTES} bytes of results, found {size}")));
    }
    let text = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let mut reader = csv::Reader::from_reader(&text[..]);
    let wrong = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Error::at_line(path, line, 1, format!("expected a row of results: {e}"))
    };
    let header = reader.headers().map_err(wrong)?.clone();
    if let Some(missing) =
        ["scene", "class", "engine", "status"].iter().find(|name| !header.iter().any(|h| h == **name))
    {
        return Err(Error::at_line(path, 1, 1, format!("expected a column `{missing}`, as `bench -o` writes it")));
    }
    let row = |record: csv::StringRecord| header.iter().zip(&record).map(|(h, cell)| (h.into(), cell.into())).collect();
    reader.records().map(|record| record.map(row).map_err(wrong)).collect()
}

/// Lines `name: value`; none if there is no such file.
fn facts(path: &Path) -> Vec<(String, String)> {
    let small = std::fs::metadata(path).is_ok_and(|meta| meta.is_file() && meta.len() < 1 << 20);
    let text = if small { std::fs::read_to_string(path).unwrap_or_default() } else { String::new() };
    text.lines().filter_map(|line| line.split_once(": ")).map(|(n, v)| (n.to_string(), v.to_string())).collect()
}
