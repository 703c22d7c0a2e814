//! What each thread adds: the same rays on 1, 2, 4, ... threads in one run, as a table for people.

use std::fmt::Write as _;

use crate::measure::rows::{Outcome, Row};

/// One line per ray class and engine that has rows of several numbers of threads: the median rate of each number and its efficiency.
/// Empty if there are none.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::new();
    let measured = |row: &&Row| row.efficiency.is_some();
    let mut counts: Vec<usize> = rows.iter().filter(measured).map(|row| row.threads).collect();
    counts.sort_unstable();
    counts.dedup();
    // Two scenes may have one hash (the same file under two names), but never one name.
    let key = |row: &Row| (row.class, row.engine, row.precision);
    let same = |a: &Row, b: &Row| key(a) == key(b) && (&a.scene.hash, &a.scene.name) == (&b.scene.hash, &b.scene.name);
    let most = counts.last().copied().unwrap_or(0);
    let width = rows.iter().map(|row| row.engine.len()).max().unwrap_or(0).max("engine".len());
    let mut scene = None;
    for last in rows.iter().filter(measured).filter(|row| row.threads == most) {
        if scene != Some(&last.scene.name) {
            scene = Some(&last.scene.name);
            let _infallible =
                write!(text, "{} on several threads\n  {:<8} {:<width$}", last.scene.name, "rays", "engine");
            counts.iter().for_each(|n| text.push_str(&format!(" {n:>9} {:>7}", "each")));
            text.push('\n');
        }
        let _infallible = write!(text, "  {:<8} {:<width$}", last.class, last.engine);
        for &threads in &counts {
            let row = rows.iter().find(|row| row.threads == threads && row.efficiency.is_some() && same(row, last));
            let (rate, each) = match row.map(|row| (row, &row.outcome, row.efficiency)) {
                Some((row, Outcome::Timed { seconds, .. }, Some(each))) => {
                    (format!("{:.2}", row.mrays(seconds.median)), format!("{:.0}%", 100.0 * each))
                }
                _ => ("-".into(), "-".into()),
            };
            let _infallible = write!(text, " {rate:>9} {each:>7}");
        }
        text.push('\n');
    }
    if !text.is_empty() {
        text.push_str(LEGEND);
    }
    text
}

/// How to read [`table`].
const LEGEND: &str = "a number of threads: million rays per second, median; each: times as fast as one thread, pass by pass, per thread.\n";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::rows::SceneFacts;
    use crate::measure::stats::summary;

    fn row(engine: &'static str, threads: usize, seconds: f64, efficiency: Option<f64>) -> Row {
        Row {
            scene: SceneFacts { name: "box".into(), ..Default::default() },
            class: "primary",
            query: "closest",
            engine,
            precision: "f32",
            threads,
            rays: 3_000_000,
            ties: 0,
            differences: 0,
            efficiency,
            peer: None,
            outcome: Outcome::Timed {
                seconds: summary(&[seconds]).unwrap(),
                repeat: 1,
                passes: vec![seconds],
                hits: 0,
                checksum: 0,
                ratio: None,
                node_lane_use: None,
                prim_lane_use: None,
                percent_of_limit: None,
            },
        }
    }

    #[test]
    fn a_line_per_engine_and_a_column_per_number_of_threads() {
        let rows = [
            row("scalar", 2, 1.5, Some(1.0)),
            row("tile", 2, 0.5, Some(0.75)),
            row("scalar", 1, 3.0, Some(1.0)),
            row("tile", 1, 0.75, Some(1.0)),
            row("stream", 2, 1.0, Some(1.0)),
            Row { outcome: Outcome::Wrong("1 ray".into()), ..row("stream", 1, 0.0, None) },
            row("embree", 2, 1.0, None),
        ];
        let text = table(&rows);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[0], ["box", "on", "several", "threads"]);
        assert_eq!(lines[1], ["rays", "engine", "1", "each", "2", "each"]);
        assert_eq!(lines[2], ["primary", "scalar", "1.00", "100%", "2.00", "100%"]);
        assert_eq!(lines[3], ["primary", "tile", "4.00", "100%", "6.00", "75%"]);
        assert_eq!(lines[4], ["primary", "stream", "-", "-", "3.00", "100%"]);
        assert_eq!(lines.len(), 6, "{text}");
        assert_eq!(table(&[row("tile", 2, 0.5, None)]), "");
    }

    #[test]
    fn scenes_of_one_hash_have_rates_of_their_own() {
        let named = |name: &str, threads, seconds| {
            let scene = SceneFacts { name: name.into(), hash: "00ff".into(), ..Default::default() };
            Row { scene, ..row("scalar", threads, seconds, Some(1.0)) }
        };
        let rows = [named("m", 2, 1.5), named("m", 1, 3.0), named("m-2", 2, 0.5), named("m-2", 1, 1.0)];
        let text = table(&rows);
        let rates: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| line.contains("scalar"))
            .map(|line| line.split_whitespace().skip(2).step_by(2).collect())
            .collect();
        assert_eq!(rates, [["1.00", "2.00"], ["3.00", "6.00"]], "{text}");
    }
}
