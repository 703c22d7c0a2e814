//! PFM pictures (Portable FloatMap): floats as they are, one plane or three.
//!
//! Source: P. Debevec, "PFM Portable FloatMap Image Format", 2001: `PF` (colour) or `Pf` (one plane), width, height, a
//! scale whose sign gives the byte order (negative is little-endian), then rows from the bottom up. The scale's size is
//! a unit of light and is not applied, as other readers do.

use std::path::Path;

use super::input;
use super::planes::{COLOR, Film, PlaneData};
use crate::error::{Error, Result};

/// Longest word of a header.
const MAX_WORD: usize = 32;

/// Reads a PFM picture as planes `R G B`, or `Y`.
///
/// # Errors
/// [`Error::Io`], or [`Error::Input`] with a byte offset if the file is no such picture or its length does not fit.
pub fn read(path: &Path) -> Result<Film> {
    parse(path, &input::read(path)?)
}

/// [`read`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Film> {
    let mut header = Words { file, bytes, at: 0 };
    let channels = match header.word()? {
        (_, "PF") => 3,
        (_, "Pf") => 1,
        (at, _) => return Err(Error::at_byte(file, at as u64, "expected a PFM picture, which starts with PF or Pf")),
    };
    let (width, height) = (header.number::<u32>("a width")?, header.number::<u32>("a height")?);
    let scale_at = header.at;
    let scale = header.number::<f64>("a scale")?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(Error::at_byte(file, scale_at as u64, format!("expected a scale other than 0, found {scale}")));
    }
    let data = bytes.get(header.at + 1..).unwrap_or_default();
    let wanted = u64::from(width) * u64::from(height);
    if wanted.checked_mul(4 * channels as u64) != Some(data.len() as u64) {
        let what = format!("{width}x{height} pixels of {channels} floats do not match {} bytes of data", data.len());
        return Err(Error::at_byte(file, (header.at + 1) as u64, what));
    }
    let mut film = Film::full(width, height).map_err(|e| Error::whole(file, e.to_string()))?;
    let names: &[&str] = if channels == 3 { &COLOR } else { &["Y"] };
    for (channel, name) in names.iter().enumerate() {
        let float = |word: &[u8]| {
            let word = [word[0], word[1], word[2], word[3]];
            if scale < 0.0 { f32::from_le_bytes(word) } else { f32::from_be_bytes(word) }
        };
        let rows = data.chunks_exact(width as usize * channels * 4).rev();
        let plane = rows.flat_map(|row| row.chunks_exact(4).skip(channel).step_by(channels).map(float)).collect();
        film.push(*name, PlaneData::F32(plane))?;
    }
    Ok(film)
}

/// Words of the header, each ended by one white space.
struct Words<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    /// The white space after the last word.
    at: usize,
}

impl<'a> Words<'a> {
    /// The next word and where it starts.
    fn word(&mut self) -> Result<(usize, &'a str)> {
        let blank = |at: usize| self.bytes.get(at).is_some_and(u8::is_ascii_whitespace);
        let start = (self.at..self.bytes.len()).find(|&at| !blank(at)).unwrap_or(self.bytes.len());
        let end = (start..self.bytes.len().min(start + MAX_WORD)).find(|&at| blank(at));
        let word = end.and_then(|end| std::str::from_utf8(&self.bytes[start..end]).ok());
        let (Some(end), Some(word)) = (end, word) else {
            return Err(Error::at_byte(self.file, start as u64, "expected a word of a PFM header"));
        };
        self.at = end;
        Ok((start, word))
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let (at, word) = self.word()?;
        let wrong =
            || Error::at_byte(self.file, at as u64, format!("expected {what}, found `{}`", word.escape_debug()));
        word.parse().map_err(|_| wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::{XorShift, mutate};

    fn bytes(header: &str, values: &[f32], little: bool) -> Vec<u8> {
        let word = |x: &f32| if little { x.to_le_bytes() } else { x.to_be_bytes() };
        [header.as_bytes(), &values.iter().flat_map(word).collect::<Vec<u8>>()].concat()
    }

    /// Rows come bottom first: the file's first row is the picture's last.
    #[test]
    fn rows_planes_and_byte_orders() {
        let gray = parse(Path::new("g"), &bytes("Pf\n2 2\n-1.0\n", &[3.0, 4.0, 1.0, 2.0], true)).unwrap();
        assert_eq!(gray.f32_plane("Y").unwrap(), [1.0, 2.0, 3.0, 4.0]);
        let colour = parse(Path::new("c"), &bytes("PF 1 2 1\n", &[4.0, 5.0, 6.0, 1.0, 2.0, 3.0], false)).unwrap();
        assert_eq!(colour.color().unwrap(), [[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]);
    }

    #[test]
    fn faults_say_where() {
        let fault = |bytes: &[u8]| parse(Path::new("a.pfm"), bytes).unwrap_err().to_string();
        assert!(fault(b"P6 1 1 255\n").starts_with("a.pfm: byte 0: "));
        assert!(fault(b"PF x 1 -1\n").contains("byte 3: expected a width, found `x`"));
        assert!(fault(b"PF 1 1 0\n").contains("a scale other than 0"));
        assert!(fault(b"PF 4000000000 4000000000 -1\nabc").contains("do not match 3 bytes"));
        assert!(fault(b"PF 1").contains("byte 3: expected a word"));
        assert!(fault(b"Pf 0 0 -1\n").contains("empty"));
    }

    #[test]
    fn damaged_files_give_a_film_or_an_error() {
        let seed = bytes("PF\n2 2\n-1.0\n", &[0.5; 12], true);
        let (mut random, mut accepted) = (XorShift(0x1234_5678_9abc_def1), 0);
        for _ in 0..20_000 {
            if let Ok(film) = parse(Path::new("m"), &mutate(&seed, &mut random)) {
                film.validate().unwrap();
                accepted += 1;
            }
        }
        assert!((100..19_900).contains(&accepted), "{accepted}");
    }
}
