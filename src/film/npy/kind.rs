//! What an array is, told by its header alone.

use std::path::Path;

use super::arrays::open;
use super::header::{Descr, Header};
use crate::error::Result;

/// Kinds of arrays that lanecast writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Records of one axis: hits.
    Hits,
    /// Bytes or truth values of one axis.
    Occlusion,
    /// Anything else: planes, rays.
    Numbers,
}

/// Tells what the array in `path` is; whether it is sound is for its reader to say.
///
/// # Errors
/// As [`super::read_plane`].
pub fn kind(path: &Path) -> Result<Kind> {
    let (mut reader, len) = open(path)?;
    let header = Header::read(path, &mut reader, len)?;
    Ok(match &header.descr {
        Descr::Record(_) => Kind::Hits,
        Descr::Plain(format) if header.shape.len() == 1 && (format == "|u1" || format == "|b1") => Kind::Occlusion,
        Descr::Plain(_) => Kind::Numbers,
    })
}
