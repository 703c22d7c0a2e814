//! Tokens of `.csg` files: space, comments, names, numbers, texts, lists; and the calls made of them.

use super::syntax::{Argument, Marks, Node, Source, Value, ValueKind};
use crate::error::{Error, Result};
use crate::scene::text::shown;

/// Most brackets inside one another.
const MAX_DEPTH: usize = 64;
/// What those who come with a program are told.
const HELP: &str = "a .csg file holds no variables and expressions: `openscad -o model.csg model.scad` writes one";

/// A position in the file.
pub(super) struct Cursor<'a> {
    source: Source<'a>,
    /// The next byte.
    pub at: usize,
}

impl<'a> Cursor<'a> {
    /// At the start of `source`, behind its byte order mark.
    pub fn new(source: Source<'a>) -> Self {
        let at = if source.bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { source, at }
    }

    /// The next byte.
    pub fn peek(&self) -> Option<u8> {
        self.source.bytes.get(self.at).copied()
    }

    fn rest(&self) -> &'a [u8] {
        &self.source.bytes[self.at..]
    }

    fn error(&self, at: usize, what: impl Into<String>) -> Error {
        self.source.error(at as u32, what)
    }

    /// Skips white space and comments.
    ///
    /// # Errors
    /// A comment without an end.
    pub fn skip_space(&mut self) -> Result<()> {
        loop {
            let rest = self.rest();
            if rest.starts_with(b"//") {
                self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            } else if rest.starts_with(b"/*") {
                let Some(length) = rest.windows(2).skip(2).position(|w| w == b"*/") else {
                    return Err(self.error(self.at, "this comment has no end: expected `*/`"));
                };
                self.at += length + 4;
            } else if rest.first().is_some_and(u8::is_ascii_whitespace) {
                self.at += 1;
            } else {
                return Ok(());
            }
        }
    }

    /// The error that `wanted` should be here.
    pub fn unexpected(&self, wanted: &str) -> Error {
        let rest = self.rest();
        let is_word = |&&b: &&u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'$';
        let found = match rest.first() {
            None => "the end of the file".into(),
            Some(b) if is_word(&b) => shown(&rest[..rest.iter().take_while(is_word).count()]),
            // A whole character.
            Some(_) => shown(&rest[..1 + rest[1..].iter().take_while(|&&b| b & 0xc0 == 0x80).count()]),
        };
        let error = self.error(self.at, format!("expected {wanted}, found {found}"));
        let is_program = rest.first().is_some_and(|b| is_word(&b) || b"=:?+*/(".contains(b));
        if is_program { error.with_help(HELP) } else { error }
    }

    /// Steps over `byte`, which comes next, or else `wanted` was.
    fn expect(&mut self, byte: u8, wanted: &str) -> Result<()> {
        self.skip_space()?;
        if self.peek() != Some(byte) {
            return Err(self.unexpected(wanted));
        }
        self.at += 1;
        Ok(())
    }

    /// The name that comes next, empty if none does.
    fn word(&mut self) -> &'a str {
        let rest = self.rest();
        let first = rest.first().is_some_and(|&b| b.is_ascii_alphabetic() || b == b'_' || b == b'$');
        let after = rest.iter().skip(1).take_while(|&&b| b.is_ascii_alphanumeric() || b == b'_').count();
        let length = if first { 1 + after } else { 0 };
        self.at += length;
        std::str::from_utf8(&rest[..length]).unwrap_or("")
    }

    /// A module with its marks and arguments, without what is in its braces.
    ///
    /// # Errors
    /// Anything else.
    pub fn call(&mut self) -> Result<Node<'a>> {
        let mut marks = Marks::default();
        let at = self.at as u32;
        loop {
            match self.peek() {
                Some(b'*') => marks.disabled = true,
                Some(b'%') => marks.background = true,
                Some(b'!') => marks.root = true,
                Some(b'#') => {}
                _ => break,
            }
            self.at += 1;
            self.skip_space()?;
        }
        let name = self.word();
        if name.is_empty() {
            return Err(self.unexpected("a module such as `union()`"));
        }
        self.expect(b'(', "`(`")?;
        let arguments = self.arguments()?;
        Ok(Node { name, at, marks, arguments, children: Vec::new() })
    }

    /// What is between parentheses, and the closing one.
    fn arguments(&mut self) -> Result<Vec<Argument<'a>>> {
        let mut arguments = Vec::new();
        loop {
            self.skip_space()?;
            if self.peek() == Some(b')') {
                self.at += 1;
                return Ok(arguments);
            }
            let start = self.at;
            let name = self.word();
            self.skip_space()?;
            let name = if !name.is_empty() && self.peek() == Some(b'=') {
                self.at += 1;
                Some(name)
            } else {
                self.at = start;
                None
            };
            arguments.push(Argument { name, value: self.value()? });
            self.skip_space()?;
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b')') => {}
                _ => return Err(self.unexpected("`,` or `)`")),
            }
        }
    }

    /// A value.
    ///
    /// # Errors
    /// Anything else, and lists nested too deep.
    fn value(&mut self) -> Result<Value> {
        let mut open: Vec<(u32, Vec<Value>)> = Vec::new();
        loop {
            self.skip_space()?;
            let at = self.at as u32;
            let mut value = if self.peek() == Some(b'[') {
                if open.len() >= MAX_DEPTH {
                    return Err(self.error(self.at, format!("lists nest deeper than {MAX_DEPTH} levels")));
                }
                self.at += 1;
                open.push((at, Vec::new()));
                self.skip_space()?;
                if self.peek() != Some(b']') {
                    continue;
                }
                None
            } else {
                Some(Value { at, kind: self.single()? })
            };
            // Whatever is complete goes into the list around it.
            loop {
                let Some((start, list)) = open.last_mut() else {
                    return value.ok_or_else(|| self.unexpected("a value"));
                };
                list.extend(value.take());
                let start = *start;
                self.skip_space()?;
                match self.peek() {
                    Some(b',') => {
                        self.at += 1;
                        self.skip_space()?;
                        if self.peek() != Some(b']') {
                            break;
                        }
                    }
                    Some(b']') => {
                        self.at += 1;
                        let list = open.pop().map(|(_, list)| list).unwrap_or_default();
                        value = Some(Value { at: start, kind: ValueKind::List(list) });
                    }
                    _ => return Err(self.unexpected("`,` or `]`")),
                }
            }
        }
    }

    /// A value that is no list.
    fn single(&mut self) -> Result<ValueKind> {
        const WANTED: &str = "a number, a text, a list, `true`, `false` or `undef`";
        let start = self.at;
        match self.peek() {
            Some(b'"') => return self.text(),
            Some(b'0'..=b'9' | b'.' | b'-' | b'+') => return self.number(),
            _ => {}
        }
        match self.word() {
            "true" => Ok(ValueKind::Bool(true)),
            "false" => Ok(ValueKind::Bool(false)),
            "undef" => Ok(ValueKind::Undef),
            "inf" => Ok(ValueKind::Number(f64::INFINITY)),
            "nan" => Ok(ValueKind::Number(f64::NAN)),
            _ => {
                self.at = start;
                Err(self.unexpected(WANTED))
            }
        }
    }

    fn number(&mut self) -> Result<ValueKind> {
        let rest = self.rest();
        let mut length = 0;
        while let Some(&b) = rest.get(length) {
            let is_sign = b == b'-' || b == b'+';
            let after_exponent = length > 0 && rest[length - 1].eq_ignore_ascii_case(&b'e');
            if !(b.is_ascii_alphanumeric() || b == b'.' || is_sign && (length == 0 || after_exponent)) {
                break;
            }
            length += 1;
        }
        let written = &rest[..length];
        let number = std::str::from_utf8(written).ok().and_then(|text| text.parse().ok());
        let Some(number) = number else {
            return Err(self.error(self.at, format!("expected a number, found {}", shown(written))));
        };
        self.at += length;
        Ok(ValueKind::Number(number))
    }

    fn text(&mut self) -> Result<ValueKind> {
        let start = self.at;
        let mut bytes = Vec::new();
        self.at += 1;
        loop {
            match self.rest() {
                [b'"', ..] => {
                    self.at += 1;
                    return Ok(ValueKind::Text(String::from_utf8_lossy(&bytes).into()));
                }
                [b'\\', escaped, ..] => {
                    bytes.push(match escaped {
                        b'n' => b'\n',
                        b't' => b'\t',
                        b'r' => b'\r',
                        other => *other,
                    });
                    self.at += 2;
                }
                [] | [b'\\'] => return Err(self.error(start, "this text has no closing `\"`")),
                [byte, ..] => {
                    bytes.push(*byte);
                    self.at += 1;
                }
            }
        }
    }
}
