//! Words and lists of Tcl, as far as text databases of version 5 use it: no substitution of variables or commands.
//!
//! Source: John Ousterhout, "Tcl and the Tk Toolkit", 1994, chapter 3 (syntax).

use std::borrow::Cow;
use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::scene::text::error_at;

/// One word.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    /// Byte position of its first byte, inside braces or quotes.
    pub at: usize,
    pub bytes: &'a [u8],
    /// Whether braces stood around it: then backslashes mean themselves.
    braced: bool,
}

impl<'a> Word<'a> {
    /// The word's text; lossy UTF-8, backslashes taken away outside braces.
    pub fn text(&self) -> Cow<'a, str> {
        let text = String::from_utf8_lossy(self.bytes);
        if self.braced || !self.bytes.contains(&b'\\') {
            return text;
        }
        let mut out = String::with_capacity(text.len());
        let mut chars = text.chars();
        while let Some(c) = chars.next() {
            out.push(if c == '\\' { chars.next().unwrap_or(c) } else { c });
        }
        out.into()
    }
}

/// A cursor over the words of a text or of a list.
#[derive(Clone, Debug)]
pub(super) struct Words<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    end: usize,
    /// Lines that end before `line_at`, for places.
    line: u64,
    line_at: usize,
}

impl<'a> Words<'a> {
    pub fn new(file: &'a Path, bytes: &'a [u8]) -> Self {
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { file, bytes, at, end: bytes.len(), line: 1, line_at: 0 }
    }

    /// The words of the list that `word` holds.
    pub fn inside(&self, word: Word<'a>) -> Self {
        Self { at: word.at, end: word.at + word.bytes.len(), ..self.clone() }
    }

    /// An error at byte `at`.
    pub fn error(&self, at: usize, what: impl Into<String>) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    /// Number of the line of byte `at`, from 1: counts from the start of the file.
    pub fn line_of(&self, at: usize) -> usize {
        1 + self.bytes[..at].iter().filter(|&&b| b == b'\n').count()
    }

    /// Where the cursor is.
    pub fn position(&self) -> usize {
        self.at
    }

    /// The line of byte `at`, which must not lie before an earlier one asked for.
    pub fn place(&mut self, at: usize) -> Place {
        let passed = &self.bytes[self.line_at.min(at)..at];
        self.line += passed.iter().filter(|&&b| b == b'\n').count() as u64;
        self.line_at = at;
        Place::LineColumn { line: self.line, column: 1 }
    }

    /// Passes over white space that does not end a command, or over all of it.
    fn skip(&mut self, all: bool) {
        while self.at < self.end {
            match self.bytes[self.at] {
                b'\\' if matches!(self.bytes.get(self.at + 1), Some(b'\n' | b'\r')) => self.at += 2,
                b'\n' | b';' if !all => break,
                b if b.is_ascii_whitespace() || b == 0x0b || b == b';' && all => self.at += 1,
                _ => break,
            }
        }
    }

    /// Goes to the next command; false at the end. Comments are passed over.
    pub fn next_command(&mut self) -> bool {
        loop {
            self.skip(true);
            if self.at >= self.end {
                return false;
            }
            if self.bytes[self.at] != b'#' {
                return true;
            }
            while self.at < self.end && self.bytes[self.at] != b'\n' {
                self.at += 1;
            }
        }
    }

