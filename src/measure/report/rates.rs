//! Rates, limits and accuracy: what the newest run of every scene says.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::collect::{Found, Row};
use super::figures::{Section, figure, made, number, percent, table, with_interval};
use super::plot::{Bar, bars};
use crate::measure::intervals::{Estimate, Interval};

/// What distinguishes one figure from another.
const FIGURE: [&str; 12] = [
    "scene",
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
    "scene_hash",
];

/// Rows of each figure: of every scene, setting and machine, and every ray class, those of the newest run, in written order.
fn newest(found: &Found) -> Vec<(String, Vec<&Row>)> {
    let mut groups: BTreeMap<[String; 12], Vec<&Row>> = BTreeMap::new();
    for row in &found.rows {
        groups.entry(row.key(FIGURE)).or_default().push(row);
    }
    let figures = groups.into_iter().map(|(key, rows)| {
        let mut last: BTreeMap<&str, usize> = BTreeMap::new();
        for row in &rows {
            let run = last.entry(row.text("class")).or_default();
            *run = row.run.max(*run);
        }
        let is_last = |row: &&Row| row.is_quoted() && last.get(row.text("class")) == Some(&row.run);
        let rows: Vec<&Row> = rows.iter().copied().filter(is_last).collect();
        let [scene, precision, threads, rays, ..] = key;
        let prims = rows.first().map_or("", |row| row.text("prims"));
        let plural = if threads == "1" { "" } else { "s" };
        let (made, on) = rows.first().map_or_else(Default::default, |row| (made(row, ""), found.on(row)));
        let how = format!("{rays} rays, {precision}, {threads} thread{plural}{made}{on}");
        (format!("{scene}: {prims} primitives, {how}"), rows)
    });
    figures.collect()
}

/// The row of `scalar` on the same rays.
fn scalar<'a>(rows: &[&'a Row], row: &Row) -> Option<&'a Row> {
    let same = |other: &&&Row| other.text("engine") == "scalar" && other.text("class") == row.text("class");
    rows.iter().filter(|other| other.is_timed() && other.run == row.run).find(same).copied()
}

/// Rates with error bars, ratios to `scalar` and to peers.
pub fn section(found: &Found) -> Option<Section> {
    let figures = newest(found).into_iter().filter_map(|(title, rows)| rates(&title, &rows)).collect();
    let about = "Million rays per second: the median over interleaved rounds with its 95 % bootstrap interval. Ratios are pass by \
                 pass, so that what disturbs the machine cancels. Rows without passes (of older versions) show intervals from the \
                 median absolute deviation.";
    Section::of_figures("rates", "Rates", about, figures)
}

fn rates(title: &str, rows: &[&Row]) -> Option<Markup> {
    let timed: Vec<&Row> = rows.iter().copied().filter(|row| row.is_timed()).collect();
    let mut series: Vec<String> = Vec::new();
    let mut plotted = Vec::new();
    for row in &timed {
        let engine = row.text("engine").to_string();
        let index = series.iter().position(|name| *name == engine).unwrap_or_else(|| {
            series.push(engine.clone());
            series.len() - 1
        });
        if let Some(value) = row.rate() {
            plotted.push(Bar { label: row.engine(), group: row.text("class").into(), value, series: index });
        }
    }
    let cells = |row: &&Row| {
        let ratio = scalar(&timed, row).and_then(|scalar| row.ratio_to(scalar));
        let stored = row.number("ratio_to_scalar");
        vec![
            row.text("class").to_string(),
            row.engine(),
            with_interval(row.rate(), 2),
            number(row.number("best_mrays_per_s"), 2),
            percent(row.number("spread")),
            ratio.map_or_else(|| number(stored, 2), |_| with_interval(ratio, 2)),
            number(row.number("ours_over_peer"), 2),
            percent(row.number("node_lane_use")),
            percent(row.number("prim_lane_use")),
            number(row.number("build_seconds"), 3),
            number(row.number("bytes").map(|b| b / f64::from(1 << 20)), 1),
        ]
    };
    let head = [
        "rays",
        "engine",
        "Mrays/s (95 %)",
        "best",
        "spread",
        "times scalar",
        "ours / peer",
        "node lanes",
        "primitive lanes",
        "build s",
        "MiB",
    ];
    let body: Vec<Vec<String>> = timed.iter().map(cells).collect();
    (!timed.is_empty()).then(|| figure(title, bars(&plotted, "million rays per second"), &table(&head, &body), &timed))
}

