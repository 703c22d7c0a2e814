//! Opening input files: only regular files, whose length is known before anything is believed.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// Opens a regular file and says its length in bytes.
///
/// # Errors
/// [`Error::Io`] if it cannot be opened; [`Error::Input`] for a directory, pipe or device, whose length says nothing.
pub(super) fn open(path: &Path) -> Result<(File, u64)> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let meta = file.metadata().map_err(|e| Error::io(path, e))?;
    if !meta.is_file() {
        return Err(Error::whole(path, "expected a regular file"));
    }
    Ok((file, meta.len()))
}

/// The bytes of a regular file, no more than its length when it was opened.
///
/// # Errors
/// As [`open`], and [`Error::Io`] while reading.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let (file, len) = open(path)?;
    let mut bytes = Vec::new();
    file.take(len).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_no_regular_file() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read(dir.path()).unwrap_err().to_string().contains("expected a regular file"));
        assert!(matches!(read(&dir.path().join("none")), Err(Error::Io { .. })));
    }
}
