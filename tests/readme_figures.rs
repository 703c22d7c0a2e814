//! README's figures are those of the rows in results/, and it has no others.

mod binary;

use std::path::{Path, PathBuf};

use binary::{lanecast, refused};

const END: &str = "<!-- end of figures -->";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The rows, which a packaged crate does not have.
fn results() -> Option<PathBuf> {
    let folder = root().join("results");
    let found = folder.is_dir().then_some(folder);
    if found.is_none() {
        println!("SKIPPED: no results beside the package");
    }
    found
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).expect("a README")
}

/// Makes the figures of `text` anew from `results` and returns what came of it.
fn remade(text: &str, results: &Path) -> String {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("README.md"), text).expect("written");
    let results = results.to_str().expect("UTF-8");
    let ended = lanecast(dir.path(), &["report", results, "--readme", "README.md", "--json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let made = std::fs::read_to_string(dir.path().join("README.md")).expect("a README");
    assert_eq!(ended.json(), serde_json::json!({ "tables": 1, "changed": made != text }));
    made
}

#[test]
fn the_figures_are_those_of_the_rows() {
    let Some(results) = results() else { return };
    let text = readme();
    assert!(
        remade(&text, &results) == text,
        "README.md is not what `lanecast report results --readme README.md` makes of it; run that"
    );
    // A figure changed by hand is put right again.
    let at = text.find("x) |").expect("a ratio in the table");
    let wrong = format!("{}9{}", &text[..at], &text[at..]);
    assert_eq!(remade(&wrong, &results), text);
}

/// Speeds in `text`: numbers before `x`, `times as fast` or a rate's unit.
fn speeds(text: &str) -> Vec<String> {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut found = Vec::new();
    let in_number = |c: char| c.is_ascii_digit() || c == '.';
    for (at, _) in text.match_indices(|c: char| c.is_ascii_digit()) {
        if text[..at].ends_with(in_number) {
            continue;
        }
        let number = text[at..].find(|c| !in_number(c)).map_or(text.len(), |n| at + n);
        let rest = text[number..].trim_start();
        let ratio = text[number..].strip_prefix('x').is_some_and(|r| !r.starts_with(char::is_alphanumeric));
        let units = ["times as fast", "times faster", "Mrays", "Mpaths", "million rays per", "million paths per"];
        if ratio || units.iter().any(|unit| rest.starts_with(unit)) {
            found.push(text[at..].chars().take(40).collect());
        }
    }
    found
}

/// Every speed in README stands between the marks, where the rows put it.
#[test]
fn there_are_no_other_figures() {
    let text = readme();
    let (before, rest) = text.split_once("<!-- figures\n").expect("marks");
    let (table, after) = rest.split_once(END).expect("marks");
    assert!(speeds(table).len() >= 10, "the table has ratios: {:?}", speeds(table));
    for part in [before, after] {
        assert_eq!(speeds(part), Vec::<String>::new(), "no row holds these");
    }
    // The search finds what it should, and sizes are no speeds.
    let found = speeds("a tile of 16x16 rays is 2.5x, 3 times as fast, 10 Mrays/s and 7.5 million\nrays per second");
    assert_eq!(found.len(), 4, "{found:?}");
    assert_eq!(speeds("--size 1024x576, 18 million primitives"), Vec::<String>::new());
}

/// Files of rows and facts below `folder`.
fn records(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let (folders, files): (Vec<_>, Vec<_>) = entries.partition(|path| path.is_dir());
    let kept = files.into_iter().filter(|path| path.extension().is_some_and(|e| e == "csv" || e == "txt"));
    kept.chain(folders.iter().flat_map(|folder| records(folder))).collect()
}

/// Recorded commands are anyone's: no paths of the machine they ran on.
#[test]
fn records_hold_no_paths_of_a_machine() {
    let Some(results) = results() else { return };
    let records = records(&results);
    assert!(records.len() > 100, "{} files", records.len());
    let strange = |text: &str| {
        let commands = text.lines().filter_map(|line| line.strip_prefix("command: "));
        let known = ["lanecast ", "target/release/lanecast "];
        let by_another = commands.clone().any(|command| !known.iter().any(|name| command.starts_with(name)));
        let mut words = text.split(|c: char| c.is_whitespace() || "=,;:\"'".contains(c));
        by_another || words.any(|word| word.len() > 1 && word.starts_with('/'))
    };
    for path in records {
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(!strange(&text), "{} holds a path of a machine", path.display());
    }
    assert!(strange("command: /opt/lanecast bench") && strange("1,lanecast bench -o /tmp/x,2"));
    assert!(!strange("command: lanecast bench ../x.ply -o results/x\n5.0 Mrays / s, 3 / 4\n"));
}

/// Two scenes of hand-made rows: the newest whole run counts, rates are rounded, the ratio is of the same rounds.
#[test]
fn a_block_is_made_from_the_newest_run_that_has_all() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let head = "revision,date,cpu,isa,threads,scene,prims,class,engine,precision,rays,status,repeat,\
                median_mrays_per_s,peer_description,quoted,command,seconds";
    let row = |run: &str, class: &str, engine: &str, rate: f64, quoted: &str, seconds: &str| {
        format!(
            "{run}0123456,2026-01-0{run}T00:00:00Z,A CPU,avx2,1,hall,12345,{class},{engine},f32,1000000,ok,3,{rate},\
             \"Peer 2.0, high\",{quoted},lanecast bench,{seconds}"
        )
    };
    let write = |run: &str, rows: &[String]| {
        std::fs::create_dir_all(dir.path().join(run)).expect("a folder");
        std::fs::write(dir.path().join(run).join("bench.csv"), format!("{head}\n{}\n", rows.join("\n"))).expect("rows");
    };
    let whole = |run: &str, tile: f64| {
        [
            row(run, "primary", "scalar", 4.04, "", "1 1 1"),
            row(run, "primary", "tile", tile, "", "0.2 0.1 0.1"),
            row(run, "primary", "peer", 8.0, "true", "0.3 0.3 0.3"),
            row(run, "primary", "peer", 80.0, "false", "0.01 0.01 0.01"),
        ]
    };
    write("1", &whole("1", 99.0));
    write("2", &[&whole("2", 40.04)[..], &[row("2", "ao", "scalar", 1.0, "", "1 1 1")]].concat());
    // Newer, but without the peer.
    write("3", &whole("3", 70.0)[..2]);
    // Newer and whole, but of another build.
    write("4", &whole("4", 60.0).map(|row| row.replace("avx2", "sse2")));
    let text = "a\n<!-- figures\nscenes: hall as The hall\nengines: scalar, tile\npeer: peer as A peer\nisa: avx2\n-->\nold\n\
                <!-- end of figures -->\nb\n";
    let file = dir.path().join("text.md");
    std::fs::write(&file, text).expect("written");
    let ended = lanecast(dir.path(), &["report", ".", "--readme", "text.md"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let made = std::fs::read_to_string(&file).expect("a text");
    // 0.3 / 0.1 in two of three rounds; in the slowest 0.3 / 0.2.
    assert!(
        made.contains("| rays | The hall `scalar` | `tile` |\n|---|---|---|\n| primary | 4.0 | 40.0 (3.00x) |\n\n<!--"),
        "{made}"
    );
    assert!(made.contains("The hall: 12 345 primitives, revision `20123456` of 2026-01-02."), "{made}");
    assert!(made.contains("(Peer 2.0)") && !made.contains("old") && !made.contains("ao"), "{made}");
    assert!(made.starts_with("a\n") && made.ends_with("b\n"), "{made}");
}

#[test]
fn faults_name_the_line() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("bench.csv"), "scene,class,engine,status\nhall,primary,scalar,ok\n").expect("rows");
    let fault = |text: &str, what: &str| {
        std::fs::write(dir.path().join("t.md"), text).expect("written");
        refused(dir.path(), &["report", ".", "--readme", "t.md"], what);
        assert_eq!(std::fs::read_to_string(dir.path().join("t.md")).expect("a text"), text, "left alone");
    };
    fault("nothing\n", "t.md: expected a line `<!-- figures`");
    fault("x\n<!-- figures\nscenes: a\n", "t.md:2:1: expected `-->`");
    fault("<!-- figures\n-->\nx\n", "t.md:1:1: expected `<!-- end of figures -->`");
    fault("<!-- figures\nscene: a\n-->\n<!-- end of figures -->\n", "t.md:2:1: expected one of scenes, engines");
    fault("<!-- figures\nscenes: a\nscenes: a\n-->\n<!-- end of figures -->\n", "t.md:3:1: `scenes` is given twice");
    fault("<!-- figures\nscenes: a\n-->\n<!-- end of figures -->\n", "t.md:1:1: expected `engines:`");
    let block = "<!-- figures\nscenes: hall\nengines: scalar\n-->\n<!-- end of figures -->\n";
    fault(block, "t.md:1:1: expected a run of hall with all of scalar");
    refused(dir.path(), &["report", ".", "--readme", "none.md"], "none.md");
}
