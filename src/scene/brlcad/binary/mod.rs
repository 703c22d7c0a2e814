//! Binary databases of version 5 (`.g`): a header of eight bytes, then objects, one after another.
//!
//! An object: the byte 0x76; flags of the object, of its attributes and of its body; major and minor type; its length
//! in units of eight bytes; name, attributes and body as far as the flags say so, each after its own length; zeros;
//! the byte 0x35. Numbers are big-endian, lengths have the width that two bits of their flags give.
//!
//! Source: BRL-CAD's public header `db5.h` and its description of the format (Muuss, Butler, Tanenbaum, Anderson,
//! "BRL-CAD v5 database format", 2000). It becomes the same objects as the text of version 5.

mod combination;
mod cursor;
mod packed;
mod solids;

use std::path::Path;

use super::attributes;
use super::model::{Attributes, ColorRange, Database, Object, ObjectKind, short};
use crate::error::{Error, Place, Result};
use crate::scene::text::shown;
use cursor::Cursor;
use packed::{Budget, Section};

/// First byte of every object.
const FIRST: u8 = 0x76;
/// Last byte of every object.
const LAST: u8 = 0x35;
/// The header of a database.
const HEADER: [u8; 8] = [FIRST, 1, 0, 0, 0, 0, 1, LAST];
/// Name of the object whose attributes are the database's own.
const GLOBAL: &str = "_GLOBAL";
/// Major type of geometry.
const GEOMETRY: u8 = 1;
/// Major type of what has nothing but attributes.
const ATTRIBUTES_ONLY: u8 = 2;
/// Minor type of a combination.
const COMBINATION: u8 = 31;
/// Units by their millimetres.
const UNITS: [(f64, &str); 9] = [
    (1.0, "mm"),
    (10.0, "cm"),
    (1e3, "m"),
    (1e6, "km"),
    (1e-3, "um"),
    (25.4, "in"),
    (304.8, "ft"),
    (914.4, "yd"),
    (1_609_344.0, "mi"),
];

/// Whether `bytes` begin as a binary database of version 5 does.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.starts_with(&HEADER[..2])
}

/// The error of a binary database of version 4; `None` if `bytes` are none.
pub(super) fn of_version_4(file: &Path, bytes: &[u8]) -> Option<Error> {
    matches!(bytes, [b'I', _, b'v', b'4', ..]).then(|| {
        let error =
            Error::at_byte(file, 0, "expected a database of version 5, or text: this is a binary one of version 4");
        error.with_help("BRL-CAD's `dbupgrade` makes version 5 of it, its `g2asc` text")
    })
}

/// Reads all objects.
pub(super) fn read(file: &Path, bytes: &[u8], database: &mut Database) -> Result<()> {
    let mut all = Cursor::new(file, bytes);
    let start = all.clone();
    if all.take(HEADER.len() as u64, "the header of a BRL-CAD database")? != HEADER {
        return Err(start.error("expected the header of a BRL-CAD database, 76 01 00 00 00 00 01 35"));
    }
    let mut budget = Budget::for_file(bytes.len());
    while all.left() > 0 {
        object(file, &mut all, &mut budget, database)?;
    }
    Ok(())
}

