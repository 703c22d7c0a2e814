//! Instances: their maps, their boxes in the world, the tree over them.
//!
//! A turned box is larger than what is in it: for a round crown turned by an eighth, the box of its turned box has twice the floor
//! that it needs. So an instance's box is not that of its object's box, but that of some dozens of smaller ones which together
//! hold the object, taken from the upper nodes of its tree: rays enter fewer instances in vain.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::{Instance, Object};
use crate::bvh::{self, BuildSettings, Leaf, Preset, Tree};
use crate::lanes::Real;
use crate::math::{Aabb, Affine};
use crate::scene::assembly::Placement;

/// Most boxes that stand for an object.
const MOST_BOXES: usize = 128;

/// Boxes that hold all of an object, as centres and half sizes in its space.
struct Cover(Vec<[DVec3; 2]>);

impl Cover {
    /// Of an object with bounds.
    fn of<S: Real>(object: &Object<S>) -> Self {
        let nodes = &object.tree.nodes;
        let children = |node: usize| {
            let node = &nodes[node];
            (0..node.used as usize).map(|slot| (node.child_bounds(slot), node.child(slot)))
        };
        let mut open: Vec<_> = if nodes.is_empty() { Vec::new() } else { children(0).collect() };
        let mut boxes = Vec::new();
        // The largest one is opened as long as there is room for what it holds.
        while !open.is_empty() {
            let area = |i: &usize| open[*i].0.half_area();
            let largest = (0..open.len()).max_by(|a, b| area(a).total_cmp(&area(b))).unwrap_or(0);
            let (bounds, child) = open.swap_remove(largest);
            if child.is_leaf() || boxes.len() + open.len() + bvh::WIDTH > MOST_BOXES {
                boxes.push(bounds);
            } else {
                open.extend(children(child.index as usize));
            }
        }
        // Halves first: sums of the largest numbers would be infinite.
        let halves = |(lo, hi): (DVec3, DVec3)| [0.5 * lo + 0.5 * hi, 0.5 * hi - 0.5 * lo];
        Self(boxes.iter().map(Aabb::to_f64).map(halves).collect())
    }

    /// The box of its image.
    fn image(&self, m: &DAffine3) -> (DVec3, DVec3) {
        let size = m.matrix3.abs();
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = self.0.iter().fold(none, |(lo, hi), [centre, half]| {
            let (centre, half) = (m.matrix3 * *centre, size * *half);
            (lo.min(centre - half), hi.max(centre + half))
        });
        (lo + m.translation, hi + m.translation)
    }
}

/// The instances of some placements.
pub fn all<S: Real>(placements: &[Placement], objects: &[Object<S>]) -> Vec<Instance<S>> {
    let covers: Vec<Cover> = objects.par_iter().map(Cover::of).collect();
    let one = |placement: &Placement| instance(placement, objects, &covers);
    placements.par_iter().with_min_len(256).map(one).collect()
}

fn instance<S: Real>(placement: &Placement, objects: &[Object<S>], covers: &[Cover]) -> Instance<S> {
    let bounds = objects[placement.object as usize].bounds();
    let m = &placement.to_world;
    let identity = *m == DAffine3::IDENTITY;
    let to_local = Affine::from_f64(&m.inverse());
    let world = if identity || bounds.is_empty() {
        bounds
    } else if bounds.is_bounded() {
        let (lo, hi) = covers[placement.object as usize].image(m);
        // The map's rounding moves a hit by some ulps of the numbers that are added up on the way.
        let (least, most) = bounds.to_f64();
        let reach = m.matrix3.abs() * least.abs().max(most.abs());
        let size = reach.max(m.translation.abs()).max_element();
        let slack = DVec3::splat(32.0 * S::EPSILON.to_f64() * size);
        Aabb::enclosing(lo - slack, hi + slack)
    } else {
        Aabb::EVERYTHING
    };
    Instance { object: placement.object, identity, to_local, bounds: world }
}

/// Tree over boxes of instances, the instances of its leaves, instances without a box.
type UpperTree<S> = (Tree<S>, Vec<u32>, Vec<u32>);

