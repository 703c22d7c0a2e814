//! Figures in a text: a table of rates between two marks, made anew from the newest rows.
//!
//! A block begins with a comment that says what to show and ends with `<!-- end of figures -->`:
//!
//! ```text
//! <!-- figures
//! scenes: sponza_crytek as Sponza, conference as Conference
//! engines: scalar, packet16, tile
//! peer: embree as Embree
//! threads: 1
//! -->
//! ```
//!
//! `scenes` and `engines` are required, `threads` is 1 and `precision` f32 unless said otherwise; with `isa`, only rows of builds
//! for it count. What stands between the
//! comments is replaced.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use super::collect::{Found, Row};
use crate::error::{Error, Result};

const BEGIN: &str = "<!-- figures";
const CLOSE: &str = "-->";
const END: &str = "<!-- end of figures -->";

const KEYS: [&str; 6] = ["scenes", "engines", "peer", "threads", "precision", "isa"];

/// Longest line of prose.
const COLUMNS: usize = 120;

/// A name in the rows and the one people see.
struct Named {
    name: String,
    shown: String,
}

/// What a block shows.
struct Wanted {
    scenes: Vec<Named>,
    engines: Vec<Named>,
    peer: Option<Named>,
    threads: String,
    precision: String,
    isa: Option<String>,
}

/// One class of rays in one scene: the rows of the engines, in order, and of the peer's quoted mode.
struct Cell<'a> {
    engines: Vec<&'a Row>,
    peer: Option<&'a Row>,
}

/// `text` (of `file`) with all its blocks made anew, and their number.
///
/// # Errors
/// No block; a block without end, with an unknown or missing key, or without rows that hold what it asks for; with the line.
pub fn fill(text: &str, file: &Path, found: &Found) -> Result<(String, usize)> {
    let (mut made, mut blocks) = (String::new(), 0);
    let mut lines = (1u64..).zip(text.split_inclusive('\n'));
    while let Some((at, line)) = lines.next() {
        made.push_str(line);
        if line.trim_end() != BEGIN {
            continue;
        }
        let mut settings = Vec::new();
        loop {
            let Some((number, line)) = lines.next() else {
                return Err(Error::at_line(file, at, 1, format!("expected `{CLOSE}` below `{BEGIN}`")));
            };
            made.push_str(line);
            match line.trim() {
                CLOSE => break,
                line => settings.push((number, line)),
            }
        }
        if !lines.any(|(_, line)| line.trim_end() == END) {
            return Err(Error::at_line(file, at, 1, format!("expected `{END}` below `{BEGIN}`")));
        }
        let wanted = Wanted::read(&settings).map_err(|(n, what)| Error::at_line(file, n.unwrap_or(at), 1, what))?;
        made.push_str(&wanted.block(found).map_err(|what| Error::at_line(file, at, 1, what))?);
        let _infallible = writeln!(made, "{END}");
        blocks += 1;
    }
    if blocks == 0 {
        return Err(Error::whole(file, format!("expected a line `{BEGIN}` where figures shall be")));
    }
    Ok((made, blocks))
}

type Fault = (Option<u64>, String);

impl Wanted {
    fn read(settings: &[(u64, &str)]) -> std::result::Result<Self, Fault> {
        let mut values = KEYS.map(|_| None);
        for &(number, line) in settings {
            let known =
                line.split_once(':').and_then(|(k, v)| Some((KEYS.iter().position(|key| *key == k)?, v.trim())));
            let Some((key, value)) = known.filter(|(_, value)| !value.is_empty()) else {
                return Err((Some(number), format!("expected one of {}, a colon and a value", KEYS.join(", "))));
            };
            if values[key].replace(value).is_some() {
                return Err((Some(number), format!("`{}` is given twice", KEYS[key])));
            }
        }
        let [scenes, engines, peer, threads, precision, isa] = values;
        let required = |value: Option<&str>, key: &str| value.map(names).ok_or((None, format!("expected `{key}:`")));
        Ok(Self {
            scenes: required(scenes, "scenes")?,
            engines: required(engines, "engines")?,
            peer: peer.and_then(|value| names(value).pop()),
            threads: threads.unwrap_or("1").into(),
            precision: precision.unwrap_or("f32").into(),
            isa: isa.map(String::from),
        })
    }

