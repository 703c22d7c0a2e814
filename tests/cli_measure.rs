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
        // Some engines exist in one precision only; each answers 6 classes x 2 queries.
        assert!(count("precision", precision) >= 48 && count("precision", precision) % 12 == 0, "{precision}");
    }
    for class in ["primary", "shadow", "ao", "reflect", "diffuse", "scatter"] {
        assert_eq!(count("class", class), lines.len() / 6, "{class}");
    }
    for engine in ["brute", "scalar", "packet4", "packet8"] {
        assert_eq!(count("engine", engine), 24, "{engine}");
    }
    for line in lines {
        let judged: u64 = ["agree", "unexplained"].iter().filter_map(|key| line["oracle"][key].as_u64()).sum();
        let explained: u64 =
            line["oracle"]["explained"].as_object().expect("reasons").values().filter_map(|n| n.as_u64()).sum();
        assert_eq!(line["rays"].as_u64(), Some(judged + explained), "every ray is judged: {line}");
        // Who has an arithmetic of its own is counted apart, in no column that fails.
        let (same, own) = (&line["bit_differences"], &line["own_differences"]);
        match line["engine"] == "tile" {
            true => assert!(same.is_null() && own.as_u64() <= line["rays"].as_u64() && own.is_u64(), "{line}"),
            false => assert!(same == 0 && own.is_null(), "{line}"),
        }
    }
    assert!(lines.iter().any(|l| l["own_differences"].as_u64() > Some(0)), "tile computes in its own frame");
    for class in ["primary", "scatter"] {
        assert!(lines.iter().any(|l| l["class"] == class && l["hits"].as_u64() > Some(0)), "{class}");
    }
    let once = run(&dir, "verify square.ply --rays 300 --precision f32 --kinds primary,ao,primary").out;
    assert_eq!(once.lines().count(), 1 + 2 * 2, "each class once: {once}");
    let brief = run(&dir, "verify square.ply --rays 300").out;
    assert_eq!(brief.lines().count(), 1 + 2 * 6 * 2, "a line per precision, class and query: {brief}");
    let full = run(&dir, "verify square.ply --rays 300 -v").out;
    assert_eq!(full.lines().count(), brief.lines().count() + lines.len(), "and one per engine: {full}");
}

/// Shapes that are thinner than rounding reaches: whoever judges must find them where they are, not where their own space has them.
#[test]
fn verify_explains_what_rounding_does_to_stretched_shapes() {
    let dir = tempfile::tempdir().expect("a folder");
    for (shape, scale) in
        [("disc", "1e3 0.01 1"), ("disc", "1e4 1 1"), ("sphere", "1e3 0.01 0.01"), ("cone", "1e3 0.01 0.01")]
    {
        let scene = format!("{shape} {{ scale {scale} }}\nsphere {{ translate 3 0 0 }}\n");
        std::fs::write(dir.path().join("thin.kdl"), scene).expect("a file");
        for seed in 1..=3 {
            let report = run(&dir, &format!("verify thin.kdl --rays 500 --seed {seed} --json")).json();
            assert_eq!(report["pass"], true, "{shape} {scale}, seed {seed}");
        }
    }
}

/// Corners on a line in f64 that leave it when they are rounded to f32: of no area, whatever the precision, moved or not.
#[test]
fn triangles_on_a_line_are_dropped_in_every_precision() {
    let dir = tempfile::tempdir().expect("a folder");
    let mesh = "v 1.44 -2.75 2.49\nv 1.9 -3.71 2.13\nv 1.67 -3.23 2.31\nv 5 0 0\nv 0 5 0\nv 0 0 5\nf 1 2 3\nf 4 5 6\n";
    std::fs::write(dir.path().join("line.obj"), mesh).expect("a mesh");
    std::fs::write(dir.path().join("moved.kdl"), "mesh \"line.obj\" { translate 0.3 7 0.1 }\n").expect("a scene");
    for scene in ["line.obj", "moved.kdl"] {
        for precision in ["f32", "f64"] {
            let counts = run(&dir, &format!("info {scene} --precision {precision} --json")).json()["counts"].clone();
            assert_eq!(counts["dropped_degenerate"], 1, "{scene} {precision}: {counts}");
        }
        let report = run(&dir, &format!("verify {scene} --rays 500 --json")).json();
        assert_eq!(report["pass"], true, "{scene}: {report}");
    }
}

