//! Replays every file of the fuzz corpora through its parser, so that the stable toolchain keeps what fuzzing found.

use std::path::Path;
use std::sync::Arc;

use lanecast::scene::mesh::Mesh;
use lanecast::scene::reference::References;
use lanecast::scene::{gltf, obj, ply, stl};

/// Files that must be refused; all others must be read.
const REFUSED: [&str; 9] = [
    "zero_index.obj",
    "beyond_start.obj",
    "lie.ply",
    "negative_list.ply",
    "lie.stl",
    "open.stl",
    "cycle.gltf",
    "zeros.gltf",
    "lie.glb",
];

type Parser = fn(&Path, &[u8]) -> lanecast::error::Result<Vec<Arc<Mesh>>>;

fn replay(folder: &str, parse: Parser) {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(folder);
    let Ok(entries) = std::fs::read_dir(&corpus) else {
        println!("SKIPPED: no fuzz corpus for {folder} (packaged sources leave it out)");
        return;
    };
    let mut files = 0;
    for entry in entries {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let result = parse(&path, &std::fs::read(&path).unwrap());
        // Fuzzers name what they find by its hash; only the seeds written by hand have a known verdict.
        if name.contains('.') {
            assert_eq!(result.is_err(), REFUSED.contains(&name), "{name}: {result:?}");
        }
        for mesh in result.unwrap_or_default() {
            assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()), "{name}");
        }
        files += 1;
    }
    assert!(files >= 5, "the corpus of {folder} has only {files} files");
}

#[test]
fn obj_corpus() {
    replay("obj", |file, bytes| obj::parse(file, bytes).map(|out| vec![out.mesh.into()]));
}

#[test]
fn ply_corpus() {
    replay("ply", |file, bytes| ply::parse(file, bytes).map(|mesh| vec![mesh.into()]));
}

#[test]
fn stl_corpus() {
    replay("stl", |file, bytes| stl::parse(file, bytes).map(|mesh| vec![mesh.into()]));
}

#[test]
fn gltf_corpus() {
    const NO_FILES: References = References { folder: None, allow_outside: false, found: None };
    replay("gltf", |file, bytes| gltf::parse(file, "corpus", bytes, &NO_FILES).map(|scene| scene.meshes));
}

#[test]
fn g_corpus() {
    use lanecast::scene::brlcad::{choose_tops, parse, regions::walk};
    let parse = |file: &Path, bytes: &[u8]| {
        let database = parse(file, bytes)?;
        walk(file, &database, &choose_tops(&database, &[])?)
    };
    for (name, accepted) in verdicts("g", |file, bytes| parse(file, bytes).is_ok()) {
        if name.contains('.') {
            assert_eq!(accepted, !["cut.g", "cycle.g", "lie.g"].contains(&name.as_str()), "{name}");
        }
    }
}

#[test]
fn csg_corpus() {
    use lanecast::scene::solids::flat::FlatTree;
    const NO_FILES: References = References { folder: None, allow_outside: false, found: None };
    let read = |path: &Path| Err(lanecast::error::Error::whole(path, "no files here"));
    let parse = |file: &Path, bytes: &[u8]| {
        let scene = lanecast::scene::openscad::parse(file, "corpus", bytes, &NO_FILES, &read);
        scene.is_ok_and(|scene| scene.solids.iter().all(|tree| FlatTree::new(tree).is_ok()))
    };
    for (name, accepted) in verdicts("csg", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, !["open.csg", "text.csg"].contains(&name.as_str()), "{name}");
    }
}

/// Files of a corpus by whether they were accepted: each file is read by `parse`.
fn verdicts(folder: &str, parse: impl Fn(&Path, &[u8]) -> bool) -> Vec<(String, bool)> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(folder);
    let Ok(entries) = std::fs::read_dir(&corpus) else {
        println!("SKIPPED: no fuzz corpus for {folder} (packaged sources leave it out)");
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    paths.map(|path| (name(&path), parse(&path, &std::fs::read(&path).unwrap()))).collect()
}

#[test]
fn pfm_corpus() {
    let parse = |file: &Path, bytes: &[u8]| {
        let film = lanecast::film::pfm::parse(file, bytes);
        film.is_ok_and(|film| film.validate().is_ok())
    };
    for (name, accepted) in verdicts("pfm", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, name != "lie.pfm", "{name}");
    }
}

#[test]
fn experiment_corpus() {
    let parse = |file: &Path, bytes: &[u8]| lanecast::measure::experiment::parse(file, bytes).is_ok();
    for (name, accepted) in verdicts("experiment", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, name != "misspelt.kdl", "{name}");
    }
}

#[test]
fn script_corpus() {
    let parse = |file: &Path, bytes: &[u8]| lanecast::view::script::parse(file, bytes).is_ok();
    for (name, accepted) in verdicts("script", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, name != "nan.txt" && name != "more.txt", "{name}");
    }
}

#[test]
fn view_corpus() {
    const REFUSED: [&str; 5] = ["mirrored.rt", "no_size.rt", "open.rt", "misspelt.rt", "infinite.rt"];
    let parse = |file: &Path, bytes: &[u8]| lanecast::scene::brlcad::view::parse(file, bytes).is_ok();
    for (name, accepted) in verdicts("view", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, !REFUSED.contains(&name.as_str()), "{name}");
    }
}

#[test]
fn bench_corpus() {
    const REFUSED: [&str; 4] = ["columns.csv", "twice.csv", "negative.csv", "short.csv"];
    let parse = |file: &Path, bytes: &[u8]| lanecast::measure::compare::parse(file, bytes).is_ok();
    for (name, accepted) in verdicts("bench", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, !REFUSED.contains(&name.as_str()), "{name}");
    }
}

#[test]
fn mtl_corpus() {
    let parse = |file: &Path, bytes: &[u8]| lanecast::scene::mtl::parse(file, bytes).is_ok();
    for (name, accepted) in verdicts("mtl", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, !["no_name.mtl", "two_numbers.mtl"].contains(&name.as_str()), "{name}");
    }
}

#[test]
fn picture_corpus() {
    use lanecast::scene::pictures::{Curve, decode};
    const BROKEN: [&str; 5] = ["huge.png", "lie.png", "lie.hdr", "text.png", "truncated.jpg"];
    let parse = |_: &Path, bytes: &[u8]| decode("corpus", bytes, Curve::Srgb).is_ok();
    for (name, accepted) in verdicts("picture", parse).into_iter().filter(|(name, _)| name.contains('.')) {
        assert_eq!(accepted, !BROKEN.contains(&name.as_str()), "{name}");
    }
}
