//! Reader of BRL-CAD databases: real files against counts made without it and against BRL-CAD's own list of regions,
//! errors with their places, damaged and malicious files.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lanecast::error::{Error, Result};
use lanecast::scene::brlcad::describe::{Options, describe};
use lanecast::scene::brlcad::regions::{Regions, walk};
use lanecast::scene::brlcad::{Database, ObjectKind, Region, choose_tops, parse, tops};

use crate::common;
use common::Random;

fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/brlcad").join(path);
    if !path.exists() {
        println!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

fn read(text: &str) -> Result<Database> {
    parse(Path::new("d.asc"), text.as_bytes())
}

fn regions(text: &str, top: &str) -> Result<Regions> {
    let database = read(text)?;
    let tops = choose_tops(&database, &[top.to_owned()])?;
    walk(Path::new("d.asc"), &database, &tops)
}

/// Solids, combinations and regions counted by the first words of lines, knowing nothing else of the format.
fn count_by_lines(text: &str) -> (usize, usize, usize) {
    let count = |starts: &dyn Fn(&str) -> bool| text.lines().filter(|line| starts(line)).count();
    if text.starts_with("title") {
        let puts = count(&|line| line.starts_with("put "));
        let combinations = count(&|line| line.starts_with("put ") && line.contains(" comb region "));
        (puts - combinations, combinations, count(&|line| line.contains(" comb region yes ")))
    } else {
        let regions = count(&|line| line.starts_with("C Y "));
        let record = |line: &str| line.starts_with("S ") && line[2..].starts_with(|c: char| c.is_ascii_digit());
        (count(&record), regions + count(&|line| line.starts_with("C N ")), regions)
    }
}

#[test]
fn every_database_loads_with_the_counts_of_its_lines() {
    let Some(folder) = shared("db") else { return };
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        let database = parse(&path, &bytes).unwrap();
        let counts = database.counts();
        let found = (counts.solids, counts.combinations, counts.regions);
        assert_eq!(found, count_by_lines(&String::from_utf8_lossy(&bytes)), "{}", path.display());
        assert_eq!(counts.unsupported, 0, "{}", path.display());
        assert!(!database.title.is_empty());
        let tops = choose_tops(&database, &[]).unwrap();
        let regions = walk(&path, &database, &tops).unwrap();
        assert!(!regions.regions.is_empty(), "{}", path.display());
        println!("{}: {counts:?}, {} regions", path.display(), regions.regions.len());
        files += 1;
    }
    assert!(files >= 16, "only {files} databases");
}

#[test]
fn regions_are_those_that_librt_lists() {
    for name in ["moss", "bldg391", "sphflake", "boolean-ops", "goliath", "crod", "tank_car"] {
        let (Some(list), Some(db)) = (shared(&format!("dump/{name}.regions.txt")), shared(&format!("db/{name}.asc")))
        else {
            continue;
        };
        let list = std::fs::read_to_string(list).unwrap();
        let expected: Vec<(i32, &str)> = list
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split(' ').collect::<Vec<_>>())
            .map(|words| (words[1].parse().unwrap(), words[3]))
            .collect();
        let top = expected[0].1.split('/').nth(1).unwrap();
        let database = parse(&db, &std::fs::read(&db).unwrap()).unwrap();
        let tops = choose_tops(&database, &[top.to_owned()]).unwrap();
        let found = walk(&db, &database, &tops).unwrap();
        assert_eq!(found.problems, []);
        let found: Vec<(i32, &str)> = found.regions.iter().map(|r| (r.region.id, r.path.as_str())).collect();
        assert_eq!(found.len(), expected.len(), "{name}");
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found, expected, "{name}");
        }
    }
}

