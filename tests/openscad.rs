//! OpenSCAD's models: the solids that we make of a `.csg` file are where OpenSCAD's own mesh of it is.
//!
//! The models of tests/openscad and scenes/openscad are ours, written as .scad and exported by OpenSCAD 2021.01. `SEEN`
//! is what rays see of the meshes that it makes of them; where there is an OpenSCAD (`LANECAST_OPENSCAD` names it, else
//! `openscad`), its meshes are made anew and compared ray by ray, and the table with them.

mod binary;

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use lanecast::lanes::Real;
use lanecast::ray::{Hits, Rays};
use lanecast::reference::{EngineHit, Oracle, OracleRay, Tally};
use lanecast::scene::description::{Description, Precision};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch};

/// Rays along a side of the square that is seen from each direction.
const SIDE: usize = 64;
const DIRECTIONS: [DVec3; 3] = [DVec3::new(0.3, 0.5, -0.8), DVec3::new(-0.9, 0.21, 0.3), DVec3::new(0.02, 0.03, 1.0)];
/// The share of rays that may see something else: those that pass within roundings of an edge.
const EDGES: f64 = 0.001;

/// What OpenSCAD's mesh of a model is like.
struct Seen {
    /// Its file in the package, without the extension.
    model: &'static str,
    lo: DVec3,
    hi: DVec3,
    /// Rays that meet it.
    hits: usize,
    /// How far they go until then, on average.
    depth: f64,
}

const fn seen(model: &'static str, lo: [f64; 3], hi: [f64; 3], hits: usize, depth: f64) -> Seen {
    Seen { model, lo: DVec3::from_array(lo), hi: DVec3::from_array(hi), hits, depth }
}

const SEEN: [Seen; 9] = [
    seen("tests/openscad/bool", [-5.0, -5.0, -5.0], [23.5, 25.0, 9.0], 1593, 40.59308),
    seen("tests/openscad/cyl", [-10.0, -20.0, -2.5], [50.0, 40.0, 5.0], 3435, 82.64678),
    seen("tests/openscad/hull", [-1.66477, -1.80143, -4.5], [70.0, 27.0, 10.0], 929, 74.31821),
    seen("tests/openscad/lin", [-4.64739, -4.64739, -3.0], [50.0, 21.0, 6.0], 782, 60.24404),
    seen("tests/openscad/off", [-1.80194, -1.5, 0.0], [71.0, 45.0, 2.0], 1088, 84.33819),
    seen("tests/openscad/poly", [-10.0, -10.0, -4.75528], [38.0, 49.6, 10.0], 975, 73.20201),
    seen("tests/openscad/rot", [-7.0, -6.92875, -1.94986], [42.4271, 25.7138, 7.0], 834, 58.53718),
    seen("tests/openscad/sphere", [-10.0, -9.94522, -9.94522], [29.6194, 29.6194, 9.94522], 1565, 53.58845),
    seen("scenes/openscad/bracket", [0.0, -25.0, -6.60999], [60.0, 25.0, 60.0], 3537, 97.16018),
];

impl Seen {
    fn file(&self) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(self.model).with_extension("csg")
    }
}

fn scene(path: &Path) -> Description {
    load(path.to_str().unwrap(), &LoadOptions::default()).unwrap()
}

/// Parallel rays, beside the lattice that models have.
fn rays<S: Real>(seen: &Seen) -> Rays<S> {
    let (centre, size) = ((seen.lo + seen.hi) * 0.5, (seen.hi - seen.lo).length());
    let mut rays = Rays::new(DIRECTIONS.len() * SIDE * SIDE);
    for (d, dir) in DIRECTIONS.into_iter().enumerate() {
        let (right, up) = dir.normalize().any_orthonormal_pair();
        for i in 0..SIDE * SIDE {
            let place = |n: usize| (n as f64 + 0.3819) / SIDE as f64 - 0.5;
            let org = centre + (right * place(i % SIDE) + up * place(i / SIDE)) * size - dir.normalize() * size;
            let s = |v: DVec3| v.to_array().map(S::from_f64);
            rays.set(d * SIDE * SIDE + i, s(org), s(dir.normalize()), S::from_f64(0.0), S::from_f64(f64::INFINITY));
        }
    }
    rays
}

/// Where the rays first meet something, `None` for nothing.
fn first_hits(description: &Description, seen: &Seen) -> Vec<Option<f64>> {
    let world = World::<f64>::compile(description, Preset::Fast).unwrap();
    let engine = f64::engines().iter().find(|engine| engine.name() == "scalar").unwrap();
    let (mut hits, rays) = (Hits::default(), rays::<f64>(seen));
    engine.intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
    (0..rays.len()).map(|i| hits.is_hit(i).then(|| hits.t[i])).collect()
}

