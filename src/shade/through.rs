//! Closest hits and shadow rays in scenes where surfaces let rays pass: by their opacity, or as panes and bodies of
//! glass.

use glam::DVec3;

use super::classic::Classic;
use super::look::Looks;
use crate::lanes::Real;
use crate::ray::{Counters, Hits, INVALID_ID, Rays};
use crate::scene::assembly::PartKind;
use crate::scene::world::World;
use crate::trace::{Engine, Scratch};

/// Surfaces that a ray may pass; what lies behind more of them is not seen.
const MOST_LAYERS: u32 = 1024;
/// Roundings within which two parameters of one surface are the same hit.
const SAME: f64 = 16.0;
/// Name of the number that chooses in mixtures; layers that a ray meets are named by their number.
pub(super) const MIXTURE: u32 = u32::MAX;

/// A tracer of rays that pass some surfaces.
#[derive(Clone, Copy)]
pub(super) struct Through<'a, S: Real> {
    pub world: &'a World<S>,
    pub engine: &'a dyn Engine<S>,
    pub looks: &'a Looks<'a>,
}

/// Rays on their way through layers.
#[derive(Debug)]
pub(super) struct Again<S> {
    rays: Rays<S>,
    hits: Hits<S>,
    /// Which ray of the batch each is.
    index: Vec<u32>,
    /// What of each ray's light is left.
    left: Vec<DVec3>,
    /// Of all rays of the batch, those whose hit is one that they have passed already.
    passed: Vec<bool>,
}

impl<S: Real> Default for Again<S> {
    fn default() -> Self {
        Self { rays: Rays::new(0), hits: Hits::new(0), index: Vec::new(), left: Vec::new(), passed: Vec::new() }
    }
}

impl<S: Real> Again<S> {
    /// Begins with all of `count` rays.
    fn start(&mut self, count: usize) {
        self.index.clear();
        self.index.extend(0..count as u32);
        self.passed.clear();
        self.passed.resize(count, false);
    }
}

