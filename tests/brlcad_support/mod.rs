//! What tests of BRL-CAD scenes share: where the shared data is, and a reader of NumPy's `.npz`.
#![allow(dead_code, reason = "each test binary uses its own part")]

pub mod g;

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

pub fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/brlcad").join(path);
    if !path.exists() {
        println!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Arrays of an `.npz` file (a ZIP archive of `.npy` files) by name, all numbers as f64 in C order.
pub fn read_npz(path: &Path) -> HashMap<String, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let u16_at = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let end = bytes.windows(4).rposition(|w| w == b"PK\x05\x06").unwrap();
    let (count, mut at) = (u16_at(end + 10), u32_at(end + 16));
    let mut arrays = HashMap::new();
    for _ in 0..count {
        assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
        let (method, packed, name) = (u16_at(at + 10), u32_at(at + 20), u16_at(at + 28));
        let local = u32_at(at + 42);
        let file = String::from_utf8(bytes[at + 46..at + 46 + name].to_vec()).unwrap();
        at += 46 + name + u16_at(at + 30) + u16_at(at + 32);
        let start = local + 30 + u16_at(local + 26) + u16_at(local + 28);
        let body = &bytes[start..start + packed];
        let mut npy = Vec::new();
        match method {
            0 => npy.extend_from_slice(body),
            _ => _ = flate2::read::DeflateDecoder::new(body).read_to_end(&mut npy).unwrap(),
        }
        arrays.insert(file.trim_end_matches(".npy").to_owned(), read_npy(&npy));
    }
    arrays
}

fn read_npy(bytes: &[u8]) -> Vec<f64> {
    assert_eq!(&bytes[..6], b"\x93NUMPY");
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
    assert!(header.contains("'fortran_order': False"), "{header}");
    let kind = header.split("'descr': '").nth(1).unwrap().split('\'').next().unwrap();
    let body = &bytes[10 + length..];
    match kind {
        "<f8" => body.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect(),
        "<f4" => body.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()).into()).collect(),
        "<i4" => body.chunks_exact(4).map(|b| i32::from_le_bytes(b.try_into().unwrap()).into()).collect(),
        "<i8" => body.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().unwrap()) as f64).collect(),
        other => panic!("a type of number this reader does not know: {other}"),
    }
}
