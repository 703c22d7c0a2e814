//! `verify`, `bench` and `info` through the real binary.

mod binary;

use binary::{SQUARE, files, lanecast};

fn square() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("square.ply"), SQUARE).expect("a scene");
    dir
}

fn run(dir: &tempfile::TempDir, line: &str) -> binary::Ended {
    let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}{}", ended.out, ended.err);
    ended
}

#[test]
fn verify_covers_every_engine_query_class_and_precision() {
    let dir = square();
    let report = run(&dir, "verify square.ply --rays 300 --json").json();
    assert_eq!(report["pass"], true);
    let lines = report["lines"].as_array().expect("lines");
    let count = |key: &str, value: &str| lines.iter().filter(|line| line[key] == value).count();
    for precision in ["f32", "f64"] {
        assert_eq!(count("precision", precision), lines.len() / 2);
    }
    for class in ["primary", "shadow", "ao", "reflect", "diffuse"] {
        assert_eq!(count("class", class), lines.len() / 5, "{class}");
    }
    for engine in ["brute", "scalar", "packet4", "packet8"] {
        assert_eq!(count("engine", engine) % 10, 0, "{engine}");
    }
    for line in lines {
        let judged: u64 = ["agree", "unexplained"].iter().filter_map(|key| line["oracle"][key].as_u64()).sum();
        let explained: u64 =
            line["oracle"]["explained"].as_object().expect("reasons").values().filter_map(|n| n.as_u64()).sum();
        assert_eq!(line["rays"].as_u64(), Some(judged + explained), "every ray is judged: {line}");
    }
    assert!(lines.iter().any(|l| l["class"] == "primary" && l["hits"].as_u64() > Some(0)));
}

#[test]
fn bench_prints_a_table_and_writes_rows_and_facts() {
    let dir = square();
    let table = run(&dir, "bench square.ply --size 64x32 --rays primary,ao --engines scalar,packet8 --repeat 3 -o out");
    assert_eq!(files(&dir.path().join("out")), ["bench.csv", "bench.env.txt"]);
    let csv = std::fs::read_to_string(dir.path().join("out/bench.csv")).expect("rows");
    assert_eq!(csv.lines().count(), 5, "a header, 2 classes x 2 engines: {csv}");
    assert!(csv.lines().skip(1).all(|line| line.contains(",ok,")), "{csv}");
    let facts = std::fs::read_to_string(dir.path().join("out/bench.env.txt")).expect("facts");
    for fact in ["command: ", "cpu: ", "rustc: rustc", "load average: ", "isa compiled: "] {
        assert!(facts.contains(fact), "{fact} in {facts}");
    }
    for word in ["square", "primary", "ao", "scalar", "packet8", "1.00x"] {
        assert!(table.out.contains(word), "{word} in {}", table.out);
    }
}

#[test]
fn brute_force_beyond_reason_is_skipped_in_words() {
    let dir = square();
    let report =
        run(&dir, "bench builtin:terrain --size 512x512 --rays primary --engines brute --repeat 1 --json").json();
    let outcome = &report["rows"][0]["outcome"];
    assert!(outcome["skipped"].as_str().is_some_and(|why| why.contains("limit")), "{report}");
}

#[test]
fn info_counts_and_measures() {
    let dir = square();
    let report = run(&dir, "info square.ply --json").json();
    assert_eq!(report["counts"]["primitives"], 2);
    assert_eq!(report["counts"]["instances"], 1);
    assert_eq!(report["bounds"]["lower"], serde_json::json!([0.0, 0.0, 0.0]));
    assert_eq!(report["bounds"]["upper"], serde_json::json!([1.0, 1.0, 0.0]));
    let text = run(&dir, "info square.ply").out;
    assert!(text.contains("primitives") && text.contains("SAH cost"), "{text}");
}
