//! How rates change with the number of threads, of primitives and of rays in the same picture, and with the size of leaves.

use std::collections::{BTreeMap, BTreeSet};

use maud::Markup;

use super::collect::{Found, Row};
use super::figures::{Section, figure, made, table, with_interval};
use super::plot::{Line, Places, lines};
use crate::measure::intervals::Estimate;

/// What stays the same within any figure.
const SAME: [&str; 8] = ["scene", "class", "precision", "preset", "settings", "cpu", "isa", "machine"];

/// A way a scene can grow.
struct Axis {
    /// The column that grows.
    column: &'static str,
    /// Its name on the plot.
    unit: &'static str,
    /// What stays the same within a figure, besides [`SAME`]; the title tells the last of it.
    same: &'static [&'static str],
    /// Fewest different values that make a figure.
    least: usize,
    places: Places,
}

fn axes() -> [Axis; 4] {
    [
        Axis {
            column: "threads",
            unit: "threads",
            same: &["scene_hash", "set", "leaf", "rays"],
            least: 2,
            places: Places::Linear,
        },
        Axis {
            column: "prims",
            unit: "primitives",
            // Parameters make scenes grow: see `parameters`.
            same: &["threads", "leaf", "rays"],
            least: 3,
            places: Places::Logarithmic,
        },
        Axis {
            column: "rays",
            unit: "rays",
            same: &["scene_hash", "set", "leaf", "threads"],
            least: 3,
            places: Places::Logarithmic,
        },
        Axis {
            column: "leaf",
            unit: "primitives in a leaf at most",
            same: &["scene_hash", "set", "rays", "threads"],
            least: 2,
            places: Places::Linear,
        },
    ]
}

/// Scaling figures, where rows allow some.
pub fn section(found: &Found) -> Option<Section> {
    let figures = axes().iter().flat_map(|axis| of_axis(found, axis)).collect();
    let about = "Million rays per second over what grows. The points of a figure are of one machine, build and revision, and of one \
                 run or experiment or of a day's runs in folders beside each other: the newest that has enough of them.";
    Section::of_figures("scaling", "Scaling", about, figures)
}

fn of_axis(found: &Found, axis: &Axis) -> Vec<Markup> {
    let mut groups: BTreeMap<Vec<String>, Vec<&Row>> = BTreeMap::new();
    let placed = |row: &&Row| row.is_timed() && row.is_quoted() && row.number(axis.column).is_some();
    for row in found.rows.iter().filter(placed) {
        let same: Vec<String> = SAME.iter().chain(axis.same).map(|column| row.text(column).into()).collect();
        // Where primitives grow, `set` may be what makes them; elsewhere it is among the columns.
        let others = if axis.column == "prims" { parameters(row.text("set")) } else { vec![Vec::new()] };
        for other in others {
            groups.entry([&same[..], &other[..]].concat()).or_default().push(row);
        }
    }
    groups.into_values().filter_map(|rows| one(found, axis, &together(found, axis, rows)?)).collect()
}

/// For every parameter in `set` its name and what all others are: a figure may be about its growth, not about that of two at once.
fn parameters(set: &str) -> Vec<Vec<String>> {
    let all: Vec<&str> = set.split(", ").collect();
    let one = |(i, parameter): (usize, &&str)| {
        let name = parameter.split('=').next().unwrap_or_default();
        [&[name][..], &all[..i], &all[i + 1..]].concat().into_iter().map(String::from).collect()
    };
    all.iter().enumerate().map(one).collect()
}

/// Of `rows`, those that were measured together and make a figure: of one revision and one run, else of one sitting; the newest.
/// A later revision, or the machine's mood on another day, must not look like growth.
fn together<'a>(found: &Found, axis: &Axis, rows: Vec<&'a Row>) -> Option<Vec<&'a Row>> {
    let enough =
        |rows: &Vec<&Row>| rows.iter().map(|row| row.text(axis.column)).collect::<BTreeSet<_>>().len() >= axis.least;
    let mut sittings: BTreeMap<(&str, &str), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let sitting = found.runs.get(row.run).map_or("", |run| run.sitting.as_str());
        sittings.entry((sitting, row.text("revision"))).or_default().push(row);
    }
    let last = |rows: &Vec<&Row>| rows.last().map(|row| row.run);
    let newest = sittings.into_values().filter(enough).max_by_key(last)?;
    let mut runs = newest.chunk_by(|a, b| a.run == b.run).map(<[&Row]>::to_vec);
    Some(runs.rfind(enough).unwrap_or(newest))
}

fn one(found: &Found, axis: &Axis, rows: &[&Row]) -> Option<Markup> {
    // By engine, then by place; a later run of the same sitting replaces an earlier one.
    let mut series: BTreeMap<String, BTreeMap<u64, (Estimate, &Row)>> = BTreeMap::new();
    for row in rows {
        if let (Some(x), Some(rate)) = (row.number(axis.column), row.rate()) {
            series.entry(row.text("engine").into()).or_default().insert(x as u64, (rate, row));
        }
    }
    let drawn: Vec<Line> = series
        .iter()
        .map(|(engine, points)| Line {
            label: engine.clone(),
            points: points.iter().map(|(x, (rate, _))| (*x as f64, *rate)).collect(),
        })
        .collect();
    let used: Vec<&Row> = series.values().flat_map(|points| points.values().map(|(_, row)| *row)).collect();
    let body: Vec<Vec<String>> = series
        .iter()
        .flat_map(|(engine, points)| {
            let first = points.values().next().map(|(rate, _)| rate.value);
            points.iter().map(move |(x, (rate, _))| {
                let relative = first.map_or("-".into(), |first| format!("{:.2}", rate.value / first));
                vec![engine.clone(), x.to_string(), with_interval(Some(*rate), 2), relative]
            })
        })
        .collect();
    let head = ["engine", axis.unit, "Mrays/s (95 %)", "over the first"];
    let (first, last) = (rows.first()?, axis.same.last()?);
    let [scene, class, precision, last_value] = ["scene", "class", "precision", last].map(|column| first.text(column));
    // The parameter that makes primitives grow differs from point to point; the others belong into the title.
    let grown = if axis.column == "prims" { "set" } else { axis.column };
    let kept = first.text("set").split(", ").filter(|kept| grown == "set" && !kept.is_empty());
    let kept = kept.filter(|kept| rows.iter().all(|row| row.text("set").split(", ").any(|other| other == *kept)));
    let made = kept.fold(made(first, grown), |made, kept| format!("{made}, {kept}"));
    let title = format!(
        "{scene}, {class} rays over {} ({precision}, {last}: {last_value}{made}){}",
        axis.unit,
        found.on(first)
    );
    let plot = lines(&drawn, &axis.places, axis.unit, "million rays per second");
    Some(figure(&title, plot, &table(&head, &body), &used))
}