#[test]
fn bench_prints_a_table_and_writes_rows_facts_and_a_picture() {
    let dir = square();
    let table = run(&dir, "bench square.ply --size 64x32 --rays primary,ao --engines scalar,packet8 --repeat 3 -o out");
    assert_eq!(files(&dir.path().join("out")), ["bench.csv", "bench.env.txt", "square.exr"]);
    let csv = std::fs::read_to_string(dir.path().join("out/bench.csv")).expect("rows");
    assert_eq!(csv.lines().count(), 5, "a header, 2 classes x 2 engines: {csv}");
    assert!(csv.lines().skip(1).all(|line| line.contains(",ok,")), "{csv}");
    let facts = std::fs::read_to_string(dir.path().join("out/bench.env.txt")).expect("facts");
    for fact in ["command: ", "cpu: ", "rustc: rustc", "load average: ", "isa compiled: ", "ports: "] {
        assert!(facts.contains(fact), "{fact} in {facts}");
    }
    for word in ["square", "primary", "ao", "scalar", "packet8", "1.00x"] {
        assert!(table.out.contains(word), "{word} in {}", table.out);
    }
    let said = table.err.lines().find(|line| line.starts_with("ports: ")).expect("the calibration");
    assert!(facts.contains(said) && said.contains(" GHz: multiply") && said.contains(" per cycle"), "{said}");
}

/// A picture that fills none of its four tiles but one has as many rays as pixels, for engines, peers and rates alike.
#[test]
fn rays_are_pixels_of_the_picture() {
    let dir = square();
    let line = "bench square.ply --size 33x33 --rays primary,camera,ao,diffuse2 --engines scalar,tile \
                --peers obvhs --repeat 1 --threads 1 --json -o out";
    let report = run(&dir, line).json();
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 4 * (2 + 2), "{report}");
    for row in rows {
        assert_eq!(row["rays"], 33 * 33, "{row}");
    }
    let csv = std::fs::read_to_string(dir.path().join("out/bench.csv")).expect("rows");
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let header = reader.headers().expect("a header").clone();
    for row in reader.records() {
        let row = row.expect("a row");
        let number = |name: &str| -> f64 {
            let column = header.iter().position(|h| h == name).expect("the column");
            row[column].parse().expect("a number")
        };
        let rate = 33.0 * 33.0 / number("seconds") / 1e6;
        assert!((number("median_mrays_per_s") / rate - 1.0).abs() < 0.01, "{row:?}");
    }
    let line = "bench square.ply --size 33x33 --rays scatter --engines scalar --repeat 1 --threads 1 --json";
    assert_eq!(run(&dir, line).json()["rows"][0]["rays"], 33 * 33);
}

/// Two files of one name, the second a triangle: a heading, a name in the rows and a picture for each.
#[test]
fn scenes_of_one_name_have_rows_and_pictures_of_their_own() {
    let dir = square();
    let triangle = SQUARE.replace("element face 2", "element face 1").replace("3 0 2 3\n", "");
    for (folder, text) in [("a", SQUARE), ("b", triangle.as_str())] {
        std::fs::create_dir(dir.path().join(folder)).expect("a folder");
        std::fs::write(dir.path().join(folder).join("m.ply"), text).expect("a scene");
    }
    let line = "bench a/m.ply b/m.ply --size 16x16 --rays primary --engines scalar --repeat 1 -o out";
    let table = run(&dir, line).out;
    assert!(table.contains("m: 2 primitives") && table.contains("m-2: 1 primitives"), "{table}");
    assert_eq!(files(&dir.path().join("out")), ["bench.csv", "bench.env.txt", "m-2.exr", "m.exr"]);
    let csv = std::fs::read_to_string(dir.path().join("out/bench.csv")).expect("rows");
    assert!(csv.contains(",m,") && csv.contains(",m-2,"), "{csv}");
    let triangles = |name: &str| {
        let film = lanecast::film::exr::read(&dir.path().join("out").join(name)).expect("an EXR");
        film.u32_plane("id.primitive").expect("ids").iter().filter(|&&id| id == 1).count()
    };
    assert!(triangles("m.exr") > 0 && triangles("m-2.exr") == 0);
}

/// Rays that a camera makes under the clock are checked against those it makes beforehand, in either precision: with an eye point,
/// where engines are told where the rays go, and without.
#[test]
fn cameras_make_the_rays_that_are_checked() {
    let dir = square();
    for (scene, engines) in [("square.ply", "scalar,packet8,stream,tile"), ("builtin:die", "scalar,packet8,stream")] {
        for precision in ["f32", "f64"] {
            for projection in ["", " --az 35 --el 25"] {
                let engines = if precision == "f64" { "scalar,packet8,stream" } else { engines };
                let line = format!("bench {scene} --size 70x40 --rays primary,camera --engines {engines} --repeat 1");
                let line = format!("{line} --precision {precision}{projection} -o out");
                run(&dir, &line);
                let csv = std::fs::read_to_string(dir.path().join("out/bench.csv")).expect("rows");
                let made = csv.lines().filter(|row| row.contains(",camera,") && row.contains(",ok,")).count();
                assert_eq!(made, engines.split(',').count(), "{line}: {csv}");
            }
        }
    }
}

