//! Placements traced as one object: meshes that a file places once, and tiny ones.
//!
//! Formats like glTF place every mesh by a node. To engines an instance is work: the ray, or the tile, goes through its map, and
//! the instance's tree begins anew where that of its neighbours knows nothing of it. So what is placed once goes into one tree, in
//! world space, where the map costs its corners no digits that tell; and so do meshes no larger than a leaf, however often they are
//! placed: each would be a tree without a node. Hits keep the assembly's numbers: [`Names`]. Of equal hits the one with the smaller
//! number wins, as everywhere; but against what stays an instance all that is joined counts as the first of it.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::names::{self, Names};
use crate::scene::assembly::{Assembly, AssemblyObject, Part, PartKind, Placement};
use crate::shape::BLOCK;

/// Most triangles of copies of what is placed more than once: no file is to ask for more memory by that than its size explains.
const MOST_COPIED: u64 = 1 << 22;

/// Rounding to world space may move corners by this part of what is between them.
const TOLERANCE: f64 = 1.0 / 256.0;

/// Coordinates up to which squares and products of them are normal numbers in f32, and how fine meshes may be for the same.
const LARGEST: f64 = (1u64 << 40) as f64;

/// Where a mesh is, in its own space, and how fine.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Middle and half size of its box.
    middle: DVec3,
    half: DVec3,
    /// Largest coordinates.
    size: DVec3,
    /// Smallest height of a triangle: the mean of it over triangles, as factors go.
    height: f64,
}

impl Extent {
    /// Of an object's triangles, corners that are not finite left out; `None` if it is not of meshes only, or has none.
    fn of(object: &AssemblyObject) -> Option<Self> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut sum, mut count) = (0.0, 0.0);
        for part in &object.parts {
            let PartKind::Mesh(mesh) = &part.kind else { return None };
            for i in 0..mesh.triangles.len() {
                let corners = mesh.corners(i).map(|p| part.to_object.transform_point3(p));
                for point in corners.into_iter().filter(|p| p.is_finite()) {
                    (low, high) = (low.min(point), high.max(point));
                }
                let height = smallest_height(corners);
                if height > 0.0 && height.is_finite() {
                    (sum, count) = (sum + height.log2(), count + 1.0);
                }
            }
        }
        let size = low.abs().max(high.abs());
        let (middle, half) = (0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low);
        (low.is_finite() && count > 0.0).then(|| Self { middle, half, size, height: (sum / count).exp2() })
    }

    /// Whether corners rounded after `map`, relatively by `epsilon`, are where they were as far as their neighbours can tell, or
    /// no worse off than before it.
    fn bears(&self, map: &DAffine3, epsilon: f64) -> bool {
        if *map == DAffine3::IDENTITY {
            return true;
        }
        let m = map.matrix3.abs();
        let reach = (map.transform_point3(self.middle).abs() + m * self.half).max_element();
        let height = self.height / (map.matrix3.inverse().abs() * DVec3::ONE).max_element();
        let is_ordinary = reach <= LARGEST && height >= 1.0 / LARGEST;
        is_ordinary && (epsilon * reach <= TOLERANCE * height || reach <= 2.0 * (m * self.size).max_element())
    }
}

fn smallest_height([a, b, c]: [DVec3; 3]) -> f64 {
    let edges = [b - a, c - b, a - c].map(DVec3::length);
    (b - a).cross(c - a).length() / edges.into_iter().fold(0.0, f64::max)
}

