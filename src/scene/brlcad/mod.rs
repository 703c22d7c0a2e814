//! BRL-CAD databases: text of version 4 (`I ...` records) and version 5 (Tcl commands), and the binary form of version 5.
//!
//! Reading gives a [`Database`]: objects with their raw parameters, nothing placed. [`regions`] then walks down from
//! the chosen top objects: matrices multiply, colours and shaders are inherited, and each region becomes one boolean
//! expression over placed solids.
//!
//! Nothing recurses over what a file says: trees of any depth are read and walked with stacks on the heap. Memory stays
//! below 256 bytes per byte of the file while reading; a walk ends with an error at [`regions::MAX_LEAVES`].

mod attributes;
mod binary;
mod boolean;
mod bot;
mod boxes;
mod colors;
pub mod describe;
mod lines;
mod lower;
mod matrix;
mod model;
mod new_solids;
mod old_solids;
mod opening;
mod pipe;
mod records;
pub mod regions;
mod script;
pub mod shader;
mod solid;
mod tcl;
mod tops;
pub mod view;

use std::path::Path;

pub use boolean::{Expression, Step};
pub use model::{Attributes, ColorRange, Combination, Counts, Database, Member, Object, ObjectKind, Region};
pub use solid::{ARB_FACES, PipePoint, Solid};
pub use tops::{choose_tops, tops};

use crate::error::Result;
use lines::Lines;
use tcl::Words;

/// Reads the bytes of a database; `file` is only for error messages.
///
/// # Errors
/// At line and column, or at a byte of binary ones: what is no record or command, numbers that are missing or not finite, trees and lists that do
/// not close, matrices that are no affine map.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Database> {
    let mut database = Database::default();
    if binary::is_binary(bytes) {
        binary::read(file, bytes, &mut database)?;
        return Ok(database);
    }
    if let Some(error) = binary::of_version_4(file, bytes) {
        return Err(error);
    }
    let mut lines = Lines::new(file, bytes);
    // Comments may come first.
    let mut first = lines.clone();
    let mut begin = lines.next();
    while begin.is_some_and(|line| line.bytes.trim_ascii().is_empty() || line.bytes.trim_ascii().starts_with(b"#")) {
        first = lines.clone();
        begin = lines.next();
    }
    match begin.map(|line| line.bytes.trim_ascii_start()) {
        Some([b'I', b' ' | b'\t', ..]) => records::read(first, &mut database)?,
        Some(text) if [&b"title"[..], b"put", b"attr", b"units", b"color"].iter().any(|c| text.starts_with(c)) => {
            script::read(Words::new(file, bytes), &mut database)?;
        }
        _ => return Err(records::not_a_database(&lines, begin.map_or(0, |line| line.at))),
    }
    Ok(database)
}
