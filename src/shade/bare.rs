//! Triangles without shading normals whose look is the same everywhere: what shading in lanes takes of them.

use rayon::prelude::*;

use super::look::Looks;
use super::place::{Flat, unit_normal};
use crate::lanes::chosen::{lanes_of, records};
use crate::lanes::{MAX_LANES, Real};
use crate::ray::Hits;
use crate::scene::world::World;

/// Most triangles that are kept.
const MAX_KEPT: u32 = 1 << 20;
/// Material of those that are not such.
const OTHER: u32 = u32::MAX;

/// Numbers of a triangle: first corner, the edges from it to the second and the third, unit normal; world space.
const KEPT: usize = 12;
/// Those without the normal.
const EDGES: usize = 9;

/// A triangle and its material.
#[derive(Clone, Copy, Debug)]
struct Bare<S, const K: usize> {
    numbers: [S; K],
    /// Index into the description's materials.
    material: u32,
}

impl<S: Real> Bare<S, EDGES> {
    fn with_normal(&self) -> Bare<S, KEPT> {
        let [.., x1, y1, z1, x2, y2, z2] = self.numbers;
        let mut numbers = [S::ZERO; KEPT];
        numbers[..EDGES].copy_from_slice(&self.numbers);
        numbers[EDGES..].copy_from_slice(&unit_normal([x1, y1, z1], [x2, y2, z2]));
        Bare { numbers, material: self.material }
    }
}

/// Bare triangles by primitive number, where the world is one placed object of moderate size and there are
/// rays enough; others are worked out hit by hit.
#[derive(Debug, Default)]
pub struct BareTriangles<S> {
    kept: Vec<Bare<S, KEPT>>,
}

impl<S: Real> BareTriangles<S> {
    /// Those of `world`, which `rays` primary rays are to be traced through.
    pub fn new(world: &World<S>, looks: &Looks<'_>, rays: u64) -> Self {
        let count = world.first_placed().map_or(0, |(_, object)| object.prim_count);
        let is_one = world.is_single_object() && world.names.is_none();
        if !is_one || count > MAX_KEPT || 2 * u64::from(count) > rays {
            return Self { kept: Vec::new() };
        }
        let other = Bare { numbers: [S::ZERO; KEPT], material: OTHER };
        let kept = |prim| of(world, looks, prim, 0).map_or(other, |bare| bare.with_normal());
        Self { kept: (0..count).into_par_iter().map(kept).collect() }
    }

    /// The triangles that the `lanes` of rays `first..first + N` hit, where they are such: these lanes, and their materials
    /// into `material`.
    #[inline(always)]
    pub fn gather(
        &self,
        (world, looks): (&World<S>, &Looks<'_>),
        hits: &Hits<S>,
        first: usize,
        lanes: u32,
        material: &mut [u32; MAX_LANES],
    ) -> (u32, Flat<S::Wide>) {
        let mut bare = 0;
        if self.kept.is_empty() {
            let mut own = [[S::ZERO; EDGES]; MAX_LANES];
            for lane in lanes_of(lanes) {
                let Some(found) = of(world, looks, hits.prim[first + lane], hits.inst[first + lane]) else { continue };
                (own[lane], material[lane]) = (found.numbers, found.material);
                bare |= 1 << lane;
            }
            let numbers: [S::Wide; EDGES] = records(bare, &NUMBERS, |lane| &own[lane as usize % MAX_LANES]);
            let three = |k: usize| [numbers[k], numbers[k + 1], numbers[k + 2]];
            let (corner, e1, e2) = (three(0), three(3), three(6));
            return (bare, Flat { corner, edges: [e1, e2], normal: unit_normal(e1, e2) });
        }
        let mut prim = [0; MAX_LANES];
        for lane in lanes_of(lanes) {
            prim[lane] = hits.prim[first + lane];
            let own = self.kept[prim[lane] as usize].material;
            material[lane] = own;
            bare |= u32::from(own != OTHER) << lane;
        }
        let numbers: [S::Wide; KEPT] = records(bare, &prim, |prim| &self.kept[prim as usize].numbers);
        // Written out: `map` of vectors is a call.
        let three = |k: usize| [numbers[k], numbers[k + 1], numbers[k + 2]];
        (bare, Flat { corner: three(0), edges: [three(3), three(6)], normal: three(9) })
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
fn of<S: Real>(world: &World<S>, looks: &Looks<'_>, prim: u32, inst: u32) -> Option<Bare<S, EDGES>> {
    let bare = world.bare_triangle(prim, inst);
    if !looks.is_alike(bare.material) {
        return None;
    }
    // Edges are differences in f64, rounded once.
    let [a, e1, e2] = bare.triangle?.map(|v| v.to_array().map(S::from_f64));
    let numbers = [a[0], a[1], a[2], e1[0], e1[1], e1[2], e2[0], e2[1], e2[2]];
    Some(Bare { numbers, material: bare.material })
}