/// Three threads, however many cores there are: rows of one, two and three, with one checksum.
#[test]
fn scaling_has_rows_of_each_number_of_threads() {
    let dir = square();
    let line = "bench square.ply --size 64x32 --rays primary,ao --engines scalar,tile --repeat 3 --threads 3 --scaling";
    let table = run(&dir, line).out;
    let heading = table.lines().find(|line| line.contains("each")).expect("the table of threads");
    assert_eq!(
        heading.split_whitespace().collect::<Vec<_>>(),
        ["rays", "engine", "1", "each", "2", "each", "3", "each"]
    );
    let of_threads = table.split(heading).nth(1).expect("its lines").lines().filter(|line| line.contains("100%"));
    assert_eq!(of_threads.count(), 2 * 2, "{table}");
    let report = run(&dir, &format!("{line} --json")).json();
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 2 * 2 * 3, "{report}");
    for class in ["primary", "ao"] {
        for engine in ["scalar", "tile"] {
            let of: Vec<_> = rows.iter().filter(|row| row["class"] == class && row["engine"] == engine).collect();
            let mut threads: Vec<_> = of.iter().filter_map(|row| row["threads"].as_u64()).collect();
            threads.sort_unstable();
            assert_eq!(threads, [1, 2, 3]);
            for row in &of {
                let (timed, each) = (&row["outcome"]["timed"], row["efficiency"].as_f64().expect("efficiency"));
                assert_eq!(timed["checksum"], of[0]["outcome"]["timed"]["checksum"], "{report}");
                assert!(if row["threads"] == 1 { each == 1.0 } else { each > 0.0 }, "{row}");
            }
        }
    }
    binary::refused(dir.path(), &["bench", "square.ply", "--threads", "1", "--scaling"], "--threads 2 or more");
}

#[test]
fn peers_are_rows_and_a_missing_one_says_so() {
    let dir = square();
    let line = "bench square.ply --size 64x32 --rays primary,ao --engines scalar,packet8 --repeat 3 \
                --peers obvhs,embree,obvhs,tinybvh --embree nowhere.so --json";
    let report = run(&dir, line).json();
    let rows = report["rows"].as_array().expect("rows");
    assert!(report["run"]["rustc"].as_str().is_some_and(|name| name.starts_with("rustc ")), "{}", report["run"]);
    assert!(report["run"]["flags"].is_string(), "{}", report["run"]);
    assert_eq!(rows.len(), 12, "2 classes x (2 engines, 2 trees of obvhs, no Embree, no tinybvh): {report}");
    let rate = report["ports"]["multiply_add"]["per_cycle"].as_f64();
    assert!(rate.is_some_and(|rate| (0.2..8.0).contains(&rate)), "{}", report["ports"]);
    let hits = |engine: &str, class: &str| {
        let found = rows.iter().find(|row| row["engine"] == engine && row["class"] == class);
        found.and_then(|row| row["outcome"]["timed"]["hits"].as_u64()).unwrap_or_else(|| panic!("{engine}: {report}"))
    };
    for class in ["primary", "ao"] {
        for peer in ["obvhs-bvh2", "obvhs-cwbvh"] {
            assert_eq!(hits(peer, class), hits("scalar", class), "{peer} {class}");
        }
    }
    for row in rows {
        let (peer, outcome) = (&row["peer"], &row["outcome"]);
        match row["engine"].as_str() {
            Some("embree") => assert!(outcome["skipped"].as_str().is_some_and(|why| why.contains("nowhere.so"))),
            Some("tinybvh") => assert!(outcome["skipped"].as_str().is_some_and(|why| why.contains("C++ header"))),
            Some("scalar" | "packet8") => assert!(peer.is_null()),
            _ => assert!(peer["lead"].as_f64() > Some(0.0) && peer["quoted"] == true, "{row}"),
        }
    }
    // Scattered rays begin and end on surfaces: nobody is wrong there for not having our last bit.
    let line = "bench square.ply --size 64x32 --rays scatter --engines scalar --repeat 3 --peers obvhs --json";
    let rows = run(&dir, line).json()["rows"].clone();
    for row in rows.as_array().expect("rows").iter().filter(|row| row["engine"] != "scalar") {
        assert!(row["outcome"]["skipped"].as_str().is_some_and(|why| why.contains("on surfaces")), "{row}");
    }
    assert_eq!(rows.as_array().map(Vec::len), Some(3), "{rows}");
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

/// Engines get as many rays at a time for a picture of costs as they trace together.
#[test]
fn pictures_of_costs_show_what_explain_counts() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (same, engines) = ("builtin:cornell --size 64x64", ["scalar", "packet16", "stream", "tile"]);
    let report = run(&dir, &format!("explain {same} --rays primary --engine {} --json", engines.join(","))).json();
    for (i, engine) in engines.iter().enumerate() {
        run(&dir, &format!("render {same} --engine {engine} --aov cost.nodes -o {engine}.exr"));
        let film = lanecast::film::exr::read(&dir.path().join(format!("{engine}.exr"))).expect("an EXR");
        let nodes = film.f32_plane("cost.nodes").expect("a plane");
        let mean = nodes.iter().map(|&n| f64::from(n)).sum::<f64>() / nodes.len() as f64;
        let want = report["classes"][0]["engines"][i]["nodes_per_ray"].as_f64().expect("a number");
        assert!((mean / want - 1.0).abs() < 0.02, "{engine}: {mean}, explain says {want}");
    }
}

