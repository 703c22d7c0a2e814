//! What a folder of results holds: rows, facts about machines, pictures.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::film::picture;
use crate::measure::command::{settings, values, words};
use crate::measure::intervals::{Estimate, Interval, median_estimate, paired_ratio};

/// Largest file of rows.
const MAX_BYTES: u64 = 64 << 20;
/// Most files of rows, and most pictures.
const MAX_FILES: usize = 4096;
/// Deepest folder.
const MAX_DEPTH: usize = 12;
/// Most rows.
const MAX_ROWS: usize = 200_000;

/// Columns of numbers, where they are not empty; `seconds` holds several.
const NUMBERS: [&str; 20] = [
    "threads",
    "prims",
    "rays",
    "hits",
    "repeat",
    "best_mrays_per_s",
    "median_mrays_per_s",
    "spread",
    "mad_seconds",
    "ratio_to_scalar",
    "node_lane_use",
    "prim_lane_use",
    "percent_of_limit",
    "build_seconds",
    "bytes",
    "ties",
    "differences",
    "ours_over_peer",
    "efficiency",
    "seconds",
];

/// All that was found.
#[derive(Debug, Default)]
pub struct Found {
    /// Result files, oldest first.
    pub runs: Vec<Run>,
    /// Rows of all runs, in the order of runs.
    pub rows: Vec<Row>,
    /// Pictures, by path.
    pub pictures: Vec<PathBuf>,
    /// Whether its rows are of more than one machine or build, so that figures have to say which.
    several: bool,
}

impl Found {
    /// The rows of one run.
    pub fn rows_of(&self, run: usize) -> &[Row] {
        let first = self.rows.partition_point(|row| row.run < run);
        &self.rows[first..self.rows.partition_point(|row| row.run <= run)]
    }

    /// What the row was measured on, as the end of a title; empty if that is so of all rows.
    pub fn on(&self, row: &Row) -> String {
        if !self.several {
            return String::new();
        }
        let [cpu, isa, machine] = BUILD.map(|column| row.text(column));
        let machine = if machine.is_empty() { String::new() } else { format!(" ({machine})") };
        format!(" on {cpu}{machine} built for {isa}")
    }
}

/// Columns that must be the same for two rates to compare: a CPU's name alone does not say which machine it is.
const BUILD: [&str; 3] = ["cpu", "isa", "machine"];

/// One result file.
#[derive(Debug)]
pub struct Run {
    /// Where it lies, seen from the folder.
    pub place: String,
    /// When it began.
    pub date: String,
    /// Lines of the file of facts beside it, name and value.
    pub facts: Vec<(String, String)>,
    /// The same for runs that belong together: the steps of one experiment, or a day's runs in folders beside each other.
    pub sitting: String,
}

/// One row, by column. Besides the file's columns there are `preset`, `leaf` and `set`: what its command says of them, empty
/// if it says nothing; `settings`: see [`settings`]; and `machine`: which machine it is among those whose CPU has the same name, as far as the folder and the
/// file of facts tell.
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
        let date = rows.first().and_then(|row| row.get("date")).cloned().unwrap_or_default();
        let (facts, sitting) = (facts(&path.with_file_name("bench.env.txt")), sitting(folder, path, &date));
        let machine = machine(Path::new(&place), &facts);
        let place = if place.is_empty() { ".".into() } else { place };
        found.runs.push(Run { place, date, facts, sitting });
        found.rows.extend(rows.into_iter().map(|mut cells| {
            cells.insert("machine".into(), machine.clone());
            Row { run, cells: with_options(cells) }
        }));
        if found.rows.len() > MAX_ROWS {
            return Err(Error::whole(folder, format!("expected at most {MAX_ROWS} rows of results")));
        }
    }
    found.several =
        found.rows.iter().map(|row| BUILD.map(|column| row.text(column))).collect::<BTreeSet<_>>().len() > 1;
    Ok(found)
}

/// The folder of the machine in a history (`MACHINE/DATE-REVISION/SCENE`, as `bench --record` keeps it), and the CPU's family and
/// model: virtual machines of different kinds may call their CPU by one name.
fn machine(place: &Path, facts: &[(String, String)]) -> String {
    let words: Vec<String> = place.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let dated = words.iter().position(|word| is_dated(word)).unwrap_or(0);
    let fact = |name: &str| facts.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
    let kind = fact("cpu family").zip(fact("cpu model number"));
    let kind = kind.map(|(family, model)| format!("family {family}, model {model}"));
    let folder = Some(words[..dated].join("/")).filter(|folder| !folder.is_empty());
    folder.into_iter().chain(kind).collect::<Vec<_>>().join(", ")
}

/// Whether a folder's name begins with a day: `2026-01-31-`.
fn is_dated(name: &str) -> bool {
    let fits = |(i, c): (usize, u8)| if [4, 7, 10].contains(&i) { c == b'-' } else { c.is_ascii_digit() };
    name.len() > 10 && name.bytes().take(11).enumerate().all(fits)
}