/// What is traced in place of `assembly` in a precision of relative rounding `epsilon`, and the names of what is hit; `None` if that
/// is the assembly as it is.
pub fn join(assembly: &Assembly, epsilon: f64) -> Option<(Assembly, Names)> {
    let chosen = choose(assembly, epsilon, MOST_COPIED);
    let is_joined = |placement: &Placement| chosen[placement.object as usize];
    let count = assembly.placements.iter().filter(|p| is_joined(p)).count();
    // One among others is an instance as good as any.
    if count == 0 || count == 1 && (assembly.placements.len() > 1 || assembly.placements[0].stands()) {
        return None;
    }
    let mut traced = Assembly::default();
    let (mut one, mut parts) = (AssemblyObject { name: "joined meshes".into(), ..Default::default() }, Vec::new());
    let (mut insts, mut at) = (Vec::new(), None);
    let mut kept = vec![None; assembly.objects.len()];
    for (number, placement) in (0..).zip(&assembly.placements) {
        let object = &assembly.objects[placement.object as usize];
        if is_joined(placement) {
            at.get_or_insert_with(|| {
                traced.placements.push(Placement { object: 0, to_world: DAffine3::IDENTITY });
                insts.push(number);
                insts.len() as u32 - 1
            });
            let first = one.prim_count;
            one.add(object, &placement.to_world);
            parts.push(names::Part { first, end: one.prim_count, placement: number });
            continue;
        }
        // Number 0 is the joined one's.
        let object = *kept[placement.object as usize].get_or_insert_with(|| {
            traced.objects.push(object.clone());
            traced.objects.len() as u32
        });
        traced.placements.push(Placement { object, to_world: placement.to_world });
        insts.push(number);
    }
    let names = Names::new(insts, at.unwrap_or(0), parts);
    traced.objects.insert(0, one);
    Some((traced, names))
}

impl AssemblyObject {
    /// Adds the parts of another one, mapped.
    fn add(&mut self, other: &Self, map: &DAffine3) {
        let first = self.prim_count;
        self.parts.extend(other.parts.iter().map(|part| Part {
            first_prim: first + part.first_prim,
            to_object: *map * part.to_object,
            ..part.clone()
        }));
        self.prim_count += other.prim_count;
    }
}

