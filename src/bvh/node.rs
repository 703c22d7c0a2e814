//! The flat node: eight children for all engines, sixteen for streams and tiles where registers hold as many.

use crate::lanes::words::zeros;
use crate::lanes::{Real, each};
use crate::math::Aabb;

/// Children per node.
pub const WIDTH: usize = 8;

/// Children per node of the wide tree, where a register holds as many numbers.
pub const WIDE: usize = 16;

/// Most primitives in a leaf.
pub const LEAF_PRIMS: usize = 8;

/// The boxes of `W` children as a structure of arrays. f32, eight children: 256 bytes, four cache lines (sixteen: twice as many):
///
/// | bytes | content |
/// |---|---|
/// | 0..192 | `bounds[axis][0 low, 1 high][child]` |
/// | 192..224 | `child`: node index, or block index of a leaf |
/// | 224..232 | `count`: 0 for an inner node, else primitives in the leaf |
/// | 232..240 | `class` of the leaf |
/// | 240..244 | `used`: children in use, slots `0..used` |
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node<S, const W: usize = WIDTH> {
    /// Boxes.
    pub bounds: [[[S; W]; 2]; 3],
    /// References.
    pub child: [u32; W],
    /// Primitives per leaf child.
    pub count: [u8; W],
    /// Classes of leaf children.
    pub class: [u8; W],
    /// Children in use, largest area first.
    pub used: u32,
}

const _: () = assert!(size_of::<Node<f32>>() == 256 && align_of::<Node<f32>>() == 64);
const _: () = assert!(size_of::<Node<f32, WIDE>>() == 512);

/// A reference to a child: what traversal keeps on its stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child {
    /// Node index, or block index of a leaf.
    pub index: u32,
    /// 0 for an inner node, else primitives in the leaf.
    pub count: u8,
    /// Class of a leaf.
    pub class: u8,
}

impl Child {
    /// The root node of a tree.
    pub const ROOT: Self = Self { index: 0, count: 0, class: 0 };

    /// Whether this is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.count != 0
    }
}

impl<S: Real, const W: usize> Node<S, W> {
    /// A node without children; unused slots hold empty boxes.
    pub fn empty() -> Self {
        Self { bounds: [[[S::INFINITY; W], [S::LOWEST; W]]; 3], child: [0; W], count: [0; W], class: [0; W], used: 0 }
    }

    /// Puts a child into the next free slot.
    pub fn push(&mut self, bounds: &Aabb<S>, child: Child) {
        let slot = self.used as usize;
        for axis in 0..3 {
            self.bounds[axis][0][slot] = bounds.lo[axis];
            self.bounds[axis][1][slot] = bounds.hi[axis];
        }
        (self.child[slot], self.count[slot], self.class[slot]) = (child.index, child.count, child.class);
        self.used += 1;
    }

    /// Box of a child.
    #[inline(always)]
    pub fn child_bounds(&self, slot: usize) -> Aabb<S> {
        Aabb { lo: each(|a| self.bounds[a][0][slot]), hi: each(|a| self.bounds[a][1][slot]) }
    }

    /// Children that are inner nodes, as bits; slots that are not in use look like such.
    #[inline(always)]
    pub fn inner(&self) -> u32 {
        zeros(&self.count)
    }

    /// Reference to a child.
    #[inline(always)]
    pub fn child(&self, slot: usize) -> Child {
        Child { index: self.child[slot], count: self.count[slot], class: self.class[slot] }
    }
}