/// See [`Run::sitting`]; `path` is the file of rows.
fn sitting(folder: &Path, path: &Path, date: &str) -> String {
    let above = |path: &Path| path.strip_prefix(folder).map_or(String::new(), |p| p.display().to_string());
    let own = path.parent().unwrap_or(folder);
    // `bench --experiment` leaves its file above its steps, each of which has a folder of its own.
    let mut inside = own.ancestors().take_while(|ancestor| ancestor.starts_with(folder));
    match inside.find(|ancestor| ancestor.join("experiment.kdl").is_file()) {
        Some(experiment) => format!("experiment {}", above(experiment)),
        None => format!("{} {}", date.get(..10).unwrap_or_default(), own.parent().map_or(String::new(), above)),
    }
}

/// Adds what the command says.
fn with_options(mut cells: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let words = words(cells.get("command").map_or("", String::as_str));
    for name in ["preset", "leaf"] {
        cells.insert(name.into(), values(&words, name).last().copied().unwrap_or_default().into());
    }
    cells.insert("set".into(), values(&words, "set").join(", "));
    cells.insert("settings".into(), settings(&words));
    cells
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
    let row = |record: std::result::Result<csv::StringRecord, csv::Error>| -> Result<BTreeMap<String, String>> {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(1, csv::Position::line);
        for (name, cell) in header.iter().zip(&record).filter(|(name, _)| NUMBERS.contains(name)) {
            // Without it the run would be shown as if there were none.
            if !cell.split_ascii_whitespace().all(|word| word.parse().is_ok_and(f64::is_finite)) {
                let what = format!("expected a number in `{name}`, found `{}`", cell.escape_debug());
                return Err(Error::at_line(path, line, 1, what));
            }
        }
        Ok(header.iter().zip(&record).map(|(h, cell)| (h.into(), cell.into())).collect())
    };
    reader.records().map(row).collect()
}

/// Lines `name: value`; none if there is no such file.
fn facts(path: &Path) -> Vec<(String, String)> {
    let small = std::fs::metadata(path).is_ok_and(|meta| meta.is_file() && meta.len() < 1 << 20);
    let text = if small { std::fs::read_to_string(path).unwrap_or_default() } else { String::new() };
    text.lines().filter_map(|line| line.split_once(": ")).map(|(n, v)| (n.to_string(), v.to_string())).collect()
}

#[cfg(test)]
pub mod samples {
    use super::*;

    const COLUMNS: &str = "revision,date,cpu,isa,threads,scene,scene_hash,prims,class,engine,precision,rays,status,\
                           median_mrays_per_s,ratio_to_scalar,mad_seconds,repeat,command";

    /// A row of `tile`; `command` is what follows the scene.
    pub struct Sample {
        pub revision: &'static str,
        pub day: &'static str,
        pub isa: &'static str,
        pub threads: u32,
        pub prims: u32,
        pub class: &'static str,
        pub rate: f64,
        pub command: &'static str,
    }

    /// One thread of an AVX-512 build.
    pub const SAMPLE: Sample = Sample {
        revision: "aaaaaaaaaaaa",
        day: "2026-01-01",
        isa: "avx512",
        threads: 1,
        prims: 12,
        class: "primary",
        rate: 10.0,
        command: "",
    };

    /// What is found where `place`s hold these rows, and files of facts that name the model of the CPU, if it is not 0. All CPUs
    /// have the same name.
    pub fn found(files: &[(&str, u32, &[Sample])]) -> Found {
        let root = tempfile::tempdir().unwrap();
        for (place, model, rows) in files {
            let folder = root.path().join(place);
            std::fs::create_dir_all(&folder).unwrap();
            let mut text = format!("{COLUMNS}\n");
            for Sample { revision, day, isa, threads, prims, class, rate, command } in *rows {
                text.push_str(&format!(
                    "{revision},{day}T00:00:00Z,A CPU,{isa},{threads},box,{prims:x},{prims},{class},tile,f32,"
                ));
                text.push_str(&format!("1000,ok,{rate},{rate},0.0,9,\"lanecast bench box{command}\"\n"));
            }
            std::fs::write(folder.join("bench.csv"), text).unwrap();
            if *model != 0 {
                let facts = format!("cpu: A CPU\ncpu family: 25\ncpu model number: {model}\n");
                std::fs::write(folder.join("bench.env.txt"), facts).unwrap();
            }
            if let Some((experiment, _)) = place.split_once("/CASE") {
                std::fs::write(root.path().join(experiment).join("experiment.kdl"), "").unwrap();
            }
        }
        collect(root.path()).unwrap()
    }

    /// Titles of figures, and the cells of each line of their tables.
    pub fn told(html: &str) -> (Vec<String>, Vec<String>) {
        let between = |text: &str, end: &str| text.split(end).next().unwrap_or_default().to_string();
        let titles = html.split("<figcaption>").skip(1).map(|text| between(text, "</figcaption>"));
        let cells = |line: &str| {
            let cells = line.split("<td").skip(1).filter_map(|cell| Some(between(cell.split_once('>')?.1, "</td>")));
            cells.collect::<Vec<_>>().join("|")
        };
        let lines =
            html.split("<tr>").skip(1).map(|line| cells(&between(line, "</tr>"))).filter(|line| !line.is_empty());
        (titles.collect(), lines.collect())
    }
}
