//! A tiny engine of its own for the tests of this floor: it needs no geometry and can be told to be wrong.

use std::sync::Mutex;

use crate::lanes::Real;
use crate::ray::{Counters, Hits, Rays};
use crate::scene::assembly::Assembly;
use crate::scene::description::{Description, Item, ItemKind};
use crate::scene::mesh::Mesh;
use crate::scene::world::{Compiles, Preset, World};
use crate::trace::{Engine, Scratch};

/// Hits the plane z = 0 from above: t = -oz / dz, u = ox.
#[derive(Default)]
pub struct Slab<'a> {
    name: Option<&'static str>,
    order: Option<&'a Mutex<String>>,
    /// Rays of every batch (by slot) that are answered wrongly.
    pub wrong_slot: Option<usize>,
}

impl<'a> Slab<'a> {
    /// An engine that writes its name into `order` at every call.
    pub fn named(name: &'static str, order: &'a Mutex<String>) -> Self {
        Self { name: Some(name), order: Some(order), wrong_slot: None }
    }

    fn note(&self, rays: usize, counters: Option<&mut Counters>) {
        if let (Some(name), Some(order)) = (self.name, self.order) {
            order.lock().unwrap().push_str(name);
        }
        if let Some(counters) = counters {
            counters.rays += rays as u64;
        }
    }

    fn t<S: Real>(&self, rays: &Rays<S>, i: usize) -> Option<f64> {
        let t = -rays.org[2][i].to_f64() / rays.dir[2][i].to_f64();
        let inside = rays.is_live(i) && t >= rays.t_min[i].to_f64() && t <= rays.t_max[i].to_f64();
        (inside && self.wrong_slot != Some(i)).then_some(t)
    }
}

impl<S: Real> Engine<S> for Slab<'_> {
    fn name(&self) -> &'static str {
        self.name.unwrap_or("slab")
    }

    fn lanes(&self) -> usize {
        1
    }

    fn intersect(
        &self,
        _world: &World<S>,
        rays: &Rays<S>,
        hits: &mut Hits<S>,
        _scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        self.note(rays.len(), counters);
        hits.reset(rays.len());
        for i in 0..rays.len() {
            if let Some(t) = self.t(rays, i) {
                hits.t[i] = S::from_f64(t);
                hits.u[i] = rays.org[0][i];
                hits.prim[i] = 0;
                hits.inst[i] = 0;
            }
        }
    }

    fn occluded(
        &self,
        _world: &World<S>,
        rays: &Rays<S>,
        out: &mut Vec<u8>,
        _scratch: &mut Scratch,
        counters: Option<&mut Counters>,
    ) {
        self.note(rays.len(), counters);
        out.clear();
        out.extend((0..rays.len()).map(|i| u8::from(self.t(rays, i).is_some())));
    }
}

/// A world that [`Slab`] ignores.
pub fn empty_world<S: Compiles>() -> World<S> {
    World::compile(&Description::new("empty"), Preset::Fast).unwrap()
}

/// Batches of rays that fall down -z from different heights.
pub fn falling_rays<S: Real>(sizes: &[usize]) -> Vec<Rays<S>> {
    let mut number = 0;
    let mut batch = |&size: &usize| {
        let mut rays = Rays::new(size);
        for i in 0..size {
            number += 1;
            let (at, down) = (f64::from(number), [0.0, 0.0, -1.0]);
            rays.set(i, [at, 0.0, at].map(S::from_f64), down.map(S::from_f64), S::from_f64(0.0), S::from_f64(1e9));
        }
        rays
    };
    sizes.iter().map(&mut batch).collect()
}

/// A scene of one item under the identity; `mesh` is mesh 0.
pub fn scene_of(kind: ItemKind, mesh: Option<Mesh>) -> Assembly {
    let mut scene = Description::new("one item");
    scene.meshes = mesh.into_iter().map(Into::into).collect();
    scene.groups[0].items.push(Item { transform: glam::DAffine3::IDENTITY, material: None, kind });
    Assembly::new(&scene).unwrap()
}