/// Rays that start on surfaces, where there is none.
#[test]
fn explain_of_nothing_speaks_of_no_primitives() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("empty.kdl"), "").expect("a scene");
    let said = run(&dir, "explain empty.kdl --rays ao --engine scalar --size 16x16").out;
    assert!(said.contains("there are no rays") && !said.contains("other primitives"), "{said}");
}

#[test]
fn shapes_that_a_precision_cannot_hold_are_told_of() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("s.kdl"), "sphere\nbox { scale 1e-40 1 1 }\ncone { scale 1e39 }\n")
        .expect("a scene");
    for (precision, dropped) in [("f32", 2), ("f64", 0)] {
        let line = format!("info s.kdl --precision {precision}");
        let counts = run(&dir, &format!("{line} --json")).json()["counts"].clone();
        let of = ["dropped_singular", "primitives"].map(|key| counts[key].as_u64());
        assert_eq!(of, [Some(dropped), Some(3 - dropped)], "{counts}");
        let text = run(&dir, &line).out;
        assert_eq!(text.contains("2 shapes too thin or too large for f32"), dropped == 2, "{text}");
    }
}

/// What is dropped is counted in no instance.
#[test]
fn dropped_triangles_are_in_no_instance() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    // The second triangle has no area.
    std::fs::write(dir.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 2\n").expect("a mesh");
    let scene = "define \"m\" { mesh \"m.obj\" }\n".to_owned() + &"instance \"m\" { translate 2 0 0 }\n".repeat(3);
    std::fs::write(dir.path().join("s.kdl"), scene).expect("a scene");
    let counts = run(&dir, "info s.kdl --json").json()["counts"].clone();
    let of = ["primitives", "instanced_primitives", "dropped_degenerate"].map(|key| counts[key].as_u64());
    assert_eq!(of, [Some(1), Some(3), Some(1)], "{counts}");
}

#[test]
fn what_nothing_places_is_counted_nowhere() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let placed = "define \"hill\" { terrain size=4 }\ninstance \"hill\"\n";
    std::fs::write(dir.path().join("one.kdl"), placed).expect("a scene");
    let unplaced = "define \"hall\" { terrain size=16; sphere }\ndefine \"ball\" { sphere; instance \"hall\" }\n";
    std::fs::write(dir.path().join("more.kdl"), format!("{unplaced}{placed}")).expect("a scene");
    let counted = |scene: &str| {
        let report = run(&dir, &format!("info {scene} --json")).json();
        let counts =
            ["objects", "instances", "primitives", "instanced_primitives"].map(|key| report["counts"][key].as_u64());
        (counts, report["tree"].clone(), report["bytes"].clone())
    };
    assert_eq!(counted("more.kdl"), counted("one.kdl"));
    let said = run(&dir, "explain more.kdl --engine scalar --size 16x16").out;
    assert!(said.contains("32 primitives") && !said.contains("other primitives"), "{said}");
}

