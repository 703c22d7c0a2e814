//! What a tree costs: one model for all who decide on its shape.
//!
//! A node costs 1, a leaf 1 and a quarter per triangle, or what its primitives are said to cost, both times the share of rays that
//! meet their boxes, which is that of their surface (Goldsmith, Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing",
//! IEEE CG&A 7(5), 1987). What is there also costs if it is not met: it takes a place in the caches. So few rays' leaves are filled,
//! as blocks have room for all their primitives, while what many rays meet, like the walls of a room, is kept apart.

/// Cost of a primitive in a leaf that is met: a triangle's, which is tested together with the others of its block.
pub const PRIMITIVE: f32 = 0.25;

/// Cost of a node or a leaf that is never met; also the share of rays from which on a box counts as met by many.
const PLACE: f32 = 1e-3;

/// Costs in a scene whose box has half the surface area `root`; areas of boxes are halved, too.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    place: f32,
}

impl Cost {
    /// The model for a scene.
    pub fn new(root: f32) -> Self {
        Self { place: PLACE * root }
    }

    /// An inner node without what is below it.
    #[inline(always)]
    pub fn node(self, area: f32) -> f32 {
        area + self.place
    }

    /// A leaf of `count` primitives that cost `each`.
    #[inline(always)]
    pub fn leaf(self, area: f32, count: u32, each: f32) -> f32 {
        area * (1.0 + each * count as f32) + self.place
    }

    /// Whether nothing can cost less than one leaf of all, as two cost more by their places alone.
    #[inline(always)]
    pub fn is_one_leaf(self, area: f32, count: u32) -> bool {
        self.leaf(area, count, PRIMITIVE) <= 2.0 * self.place
    }

    /// What a subtree of `count` primitives may come to before it is built: as many leaves as it has blocks of `block`.
    /// Primitives count where many rays meet them; elsewhere leaves will be full.
    #[inline(always)]
    pub fn guess(self, area: f32, count: u32, block: usize) -> f32 {
        let many = if area > 0.0 { area / (area + self.place) } else { 0.0 };
        area * (count.div_ceil(block as u32) as f32 + PRIMITIVE * many * count as f32)
    }
}
