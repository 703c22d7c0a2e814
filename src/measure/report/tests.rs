use std::path::Path;

use scraper::{Html, Selector};

use super::*;
use crate::film::{Film, PlaneData, png};
use crate::measure::rows::{self, Outcome, Row, Run, SceneFacts};
use crate::measure::stats::summary;

fn row(scene: &str, prims: u64, engine: &'static str, seconds: f64) -> Row {
    let passes: Vec<f64> = (0..9).map(|i| seconds * (1.0 + 0.01 * f64::from(i))).collect();
    let scene =
        SceneFacts { name: scene.into(), hash: format!("{prims:x}"), prims, build_seconds: 0.1, bytes: 1 << 20 };
    let outcome = Outcome::Timed {
        seconds: summary(&passes).unwrap(),
        repeat: 9,
        passes,
        hits: 5,
        checksum: 7,
        ratio: None,
        node_lane_use: Some(0.5),
        prim_lane_use: None,
        percent_of_limit: Some(40.0),
    };
    Row {
        scene,
        class: "primary",
        query: "closest",
        engine,
        precision: "f32",
        threads: 1,
        rays: 1000,
        ties: 1,
        differences: 0,
        efficiency: None,
        peer: None,
        outcome,
    }
}

fn run(folder: &Path, revision: &'static str, threads: usize, rows: &[Row]) {
    std::fs::create_dir_all(folder).unwrap();
    let (date, cpu) = (format!("2026-01-01T0{threads}:00:00Z"), "A <fast> CPU".to_string());
    let command = format!("lanecast bench 'a & b.ply' --threads {threads}");
    let run = Run { date, revision, isa: "avx2", flags: "", rustc: "", cpu, threads, command };
    let rows: Vec<Row> = rows.iter().map(|row| Row { threads, ..row.clone() }).collect();
    std::fs::write(folder.join("bench.csv"), rows::csv(&run, &rows)).unwrap();
    std::fs::write(folder.join("bench.env.txt"), "cpu: A <fast> CPU\nrustc: rustc 1\nload average: 1 2 3\n").unwrap();
}

fn picture(path: &Path, value: f32) {
    let mut film = Film::full(20, 12).unwrap();
    ["R", "G", "B"].iter().for_each(|name| film.push(*name, PlaneData::F32(vec![value; 240])).unwrap());
    png::write(path, &film, 0.0).unwrap();
}

/// Two revisions, two thread counts, three sizes, a skipped row, a pair of pictures.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let mut skipped = row("box", 12, "brute", 1.0);
    skipped.outcome = Outcome::Skipped("too many".into());
    run(&at("a"), "aaaaaaaaaaaa", 1, &[row("box", 12, "scalar", 1.0), row("box", 12, "tile", 0.25), skipped]);
    run(&at("b"), "bbbbbbbbbbbb", 1, &[row("box", 12, "scalar", 1.0), row("box", 12, "tile", 0.2)]);
    let sizes = [row("grid", 100, "tile", 0.1), row("grid", 1000, "tile", 0.2), row("grid", 10_000, "tile", 0.3)];
    run(&at("c"), "bbbbbbbbbbbb", 2, &[&sizes[..], &[row("box", 12, "tile", 0.1)]].concat());
    picture(&at("a/box.png"), 0.5);
    picture(&at("b/box.png"), 0.4);
    dir
}

fn page() -> (String, Summary) {
    let options = Options { title: None, command: "lanecast report x".into(), date: "today".into() };
    html(folder().path(), &options).unwrap()
}

fn all<'a>(page: &'a Html, selector: &str) -> Vec<scraper::ElementRef<'a>> {
    page.select(&Selector::parse(selector).unwrap()).collect()
}