/// Two nodes with one mesh, a triangle, one of them turned on its side.
const TWO_NODES: &str = r#"{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "nodes": [{"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 0, "rotation": [0.6, 0, 0, 0.8]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri":
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn what_is_joined_is_said_and_can_be_left_apart() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("two.gltf"), TWO_NODES).expect("a scene");
    let counts = |line: &str| {
        let counts = &run(&dir, line).json()["counts"];
        ["objects", "instances", "joined", "primitives"].map(|key| counts[key].as_u64().expect("a number"))
    };
    assert_eq!(counts("info two.gltf --json"), [1, 2, 2, 2]);
    assert_eq!(counts("info two.gltf --json --apart"), [1, 2, 0, 1]);
    assert!(run(&dir, "info two.gltf").out.contains("placed 2 times, 2 traced as one mesh"));
    assert!(run(&dir, "info two.gltf --apart").out.contains("placed 2 times\n"));
    assert_eq!(run(&dir, "verify two.gltf --rays 300 --json").json()["pass"], true);
}

/// Two spheres of radius 10 in regions of their own, at the origin and at x = 30.
const TWO_SPHERES: &str = "title {t}\nunits mm\n\
    put {a.s} sph V {0 0 0} A {10 0 0} B {0 10 0} C {0 0 10}\nput {b.s} sph V {30 0 0} A {10 0 0} B {0 10 0} C {0 0 10}\n\
    put {a.r} comb region yes tree {l a.s}\nput {b.r} comb region yes tree {l b.s}\n\
    put {all.g} comb region no tree {u {l a.r} {l b.r}}\n";

/// Both from above, 100 units wide; MGED's script names the second only.
const SECOND_SPHERE: &str = "#!/bin/sh\nrt -M \\\n -o one.rt.pix\\\n $*\\\n 'two.g'\\\n 'b.r' \\\n 2>> one.rt.log\\\n <<EOF\n\
    viewsize 100;\neye_pt 15.3 0.2 100;\nviewrot 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1;\nstart 0;\nend;\n\nEOF\n";

#[test]
fn every_command_shows_the_objects_of_a_view_script() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in [("two.asc", TWO_SPHERES), ("one.rt", SECOND_SPHERE), ("script", "click 34 49\nclick 65 49\n")]
    {
        std::fs::write(dir.path().join(name), text).expect("a file");
    }
    // A pixel's lower left corner is (px - 34.7, 49.2 - py).
    let pixels = (0..100 * 100).map(|i| (f64::from(i % 100) - 64.7, 49.2 - f64::from(i / 100)));
    let seen = pixels.filter(|(x, y)| x.hypot(*y) < 10.0).count();
    let json = |line: &str| run(&dir, &format!("{line} --view one.rt --size 100x100 --json")).json();
    assert_eq!(json("rays two.asc --kind shadow -o rays.npy")["live"], seen);
    assert_eq!(json("rays two.asc --top all.g --kind shadow -o rays.npy")["live"], 2 * seen, "--top is stronger");
    let verified = json("verify two.asc --kinds primary --precision f64");
    assert!(verified["lines"].as_array().expect("lines").iter().all(|line| line["hits"] == seen), "{verified}");
    let row = &json("bench two.asc --rays primary --engines scalar --repeat 1")["rows"][0];
    assert_eq!((&row["scene"]["prims"], &row["outcome"]["timed"]["hits"]), (&1.into(), &seen.into()));
    assert_eq!(json("explain two.asc --engine scalar")["tree"]["prims"], 1);
    assert_eq!(json("render two.asc -o two.exr")["holds"]["primitives"], 1);
    let said = run(&dir, "view two.asc --view one.rt --size 100x100 --headless-script script").out;
    let said: Vec<serde_json::Value> = said.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert!(said[0]["hit"].is_null() && !said[1]["hit"].is_null(), "{said:?}");
}

/// A sphere, and a solid of a kind that is not shown.
const WITH_ARS: &str = "title {t}\nunits mm\nput {a.s} sph V {0 0 0} A {10 0 0} B {0 10 0} C {0 0 10}\n\
    put {e.s} ars NC 3 PPC 3 C0 {{0 0 0}} C1 {{1 0 0}} C2 {{2 0 0}}\nput {a.r} comb region yes tree {l a.s}\n\
    put {e.r} comb region yes tree {l e.s}\nput {all.g} comb region no tree {u {l a.r} {l e.r}}\n";