/// Figures that a count of BRL-CAD's own gives for the benchmark scenes: regions, air regions, leaves of all regions.
#[test]
fn benchmark_scenes_have_the_known_numbers() {
    let leaves = |r: &Regions| r.regions.iter().map(|region| region.solids.len()).sum::<usize>();
    for (name, top, count, air, instances) in [
        ("moss", "all.g", 6, 0, 6),
        ("world", "all.g", 7, 0, 8),
        ("star", "all", 72, 0, 208),
        ("bldg391", "all.g", 68, 0, 215),
        ("m35", "all.g", 893, 44, 2505),
        ("sphflake", "scene.r", 8, 0, 832 - 8),
    ] {
        let Some(path) = shared(&format!("db/{name}.asc")) else { continue };
        let database = parse(&path, &std::fs::read(&path).unwrap()).unwrap();
        let tops = choose_tops(&database, &[top.to_owned()]).unwrap();
        let found = walk(&path, &database, &tops).unwrap();
        assert_eq!((found.regions.len(), found.air, leaves(&found)), (count, air, instances), "{name}");
    }
}

/// A version 4 record of a member with the identity.
fn member(operator: char, name: &str) -> String {
    format!("M {operator} {name} 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0\n")
}

const BALL: &str = "S 19 ball 11 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0 0 0 0 0 0 0 0 0 0\n";

#[test]
fn colours_and_shaders_are_inherited_as_the_rules_say() {
    let combination = |flag: char, name: &str, id: i32, rgb: &str, shader: bool, inherit: u8, members: &str| {
        let text = if shader { format!("sh_{name}\n") } else { String::new() };
        format!("C {flag} {name} {id} 0 1 0 0 0 {rgb} {} 0 {inherit}\n{text}{members}", u8::from(shader))
    };
    let m = |name: &str| member('u', name);
    let none = "0 0 0 0";
    let text = format!(
        "I 1 v4\nCome, a title\n{BALL}m 0 5 9 51 102 153\n{}{}{}{}{}",
        combination('N', "top", 0, "1 255 0 0", true, 0, &(m("locked") + &m("open"))),
        combination('N', "locked", 0, "1 0 255 0", true, 1, &m("r1")),
        combination('N', "open", 0, none, false, 0, &(m("r1") + &m("r2"))),
        combination('Y', "r1", 1, "1 0 0 255", true, 0, &m("ball")),
        combination('Y', "r2", 7, none, false, 0, &m("ball")),
    );
    let database = read(&text).unwrap();
    assert_eq!((database.title.as_str(), database.units.as_str()), ("Come, a title", "mm"));
    let found = regions(&text, "top").unwrap().regions;
    let shader = |i: usize| found[i].shader.map(|o| database.objects[o as usize].name.as_str());
    let color = |i: usize| found[i].color.unwrap().to_array();
    assert_eq!(found.len(), 3);
    assert_eq!((color(0), shader(0)), ([0.0, 1.0, 0.0], Some("locked")), "a lock overrules what is below");
    assert_eq!((color(1), shader(1)), ([0.0, 0.0, 1.0], Some("r1")), "else the lower one counts");
    assert_eq!((color(2), shader(2)), ([1.0, 0.0, 0.0], Some("top")), "else what is above");
    let alone = regions(&text, "r2").unwrap().regions;
    assert_eq!(alone[0].color.unwrap().to_array(), [51.5 / 255.0, 102.5 / 255.0, 153.5 / 255.0], "else the table");
}

