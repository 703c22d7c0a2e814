//! The corner of Python's literal syntax that NumPy headers are written in. No recursion, so nothing nests deeply.

use std::path::Path;

use crate::error::{Error, Result};

/// Reads literals from the header's text; knows where it is for messages.
pub(super) struct Literals<'a> {
    file: &'a Path,
    text: &'a [u8],
    /// Offset of `text` in the file.
    base: u64,
    at: usize,
}

impl<'a> Literals<'a> {
    pub(super) fn new(file: &'a Path, text: &'a [u8], base: u64) -> Self {
        Self { file, text, base, at: 0 }
    }

    /// Offset in the file of the next character that is no space.
    pub(super) fn place(&mut self) -> u64 {
        self.skip_space();
        self.base + self.at as u64
    }

    /// What stands here instead of `wanted`.
    pub(super) fn unexpected(&mut self, wanted: &str) -> Error {
        let place = self.place();
        let found = match self.peek() {
            Some(c) => format!("`{}`", char::from(c).escape_default()),
            None => "the header's end".to_owned(),
        };
        Error::at_byte(self.file, place, format!("expected {wanted}, found {found}"))
    }

    fn skip_space(&mut self) {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    pub(super) fn peek(&mut self) -> Option<u8> {
        self.skip_space();
        self.text.get(self.at).copied()
    }

    /// Takes `c` if it is next.
    pub(super) fn take(&mut self, c: u8) -> bool {
        let is_next = self.peek() == Some(c);
        self.at += usize::from(is_next);
        is_next
    }

    /// Takes `c` or fails.
    pub(super) fn expect(&mut self, c: u8) -> Result<()> {
        if self.take(c) { Ok(()) } else { Err(self.unexpected(&format!("`{}`", char::from(c)))) }
    }

    /// After an element of a sequence: a comma before the next one, or the closing bracket. True at the end.
    pub(super) fn element_ends(&mut self, close: u8) -> Result<bool> {
        let comma = self.take(b',');
        if self.take(close) {
            return Ok(true);
        }
        if comma { Ok(false) } else { Err(self.unexpected(&format!("`,` or `{}`", char::from(close)))) }
    }

    /// A string in single or double quotes, printable ASCII, no escapes.
    pub(super) fn string(&mut self) -> Result<String> {
        let Some(quote @ (b'\'' | b'"')) = self.peek() else {
            return Err(self.unexpected("a quoted string"));
        };
        self.at += 1;
        let mut value = String::new();
        loop {
            match self.text.get(self.at) {
                Some(&c) if c == quote => break,
                Some(&c) if (c.is_ascii_graphic() || c == b' ') && c != b'\\' => value.push(char::from(c)),
                _ => return Err(self.unexpected("plain ASCII and the string's closing quote")),
            }
            self.at += 1;
        }
        self.at += 1;
        Ok(value)
    }

    /// `True` or `False`.
    pub(super) fn boolean(&mut self) -> Result<bool> {
        self.skip_space();
        let rest = &self.text[self.at..];
        for (word, value) in [("True", true), ("False", false)] {
            if rest.starts_with(word.as_bytes()) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(self.unexpected("`True` or `False`"))
    }

    /// A decimal integer that is not negative.
    pub(super) fn integer(&mut self) -> Result<u64> {
        let place = self.place();
        let digits = self.text[self.at..].iter().take_while(|c| c.is_ascii_digit()).count();
        if digits == 0 {
            return Err(self.unexpected("an integer that is not negative"));
        }
        let value = self.text[self.at..self.at + digits]
            .iter()
            .try_fold(0_u64, |n, &c| n.checked_mul(10)?.checked_add(u64::from(c - b'0')));
        self.at += digits;
        value.ok_or_else(|| Error::at_byte(self.file, place, "expected an integer below 2^64"))
    }
}