#[test]
fn every_command_says_once_what_a_scene_is_shown_without() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("ars.asc"), WITH_ARS).expect("a database");
    std::fs::write(dir.path().join("script"), "frame 0\n").expect("a script");
    for line in [
        "render ars.asc --size 8x8 -o a.exr",
        "rays ars.asc --size 8x8 --kind primary -o rays.npy",
        "trace ars.asc --rays rays.npy --repeat 1",
        "info ars.asc",
        "explain ars.asc --size 8x8 --engine scalar",
        "verify ars.asc --rays 50 --kinds primary",
        "convert ars.asc -o a.stl --cells 8",
        "bench ars.asc --size 8x8 --rays primary --engines scalar --repeat 1 -o out",
        "view ars.asc --size 8x8 --headless-script script",
    ] {
        let left_out = |more: &str| {
            let said = run(&dir, &format!("{line} --lenient{more}")).err;
            said.lines().filter(|line| line.starts_with("warning: left out: `e.s`")).count()
        };
        assert_eq!((left_out(""), left_out(" -q")), (1, 0), "{line}");
    }
}

/// Ctrl-C in the middle of a bench: exit code 130, and the output is whole.
#[cfg(unix)]
#[test]
fn an_interrupted_bench_ends_with_130_and_valid_output() {
    use std::process::{Command, Stdio};
    let line = "bench builtin:cornell --size 64x64 --rays primary,ao --repeat 1000000 --json";
    let child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(line.split(' '))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    binary::watch::until_it_listens(child.id());
    std::thread::sleep(std::time::Duration::from_millis(700));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = child.wait_with_output().expect("an end");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("interrupted"), "{err}");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(report["rows"].is_array());
}

#[test]
fn two_runs_are_compared() {
    let dir = square();
    // `auto` is `tile` here: one row, or the file could not be compared; nor could it with a class twice.
    let bench =
        "bench square.ply --rays primary,primary --engines scalar,tile,auto --size 32x32 --repeat 3 --threads 1 -o";
    run(&dir, &format!("{bench} old"));
    run(&dir, &format!("{bench} new"));
    let text = run(&dir, "bench --compare old new/bench.csv").out;
    assert!(text.contains("square") && text.contains("tile") && text.contains("scalar"), "{text}");
    let same = run(&dir, "bench --compare old old --json").json();
    let rows = same["rows"].as_array().expect("rows");
    assert_eq!((rows.len(), &same["compared"]), (2, &serde_json::json!(2)));
    assert!(["faster", "slower", "only_old", "only_new"].iter().all(|count| same[count] == 0), "{same}");
    assert!(rows.iter().all(|row| row["verdict"] == "no difference seen" && row["factor"] == 1.0), "{same}");
    let csv = std::fs::read_to_string(dir.path().join("old/bench.csv")).expect("rows");
    let header = csv.lines().next().expect("a header");
    assert!(header.ends_with(",seconds") && csv.lines().nth(1).expect("a row").split(' ').count() >= 3, "{csv}");
    binary::refused(dir.path(), &["bench", "--compare", "old", "nowhere"], "nowhere");
    let other = csv.replace(",primary,", ",ao,");
    std::fs::write(dir.path().join("other.csv"), other).expect("a file");
    binary::refused(dir.path(), &["bench", "--compare", "old", "other.csv"], "only old: 2, only new: 2");
    // Rows of versions without single passes still compare.
    let committed = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("results/amd-epyc-avx512");
    let [older, newer] = ["2026-11-21-c2763bb", "2026-11-21-c32b661"].map(|run| committed.join(run).join("sponza"));
    if older.exists() {
        let line = format!("bench --compare {} {}", older.display(), newer.display());
        assert!(run(&dir, &line).out.contains("sponza"), "{line}");
    } else {
        println!("SKIPPED: no committed results (packaged sources leave them out)");
    }
    std::fs::write(dir.path().join("bad.csv"), "a,b\n1,2\n").expect("a file");
    binary::refused(dir.path(), &["bench", "--compare", "old", "bad.csv"], "bad.csv:1:1");
}