/// Reads one object; `all` is at its first byte and is left behind its last one.
fn object(file: &Path, all: &mut Cursor<'_>, budget: &mut Budget, database: &mut Database) -> Result<()> {
    let start = all.clone();
    if all.byte("an object")? != FIRST {
        return Err(start.error("expected the first byte of an object, 76"));
    }
    let [flags, of_attributes, of_body, major, minor] =
        [all.byte("flags")?, all.byte("flags")?, all.byte("flags")?, all.byte("a type")?, all.byte("a type")?];
    let at_length = all.clone();
    let length = all.length(flags >> 6, "the length of an object")?.saturating_mul(8);
    let read = (start.left() - all.left()) as u64;
    if length <= read {
        return Err(
            at_length.error(format!("expected the length of an object, more than {read} bytes, found {length}"))
        );
    }
    let mut inside = all.part(length - read - 1, "an object")?;
    let end = all.clone();
    if all.byte("the last byte of an object")? != LAST {
        return Err(end.error("expected the last byte of an object, 35"));
    }
    match flags & 3 {
        0 => {}
        // The header of a database that was appended to another one, and free space.
        1 | 2 => return Ok(()),
        _ => {
            return Err(start.error("expected an object, a header or free space (0 to 2 in the lowest flags), found 3"));
        }
    }
    if flags & 0x20 == 0 {
        return Err(start.error("expected an object with a name"));
    }
    let length = inside.length(flags >> 3 & 3, "the length of a name")?;
    let name = inside.part(length, "a name")?.text("a name")?;
    let pairs = Section::read(file, of_attributes, "attributes", &mut inside, budget)?;
    let pairs = pairs.as_ref().map_or(Ok(Vec::new()), |section| self::pairs(section.cursor()))?;
    if major == ATTRIBUTES_ONLY {
        // Others say nothing about what is shown.
        return if name == GLOBAL { global(&start, pairs, database) } else { Ok(()) };
    }
    let body = Section::read(file, of_body, "a body", &mut inside, budget)?;
    let body = || body.as_ref().map(Section::cursor).ok_or_else(|| start.error("expected an object with a body"));
    let mut attributes = pairs;
    let kind = match (major, minor) {
        (GEOMETRY, COMBINATION) => {
            let mut combination = combination::read(body()?)?;
            attributes = set_all(&mut combination, attributes, |what| {
                database.warn(format!("`{}` (byte {}): {what}", short(&name), start.place()));
            });
            ObjectKind::Combination(Box::new(combination))
        }
        (GEOMETRY, _) => solids::solid(minor, body)?,
        (9, _) => ObjectKind::Unsupported("binunif".into()),
        _ => ObjectKind::Unsupported(format!("type {major}.{minor}")),
    };
    database.add(Object { name, place: Place::Byte(start.place() as u64), kind, attributes });
    Ok(())
}

/// Sets what attributes mean for a combination and gives back those that mean nothing; says to `warn` which were odd.
fn set_all(combination: &mut super::Combination, pairs: Attributes, mut warn: impl FnMut(String)) -> Attributes {
    let (first, mut rest): (Attributes, Attributes) = pairs.into_iter().partition(|(key, _)| key == attributes::REGION);
    let mut set = |(key, value): &(String, String)| {
        let warn = |what| warn(format!("attribute {}: {what}", shown(key.as_bytes())));
        attributes::set(combination, key, value, warn)
    };
    for pair in &first {
        set(pair);
    }
    rest.retain(|pair| !set(pair));
    rest
}

/// Names and values, each with a zero byte at its end; an empty name ends them.
fn pairs(mut list: Cursor<'_>) -> Result<Attributes> {
    let mut pairs = Vec::new();
    while list.left() > 0 {
        let key = list.text("the name of an attribute")?;
        if key.is_empty() {
            break;
        }
        pairs.push((key, list.text("the value of an attribute")?));
    }
    Ok(pairs)
}

/// Title, units and region colour table of the database.
fn global(start: &Cursor<'_>, pairs: Attributes, database: &mut Database) -> Result<()> {
    for (key, value) in pairs {
        match key.as_str() {
            "title" => database.title = value.trim().to_owned(),
            "units" => {
                let size: Option<f64> = value.trim().parse().ok();
                let known = UNITS.iter().find(|unit| size.is_some_and(|size| (size / unit.0 - 1.0).abs() < 1e-9));
                database.units = known.map_or_else(|| format!("{} mm", value.trim()), |unit| unit.1.to_owned());
            }
            "regionid_colortable" => {
                let lists = value.split(['{', '}']).filter(|list| !list.trim().is_empty());
                database.colors = lists.map(|list| color(start, list)).collect::<Result<_>>()?;
            }
            _ => database.attributes.push((key, value)),
        }
    }
    Ok(())
}

/// `LOW HIGH R G B`.
fn color(start: &Cursor<'_>, list: &str) -> Result<ColorRange> {
    let wrong =
        || start.error(format!("expected LOW HIGH R G B in the region colour table, found {}", shown(list.as_bytes())));
    let mut words = list.split_whitespace();
    let mut word = || words.next().ok_or_else(wrong);
    let region = |word: &str| word.parse::<i32>().map_err(|_| wrong());
    let channel = |word: &str| word.parse::<u8>().map_err(|_| wrong());
    let (low, high) = (region(word()?)?, region(word()?)?);
    Ok(ColorRange { low, high, rgb: [channel(word()?)?, channel(word()?)?, channel(word()?)?] })
}