/// By object: whether it is joined, wherever it is placed. `room`: most triangles of copies.
fn choose(assembly: &Assembly, epsilon: f64, mut room: u64) -> Vec<bool> {
    let extents: Vec<_> = assembly.objects.par_iter().map(Extent::of).collect();
    let mut placed = vec![0u64; extents.len()];
    let mut bears = vec![true; extents.len()];
    for Placement { object, to_world } in &assembly.placements {
        let object = *object as usize;
        placed[object] += 1;
        bears[object] &= extents[object].is_some_and(|extent| extent.bears(to_world, epsilon));
    }
    let mut numbers = u64::from(u32::MAX) - 1;
    let mut chosen = vec![false; extents.len()];
    for (i, object) in assembly.objects.iter().enumerate() {
        let (times, count) = (placed[i], u64::from(object.prim_count));
        let (all, copied) = (times * count, if times > 1 { times * count } else { 0 });
        let is_small = times == 1 || times > 1 && count <= BLOCK as u64;
        if bears[i] && is_small && all < numbers && copied <= room {
            (numbers, room) = (numbers - all, room - copied);
            chosen[i] = true;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::mesh::Mesh;

    /// Rounding of f32.
    const SINGLE: f64 = 1.0 / (1u64 << 24) as f64;

    /// A strip of `triangles` triangles in the unit square.
    fn object(triangles: u32) -> AssemblyObject {
        let mut mesh = Mesh::default();
        for i in 0..triangles + 2 {
            mesh.positions.push(DVec3::new(f64::from(i % 2), f64::from(i) / f64::from(triangles + 1), 0.0));
        }
        mesh.triangles = (0..triangles).map(|i| [i, i + 1, i + 2]).collect();
        let (to_object, kind) = (DAffine3::IDENTITY, PartKind::Mesh(Arc::new(mesh)));
        let part = Part { first_prim: 0, prim_count: triangles, to_object, material: None, kind };
        AssemblyObject { name: String::new(), parts: vec![part], prim_count: triangles }
    }

    /// Objects of so many triangles, and which of them is placed with which map.
    fn assembly(counts: &[u32], places: &[(u32, DAffine3)]) -> Assembly {
        let placements = places.iter().map(|&(object, to_world)| Placement { object, to_world }).collect();
        Assembly { objects: counts.iter().map(|&count| object(count)).collect(), placements }
    }

    fn at(x: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, 0.0, 0.0))
    }

    #[test]
    fn what_is_placed_once_is_one_object_in_the_world() {
        let source = assembly(&[3, 5, 900], &[(2, at(1.0)), (1, at(2.0)), (2, at(3.0)), (0, at(4.0))]);
        let (traced, names) = join(&source, SINGLE).unwrap();
        assert_eq!(traced.objects.iter().map(|o| o.prim_count).collect::<Vec<_>>(), [8, 900]);
        assert_eq!(traced.placements.iter().map(|p| p.object).collect::<Vec<_>>(), [1, 0, 1]);
        let parts: Vec<_> = traced.objects[0].parts.iter().map(|p| (p.first_prim, p.to_object)).collect();
        assert_eq!(parts, [(0, at(2.0)), (5, at(4.0))]);
        assert!(traced.placements[1].stands() && names.joined() == 2);
        let named: Vec<_> =
            [(899, 0), (0, 1), (4, 1), (5, 1), (7, 1), (0, 2)].map(|(prim, inst)| names.of(prim, inst)).into();
        assert_eq!(named, [[899, 0], [0, 1], [4, 1], [0, 3], [2, 3], [0, 2]]);
    }

    #[test]
    fn nothing_to_join() {
        assert!(join(&Assembly::default(), SINGLE).is_none());
        assert!(join(&assembly(&[7], &[(0, DAffine3::IDENTITY)]), SINGLE).is_none());
        assert!(join(&assembly(&[7], &[(0, at(1.0))]), SINGLE).is_some());
        assert!(join(&assembly(&[70, 9], &[(0, at(1.0)), (1, at(2.0)), (1, at(3.0))]), SINGLE).is_none());
        assert!(join(&assembly(&[100], &[(0, at(1.0)), (0, at(2.0))]), SINGLE).is_none(), "twice as much");
    }

    #[test]
    fn what_is_no_larger_than_a_leaf_is_copied() {
        let places = |object: u32, count: usize| (0..count).map(move |i| (object, at(i as f64)));
        let all: Vec<_> = places(0, 10).chain(places(1, 2)).chain(places(2, 2)).chain(places(3, 1)).collect();
        // The last one is never placed.
        let some = assembly(&[1, 8, 9, 1100, 8], &all);
        assert_eq!(choose(&some, SINGLE, 26), [true, true, false, true, false]);
        assert_eq!(choose(&some, SINGLE, 25), [true, false, false, true, false], "10 and 16 are more than 25");
    }

    /// What would lose its form in world space stays an instance; in f64 there is room.
    #[test]
    fn digits_are_kept() {
        let placed = |map: DAffine3| assembly(&[100, 100], &[(0, map), (1, at(0.5))]);
        let (far, scaled) = (|x: f64| placed(at(x)), |s: f64| placed(DAffine3::from_scale(DVec3::splat(s))));
        // Heights of about 1/50.
        assert_eq!(choose(&far(1e3), SINGLE, 99), [true, true]);
        assert_eq!(choose(&far(2e3), SINGLE, 99), [false, true]);
        assert_eq!(choose(&far(2e3), SINGLE * SINGLE, 99), [true, true]);
        // Size alone costs no digits, but numbers are to be such that products of them are.
        for (scale, joined) in [(1e-9, true), (1e-12, false), (1e9, true), (1e15, false)] {
            assert_eq!(choose(&scaled(scale), SINGLE, 99), [joined, true], "{scale}");
        }
        // As far off before its map: nothing is lost by that.
        let mut shifted = far(0.0);
        shifted.objects[0].parts[0].to_object = at(1e6);
        assert_eq!(choose(&shifted, SINGLE, 99), [true, true]);
        // A mesh with some corners that are not finite is joined, one without any other is not.
        let mut broken = far(1.0);
        let PartKind::Mesh(mesh) = &mut broken.objects[0].parts[0].kind else { panic!("a mesh") };
        Arc::make_mut(mesh).positions[0].x = f64::NAN;
        assert_eq!(choose(&broken, SINGLE, 99), [true, true]);
        let PartKind::Mesh(mesh) = &mut broken.objects[0].parts[0].kind else { panic!("a mesh") };
        Arc::make_mut(mesh).positions.fill(DVec3::INFINITY);
        assert_eq!(choose(&broken, SINGLE, 99), [false, true]);
    }
}
