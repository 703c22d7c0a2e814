//! Damaged and malicious files through the real binary: exit code 2, one error line with file and place, no output,
//! bounded memory and time.

mod binary;

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use binary::watch::watch;
use binary::{SQUARE, files, ray_file};

const LIMIT: Duration = Duration::from_secs(20);

/// What the program may hold besides the file: its own code, threads, the tables of a parser.
const BASE: u64 = 96 << 20;

/// Bytes of memory per byte of a file (the bounds that the importers state are below this).
const PER_BYTE: u64 = 64;

/// What a small packed file may unpack to before it is refused.
const UNPACKED: u64 = 256 << 20;

/// Where an error says something is: a line and column, a byte, or only the file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Line,
    Byte,
    File,
}

/// Runs `command` in a folder with the file `name`; it must be refused properly.
fn refused(name: &str, bytes: &[u8], command: &str, place: Place, what: &str) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join(name), bytes).expect("a hostile file");
    std::fs::write(dir.path().join("square.ply"), SQUARE).expect("a scene");
    let before = files(dir.path());
    let watched = watch(dir.path(), &command.split(' ').collect::<Vec<_>>(), LIMIT);
    let err = &watched.ended.err;
    let shown: String = err.chars().take(600).collect();
    let case = format!("{name} ({what}): {shown}");
    assert_eq!(watched.ended.code, Some(2), "{case}");
    assert_eq!(err.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{case}");
    assert!(err.len() < 2000 && !err.contains("panicked") && watched.ended.out.is_empty(), "{case}");
    let first = err.lines().find(|line| line.starts_with("error: ")).expect("an error line");
    assert!(first.contains(name) && err.contains(what), "{case}");
    assert_eq!(place_of(first, name), place, "{case}");
    assert_eq!(files(dir.path()), before, "{case}");
    let unpacked = if name.ends_with(".zst") || name.ends_with(".gz") { UNPACKED } else { 0 };
    let most = BASE + unpacked + PER_BYTE * bytes.len() as u64;
    assert!(watched.peak.is_none_or(|peak| peak < most), "{case}: {:?} bytes", watched.peak);
}

/// `FILE:1:2: ...` or `FILE: byte 3: ...`.
fn place_of(line: &str, name: &str) -> Place {
    let rest = line.split_once(name).map_or("", |(_, rest)| rest);
    let number = |text: &str| text.parse::<u64>().is_ok();
    match rest.splitn(4, ':').collect::<Vec<_>>()[..] {
        ["", line, column, _] if number(line) && number(column) => Place::Line,
        ["", byte, ..] if byte.strip_prefix(" byte ").is_some_and(number) => Place::Byte,
        _ => Place::File,
    }
}

fn render(name: &str, bytes: &[u8], place: Place, what: &str) {
    refused(name, bytes, &format!("render {name} -o out.exr --size 32x32"), place, what);
    refused(name, bytes, &format!("info {name}"), place, what);
}

fn ply(format: &str, vertices: u64, faces: u64, rows: &[u8]) -> Vec<u8> {
    let head = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [head.as_bytes(), rows].concat()
}