#[test]
fn matrices_multiply_down_and_operators_above_regions_split() {
    let text = "title {t}\nput {b} ell V {0 0 0} A {1 0 0} B {0 1 0} C {0 0 1}\n\
        put {r} comb region yes tree {l b {1 0 0 5  0 1 0 0  0 0 1 0  0 0 0 1}}\n\
        put {cut} comb region yes tree {l b}\n\
        put {top} comb region no tree {- {u {l r {0 -1 0 0  1 0 0 0  0 0 1 2  0 0 0 1}} {l r}} {u {l cut} {l b}}}\n\
        attr set {r} {region_id} {12} {color} {1/2/3} {my key} {my value}\n";
    let found = regions(text, "top").unwrap();
    let paths: Vec<&str> = found.regions.iter().map(|r| r.path.as_str()).collect();
    assert_eq!(paths, ["/top/r", "/top/r"]);
    assert_eq!(found.regions[0].region.id, 12);
    // (5, 0, 0) turned by 90 degrees, then moved up by 2.
    let first = found.regions[0].solids[0].transform.translation;
    assert_eq!(first.to_array(), [0.0, 5.0, 2.0]);
    assert_eq!(found.regions[0].solids.len(), 3, "r - (cut u b)");
    assert_eq!(
        format!("{:?}", found.regions[0].expression.steps()),
        "[Member(0), Member(1), Member(2), Union, Difference]"
    );
    let database = read(text).unwrap();
    let r = &database.objects[database.find("r").unwrap() as usize];
    assert_eq!(r.attributes, [("my key".to_owned(), "my value".to_owned())]);
}

#[test]
fn errors_say_file_line_column_and_what_was_expected() {
    let v5 = |line: &str| format!("title {{t}}\n{line}\n");
    let v4 = |line: &str| format!("I 1 v4\nt\n{line}\n");
    for (text, expected) in [
        ("hello".into(), "d.asc:1:1: expected a BRL-CAD database"),
        (String::new(), "d.asc:1:1: expected a BRL-CAD database"),
        ("I 1 v5\nt\n".into(), "d.asc:1:5: expected version `v4`, found `v5`"),
        (v4("S 19 a 11 0 0 0 1 0 0 x"), "d.asc:3:23: expected a number of the solid (a finite number), found `x`"),
        (v4("S 99 a 11 0"), "d.asc:3:3: expected the type of a solid (16, 18, 19, 20, 24 or 26 to 33), found 99"),
        (v4("C Z a 1"), "d.asc:3:3: expected the region flag Y, R, P, V or N, found `Z`"),
        (v4("C Y a 1\nM u b 1 0 0"), "d.asc:4:12: expected a number of the matrix (16 in all), found the end"),
        (v4("C Y a 1\nM x b 1 0 0"), "d.asc:4:3: expected the operator u, - or +, found `x`"),
        (v4("M u b 1"), "d.asc:3:1: a member outside a combination"),
        (v4("C Y a 1\nM u b 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 0 0"), "d.asc:4:7: the matrix divides by zero"),
        (v4("C Y a 1\nM u b 1 0 0 0 0 1 0 0 0 0 1 0 nan 0 0 0 0"), "d.asc:4:31: expected a number of the matrix"),
        (v4("t bot 1 1 0 4000000000 1\n\t0: 1 2 3"), "d.asc:5:1: the file ends where a vertex of a mesh was expected"),
        (v4("N 1 n 99999999999999"), "d.asc:4:1: the file ends where the counts of an NMG solid was expected"),
        (v5("put {a} ell V {0 0 0}"), "d.asc:2:1: expected the key `A`"),
        (v5("put {a} half N {0 0 1} d {x}"), "d.asc:2:27: expected the number `d` (a finite number), found `x`"),
        (v5("put {a} arb8 V1 {0 0 0}"), "d.asc:2:1: expected the corners V1 to V4 at least, up to V8, found 1"),
        (v5("put {a} comb region yes tree {u {l b}}"), "d.asc:2:31: this operator needs two trees in braces"),
        (v5("put {a} comb region yes tree {x {l b}}"), "d.asc:2:31: expected l, u, n, - or ^ at the head of a tree"),
        (v5("put {a} comb region yes tree {l b} }"), "d.asc:2:36: `}` has no value"),
        (v5("put {a} comb region yes tree {u {l b} {l c} {l d}}"), "d.asc:2:46: expected the end of the tree"),
        (v5("put {a"), "d.asc:2:5: this `{` is never closed"),
        (v5("attr set {b} {rgb} {1/2/3}"), "d.asc:2:1: attributes of `b`, which is defined nowhere"),
        (v5("exec rm -rf"), "d.asc:2:1: expected title, units, color, put or attr, found `exec`"),
    ] {
        let error = read(&text).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().starts_with(expected), "{error}\nexpected: {expected}");
    }
}

