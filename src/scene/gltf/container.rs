//! Binary glTF: a header and chunks around the JSON and the first buffer.

use std::path::Path;

use crate::error::{Error, Result};
use crate::scene::unpack;

const MAGIC: &[u8] = b"glTF";
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
/// Chunk types, `JSON` and `BIN\0` as little-endian words.
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// The parts of a document.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The JSON text.
    pub json: &'a [u8],
    /// Where it begins in a binary file; `None` in a text file.
    pub json_at: Option<usize>,
    /// The binary chunk: content of the first buffer if that has no URI.
    pub bin: Option<&'a [u8]>,
}

/// Takes a file apart: a binary one (told by its first bytes) into its chunks, a text one is all JSON.
///
/// # Errors
/// At the byte: a file named `.glb` that is none, another version, lengths that reach beyond the file, a first chunk
/// that is not JSON.
pub fn split<'a>(file: &Path, bytes: &'a [u8]) -> Result<Parts<'a>> {
    if !bytes.starts_with(MAGIC) {
        if unpack::inner_extension(file).as_deref() == Some("glb") {
            return Err(Error::at_byte(file, 0, "expected `glTF`, the first bytes of a binary glTF file"));
        }
        return Ok(Parts { json: bytes, json_at: None, bin: None });
    }
    let fail = |at: usize, what: String| Err(Error::at_byte(file, at as u64, what));
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return fail(bytes.len(), format!("expected a header of {HEADER} bytes, found {} bytes", bytes.len()));
    };
    if version != 2 {
        return fail(4, format!("expected version 2 of binary glTF, found {version}"));
    }
    let Some(bytes) = bytes.get(..length as usize) else {
        return fail(8, format!("the header says {length} bytes, but the file has {}", bytes.len()));
    };
    let mut chunks = Vec::new();
    let mut at = HEADER;
    // The binary chunk is the second one; what follows belongs to extensions.
    while at < bytes.len() && chunks.len() < 2 {
        let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else {
            return fail(at, format!("expected the {CHUNK_HEADER} bytes of a chunk header"));
        };
        let start = at + CHUNK_HEADER;
        let left = bytes.len() - start;
        let Some(content) = bytes[start..].get(..length as usize) else {
            return fail(at, format!("the chunk says {length} bytes, but only {left} are left"));
        };
        chunks.push((kind, start, content));
        at = start + content.len();
    }
    match chunks[..] {
        [(JSON, start, json), ref rest @ ..] => {
            let bin = rest.first().filter(|(kind, ..)| *kind == BIN).map(|(.., content)| *content);
            Ok(Parts { json, json_at: Some(start), bin })
        }
        _ => fail(HEADER, "expected a first chunk of type JSON".into()),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}