/// Achieved against the limit of counted work, where rows have one.
pub fn limits(found: &Found) -> Option<Section> {
    let share = |row: &Row| row.number("percent_of_limit").map(|p| p / 100.0);
    let mut figures = Vec::new();
    for (title, rows) in newest(found) {
        let rows: Vec<&Row> = rows.into_iter().filter(|row| row.is_timed() && share(row).is_some()).collect();
        let exact = |value: f64| Estimate { value, interval: Interval { low: value, high: value } };
        let bar = |row: &&Row| {
            let value = exact(100.0 * share(row)?);
            Some(Bar { label: row.engine(), group: row.text("class").into(), value, series: 0 })
        };
        let cells = |row: &&Row| {
            let limit = row.number("median_mrays_per_s").zip(share(row)).map(|(rate, share)| rate / share);
            let rate = number(row.number("median_mrays_per_s"), 2);
            vec![row.text("class").into(), row.engine(), rate, number(limit, 1), percent(share(row))]
        };
        if !rows.is_empty() {
            let plot = bars(&rows.iter().filter_map(bar).collect::<Vec<_>>(), "per cent of the limit");
            let body: Vec<Vec<String>> = rows.iter().map(cells).collect();
            let head = ["rays", "engine", "Mrays/s", "limit Mrays/s", "of the limit"];
            figures.push(figure(&title, plot, &table(&head, &body), &rows));
        }
    }
    let about = "Counted box and triangle tests times what single tests took in the same run, in full vectors over data in the \
                 first cache, give the rate at which the machine could do just these tests and nothing else. An engine that \
                 makes fewer tests has a higher limit; docs/METHODOLOGY.md says what the limit is not. Scenes of triangles only.";
    Section::of_figures("limits", "Achieved against the limit", about, figures)
}

/// Who answered what: hits, ties, differences, and rows without figures with their reason.
pub fn accuracy(found: &Found) -> Option<Section> {
    let mut figures = Vec::new();
    for (title, rows) in newest(found) {
        let cells = |row: &&Row| {
            let scalar = scalar(&rows, row).map(|scalar| scalar.text("checksum"));
            let same = match scalar {
                _ if !row.is_timed() => "-",
                Some(sum) if sum == row.text("checksum") => "yes",
                Some(_) => "no",
                None => "-",
            };
            let [class, hits, ties, differences, status] =
                ["class", "hits", "ties", "differences", "status"].map(|column| row.text(column).to_string());
            vec![class, row.engine(), hits, ties, differences, same.into(), status]
        };
        let body: Vec<Vec<String>> = rows.iter().map(cells).collect();
        let head = ["rays", "engine", "hits", "ties", "different", "bits of scalar", "status"];
        figures.push(figure(&title, None, &table(&head, &body), &rows));
    }
    let body = html! {
        p {
            "Every engine's hits are checked before the clock starts. Ties are rays with scalar's distance and another \
             primitive (shared edges, coincident surfaces); different ones must be explained by the f64 oracle, or there is \
             no figure."
        }
        @for figure in &figures { (figure) }
    };
    Some(Section { id: "accuracy", title: "Accuracy", figures: figures.len(), pairs: 0, body })
        .filter(|s| s.figures > 0)
}

#[cfg(test)]
mod tests {
    use super::super::collect::samples::{SAMPLE, Sample, found, told};
    use super::*;

    #[test]
    fn machines_and_builds_have_figures_of_their_own() {
        let later = Sample { day: "2026-01-02", rate: 20.0, ..SAMPLE };
        let narrow = Sample { isa: "avx2", rate: 5.0, ..later };
        let found = found(&[("a", 17, &[SAMPLE]), ("b", 17, &[later]), ("c", 2, &[SAMPLE]), ("d", 17, &[narrow])]);
        let (titles, lines) = told(&section(&found).unwrap().body.into_string());
        let title = |on: &str| format!("box: 12 primitives, 1000 rays, f32, 1 thread on A CPU (family 25, model {on}");
        assert_eq!(titles, ["17) built for avx2", "17) built for avx512", "2) built for avx512"].map(title));
        // Of each the newest run.
        let rates: Vec<&str> = lines.iter().filter_map(|line| line.split(['|', '(']).nth(2)).collect();
        assert_eq!(rates, ["5.00 ", "20.00 ", "10.00 "], "{lines:?}");
    }
}
