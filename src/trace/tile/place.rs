//! An instance as a tile sees it.
//!
//! A point of an object, p, stands in the world at M p + m. Seen from the tile's apex o along an axis of its frame that
//! is axis . (M p + m - o) = (axis M) . (p - o'), where o' is the apex in the object's space. So an instance is entered by
//! taking the three axes and the apex through its map, once per tile; rays keep their (s, t), depths stay the world's, and
//! hits in one instance shorten what is looked for in the next. The products are made in f64 from the exact map and
//! rounded once, so what the map adds to the rounding of [`super::batch`] is as much as a vertex' own.

use super::frame::Frame;
use super::slab::Space;
use super::{HALF_ULP, node};
use crate::math::Affine;
use crate::scene::world::{Instance, Object, World};

/// Largest growth of rounding ([`crate::scene::world::Rounding`]) that tiles are made for.
pub const MOST_GROWTH: f64 = 1000.0;

/// Errors of mapped points in the units of [`node::MARGIN`], to be multiplied with the growth of rounding.
const MAPPED: f64 = 8.0;

/// An instance, seen by one tile.
#[derive(Debug)]
pub struct Place<'a> {
    /// Its number.
    pub inst: u32,
    /// Its geometry.
    pub object: &'a Object<f32>,
    /// The tile's frame in the space of the object.
    pub frame: Frame,
    /// Object space to world space, times the scale of the frame.
    pub to_world: Affine<f32>,
    instance: &'a Instance<f32>,
}

impl<'a> Place<'a> {
    /// Instance `inst` seen from `frame`.
    #[inline(always)]
    pub fn new(world: &'a World<f32>, inst: u32, frame: &Frame) -> Self {
        let instance = &world.instances[inst as usize];
        let object = &world.objects[instance.object as usize];
        let map = &world.traced.placements[inst as usize].to_world;
        let mut to_world = Affine::from_f64(map);
        to_world.rows.iter_mut().flatten().for_each(|x| *x *= frame.scale);
        Self { inst, object, frame: frame.through(map, &object.tree.bounds), to_world, instance }
    }

    /// How box tests of single rays see the object's boxes. `slack`: see [`super::groups::Groups::slack`], in world units.
    #[inline(always)]
    pub fn space(&self, world: &World<f32>, slack: f32) -> Space<'a> {
        let rows = &self.instance.to_local.rows;
        let size = |r: &[f32; 4]| r[0].abs() + r[1].abs() + r[2].abs();
        let shrink = size(&rows[0]).max(size(&rows[1])).max(size(&rows[2]));
        let margin = node::MARGIN * HALF_ULP * self.frame.extent * world.rounding.growth as f32;
        Space {
            apex: self.frame.apex,
            margin: margin + 2.0 * slack * shrink,
            extent: self.frame.extent,
            to_local: Some(&self.instance.to_local),
        }
    }
}

/// Margin of the upper tree's boxes, world units: what [`node::MARGIN`] says, and what points move by in the maps of
/// instances, seen from `frame`.
pub fn margin(world: &World<f32>, frame: &Frame) -> f32 {
    let rounding = &world.rounding;
    let units = f64::from(node::MARGIN) + MAPPED * rounding.growth;
    let size = units * f64::from(frame.extent) + MAPPED * rounding.reach;
    (f64::from(HALF_ULP) * size) as f32
}
