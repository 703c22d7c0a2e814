//! Cryptomattes of a picture: what each pixel's samples met first, counted.
//!
//! Samples are placed with the density of the filter and count the same, so shares of them are coverages.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::aov::Aov;
use super::kept::Names;
use crate::camera::Passes;
use crate::error::locked;
use crate::film::{Film, Plane, PlaneData, Window, cryptomatte};
use crate::lanes::Real;
use crate::ray::INVALID_ID;
use crate::scene::assembly::{Assembly, PartKind};
use crate::scene::description::{Description, Shape};
use crate::scene::world::World;
use crate::shade::FirstHit;

/// Layers: objects, materials.
const LAYERS: [&str; 2] = ["cryptoObject", "cryptoMaterial"];

/// A thing that may be in a pixel: instance, part of its object, group of the part's mesh; material, 0, 0.
type Thing = [u32; 3];

/// How many samples of a pixel met which things first, layer by layer.
#[derive(Clone, Debug, Default)]
pub(super) struct Coverage([Vec<(Thing, u32)>; 2]);

impl Coverage {
    /// Nothing.
    pub fn clear(&mut self) {
        self.0.iter_mut().for_each(Vec::clear);
    }
}

/// Names and planes of the mattes of a picture.
pub(super) struct Mattes<'a> {
    assembly: &'a Assembly,
    description: &'a Description,
    /// How many placements an object has.
    placed: Vec<u32>,
    /// First of the film's planes that are mattes.
    first_plane: usize,
    /// What was seen: names and ids, by layer.
    seen: Mutex<Names>,
}

/// Names of the planes of mattes, in the order of the film's.
pub(super) fn planes() -> impl Iterator<Item = String> {
    LAYERS.iter().flat_map(|layer| cryptomatte::planes(layer))
}

impl<'a> Mattes<'a> {
    /// Those of a picture of `world` with the planes `aovs`, if they are wanted; their planes are added to `film`.
    pub fn new<S: Real>(
        world: &'a World<S>,
        description: &'a Description,
        aovs: &[Aov],
        film: &mut Film,
    ) -> Option<Self> {
        if !aovs.contains(&Aov::Cryptomatte) {
            return None;
        }
        let assembly = &world.assembly;
        let mut placed = vec![0; assembly.objects.len()];
        assembly.placements.iter().for_each(|placement| placed[placement.object as usize] += 1);
        let (first_plane, pixels) = (film.planes.len(), film.pixels());
        let plane = |name| Plane { name, data: PlaneData::F32(vec![0.0; pixels]) };
        film.planes.extend(planes().map(plane));
        Some(Self { assembly, description, placed, first_plane, seen: Mutex::default() })
    }

    /// Counts what `passes` over the `pixels` pixels of a tile met into the coverages of the pixels; misses count for nothing.
    pub fn count(&self, passes: Passes, pixels: usize, hits: &[FirstHit], coverages: &mut Vec<Coverage>) {
        coverages.resize_with(pixels, Coverage::default);
        for (pixel, ray) in passes.runs().flat_map(|run| run.pixels.zip(run.rays)) {
            let (hit, coverage) = (&hits[ray], &mut coverages[pixel]);
            if hit.inst == INVALID_ID {
                continue;
            }
            for (thing, list) in [self.object(hit), [hit.material, 0, 0]].into_iter().zip(&mut coverage.0) {
                match list.iter_mut().find(|(known, _)| *known == thing) {
                    Some((_, count)) => *count += 1,
                    None => list.push((thing, 1)),
                }
            }
        }
    }

    fn object(&self, hit: &FirstHit) -> Thing {
        let object = &self.assembly.objects[self.assembly.placements[hit.inst as usize].object as usize];
        let part = object.parts.partition_point(|part| part.first_prim <= hit.prim).saturating_sub(1);
        let group = match &object.parts[part].kind {
            PartKind::Mesh(mesh) => {
                let triangle = hit.prim - object.parts[part].first_prim;
                mesh.groups.partition_point(|group| group.first <= triangle).saturating_sub(1)
            }
            PartKind::Shape(_) | PartKind::Solids(_) => 0,
        };
        [hit.inst, part as u32, group as u32]
    }

