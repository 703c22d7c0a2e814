//! Tokens of a KDL document: white space, comments, strings, numbers, keywords.

use std::borrow::Cow;

use super::hints;
use super::number::{number_from, starts_with_digit};
use super::source::{Source, Span, quote};
use super::syntax::Value;
use crate::error::{Error, Result};

/// A position in the text.
pub struct Cursor<'a> {
    source: Source<'a>,
    /// Byte offset of the next character.
    pub at: usize,
}

impl<'a> Cursor<'a> {
    /// At the start of `source`.
    pub fn new(source: Source<'a>) -> Self {
        Self { source, at: 0 }
    }

    /// What is left.
    pub fn rest(&self) -> &'a str {
        &self.source.text[self.at..]
    }

    /// The next character.
    pub fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// The error that `what` is wrong from `start` to here.
    pub fn error_from(&self, start: usize, what: impl Into<String>) -> Error {
        self.source.error(Span::new(start, self.at.max(start)), what)
    }

    /// Steps over `token` if it comes next.
    pub fn eat(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        self.at += if found { token.len() } else { 0 };
        found
    }

    /// Steps over one line break if it comes next.
    pub fn eat_newline(&mut self) -> bool {
        if self.eat("\r\n") {
            return true;
        }
        match self.peek() {
            Some(c) if is_newline(c) => {
                self.at += c.len_utf8();
                true
            }
            _ => false,
        }
    }

    /// Skips space, block comments and continued lines; says whether there was any.
    ///
    /// # Errors
    /// A comment without an end, or a backslash that does not end its line.
    pub fn skip_node_space(&mut self) -> Result<bool> {
        let start = self.at;
        loop {
            let rest = self.rest();
            if rest.starts_with("/*") {
                self.skip_block_comment()?;
            } else if rest.starts_with('\\') {
                self.skip_continuation()?;
            } else {
                let spaces = rest.len() - rest.trim_start_matches(is_space).len();
                if spaces == 0 {
                    return Ok(self.at > start);
                }
                self.at += spaces;
            }
        }
    }

    /// Skips [`Cursor::skip_node_space`]'s matter, line breaks and line comments.
    ///
    /// # Errors
    /// As there.
    pub fn skip_line_space(&mut self) -> Result<()> {
        loop {
            if !self.skip_node_space()? && !self.eat_newline() && !self.skip_line_comment() {
                return Ok(());
            }
        }
    }

    /// Skips a `//` comment up to (not including) its line break.
    pub fn skip_line_comment(&mut self) -> bool {
        let rest = self.rest();
        let comment = rest.starts_with("//");
        if comment {
            self.at += rest.find(is_newline).unwrap_or(rest.len());
        }
        comment
    }

    fn skip_block_comment(&mut self) -> Result<()> {
        let start = self.at;
        let mut depth = 0_u32;
        loop {
            if self.eat("/*") {
                depth += 1;
            } else if self.eat("*/") {
                depth -= 1;
                if depth == 0 {
                    return Ok(());
                }
            } else {
                // To the next character that can begin either mark.
                let step = self.rest().char_indices().skip(1).find(|&(_, c)| c == '/' || c == '*');
                let Some((step, _)) = step else {
                    return Err(self.error_from(start, "this comment has no end: expected `*/`"));
                };
                self.at += step;
            }
        }
    }

    fn skip_continuation(&mut self) -> Result<()> {
        let start = self.at;
        self.at += 1;
        loop {
            let rest = self.rest();
            if rest.starts_with("/*") {
                self.skip_block_comment()?;
            } else if rest.starts_with(is_space) {
                self.at += rest.len() - rest.trim_start_matches(is_space).len();
            } else {
                break;
            }
        }
        if self.skip_line_comment() && self.rest().is_empty() {
            return Ok(());
        }
        if self.eat_newline() || self.rest().is_empty() {
            return Ok(());
        }
        Err(self.error_from(start, "expected the end of the line after `\\`"))
    }

    /// Reads a value: text, number or keyword. `wanted` completes "expected ...".
    ///
    /// # Errors
    /// Anything else.
    pub fn value(&mut self, wanted: &str) -> Result<Value<'a>> {
        let rest = self.rest();
        let digit_at = |i: usize| rest.as_bytes().get(i).is_some_and(u8::is_ascii_digit);
        match self.peek() {
            Some('"') => self.quoted().map(Value::Text),
            Some('#') if rest.trim_start_matches('#').starts_with('"') => self.raw().map(Value::Text),
            Some('#') => self.keyword(),
            Some('+' | '-') if digit_at(1) => self.number(),
            Some(c) if c.is_ascii_digit() => self.number(),
            Some(c) if is_name_char(c) => self.bare().map(Value::Text),
            _ => Err(self.unexpected(wanted)),
        }
    }

    /// Reads a name: bare or quoted text. `wanted` completes "expected ...".
    ///
    /// # Errors
    /// Anything else.
    pub fn name(&mut self, wanted: &str) -> Result<Cow<'a, str>> {
        let start = self.at;
        match self.value(wanted)? {
            Value::Text(name) => Ok(name),
            _ => {
                let found = quote(&self.source.text[start..self.at]);
                Err(self.error_from(start, format!("expected {wanted}, found {found}")))
            }
        }
    }

    /// The error that `wanted` should be here.
    pub fn unexpected(&self, wanted: &str) -> Error {
        let found = match self.peek() {
            None => "the end of the file".into(),
            Some(c) if is_newline(c) => "the end of the line".into(),
            Some(c) => quote(&c.to_string()),
        };
        let error = self.error_from(self.at, format!("expected {wanted}, found {found}"));
        let (before, rest) = self.source.text.split_at(self.at);
        match rest.strip_prefix('(') {
            Some(inner) => match hints::list(before, inner).filter(|_| hints::is_list(inner)) {
                Some(help) => error.with_help(help),
                None => error.with_help("expressions stand in quotes: \"(a + b) * 2\""),
            },
            None => error,
        }
    }

    /// The longest run of name characters from here.
    fn word(&mut self) -> &'a str {
        let rest = self.rest();
        let word = &rest[..rest.find(|c| !is_name_char(c)).unwrap_or(rest.len())];
        self.at += word.len();
        word
    }

    fn bare(&mut self) -> Result<Cow<'a, str>> {
        let start = self.at;
        let word = self.word();
        if matches!(word, "true" | "false" | "null" | "inf" | "-inf" | "nan") {
            return Err(self.error_from(start, format!("{} is a KDL keyword: write `#{word}`", quote(word))));
        }
        let digits = word.trim_start_matches(['+', '-']);
        if digits.len() + 1 >= word.len() && digits.strip_prefix('.').is_some_and(starts_with_digit) {
            let sign = &word[..word.len() - digits.len()];
            return Err(self.error_from(start, format!("expected a digit before the point: `{sign}0{}`", cut(digits))));
        }
        Ok(word.into())
    }

    fn keyword(&mut self) -> Result<Value<'a>> {
        let start = self.at;
        self.at += 1;
        match self.word() {
            "true" => Ok(Value::Bool(true)),
            "false" => Ok(Value::Bool(false)),
            "null" => Ok(Value::Null),
            word @ ("inf" | "-inf" | "nan") => {
                Err(self.error_from(start, format!("expected a finite number, found `#{word}`")))
            }
            word => {
                let found = quote(&format!("#{word}"));
                let error = self.error_from(start, format!("expected `#true` or `#false`, found {found}"));
                Err(error.with_help(hints::COMMENT))
            }
        }
    }

    fn number(&mut self) -> Result<Value<'a>> {
        let start = self.at;
        let word = self.word();
        let parsed = number_from(word);
        match parsed {
            Some(value) if value.is_finite() => Ok(Value::Number(value)),
            Some(_) => Err(self.error_from(start, format!("{} is too large for a number", quote(word)))),
            None => {
                let (before, rest) = self.source.text.split_at(start);
                let help = hints::list(before, rest).filter(|_| word.contains(','));
                let help =
                    help.unwrap_or_else(|| "expressions and names that start with a digit stand in quotes".into());
                Err(self.error_from(start, format!("expected a number, found {}", quote(word))).with_help(help))
            }
        }
    }

    fn quoted(&mut self) -> Result<Cow<'a, str>> {
        let start = self.at;
        self.refuse_multi_line()?;
        self.at += 1;
        let mut text: Cow<'a, str> = Cow::Borrowed("");
        loop {
            let rest = self.rest();
            let stop = rest.find(|c| c == '"' || c == '\\' || is_newline(c)).unwrap_or(rest.len());
            match &mut text {
                Cow::Borrowed("") => text = Cow::Borrowed(&rest[..stop]),
                _ => text.to_mut().push_str(&rest[..stop]),
            }
            self.at += stop;
            match self.peek() {
                Some('"') => {
                    self.at += 1;
                    return Ok(text);
                }
                Some('\\') => {
                    if let Some(c) = self.escape()? {
                        text.to_mut().push(c);
                    }
                }
                _ => return Err(self.error_from(start, "this text has no closing `\"` on its line")),
            }
        }
    }

    /// Reads an escape; `None` for the one that swallows white space.
    fn escape(&mut self) -> Result<Option<char>> {
        let start = self.at;
        self.at += 1;
        let swallowed = self.rest().trim_start_matches(|c| is_space(c) || is_newline(c));
        if swallowed.len() < self.rest().len() {
            self.at += self.rest().len() - swallowed.len();
            return Ok(None);
        }
        let c = self.peek();
        self.at += c.map_or(0, char::len_utf8);
        let plain = match c {
            Some('n') => '\n',
            Some('t') => '\t',
            Some('r') => '\r',
            Some('s') => ' ',
            Some('b') => '\u{8}',
            Some('f') => '\u{c}',
            Some(c @ ('"' | '\\')) => c,
            Some('u') => return self.unicode_escape(start).map(Some),
            _ => {
                return Err(
                    self.error_from(start, "unknown escape: expected \\n \\t \\r \\s \\b \\f \\\" \\\\ or \\u{..}")
                );
            }
        };
        Ok(Some(plain))
    }

    fn unicode_escape(&mut self, start: usize) -> Result<char> {
        let digits = self.rest().strip_prefix('{').and_then(|r| r.get(..7.min(r.len())).or(r.get(..0)));
        let hex = digits.and_then(|d| d.split_once('}')).map(|(hex, _)| hex);
        let code =
            hex.filter(|h| h.bytes().all(|b| b.is_ascii_hexdigit())).and_then(|h| u32::from_str_radix(h, 16).ok());
        match (code.and_then(char::from_u32), hex) {
            (Some(c), Some(hex)) => {
                self.at += hex.len() + 2;
                Ok(c)
            }
            _ => Err(self.error_from(start, "expected a character code such as \\u{e9}")),
        }
    }

    fn raw(&mut self) -> Result<Cow<'a, str>> {
        let start = self.at;
        let hashes = self.rest().len() - self.rest().trim_start_matches('#').len();
        self.at += hashes;
        self.refuse_multi_line()?;
        self.at += 1;
        let closing = format!("\"{}", "#".repeat(hashes));
        let line = self.rest();
        let line = &line[..line.find(is_newline).unwrap_or(line.len())];
        let Some(end) = line.find(&closing) else {
            return Err(self.error_from(start, format!("this text has no closing {} on its line", quote(&closing))));
        };
        self.at += end + closing.len();
        Ok(line[..end].into())
    }

    fn refuse_multi_line(&self) -> Result<()> {
        match self.rest().starts_with("\"\"\"") {
            true => Err(self.error_from(self.at, "texts over several lines are not used in scene files")),
            false => Ok(()),
        }
    }
}

/// At most 40 characters of `word`.
fn cut(word: &str) -> String {
    word.chars().take(40).collect()
}

/// Characters of bare names.
pub fn is_name_char(c: char) -> bool {
    !(is_space(c) || is_newline(c) || "\\/(){};[]\"#=".contains(c))
}

/// KDL's `unicode-space`.
pub fn is_space(c: char) -> bool {
    matches!(c, '\t' | ' ' | '\u{a0}' | '\u{1680}' | '\u{2000}'..='\u{200a}' | '\u{202f}' | '\u{205f}' | '\u{3000}')
}

/// KDL's line breaks; CR LF counts as one.
pub fn is_newline(c: char) -> bool {
    matches!(c, '\n' | '\r' | '\u{85}' | '\u{b}' | '\u{c}' | '\u{2028}' | '\u{2029}')
}