#[test]
fn the_page_is_whole_and_needs_nothing_else() {
    let (text, found) = page();
    let page = Html::parse_document(&text);
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    assert_eq!((found.runs, found.rows, found.pairs), (3, 9, 1));
    // Nothing is fetched: every address is inside the page.
    for element in page.root_element().descendants().filter_map(scraper::ElementRef::wrap) {
        for (name, value) in element.value().attrs() {
            let address = ["src", "href", "action", "data", "poster", "srcset"].contains(&name);
            assert!(!address || value.starts_with("data:") || value.starts_with('#'), "{name}={value}");
        }
    }
    assert!(!text.contains("@import") && !text.contains("url(") && !text.contains("fetch("));
    // What files say is text, not markup.
    assert!(text.contains("A &lt;fast&gt; CPU") && !text.contains("<fast>"));
    let ids: Vec<&str> = all(&page, "main > section").iter().filter_map(|s| s.value().id()).collect();
    assert_eq!(ids, ["machine", "rates", "scaling", "limits", "accuracy", "pictures", "history"]);
    for link in all(&page, "nav a") {
        let target = link.attr("href").unwrap().trim_start_matches('#');
        assert!(ids.contains(&target), "{target}");
    }
}

#[test]
fn every_figure_has_a_table_and_its_commands() {
    let (text, found) = page();
    let page = Html::parse_document(&text);
    let figures = all(&page, "figure");
    assert_eq!(figures.len(), found.figures);
    for figure in &figures {
        let has = |selector: &str| figure.select(&Selector::parse(selector).unwrap()).next().is_some();
        assert!(has("table") && has(".commands pre") && has("figcaption"), "{}", figure.html());
    }
    assert!(all(&page, ".plot svg").len() >= 5, "rates of 5 settings, scaling, history");
    // The command is there as typed.
    assert!(all(&page, "pre").iter().any(|pre| pre.text().collect::<String>().contains("'a & b.ply' --threads 2")));
}

#[test]
fn figures_are_those_of_the_rows() {
    let (text, _) = page();
    let page = Html::parse_document(&text);
    let rows_of = |section: &str| -> Vec<String> {
        all(&page, &format!("#{section} tbody tr")).iter().map(|tr| tr.text().collect::<Vec<_>>().join("|")).collect()
    };
    let rates = rows_of("rates");
    // The newest run of one thread: 1000 rays in a median pass of 1.04 and 0.208 s; 5 times scalar in every round.
    assert!(
        rates.iter().any(|r| r.contains("tile|0.00 (0.00 to 0.00)") && r.contains("5.00 (5.00 to 5.00)")),
        "{rates:?}"
    );
    let history = rows_of("history");
    assert!(history.iter().any(|r| r == "tile|2026-01-01 aaaaaaa|4.000 (4.000 to 4.000)"), "{history:?}");
    let scaling = rows_of("scaling");
    assert!(scaling.iter().any(|r| r.starts_with("tile|10000|") && r.ends_with("|0.33")), "{scaling:?}");
    assert!(scaling.iter().any(|r| r.starts_with("tile|2|") && r.ends_with("|2.00")), "{scaling:?}");
    let accuracy = rows_of("accuracy").join("\n");
    assert!(accuracy.contains("primary|tile|5|1|0|yes|ok"), "{accuracy}");
    let limits = rows_of("limits");
    assert!(limits.iter().any(|r| r.starts_with("primary|tile|") && r.ends_with("|40 %")), "{limits:?}");
    let slider = all(&page, ".slider");
    assert_eq!(slider.len(), 1);
    assert_eq!(all(&page, ".slider img").len(), 2);
}

#[test]
fn a_folder_without_results_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let fault = |dir: &Path| html(dir, &Options::default()).unwrap_err().to_string();
    assert!(fault(dir.path()).contains("bench.csv"));
    std::fs::write(dir.path().join("bench.csv"), "a,b\n1,2\n").unwrap();
    assert!(fault(dir.path()).contains("bench.csv:1:1: expected a column `scene`"));
    std::fs::write(dir.path().join("bench.csv"), "scene,class,engine,status\n1,2\n").unwrap();
    assert!(fault(dir.path()).contains("bench.csv:2:1"));
    let head = "scene,class,engine,status,rays,seconds";
    for (cells, what) in [("1e3,0.5 fast", "`seconds`, found `0.5 fast`"), ("many,0.5", "`rays`, found `many`")] {
        std::fs::write(dir.path().join("bench.csv"), format!("{head}\nbox,ao,tile,ok,{cells}\n")).unwrap();
        let said = fault(dir.path());
        assert!(said.contains("bench.csv:2:1: expected a number in ") && said.contains(what), "{said}");
    }
}