    /// What layer `layer` calls `thing`. Objects: group of the scene (of a scene file a `define`: a `group` there is no object, and its
    /// label is not kept), name or kind of the part; where the group is placed several times, the number of the instance after `@`.
    fn name(&self, layer: usize, [first, part, group]: Thing) -> String {
        if layer == 1 {
            return self.description.materials.get(first as usize).map_or("default".into(), |m| m.name.clone());
        }
        let number = self.assembly.placements[first as usize].object as usize;
        let object = &self.assembly.objects[number];
        let named = |name: &str, kind: &str| if name.is_empty() { format!("{kind} {part}") } else { name.to_owned() };
        let name = match &object.parts[part as usize].kind {
            PartKind::Mesh(mesh) => named(mesh.groups.get(group as usize).map_or("", |g| &g.name), "mesh"),
            PartKind::Solids(tree) => named(&tree.name, "solid"),
            PartKind::Shape(shape) => named("", kind(shape)),
        };
        let place = if self.placed[number] > 1 { format!("@{first}") } else { String::new() };
        let gap = if object.name.is_empty() { "" } else { "/" };
        format!("{}{gap}{name}{place}", object.name)
    }

    /// Writes the ranks of those of `pixels` that lie in `window` to `film`; each had `count` samples. Returns the names.
    pub fn paint(
        &self,
        film: &mut Film,
        window: Window,
        pixels: &[(u32, u32)],
        coverages: &[Coverage],
        count: u32,
    ) -> Names {
        let mut names: [BTreeMap<Thing, (String, u32)>; 2] = Default::default();
        for (&(x, y), coverage) in pixels.iter().zip(coverages) {
            let Some(place) = window.index(x, y) else { continue };
            for (layer, list) in coverage.0.iter().enumerate() {
                // Different things of one name are one.
                let mut shares: BTreeMap<u32, u32> = BTreeMap::new();
                for &(thing, samples) in list {
                    let name = || {
                        let name = self.name(layer, thing);
                        let id = cryptomatte::id(&name);
                        (name, id)
                    };
                    *shares.entry(names[layer].entry(thing).or_insert_with(name).1).or_default() += samples;
                }
                let mut ranks: Vec<(u32, u32)> = shares.into_iter().collect();
                ranks.sort_by_key(|&(id, samples)| (u32::MAX - samples, id));
                for (rank, &(id, samples)) in ranks.iter().take(cryptomatte::RANKS).enumerate() {
                    let plane = self.first_plane + 2 * (layer * cryptomatte::RANKS + rank);
                    let values = [f32::from_bits(id), (f64::from(samples) / f64::from(count)) as f32];
                    for (plane, value) in film.planes[plane..].iter_mut().zip(values) {
                        if let PlaneData::F32(data) = &mut plane.data {
                            data[place] = value;
                        }
                    }
                }
            }
        }
        let names = names.map(|found| found.into_values().collect());
        self.note(&names);
        names
    }

    /// Notes names that were seen.
    pub fn note(&self, names: &Names) {
        for (all, found) in locked(&self.seen).iter_mut().zip(names) {
            all.extend(found.iter().map(|(name, id)| (name.clone(), *id)));
        }
    }

    /// Adds the attributes that say what the ids mean to `film`.
    pub fn finish(self, film: &mut Film) {
        let seen = self.seen.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        for (layer, names) in LAYERS.iter().zip(&seen) {
            film.texts.extend(cryptomatte::attributes(layer, names));
        }
    }
}

fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere => "sphere",
        Shape::HalfSpace => "half-space",
        Shape::Disc => "disc",
        Shape::Cuboid => "box",
        Shape::Cylinder => "cylinder",
        Shape::Cone { .. } => "cone",
    }
}
