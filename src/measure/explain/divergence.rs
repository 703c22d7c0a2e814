//! How long the rays of a packet stay together on their way down the tree.
//!
//! A ray goes into the boxes that its segment meets, up to its hit: what it would visit if it knew its hit beforehand. That is a
//! property of the rays and the tree alone, the same for every engine with packets of the same size; the lanes that an
//! engine has in use also fall when rays find their hits one after the other.

use std::rc::Rc;

use crate::bvh::Tree;
use crate::lanes::Real;
use crate::ray::slab::Interval;
use crate::ray::{Packet, Rays};
use crate::scene::world::World;

/// A ray with the ends of its segment.
#[derive(Clone, Copy)]
struct Way<S: Real> {
    ray: Packet<S>,
    end: S,
}

impl<S: Real> Way<S> {
    fn meets(&self, lo: [S; 3], hi: [S; 3]) -> bool {
        Interval::of(&self.ray, lo, hi).meets(self.ray.t_min, self.end)
    }
}

/// Rays in the space of a tree.
type Ways<S> = Rc<[Way<S>]>;

/// What all rays go into.
enum Place<'a, S: Real> {
    /// A node of the tree of instances (`top`) or of an object.
    Node { tree: &'a Tree<S>, top: bool, node: u32, ways: Ways<S> },
    /// Instances that lie in one leaf.
    Instances { instances: &'a [u32], ways: Ways<S> },
}

/// The depth at which some, but not all live rays of `first..first + count` of a batch go into a child (children of the root
/// have depth 1; below instances it goes on); `None` if all stay together down to the leaves, or fewer than two rays are
/// live. `ends`: where the rays' segments end, at the hit or `t_max`.
pub fn depth<S: Real>(world: &World<S>, rays: &Rays<S>, ends: &[S], first: usize, count: usize) -> Option<u32> {
    let live = (first..rays.len().min(first + count)).filter(|&i| rays.is_live(i));
    let ways: Ways<S> = live.map(|i| Way { ray: Packet::<S>::load(rays, i).0, end: ends[i] }).collect();
    if ways.len() < 2 {
        return None;
    }
    let mut level = Vec::new();
    if world.is_single_object() {
        enter(world, 0, &ways, &mut level);
    } else {
        push(&world.top, true, &ways, &mut level);
        for &inst in &world.unbounded_instances {
            // They have no box that could part the rays.
            let _all_or_none = enter(world, inst, &ways, &mut level);
        }
    }
    let mut depth = 0;
    while !level.is_empty() {
        depth += 1;
        let mut below = Vec::new();
        if !level.iter().all(|place| descend(world, place, &mut below)) {
            return Some(depth);
        }
        level = below;
    }
    None
}

fn push<'a, S: Real>(tree: &'a Tree<S>, top: bool, ways: &Ways<S>, places: &mut Vec<Place<'a, S>>) {
    if !tree.nodes.is_empty() {
        places.push(Place::Node { tree, top, node: 0, ways: ways.clone() });
    }
}

/// Adds what all rays go into below `place`; false if only some go into something.
fn descend<'a, S: Real>(world: &'a World<S>, place: &Place<'a, S>, below: &mut Vec<Place<'a, S>>) -> bool {
    match place {
        Place::Instances { instances, ways } => instances.iter().all(|&inst| enter(world, inst, ways, below)),
        Place::Node { tree, top, node, ways } => {
            let node = &tree.nodes[*node as usize];
            for slot in 0..node.used as usize {
                let bounds = node.child_bounds(slot);
                let met = ways.iter().filter(|way| way.meets(bounds.lo, bounds.hi)).count();
                if met == 0 {
                    continue;
                }
                if met < ways.len() {
                    return false;
                }
                let (child, ways) = (node.child(slot), ways.clone());
                if !child.is_leaf() {
                    below.push(Place::Node { tree, top: *top, node: child.index, ways });
                } else if *top {
                    let at = child.index as usize;
                    let instances = &world.top_leaves[at..=at];
                    below.push(Place::Instances { instances, ways });
                }
            }
            true
        }
    }
}

