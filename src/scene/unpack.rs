//! Reading files that may be compressed: gzip (`.gz`) and Zstandard (`.zst`), told apart by their first bytes.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// How large a file may become in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnpackLimit {
    /// A compressed file may always unpack to this many bytes...
    pub floor: u64,
    /// ...or to this many times its own size, if that is more...
    pub ratio: u64,
    /// ...but no file, compressed or not, may have more bytes than this.
    pub cap: u64,
}

/// The limit of [`read_file`]: 256 MiB or 200 times the compressed size, 16 GiB at most.
pub const DEFAULT_LIMIT: UnpackLimit = UnpackLimit { floor: 256 << 20, ratio: 200, cap: 16 << 30 };

impl UnpackLimit {
    /// Most bytes that `packed` compressed bytes may unpack to.
    pub fn unpacked(&self, packed: u64) -> u64 {
        self.floor.max(packed.saturating_mul(self.ratio)).min(self.cap)
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Packing {
    Gzip,
    Zstd,
}

impl Packing {
    fn of_content(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::Zstd),
            _ => None,
        }
    }

    fn of_name(path: &Path) -> Option<Self> {
        match extension(path)?.as_str() {
            "gz" => Some(Self::Gzip),
            "zst" => Some(Self::Zstd),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "Zstandard",
        }
    }
}

/// Reads `path` and unpacks it if it is compressed, under [`DEFAULT_LIMIT`].
///
/// # Errors
/// An unreadable file; a name that ends in `.gz` or `.zst` over content that is not; damaged or truncated
/// compressed data; a size over the limit.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    read_file_within(path, DEFAULT_LIMIT)
}

/// [`read_file`] under another limit.
///
/// # Errors
/// As [`read_file`].
pub fn read_file_within(path: &Path, limit: UnpackLimit) -> Result<Vec<u8>> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let expected = file.metadata().map_err(|e| Error::io(path, e))?.len();
    let mut bytes = Vec::new();
    // The size is only a hint (pipes have none, files grow), so it is trusted for the buffer, not for the limit.
    let hint = usize::try_from(expected.min(limit.cap)).unwrap_or(0);
    bytes.try_reserve_exact(hint).map_err(|_| Error::whole(path, format!("no memory for {expected} bytes")))?;
    file.take(limit.cap.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    if bytes.len() as u64 > limit.cap {
        return Err(Error::whole(path, format!("more than {} bytes, the largest file that is read", limit.cap)));
    }
    unpack(path, bytes, limit)
}

/// Unpacks `bytes` if they are compressed and gives them back otherwise; `file` is for its extension and for error
/// messages.
///
/// # Errors
/// As [`read_file`], without those of reading.
pub fn unpack(file: &Path, bytes: Vec<u8>, limit: UnpackLimit) -> Result<Vec<u8>> {
    let Some(packing) = Packing::of_content(&bytes) else {
        return match Packing::of_name(file) {
            Some(named) => Err(Error::whole(file, format!("expected {} data, as its name says", named.name()))),
            None => Ok(bytes),
        };
    };
    let most = limit.unpacked(bytes.len() as u64);
    let mut out = Vec::new();
    let read = match packing {
        Packing::Gzip => read_limited(flate2::read::MultiGzDecoder::new(bytes.as_slice()), most, &mut out),
        Packing::Zstd => zstd::stream::read::Decoder::with_buffer(bytes.as_slice())
            .and_then(|decoder| read_limited(decoder, most, &mut out)),
    };
    read.map_err(|e| Error::whole(file, format!("{} data is damaged after {} bytes: {e}", packing.name(), out.len())))?;
    if out.len() as u64 > most {
        let what = format!("unpacks to more than {most} bytes, the limit for {} compressed bytes", bytes.len());
        let error = Error::whole(file, what);
        // What is over the cap is refused unpacked, too.
        return Err(if most < limit.cap { error.with_help("unpack the file first") } else { error });
    }
    Ok(out)
}

/// Reads at most one byte more than `most`, so that the caller sees whether there was more.
fn read_limited(reader: impl Read, most: u64, out: &mut Vec<u8>) -> std::io::Result<()> {
    reader.take(most.saturating_add(1)).read_to_end(out).map(|_| ())
}

