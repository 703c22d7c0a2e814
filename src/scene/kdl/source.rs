//! The text of a scene file and the errors that point into it.

use std::path::Path;

use crate::error::{Error, Result, nearest_name};

/// Longest name that misspelling hints look at; edit distance is quadratic in it.
const MAX_HINT_LETTERS: usize = 48;
/// Most candidates a misspelling hint looks at.
const MAX_HINT_CANDIDATES: usize = 4096;
/// Largest column at which the source line is still shown under the message.
const MAX_SHOWN_COLUMN: u64 = 150;

/// A range of bytes of the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The range `start..end`; positions fit because the file size is limited.
    pub fn new(start: usize, end: usize) -> Self {
        Self { start: start as u32, end: end as u32 }
    }
}

/// A scene file's name and text.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The file as the user named it, or `builtin:NAME`.
    pub file: &'a Path,
    /// Its text, without a byte order mark.
    pub text: &'a str,
}

impl<'a> Source<'a> {
    /// The text behind `bytes`.
    ///
    /// # Errors
    /// More than [`super::MAX_BYTES`], bytes that are not UTF-8, or characters KDL forbids.
    pub fn new(file: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        if bytes.len() as u64 > super::MAX_BYTES {
            let limit = super::MAX_BYTES >> 20;
            return Err(Error::whole(file, format!("larger than {limit} MiB, the limit for scene files")));
        }
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text,
            Err(bad) => {
                let valid = std::str::from_utf8(&bytes[..bad.valid_up_to()]).unwrap_or("");
                let (line, column) = line_column(valid, valid.len());
                return Err(Error::at_line(file, line, column, "expected UTF-8 text, found other bytes"));
            }
        };
        let source = Self { file, text };
        match text.char_indices().find(|&(_, c)| is_forbidden(c)) {
            Some((at, c)) => {
                let code = u32::from(c);
                Err(source.error(Span::new(at, at), format!("the character U+{code:04X} is not allowed in KDL")))
            }
            None => Ok(source),
        }
    }

    /// The error that `what` is wrong at `span`, showing its line.
    pub fn error(&self, span: Span, what: impl Into<String>) -> Error {
        let at = (span.start as usize).min(self.text.len());
        let (line, column) = line_column(self.text, at);
        let error = Error::at_line(self.file, line, column, what);
        if column > MAX_SHOWN_COLUMN {
            return error;
        }
        let is_break = |c| c == '\n' || c == '\r';
        let start = self.text[..at].rfind(is_break).map_or(0, |i| i + 1);
        let end = self.text[at..].find(is_break).map_or(self.text.len(), |i| at + i);
        error.with_line_text(&self.text[start..end])
    }

    /// [`Source::error`] with a hint if one of `candidates` is spelt like `word`.
    pub fn error_near<'c>(
        &self,
        span: Span,
        what: impl Into<String>,
        word: &str,
        candidates: impl IntoIterator<Item = &'c str>,
    ) -> Error {
        let error = self.error(span, what);
        match near(word, candidates) {
            Some(name) => error.with_help(format!("did you mean `{name}`?")),
            None => error,
        }
    }
}

/// The candidate spelt like `word`, in bounded time whatever the lengths.
pub fn near<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let short = |s: &str| s.len() <= MAX_HINT_LETTERS;
    if !short(word) {
        return None;
    }
    nearest_name(word, candidates.into_iter().filter(|c| short(c)).take(MAX_HINT_CANDIDATES))
}

/// `name` in backquotes, cut to a length worth reading.
pub fn quote(name: &str) -> String {
    const SHOWN: usize = 40;
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let head: String = name.chars().take(SHOWN).map(clean).collect();
    if head.len() < name.len() { format!("`{head}...`") } else { format!("`{head}`") }
}

/// 1-based line and column (characters) of byte `at`; lines end with LF, CR LF or CR.
fn line_column(text: &str, at: usize) -> (u64, u64) {
    let before = &text.as_bytes()[..at];
    let mut line = 1;
    let mut start = 0;
    for (i, &byte) in before.iter().enumerate() {
        if byte == b'\n' || (byte == b'\r' && text.as_bytes().get(i + 1) != Some(&b'\n')) {
            line += 1;
            start = i + 1;
        }
    }
    (line, text[start..at].chars().count() as u64 + 1)
}

/// Code points that may not appear literally in a KDL document (KDL 2.0.0, "Disallowed Literal Code Points").
fn is_forbidden(c: char) -> bool {
    matches!(c, '\0'..='\u{8}' | '\u{e}'..='\u{1f}' | '\u{7f}' | '\u{200e}' | '\u{200f}'
        | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters() {
        let text = "ab\r\nçdé\rx\n";
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, 4), (2, 1));
        assert_eq!(line_column(text, 7), (2, 3));
        assert_eq!(line_column(text, text.find('x').unwrap()), (3, 1));
        assert_eq!(line_column(text, text.len()), (4, 1));
    }

    #[test]
    fn hints_ignore_monstrous_names() {
        let long = "a".repeat(1 << 20);
        assert_eq!(near(&long, ["sphere"]), None);
        assert_eq!(near("spher", [long.as_str(), "sphere"]), Some("sphere"));
        assert!(quote(&long).len() < 60);
    }
}
