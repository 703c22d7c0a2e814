//! Runs the real binary, and writes ray files byte by byte, apart from the library's own writer.
#![allow(dead_code, reason = "each test file uses its own part of this module")]

pub mod watch;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A binary call that ended.
pub struct Ended {
    /// Exit code.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Ended {
    /// Stdout as the one JSON object it must be.
    pub fn json(&self) -> serde_json::Value {
        assert_eq!(self.out.lines().count(), 1, "one object on one line: {}", self.out);
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}", self.out))
    }
}

/// Runs `lanecast` with `arguments` in `folder`.
pub fn lanecast(folder: &Path, arguments: &[&str]) -> Ended {
    let output = Command::new(env!("CARGO_BIN_EXE_lanecast")).args(arguments).current_dir(folder).output();
    let Output { status, stdout, stderr } = output.expect("the binary runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Ended { code: status.code(), out: text(stdout), err: text(stderr) }
}

/// Checks a refusal: code 2, an `error:` line on stderr that contains `what`, nothing on stdout, no panic.
pub fn refused(folder: &Path, arguments: &[&str], what: &str) {
    let ended = lanecast(folder, arguments);
    assert_eq!(ended.code, Some(2), "{arguments:?}: {}", ended.err);
    assert!(ended.err.starts_with("error: ") && ended.err.contains(what), "{arguments:?}: {}", ended.err);
    assert!(!ended.err.contains("panicked") && ended.out.is_empty(), "{arguments:?}: {}", ended.err);
}

/// A file or folder of the shared data beside the package, or a line that says it is not there.
pub fn shared(path: &str) -> Option<PathBuf> {
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(path);
    if !full.exists() {
        println!("SKIPPED: no ../shared/{path}");
        return None;
    }
    Some(full)
}

/// Names of the files in `folder`, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The bytes of a ray file: NPY 1.0, `<f4`, shape (N, 8).
pub fn ray_file(rays: &[[f32; 8]]) -> Vec<u8> {
    let dict = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 8), }}", rays.len());
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let padded = (10 + dict.len() + 1).next_multiple_of(64) - 10;
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{dict:<width$}\n", width = padded - 1).bytes());
    bytes.extend(rays.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// The data of an NPY 1.0 file and its header's text.
pub fn npy_parts(bytes: &[u8]) -> (String, &[u8]) {
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let data = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    (String::from_utf8_lossy(&bytes[10..data]).into_owned(), &bytes[data..])
}

/// Two triangles: the unit square 0 <= x, y <= 1 in the plane z = 0, as an ASCII PLY file.
pub const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
    property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
