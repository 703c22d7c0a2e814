//! Cryptomatte: which things a pixel shows, and how much of each, under ids made of their names.
//!
//! Source: J. Friedman, A. Jones, *Fully automatic ID mattes with support for motion blur and transparency*, 2015, and
//! Psyop, *Cryptomatte Specification*, 1.2. An id is the 32-bit MurmurHash3 of a name, as the bits of a float that is
//! neither denormal nor infinite nor NaN. Ids and coverages of a pixel come in ranks, most coverage first, two ranks per
//! layer of four channels; the attributes name the layers and list what the ids mean.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Ranks of a pixel: what has less coverage than so many others is left out.
pub const RANKS: usize = 6;

/// Channels of a layer: id and coverage of one rank, then of the next.
const CHANNELS: [&str; 4] = ["R", "G", "B", "A"];

/// MurmurHash3_x86_32 of `bytes`.
/// Source: A. Appleby, *SMHasher*, MurmurHash3.cpp, 2011.
pub fn murmur3(bytes: &[u8], seed: u32) -> u32 {
    let mix = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut hash = seed;
    let blocks = bytes.chunks_exact(4);
    let tail = blocks.remainder();
    for block in blocks {
        hash ^= mix(u32::from_le_bytes([block[0], block[1], block[2], block[3]]));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    if !tail.is_empty() {
        hash ^= mix(tail.iter().rev().fold(0, |k, &byte| k << 8 | u32::from(byte)));
    }
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// The id of what is called `name`, as the bits of a float.
pub fn id(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes(), 0);
    // Denormal numbers may be flushed to zero, infinities and NaNs lose their bits.
    if matches!(hash >> 23 & 0xff, 0 | 0xff) { hash ^ 1 << 23 } else { hash }
}

/// Names of the planes of the layers that begin with `layer`, rank by rank: id, coverage.
pub fn planes(layer: &str) -> Vec<String> {
    (0..2 * RANKS).map(|i| format!("{layer}{:02}.{}", i / 4, CHANNELS[i % 4])).collect()
}

/// The attributes of the layers that begin with `layer`, in which names have their ids: names and values.
pub fn attributes(layer: &str, names: &BTreeMap<String, u32>) -> Vec<(String, String)> {
    let mut manifest = String::from("{");
    for (i, (name, id)) in names.iter().enumerate() {
        let comma = if i > 0 { "," } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(manifest, "{comma}{}:\"{id:08x}\"", quoted(name));
    }
    manifest.push('}');
    let key = format!("{:08x}", murmur3(layer.as_bytes(), 0));
    let entry = |field: &str, value: &str| (format!("cryptomatte/{}/{field}", &key[..7]), value.to_owned());
    vec![
        entry("name", layer),
        entry("hash", "MurmurHash3_32"),
        entry("conversion", "uint32_to_float32"),
        entry("manifest", &manifest),
    ]
}

/// As a string of JSON, in ASCII: attributes of EXR have one byte per character.
fn quoted(name: &str) -> String {
    let mut out = String::from("\"");
    for c in name.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            ' '..='~' => out.push(c),
            _ => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    let _ = write!(out, "\\u{unit:04x}");
                }
            }
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vectors that implementations of MurmurHash3 are tested with everywhere.
    #[test]
    fn hashes_of_reference() {
        for (text, seed, hash) in [
            ("", 0, 0),
            ("", 1, 0x514e_28b7),
            ("", 0xffff_ffff, 0x81f1_6f39),
            ("test", 0, 0xba6b_d213),
            ("test", 0x9747_b28c, 0x704b_81dc),
            ("Hello, world!", 0, 0xc036_3e43),
            ("Hello, world!", 0x9747_b28c, 0x2488_4cba),
            ("The quick brown fox jumps over the lazy dog", 0, 0x2e4f_f723),
            ("The quick brown fox jumps over the lazy dog", 0x9747_b28c, 0x2fa8_26cd),
            ("aaa", 0x9747_b28c, 0x283e_0130),
            ("aa", 0x9747_b28c, 0x5d21_1726),
            ("a", 0x9747_b28c, 0x7fa0_9ea6),
        ] {
            assert_eq!(murmur3(text.as_bytes(), seed), hash, "{text:?} {seed:x}");
        }
        // The specification's example.
        assert_eq!(id("hello"), 0x248b_fa47);
    }

    #[test]
    fn ids_are_plain_floats() {
        let mut fixed = 0;
        for i in 0..20_000 {
            let name = format!("object {i}");
            let (hash, id) = (murmur3(name.as_bytes(), 0), id(&name));
            assert!(f32::from_bits(id).is_normal(), "{name}");
            assert!(hash == id || hash ^ id == 1 << 23);
            fixed += u32::from(hash != id);
        }
        // One in 128.
        assert!((100..220).contains(&fixed), "{fixed}");
    }

    #[test]
    fn layers_and_manifest() {
        let planes = planes("cryptoObject");
        assert_eq!(
            (planes.len(), planes[0].as_str(), planes[5].as_str()),
            (12, "cryptoObject00.R", "cryptoObject01.G")
        );
        let names = BTreeMap::from([("b\"\u{e9}".to_owned(), 0x1f), ("a".to_owned(), 0x3c25_69b2)]);
        let found = attributes("cryptoObject", &names);
        let keys: Vec<&str> = found.iter().map(|(key, _)| key.rsplit('/').next().unwrap()).collect();
        assert_eq!(keys, ["name", "hash", "conversion", "manifest"]);
        assert!(
            found.iter().all(|(key, _)| key.starts_with("cryptomatte/") && key.split('/').nth(1).unwrap().len() == 7)
        );
        assert_eq!(found[3].1, r#"{"a":"3c2569b2","b\"\u00e9":"0000001f"}"#);
    }
}