    /// Of `scene` and `classes`, for each the newest run that has them all with figures; of all runs those that have the settings (the
    /// camera) of the newest: a line below the other must not be of another picture.
    fn cells<'a>(&self, found: &'a Found, scene: &str, classes: &[&str]) -> Vec<Option<Cell<'a>>> {
        let runs = || (0..found.runs.len()).rev();
        let newest = runs().find_map(|run| classes.iter().find_map(|class| self.cell(found, run, scene, class, None)));
        let settings = newest.map(|cell| cell.engines[0].text("settings"));
        let cell = |class: &&str| runs().find_map(|run| self.cell(found, run, scene, class, settings));
        classes.iter().map(cell).collect()
    }

    /// Of `scene` and `class`, what `run` has, if it has them all with figures and has these settings, should they matter.
    fn cell<'a>(
        &self,
        found: &'a Found,
        run: usize,
        scene: &str,
        class: &str,
        settings: Option<&str>,
    ) -> Option<Cell<'a>> {
        let fits = |row: &&Row| {
            row.is_timed()
                && row.is_quoted()
                && [("scene", scene), ("class", class), ("threads", &self.threads), ("precision", &self.precision)]
                    .iter()
                    .all(|(column, value)| row.text(column) == *value)
                && self.isa.as_deref().is_none_or(|isa| row.text("isa") == isa)
                && ["", "balanced"].contains(&row.text("preset"))
                && ["", "8"].contains(&row.text("leaf"))
                && !row.text("settings").ends_with("--apart")
                && settings.is_none_or(|settings| row.text("settings") == settings)
        };
        let rows = found.rows_of(run);
        let of = |name: &str| rows.iter().filter(fits).find(|row| row.text("engine") == name);
        let engines = self.engines.iter().map(|engine| of(&engine.name)).collect::<Option<Vec<_>>>()?;
        let peer = self.peer.as_ref().map(|peer| of(&peer.name).ok_or(())).transpose().ok()?;
        Some(Cell { engines, peer })
    }

    /// What stands between the marks, with empty lines around.
    fn block(&self, found: &Found) -> std::result::Result<String, String> {
        let mut classes: Vec<&str> = Vec::new();
        for row in &found.rows {
            if !classes.contains(&row.text("class")) && self.scenes.iter().any(|scene| scene.name == row.text("scene"))
            {
                classes.push(row.text("class"));
            }
        }
        let mut lines: Vec<(&str, Vec<Option<Cell>>)> = classes.iter().map(|class| (*class, Vec::new())).collect();
        for scene in &self.scenes {
            let cells = self.cells(found, &scene.name, &classes);
            lines.iter_mut().zip(cells).for_each(|((_, line), cell)| line.push(cell));
        }
        // Classes that some scene has.
        lines.retain(|(_, cells)| cells.iter().any(Option::is_some));
        for (i, scene) in self.scenes.iter().enumerate() {
            if lines.iter().all(|(_, cells)| cells[i].is_none()) {
                return Err(format!(
                    "expected a run of {} with all of {}{} ({}, threads: {})",
                    scene.name,
                    self.engines.iter().map(|engine| engine.name.as_str()).collect::<Vec<_>>().join(", "),
                    self.peer.as_ref().map_or(String::new(), |peer| format!(" and {}", peer.name)),
                    self.precision,
                    self.threads
                ));
            }
        }
        Ok(format!("\n{}\n{}\n", self.about(&lines), self.table(&lines)))
    }

    /// The sentences above the table.
    fn about(&self, lines: &[(&str, Vec<Option<Cell>>)]) -> String {
        let rows: Vec<&Row> =
            lines.iter().flat_map(|(_, cells)| cells).flatten().flat_map(|c| &c.engines).copied().collect();
        let all = |column: &str| {
            let values: BTreeSet<&str> = rows.iter().map(|row| row.text(column)).collect();
            values.into_iter().map(grouped).collect::<Vec<_>>().join(" or ")
        };
        // Cells are of the newest run of each; a CPU's name does not say whether all are of one machine.
        let machines: BTreeSet<[&str; 2]> = rows.iter().map(|row| [row.text("cpu"), row.text("machine")]).collect();
        let cpus = if machines.len() > 1 {
            let told = |[cpu, machine]: &[&str; 2]| match *machine {
                "" => cpu.to_string(),
                machine => format!("{cpu} ({machine})"),
            };
            machines.iter().map(told).collect::<Vec<_>>().join(" or ")
        } else {
            all("cpu")
        };
        let threads = if self.threads == "1" { "One thread".into() } else { format!("{} threads", self.threads) };
        let mut text = format!(
            "{threads} of {cpus}, built for {}; {} rays of each class in {}; million rays per second, medians of {} interleaved rounds",
            all("isa"),
            all("rays"),
            self.precision,
            all("repeat")
        );
        if let Some(peer) = &self.peer {
            let _infallible = write!(
                text,
                ". In brackets: how many times as fast the fastest engine shown is as {}'s best mode for the class, pass by pass in \
                 the same run ({})",
                peer.shown,
                self.version(lines)
            );
        }
        text.push('.');
        for (i, scene) in self.scenes.iter().enumerate() {
            let own = lines.iter().filter_map(|(_, cells)| cells[i].as_ref()).flat_map(|cell| &cell.engines);
            let mut runs: Vec<String> = Vec::new();
            let mut prims = "";
            for row in own {
                prims = row.text("prims");
                let (day, revision) = (row.text("date").get(..10).unwrap_or_default(), row.text("revision"));
                let run = format!("`{revision}` of {day}");
                if !runs.contains(&run) {
                    runs.push(run);
                }
            }
            let _infallible =
                write!(text, " {}: {} primitives, revision {}.", scene.shown, grouped(prims), runs.join(" and "));
        }
        wrapped(&text)
    }

    /// How the peers of all rows describe themselves, up to the first comma.
    fn version(&self, lines: &[(&str, Vec<Option<Cell>>)]) -> String {
        let peers = lines.iter().flat_map(|(_, cells)| cells).flatten().filter_map(|cell| cell.peer);
        let versions: BTreeSet<&str> =
            peers.map(|row| row.text("peer_description").split(',').next().unwrap_or_default()).collect();
        versions.into_iter().collect::<Vec<_>>().join(" or ")
    }

    fn table(&self, lines: &[(&str, Vec<Option<Cell>>)]) -> String {
        let mut head = "| rays |".to_string();
        for scene in &self.scenes {
            for (i, engine) in self.engines.iter().enumerate() {
                let scene = if i == 0 { format!("{} ", scene.shown) } else { String::new() };
                let _infallible = write!(head, " {scene}`{}` |", engine.shown);
            }
        }
        let columns = self.scenes.len() * self.engines.len();
        let mut text = format!("{head}\n|---|{}\n", "---|".repeat(columns));
        for (class, cells) in lines {
            let _infallible = write!(text, "| {class} |");
            for cell in cells {
                match cell {
                    Some(cell) => cell.figures().iter().for_each(|figure| _ = write!(text, " {figure} |")),
                    None => text.push_str(&" |".repeat(self.engines.len())),
                }
            }
            text.push('\n');
        }
        text
    }
}