#[test]
fn programs_take_turns_and_are_compared() {
    let dir = square();
    let own = env!("CARGO_BIN_EXE_lanecast");
    let words = "bench --rays primary --engines scalar,packet4 --size 32x32 --repeat 3 --threads 1 --turns 3";
    let words = format!("{words} --against {own} -qv -o turns --json -- square.ply");
    let changes = run(&dir, &words).json();
    let rows = changes["rows"].as_array().expect("rows");
    assert!(rows.len() == 2 && rows.iter().all(|row| row["basis"] == "turns" && row["interval"]["low"].is_number()));
    for side in ["old", "new"] {
        assert_eq!(files(&dir.path().join("turns").join(side)), ["001", "002", "003"], "{side}");
    }
    let again = run(&dir, "bench --compare turns/old turns/new").out;
    assert!(again.contains("2 rows compared"), "{again}");
    binary::refused(dir.path(), &["bench", "--against", "nowhere/lanecast"], "nowhere/lanecast");
    binary::refused(dir.path(), &words.split(' ').collect::<Vec<_>>(), "earlier run");
    binary::refused(dir.path(), &["bench", "square.ply", "--against", "true"], "true bench: wrote no rows");
    for (bad, what) in [("bench none.ply", "none.ply"), ("bench square.ply --engines scaler", "scalar")] {
        let line = format!("{bad} --against {own} -o bad");
        binary::refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
}

#[test]
fn history_keeps_rows_and_names_their_revision() {
    let dir = square();
    let words =
        "bench square.ply --rays primary --engines scalar --size 16x16 --repeat 2 --threads 1 --record results --dirty";
    run(&dir, words);
    run(&dir, words);
    let machine = dir.path().join("results").join(&files(&dir.path().join("results"))[0]);
    let revision = files(&machine).remove(0);
    assert_eq!(files(&machine.join(revision)), ["square", "square-2"]);
}

/// An engine by two names, a class twice.
#[test]
fn explain_takes_each_engine_and_class_once() {
    let words = "explain square.ply --engine auto,tile,scalar --rays ao,primary,ao --size 16x16 --precision f32 --json";
    let report = run(&square(), words).json();
    let classes = report["classes"].as_array().expect("classes");
    assert_eq!(classes.iter().map(|class| class["rays"].clone()).collect::<Vec<_>>(), ["ao", "primary"]);
    for class in classes {
        let engines = class["engines"].as_array().expect("engines");
        assert_eq!(engines.iter().map(|work| work["engine"].clone()).collect::<Vec<_>>(), ["tile", "scalar"]);
    }
}

#[test]
fn explain_counts_compares_and_draws() {
    let dir = square();
    let words = "explain builtin:cornell --rays primary,shadow --engine scalar,packet8 --size 128x96 -o why";
    let report = run(&dir, &format!("{words} --json")).json();
    let engines = |class: usize| report["classes"][class]["engines"].as_array().expect("engines").clone();
    let nodes = |class: usize, engine: usize| engines(class)[engine]["nodes_per_ray"].as_f64().expect("a number");
    assert!(nodes(0, 1) < nodes(0, 0) && nodes(1, 1) < nodes(1, 0), "packets share visits: {report}");
    assert_eq!(engines(0)[1]["packets"].as_u64(), Some(128 * 96 / 8));
    assert!(report["tree"]["leaves"].as_u64() > Some(0), "{report}");
    for (work, lanes) in engines(0).iter().zip([1, 8]) {
        let limit = |key: &str| work["limit"][key].as_f64().expect("a limit: the box is of triangles");
        assert!((limit("percent") - 100.0 * limit("ns_per_ray") / limit("measured_ns_per_ray")).abs() < 1e-6);
        assert!(limit("boxes") > 0.0 && work["bytes_per_ray"].as_f64() > Some(0.0), "{work}");
        // A single ray has nobody to part from.
        let parted = work["per_packet"]["divergence"]["max"].as_f64();
        assert_eq!((work["together"].is_null(), parted > Some(0.0)), (lanes == 1, lanes > 1), "{work}");
    }
    let drawn = files(&dir.path().join("why"));
    assert_eq!(drawn.len(), 8, "2 classes x 2 engines x (EXR, PNG): {drawn:?}");
    let film = lanecast::film::exr::read(&dir.path().join("why/cost-primary-scalar.exr")).expect("an EXR");
    let nodes_map = film.f32_plane("cost.nodes").expect("a plane");
    assert!(nodes_map.len() == 128 * 96 && nodes_map.iter().any(|&n| n > 1.0));
    let text = run(&dir, words).out;
    assert!(
        text.contains("SAH cost") && text.contains("per packet") && text.contains("times as fast as scalar"),
        "{text}"
    );
    assert!(text.contains("of the limit") && text.contains("rays part at depth"), "{text}");
    // The limit is of triangles.
    let flake = run(&dir, "explain builtin:sphere-flake --engine scalar --size 32x32 --json").json();
    assert!(flake["classes"][0]["engines"][0]["limit"].is_null() && flake["costs"]["ns_box"].is_number(), "{flake}");
    binary::refused(dir.path(), &["explain", "square.ply", "--engine", "paket8"], "packet8");
}

/// All rays of a picture are held at once: more than fit are refused, not tried.
#[test]
fn pictures_beyond_all_memory_are_refused() {
    let dir = square();
    let film = "more than 268435456 pixels in one film";
    for (line, what) in [
        ("rays square.ply --kind primary --size 65536x65536 -o r.npy", film),
        ("rays square.ply --kind scatter --size 16384x16385 -o r.npy", film),
        ("bench square.ply --size 65536x65536 --engines scalar --threads 1", film),
        ("explain square.ply --size 65536x65536 --engine scalar", film),
        ("verify square.ply --size 65536x65536", "verify takes at most 10000000"),
        ("verify square.ply --size 3200x3200", "3200x3200 rays per class"),
        ("verify square.ply --rays 10000001", "10000000"),
    ] {
        binary::refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    assert_eq!(files(dir.path()), ["square.ply"]);
}

/// Two scenes' worth of steps; a killed experiment goes on without measuring anything twice.
#[test]
fn experiments_resume_where_they_were() {
    let dir = square();
    let at = |name: &str| dir.path().join(name);
    let text = "experiment \"tiny\" {\n question \"is it there?\"\n scenes square.ply\n rays primary diffuse primary\n \
                engines scalar packet4 scalar\n size \"32x32\" \"64x64\"\n repeat 3\n}";
    std::fs::write(at("tiny.kdl"), text).expect("a file");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["bench", "--experiment", "tiny.kdl", "-o", "out", "-q"])
        .current_dir(dir.path())
        .spawn()
        .expect("the binary runs");
    let first = at("out/square-32x32-t1-balanced/primary/bench.csv");
    let begun = std::time::Instant::now();
    while !first.exists() && begun.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    // The process may have ended by itself; what is there is whole either way.
    let _gone = child.kill();
    child.wait().expect("it ended");
    let kept = std::fs::read_to_string(&first).expect("rows");
    assert!(kept.contains("lanecast bench square.ply --rays primary --engines scalar,packet4,scalar --size"), "{kept}");
    assert_eq!(kept.lines().count(), 1 + 2, "each engine once: {kept}");
    let ended = run(&dir, "bench --experiment tiny.kdl -o out");
    assert!(ended.err.contains("of 4 steps are finished already"), "{}", ended.err);
    assert_eq!(std::fs::read_to_string(&first).expect("rows"), kept, "nothing is measured twice");
    let again = run(&dir, "bench --experiment tiny.kdl -o out");
    assert!(
        again.err.contains("4 of 4 steps are finished already") && again.err.contains("0 steps in"),
        "{}",
        again.err
    );
    // What is not there is said before anything is measured, or a folder made.
    let scenes = text.replace("scenes square.ply", "scenes square.ply \"builtin:cornel\"");
    for (wrong, what) in [(scenes, "`builtin:cornell`"), (text.replace("packet4", "packet5"), "packet5")] {
        std::fs::write(at("wrong.kdl"), wrong).expect("a file");
        binary::refused(dir.path(), &["bench", "--experiment", "wrong.kdl", "-o", "wrong", "-q"], what);
        assert!(!at("wrong").exists(), "{what}");
    }
    // From another folder: the commands of the rows name the scene as it is found from here.
    std::fs::create_dir(at("sub dir")).expect("a folder");
    std::fs::write(at("sub dir/near.ply"), SQUARE).expect("a scene");
    let near = "experiment \"near\" {\n scenes near.ply\n engines scalar\n size \"8x8\"\n repeat 3\n}";
    std::fs::write(at("sub dir/near.kdl"), near).expect("a file");
    let ended = lanecast(dir.path(), &["bench", "--experiment", "sub dir/near.kdl", "-o", "near"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let rows = std::fs::read_to_string(at("near/near-8x8-t1-balanced/primary/bench.csv")).expect("rows");
    assert!(rows.contains("lanecast bench 'sub dir/near.ply' --rays primary --engines scalar --size 8x8"), "{rows}");
    let report = run(&dir, "bench --experiment tiny.kdl -o out --json").json();
    let numbers = ["steps", "finished", "measured", "wrong"].map(|key| report[key].as_u64().expect("a number"));
    assert_eq!((numbers, report["experiment"].as_str()), ([4, 4, 0, 0], Some("tiny")), "{report}");
    assert!(report["run"]["command"].is_string() && report["ports"].is_object(), "{report}");
    let cases = files(&at("out"));
    assert_eq!(cases, ["experiment.kdl", "square-32x32-t1-balanced", "square-64x64-t1-balanced"]);
    run(&dir, "report out -o report.html");
    std::fs::write(at("tiny.kdl"), text.replace("packet4", "packet8")).expect("a file");
    binary::refused(dir.path(), &["bench", "--experiment", "tiny.kdl", "-o", "out", "-q"], "another experiment");
    binary::refused(dir.path(), &["bench", "--experiment", "square.ply"], "square.ply:10:1");
}
