//! Triangles without shading normals whose look is the same everywhere: what shading in lanes takes of them.

use rayon::prelude::*;

use super::look::Looks;
use crate::lanes::chosen::{lanes_of, records};
use crate::lanes::{MAX_LANES, Real};
use crate::ray::Hits;
use crate::scene::world::World;

/// Most triangles that are kept.
const MAX_KEPT: u32 = 1 << 20;
/// Material of those that are not such.
const OTHER: u32 = u32::MAX;

/// First corner and the edges from it to the second and the third, world space, and the material.
#[derive(Clone, Copy, Debug)]
struct Bare<S> {
    /// Corner, edge, edge.
    numbers: [S; 9],
    /// Index into the description's materials.
    material: u32,
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

    /// Corner and edges of the triangles that the `lanes` of rays `first..first + N` hit, where they are such: these lanes,
    /// and their materials into `material`.
    #[inline(always)]
    pub fn gather(
        &self,
        (world, looks): (&World<S>, &Looks<'_>),
        hits: &Hits<S>,
        first: usize,
        lanes: u32,
        material: &mut [u32; MAX_LANES],
    ) -> (u32, [S::Wide; 9]) {
        let mut bare = 0;
        if self.kept.is_empty() {
            let mut own = [[S::ZERO; 9]; MAX_LANES];
            for lane in lanes_of(lanes) {
                let Some(found) = of(world, looks, hits.prim[first + lane], hits.inst[first + lane]) else { continue };
                (own[lane], material[lane]) = (found.numbers, found.material);
                bare |= 1 << lane;
            }
            return (bare, records(bare, &NUMBERS, |lane| &own[lane as usize % MAX_LANES]));
        }
        let mut prim = [0; MAX_LANES];
        for lane in lanes_of(lanes) {
            prim[lane] = hits.prim[first + lane];
            let own = self.kept[prim[lane] as usize].material;
            material[lane] = own;
            bare |= u32::from(own != OTHER) << lane;
        }
        (bare, records(bare, &prim, |prim| &self.kept[prim as usize].numbers))
    }
}

/// The numbers of lanes.
const NUMBERS: [u32; MAX_LANES] = {
    let (mut numbers, mut lane) = ([0; MAX_LANES], 0);
    while lane < MAX_LANES {
        numbers[lane] = lane as u32;
        lane += 1;
    }
    numbers
};

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
