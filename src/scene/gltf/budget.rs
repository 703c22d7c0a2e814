//! How much a document may decode to. Accessors need not own their bytes (they overlap, or have none and are zeros),
//! so no single length bounds what a document asks for: the sum over all requests is bounded instead.

use std::cell::Cell;

/// Most bytes of vertices, triangles and instances per byte of the document and of the files it refers to. A document
/// that names each of its bytes once needs at most 40 (a triangle strip of 8-bit indices).
pub const DECODED_PER_BYTE: u64 = 64;
/// What any document may decode to: the smallest ones have vertices without bytes too.
const FLOOR: u64 = 1 << 20;

/// The allowance of one document.
#[derive(Debug)]
pub struct Budget {
    document: u64,
    spent: Cell<u64>,
}

impl Budget {
    /// The allowance of a document of `document` bytes.
    pub fn new(document: u64) -> Self {
        Self { document, spent: Cell::new(0) }
    }

    /// Takes `bytes`; `external` bytes were read from other files so far.
    ///
    /// # Errors
    /// The allowance does not suffice.
    pub fn spend(&self, bytes: u64, external: u64) -> Result<(), String> {
        let total = self.document.saturating_add(external);
        let spent = self.spent.get().saturating_add(bytes);
        self.spent.set(spent);
        if spent <= total.saturating_mul(DECODED_PER_BYTE).max(FLOOR) {
            return Ok(());
        }
        Err(format!(
            "decodes to more than {DECODED_PER_BYTE} bytes per byte of the files ({total}): the document has less \
             data than it counts, or names the same data very often"
        ))
    }
}
