//! The text header of a PLY file: format, elements and their properties.

use std::path::Path;

use crate::error::{Error, Result, nearest_name};
use crate::scene::text::{self, Word, Words, error_at};

/// How the rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// Both names of every type.
const TYPES: [(&str, Scalar); 16] = [
    ("char", Scalar::I8),
    ("int8", Scalar::I8),
    ("uchar", Scalar::U8),
    ("uint8", Scalar::U8),
    ("short", Scalar::I16),
    ("int16", Scalar::I16),
    ("ushort", Scalar::U16),
    ("uint16", Scalar::U16),
    ("int", Scalar::I32),
    ("int32", Scalar::I32),
    ("uint", Scalar::U32),
    ("uint32", Scalar::U32),
    ("float", Scalar::F32),
    ("float32", Scalar::F32),
    ("double", Scalar::F64),
    ("float64", Scalar::F64),
];

/// What a property holds in each row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    /// A length and that many items.
    List {
        count: Scalar,
        item: Scalar,
    },
}

#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

impl Property {
    /// The one value that every row has.
    pub fn first_scalar(&self) -> Scalar {
        match self.kind {
            Kind::Scalar(scalar) | Kind::List { count: scalar, .. } => scalar,
        }
    }
}

#[derive(Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    /// Byte position of the count, for errors about it.
    pub count_at: usize,
    pub properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Byte position of the first row.
    pub body: usize,
}

/// Reads the header at the start of `bytes`.
///
/// # Errors
/// At line and column: anything that is not a statement of the format.
pub(super) fn read(file: &Path, bytes: &[u8]) -> Result<Header> {
    if !bytes.starts_with(b"ply") || !bytes.get(3).is_some_and(|b| b.is_ascii_whitespace()) {
        return Err(error_at(file, bytes, 0, "expected a PLY header, which begins with the line `ply`"));
    }
    // A lone `\r` ends lines only if it ends the first one: in binary data it may be the first byte of the rows.
    let first_end = bytes.iter().position(|&b| text::is_newline(b)).unwrap_or(bytes.len());
    let is_lone_return = bytes.get(first_end) == Some(&b'\r') && bytes.get(first_end + 1) != Some(&b'\n');
    let terminator = if is_lone_return { b'\r' } else { b'\n' };

    let mut format = None;
    let mut elements = Vec::new();
    let mut at = first_end.saturating_add(1);
    while at < bytes.len() {
        let end = bytes[at..].iter().position(|&b| b == terminator).map_or(bytes.len(), |length| at + length);
        let mut line = Words::new(file, &bytes[..end], at);
        at = end + 1;
        let Some(keyword) = line.next() else { continue };
        match keyword.bytes {
            b"comment" | b"obj_info" => continue,
            b"format" => format = Some(read_format(&mut line)?),
            b"element" => {
                let element = read_element(&mut line)?;
                if is_read(&element.name) && elements.iter().any(|e: &Element| e.name == element.name) {
                    return Err(line.error(keyword.at, format!("a second element `{}`", element.name)));
                }
                elements.push(element);
            }
            b"property" => match elements.last_mut() {
                Some(element) => element.properties.push(read_property(&mut line)?),
                None => return Err(line.error(keyword.at, "expected an `element` before its properties")),
            },
            b"end_header" => {
                let format = format.ok_or_else(|| line.error(keyword.at, "expected a `format` before `end_header`"))?;
                return Ok(Header { format, elements, body: at.min(bytes.len()) });
            }
            _ => {
                let what = format!("expected a header statement or `end_header`, found {}", keyword.shown());
                return Err(line.error(keyword.at, what));
            }
        }
        if let Some(word) = line.next() {
            return Err(line.error(word.at, format!("expected the end of the line, found {}", word.shown())));
        }
    }
    Err(error_at(file, bytes, bytes.len(), "expected `end_header`, found the end of the file"))
}

/// Elements that are read, so that two of them would be ambiguous.
fn is_read(name: &str) -> bool {
    matches!(name, "vertex" | "face" | "tristrips")
}

fn word<'a>(line: &mut Words<'a>, expected: &str) -> Result<Word<'a>> {
    line.next().ok_or_else(|| line.missing(format!("expected {expected}")))
}

fn read_format(line: &mut Words<'_>) -> Result<Format> {
    let name = word(line, "a format")?;
    let format = match name.bytes {
        b"ascii" => Format::Text,
        b"binary_little_endian" => Format::LittleEndian,
        b"binary_big_endian" => Format::BigEndian,
        _ => {
            let what = format!("expected ascii, binary_little_endian or binary_big_endian, found {}", name.shown());
            return Err(line.error(name.at, what));
        }
    };
    let version = word(line, "the version 1.0")?;
    if version.bytes != b"1.0" {
        return Err(line.error(version.at, format!("expected the version 1.0, found {}", version.shown())));
    }
    Ok(format)
}

fn read_element(line: &mut Words<'_>) -> Result<Element> {
    let name = word(line, "the element's name")?;
    let count = word(line, "the number of rows")?;
    let Some(rows) = text::int(count.bytes).and_then(|n| u64::try_from(n).ok()) else {
        return Err(line.error(count.at, format!("expected the number of rows, found {}", count.shown())));
    };
    Ok(Element { name: text::name(name.bytes), count: rows, count_at: count.at, properties: Vec::new() })
}

fn read_property(line: &mut Words<'_>) -> Result<Property> {
    let first = word(line, "a type or `list`")?;
    let kind = if first.bytes == b"list" {
        let count = word(line, "the type of the list's length")?;
        let item = word(line, "the type of the list's items")?;
        Kind::List { count: scalar(line, count)?, item: scalar(line, item)? }
    } else {
        Kind::Scalar(scalar(line, first)?)
    };
    let name = word(line, "the property's name")?;
    Ok(Property { name: text::name(name.bytes), kind })
}

fn scalar(line: &Words<'_>, word: Word<'_>) -> Result<Scalar> {
    let found = TYPES.iter().find(|(name, _)| name.as_bytes() == word.bytes);
    found.map(|(_, scalar)| *scalar).ok_or_else(|| unknown_type(line, word))
}

fn unknown_type(line: &Words<'_>, word: Word<'_>) -> Error {
    let what = format!("expected a number type such as float or uchar, found {}", word.shown());
    let error = line.error(word.at, what);
    // Only words that could be a misspelling are compared: the distance takes the product of both lengths.
    match nearest_name(&text::name(word.bytes), TYPES.map(|(name, _)| name)) {
        Some(near) => error.with_help(format!("did you mean `{near}`?")),
        None => error,
    }
}