/// Three vertices of a binary file.
fn corners() -> Vec<u8> {
    [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn face(indices: [i32; 3]) -> Vec<u8> {
    std::iter::once(3).chain(indices.iter().flat_map(|i| i.to_le_bytes())).collect()
}

#[test]
fn ply_files() {
    let binary = "binary_little_endian";
    render("lie.ply", &ply(binary, 3, 4_000_000_000, &corners()), Place::Line, "4000000000");
    render("lie.ply", &ply(binary, u64::MAX, 1, &corners()), Place::Line, "18446744073709551615");
    render("lie.ply", &ply("ascii", 4_000_000_000, 1, b"0 0 0\n"), Place::Line, "");
    let outside = |indices| [corners(), face(indices)].concat();
    render("index.ply", &ply(binary, 3, 1, &outside([0, 1, 3])), Place::Byte, "3");
    render("index.ply", &ply(binary, 3, 1, &outside([0, 1, -1])), Place::Byte, "-1");
    render("index.ply", &ply("ascii", 3, 1, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"), Place::Line, "7");
    let whole = ply(binary, 3, 1, &outside([0, 1, 2]));
    render("cut.ply", &whole[..whole.len() - 5], Place::Byte, "");
    render("cut.ply", b"ply\nformat ascii 1.0\nelement ver", Place::Line, "");
    let long = [b"ply\nformat ascii 1.0\nelement vertex ".as_slice(), &vec![b'9'; 8 << 20]].concat();
    render("long.ply", &long, Place::Line, "");
    render("empty.ply", b"", Place::Line, "");
}

#[test]
fn obj_files() {
    render("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", Place::Line, "9");
    render("zero.obj", b"v 0 0 0\nf 0 1 1\n", Place::Line, "0");
    render("cut.obj", b"v 0 0 0\nv 1 0", Place::Line, "");
    render("long.obj", &[b"v 0 0 ".as_slice(), &vec![b'x'; 8 << 20]].concat(), Place::Line, "");
}

#[test]
fn gltf_files() {
    let document = |rest: &str| format!("{{\"asset\": {{\"version\": \"2.0\"}},\n {rest}}}").into_bytes();
    let mesh = "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], ";
    let accessor = |rest: &str| document(&format!("{mesh}\"accessors\": [{{\"componentType\": 5126, {rest}}}]"));
    render("cut.gltf", b"{\"asset\": ", Place::Line, "");
    render("type.gltf", &document("\"nodes\": 3"), Place::Line, "expected a sequence");
    render("zeros.gltf", &accessor("\"count\": 4000000000, \"type\": \"VEC3\""), Place::File, "decodes to more");
    render("kind.gltf", &accessor("\"count\": 3, \"type\": \"VEC2\""), Place::File, "`VEC3`");
    render("cycle.gltf", &document("\"nodes\": [{\"children\": [0]}]"), Place::File, "below itself");
    render("lie.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff", Place::Byte, "4294967295");
    render("text.glb", b"{}", Place::Byte, "glTF");
}

#[test]
fn stl_files() {
    let lie = [[0; 80].as_slice(), &[0xff; 4], &[0; 500]].concat();
    render("lie.stl", &lie, Place::Byte, "4294967295");
    let cut = [[0; 80].as_slice(), &2u32.to_le_bytes(), &[0; 70]].concat();
    render("cut.stl", &cut, Place::Byte, "");
    render("cut.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0", Place::Line, "");
}

#[test]
fn packed_files() {
    // Half a gigabyte of spaces in some tens of kilobytes.
    let mut pack = zstd::Encoder::new(Vec::new(), 3).expect("an encoder");
    pack.write_all(b"ply\nformat ascii 1.0\ncomment ").expect("memory");
    for _ in 0..512 {
        pack.write_all(&vec![b' '; 1 << 20]).expect("memory");
    }
    let bomb = pack.finish().expect("memory");
    assert!(bomb.len() < 1 << 20, "{}", bomb.len());
    refused("bomb.ply.zst", &bomb, "info bomb.ply.zst", Place::File, "unpacks to more than");
    refused("cut.ply.zst", &bomb[..bomb.len() / 2], "info cut.ply.zst", Place::File, "");
    refused("none.ply.gz", b"ply\n", "info none.ply.gz", Place::File, "");
}

#[test]
fn scene_files() {
    render("self.kdl", b"define a { instance a }\ninstance a\n", Place::Line, "a");
    render("ring.kdl", b"define a { instance b }\ndefine b { sphere; instance a }\ninstance a\n", Place::Line, "");
    render("up.kdl", b"sphere\nmesh \"../square.ply\"\n", Place::Line, "folder");
    render("root.kdl", b"mesh \"/etc/hostname.ply\"\n", Place::Line, "");
    let deep = ["group { ".repeat(100_000), "sphere".into(), " }".repeat(100_000)].concat();
    render("deep.kdl", deep.as_bytes(), Place::Line, "96");
    render("long.kdl", &[b"sphere radius=".as_slice(), &vec![b'x'; 8 << 20]].concat(), Place::Line, "");
    render("bytes.kdl", b"sphere\n\xff\xfe", Place::Line, "");
    render("many.kdl", b"define a { repeat 100000 { repeat 100000 { sphere } } }\ninstance a\n", Place::Line, "");
    let next = |level: usize| format!("define g{level} {{ {}}}\n", format!("instance g{}; ", level + 1).repeat(20));
    let nested = format!("{}define g20 {{ sphere }}\ninstance g0\n", (0..20).map(next).collect::<String>());
    render("nested.kdl", nested.as_bytes(), Place::File, "more than 16777216 instances");
    render("lie.kdl", b"mesh \"none.ply\"\n", Place::Line, "none.ply");
}

#[test]
fn ray_files() {
    let good = ray_file(&[[0.0; 8]; 4]);
    let header = |dict: &str| {
        let padded = (10 + dict.len() + 1).next_multiple_of(64) - 10;
        let head = [b"\x93NUMPY\x01\x00".as_slice(), &(padded as u16).to_le_bytes()].concat();
        [head, format!("{dict:<width$}\n", width = padded - 1).into_bytes(), vec![0; 32]].concat()
    };
    let f4 =
        |shape: &str, order: &str| header(&format!("{{'descr': '<f4', 'fortran_order': {order}, 'shape': {shape}, }}"));
    let huge_header = [b"\x93NUMPY\x02\x00".as_slice(), &u32::MAX.to_le_bytes(), &[b' '; 100]].concat();
    for (bytes, what) in [
        (f4("(4000000000, 8)", "False"), ""),
        (f4("(18446744073709551615, 8)", "False"), ""),
        (f4("(2305843009213693953, 8)", "False"), ""),
        (f4("(1, 7)", "False"), "8"),
        (f4("(1, 8)", "True"), ""),
        (f4("(-1, 8)", "False"), ""),
        (header("{'descr': '|O', 'fortran_order': False, 'shape': (1, 8), }"), "<f4"),
        (header(&format!("{{'descr': {}", "[".repeat(50_000))), ""),
        (good[..good.len() - 3].to_vec(), ""),
        (good[..40].to_vec(), ""),
        (huge_header, ""),
        (b"PK\x03\x04 not an array".to_vec(), ""),
        (Vec::new(), ""),
    ] {
        refused("h.npy", &bytes, "trace square.ply --rays h.npy --hits out.npy", Place::Byte, what);
    }
}

/// Vertices that are no numbers are legal input: their triangles are counted and never hit.
#[test]
fn vertices_that_are_no_numbers_are_counted() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut vertices = corners();
    vertices.extend([f32::NAN, 0.0, f32::INFINITY].iter().flat_map(|x| x.to_le_bytes()));
    let rows = [vertices, face([0, 1, 2]), face([0, 1, 3]), face([3, 3, 3])].concat();
    std::fs::write(dir.path().join("nan.ply"), ply("binary_little_endian", 4, 3, &rows)).expect("a scene");
    let run = |command: &str| {
        let watched = watch(dir.path(), &command.split(' ').collect::<Vec<_>>(), LIMIT);
        assert_eq!(watched.ended.code, Some(0), "{}", watched.ended.err);
        watched.ended
    };
    let counts = run("info nan.ply --json").json()["counts"].clone();
    assert_eq!((&counts["primitives"], &counts["dropped_nonfinite"]), (&1.into(), &2.into()));
    run("render nan.ply -o out.exr --size 32x32");
    assert!(Path::new(&dir.path().join("out.exr")).exists());
}
