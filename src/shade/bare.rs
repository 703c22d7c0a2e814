//! Triangles without shading normals whose look is the same everywhere: what shading in lanes takes of them.

use rayon::prelude::*;

use super::look::Looks;
use crate::lanes::Real;
use crate::scene::world::World;

/// Most triangles that are kept.
const MAX_KEPT: u32 = 1 << 20;
/// Material of those that are not such.
const OTHER: u32 = u32::MAX;

/// First corner and the edges from it to the second and the third, world space, and the material.
#[derive(Clone, Copy, Debug)]
pub struct Bare<S> {
    /// Corner, edge, edge.
    pub numbers: [S; 9],
    /// Index into the description's materials.
    pub material: u32,
}

/// Bare triangles by primitive number, where the world is one object of moderate size and there are
/// rays enough; others are worked out hit by hit.
#[derive(Debug, Default)]
pub struct BareTriangles<S> {
    kept: Vec<Bare<S>>,
}

impl<S: Real> BareTriangles<S> {
    /// Those of `world`, which `rays` primary rays are to be traced through.
    pub fn new(world: &World<S>, looks: &Looks<'_>, rays: u64) -> Self {
        let count = world.assembly.objects.first().map_or(0, |object| object.prim_count);
        if !world.is_single_object() || count > MAX_KEPT || 2 * u64::from(count) > rays {
            return Self { kept: Vec::new() };
        }
        let other = Bare { numbers: [S::ZERO; 9], material: OTHER };
        Self { kept: (0..count).into_par_iter().map(|prim| of(world, looks, prim, 0).unwrap_or(other)).collect() }
    }

    /// Triangle `prim` of instance `inst`, if it is such a one.
    #[inline]
    pub fn get(&self, world: &World<S>, looks: &Looks<'_>, prim: u32, inst: u32) -> Option<Bare<S>> {
        if self.kept.is_empty() {
            return of(world, looks, prim, inst);
        }
        let bare = &self.kept[prim as usize];
        (bare.material != OTHER).then_some(*bare)
    }
}

#[inline]
fn of<S: Real>(world: &World<S>, looks: &Looks<'_>, prim: u32, inst: u32) -> Option<Bare<S>> {
    let bare = world.bare_triangle(prim, inst);
    if !looks.is_alike(bare.material) {
        return None;
    }
    // Edges are differences in f64, rounded once.
    let [a, e1, e2] = bare.triangle?.map(|v| v.to_array().map(S::from_f64));
    let numbers = [a[0], a[1], a[2], e1[0], e1[1], e1[2], e2[0], e2[1], e2[2]];
    Some(Bare { numbers, material: bare.material })
}
