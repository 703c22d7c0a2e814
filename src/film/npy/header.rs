//! The header of a `.npy` file: magic, version, and a Python dictionary of dtype, order and shape.

use std::io::Read;
use std::path::Path;

use super::literal::Literals;
use crate::error::{Error, Result};

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Longest dictionary that is read; NumPy's own are a few hundred bytes.
const MAX_DICT: u64 = 65_535;
/// Most fields of a record, most axes of a shape (NumPy's limit is 64 axes).
const MAX_ITEMS: usize = 64;
/// NumPy leaves room for the first axis to grow to this many digits; so do we, which lets a streaming writer put the
/// number of rows in afterwards.
const GROWTH_DIGITS: usize = 21;
/// Headers are padded so that the data starts at a multiple of this.
const ALIGN: usize = 64;

/// An array's element type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Descr {
    /// One number, e.g. `<f4`.
    Plain(String),
    /// A record of named numbers: (name, type).
    Record(Vec<(String, String)>),
}

impl std::fmt::Display for Descr {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Plain(format) => write!(f, "'{format}'"),
            Self::Record(fields) => {
                let fields: Vec<String> = fields.iter().map(|(n, t)| format!("('{n}', '{t}')")).collect();
                write!(f, "[{}]", fields.join(", "))
            }
        }
    }
}

/// A parsed header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// Element type.
    pub descr: Descr,
    /// Byte offset of the element type, for messages.
    pub descr_at: u64,
    /// Column-major order.
    pub fortran_order: bool,
    /// Byte offset of the order, for messages.
    pub order_at: u64,
    /// Length of each axis.
    pub shape: Vec<u64>,
    /// Byte offset of the shape, for messages.
    pub shape_at: u64,
    /// Byte offset of the first element.
    pub data_at: u64,
}

impl Header {
    /// Reads the header from the start of `reader`, a file of `len` bytes. `file` is only for messages.
    ///
    /// # Errors
    /// [`Error::Input`] with the byte where something else was expected; [`Error::Io`].
    pub fn read(file: &Path, reader: &mut impl Read, len: u64) -> Result<Self> {
        let mut fill = |bytes: &mut [u8], at: u64, what: &str| {
            if at + bytes.len() as u64 > len {
                return Err(Error::at_byte(file, len, format!("the file ends inside {what}")));
            }
            reader.read_exact(bytes).map_err(|e| Error::io(file, e))
        };
        let mut start = [0; 8];
        fill(&mut start, 0, "the .npy signature")?;
        if &start[..6] != MAGIC {
            return Err(Error::at_byte(file, 0, "expected a NumPy .npy file, which starts with \\x93NUMPY"));
        }
        let mut size = [0; 4];
        let size_bytes = match (start[6], start[7]) {
            (1, 0) => 2,
            (2, 0) => 4,
            (major, minor) => {
                let what = format!("expected .npy version 1.0 or 2.0, found {major}.{minor}");
                return Err(Error::at_byte(file, 6, what));
            }
        };
        fill(&mut size[..size_bytes], 8, "the header's length")?;
        let (base, dict_len) = (8 + size_bytes as u64, u64::from(u32::from_le_bytes(size)));
        if dict_len > MAX_DICT {
            let what = format!("the header claims {dict_len} bytes, expected at most {MAX_DICT}");
            return Err(Error::at_byte(file, 8, what));
        }
        let mut dict = vec![0; dict_len as usize];
        fill(&mut dict, base, "the header")?;
        parse_dict(&mut Literals::new(file, &dict, base), file, base + dict_len)
    }

    /// Number of elements of `size` bytes in an array of this shape, after checking that they fill the rest of a
    /// file of `len` bytes exactly.
    ///
    /// # Errors
    /// [`Error::Input`] at the shape.
    pub fn count(&self, file: &Path, size: u64, len: u64) -> Result<usize> {
        let has = len - self.data_at;
        let count = self.shape.iter().try_fold(1_u64, |n, &axis| n.checked_mul(axis));
        let fits = count.filter(|n| n.checked_mul(size) == Some(has)).and_then(|n| usize::try_from(n).ok());
        fits.ok_or_else(|| {
            let shape = tuple(&self.shape);
            let what = format!("shape {shape} of {size}-byte elements does not match the {has} bytes of data");
            Error::at_byte(file, self.shape_at, what)
        })
    }

    /// An [`Error::Input`] at the element type.
    pub fn wrong_descr(&self, file: &Path, expected: &str) -> Error {
        Error::at_byte(file, self.descr_at, format!("dtype is {}, expected {expected}", self.descr))
    }

