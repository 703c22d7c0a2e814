//! Lines of a database text and the fields in them, with their places.

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, Place, Result};
use crate::scene::text::{error_at, is_blank, is_newline, shown};

/// One line without its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Byte position of its first byte.
    pub at: usize,
    /// Its number, from 1.
    pub number: u64,
    pub bytes: &'a [u8],
}

impl Line<'_> {
    /// Where the line begins.
    pub fn place(&self) -> Place {
        Place::LineColumn { line: self.number, column: 1 }
    }

    /// The line as a text: lossy UTF-8, without blanks around it.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(self.bytes.trim_ascii()).into_owned()
    }
}

/// The lines of a text.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    number: u64,
}

impl<'a> Lines<'a> {
    pub fn new(file: &'a Path, bytes: &'a [u8]) -> Self {
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { file, bytes, at, number: 0 }
    }

    /// The next line, empty ones included.
    pub fn next(&mut self) -> Option<Line<'a>> {
        let (line, end) = self.look()?;
        self.at = end;
        self.number += 1;
        Some(line)
    }

    /// Where the next line begins.
    pub fn position(&self) -> usize {
        self.at
    }

    /// The next line if it begins with `first`; else it stays.
    pub fn next_if(&mut self, first: u8) -> Option<Line<'a>> {
        let (line, _) = self.look()?;
        if line.bytes.first() == Some(&first) { self.next() } else { None }
    }

    /// The next line where the file must go on with `what`.
    pub fn expect(&mut self, what: &str) -> Result<Line<'a>> {
        self.next().ok_or_else(|| self.error(self.bytes.len(), format!("the file ends where {what} was expected")))
    }

    /// The next line and where the one after it begins.
    fn look(&self) -> Option<(Line<'a>, usize)> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        let end = match rest[length..] {
            [b'\r', b'\n', ..] => 2,
            [_, ..] => 1,
            [] => 0,
        };
        let line = Line { at: self.at, number: self.number + 1, bytes: &rest[..length] };
        Some((line, self.at + length + end))
    }

    /// An error at byte `at`.
    pub fn error(&self, at: usize, what: impl Into<String>) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    /// The fields of `line` from its byte `from` on.
    pub fn fields(&self, line: Line<'a>, from: usize) -> Fields<'a> {
        Fields { file: self.file, bytes: self.bytes, at: line.at + from, end: line.at + line.bytes.len() }
    }
}

/// Fields of a line, separated by blanks.
#[derive(Clone, Debug)]
pub(super) struct Fields<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    end: usize,
}

impl<'a> Fields<'a> {
    /// The fields between two bytes; ends of lines separate them too.
    pub fn new(file: &'a Path, bytes: &'a [u8], at: usize, end: usize) -> Self {
        Self { file, bytes, at, end }
    }

    /// The next field and where it begins.
    pub fn next(&mut self) -> Option<(usize, &'a [u8])> {
        while self.at < self.end && is_space(self.bytes[self.at]) {
            self.at += 1;
        }
        let start = self.at;
        while self.at < self.end && !is_space(self.bytes[self.at]) {
            self.at += 1;
        }
        (self.at > start).then(|| (start, &self.bytes[start..self.at]))
    }

    /// An error at byte `at`.
    pub fn error(&self, at: usize, what: impl Into<String>) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    /// The next field, which must be there.
    pub fn expect(&mut self, what: &str) -> Result<(usize, &'a [u8])> {
        self.next().ok_or_else(|| self.error(self.at, format!("expected {what}, found the end of the line")))
    }

    /// The next field as a name.
    pub fn name(&mut self, what: &str) -> Result<String> {
        Ok(String::from_utf8_lossy(self.expect(what)?.1).into_owned())
    }

    /// The next field as a whole number.
    pub fn int<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let (at, word) = self.expect(what)?;
        let value = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        value.ok_or_else(|| self.error(at, format!("expected {what} (a whole number), found {}", shown(word))))
    }

    /// As [`Self::int`]; 0 if the line has ended.
    pub fn int_or_zero(&mut self, what: &str) -> Result<i32> {
        if self.clone().next().is_some() { self.int(what) } else { Ok(0) }
    }

    /// The next field as a finite number.
    pub fn number(&mut self, what: &str) -> Result<f64> {
        let (at, word) = self.expect(what)?;
        let value: Option<f64> = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        value.filter(|v| v.is_finite()).ok_or_else(|| {
            let what = format!("expected {what} (a finite number), found {}", shown(word));
            self.error(at, what)
        })
    }

    /// The next three fields as a point or vector.
    pub fn vector(&mut self, what: &str) -> Result<DVec3> {
        Ok(DVec3::new(self.number(what)?, self.number(what)?, self.number(what)?))
    }
}

fn is_space(byte: u8) -> bool {
    is_blank(byte) || is_newline(byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_every_way_and_keep_their_numbers() {
        let mut lines = Lines::new(Path::new("f"), b"a\r\nb\rc\n\nd");
        let mut seen = Vec::new();
        while let Some(line) = lines.next() {
            seen.push((line.number, line.at, line.text()));
        }
        let expected = [(1, 0, "a"), (2, 3, "b"), (3, 5, "c"), (4, 7, ""), (5, 8, "d")];
        assert_eq!(seen, expected.map(|(n, at, text)| (n, at, text.to_owned())));
        assert!(lines.expect("a member").unwrap_err().to_string().contains("where a member was expected"));
    }

    #[test]
    fn fields_say_what_they_expected_and_where() {
        let mut lines = Lines::new(Path::new("f"), b"S 16 x nan 3\n");
        let line = lines.next().unwrap();
        let mut fields = lines.fields(line, 1);
        assert_eq!(fields.int::<i32>("a type").unwrap(), 16);
        assert_eq!(fields.name("a name").unwrap(), "x");
        let error = fields.number("the radius").unwrap_err().to_string();
        assert!(error.starts_with("f:1:8: expected the radius (a finite number), found `nan`"), "{error}");
        assert_eq!(fields.number("n").unwrap(), 3.0);
        assert_eq!(fields.int_or_zero("n").unwrap(), 0);
        assert!(fields.number("n").unwrap_err().to_string().starts_with("f:1:13: expected n, found the end"));
    }
}
