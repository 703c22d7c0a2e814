//! `rays` and `trace` through the real binary, on a square whose hits are known in closed form.

mod binary;

use std::path::Path;

use binary::{SQUARE, files, lanecast, npy_parts, ray_file, refused};

const INFINITY: f32 = f32::INFINITY;

/// Down onto the square, beside it, ending above it, not unit, dead, not a number.
const RAYS: [[f32; 8]; 6] = [
    [0.75, 0.25, 2.0, 0.0, 0.0, 0.0, -1.0, INFINITY],
    [1.5, 0.25, 2.0, 0.0, 0.0, 0.0, -1.0, INFINITY],
    [0.75, 0.25, 2.0, 0.0, 0.0, 0.0, -1.0, 1.5],
    [0.25, 0.75, 2.0, 0.0, 0.0, 0.0, -4.0, INFINITY],
    [0.75, 0.25, 2.0, 1.0, 0.0, 0.0, -1.0, 0.0],
    [f32::NAN, 0.25, 2.0, 0.0, 0.0, 0.0, -1.0, INFINITY],
];

fn square() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("square.ply"), SQUARE).expect("a scene");
    std::fs::write(dir.path().join("rays.npy"), ray_file(&RAYS)).expect("rays");
    dir
}

fn trace(dir: &Path, more: &str) -> binary::Ended {
    let line = format!("trace square.ply --rays rays.npy {more}");
    lanecast(dir, &line.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn hits_are_where_they_must_be() {
    let dir = square();
    for engine in ["scalar", "brute", "packet4", "packet8", "packet16"] {
        let ended = trace(dir.path(), &format!("--engine {engine} --repeat 2 --hits hits.npy --json"));
        assert_eq!(ended.code, Some(0), "{engine}: {}", ended.err);
        assert_eq!(ended.json()["hits"], 2, "{engine}");
        let bytes = std::fs::read(dir.path().join("hits.npy")).expect("hits");
        let (header, data) = npy_parts(&bytes);
        assert!(header.contains("(6,)") && header.contains("'prim', '<u4'"), "{header}");
        let record = |i: usize| &data[20 * i..20 * i + 20];
        let t = |i: usize| f32::from_le_bytes(record(i)[..4].try_into().expect("four bytes"));
        let ids = |i: usize| record(i)[12..].to_vec();
        assert_eq!([0, 1, 2, 3, 4, 5].map(t), [2.0, INFINITY, INFINITY, 0.5, INFINITY, INFINITY], "{engine}");
        assert_eq!(ids(0), [0; 8], "{engine}: the first triangle is below the diagonal");
        assert_eq!(ids(3), [1, 0, 0, 0, 0, 0, 0, 0], "{engine}");
        assert_eq!(ids(1), [0xff; 8], "{engine}");
    }
}

#[test]
fn any_hit_writes_one_byte_per_ray() {
    let dir = square();
    for precision in ["f32", "f64"] {
        let ended = trace(dir.path(), &format!("--query any --precision {precision} --hits any.npy --json"));
        assert_eq!(ended.code, Some(0), "{}", ended.err);
        let bytes = std::fs::read(dir.path().join("any.npy")).expect("flags");
        let (header, data) = npy_parts(&bytes);
        assert!(header.contains("u1") && data == [1, 0, 0, 1, 0, 0], "{header} {data:?}");
    }
}

/// The keys that other tools read, and nothing else.
#[test]
fn json_has_the_agreed_keys() {
    let dir = square();
    let report = trace(dir.path(), "--json --repeat 3 --threads 1").json();
    let keys = |value: &serde_json::Value| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
    let mut got = keys(&report);
    got.sort();
    let want =
        "build_seconds bytes checksum engine hits isa mrays_per_s precision query rays repeat scene seconds threads";
    assert_eq!(got.join(" "), want);
    for (name, want) in
        [("seconds", "max median min"), ("mrays_per_s", "best median"), ("bytes", "nodes primitives total")]
    {
        let mut got = keys(&report[name]);
        got.sort();
        assert_eq!(got.join(" "), want);
    }
    assert_eq!((&report["rays"], &report["repeat"], &report["threads"]), (&6.into(), &3.into(), &1.into()));
    assert_eq!((&report["scene"], &report["query"]), (&"square.ply".into(), &"closest".into()));
    let total = report["bytes"]["nodes"].as_u64().zip(report["bytes"]["primitives"].as_u64()).map(|(a, b)| a + b);
    assert_eq!(report["bytes"]["total"].as_u64(), total);
}

/// No rays are no time inside: 0, not the -0 that a sum of nothing is.
#[test]
fn no_rays_are_0_inside() {
    let dir = square();
    std::fs::write(dir.path().join("rays.npy"), ray_file(&[])).expect("no rays");
    let report = trace(dir.path(), "--query all --repeat 1 --json");
    assert!(report.out.contains("\"stretches\":0,\"inside\":0.0,"), "{}{}", report.out, report.err);
    let text = trace(dir.path(), "--query all --repeat 1").out;
    assert!(text.contains("stretches 0, length 0.000000e0"), "{text}");
}

/// FNV-1a over the bytes of the hit file, worked out here again.
#[test]
fn the_checksum_is_that_of_the_hit_file_whatever_the_engine_and_threads() {
    let dir = square();
    let mut sums = Vec::new();
    for more in ["--engine scalar --threads 1", "--engine packet8 --threads 2", "--engine packet16"] {
        sums.push(trace(dir.path(), &format!("{more} --hits hits.npy --json")).json()["checksum"].clone());
    }
    let bytes = std::fs::read(dir.path().join("hits.npy")).expect("hits");
    let fnv = npy_parts(&bytes)
        .1
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    assert_eq!(sums, vec![serde_json::Value::from(format!("{fnv:016x}")); 3]);
}

/// All stretches through a ball: the keys of the other queries, counted by rays, and the checksum of the file.
#[test]
fn stretches_have_the_agreed_keys_too() {
    let dir = square();
    std::fs::write(dir.path().join("ball.kdl"), "union \"ball\" { sphere radius=1 }\n").expect("a scene");
    let line = "trace ball.kdl --rays rays.npy --query all --repeat 1 --hits all.npy --json";
    let mut said = Vec::new();
    for threads in ["1", "2"] {
        let ended = lanecast(dir.path(), &[&line.split(' ').collect::<Vec<_>>()[..], &["--threads", threads]].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.err);
        said.push(ended.json());
    }
    let report = &said[0];
    // The first ray and the fourth go through; the third ends inside, half a unit from where it enters and more.
    assert_eq!((&report["hits"], &report["stretches"], &report["rays"]), (&3.into(), &3.into(), &6.into()));
    for key in ["mrays_per_s", "bytes", "seconds", "checksum", "isa", "build_seconds"] {
        assert!(!report[key].is_null(), "{key}: {report}");
    }
    let total = report["bytes"]["nodes"].as_u64().zip(report["bytes"]["primitives"].as_u64()).map(|(a, b)| a + b);
    assert_eq!(report["bytes"]["total"].as_u64(), total);
    let bytes = std::fs::read(dir.path().join("all.npy")).expect("stretches");
    let fnv = npy_parts(&bytes)
        .1
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    for report in &said {
        assert_eq!(report["checksum"], format!("{fnv:016x}"));
    }
}

#[test]
fn errors_leave_no_files() {
    let dir = square();
    let before = files(dir.path());
    let path = dir.path();
    refused(path, &["trace", "square.ply", "--rays", "rays.npy", "--engine", "packet5", "--hits", "h.npy"], "packet");
    refused(path, &["trace", "square.ply", "--rays", "none.npy", "--hits", "h.npy"], "none.npy");
    refused(path, &["trace", "none.ply", "--rays", "rays.npy", "--hits", "h.npy"], "none.ply");
    refused(path, &["trace", "square.ply", "--rays", "square.ply", "--hits", "h.npy"], "square.ply");
    refused(path, &["trace", "square.ply", "--rays", "rays.npy", "--hits", "no/such/folder.npy"], "folder.npy");
    refused(path, &["trace", "square.ply", "--rays", "rays.npy", "--query", "most"], "closest");
    let all = ["trace", "square.ply", "--rays", "rays.npy", "--query", "all", "--engine"];
    for (engine, used) in [("scalar", "scalar"), ("packet8", "packet8"), ("auto", "packet8"), ("tile", "packet8")] {
        let ended = lanecast(path, &[&all[..], &[engine, "--repeat", "1", "--json"]].concat());
        assert_eq!((ended.code, &ended.json()["engine"]), (Some(0), &used.into()), "{engine}: {}", ended.err);
        let warns = ended.err.contains("--engine tile: --query all is answered by scalar or, as now, by packet8");
        assert_eq!(warns, engine == "tile", "{}", ended.err);
    }
    assert_eq!(files(path), before);
}

#[test]
fn a_file_without_rays_is_traced() {
    let dir = square();
    std::fs::write(dir.path().join("rays.npy"), ray_file(&[])).expect("rays");
    let report = trace(dir.path(), "--json").json();
    assert_eq!((&report["rays"], &report["hits"]), (&0.into(), &0.into()));
}

/// 40x24 pixels are two tiles of 32x32: 2048 rays, 960 of them live; all classes are as long.
#[test]
fn ray_files_of_every_class_come_back_through_trace() {
    let dir = square();
    for kind in ["primary", "shadow", "ao", "reflect", "diffuse"] {
        let line = format!("rays square.ply --kind {kind} --size 40x24 --seed 3 -o {kind}.npy --json");
        let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(0), "{kind}: {}", ended.err);
        let report = ended.json();
        assert_eq!(report["rays"], 2048, "{kind}");
        let live = report["live"].as_u64().expect("a number");
        assert!(if kind == "primary" { live == 960 } else { live > 0 && live < 960 }, "{kind}: {live}");
        let traced = lanecast(dir.path(), &["trace", "square.ply", "--rays", &format!("{kind}.npy"), "--json"]);
        assert_eq!((traced.code, &traced.json()["rays"]), (Some(0), &2048.into()), "{kind}: {}", traced.err);
        // Secondary rays leave a single flat square: none of them may hit it again.
        let hits = traced.json()["hits"].as_u64().expect("a number");
        assert!(if kind == "primary" { hits > 0 } else { hits == 0 }, "{kind}: {hits} hits");
    }
    let again = "rays square.ply --kind diffuse --size 40x24 --seed 3 --threads 1 -o again.npy";
    assert_eq!(lanecast(dir.path(), &again.split(' ').collect::<Vec<_>>()).code, Some(0));
    let read = |name: &str| std::fs::read(dir.path().join(name)).expect("a ray file");
    assert!(read("again.npy") == read("diffuse.npy"), "the same seed gives the same file on any number of threads");
}
