//! Many pictures at once: headers first, so that their sum is known, then pixels, both on all threads.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::header::{Header, MAX_BYTES};
use super::{Curve, Format, decode};
use crate::scene::texture::Texture;

/// Most bytes of all textures of a scene together.
pub const MAX_TOTAL: u64 = 4 << 30;

/// A picture to be decoded.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Name of the texture.
    pub name: String,
    /// Where its bytes are.
    pub content: Content<'a>,
    /// What its levels mean.
    pub curve: Curve,
}

/// Where the bytes of a picture are.
#[derive(Clone, Debug)]
pub enum Content<'a> {
    /// In a file of its own.
    File(PathBuf),
    /// In a part of another.
    Bytes(Cow<'a, [u8]>),
}

/// A picture that could not be decoded: its index and what is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unreadable {
    /// Index in the list that was to be decoded.
    pub index: usize,
    /// What is wrong, what was expected.
    pub what: String,
}

/// Decodes `pictures`: the textures in their order, each with the SHA-256 of its bytes. Bytes of files are held only
/// while their picture is decoded.
///
/// # Errors
/// The first picture, in their order, that cannot be read or decoded, or that does not fit beside those before it
/// into [`MAX_TOTAL`].
pub fn decode_all(pictures: &[Picture<'_>]) -> Result<Vec<(Texture, [u8; 32])>, Unreadable> {
    let headers: Vec<_> = pictures.par_iter().map(|picture| picture.with_bytes(Header::read)).collect();
    let mut total = 0_u64;
    for (index, header) in headers.into_iter().enumerate() {
        total += header.map_err(|what| Unreadable { index, what })?.bytes;
        if total > MAX_TOTAL {
            let what = format!("the scene's pictures need more than {} MiB of memory", MAX_TOTAL >> 20);
            return Err(Unreadable { index, what });
        }
    }
    let decoded: Vec<_> = pictures
        .par_iter()
        .map(|picture| {
            picture.with_bytes(|bytes| {
                Ok((decode(&picture.name, bytes, picture.curve)?, <[u8; 32]>::from(Sha256::digest(bytes))))
            })
        })
        .collect();
    let name = |(index, one): (usize, Result<_, String>)| one.map_err(|what| Unreadable { index, what });
    decoded.into_iter().enumerate().map(name).collect()
}

/// Whether `path` is a file that begins like a picture of a format that is read.
pub fn is_known(path: &Path) -> bool {
    const HEAD: u64 = 16;
    let is_file = path.metadata().is_ok_and(|data| data.is_file());
    let mut head = Vec::new();
    let read = |head: &mut Vec<u8>| File::open(path)?.take(HEAD).read_to_end(head);
    is_file && read(&mut head).is_ok() && Format::of(&head).is_some()
}

impl Picture<'_> {
    fn with_bytes<T>(&self, read: impl FnOnce(&[u8]) -> Result<T, String>) -> Result<T, String> {
        match &self.content {
            Content::Bytes(bytes) => read(bytes),
            Content::File(path) => read(&file(path).map_err(|e| format!("cannot read it: {e}"))?),
        }
    }
}

/// The bytes of a picture's file, which is never much larger than its texels.
fn file(path: &Path) -> std::io::Result<Vec<u8>> {
    const MOST: u64 = 2 * MAX_BYTES;
    // Asked before it is opened: opening a pipe waits for its writer.
    if !path.metadata()?.is_file() {
        return Err(std::io::Error::other("not a file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MOST + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MOST {
        true => Err(std::io::Error::other(format!("more than {MOST} bytes"))),
        false => Ok(bytes),
    }
}