    /// The next word of this command.
    pub fn next_in_command(&mut self) -> Result<Option<Word<'a>>> {
        self.skip(false);
        if self.at >= self.end || matches!(self.bytes[self.at], b'\n' | b';') {
            Ok(None)
        } else {
            self.word().map(Some)
        }
    }

    /// The next element of a list.
    pub fn next(&mut self) -> Result<Option<Word<'a>>> {
        while self.at < self.end {
            match self.bytes[self.at] {
                b'\\' if matches!(self.bytes.get(self.at + 1), Some(b'\n' | b'\r')) => self.at += 2,
                b if b.is_ascii_whitespace() || b == 0x0b => self.at += 1,
                _ => break,
            }
        }
        if self.at >= self.end { Ok(None) } else { self.word().map(Some) }
    }

    /// The next element of a list, which must be there.
    pub fn expect(&mut self, what: &str) -> Result<Word<'a>> {
        match self.next()? {
            Some(word) => Ok(word),
            None => Err(self.error(self.at, format!("expected {what}"))),
        }
    }

    /// Passes `byte` if it is the next one after white space.
    pub fn passes(&mut self, byte: u8) -> bool {
        while self.at < self.end && self.bytes[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
        let found = self.at < self.end && self.bytes[self.at] == byte;
        self.at += usize::from(found);
        found
    }

    fn word(&mut self) -> Result<Word<'a>> {
        match self.bytes[self.at] {
            b'{' => self.braced(),
            b'"' => self.quoted(),
            _ => Ok(self.bare()),
        }
    }

    fn braced(&mut self) -> Result<Word<'a>> {
        let start = self.at + 1;
        let mut depth = 0usize;
        let mut at = self.at;
        while at < self.end {
            match self.bytes[at] {
                b'{' => depth += 1,
                b'}' => depth -= 1,
                b'\\' => at += 1,
                _ => {}
            }
            at += 1;
            if depth == 0 {
                self.at = at;
                return Ok(Word { at: start, bytes: &self.bytes[start..at - 1], braced: true });
            }
        }
        Err(self.error(self.at, "this `{` is never closed"))
    }

    fn quoted(&mut self) -> Result<Word<'a>> {
        let start = self.at + 1;
        let mut at = start;
        while at < self.end {
            match self.bytes[at] {
                b'"' => {
                    self.at = at + 1;
                    return Ok(Word { at: start, bytes: &self.bytes[start..at], braced: false });
                }
                b'\\' => at += 2,
                _ => at += 1,
            }
        }
        Err(self.error(self.at, "this `\"` is never closed"))
    }

    /// A word up to white space, `;` or a brace.
    fn bare(&mut self) -> Word<'a> {
        let start = self.at;
        while self.at < self.end {
            match self.bytes[self.at] {
                // A line that goes on in the next one: white space.
                b'\\' if self.at > start && matches!(self.bytes.get(self.at + 1), Some(b'\n' | b'\r')) => break,
                b'\\' => self.at = (self.at + 2).min(self.end),
                b'{' | b'}' | b';' if self.at > start => break,
                b if b.is_ascii_whitespace() => break,
                _ => self.at += 1,
            }
        }
        Word { at: start, bytes: &self.bytes[start..self.at], braced: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_words_braces_and_quotes() {
        let text = b"# c {\nput {a b} comb\\\n x {u {l x} {l\ny}}\n\n;title \"a \\\" b\" c\\ d # no";
        let mut words = Words::new(Path::new("f"), text);
        let mut commands = Vec::new();
        while words.next_command() {
            let mut command = Vec::new();
            while let Some(word) = words.next_in_command().unwrap() {
                command.push(word.text().into_owned());
            }
            commands.push(command);
        }
        let first = ["put", "a b", "comb", "x", "u {l x} {l\ny}"];
        assert_eq!(commands, [first.to_vec(), ["title", "a \" b", "c d", "#", "no"].to_vec()]);
    }

    #[test]
    fn lists_nest_and_open_braces_are_errors() {
        let mut words = Words::new(Path::new("f"), b"a\\\n b\\\n");
        let next = |words: &mut Words| words.next().unwrap().map(|word| word.text().into_owned());
        assert_eq!([(); 3].map(|()| next(&mut words)), [Some("a".into()), Some("b".into()), None]);
        let mut words = Words::new(Path::new("f"), b"{1 2  {3 4}}");
        let outer = words.next().unwrap().unwrap();
        let mut inner = words.inside(outer);
        let mut found = Vec::new();
        while let Some(word) = inner.next().unwrap() {
            found.push((word.at, word.text().into_owned()));
        }
        assert_eq!(found, [(1, "1".into()), (3, "2".into()), (7, "3 4".into())]);
        let error = Words::new(Path::new("f"), b"\n {a {b}").next().unwrap_err().to_string();
        assert!(error.starts_with("f:2:2: this `{` is never closed"), "{error}");
        assert!(Words::new(Path::new("f"), b"\"a\\\"").next().is_err());
        assert!(Words::new(Path::new("f"), b"{a\\}").next().is_err(), "the escaped brace does not close");
    }
}
