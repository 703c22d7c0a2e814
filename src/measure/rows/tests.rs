//! Rows as CSV, as a table and as JSON.

use super::*;
use crate::measure::stats::summary;

fn row(outcome: Outcome) -> Row {
    let scene =
        SceneFacts { name: "a, \"b\"".into(), hash: "00ff".into(), prims: 12, build_seconds: 0.25, bytes: 1 << 20 };
    Row {
        scene,
        class: "primary",
        query: "closest",
        engine: "packet4",
        precision: "f32",
        threads: 2,
        rays: 2_000_000,
        ties: 5,
        differences: 1,
        efficiency: Some(0.9),
        peer: None,
        outcome,
    }
}

fn timed() -> Row {
    row(Outcome::Timed {
        seconds: summary(&[1.0, 0.5, 1.0]).unwrap(),
        repeat: 3,
        passes: vec![1.0, 0.5, 1.0],
        hits: 7,
        checksum: 0xabc,
        ratio: Some(2.0),
        node_lane_use: Some(0.5),
        prim_lane_use: None,
        percent_of_limit: Some(12.5),
    })
}

fn run() -> Run {
    let (date, cpu, command) = ["2026-01-31T00:00:00Z", "CPU", "lanecast bench"].map(String::from).into();
    Run { date, revision: "0123456789ab", isa: "avx2", flags: "-O", rustc: "rustc 1", cpu, threads: 4, command }
}

/// Reads a CSV line by the rules of RFC 4180.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut open) = (vec![String::new()], false);
    let mut letters = line.chars().peekable();
    while let Some(c) = letters.next() {
        let last = cells.len() - 1;
        match c {
            '"' if open && letters.peek() == Some(&'"') => {
                letters.next();
                cells[last].push('"');
            }
            '"' => open = !open,
            ',' if !open => cells.push(String::new()),
            c => cells[last].push(c),
        }
    }
    cells
}

/// 2 million rays in a best pass of 0.5 s are 4 Mrays/s, in a median pass of 1 s 2; spread (1 - 0.5) / 1.
#[test]
fn every_row_fills_every_column() {
    let rows = [timed(), row(Outcome::Skipped("too, many".into())), row(Outcome::Wrong("ray 3".into()))];
    let text = csv(&run(), &rows);
    let lines: Vec<Vec<String>> = text.lines().map(cells).collect();
    assert_eq!(lines.len(), 4);
    assert!(lines.iter().all(|l| l.len() == lines[0].len()), "{text}");
    let cell = |row: usize, name: &str| {
        lines[row][lines[0].iter().position(|c| c == name).unwrap_or_else(|| panic!("no column {name}"))].clone()
    };
    assert_eq!((cell(1, "scene"), cell(1, "flags")), ("a, \"b\"".into(), "-O".into()));
    assert_eq!(cell(1, "best_mrays_per_s"), "4.0000");
    assert_eq!(cell(1, "median_mrays_per_s"), "2.0000");
    assert_eq!(cell(1, "spread"), "0.5000");
    assert_eq!(cell(1, "ratio_to_scalar"), "2.0000");
    assert_eq!(cell(1, "percent_of_limit"), "12.5000");
    assert_eq!((cell(1, "threads"), cell(1, "efficiency")), ("2".into(), "0.9000".into()));
    assert_eq!(cell(1, "checksum"), "0000000000000abc");
    assert_eq!(cell(1, "seconds"), "1.000000000 0.500000000 1.000000000");
    assert_eq!(cell(2, "status"), "skipped: too, many");
    assert_eq!(cell(3, "status"), "wrong: ray 3");
    for row in [2, 3] {
        assert_eq!((cell(row, "best_mrays_per_s"), cell(row, "command")), (String::new(), "lanecast bench".into()));
    }
}

#[test]
fn the_table_shows_figures_and_reasons() {
    let text = table(&[timed(), row(Outcome::Wrong("3 rays".into()))]);
    assert_eq!(text.lines().count(), 4, "{text}");
    assert!(text.contains("2.00      4.00   50.0%    2.00x     50%       -"), "{text}");
    assert!(text.contains("WRONG: 3 rays"), "{text}");
}

fn peer(mode: &'static str, quoted: bool) -> Row {
    let peer = PeerRow { mode, quoted, lead: Some(1.5), ..Default::default() };
    Row { engine: "embree", peer: Some(peer), ..timed() }
}

#[test]
fn every_mode_of_a_peer_is_kept_and_the_fastest_shown() {
    let rows = [peer("8 coherent", false), peer("16 coherent", true)];
    let text = table(&rows);
    assert_eq!(text.lines().count(), 3, "{text}");
    assert!(text.contains("embree [16 coherent]") && text.contains("1.50x       5      1"), "{text}");
    let csv = csv(&run(), &rows);
    assert!(csv.contains(",8 coherent,,false,5,1,1.5000,0.9000,") && csv.contains(",16 coherent,,true,"), "{csv}");
}

/// Readers of JSON keep 53 bits of a number: sums are text, as in the CSV file.
#[test]
fn checksums_are_hexadecimal_text() {
    let json = serde_json::to_value(timed()).unwrap();
    assert_eq!(json["outcome"]["timed"]["checksum"], "0000000000000abc", "{json}");
}