impl Cell<'_> {
    /// Rates, with the ratio to the peer beside the highest.
    fn figures(&self) -> Vec<String> {
        let rates: Vec<f64> = self.engines.iter().map(|row| row.number("median_mrays_per_s").unwrap_or(0.0)).collect();
        let best = (0..rates.len()).max_by(|&a, &b| rates[a].total_cmp(&rates[b]));
        let ratio = best.zip(self.peer).and_then(|(best, peer)| self.engines[best].ratio_to(peer));
        let figure = |(i, rate): (usize, &f64)| match ratio {
            Some(ratio) if best == Some(i) => format!("{rate:.1} ({:.2}x)", ratio.value),
            _ => format!("{rate:.1}"),
        };
        rates.iter().enumerate().map(figure).collect()
    }
}

/// `a as b, c`: names with what is shown for them.
fn names(list: &str) -> Vec<Named> {
    let named = |word: &str| {
        let (name, shown) = word.split_once(" as ").unwrap_or((word, word));
        Named { name: name.trim().into(), shown: shown.trim().into() }
    };
    list.split(',').map(named).collect()
}

/// Digits of a whole number in groups of three; anything else as it is.
fn grouped(text: &str) -> String {
    if text.len() < 5 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return text.into();
    }
    let mut grouped = String::new();
    for (i, digit) in text.chars().enumerate() {
        if i > 0 && (text.len() - i).is_multiple_of(3) {
            grouped.push(' ');
        }
        grouped.push(digit);
    }
    grouped
}

