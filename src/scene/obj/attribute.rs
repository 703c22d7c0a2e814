//! Texture coordinates and normals of an OBJ file, which have indices of their own at each corner.

use crate::scene::mesh::Attribute;
use crate::scene::polygon;

/// The index of a corner without a value.
pub(super) const NONE: u32 = u32::MAX;

/// One attribute while the file is read.
#[derive(Debug, Default)]
pub(super) struct Column<T> {
    /// The values so far.
    pub values: Vec<T>,
    /// Indices at the corners of the triangles so far; empty until the first corner has one.
    indices: Vec<[u32; 3]>,
    /// Corners whose index names nothing.
    pub dangling: u64,
}

impl<T: Copy + Default> Column<T> {
    /// The 0-based index that `written` means here: from 1 on, or backwards from -1. It may name a value that comes
    /// later. [`NONE`], and counted, if it cannot name any.
    pub fn index(&mut self, written: i64) -> u32 {
        let index = match written {
            1.. => u32::try_from(written - 1).ok().filter(|&index| index != NONE),
            _ => usize::try_from(written.unsigned_abs())
                .ok()
                .filter(|&back| back > 0)
                .and_then(|back| self.values.len().checked_sub(back))
                .and_then(|index| u32::try_from(index).ok()),
        };
        self.dangling += u64::from(index.is_none());
        index.unwrap_or(NONE)
    }

    /// Adds the triangle with number `triangle`.
    pub fn push(&mut self, triangle: usize, corners: [u32; 3]) {
        if self.indices.is_empty() {
            if corners == [NONE; 3] {
                return;
            }
            self.indices.resize(triangle, [NONE; 3]);
        }
        self.indices.push(corners);
    }

    /// Cuts the polygon whose fan of `count` triangles begins with number `first` another way ([`polygon`]).
    pub fn cut(&mut self, cut: &[[u32; 3]], first: usize, count: usize) {
        if !self.indices.is_empty() {
            polygon::apply(cut, &mut self.indices[first..first + count]);
        }
    }

    /// The attribute of a mesh of `triangles`: corners without a value have the default one.
    pub fn finish(mut self, triangles: &[[u32; 3]], dangling: &mut u64) -> Attribute<T> {
        if self.indices.is_empty() {
            *dangling += self.dangling;
            return Attribute::default();
        }
        let absent = self.values.len() as u32;
        let mut has_absent = false;
        for index in self.indices.iter_mut().flatten() {
            if *index >= absent {
                self.dangling += u64::from(*index != NONE);
                *index = absent;
                has_absent = true;
            }
        }
        if has_absent {
            self.values.push(T::default());
        }
        *dangling += self.dangling;
        // Writers often number all alike: then the indices of the vertices say it.
        if self.indices == triangles {
            self.indices = Vec::new();
        }
        Attribute { values: self.values, indices: self.indices }
    }
}
