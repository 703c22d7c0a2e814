//! Which emitting surfaces paths aim at: all that a scene stores, and of its copies as many as memory bears.

use glam::{DAffine3, DVec3};

use super::emitter::Emitter;
use crate::lanes::Real;
use crate::scene::assembly::{Part, PartKind};
use crate::scene::description::{Description, Shape};
use crate::scene::world::World;
use crate::shade::look::Looks;

/// Most emitting primitives of copies that are aimed at: no file is to ask for more memory by that than its size explains.
const MOST_COPIED: u64 = 1 << 20;

/// Emitting primitives of an object: first primitive, number, and how many of the object come before.
type Run = (u32, u32, u32);

/// The emitting primitives that are aimed at, numbered placement by placement.
pub struct Surfaces {
    /// Per object.
    runs: Vec<Vec<Run>>,
    /// Per placement: the number of its first emitting primitive; `u32::MAX` if none of it is aimed at.
    first: Vec<u32>,
    /// Emitting primitives that are not numbered: paths find them by chance only.
    left_out: u64,
}

impl Surfaces {
    /// Those of `world`.
    pub fn new<S: Real>(world: &World<S>, looks: &Looks<'_>) -> Self {
        Self::with_room(world, looks, MOST_COPIED)
    }

    /// The same with at most `room` primitives of copies: objects have their first placement whole, then every further one, in the
    /// order of the scene, as long as it fits.
    fn with_room<S: Real>(world: &World<S>, looks: &Looks<'_>, mut room: u64) -> Self {
        let assembly = &world.assembly;
        let runs: Vec<_> = (0..assembly.objects.len() as u32).map(|object| runs(world, looks, object)).collect();
        let count = |object: usize| runs[object].last().map_or(0, |&(_, count, before)| u64::from(before + count));
        let mut is_copy = vec![false; runs.len()];
        let (mut numbers, mut left_out) = (0, 0);
        let mut first_of = |object: usize| {
            let (count, is_copy) = (count(object), std::mem::replace(&mut is_copy[object], true));
            let fits = numbers + count < u64::from(u32::MAX) && !(is_copy && count > room);
            if count == 0 || !fits {
                left_out += count;
                return u32::MAX;
            }
            room -= if is_copy { count } else { 0 };
            numbers += count;
            (numbers - count) as u32
        };
        let first = assembly.placements.iter().map(|placement| first_of(placement.object as usize)).collect();
        Self { runs, first, left_out }
    }

    /// As emitters, in the order of their numbers.
    pub fn emitters<S: Real>(&self, world: &World<S>) -> Vec<Emitter> {
        let mut emitters = Vec::new();
        for (inst, placement) in world.assembly.placements.iter().enumerate() {
            if self.first[inst] == u32::MAX {
                continue;
            }
            for &(start, count, _) in &self.runs[placement.object as usize] {
                for prim in start..start + count {
                    let part = world.assembly.part_of(placement.object, prim);
                    let to_world = placement.to_world * part.to_object;
                    let material = world.material(placement.object, prim);
                    // Any point of the primitive tells.
                    let point = || world.surface(DVec3::ZERO, DVec3::ZERO, 0.0, 0.0, 0.0, prim, inst as u32);
                    let magnitude = || point().magnitude.length();
                    emitters.push(emitter(part, [prim, inst as u32], magnitude, material, &to_world));
                }
            }
        }
        emitters
    }

    /// Number of primitive `prim` of instance `inst`, which is an `object`, if it is aimed at.
    pub fn index(&self, prim: u32, inst: u32, object: u32) -> Option<usize> {
        let first = self.first[inst as usize];
        if first == u32::MAX {
            return None;
        }
        let runs = &self.runs[object as usize];
        let &(start, count, before) = &runs[runs.partition_point(|run| run.0 <= prim).checked_sub(1)?];
        (prim - start < count).then(|| (first + before + prim - start) as usize)
    }
}

/// How many emitting primitives of `world`, compiled from `description`, paths do not aim at, since too many are copies: they are
/// found by chance only.
pub fn unaimed<S: Real>(world: &World<S>, description: &Description) -> u64 {
    Surfaces::new(world, &Looks::new(description)).left_out
}

/// The emitting runs of `object`.
fn runs<S: Real>(world: &World<S>, looks: &Looks<'_>, object: u32) -> Vec<Run> {
    let mut list: Vec<Run> = Vec::new();
    let mut before = 0;
    for (start, end) in world.material_runs(object) {
        if start < end && looks.shines(world.material(object, start)) {
            list.push((start, end - start, before));
            before += end - start;
        }
    }
    list
}

