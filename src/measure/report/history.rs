//! How figures changed over revisions.

use std::collections::{BTreeMap, BTreeSet};

use maud::Markup;

use super::collect::{Found, Row};
use super::figures::{Section, figure, made, table, with_interval};
use super::plot::{Line, Places, lines};
use crate::measure::intervals::{Estimate, Interval};

/// What must be the same for two rows to be about the same thing.
const SAME: [&str; 13] = [
    "scene",
    "scene_hash",
    "class",
    "precision",
    "threads",
    "rays",
    "preset",
    "leaf",
    "set",
    "settings",
    "cpu",
    "isa",
    "machine",
];

/// Figures over revisions, where there are at least two.
pub fn section(found: &Found) -> Option<Section> {
    let mut groups: BTreeMap<[String; 13], Vec<&Row>> = BTreeMap::new();
    for row in found.rows.iter().filter(|row| row.is_timed() && row.is_quoted()) {
        groups.entry(row.key(SAME)).or_default().push(row);
    }
    let revisions = |rows: &[&Row]| rows.iter().map(|row| row.text("revision")).collect::<BTreeSet<_>>().len();
    groups.retain(|_, rows| revisions(rows) >= 2);
    let figures = groups.iter().map(|(key, rows)| one(found, key, rows)).collect();
    let about = "Times as fast as `scalar` of the same run, oldest revision first: the machine's mood cancels, and so would a \
                 change of `scalar` itself. The row of `scalar` shows its rate over its first.";
    Section::of_figures("history", "History", about, figures)
}

fn one(found: &Found, key: &[String; 13], rows: &[&Row]) -> Markup {
    let mut runs: Vec<usize> = rows.iter().map(|row| row.run).collect();
    runs.dedup();
    let name = |run: &usize| {
        let row = rows.iter().find(|row| row.run == *run);
        row.map_or(String::new(), |row| {
            let (day, revision) = (row.text("date").get(..10).unwrap_or_default(), row.text("revision"));
            format!("{day} {}", revision.get(..7).unwrap_or(revision))
        })
    };
    let names: Vec<String> = runs.iter().map(name).collect();
    let place = |row: &Row| runs.iter().position(|run| *run == row.run).unwrap_or(0);
    let mut series: BTreeMap<String, Vec<(usize, Estimate)>> = BTreeMap::new();
    for row in rows {
        if let Some(value) = value(rows, row) {
            series.entry(row.text("engine").into()).or_default().push((place(row), value));
        }
    }
    let drawn: Vec<Line> = series
        .iter()
        .map(|(engine, points)| Line {
            label: engine.clone(),
            points: points.iter().map(|(x, e)| (*x as f64, *e)).collect(),
        })
        .collect();
    let body: Vec<Vec<String>> = series
        .iter()
        .flat_map(|(engine, points)| {
            let names = &names;
            points.iter().map(move |(x, e)| vec![engine.clone(), names[*x].clone(), with_interval(Some(*e), 3)])
        })
        .collect();
    let [scene, _, class, precision, threads, rays, ..] = key;
    let (made, on) = rows.first().map_or_else(Default::default, |row| (made(row, ""), found.on(row)));
    let title = format!("{scene}, {class} rays ({precision}, {rays} rays, threads: {threads}{made}){on}");
    let plot = lines(&drawn, &Places::Named(names.clone()), "revision", "times scalar");
    figure(&title, plot, &table(&["engine", "revision", "times scalar (95 %)"], &body), rows)
}

/// The row's speed relative to `scalar` of its run; of `scalar` itself relative to the first run's.
fn value(rows: &[&Row], row: &Row) -> Option<Estimate> {
    let scalar = |run: usize| rows.iter().find(|r| r.run == run && r.text("engine") == "scalar").copied();
    if row.text("engine") == "scalar" {
        let first = rows.iter().find(|r| r.text("engine") == "scalar")?.rate()?.value;
        let rate = row.rate()?;
        let Interval { low, high } = rate.interval;
        return Some(Estimate {
            value: rate.value / first,
            interval: Interval { low: low / first, high: high / first },
        });
    }
    let known = row.number("ratio_to_scalar").map(|x| Estimate { value: x, interval: Interval { low: x, high: x } });
    scalar(row.run).and_then(|scalar| row.ratio_to(scalar)).or(known)
}

#[cfg(test)]
mod tests {
    use super::super::collect::samples::{SAMPLE, Sample, found, told};
    use super::*;

    const OLD: Sample = SAMPLE;
    const NEW: Sample = Sample { revision: "bbbbbbbbbbbb", day: "2026-01-02", rate: 20.0, ..SAMPLE };

    /// The figures of `files`: titles and lines.
    fn of(files: &[(&str, u32, &[Sample])]) -> (Vec<String>, Vec<String>) {
        section(&found(files)).map_or_else(Default::default, |section| told(&section.body.into_string()))
    }

    #[test]
    fn revisions_of_one_build_are_one_line() {
        let (titles, lines) = of(&[("a", 0, &[OLD]), ("b", 0, &[NEW])]);
        assert_eq!(titles, ["box, primary rays (f32, 1000 rays, threads: 1)"]);
        assert_eq!(lines.len(), 2, "{lines:?}");
    }

    #[test]
    fn other_builds_trees_and_scenes_are_no_later_revision() {
        let others = [
            Sample { isa: "avx2", ..NEW },
            Sample { command: " --preset fast", ..NEW },
            Sample { command: " --leaf 4", ..NEW },
            Sample { command: " --set size=3", ..NEW },
            Sample { command: " --eye 1,2,3", ..NEW },
            Sample { command: " --seed 2", ..NEW },
            Sample { command: " --apart", ..NEW },
        ];
        for other in others {
            let what = format!("{} {}", other.isa, other.command);
            assert!(of(&[("a", 0, &[OLD]), ("b", 0, &[other])]).0.is_empty(), "{what}");
        }
    }

    #[test]
    fn machines_whose_cpus_have_one_name_have_lines_of_their_own() {
        // By the machines' folders, as `bench --record` makes them.
        let (zen4, zen5) = ("zen4/2026-01-01-aaaaaaa/box", "zen5/2026-01-02-bbbbbbb/box");
        assert!(of(&[(zen4, 0, &[OLD]), (zen5, 0, &[NEW])]).0.is_empty());
        // By the model, in one folder, too.
        let (old, new) = ("epyc/2026-01-01-aaaaaaa/box", "epyc/2026-01-02-bbbbbbb/box");
        assert!(of(&[(old, 17, &[OLD]), (new, 2, &[NEW])]).0.is_empty());
        let later = [(zen4, 0, [OLD]), (zen5, 0, [OLD]), ("zen5/2026-01-02-bbbbbbb/box-2", 0, [NEW])];
        let (titles, lines) = of(&later.each_ref().map(|(place, model, rows)| (*place, *model, &rows[..])));
        assert_eq!(titles, ["box, primary rays (f32, 1000 rays, threads: 1) on A CPU (zen5) built for avx512"]);
        assert_eq!(lines.len(), 2, "{lines:?}");
    }
}
