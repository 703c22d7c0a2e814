//! Blocks of up to eight primitives of one kind: one leaf of a tree.

use crate::lanes::Real;
use crate::ray::INVALID_ID;

/// Primitives per block.
pub const BLOCK: usize = 8;

/// `F` numbers for each of eight primitives, field by field, and their primitive numbers.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Block<S, const F: usize> {
    /// `fields[f][i]`: number `f` of primitive `i`.
    pub fields: [[S; BLOCK]; F],
    /// Primitive numbers; [`INVALID_ID`] in unused slots.
    pub prim: [u32; BLOCK],
}

// The triangle block of the f32 engines: nine corners' coordinates and the ids, five cache lines.
const _: () = assert!(size_of::<Block<f32, 9>>() == 320 && align_of::<Block<f32, 9>>() == 64);

impl<S: Real, const F: usize> Block<S, F> {
    /// A block with no primitive.
    pub fn empty() -> Self {
        Self { fields: [[S::ZERO; BLOCK]; F], prim: [INVALID_ID; BLOCK] }
    }

    /// Puts a primitive into slot `i`.
    pub fn set(&mut self, i: usize, numbers: [S; F], prim: u32) {
        for (field, x) in self.fields.iter_mut().zip(numbers) {
            field[i] = x;
        }
        self.prim[i] = prim;
    }

    /// Primitives in the block: slots `0..len`.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.prim.iter().take_while(|&&p| p != INVALID_ID).count()
    }

    /// Whether no slot is used.
    pub fn is_empty(&self) -> bool {
        self.prim[0] == INVALID_ID
    }

    /// The numbers of the primitive in slot `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> [S; F] {
        let mut numbers = [S::ZERO; F];
        for f in 0..F {
            numbers[f] = self.fields[f][i];
        }
        numbers
    }
}
