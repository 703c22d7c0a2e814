//! The one error type of the crate.
//!
//! Every error that a user can cause says *where* (file, line and column, or byte offset) and *what was
//! expected*; every variant maps to an exit code of the command line (see [`Error::exit_code`]).

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

/// Result with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Where in an input file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Text: 1-based line and 1-based column (in characters).
    LineColumn {
        /// 1-based line.
        line: u64,
        /// 1-based column, in characters.
        column: u64,
    },
    /// Binary: byte offset from the start of the (decompressed) file.
    Byte(u64),
    /// The file as a whole (empty, too large, unknown format).
    Whole,
}

/// An input file that cannot be used, with the place and what was expected there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// The file as the user named it (or `builtin:NAME`).
    pub file: PathBuf,
    /// Where.
    pub place: Place,
    /// What is wrong and what was expected, one sentence, no full stop.
    pub what: String,
    /// The offending source line, if there is one worth showing (already cut to a sane length).
    pub line_text: Option<String>,
    /// A suggestion ("did you mean `sphere`?").
    pub help: Option<String>,
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::LineColumn { line, column } => {
                write!(f, "{}:{line}:{column}: {}", self.file.display(), self.what)?;
            }
            Place::Byte(at) => {
                write!(f, "{}: byte {at}: {}", self.file.display(), self.what)?;
            }
            Place::Whole => write!(f, "{}: {}", self.file.display(), self.what)?,
        }
        if let (Some(text), Place::LineColumn { line, column }) = (&self.line_text, self.place) {
            let number = line.to_string();
            let pad = " ".repeat(number.len());
            let indent = " ".repeat(column.saturating_sub(1) as usize);
            write!(f, "\n {number} | {text}\n {pad} | {indent}^")?;
        }
        if let Some(help) = &self.help {
            write!(f, "\n help: {help}")?;
        }
        Ok(())
    }
}

/// Everything that can go wrong in the library and the command line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing a file failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file's content cannot be used.
    #[error("{0}")]
    Input(Box<InputError>),
    /// The command line asks for something that does not exist or does not fit together.
    #[error("{0}")]
    Usage(String),
    /// A comparison or verification found a difference.
    #[error("{0}")]
    Mismatch(String),
    /// Ctrl-C: what was finished has been written.
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_path_buf(), source }
    }

    /// An [`Error::Input`] about the file as a whole.
    pub fn whole(file: impl AsRef<Path>, what: impl Into<String>) -> Self {
        Self::input(file, Place::Whole, what)
    }

    /// An [`Error::Input`] at a byte offset.
    pub fn at_byte(file: impl AsRef<Path>, byte: u64, what: impl Into<String>) -> Self {
        Self::input(file, Place::Byte(byte), what)
    }

    /// An [`Error::Input`] at a 1-based line and column.
    pub fn at_line(file: impl AsRef<Path>, line: u64, column: u64, what: impl Into<String>) -> Self {
        Self::input(file, Place::LineColumn { line, column }, what)
    }

    /// An [`Error::Input`] at any place.
    pub fn input(file: impl AsRef<Path>, place: Place, what: impl Into<String>) -> Self {
        Self::Input(Box::new(InputError {
            file: file.as_ref().to_path_buf(),
            place,
            what: what.into(),
            line_text: None,
            help: None,
        }))
    }

    /// The same error showing the source line (cut to 160 characters, control characters replaced).
    #[must_use]
    pub fn with_line_text(mut self, text: &str) -> Self {
        if let Self::Input(inner) = &mut self {
            let clean: String = text.chars().take(160).map(|c| if c.is_control() { ' ' } else { c }).collect();
            inner.line_text = Some(clean);
        }
        self
    }

    /// The same error with a suggestion.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        if let Self::Input(inner) = &mut self {
            inner.help = Some(help.into());
        }
        self
    }

    /// Exit code of the command line: 1 when a comparison fails, 2 for bad usage or input, 130 on Ctrl-C.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Mismatch(_) => 1,
            Self::Interrupted => 130,
            Self::Io { .. } | Self::Input(_) | Self::Usage(_) => 2,
        }
    }
}

/// The candidate nearest to `word` by edit distance, if it is near enough to be a misspelling.
///
/// Distance is Levenshtein's, where two neighbours that are swapped are one change, as in R. Lowrance, R. A. Wagner, "An Extension of the
/// String-to-String Correction Problem", 1975 (no letter is changed twice); a candidate counts when it needs at most a third of the
/// word's letters changed, or one change.
pub fn nearest_name<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (word.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .map(|c| (edit_distance(word, c), c))
        .filter(|(d, _)| *d <= limit)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Locks `mutex`, also after another thread has panicked while it held it: that panic is told by its own thread, and what the
/// lock guards is whole between two changes.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The one of `all` that is called `name`; `what` says what they are.
///
/// # Errors
/// A usage error that lists the names and the nearest one.
pub fn by_name<T: Copy>(what: &str, all: &[T], name_of: impl Fn(T) -> &'static str, name: &str) -> Result<T> {
    all.iter().copied().find(|&one| name_of(one) == name).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|&one| name_of(one)).collect();
        let hint = nearest_name(name, names.iter().copied());
        let hint = hint.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        Error::Usage(format!("unknown {what} `{name}`, expected one of {}{hint}", names.join(", ")))
    })
}

fn edit_distance(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|word| word.chars().collect::<Vec<char>>());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    // The row before the last one: swapped letters reach back two.
    let (mut last, mut before) = (row.clone(), row.clone());
    for i in 0..a.len() {
        (before, last, row) = (last, row, before);
        row[0] = i + 1;
        for j in 0..b.len() {
            let substitute = last[j] + usize::from(a[i] != b[j]);
            row[j + 1] = substitute.min(row[j] + 1).min(last[j + 1] + 1);
            if i > 0 && j > 0 && (a[i], a[i - 1]) == (b[j - 1], b[j]) {
                row[j + 1] = row[j + 1].min(before[j - 1] + 1);
            }
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_where_and_shows_the_line() {
        let e = Error::at_line("a.kdl", 3, 5, "expected a number").with_line_text("    x y").with_help("write `x 1`");
        assert_eq!(e.to_string(), "a.kdl:3:5: expected a number\n 3 |     x y\n   |     ^\n help: write `x 1`");
        assert_eq!(e.exit_code(), 2);
        assert_eq!(Error::at_byte("m.ply", 96, "x").to_string(), "m.ply: byte 96: x");
    }

    #[test]
    fn nearest_name_finds_misspellings_only() {
        assert_eq!(nearest_name("spere", ["sphere", "box"]), Some("sphere"));
        assert_eq!(nearest_name("torus", ["sphere", "box"]), None);
        // Swapped letters are one slip.
        assert_eq!(nearest_name("bxo", ["sphere", "box"]), Some("box"));
        assert_eq!(nearest_name("mian", ["low", "main"]), Some("main"));
        for (a, b, distance) in [
            ("", "", 0),
            ("", "abc", 3),
            ("abc", "", 3),
            ("ab", "ba", 1),
            ("abcd", "badc", 2),
            ("ca", "abc", 3),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!((edit_distance(a, b), edit_distance(b, a)), (distance, distance), "{a} {b}");
        }
    }
}