/// Adds the tree of an instance's object if all rays go into it; false if only some do.
fn enter<'a, S: Real>(world: &'a World<S>, inst: u32, ways: &Ways<S>, places: &mut Vec<Place<'a, S>>) -> bool {
    let instance = &world.instances[inst as usize];
    let tree = &world.objects[instance.object as usize].tree;
    if instance.identity {
        push(tree, false, ways, places);
        return true;
    }
    let (lo, hi) = (instance.bounds.lo, instance.bounds.hi);
    let met = ways.iter().filter(|way| way.meets(lo, hi)).count();
    if met == ways.len() {
        let local = |way: &Way<S>| {
            let ray = way.ray.into_local(&instance.to_local, Interval::of(&way.ray, lo, hi).near);
            Way { ray, end: way.end }
        };
        push(tree, false, &ways.iter().map(local).collect(), places);
    }
    met == 0 || met == ways.len()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::scene::description::{Description, Item, ItemKind};
    use crate::scene::mesh::Mesh;
    use crate::scene::world::Preset;

    /// A row of `count` triangles along x, at 0, 1, 2, ..., in the plane z = 0.
    fn row(count: u32) -> World<f32> {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let corner = DVec3::new(f64::from(i), 0.0, 0.0);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([corner, corner + 0.5 * DVec3::X, corner + 0.5 * DVec3::Y]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let mut scene = Description::new("row");
        scene.meshes = vec![Arc::new(mesh)];
        scene.groups[0].items = vec![Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) }];
        World::compile(&scene, Preset::Best).unwrap()
    }

    /// Rays down onto the row at these x, and their ends.
    fn rays(places: &[f32]) -> (Rays<f32>, Vec<f32>) {
        let mut rays = Rays::new(places.len());
        for (i, &x) in places.iter().enumerate() {
            rays.set(i, [x, 0.1, 1.0], [0.0, 0.0, -1.0], 0.0, f32::INFINITY);
        }
        (rays, vec![f32::INFINITY; places.len()])
    }

    /// The depth of the leaf that holds the triangle at `x`, root 0, by the tree itself.
    fn leaf_depth(world: &World<f32>, x: f32) -> u32 {
        let (tree, mut node, mut depth) = (&world.objects[0].tree, 0, 1);
        loop {
            let at = &tree.nodes[node];
            let holds = |slot: &usize| {
                let bounds = at.child_bounds(*slot);
                bounds.lo[0] <= x && x <= bounds.hi[0]
            };
            let child = at.child((0..at.used as usize).find(holds).unwrap());
            if child.is_leaf() {
                return depth;
            }
            (node, depth) = (child.index as usize, depth + 1);
        }
    }

    #[test]
    fn rays_part_where_their_triangles_do() {
        let world = row(4096);
        let depth = |places: &[f32]| {
            let (rays, ends) = rays(places);
            depth(&world, &rays, &ends, 0, places.len())
        };
        // The two ends of the row lie in different children of the root.
        assert_eq!(depth(&[0.1, 4095.1]), Some(1));
        // Rays on one triangle never part, nor do rays that miss everything.
        assert_eq!(depth(&[7.1, 7.11, 7.12]), None);
        assert_eq!(depth(&[-5.0, -6.0]), None);
        assert_eq!(depth(&[7.1]), None, "one ray has nobody to part from");
        // Somewhere in the row are neighbours that part at every depth there is.
        let found: std::collections::BTreeSet<u32> =
            (0..4095).filter_map(|i| depth(&[i as f32 + 0.1, i as f32 + 1.1])).collect();
        let deepest = (0..4096).map(|i| leaf_depth(&world, i as f32 + 0.1)).max().unwrap();
        assert_eq!(found.first(), Some(&1));
        assert!(found.last().is_some_and(|last| *last <= deepest && deepest > 2), "{found:?} {deepest}");
    }

    /// A segment that ends before the row goes into nothing.
    #[test]
    fn rays_end_at_their_hits() {
        let world = row(64);
        let (rays, mut ends) = rays(&[0.1, 63.1]);
        assert_eq!(depth(&world, &rays, &ends, 0, 2), Some(1));
        ends.fill(0.5);
        assert_eq!(depth(&world, &rays, &ends, 0, 2), None);
        ends[0] = 2.0;
        assert_eq!(depth(&world, &rays, &ends, 0, 2), Some(1), "one of two goes on");
    }
}