fn emitter(part: &Part, ids: [u32; 2], magnitude: impl Fn() -> f64, material: u32, to_world: &DAffine3) -> Emitter {
    match &part.kind {
        PartKind::Mesh(mesh) => {
            let corners = mesh.corners((ids[0] - part.first_prim) as usize);
            Emitter::triangle(to_world, corners, magnitude(), material, ids)
        }
        PartKind::Shape(Shape::Sphere) => Emitter::sphere(to_world, magnitude(), material, ids),
        PartKind::Shape(Shape::Disc) => Emitter::disc(to_world, magnitude(), material, ids),
        _ => Emitter::Unaimed,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};
    use std::sync::Arc;

    use glam::DMat3;

    use super::*;
    use crate::camera::{Passes, Tiling};
    use crate::ray::Rays;
    use crate::scene::description::{Group, Item, ItemKind, Material};
    use crate::scene::world::Preset;
    use crate::shade::path::Paths;
    use crate::shade::path::lights::Lights;
    use crate::shade::{Integrator, Samples, Settings, Spots, Workspace};
    use crate::trace::engine;

    /// How far away the spheres of [`ring`] are.
    const DISTANCE: f64 = 2.0;

    /// A plane z = 0 and four copies of a pair of shining spheres: a ring of eight above its origin, 45 degrees from each other.
    fn ring() -> Description {
        let mut d = Description::new("ring");
        d.ambient = DVec3::ZERO;
        d.materials.push(Material { diffuse: DVec3::splat(0.5), ..Material::default() });
        d.materials.push(Material { diffuse: DVec3::ZERO, emission: DVec3::splat(3.0), ..Material::default() });
        let shape =
            |shape, transform, material| Item { transform, material: Some(material), kind: ItemKind::Shape(shape) };
        d.groups[0].items.push(shape(Shape::HalfSpace, DAffine3::IDENTITY, 1));
        let spheres = [TAU / 16.0, -TAU / 16.0].map(|angle: f64| {
            let at = DVec3::new(angle.cos(), angle.sin(), 1.0).normalize() * DISTANCE;
            shape(Shape::Sphere, DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(0.4)), at), 2)
        });
        d.groups.push(Group { name: "pair".into(), items: spheres.to_vec() });
        for i in 0..4 {
            let transform = DAffine3::from_rotation_z(TAU * f64::from(i) / 4.0);
            d.groups[0].items.push(Item { transform, material: None, kind: ItemKind::Instance(1) });
        }
        d
    }

    #[test]
    fn copies_are_aimed_at_as_long_as_there_is_room() {
        let d = ring();
        let world = World::<f64>::compile(&d, Preset::Balanced).unwrap();
        let looks = Looks::new(&d);
        for (room, copies) in [(0, 0), (1, 0), (2, 1), (5, 2), (6, 3), (MOST_COPIED, 3)] {
            let surfaces = Surfaces::with_room(&world, &looks, room);
            assert_eq!((surfaces.emitters(&world).len(), surfaces.left_out), (2 + 2 * copies, 6 - 2 * copies as u64));
            let numbers = surfaces.first.iter().filter(|&&first| first != u32::MAX).copied();
            assert!(numbers.eq((0..=copies as u32).map(|copy| 2 * copy)), "{room}: {:?}", surfaces.first);
        }
        assert_eq!(unaimed(&world, &d), 0);
    }

    /// Light is neither lost nor counted twice where only some of its sources are aimed at.
    #[test]
    fn what_is_not_aimed_at_is_found_by_chance() {
        let d = ring();
        let world = World::<f64>::compile(&d, Preset::Balanced).unwrap();
        let looks = Arc::new(Looks::new(&d));
        let settings = Settings {
            integrator: Integrator::Path,
            depth: 1,
            ao_samples: 1,
            ao_radius: 1.0,
            seed: 3,
            cost: false,
            first_hits: false,
            count: false,
            rays: 1,
        };
        // All rays meet the origin, each with the random numbers of its own pixel and sample.
        let passes = Passes::new(&Tiling::new(32, 32, 32).unwrap(), 16);
        let mut rays = Rays::new(passes.rays());
        for i in 0..passes.rays() {
            rays.set(i, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 0.0, f64::INFINITY);
        }
        // Spheres above the horizon shine as if from their centres, which are 45 degrees up.
        let irradiance = 8.0 * PI * 3.0 * (0.4 / DISTANCE).powi(2) * f64::sqrt(0.5);
        let want = 0.5 / PI * irradiance;
        for room in [0, 2, 6] {
            let mut paths = Paths::new(&world, &d, looks.clone(), engine::<f64>("scalar").unwrap(), &settings);
            paths.lights = Lights::of(Surfaces::with_room(&world, &looks, room), &world, &d, &looks);
            let (mut work, mut out) = (Workspace::default(), Samples::default());
            out.open(passes.rays(), false);
            paths.shade(&rays, Spots::Tile { corner: (0, 0), passes, first: 0 }, &mut work, &mut out);
            let mean = (0..passes.rays()).map(|i| out.colors.get(i).radiance.x).sum::<f64>() / passes.rays() as f64;
            assert!((mean / want - 1.0).abs() < 0.05, "{room}: {mean}, want {want}");
        }
    }
}
