//! Attributes and bodies, which may be packed.

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use super::cursor::Cursor;
use crate::error::Result;
use crate::scene::unpack::DEFAULT_LIMIT;

/// How many bytes the packed parts of one file may still unpack to.
pub(super) struct Budget(u64);

impl Budget {
    /// As much as a packed file of that size might.
    pub fn for_file(bytes: usize) -> Self {
        Self(DEFAULT_LIMIT.unpacked(bytes as u64))
    }
}

/// Attributes or a body.
pub(super) struct Section<'a> {
    file: &'a Path,
    bytes: Cow<'a, [u8]>,
    cursor: Cursor<'a>,
}

impl<'a> Section<'a> {
    /// The section that `flags` describe; `None` if they say that there is none.
    pub fn read(
        file: &'a Path,
        flags: u8,
        what: &str,
        object: &mut Cursor<'a>,
        budget: &mut Budget,
    ) -> Result<Option<Self>> {
        if flags & 0x20 == 0 {
            return Ok(None);
        }
        let length = object.length(flags >> 6, &format!("the length of {what}"))?;
        let cursor = object.part(length, what)?;
        let raw = cursor.clone().take(length, what)?;
        let bytes = match flags & 7 {
            0 => Cow::Borrowed(raw),
            1 => Cow::Owned(inflate(&cursor, raw, what, budget)?),
            2 => return Err(cursor.error(format!("expected {what} plain or packed by zlib: bzip2 is not supported"))),
            code => return Err(cursor.error(format!("expected {what} plain or packed by zlib, found packing {code}"))),
        };
        Ok(Some(Self { file, bytes, cursor }))
    }

    /// A cursor at its begin.
    pub fn cursor(&self) -> Cursor<'_> {
        match &self.bytes {
            Cow::Borrowed(_) => self.cursor.clone(),
            Cow::Owned(bytes) => Cursor::unpacked(self.file, bytes, self.cursor.place()),
        }
    }
}

/// What zlib, or gzip, has packed.
fn inflate(at: &Cursor<'_>, raw: &[u8], what: &str, budget: &mut Budget) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more than is allowed tells that there was more.
    let most = budget.0.saturating_add(1);
    let read = if raw.starts_with(&[0x1f, 0x8b]) {
        flate2::read::MultiGzDecoder::new(raw).take(most).read_to_end(&mut bytes)
    } else {
        flate2::read::ZlibDecoder::new(raw).take(most).read_to_end(&mut bytes)
    };
    read.map_err(|e| at.error(format!("expected {what} packed by zlib, damaged after {} bytes: {e}", bytes.len())))?;
    if bytes.len() as u64 > budget.0 {
        return Err(at.error("the packed parts of this file unpack to more than is allowed for its size"));
    }
    budget.0 -= bytes.len() as u64;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_budget_is_for_all_parts_together() {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(&[7; 600]).unwrap();
        let packed = encoder.finish().unwrap();
        let mut budget = Budget(1000);
        let file = Path::new("f");
        let at = Cursor::new(file, &packed);
        assert_eq!(inflate(&at, &packed, "a body", &mut budget).unwrap(), [7; 600]);
        let error = inflate(&at, &packed, "a body", &mut budget).unwrap_err().to_string();
        assert_eq!(error, "f: byte 0: the packed parts of this file unpack to more than is allowed for its size");
        let error = inflate(&at, &packed[..9], "a body", &mut Budget(1000)).unwrap_err().to_string();
        assert!(error.starts_with("f: byte 0: expected a body packed by zlib, damaged after "), "{error}");
    }
}