/// Words in lines of at most [`COLUMNS`] characters (longer words stay whole).
fn wrapped(text: &str) -> String {
    let (mut lines, mut width) = (String::new(), 0);
    for word in text.split_ascii_whitespace() {
        let long = word.chars().count();
        if width > 0 && width + 1 + long > COLUMNS {
            lines.push('\n');
            width = 0;
        } else if width > 0 {
            lines.push(' ');
            width += 1;
        }
        lines.push_str(word);
        width += long;
    }
    lines.push('\n');
    lines
}

#[cfg(test)]
mod tests {
    use super::super::collect::samples::{SAMPLE, Sample, found};
    use super::*;

    #[test]
    fn a_table_is_of_one_camera_and_of_joined_meshes() {
        let text = "<!-- figures\nscenes: box\nengines: tile\n-->\n<!-- end of figures -->\n";
        let (eye, other) = (" --eye 1,2,3", Sample { command: " --eye 3,2,1", rate: 20.0, ..SAMPLE });
        let made = |files: &[(&str, u32, &[Sample])]| fill(text, Path::new("README.md"), &found(files)).unwrap().0;
        // The newest has one class only; the other class is of a run that has its camera.
        let of = |class, rate, day| Sample { command: eye, class, rate, day, ..SAMPLE };
        let table = made(&[
            ("a", 0, &[of("ao", 30.0, "2026-01-01")]),
            ("b", 0, &[Sample { class: "ao", day: "2026-01-02", ..other }]),
            ("c", 0, &[of("primary", 40.0, "2026-01-03")]),
            ("d", 0, &[Sample { command: " --eye 1,2,3 --apart", ..of("primary", 50.0, "2026-01-04") }]),
        ]);
        assert!(table.contains("| ao | 30.0 |") && table.contains("| primary | 40.0 |"), "{table}");
    }

    #[test]
    fn machines_whose_cpus_have_one_name_are_told_apart() {
        let text = "<!-- figures\nscenes: box\nengines: tile\n-->\n<!-- end of figures -->\n";
        let made = |models: [u32; 2]| {
            let found = found(&[("a", models[0], &[SAMPLE]), ("b", models[1], &[Sample { class: "ao", ..SAMPLE }])]);
            fill(text, Path::new("README.md"), &found).unwrap().0.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let two = "One thread of A CPU (family 25, model 17) or A CPU (family 25, model 2), built for avx512;";
        assert!(made([17, 2]).contains(two), "{}", made([17, 2]));
        assert!(made([17, 17]).contains("One thread of A CPU, built for avx512;"), "{}", made([17, 17]));
    }
}
