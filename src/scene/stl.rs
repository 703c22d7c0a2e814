//! STL, binary and text: loose triangles, welded to an indexed mesh.
//!
//! Source: 3D Systems, "StereoLithography Interface Specification", 1988. Equal positions (bit for bit; the two
//! zeros count as equal, the first one met is kept) become one vertex; triangles keep their order and winding.
//! Normals and attribute words are ignored. A binary file may begin with `solid`: a file whose length is what its
//! count says is binary, whatever it begins with.
//!
//! Memory stays below 16 bytes per byte of the file.

use std::path::Path;

use glam::DVec3;

use super::mesh::{Mesh, MeshGroup};
use super::text::{self, Word, Words};
use super::weld::Weld;
use crate::error::{Error, Result};

/// Bytes of the comment at the start of a binary file.
const COMMENT: usize = 80;
/// Bytes before the first triangle: comment and count.
const HEADER: usize = COMMENT + 4;
/// Bytes of one triangle: normal and three corners (f32 x 12), attribute word.
const RECORD: usize = 50;
/// Bytes of the normal.
const NORMAL: usize = 12;
/// Most triangles: three times that many vertices must be numbered by u32.
const MAX_TRIANGLES: usize = (u32::MAX / 3) as usize;

/// Reads the bytes of an STL file; `file` is only for error messages.
///
/// A solid of a text file becomes a group with its name.
///
/// # Errors
/// Binary, at byte offset: a length that does not fit the count. Text, at line and column: anything that is not the
/// word or number expected there.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Mesh> {
    let is_exact = declared(bytes).is_some_and(|count| (bytes.len() - HEADER) as u64 == RECORD as u64 * count as u64);
    if !is_exact && is_text(bytes) { parse_text(file, bytes) } else { parse_binary(file, bytes) }
}

/// The count of a binary file.
fn declared(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(COMMENT..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count) as usize)
}

/// True if the file begins with `solid` and the part where a binary file has numbers looks like text.
fn is_text(bytes: &[u8]) -> bool {
    let trimmed = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begins = trimmed.first_chunk::<5>().is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins && !bytes[..bytes.len().min(1024)].contains(&0)
}

fn parse_binary(file: &Path, bytes: &[u8]) -> Result<Mesh> {
    let Some(count) = declared(bytes) else {
        let what = format!("expected `solid` or a binary STL header of {HEADER} bytes, found {} bytes", bytes.len());
        return Err(Error::at_byte(file, 0, what));
    };
    let body = &bytes[HEADER..];
    if count > body.len() / RECORD {
        let what =
            format!("the header declares {count} triangles ({RECORD} bytes each), but {} bytes follow it", body.len());
        return Err(Error::at_byte(file, COMMENT as u64, what));
    }
    if count > MAX_TRIANGLES {
        return Err(Error::at_byte(file, COMMENT as u64, format!("more than {MAX_TRIANGLES} triangles")));
    }
    let (records, tail) = body.split_at(RECORD * count);
    if !text::is_padding(tail) {
        let what = format!("expected the end of the file after {count} triangles, found {} more bytes", tail.len());
        return Err(Error::at_byte(file, (HEADER + records.len()) as u64, what));
    }
    let mut weld = Weld::with_capacity(count / 2);
    let (records, _) = records.as_chunks::<RECORD>();
    let triangles = records.iter().map(|record| corners(record).map(|corner| weld.vertex(corner))).collect();
    Ok(Mesh { positions: weld.into_positions(), triangles, groups: Vec::new(), ..Mesh::default() })
}

/// The three corners of a record.
fn corners(record: &[u8; RECORD]) -> [DVec3; 3] {
    let (words, _) = record[NORMAL..].as_chunks::<4>();
    let number = |i: usize| f64::from(f32::from_le_bytes(words[i]));
    [0, 3, 6].map(|i| DVec3::new(number(i), number(i + 1), number(i + 2)))
}

fn parse_text(file: &Path, bytes: &[u8]) -> Result<Mesh> {
    let words = Words::new(file, bytes, 0);
    let mut reader = TextReader { words, weld: Weld::with_capacity(0), mesh: Mesh::default() };
    while let Some(word) = reader.words.next() {
        reader.check(word, "solid")?;
        reader.solid()?;
    }
    reader.mesh.positions = reader.weld.into_positions();
    Ok(reader.mesh)
}

struct TextReader<'a> {
    words: Words<'a>,
    weld: Weld,
    mesh: Mesh,
}

impl<'a> TextReader<'a> {
    /// What follows the word `solid`, up to its `endsolid`.
    fn solid(&mut self) -> Result<()> {
        let name = text::name(self.words.rest_of_line());
        let first = self.mesh.triangles.len();
        loop {
            let word = self.word("facet or endsolid")?;
            if word.bytes.eq_ignore_ascii_case(b"endsolid") {
                self.words.rest_of_line();
                break;
            }
            self.check(word, "facet")?;
            if self.mesh.triangles.len() >= MAX_TRIANGLES {
                return Err(self.words.error(word.at, format!("more than {MAX_TRIANGLES} triangles")));
            }
            let triangle = self.facet()?;
            self.mesh.triangles.push(triangle);
        }
        let count = self.mesh.triangles.len() - first;
        if count > 0 {
            let (first, count) = (first as u32, count as u32);
            self.mesh.groups.push(MeshGroup { name, material: String::new(), first, count });
        }
        Ok(())
    }

