//! Buffers: the binary chunk, `data:` URIs and files beside the document. Each is read when it is first needed, each
//! file once however many buffers name it.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use sha2::{Digest, Sha256};

use super::json::Buffer;
use crate::scene::reference::References;
use crate::scene::{text, unpack};

/// The bytes behind a document's buffers.
#[derive(Debug)]
pub struct Buffers<'a> {
    list: &'a [Buffer],
    bin: Option<&'a [u8]>,
    references: References<'a>,
    loaded: Vec<OnceCell<Content<'a>>>,
    files: RefCell<BTreeMap<PathBuf, Rc<Vec<u8>>>>,
    /// Bytes of the files read so far.
    external: Cell<u64>,
}

#[derive(Debug)]
enum Content<'a> {
    Chunk(&'a [u8]),
    Inline(Vec<u8>),
    File(Rc<Vec<u8>>),
}

/// What a URI leads to.
#[derive(Debug)]
pub enum Target {
    /// Bytes inside the URI.
    Inline(Vec<u8>),
    /// A file.
    File(PathBuf),
}

impl<'a> Buffers<'a> {
    /// The buffers of `list`, nothing read yet; `bin` is the binary chunk.
    pub fn new(list: &'a [Buffer], bin: Option<&'a [u8]>, references: References<'a>) -> Self {
        let loaded = list.iter().map(|_| OnceCell::new()).collect();
        Self { list, bin, references, loaded, files: RefCell::default(), external: Cell::new(0) }
    }

    /// The `byteLength` bytes of buffer `index`, which must exist.
    ///
    /// # Errors
    /// What is wrong with the buffer: a URI that is refused or malformed, a file that cannot be read, too few bytes.
    pub fn bytes(&self, index: usize) -> Result<&[u8], String> {
        let cell = &self.loaded[index];
        let content = match cell.get() {
            Some(content) => content,
            None => {
                let content = self.load(index)?;
                cell.get_or_init(|| content)
            }
        };
        let bytes = match content {
            Content::Chunk(bytes) => bytes,
            Content::Inline(bytes) => bytes.as_slice(),
            Content::File(bytes) => bytes.as_slice(),
        };
        let length = self.list[index].byte_length;
        let used = usize::try_from(length).ok().and_then(|length| bytes.get(..length));
        used.ok_or_else(|| format!("byteLength says {length} bytes, but there are {}", bytes.len()))
    }

    /// Bytes of the files read so far.
    pub fn external_bytes(&self) -> u64 {
        self.external.get()
    }

    /// SHA-256 of each file read so far, in the order of their resolved names.
    pub fn digests(&self) -> Vec<[u8; 32]> {
        self.files.borrow().values().map(|bytes| Sha256::digest(bytes.as_slice()).into()).collect()
    }

    /// What `uri` leads to: the content of a `data:` URI, or a file of the scene's folder.
    ///
    /// # Errors
    /// A URI that is refused or malformed, a file that does not exist.
    pub fn target(&self, uri: &str) -> Result<Target, String> {
        if let Some(data) = strip_scheme(uri, "data:") {
            return inline(data).map(Target::Inline);
        }
        if has_scheme(uri) {
            return Err(format!("expected a relative path or a data: URI, found {}", text::shown(uri.as_bytes())));
        }
        Ok(Target::File(self.references.resolve(&percent_decoded(uri)?)?))
    }

    fn load(&self, index: usize) -> Result<Content<'a>, String> {
        let Some(uri) = self.list[index].uri.as_deref() else {
            let first = if index == 0 { self.bin } else { None };
            return first.map(Content::Chunk).ok_or_else(|| "expected a `uri`, or a binary chunk that holds it".into());
        };
        let path = match self.target(uri)? {
            Target::Inline(bytes) => return Ok(Content::Inline(bytes)),
            Target::File(path) => path,
        };
        if let Some(known) = self.files.borrow().get(&path) {
            return Ok(Content::File(known.clone()));
        }
        let bytes = Rc::new(read(&path).map_err(|e| format!("cannot read {}: {e}", text::shown(uri.as_bytes())))?);
        self.external.set(self.external.get() + bytes.len() as u64);
        self.files.borrow_mut().insert(path, bytes.clone());
        Ok(Content::File(bytes))
    }
}

