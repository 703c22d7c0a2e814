//! Reading the rows of a PLY file value by value, from text or binary data.

use std::path::Path;

use super::header::Scalar;
use crate::error::{Error, Result};
use crate::scene::text::{self, Word, Words, error_at};

/// A source of values in file order.
pub(super) trait Values {
    /// Fewest bytes a value of this type takes.
    fn least_bytes(scalar: Scalar) -> u64;
    /// Bytes left for values that take [`Self::least_bytes`] each.
    fn capacity(&self) -> u64;
    /// The next value; f32 and integers widen exactly.
    fn float(&mut self, scalar: Scalar) -> Result<f64>;
    /// The next value, which must be integral.
    fn int(&mut self, scalar: Scalar) -> Result<i64>;
    /// Passes over `count` values.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<()>;
    /// An error at the value that was read last.
    fn error(&self, what: String) -> Error;
    /// An error at byte `at` of the header.
    fn header_error(&self, at: usize, what: String) -> Error;
    /// Refuses data after the last element.
    fn finish(&mut self) -> Result<()>;

    /// The next value as the length of a list whose items fit into the rest of the file.
    fn length(&mut self, count: Scalar, item: Scalar) -> Result<u64> {
        let length = self.int(count)?;
        let fits = u64::try_from(length).ok().filter(|&n| n <= self.capacity() / Self::least_bytes(item));
        fits.ok_or_else(|| match length {
            ..0 => self.error(format!("expected the length of a list, found {length}")),
            _ => self.error(format!("a list of {length} items does not fit into the {} bytes left", self.capacity())),
        })
    }
}

/// An integral f64 as an integer.
fn integral(value: f64) -> Option<i64> {
    // Beyond 2^53 neighbours are no longer one apart, and no count or index is that large.
    (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i64)
}

/// Values of a text file: words, wherever the lines end.
pub(super) struct Text<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    words: Words<'a>,
    /// Position of the last word.
    last: usize,
}

impl<'a> Text<'a> {
    pub fn new(file: &'a Path, bytes: &'a [u8], body: usize) -> Self {
        Self { file, bytes, words: Words::new(file, bytes, body), last: body }
    }

    fn word(&mut self) -> Result<Word<'a>> {
        let word =
            self.words.next().ok_or_else(|| self.words.missing("expected a number, found the end of the file"))?;
        self.last = word.at;
        Ok(word)
    }

    fn wrong(&self, word: Word<'_>, expected: &str) -> Error {
        self.words.error(word.at, format!("expected {expected}, found {}", word.shown()))
    }
}

impl Values for Text<'_> {
    /// A digit and a blank.
    fn least_bytes(_: Scalar) -> u64 {
        2
    }

    /// One more than there is: the last value needs no blank.
    fn capacity(&self) -> u64 {
        self.words.rest().len() as u64 + 1
    }

    fn float(&mut self, scalar: Scalar) -> Result<f64> {
        let word = self.word()?;
        let value = match scalar {
            Scalar::F32 => word.float::<f32>().map(f64::from),
            Scalar::F64 => word.float(),
            _ => text::int(word.bytes).map(|n| n as f64),
        };
        value.ok_or_else(|| self.wrong(word, "a number of the property's type"))
    }

    fn int(&mut self, scalar: Scalar) -> Result<i64> {
        let word = self.word()?;
        let value = match scalar {
            Scalar::F32 | Scalar::F64 => word.float().and_then(integral),
            _ => text::int(word.bytes),
        };
        value.ok_or_else(|| self.wrong(word, "an integer"))
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Result<()> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn error(&self, what: String) -> Error {
        self.words.error(self.last, what)
    }

    fn header_error(&self, at: usize, what: String) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    fn finish(&mut self) -> Result<()> {
        let rest = self.words.rest();
        match self.words.next() {
            Some(word) if !text::is_padding(rest) => Err(self.wrong(word, "the end of the file")),
            _ => Ok(()),
        }
    }
}

/// Values of a binary file; `BIG` is the byte order.
pub(super) struct Binary<'a, const BIG: bool> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    /// Position of the last value.
    last: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub fn new(file: &'a Path, bytes: &'a [u8], body: usize) -> Self {
        Self { file, bytes, at: body, last: body }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        self.last = self.at;
        let Some(mut value) = self.bytes[self.at..].first_chunk::<N>().copied() else {
            return Err(self.short(N as u64));
        };
        self.at += N;
        if BIG {
            value.reverse();
        }
        Ok(value)
    }

    #[cold]
    fn short(&self, need: u64) -> Error {
        let left = self.bytes.len() - self.at;
        Error::at_byte(self.file, self.at as u64, format!("expected {need} more bytes, found {left}"))
    }
}

impl<const BIG: bool> Values for Binary<'_, BIG> {
    fn least_bytes(scalar: Scalar) -> u64 {
        match scalar {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    fn capacity(&self) -> u64 {
        (self.bytes.len() - self.at) as u64
    }

    #[inline]
    fn float(&mut self, scalar: Scalar) -> Result<f64> {
        Ok(match scalar {
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
            _ => self.int(scalar)? as f64,
        })
    }

    #[inline]
    fn int(&mut self, scalar: Scalar) -> Result<i64> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 | Scalar::F64 => {
                let value = self.float(scalar)?;
                integral(value).ok_or_else(|| self.error(format!("expected an integer, found {value}")))?
            }
        })
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<()> {
        let need = count.saturating_mul(Self::least_bytes(scalar));
        if need > self.capacity() {
            return Err(self.short(need));
        }
        self.at += need as usize;
        Ok(())
    }

    fn error(&self, what: String) -> Error {
        Error::at_byte(self.file, self.last as u64, what)
    }

    fn header_error(&self, at: usize, what: String) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    fn finish(&mut self) -> Result<()> {
        let rest = &self.bytes[self.at..];
        if text::is_padding(rest) {
            return Ok(());
        }
        let what = format!("expected the end of the file after the last element, found {} more bytes", rest.len());
        Err(Error::at_byte(self.file, self.at as u64, what))
    }
}
