//! Importers against damaged and malicious files: an error or a valid mesh, in bounded time and memory, no panic.

use std::path::Path;
use std::time::{Duration, Instant};

use lanecast::error::{Error, Place, Result};
use lanecast::scene::mesh::Mesh;
use lanecast::scene::{obj, ply, stl};

/// Mutated inputs per format.
const MUTATIONS: u32 = 30_000;

type Parser = fn(&[u8]) -> Result<Mesh>;

const FORMATS: [(&str, Parser); 3] = [("obj", read_obj), ("ply", read_ply), ("stl", read_stl)];

fn read_obj(bytes: &[u8]) -> Result<Mesh> {
    obj::parse(Path::new("h.obj"), bytes).map(|out| out.mesh)
}

fn read_ply(bytes: &[u8]) -> Result<Mesh> {
    ply::parse(Path::new("h.ply"), bytes)
}

fn read_stl(bytes: &[u8]) -> Result<Mesh> {
    stl::parse(Path::new("h.stl"), bytes)
}

/// Seeds of a format: its fuzz corpus.
fn seeds(format: &str) -> Vec<Vec<u8>> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(format);
    let Ok(entries) = std::fs::read_dir(corpus) else {
        println!("SKIPPED: no fuzz corpus for {format} (packaged sources leave it out)");
        return Vec::new();
    };
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Checks what must hold for any input: indices and groups in range, errors short and inside the file.
fn check(bytes: &[u8], parse: Parser) -> bool {
    let start = Instant::now();
    let result = parse(bytes);
    assert!(start.elapsed() < Duration::from_secs(10), "{} bytes took {:?}", bytes.len(), start.elapsed());
    match result {
        Ok(mesh) => {
            assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
            let mut next = 0;
            for group in &mesh.groups {
                assert_eq!(group.first, next);
                next += group.count;
            }
            assert!(mesh.groups.is_empty() || next as usize == mesh.triangles.len());
            true
        }
        Err(Error::Input(error)) => {
            assert!(error.to_string().len() < 1000, "a long message");
            match error.place {
                Place::Byte(at) => assert!(at <= bytes.len() as u64),
                Place::LineColumn { line, column } => assert!(line + column <= bytes.len() as u64 + 2),
                Place::Whole => panic!("no place: {error}"),
            }
            false
        }
        Err(other) => panic!("not an input error: {other}"),
    }
}

/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Pieces that mean something to a parser.
const TOKENS: [&[u8]; 22] = [
    b"-1",
    b"0",
    b"4294967295",
    b"9223372036854775807",
    b"99999999999999999999",
    b"nan",
    b"1e999",
    b"/",
    b"//",
    b"\\\n",
    b"\r",
    b"\n",
    b"#",
    b"list",
    b"uchar",
    b"double",
    b"element face 4000000000",
    b"end_header\n",
    b"solid",
    b"endsolid",
    b"\xff\xff\xff\xff",
    b"usemtl a\nf 1 1 1\n",
];

fn mutate(seed: &[u8], others: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + random.below(24)).min(bytes.len());
        match random.below(6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < bytes.len() => bytes[at] = random.next() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => drop(bytes.splice(at..end, TOKENS[random.below(TOKENS.len())].iter().copied())),
            4 => bytes.truncate(at),
            _ => {
                let other = &others[random.below(others.len())];
                let from = random.below(other.len());
                let to = (from + random.below(200)).min(other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
        }
    }
    bytes
}

#[test]
fn mutations_never_panic() {
    for (format, parse) in FORMATS {
        let seeds = seeds(format);
        if seeds.is_empty() {
            return;
        }
        let mut random = Random(2026);
        let mut read = 0;
        for i in 0..MUTATIONS {
            let seed = &seeds[i as usize % seeds.len()];
            read += u32::from(check(&mutate(seed, &seeds, &mut random), parse));
        }
        // Both outcomes must be common, or the loop tests only one of them.
        println!("{format}: {read} of {MUTATIONS} mutated files were read");
        assert!(read > MUTATIONS / 100 && read < MUTATIONS - MUTATIONS / 100, "{format}: {read}");
    }
}

#[test]
fn every_truncation_of_every_seed() {
    for (format, parse) in FORMATS {
        for seed in seeds(format) {
            for length in 0..=seed.len() {
                check(&seed[..length], parse);
            }
        }
    }
}

#[test]
fn very_long_lines_are_read_and_never_shown() {
    const LONG: usize = 64 << 20;
    for (format, head, fill, tail) in [
        ("obj", "v 0 0 ", b"1", ""),
        ("obj", "v 0 0 ", b"x", ""),
        ("obj", "g ", b"n", "\nv 0 0 0\nf 1 1 1"),
        ("obj", "v 0 0 0 # ", b"c", "\nf 1 1 2"),
        ("obj", "v 0 0 0\nf ", b" ", "1 1 2"),
        ("ply", "ply\ncomment ", b"c", "\nformat x"),
        ("ply", "ply\nformat ascii 1.0\nelement ", b"n", " 1\nproperty float x\nend_header\n0"),
        ("ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty ", b"t", " x\nend_header\n0"),
        ("stl", "solid ", b"n", "\nendsolid"),
        ("stl", "solid\n", b"f", ""),
    ] {
        let mut bytes = head.as_bytes().to_vec();
        bytes.resize(LONG, fill[0]);
        bytes.extend_from_slice(tail.as_bytes());
        let (_, parse) = FORMATS.into_iter().find(|(name, _)| *name == format).unwrap();
        check(&bytes, parse);
    }
}

#[test]
fn many_small_statements_take_linear_time() {
    let repeated = |head: &str, piece: &str, tail: &str| [head, &piece.repeat((8 << 20) / piece.len()), tail].concat();
    let ply = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n";
    let long_name = format!("v 0 0 0\nusemtl {}\n", "m".repeat(1000));
    for (format, text) in [
        ("obj", repeated(&long_name, "g a\nf 1 1 1\ng b\nf 1 1 1\n", "")),
        ("obj", repeated("v 0 0 0\nf", " 1", "")),
        ("obj", repeated("", "\\\n", "")),
        ("obj", repeated("", "mtllib a\n", "")),
        ("obj", repeated("v 0 0 0\n", "f 1 1 7\n", "")),
        ("ply", repeated(ply, "element a 4000000000\n", "end_header\n")),
        ("ply", repeated(ply, "property list char int x\n", "end_header\n")),
        ("stl", repeated("", "solid\nendsolid\n", "")),
    ] {
        let (_, parse) = FORMATS.into_iter().find(|(name, _)| *name == format).unwrap();
        assert_eq!(check(text.as_bytes(), parse), !text.ends_with(" 7\n"), "{format}");
    }
}