    /// An [`Error::Input`] at the shape.
    pub fn wrong_shape(&self, file: &Path, expected: &str) -> Error {
        Error::at_byte(file, self.shape_at, format!("shape is {}, expected {expected}", tuple(&self.shape)))
    }

    /// Refuses column-major order.
    ///
    /// # Errors
    /// [`Error::Input`].
    pub fn require_c_order(&self, file: &Path) -> Result<()> {
        // With at most one axis, the orders are the same.
        if self.fortran_order && self.shape.len() > 1 {
            let what = "fortran_order is True, expected row-major data (numpy.ascontiguousarray makes it)";
            return Err(Error::at_byte(file, self.order_at, what));
        }
        Ok(())
    }
}

fn parse_dict(text: &mut Literals<'_>, file: &Path, data_at: u64) -> Result<Header> {
    let (mut descr, mut order, mut shape) = (None, None, None);
    let start = text.place();
    text.expect(b'{')?;
    let mut at_end = text.take(b'}');
    while !at_end {
        let key_at = text.place();
        let key = text.string()?;
        text.expect(b':')?;
        let value_at = text.place();
        let repeated = match key.as_str() {
            "descr" => descr.replace((parse_descr(text)?, value_at)).is_some(),
            "fortran_order" => order.replace((text.boolean()?, value_at)).is_some(),
            "shape" => shape.replace((parse_shape(text)?, value_at)).is_some(),
            _ => {
                let what = format!("key '{key}', expected 'descr', 'fortran_order' and 'shape'");
                return Err(Error::at_byte(file, key_at, what));
            }
        };
        if repeated {
            return Err(Error::at_byte(file, key_at, format!("key '{key}' for the second time")));
        }
        at_end = text.element_ends(b'}')?;
    }
    if text.peek().is_some() {
        return Err(text.unexpected("nothing but spaces after the dictionary"));
    }
    let missing = |key: &str| Error::at_byte(file, start, format!("the dictionary lacks '{key}'"));
    let (descr, descr_at) = descr.ok_or_else(|| missing("descr"))?;
    let (shape, shape_at) = shape.ok_or_else(|| missing("shape"))?;
    let (fortran_order, order_at) = order.ok_or_else(|| missing("fortran_order"))?;
    Ok(Header { descr, descr_at, fortran_order, order_at, shape, shape_at, data_at })
}

fn parse_descr(text: &mut Literals<'_>) -> Result<Descr> {
    if !text.take(b'[') {
        return text.string().map(Descr::Plain);
    }
    let mut fields = Vec::new();
    let mut at_end = text.take(b']');
    while !at_end {
        if fields.len() == MAX_ITEMS {
            return Err(text.unexpected("at most 64 fields"));
        }
        text.expect(b'(')?;
        let name = text.string()?;
        text.expect(b',')?;
        let format = text.string()?;
        text.take(b',');
        text.expect(b')')?;
        fields.push((name, format));
        at_end = text.element_ends(b']')?;
    }
    Ok(Descr::Record(fields))
}

fn parse_shape(text: &mut Literals<'_>) -> Result<Vec<u64>> {
    text.expect(b'(')?;
    let mut axes = Vec::new();
    let mut at_end = text.take(b')');
    while !at_end {
        if axes.len() == MAX_ITEMS {
            return Err(text.unexpected("at most 64 axes"));
        }
        axes.push(text.integer()?);
        at_end = text.element_ends(b')')?;
    }
    Ok(axes)
}

/// A Python tuple; one element keeps its comma.
fn tuple(shape: &[u64]) -> String {
    let axes: Vec<String> = shape.iter().map(u64::to_string).collect();
    let comma = if axes.len() == 1 { "," } else { "" };
    format!("({}{comma})", axes.join(", "))
}

/// The bytes of a version 1.0 header, the same as NumPy's own. Their number does not depend on the first axis.
pub(super) fn bytes(descr: &Descr, shape: &[u64]) -> Vec<u8> {
    let mut dict = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {}, }}", tuple(shape));
    let digits = shape.first().map_or(0, |axis| axis.to_string().len());
    dict.push_str(&" ".repeat(GROWTH_DIGITS.saturating_sub(digits)));
    let unpadded = MAGIC.len() + 2 + 2 + dict.len() + 1;
    dict.push_str(&" ".repeat(unpadded.next_multiple_of(ALIGN) - unpadded));
    dict.push('\n');
    let dict_len = u16::try_from(dict.len()).expect("our dictionaries have five fields at most");
    [&MAGIC[..], &[1, 0], &dict_len.to_le_bytes(), dict.as_bytes()].concat()
}