/// The extension that says what a file holds, in lower case: `ply` for `x.PLY` and for `x.ply.zst`.
pub fn inner_extension(path: &Path) -> Option<String> {
    match Packing::of_name(path) {
        Some(_) => extension(Path::new(path.file_stem()?)),
        None => extension(path),
    }
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const SMALL: UnpackLimit = UnpackLimit { floor: 1_000, ratio: 3, cap: 100_000 };

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn zst(bytes: &[u8]) -> Vec<u8> {
        zstd::bulk::compress(bytes, 3).unwrap()
    }

    #[test]
    fn inner_extensions() {
        for (name, expected) in [
            ("a/x.ply.zst", Some("ply")),
            ("x.PLY", Some("ply")),
            ("x.Obj.GZ", Some("obj")),
            ("x.zst", None),
            ("x", None),
            (".gz", None),
            ("a.ply/x", None),
        ] {
            assert_eq!(inner_extension(Path::new(name)).as_deref(), expected, "{name}");
        }
    }

    #[test]
    fn reads_plain_and_packed_files_in_several_parts() {
        let folder = tempfile::tempdir().unwrap();
        let parts = [zst(b"one "), zst(b"two")].concat();
        let members = [gzip(b"one "), gzip(b"two")].concat();
        for (name, content) in [("a.txt", b"one two".to_vec()), ("a.txt.zst", parts), ("a.gz", members)] {
            let path = folder.path().join(name);
            std::fs::write(&path, &content).unwrap();
            assert_eq!(read_file(&path).unwrap(), b"one two", "{name}");
        }
        let absent = folder.path().join("none");
        assert!(read_file(&absent).unwrap_err().to_string().contains("none: "));
        assert!(read_file(folder.path()).is_err(), "a folder is not a file");
        let tiny = UnpackLimit { cap: 6, ..SMALL };
        let error = read_file_within(&folder.path().join("a.txt"), tiny).unwrap_err().to_string();
        assert!(error.ends_with("more than 6 bytes, the largest file that is read"), "{error}");
    }

    #[test]
    fn bombs_stop_at_the_limit() {
        let zeros = vec![0; 1_001];
        for packed in [gzip(&zeros), zst(&zeros)] {
            let error = unpack(Path::new("m.ply"), packed, SMALL).unwrap_err().to_string();
            assert!(error.starts_with("m.ply: unpacks to more than 1000 bytes, the limit for "), "{error}");
        }
        for packed in [gzip(&zeros[1..]), zst(&zeros[1..])] {
            assert_eq!(unpack(Path::new("m.ply"), packed, SMALL).unwrap().len(), 1_000);
        }
        let capped = UnpackLimit { cap: 1_000, ..SMALL };
        let said = |limit| unpack(Path::new("m.ply"), gzip(&zeros), limit).unwrap_err().to_string();
        assert_eq!([SMALL, capped].map(|limit| said(limit).contains("help: unpack the file first")), [true, false]);
        assert_eq!([0, 400, 50_000].map(|n| SMALL.unpacked(n)), [1_000, 1_200, 100_000]);
        assert_eq!(DEFAULT_LIMIT.unpacked(u64::MAX), 16 << 30);
    }

    #[test]
    fn every_truncation_and_a_wrong_name_are_errors() {
        let text: Vec<u8> = (0..500_u32).flat_map(|i| (i * i).to_le_bytes()).collect();
        for (name, packed) in [("a.gz", gzip(&text)), ("a.zst", zst(&text))] {
            assert_eq!(unpack(Path::new(name), packed.clone(), DEFAULT_LIMIT).unwrap(), text);
            for length in 0..packed.len() {
                assert!(unpack(Path::new(name), packed[..length].to_vec(), DEFAULT_LIMIT).is_err(), "{name} {length}");
            }
        }
        let error = unpack(Path::new("a.gz"), b"text".to_vec(), SMALL).unwrap_err().to_string();
        assert_eq!(error, "a.gz: expected gzip data, as its name says");
    }
}