/// Reads a file as it is: unlike scenes and meshes, a buffer may begin with any bytes, so none of them say that it is
/// compressed.
fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let most = unpack::DEFAULT_LIMIT.cap;
    // Asked before it is opened: opening a pipe waits for its writer.
    if !path.metadata()?.is_file() {
        return Err(std::io::Error::other("not a file"));
    }
    let file = File::open(path)?;
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(std::io::Error::other(format!("more than {most} bytes")));
    }
    Ok(bytes)
}

fn strip_scheme<'u>(uri: &'u str, scheme: &str) -> Option<&'u str> {
    let (head, rest) = uri.split_at_checked(scheme.len())?;
    head.eq_ignore_ascii_case(scheme).then_some(rest)
}

/// Whether the URI begins with a scheme (RFC 3986, section 3.1).
fn has_scheme(uri: &str) -> bool {
    let word = |c: u8| c.is_ascii_alphanumeric() || b"+-.".contains(&c);
    let scheme = uri.split_once(':').map_or("", |(scheme, _)| scheme);
    scheme.starts_with(|c: char| c.is_ascii_alphabetic()) && scheme.bytes().all(word)
}

/// The path behind a relative URI (RFC 3986, section 2.1).
fn percent_decoded(uri: &str) -> Result<String, String> {
    let mut parts = uri.split('%');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        // A sign would pass as part of a number.
        let digits = part.get(..2).filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()));
        let Some(byte) = digits.and_then(|d| u8::from_str_radix(d, 16).ok()) else {
            return Err(format!("expected two hexadecimal digits after each `%` of {}", text::shown(uri.as_bytes())));
        };
        bytes.push(byte);
        bytes.extend_from_slice(&part.as_bytes()[2..]);
    }
    String::from_utf8(bytes).map_err(|_| format!("{} is not UTF-8", text::shown(uri.as_bytes())))
}

/// The bytes of a `data:` URI, without its scheme.
fn inline(data: &str) -> Result<Vec<u8>, String> {
    let Some((_, digits)) = data.split_once(',').filter(|(head, _)| head.ends_with(";base64")) else {
        return Err("expected `;base64,` in the data: URI".into());
    };
    base64(digits.as_bytes())
}

/// Decodes base64 (RFC 4648, section 4), padded or not.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let padding = text.iter().rev().take(2).take_while(|&&b| b == b'=').count();
    let digits = &text[..text.len() - padding];
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for (i, group) in digits.chunks(4).enumerate() {
        let mut bits = 0_u32;
        for (j, &digit) in group.iter().enumerate() {
            let value = match digit {
                b'A'..=b'Z' => digit - b'A',
                b'a'..=b'z' => digit - b'a' + 26,
                b'0'..=b'9' => digit - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return Err(format!("character {} of the data: URI's content is not base64", 4 * i + j + 1)),
            };
            bits |= u32::from(value) << (18 - 6 * j);
        }
        if group.len() == 1 {
            return Err("the data: URI's content ends within a byte".into());
        }
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        // RFC 4648, section 10.
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base64(text.as_bytes()).unwrap(), bytes.as_bytes());
            assert_eq!(base64(text.trim_end_matches('=').as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64(b"+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        for wrong in ["Z", "Zm9vY", "Zm 9", "Zg=a", "====", "Zm9v\n"] {
            assert!(base64(wrong.as_bytes()).is_err(), "{wrong}");
        }
        assert!(inline("text/plain,abc").is_err());
        assert_eq!(inline("application/octet-stream;base64,Zm8=").unwrap(), b"fo");
    }

    #[test]
    fn uris() {
        assert_eq!(percent_decoded("a%20b/%c3%A9.bin").unwrap(), "a b/é.bin");
        for wrong in ["%", "a%2", "%+1", "%zz", "%é", "%ff"] {
            assert!(percent_decoded(wrong).is_err(), "{wrong}");
        }
        assert!(has_scheme("http://x") && has_scheme("c:\\x") && has_scheme("a+b:"));
        assert!(!has_scheme("a/b:c") && !has_scheme("x.bin") && !has_scheme(":x") && !has_scheme("1:x"));
        assert_eq!(strip_scheme("DATA:x", "data:"), Some("x"));
        assert_eq!(strip_scheme("é", "data:"), None);
    }
}
