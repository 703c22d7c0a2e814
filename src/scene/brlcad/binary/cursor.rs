//! A cursor over big-endian data, with the places of what is wrong.

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, Result};

/// A cursor over a part of a file, or over data unpacked from one.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    /// Place of the first byte in the file.
    origin: usize,
    /// The bytes were packed: all of them have the place of the first.
    packed: bool,
}

impl<'a> Cursor<'a> {
    /// Over all of a file.
    pub fn new(file: &'a Path, bytes: &'a [u8]) -> Self {
        Self { file, bytes, at: 0, origin: 0, packed: false }
    }

    /// Over what was unpacked from the data at `origin`.
    pub fn unpacked(file: &'a Path, bytes: &'a [u8], origin: usize) -> Self {
        Self { file, bytes, at: 0, origin, packed: true }
    }

    /// Place of the next byte in the file.
    pub fn place(&self) -> usize {
        if self.packed { self.origin } else { self.origin + self.at }
    }

    /// How many bytes are left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// An error at the next byte.
    pub fn error(&self, what: impl Into<String>) -> Error {
        Error::at_byte(self.file, self.place() as u64, what)
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: u64, what: &str) -> Result<&'a [u8]> {
        let left = self.left();
        let Some(count) = usize::try_from(count).ok().filter(|&count| count <= left) else {
            return Err(self.error(format!("expected {what} of {count} bytes, found {left}")));
        };
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    /// A cursor over the next `count` bytes, which are passed.
    pub fn part(&mut self, count: u64, what: &str) -> Result<Self> {
        let origin = self.place();
        Ok(Self { bytes: self.take(count, what)?, at: 0, origin, ..self.clone() })
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64, what)?);
        Ok(array)
    }

    /// The next byte.
    pub fn byte(&mut self, what: &str) -> Result<u8> {
        Ok(self.array::<1>(what)?[0])
    }

    /// The next 32-bit number.
    pub fn u32(&mut self, what: &str) -> Result<u32> {
        Ok(u32::from_be_bytes(self.array(what)?))
    }

    /// The next number of 1, 2, 4 or 8 bytes, by the code 0 to 3 of its width.
    pub fn length(&mut self, width: u8, what: &str) -> Result<u64> {
        let bytes = self.take(1 << width, what)?;
        Ok(bytes.iter().fold(0, |sum, &byte| sum << 8 | u64::from(byte)))
    }

    /// As [`Self::length`], with a sign.
    pub fn signed(&mut self, width: u8, what: &str) -> Result<i64> {
        let unused = 64 - (8 << width);
        Ok((self.length(width, what)? << unused) as i64 >> unused)
    }

    /// The next finite number.
    pub fn number(&mut self, what: &str) -> Result<f64> {
        let at = self.clone();
        let value = f64::from_be_bytes(self.array(what)?);
        if value.is_finite() { Ok(value) } else { Err(at.error(format!("expected {what} (a finite number)"))) }
    }

    /// The next three finite numbers.
    pub fn vector(&mut self, what: &str) -> Result<DVec3> {
        Ok(DVec3::new(self.number(what)?, self.number(what)?, self.number(what)?))
    }

    /// The next text, up to a zero byte, which is passed. Lossy UTF-8.
    pub fn text(&mut self, what: &str) -> Result<String> {
        let rest = &self.bytes[self.at..];
        let Some(length) = rest.iter().position(|&byte| byte == 0) else {
            return Err(self.error(format!("expected {what} with a zero byte at its end")));
        };
        self.at += length + 1;
        Ok(String::from_utf8_lossy(&rest[..length]).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_widths_and_their_places() {
        let bytes = [0xff, 0xff, 0xfe, 0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfd, b'a', 0, b'b'];
        let mut cursor = Cursor::new(Path::new("f"), &bytes);
        assert_eq!(cursor.clone().length(0, "n").unwrap(), 255);
        assert_eq!(cursor.signed(0, "n").unwrap(), -1);
        assert_eq!(cursor.signed(1, "n").unwrap(), -2);
        assert_eq!(cursor.length(2, "n").unwrap(), 0x10000);
        assert_eq!(cursor.signed(3, "n").unwrap(), -3);
        assert_eq!(cursor.text("a name").unwrap(), "a");
        let error = cursor.clone().text("a name").unwrap_err().to_string();
        assert_eq!(error, "f: byte 17: expected a name with a zero byte at its end");
        let error = cursor.u32("a count").unwrap_err().to_string();
        assert_eq!(error, "f: byte 17: expected a count of 4 bytes, found 1");
        let nan = f64::NAN.to_be_bytes();
        let error = Cursor::unpacked(Path::new("f"), &nan, 5).number("d").unwrap_err().to_string();
        assert_eq!(error, "f: byte 5: expected d (a finite number)");
    }
}
