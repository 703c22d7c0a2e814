//! Words of text formats, addressed by byte position. Line and column are worked out only when an error needs
//! them, so reading pays nothing for them.

use std::path::Path;

use crate::error::{Error, Result};

/// Longest name kept from a file, bytes: names are copied per group, so a longer one could multiply.
const MAX_NAME: usize = 255;
/// Columns up to which an error shows its line (the line is cut there, and the caret must be under it).
const SHOWN_COLUMNS: u64 = 160;

/// A run of non-blank bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    /// Byte position of its first byte.
    pub at: usize,
    /// The bytes, never empty.
    pub bytes: &'a [u8],
}

impl Word<'_> {
    /// The word as a number, if it is one (`nan` and `inf` are, also as Microsoft's libraries print them).
    pub fn float<F: std::str::FromStr>(&self) -> Option<F> {
        let text = std::str::from_utf8(self.bytes).ok()?;
        text.parse().ok().or_else(|| microsoft(text)?.parse().ok())
    }

    /// The word for an error message: quoted, cut to 40 characters.
    pub fn shown(&self) -> String {
        shown(self.bytes)
    }
}

/// The usual word for what Microsoft's C libraries print where a number is none: `-nan(ind)`, before 2015 `-1.#IND`, which a
/// precision may cut (`1.#QO`, `1.#J`).
#[cold]
fn microsoft(text: &str) -> Option<&'static str> {
    if text.len() > 16 {
        return None;
    }
    let is_negative = text.starts_with('-');
    let text = text.trim_start_matches(['+', '-']).to_ascii_uppercase();
    if ["NAN(IND)", "NAN(SNAN)"].contains(&text.as_str()) {
        return Some("nan");
    }
    let kind = text.strip_prefix("1.#")?.trim_end_matches('0');
    match kind {
        "INF" | "J" if is_negative => Some("-inf"),
        "INF" | "J" => Some("inf"),
        "IND" | "IN" | "IO" | "QNAN" | "QNA" | "QN" | "QO" | "SNAN" | "SNA" | "SN" | "SO" => Some("nan"),
        _ => None,
    }
}

/// Decimal integer with optional sign.
pub(super) fn int(bytes: &[u8]) -> Option<i64> {
    std::str::from_utf8(bytes).ok()?.parse().ok()
}

/// `bytes` in backquotes for an error message, cut to 40 characters.
pub(super) fn shown(bytes: &[u8]) -> String {
    const CHARS: usize = 40;
    // Four bytes per character at most, and one more to see that there is more.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * CHARS + 4)]);
    let mut text: String = head.chars().take(CHARS).flat_map(char::escape_debug).collect();
    if head.chars().nth(CHARS).is_some() {
        text.push('…');
    }
    format!("`{text}`")
}

/// A name from a file: lossy UTF-8, whole characters up to 255 bytes.
pub(super) fn name(bytes: &[u8]) -> String {
    // The longest character has four bytes: with those to spare, none that is kept is cut.
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_NAME + 4)]);
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8());
    let end = ends.take_while(|&end| end <= MAX_NAME).last().unwrap_or(0);
    text[..end].to_owned()
}