fn summary(hits: &[Option<f64>]) -> (usize, f64) {
    let met: Vec<f64> = hits.iter().copied().flatten().collect();
    (met.len(), met.iter().sum::<f64>() / met.len().max(1) as f64)
}

/// What is wrong if a model is not the one of the table, seen by as many rays as far away.
fn fault(seen: &Seen, what: &str, hits: &[Option<f64>]) -> Option<String> {
    let (count, depth) = summary(hits);
    let is_right = (count as f64 - seen.hits as f64).abs() <= EDGES * hits.len() as f64
        && (depth - seen.depth).abs() < 1e-3 * (seen.hi - seen.lo).length();
    let Seen { model, hits, .. } = seen;
    (!is_right).then(|| format!("{model}: {what}: {count} hits {depth} away, not {hits} hits {} away", seen.depth))
}

#[test]
fn models_are_where_openscad_has_them() {
    let fault = |seen: &Seen| fault(seen, "ours", &first_hits(&scene(&seen.file()), seen));
    let faults: Vec<String> = SEEN.iter().filter_map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn rays_meet_what_they_meet_of_openscads_mesh() {
    let program = std::env::var("LANECAST_OPENSCAD").unwrap_or_else(|_| "openscad".to_owned());
    if !Command::new(&program).arg("--version").output().is_ok_and(|out| out.status.success()) {
        println!("SKIPPED: {program} not found");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut faults = Vec::new();
    for seen in &SEEN {
        let model = seen.file();
        let mesh = folder.path().join(model.with_extension("stl").file_name().unwrap());
        let out = Command::new(&program).arg("-o").arg(&mesh).arg(&model).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let theirs = scene(&mesh);
        let (lo, hi) = theirs.meshes[0].bounds().unwrap();
        let mut found = Seen { lo, hi, ..*seen };
        let (ours, theirs) = (first_hits(&scene(&model), &found), first_hits(&theirs, &found));
        (found.hits, found.depth) = summary(&theirs);
        // What belongs into the table, if it is not there.
        let [low, high] = [lo, hi].map(|p| p.to_array());
        println!("    seen({:?}, {low:?}, {high:?}, {}, {:.5}),", seen.model, found.hits, found.depth);
        let size = (hi - lo).length();
        let off = (lo - seen.lo).length().max((hi - seen.hi).length());
        faults.extend((off > 1e-4 * size).then(|| format!("{}: {lo} to {hi}", seen.model)));
        faults.extend(fault(seen, "theirs", &theirs));
        let differs = |(a, b): &(&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => (*a - *b).abs() > 1e-3 * size,
            (a, b) => a.is_some() != b.is_some(),
        };
        let different = ours.iter().zip(&theirs).filter(differs).count();
        println!("{}: {different} of {} rays differ", seen.model, ours.len());
        let too_many = different as f64 > EDGES * ours.len() as f64;
        faults.extend(too_many.then(|| format!("{}: {different} rays differ", seen.model)));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// All engines agree to the bit, and the oracle explains what they say.
fn judged<S: Engines>(seen: &Seen, precision: Precision) {
    let description = scene(&seen.file());
    let world = World::<S>::compile(&description, Preset::Fast).unwrap();
    let oracle = Oracle::new(&world.assembly);
    let rays = rays::<S>(seen);
    let (mut hits, mut first) = (Hits::<S>::default(), None);
    for engine in S::engines().iter().filter(|engine| engine.name() != "brute") {
        engine.intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
        let bits = |i: usize| (hits.t[i].to_f64().to_bits(), hits.prim[i]);
        let all: Vec<_> = (0..rays.len()).map(bits).collect();
        assert_eq!(&all, first.get_or_insert(all.clone()), "{}: {}", seen.model, engine.name());
    }
    let mut tally = Tally::default();
    for i in (0..rays.len()).step_by(7) {
        let v = |p: [S; 3]| DVec3::from_array(p.map(Real::to_f64));
        let ray = OracleRay { org: v(rays.org(i)), dir: v(rays.dir(i)), t_min: 0.0, t_max: f64::INFINITY };
        let [t, u, v] = [hits.t[i], hits.u[i], hits.v[i]].map(Real::to_f64);
        let answer = hits.is_hit(i).then(|| EngineHit { t, u, v, prim: hits.prim[i], inst: hits.inst[i] });
        tally.add(answer.is_some(), &oracle.judge(&ray, answer, precision));
    }
    assert!(tally.is_clean() && tally.hits > 0, "{} {precision:?}: {tally}", seen.model);
}

#[test]
fn the_oracle_explains_every_answer() {
    for seen in &SEEN {
        judged::<f64>(seen, Precision::F64);
        judged::<f32>(seen, Precision::F32);
    }
}

/// A nut: six flats, a round hole of twelve faces, 4 high.
const NUT: &str = "difference() {\n\tcylinder($fn = 6, h = 4, r1 = 10, r2 = 10, center = false);\n\
    \tmultmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]) {\n\
    \t\tcylinder($fn = 12, h = 9, r1 = 5, r2 = 5, center = false);\n\t}\n}\n";

#[test]
fn rays_meet_known_planes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nut.csg");
    std::fs::write(&path, NUT).unwrap();
    let description = scene(&path);
    let world = World::<f64>::compile(&description, Preset::Fast).unwrap();
    let oracle = Oracle::new(&world.assembly);
    let flat = 10.0 * 30f64.to_radians().cos();
    let bore = 5.0 * 15f64.to_radians().cos();
    let (sin, cos) = 15f64.to_radians().sin_cos();
    for (org, dir, want) in [
        (DVec3::new(0.1, 20.0, 2.0), DVec3::NEG_Y, Some(20.0 - flat)),
        (DVec3::new(7.0, 0.0, 20.0), DVec3::NEG_Z, Some(16.0)),
        (DVec3::new(1.0, 1.0, 20.0), DVec3::NEG_Z, None),
        // From the axis to the middle of a face of the hole, and from a corner of it inwards.
        (DVec3::new(0.0, 0.0, 2.0), DVec3::new(cos, sin, 0.0), Some(bore)),
        (DVec3::new(-20.0, 0.0, 2.0), DVec3::X, Some(10.0)),
        // From within outwards.
        (DVec3::new(0.0, 7.0, 2.0), DVec3::Y, Some(flat - 7.0)),
    ] {
        let mut rays = Rays::<f64>::new(1);
        rays.set(0, org.to_array(), dir.to_array(), 0.0, f64::INFINITY);
        let theirs = oracle.closest(org, dir, 0.0, f64::INFINITY).map(|hit| hit.t);
        let mut answers = vec![theirs];
        for engine in f64::engines() {
            let mut hits = Hits::default();
            engine.intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
            answers.push(hits.is_hit(0).then(|| hits.t[0]));
        }
        for answer in answers {
            let is_right = match (answer, want) {
                (Some(t), Some(want)) => (t - want).abs() < 1e-12 * want,
                (answer, want) => answer == want,
            };
            assert!(is_right, "{org} {dir}: {answer:?}, not {want:?}");
        }
    }
}

#[test]
fn the_program_renders_packs_and_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::write(dir.join("nut.csg"), NUT).unwrap();
    let packed = zstd::bulk::compress(NUT.as_bytes(), 3).unwrap();
    std::fs::write(dir.join("nut.csg.zst"), packed).unwrap();
    for name in ["nut.csg", "nut.csg.zst"] {
        let line = ["render", name, "-o", "nut.png", "--size", "64x48", "--spp", "1", "--json"];
        let ended = binary::lanecast(dir, &line);
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.err);
        assert_eq!(ended.json()["holds"]["primitives"], 2, "{}", ended.out);
    }
    let ended = binary::lanecast(dir, &["convert", "nut.csg", "-o", "nut.stl", "--tolerance", "0.02", "--json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let area = |radius: f64, corners: f64| 0.5 * corners * radius * radius * (std::f64::consts::TAU / corners).sin();
    let volume = ended.json()["volume"].as_f64().unwrap();
    assert!((volume / (4.0 * (area(10.0, 6.0) - area(5.0, 12.0))) - 1.0).abs() < 2e-3, "{volume}");
    // What was written is imported.
    std::fs::write(dir.join("again.csg"), "difference() { import(file = \"nut.stl\"); cube(size = 9); }").unwrap();
    assert_eq!(binary::lanecast(dir, &["info", "again.csg"]).code, Some(0));
    std::fs::create_dir(dir.join("in")).unwrap();
    std::fs::write(dir.join("in/out.csg"), "import(file = \"../nut.stl\");\n").unwrap();
    binary::refused(dir, &["info", "in/out.csg"], "in/out.csg:1:1: `import`: `../nut.stl` leaves the scene's folder");
    assert_eq!(binary::lanecast(dir, &["info", "in/out.csg", "--allow-outside"]).code, Some(0));
    std::fs::write(dir.join("bad.csg"), "union() {\n\tcube(size = x);\n}\n").unwrap();
    binary::refused(dir, &["render", "bad.csg", "-o", "a.png"], "bad.csg:2:14: expected a number, a text, a list");
    binary::refused(dir, &["info", "nut.csg", "--set", "a=1"], "has no parameters");
}