#[cfg(test)]
mod tests {
    use super::super::collect::samples::{SAMPLE, Sample, found, told};
    use super::*;

    const ONE: Sample = SAMPLE;
    const TWO: Sample = Sample { threads: 2, rate: 18.0, ..SAMPLE };
    const LATER: &str = "bbbbbbbbbbbb";

    /// The figures of `files`: titles and lines.
    fn of(files: &[(&str, u32, &[Sample])]) -> (Vec<String>, Vec<String>) {
        section(&found(files)).map_or_else(Default::default, |section| told(&section.body.into_string()))
    }

    /// The last cells of the lines: how many times the first.
    fn factors(lines: &[String]) -> Vec<&str> {
        lines.iter().filter_map(|line| line.rsplit('|').next()).collect()
    }

    #[test]
    fn threads_of_one_run_one_experiment_or_one_day_make_a_figure() {
        let title = "box, primary rays over threads (f32, rays: 1000)";
        let together: [&[(&str, u32, &[Sample])]; 3] = [
            &[("a", 0, &[ONE, TWO])],
            // The second step was measured after midnight.
            &[("e/CASE-t1/primary", 0, &[ONE]), ("e/CASE-t2/primary", 0, &[Sample { day: "2026-01-02", ..TWO }])],
            &[("x/2026-01-01-aaaaaaa/box", 0, &[ONE]), ("x/2026-01-01-aaaaaaa/two", 0, &[TWO])],
        ];
        for files in together {
            let (titles, lines) = of(files);
            assert_eq!((titles, factors(&lines)), (vec![title.to_string()], vec!["1.00", "1.80"]), "{lines:?}");
        }
    }

    #[test]
    fn threads_of_other_builds_trees_revisions_days_and_machines_make_none() {
        let others = [
            Sample { isa: "avx2", ..TWO },
            Sample { revision: LATER, ..TWO },
            Sample { day: "2026-01-02", ..TWO },
            Sample { command: " --preset fast", ..TWO },
            Sample { command: " --leaf 4", ..TWO },
            Sample { command: " --set size=3", ..TWO },
            Sample { command: " --fov 30", ..TWO },
            Sample { command: " --top part", ..TWO },
        ];
        for other in others {
            let what = format!("{} {} {} {}", other.isa, other.revision, other.day, other.command);
            assert!(of(&[("a", 0, &[ONE]), ("b", 0, &[other])]).0.is_empty(), "{what}");
        }
        assert!(of(&[("a", 17, &[ONE]), ("b", 2, &[TWO])]).0.is_empty(), "models");
        let (zen4, zen5) = ("zen4/2026-01-01-aaaaaaa/box", "zen5/2026-01-01-aaaaaaa/box");
        assert!(of(&[(zen4, 0, &[ONE]), (zen5, 0, &[TWO])]).0.is_empty(), "folders");
    }

    #[test]
    fn the_newest_run_with_enough_points_is_shown() {
        let (one, two) = (Sample { revision: LATER, day: "2026-01-02", ..ONE }, Sample { rate: 15.0, ..TWO });
        // A later revision has one point only, and would double the first rate.
        let (_, lines) = of(&[("a", 0, &[ONE, two]), ("b", 0, &[Sample { rate: 20.0, ..one }])]);
        assert_eq!(factors(&lines), ["1.00", "1.50"], "{lines:?}");
        let two = Sample { threads: 2, rate: 19.0, ..one };
        let (_, lines) = of(&[("a", 0, &[ONE, TWO]), ("b", 0, &[one, two])]);
        assert_eq!(factors(&lines), ["1.00", "1.90"], "{lines:?}");
    }

    #[test]
    fn primitives_grow_by_one_parameter_and_the_others_stay() {
        let sized = |prims, rate, command| Sample { prims, rate, command, ..SAMPLE };
        let rows = [
            sized(10, 8.0, " --set lake=0 --set size=1"),
            sized(20, 4.0, " --set lake=0 --set size=2"),
            sized(30, 2.0, " --set lake=0 --set size=3"),
            sized(15, 16.0, " --set lake=1 --set size=1"),
            sized(25, 20.0, " --set lake=1 --set size=2"),
        ];
        let (titles, lines) = of(&[("a", 0, &rows)]);
        assert_eq!(titles, ["box, primary rays over primitives (f32, rays: 1000, lake=0)"]);
        assert_eq!(factors(&lines), ["1.00", "0.50", "0.25"], "{lines:?}");
        let fast = [&rows[..2], &[sized(30, 2.0, " --preset fast --set lake=0 --set size=3")]];
        assert!(of(&[("a", 0, fast[0]), ("b", 0, fast[1])]).0.is_empty());
    }
}