/// As BRL-CAD does: it reads numbers with `atol`, and says of a colour that it cannot read that there is none.
#[test]
fn odd_attributes_are_warnings() {
    let text = "title {t}\nput r comb region yes id 7 air 1 los 50 GIFTmater 2 rgb {1 2 3} tree {l s}\n";
    let with = |settings: &str| {
        let database = read(&format!("{text}attr set r {settings}\n")).unwrap();
        let ObjectKind::Combination(r) = &database.objects[0].kind else { panic!("no combination") };
        (r.region.unwrap(), r.rgb, database.warnings)
    };
    let (region, rgb, warnings) = with("region_id {} aircode {} los {} material_id {}");
    assert_eq!((region, rgb, warnings), (Region::default(), Some([1, 2, 3]), Vec::new()), "empty numbers are 0");
    let (region, rgb, warnings) = with("region_id { 12 } aircode x1 los 100.0 material_id -99999999999 rgb {}");
    assert_eq!((region, rgb), (Region { id: 12, air: 0, los: 100, material: i32::MIN }, None));
    let number = |key: &str, found: &str, number: i32| {
        format!("`r` (line 3): attribute `{key}`: expected a whole number, found `{found}`, which counts as {number}")
    };
    let colour = |found: &str| {
        let what = "expected a colour R/G/B, each 0 to 255, found";
        format!("`r` (line 3): attribute `rgb`: {what} {found}; done without a colour")
    };
    let numbers =
        [number("aircode", "x1", 0), number("los", "100.0", 100), number("material_id", "-99999999999", i32::MIN)];
    assert_eq!(warnings[..3], numbers);
    assert_eq!((warnings.len(), warnings[3].starts_with("`r` (line 3): attribute `rgb`: ")), (4, true), "{warnings:?}");
    assert_eq!(with("rgb 1/2/300").2, [colour("`1/2/300`")]);
    assert_eq!(with("los +7%").0.los, 7);
}