/// The tree over `instances`.
pub fn upper_tree<S: Real>(instances: &[Instance<S>], preset: Preset) -> UpperTree<S> {
    let bounded = |i: &u32| instances[*i as usize].bounds.is_bounded();
    let present = (0..instances.len() as u32).filter(|&i| !instances[i as usize].bounds.is_empty());
    let (ids, unbounded): (Vec<u32>, Vec<u32>) = present.partition(bounded);
    if let [only] = instances
        && only.identity
    {
        return (Tree::empty(), Vec::new(), unbounded);
    }
    let boxes: Vec<_> = ids.iter().map(|&i| instances[i as usize].bounds).collect();
    // To enter an instance costs more than to open a node: each has a box of its own among eight.
    let (tree, leaves) = bvh::build(&boxes, &vec![0; boxes.len()], BuildSettings { preset, leaf: 1 });
    let leaves = leaves.iter().flat_map(Leaf::prims).map(|&p| ids[p as usize]).collect();
    (tree, leaves, unbounded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, transformed_bounds};
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::World;
    use glam::{DMat3, DQuat};

    /// Of what is large in the forest that which stands there most often: a tree.
    fn tree() -> Object<f32> {
        let description = load("builtin:forest", &LoadOptions::default()).unwrap();
        let mut world = World::<f32>::compile(&description, Preset::Fast).unwrap();
        let placed = |object: &usize| world.instances.iter().filter(|i| i.object as usize == *object).count();
        let large = |object: &usize| world.objects[*object].tree.nodes.len() > 8;
        let most = (0..world.objects.len()).filter(large).max_by_key(placed).unwrap();
        world.objects.swap_remove(most)
    }

    /// The boxes of an object's leaves.
    fn leaves(object: &Object<f32>) -> Vec<(DVec3, DVec3)> {
        let nodes = object.tree.nodes.iter();
        let of = |node: &bvh::Node<f32>| {
            let slots = (0..node.used as usize).filter(|&slot| node.child(slot).is_leaf());
            slots.map(|slot| node.child_bounds(slot).to_f64()).collect::<Vec<_>>()
        };
        nodes.flat_map(of).collect()
    }

    #[test]
    fn boxes_hold_what_is_placed_and_are_tighter_than_the_turned_box() {
        let mut r = Random(7);
        let object = tree();
        let (lo, hi) = object.bounds().to_f64();
        let cover = Cover::of(&object);
        assert!((bvh::WIDTH + 1..=MOST_BOXES).contains(&cover.0.len()), "{} boxes", cover.0.len());
        let (mut loose, mut tight) = (0.0, 0.0);
        for _ in 0..50 {
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 3.0 * r.unit(), 3.0 * r.unit(), 3.0 * r.unit());
            let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.4 * r.unit(), 1.0, 0.0), DVec3::new(0.0, 0.2, -2.0));
            let to_world = DAffine3 { matrix3: DMat3::from_quat(turn) * shear, translation: r.cube() * 100.0 };
            let [placed] = &all(&[Placement { object: 0, to_world }], std::slice::from_ref(&object))[..] else {
                panic!("one instance");
            };
            let (low, high) = placed.bounds.to_f64();
            for (lo, hi) in leaves(&object) {
                let (lo, hi) = transformed_bounds(&to_world, lo, hi);
                // The image of a leaf's box may be larger than that of the leaf; its middle is within in any case.
                let middle = 0.5 * (lo + hi);
                assert!(middle.cmpge(low).all() && middle.cmple(high).all());
            }
            for [centre, half] in &cover.0 {
                let (lo, hi) = transformed_bounds(&to_world, *centre - *half, *centre + *half);
                assert!(lo.cmpge(low).all() && hi.cmple(high).all());
            }
            let (whole_lo, whole_hi) = transformed_bounds(&to_world, lo, hi);
            let volume = |size: DVec3| size.x * size.y * size.z;
            (loose, tight) = (loose + volume(whole_hi - whole_lo), tight + volume(high - low));
        }
        assert!(tight < 0.9 * loose, "{tight} of {loose}");
    }

    #[test]
    fn covers_hold_every_leaf() {
        let object = tree();
        let cover = Cover::of(&object);
        for (lo, hi) in leaves(&object) {
            let holds = |[centre, half]: &[DVec3; 2]| {
                lo.cmpge(*centre - *half - 1e-9).all() && hi.cmple(*centre + *half + 1e-9).all()
            };
            assert!(cover.0.iter().any(holds), "{lo} to {hi}");
        }
    }
}