    /// What follows the word `facet`, up to its `endfacet`.
    fn facet(&mut self) -> Result<[u32; 3]> {
        self.expect("normal")?;
        // Not looked at: writers leave there what is no number.
        for _ in 0..3 {
            self.word("a number")?;
        }
        self.expect("outer")?;
        self.expect("loop")?;
        let mut triangle = [0; 3];
        for corner in &mut triangle {
            self.expect("vertex")?;
            let position = self.point()?;
            *corner = self.weld.vertex(position);
        }
        self.expect("endloop")?;
        self.expect("endfacet")?;
        Ok(triangle)
    }

    fn point(&mut self) -> Result<DVec3> {
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            let word = self.word("a number")?;
            *number = self.words.number(word)?;
        }
        Ok(numbers.into())
    }

    fn expect(&mut self, keyword: &str) -> Result<()> {
        let word = self.word(keyword)?;
        self.check(word, keyword)
    }

    /// The next word; `expected` is for the message when there is none.
    fn word(&mut self, expected: &str) -> Result<Word<'a>> {
        self.words.next().ok_or_else(|| self.words.missing(format!("expected {expected}, found the end of the file")))
    }

    /// Refuses a word that is not `keyword` in upper or lower case.
    fn check(&self, word: Word<'_>, keyword: &str) -> Result<()> {
        if word.bytes.eq_ignore_ascii_case(keyword.as_bytes()) {
            return Ok(());
        }
        Err(self.words.error(word.at, format!("expected {keyword}, found {}", word.shown())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A binary file of `triangles`, with `comment` at its start.
    fn binary(comment: &[u8], triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = comment.to_vec();
        bytes.resize(COMMENT, 0);
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([9_f32; 3].iter().flat_map(|n| n.to_le_bytes()));
            bytes.extend(triangle.iter().flatten().flat_map(|n| n.to_le_bytes()));
            bytes.extend([7, 7]);
        }
        bytes
    }

    const QUAD: [[[f32; 3]; 3]; 2] =
        [[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.1]], [[-0., 0., 0.], [1., 1., 0.1], [0., 1., 0.]]];

    fn parsed(bytes: &[u8]) -> Mesh {
        parse(Path::new("m.stl"), bytes).unwrap()
    }

    fn first_line_of_error(bytes: &[u8]) -> String {
        parse(Path::new("m.stl"), bytes).unwrap_err().to_string().lines().next().unwrap().to_owned()
    }

    #[test]
    fn binary_corners_are_welded_in_order() {
        for comment in [&b"made by hand"[..], b"solid but binary", b""] {
            let mesh = parsed(&binary(comment, &QUAD));
            let tenth = f64::from(0.1_f32);
            assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::new(1., 1., tenth), DVec3::Y]);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        }
        assert_eq!(parsed(&binary(b"", &[])), Mesh::default());
    }

    #[test]
    fn binary_length_must_fit_the_count() {
        let full = binary(b"solid x", &QUAD);
        assert_eq!(parsed(&[&full[..], b"\0\0\n"].concat()).triangles.len(), 2, "padding is no error");
        let error = first_line_of_error(&[&full[..], b"more"].concat());
        assert_eq!(error, "m.stl: byte 184: expected the end of the file after 2 triangles, found 4 more bytes");
        let mut lie = full.clone();
        lie[COMMENT..HEADER].copy_from_slice(&u32::MAX.to_le_bytes());
        let expected =
            "m.stl: byte 80: the header declares 4294967295 triangles (50 bytes each), but 100 bytes follow it";
        assert_eq!(first_line_of_error(&lie), expected);
        for length in 0..full.len() {
            assert!(parse(Path::new("m.stl"), &full[..length]).is_err(), "{length}");
        }
    }

    const TEXT: &str = "solid left  half
        facet normal 0 0 1
          outer loop
            vertex 0 0 0
            vertex 1 0 0
            vertex 1 1 0.1
          endloop
        endfacet
      endsolid left  half
      SOLID
        FACET NORMAL -nan(ind) 1.#QNAN ? OUTER LOOP VERTEX 0 -0 0 VERTEX 1 1 1e-1 VERTEX 0 inf 0 ENDLOOP ENDFACET
      ENDSOLID
      solid empty\nendsolid";

    #[test]
    fn text_solids_become_groups() {
        let mesh = parsed(TEXT.as_bytes());
        assert_eq!(mesh.positions[..3], [DVec3::ZERO, DVec3::X, DVec3::new(1., 1., 0.1)]);
        assert_eq!(mesh.positions[3].y, f64::INFINITY);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        let names: Vec<_> = mesh.groups.iter().map(|g| (g.name.as_str(), g.first, g.count)).collect();
        assert_eq!(names, [("left  half", 0, 1), ("", 1, 1)]);
        assert_eq!(parsed(TEXT.replace('\n', "\r\n").as_bytes()), mesh);
    }

    #[test]
    fn text_errors_say_where() {
        for (text, expected) in [
            ("solid\nfacet normal 0 0", "m.stl:2:17: expected a number, found the end of the file"),
            ("solid\nfacet normal 0 0 1 outer loop vertex 0 x", "m.stl:2:40: expected a number, found `x`"),
            ("solid\n face normal", "m.stl:2:2: expected facet, found `face`"),
            ("solid a", "m.stl:1:8: expected facet or endsolid, found the end of the file"),
            ("solid a\nendsolid\njunk", "m.stl:3:1: expected solid, found `junk`"),
            (
                "solid\nfacet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 0 0 vertex 0 0 0\nvertex 0 0 0",
                "m.stl:3:1: expected endloop, found `vertex`",
            ),
            ("", "m.stl: byte 0: expected `solid` or a binary STL header of 84 bytes, found 0 bytes"),
        ] {
            assert_eq!(first_line_of_error(text.as_bytes()), expected);
        }
    }
}