#[test]
fn cycles_are_found_and_named() {
    for (members, expected) in [
        (
            "put {a} comb region no tree {l b}\nput {b} comb region no tree {l a}",
            "d.asc:2:1: `a` contains itself: a/b/a",
        ),
        ("put {a} comb region yes tree {l a}", "d.asc:2:1: `a` contains itself: a/a"),
        (
            "put {a} comb region no tree {l b}\nput {b} comb region yes tree {l c}\nput {c} comb region no tree {l a}",
            "d.asc:3:1: `b` contains itself: b/c/a/b",
        ),
    ] {
        let error = regions(&format!("title {{t}}\n{members}\n"), "a").unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn what_is_missing_or_unknown_is_a_problem_with_its_place() {
    let text = "title {t}\nput {m} metaball x y\nput {r} comb region yes tree {u {l m} {u {l gone} {l m}}}\n";
    let found = regions(text, "r").unwrap();
    let problems: Vec<String> =
        found.problems.iter().map(|p| format!("{} {:?} {}", p.object, p.place, p.what)).collect();
    assert_eq!(
        problems,
        [
            "m LineColumn { line: 2, column: 1 } the kind `metaball` is not supported",
            "r LineColumn { line: 3, column: 1 } its member `gone` is defined nowhere",
        ]
    );
    let error = choose_tops(&read(text).unwrap(), &["rr".into()]).unwrap_err().to_string();
    assert!(error.contains("did you mean") && error.contains("on top are: r"), "{error}");
}

#[test]
fn tops_are_all_g_or_what_nobody_uses() {
    let text =
        "title {t}\nput b half N {0 0 1} d 0\nput x comb region no tree {l b}\nput y comb region no tree {l b}\n";
    let names = |text: &str| {
        let d = read(text).unwrap();
        choose_tops(&d, &[]).unwrap().iter().map(|&i| d.objects[i as usize].name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(text), ["x", "y"]);
    assert_eq!(names(&format!("{text}put all.g comb region no tree {{l x}}\n")), ["all.g"]);
    assert_eq!(tops(&read(text).unwrap()).len(), 2);
    assert!(choose_tops(&read("title {}").unwrap(), &[]).is_err());
}

#[test]
fn hostile_depth_breadth_and_sharing_end_in_time() {
    let start = Instant::now();
    // A tree 10^5 deep in one combination, to either side.
    let n = 100_000;
    let left = "{u ".repeat(n) + "{l b}" + &" {l b}}".repeat(n);
    let right = "{- {l b} ".repeat(n) + "{l b}" + &"}".repeat(n);
    for tree in [left, right] {
        let text = format!(
            "title {{t}}\nput b half N {{0 0 1}} d 0\nput r comb region yes tree {tree}\nput g comb region no tree {tree}\n"
        );
        assert_eq!(regions(&text, "r").unwrap().regions[0].solids.len(), n + 1);
        let above = regions(&text, "g").unwrap().regions;
        assert_eq!(above.iter().map(|r| r.solids.len()).sum::<usize>(), n + 1);
    }
    // Combinations 10^5 deep.
    let mut text = String::from("title {t}\nput c0 half N {0 0 1} d 0\n");
    for i in 1..n {
        text += &format!("put c{i} comb region no tree {{l c{} {{1 0 0 1  0 1 0 0  0 0 1 0  0 0 0 1}}}}\n", i - 1);
    }
    let deep = regions(&text, &format!("c{}", n - 1)).unwrap().regions;
    assert_eq!(deep[0].solids[0].transform.translation.x, (n - 1) as f64);
    assert!(deep[0].path.len() < 1000);
    // 2^60 solids in 60 lines, above regions and inside one, with and without anything to show.
    for (region, bottom) in
        [("no", "half N {0 0 1} d 0"), ("yes", "half N {0 0 1} d 0"), ("no", "comb region no tree {}")]
    {
        let mut text = format!("title {{t}}\nput c0 {bottom}\n");
        for i in 1..=60 {
            let region = if i == 60 { region } else { "no" };
            text += &format!("put c{i} comb region {region} tree {{u {{l c{0}}} {{l c{0}}}}}\n", i - 1);
        }
        let error = regions(&text, "c60").unwrap_err().to_string();
        assert!(error.contains("more than 1048576 solids"), "{error}");
    }
    // A long list with a long subtrahend.
    let sum = "{u ".repeat(3000) + "{l b}" + &" {l b}}".repeat(3000);
    let text = format!("title {{t}}\nput b half N {{0 0 1}} d 0\nput g comb region no tree {{- {sum} {sum}}}\n");
    assert!(regions(&text, "g").is_err(), "9 million leaves");
    println!("hostile trees: {:?}", start.elapsed());
    assert!(start.elapsed() < Duration::from_secs(60));
}

/// Seconds to read and describe a database of a ball and `count` regions of it, of which `region` says the rest.
fn seconds(head: &str, count: usize, region: impl Fn(usize) -> String) -> f64 {
    let mut text = format!("title {{t}}\nunits mm\n{head}put s ell V {{0 0 0}} A {{1 0 0}} B {{0 1 0}} C {{0 0 1}}\n");
    (0..count).for_each(|i| text += &format!("put r{i} comb region yes id {i} {} tree {{l s}}\n", region(i)));
    let start = Instant::now();
    let description = describe(Path::new("d.asc"), "d", &read(&text).unwrap(), &Options::default()).unwrap();
    assert_eq!(description.solids.len(), count);
    start.elapsed().as_secs_f64()
}

/// Regions that all have a colour of their own take about as long as those that share one: a search through all of them for
/// each would take ten times as long.
#[test]
fn very_many_colours_take_no_longer_than_few() {
    const COUNT: usize = 60_000;
    let own = |i: usize| format!("rgb {{{} {} {}}}", i & 255, i >> 8 & 255, i >> 16);
    let shared = seconds("", COUNT, |_| own(0));
    let distinct = seconds("", COUNT, own);
    println!("one colour: {shared} s, {COUNT} colours: {distinct} s");
    assert!(distinct < 4.0 * shared + 1.0, "{distinct} s against {shared} s");
}

/// The same with a table of colours by region number, of as many entries.
#[test]
fn a_long_table_of_colours_takes_no_longer_than_a_short_one() {
    const COUNT: usize = 60_000;
    // The entry for all comes first: each region that has none of its own would search to the end of the list.
    let short = "color 0 1000000 1 2 3\n";
    let long = (0..COUNT).fold(short.to_owned(), |text, i| text + &format!("color {0} {0} 4 5 6\n", i + 500_000));
    let short = seconds(short, COUNT, |_| String::new());
    let long = seconds(&long, COUNT, |_| String::new());
    println!("one entry: {short} s, {COUNT} entries: {long} s");
    assert!(long < 4.0 * short + 1.0, "{long} s against {short} s");
}

/// Reads mutated seeds of the fuzz corpus: an error with a place, or a database that can be walked; never a panic.
#[test]
fn mutations_never_panic() {
    const MUTATIONS: usize = 20_000;
    const TOKENS: [&[u8]; 16] = [
        b"{",
        b"}",
        b"\\",
        b"\n",
        b"M u a",
        b"{l a}",
        b"nan",
        b"1e999",
        b"-1",
        b"4294967296",
        b"put a comb region no tree {l a}",
        b"C Y a 1",
        b"\"",
        b";",
        b"\0",
        b"\xff",
    ];
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/brlcad");
    let Ok(entries) = std::fs::read_dir(&corpus) else {
        println!("SKIPPED: no fuzz corpus for brlcad (packaged sources leave it out)");
        return;
    };
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let seeds: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert!(seeds.len() >= 4);
    let mut random = Random(2026);
    let mut good = 0;
    for i in 0..MUTATIONS {
        let mut bytes = seeds[i % seeds.len()].clone();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len() + 1);
            let end = (at + random.below(12)).min(bytes.len());
            match random.below(5) {
                0 if at < bytes.len() => bytes[at] = random.bits() as u8,
                1 => drop(bytes.drain(at..end)),
                2 => bytes.truncate(at),
                _ => drop(bytes.splice(at..end, TOKENS[random.below(TOKENS.len())].iter().copied())),
            }
        }
        good += usize::from(survives(&bytes));
    }
    println!("{good} of {MUTATIONS} mutated databases were read");
    assert!(good > MUTATIONS / 20 && good < MUTATIONS);
}

#[test]
fn every_truncation_of_small_databases() {
    for name in ["moss", "operators", "prim"] {
        let Some(path) = shared(&format!("db/{name}.asc")) else { continue };
        let bytes = std::fs::read(path).unwrap();
        for length in 0..bytes.len() {
            survives(&bytes[..length]);
        }
    }
}

fn survives(bytes: &[u8]) -> bool {
    let file = Path::new("h.asc");
    match parse(file, bytes) {
        Ok(database) => {
            for object in &database.objects {
                if let ObjectKind::Combination(c) = &object.kind {
                    assert!(c.expression.steps().len() <= 2 * c.members.len() + 1);
                }
            }
            if let Ok(tops) = choose_tops(&database, &[]) {
                drop(walk(file, &database, &tops));
            }
            true
        }
        Err(Error::Input(error)) => {
            assert!(error.to_string().len() < 1000, "a long message");
            false
        }
        Err(other) => panic!("not an input error: {other}"),
    }
}