/// True for bytes that end a line; a lone `\r` (old Macintosh files) does too.
pub(super) fn is_newline(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// True for bytes that separate words of one line.
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

/// True if `bytes` is what writers leave behind the last element: nothing, zeros or white space.
pub(super) fn is_padding(bytes: &[u8]) -> bool {
    bytes.iter().all(|&b| b == 0 || is_blank(b) || is_newline(b))
}

/// The error `what` at byte `at` of a text file, as line and column and with the line if it is short enough.
pub(super) fn error_at(file: &Path, bytes: &[u8], at: usize, what: impl Into<String>) -> Error {
    let at = at.min(bytes.len());
    let (line, start) = line_at(bytes, at);
    // Characters are counted as UTF-8 lead bytes: right for text, harmless for anything else.
    let column = 1 + bytes[start..at].iter().filter(|&&b| b & 0xc0 != 0x80).count() as u64;
    let error = Error::at_line(file, line, column, what);
    if column > SHOWN_COLUMNS {
        return error;
    }
    let window = &bytes[start..bytes.len().min(start + 4 * SHOWN_COLUMNS as usize)];
    let end = window.iter().position(|&b| is_newline(b)).unwrap_or(window.len());
    error.with_line_text(&String::from_utf8_lossy(&window[..end]))
}

/// The line, from 1 on, that byte `at` of a text is in, and where it begins.
fn line_at(bytes: &[u8], at: usize) -> (u64, usize) {
    let (mut line, mut start) = (1, 0);
    for (i, &b) in bytes[..at].iter().enumerate() {
        if b == b'\n' || (b == b'\r' && bytes.get(i + 1) != Some(&b'\n')) {
            line += 1;
            start = i + 1;
        }
    }
    (line, start)
}

/// A cursor over the words of a text. A backslash at the end of a line joins it with the next one.
#[derive(Debug)]
pub(super) struct Words<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    /// Words of `bytes` from position `at` on; a UTF-8 byte order mark at the start of the file is passed over.
    pub fn new(file: &'a Path, bytes: &'a [u8], at: usize) -> Self {
        let at = if at == 0 && bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { at };
        Self { file, bytes, at }
    }

    /// The bytes not read yet.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next word, on this line or a later one.
    pub fn next(&mut self) -> Option<Word<'a>> {
        self.skip(true);
        self.take_word()
    }

    /// The next word of this line; the cursor stays before the line's end.
    pub fn next_in_line(&mut self) -> Option<Word<'a>> {
        self.skip(false);
        self.take_word()
    }

    /// Like [`Self::next_in_line`], but a word that begins with `#` is a comment up to the end of the line.
    pub fn next_value(&mut self) -> Option<Word<'a>> {
        self.skip(false);
        if self.bytes.get(self.at) == Some(&b'#') {
            self.rest_of_line();
        }
        self.take_word()
    }

    /// Passes over and returns what is left of this line, blanks around it removed, a final backslash kept.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&b| is_newline(b)).unwrap_or(rest.len());
        self.at += length;
        rest[..length].trim_ascii()
    }

    /// The words up to the end of the line with single spaces between: names may hold blanks and `#`.
    pub fn rest_as_name(&mut self) -> String {
        let mut joined = Vec::new();
        while let Some(word) = self.next_in_line() {
            if !joined.is_empty() {
                joined.push(b' ');
            }
            joined.extend_from_slice(word.bytes);
        }
        name(&joined)
    }

    /// The line that byte `at` is in.
    pub fn line(&self, at: usize) -> u64 {
        line_at(self.bytes, at.min(self.bytes.len())).0
    }

    /// An error at byte `at`.
    pub fn error(&self, at: usize, what: impl Into<String>) -> Error {
        error_at(self.file, self.bytes, at, what)
    }

    /// An error where the cursor is: something is missing here.
    pub fn missing(&self, what: impl Into<String>) -> Error {
        self.error(self.at, what)
    }

    /// The word as a finite or non-finite number.
    ///
    /// # Errors
    /// Anything else, at the word.
    pub fn number(&self, word: Word<'_>) -> Result<f64> {
        word.float().ok_or_else(|| self.error(word.at, format!("expected a number, found {}", word.shown())))
    }

    fn skip(&mut self, newlines: bool) {
        while let Some(&b) = self.bytes.get(self.at) {
            if is_blank(b) || (newlines && is_newline(b)) {
                self.at += 1;
            } else if let Some(length) = self.joint() {
                self.at += length;
            } else {
                break;
            }
        }
    }

    /// Length of the line joint (backslash, end of line) at the cursor, if there is one.
    fn joint(&self) -> Option<usize> {
        match self.rest() {
            [b'\\', b'\r', b'\n', ..] => Some(3),
            [b'\\', b'\r' | b'\n', ..] => Some(2),
            _ => None,
        }
    }

    fn take_word(&mut self) -> Option<Word<'a>> {
        let start = self.at;
        while let Some(&b) = self.bytes.get(self.at) {
            if is_blank(b) || is_newline(b) || (b == b'\\' && self.joint().is_some()) {
                break;
            }
            self.at += 1;
        }
        (self.at > start).then(|| Word { at: start, bytes: &self.bytes[start..self.at] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(bytes: &[u8], at: usize) -> String {
        let text = error_at(Path::new("f"), bytes, at, "x").to_string();
        text.lines().next().unwrap().to_owned()
    }

    #[test]
    fn line_and_column_count_every_kind_of_line_end() {
        assert_eq!(place(b"ab\ncd", 4), "f:2:2: x");
        assert_eq!(place(b"ab\r\ncd", 4), "f:2:1: x");
        assert_eq!(place(b"ab\rcd", 3), "f:2:1: x");
        assert_eq!(place("é x".as_bytes(), 3), "f:1:3: x");
        assert_eq!(place(b"", 9), "f:1:1: x");
    }

    #[test]
    fn what_is_no_number_has_many_spellings() {
        let float = |text: &str| Word { at: 0, bytes: text.as_bytes() }.float::<f64>();
        for text in ["nan", "-nan", "-nan(ind)", "nan(snan)", "1.#IND", "-1.#IND00", "1.#QNAN", "1.#QNAN0", "1.#QO"] {
            assert!(float(text).is_some_and(f64::is_nan), "{text}");
        }
        let infinite = ["1.#INF", "-1.#INF000", "1.#J"].map(float);
        assert_eq!(infinite, [Some(f64::INFINITY), Some(f64::NEG_INFINITY), Some(f64::INFINITY)]);
        for text in ["nan(", "1.#", "1.#X", "1.5#INF", "x", "-"] {
            assert_eq!(float(text), None, "{text}");
        }
    }

    #[test]
    fn long_lines_are_not_shown() {
        let line = vec![b'a'; 10_000];
        assert!(error_at(Path::new("f"), &line, 0, "x").to_string().len() < 400);
        assert_eq!(error_at(Path::new("f"), &line, 5_000, "x").to_string(), "f:1:5001: x");
        assert!(shown(&line).len() < 60);
        assert_eq!(name(&[0xff; 300]).chars().count(), 85, "85 replacement characters are 255 bytes");
        assert_eq!(name("é".repeat(300).as_bytes()), "é".repeat(127));
    }

    #[test]
    fn words_join_lines_and_stop_at_comments() {
        let mut words = Words::new(Path::new("f"), b"\xef\xbb\xbfa b\\\r\n c # d\\\ne", 0);
        let mut line = Vec::new();
        while let Some(w) = words.next_value() {
            line.push(w.bytes);
        }
        assert_eq!(line, [b"a", b"b", b"c"]);
        assert_eq!(words.next().unwrap().bytes, b"e");
        assert!(words.next().is_none());
    }
}