impl<S: Real> Through<'_, S> {
    /// Closest hits of `rays` into `hits`; what opacity lets pass is no hit. `number` gives the number in [0, 1) that
    /// decides for ray `i` at its layer `k`.
    pub fn closest(
        &self,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        again: &mut Again<S>,
        mut counters: Option<&mut Counters>,
        number: impl Fn(usize, u32) -> f64,
    ) {
        self.engine.intersect(self.world, rays, hits, scratch, counters.as_deref_mut());
        self.behind(rays, hits, scratch, again, counters, number);
    }

    /// Moves the closest `hits` of `rays` on to what is behind, where opacity lets rays pass; see [`Self::closest`].
    pub fn behind(
        &self,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        again: &mut Again<S>,
        mut counters: Option<&mut Counters>,
        number: impl Fn(usize, u32) -> f64,
    ) {
        if !self.looks.has_holes {
            return;
        }
        again.start(rays.len());
        for layer in 0..MOST_LAYERS {
            let Again { index, passed, .. } = again;
            index.retain(|&i| {
                if passed[i as usize] {
                    return true;
                }
                let opacity = self.opacity(rays, hits, i as usize);
                opacity < 1.0 && number(i as usize, layer) >= opacity
            });
            if index.is_empty() {
                return;
            }
            self.go_on(rays, hits, scratch, again, counters.as_deref_mut());
        }
    }

    /// Traces the listed rays on from behind their hits. An engine with an arithmetic of its own may find the same hit once more, a
    /// rounding farther away, when other rays go with it; who has passed it has passed it.
    fn go_on(
        &self,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        again: &mut Again<S>,
        counters: Option<&mut Counters>,
    ) {
        let Again { rays: behind, hits: found, index, passed, .. } = again;
        behind.reset(index.len());
        for (k, &i) in index.iter().enumerate() {
            let i = i as usize;
            let t = hits.t[i];
            let start = if passed[i] { (t + roundings(t)).fast_max(t.next_up()) } else { t.next_up() };
            behind.set(k, rays.org(i), rays.dir(i), start, rays.t_max[i]);
        }
        self.engine.intersect(self.world, behind, found, scratch, counters);
        for (k, &i) in index.iter().enumerate() {
            let i = i as usize;
            passed[i] = self.is_same(hits, i, found, k);
            copy(found, k, hits, i);
        }
    }

    /// Whether two hits of one ray are the same, which engines that agree in all bits do not find: a line meets a triangle once, and
    /// a face of other surfaces where it is met about there.
    fn is_same(&self, one: &Hits<S>, i: usize, other: &Hits<S>, k: usize) -> bool {
        let (prim, inst) = (other.prim[k], other.inst[k]);
        if self.engine.is_exact() || !other.is_hit(k) || (prim, inst) != (one.prim[i], one.inst[i]) {
            return false;
        }
        let assembly = &self.world.assembly;
        let part = assembly.part_of(assembly.placements[inst as usize].object, prim);
        let near = other.t[k] <= one.t[i] + roundings(one.t[i]) && other.u[k] == one.u[i];
        matches!(part.kind, PartKind::Mesh(_)) || near
    }

    /// Whether surfaces stop all light that meets them; `glass`: see [`Self::shadows`].
    pub fn is_opaque(&self, glass: bool) -> bool {
        !(self.looks.has_holes || glass && self.looks.has_glass)
    }

    /// Calls `lit` with the number of each of `rays` along which some light is left, and its share: 1 without any surface
    /// in between. With `glass`, panes and bodies of glass let light pass straight on, weakened by their tint and
    /// Fresnel's term; else they stop it.
    #[inline]
    pub fn shadows(
        &self,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        occluded: &mut Vec<u8>,
        scratch: &mut Scratch,
        again: &mut Again<S>,
        glass: bool,
        counters: Option<&mut Counters>,
        mut lit: impl FnMut(usize, DVec3),
    ) {
        if self.is_opaque(glass) {
            self.engine.occluded(self.world, rays, occluded, scratch, counters);
            occluded.iter().enumerate().filter(|(_, occluded)| **occluded == 0).for_each(|(i, _)| lit(i, DVec3::ONE));
            return;
        }
        let left = self.weakened(rays, hits, scratch, again, glass, counters);
        left.iter().enumerate().filter(|(_, left)| **left != DVec3::ZERO).for_each(|(i, left)| lit(i, *left));
    }

    /// What of the light along each of `rays` is left, as a list.
    fn weakened<'m>(
        &self,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        scratch: &mut Scratch,
        again: &'m mut Again<S>,
        glass: bool,
        mut counters: Option<&mut Counters>,
    ) -> &'m [DVec3] {
        self.engine.intersect(self.world, rays, hits, scratch, counters.as_deref_mut());
        again.start(rays.len());
        again.left.clear();
        again.left.resize(rays.len(), DVec3::ONE);
        for _ in 0..MOST_LAYERS {
            let Again { index, left, passed, .. } = &mut *again;
            index.retain(|&i| {
                let i = i as usize;
                if hits.is_hit(i) && !passed[i] {
                    left[i] *= self.passed(rays, hits, i, glass);
                }
                hits.is_hit(i) && left[i] != DVec3::ZERO
            });
            if index.is_empty() {
                break;
            }
            self.go_on(rays, hits, scratch, again, counters.as_deref_mut());
        }
        // What is still inside after so many layers is dark.
        let Again { index, left, .. } = again;
        index.iter().for_each(|&i| left[i as usize] = DVec3::ZERO);
        left
    }

    /// Share of light that the surface hit by ray `i` stops; 1 for a miss.
    fn opacity(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize) -> f64 {
        if !hits.is_hit(i) {
            return 1.0;
        }
        let (prim, inst) = (hits.prim[i], hits.inst[i]);
        let material = self.world.material(self.world.assembly.placements[inst as usize].object, prim);
        if !self.looks.is_holed(material) {
            return 1.0;
        }
        let (org, dir, [t, u, v]) = numbers(rays, hits, i);
        self.looks.opacity(material, &self.world.surface(org, dir, t, u, v, prim, inst))
    }

    /// Share of light that passes the surface hit by ray `i`.
    fn passed(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize, glass: bool) -> DVec3 {
        let (prim, inst) = (hits.prim[i], hits.inst[i]);
        let material = self.world.material(self.world.assembly.placements[inst as usize].object, prim);
        let is_glass = glass && self.looks.is_glass(material);
        if !is_glass && !self.looks.is_holed(material) {
            return DVec3::ZERO;
        }
        let (org, dir, [t, u, v]) = numbers(rays, hits, i);
        let surface = self.world.surface(org, dir, t, u, v, prim, inst);
        let opacity = self.looks.opacity(material, &surface);
        let through = if is_glass { Classic::of(self.looks, &surface, dir).through } else { DVec3::ZERO };
        DVec3::splat(1.0 - opacity) + through * opacity
    }
}

fn numbers<S: Real>(rays: &Rays<S>, hits: &Hits<S>, i: usize) -> (DVec3, DVec3, [f64; 3]) {
    let [org, dir] = [rays.org(i), rays.dir(i)].map(|v| DVec3::from(v.map(S::to_f64)));
    (org, dir, [hits.t[i], hits.u[i], hits.v[i]].map(S::to_f64))
}

/// What a parameter may be off by in an arithmetic of tiles' own, whose depths are a few roundings from it.
fn roundings<S: Real>(t: S) -> S {
    t.abs() * S::from_f64(SAME) * S::EPSILON
}

fn copy<S: Real>(from: &Hits<S>, k: usize, to: &mut Hits<S>, i: usize) {
    (to.t[i], to.u[i], to.v[i]) = (from.t[k], from.u[k], from.v[k]);
    (to.prim[i], to.inst[i]) = (from.prim[k], from.inst[k]);
    debug_assert!(from.is_hit(k) || to.prim[i] == INVALID_ID);
}
