//! The crate `bvh`: a binary tree of single triangles, built by binned SAH on all threads.
//!
//! Source: the crate `bvh` 0.13 (github.com/svenstaro/bvh, 2016 to 2026). Two of its iterators are run, each a mode. `nearest`
//! gives leaves in the order in which their boxes begin, from a heap; it ends when a box begins beyond the hit. `segment`
//! walks the tree left child first and takes boxes that meet the rest of the segment. (The third sorts children but cannot be
//! told what has been hit, and its flat tree lists all leaves on the ray: both have more to do.) The crate's triangle
//! test sees front faces only, so Moeller and Trumbore's test is written out here. Triangles are stored in leaf order.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

use ::bvh::aabb::{Aabb, Bounded, IntersectsAabb};
use ::bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use ::bvh::bvh::{Bvh, BvhNode};
use ::bvh::ray::Ray;

use super::singles::{Found, Single, Singles};
use super::triangles::Triangles;
use super::{Facts, Peer};

/// Family.
pub const NAME: &str = "bvh";

/// Entries of the stack that the crate's `traverse_iterator` has; it panics when they are used up.
const STACK: usize = 32;

/// Builds its tree and returns its modes; `segment` is missing where the tree is too deep for its stack.
///
/// # Errors
/// Why it cannot have these triangles.
pub fn build(triangles: &Triangles) -> Result<Vec<Box<dyn Peer<f32>>>, String> {
    // Its builder panics on some extreme inputs; a peer must not take the bench down.
    std::panic::catch_unwind(|| modes(triangles)).map_err(|_| "its builder panicked on this scene".into())
}

fn modes(triangles: &Triangles) -> Vec<Box<dyn Peer<f32>>> {
    let start = Instant::now();
    let count = triangles.indices.len();
    let mut shapes: Vec<Shape> = (0..count).map(|i| Shape::new(triangles.corners(i), i as u32)).collect();
    let mut tree = Bvh::build_par(&mut shapes);
    let order = into_leaf_order(&mut tree, &mut shapes);
    let build_seconds = start.elapsed().as_secs_f64();
    let bytes = (size_of_val(&tree.nodes[..]) + size_of_val(&shapes[..])) as u64;
    let ids: Vec<[u32; 2]> = order.iter().map(|&i| triangles.ids[i as usize]).collect();
    let facts = |mode| Facts {
        name: NAME,
        mode,
        description: format!("bvh 0.13, binned SAH, {mode} iterator, Moeller-Trumbore, single rays"),
        build_seconds,
        bytes,
    };
    let mut peers: Vec<Box<dyn Peer<f32>>> = Vec::new();
    let shallow = stack_need(&tree) <= STACK;
    let scene = Arc::new(Scene { tree, shapes });
    if shallow {
        let tracer = Segments(scene.clone());
        peers.push(Box::new(Singles { facts: facts("segment"), tracer, ids: ids.clone() }));
    }
    peers.push(Box::new(Singles { facts: facts("nearest"), tracer: Nearest(scene), ids }));
    peers
}

/// A triangle as its test wants it: a corner and two edges, with its box; a cache line.
#[derive(Clone)]
struct Shape {
    corner: [f32; 3],
    edges: [[f32; 3]; 2],
    bounds: Aabb<f32, 3>,
    slot: u32,
}

impl Shape {
    fn new(corners: [[f32; 4]; 3], slot: u32) -> Self {
        let [a, b, c] = corners.map(|[x, y, z, _]| [x, y, z]);
        let extreme = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
            std::array::from_fn(|axis| pick(pick(a[axis], b[axis]), c[axis]))
        };
        let bounds = Aabb::with_bounds(extreme(f32::min).into(), extreme(f32::max).into());
        Self { corner: a, edges: [minus(b, a), minus(c, a)], bounds, slot }
    }

    /// t, u and v of the hit, if it is in the segment. Source: T. Moeller, B. Trumbore, "Fast, Minimum Storage Ray/Triangle
    /// Intersection", 1997.
    #[inline]
    fn hit(&self, Segment { ray, dir, t_min, end }: &Segment) -> Option<[f32; 3]> {
        let [ab, ac] = self.edges;
        let across = cross(*dir, ac);
        let inverse = 1.0 / dot(ab, across);
        let from = minus(ray.origin.into(), self.corner);
        let u = dot(from, across) * inverse;
        let along = cross(from, ab);
        let v = dot(*dir, along) * inverse;
        let t = dot(ac, along) * inverse;
        // A ray in the triangle's plane divides by zero: infinities and NaN fail one of these.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= *t_min && t <= end.get()).then_some([t, u, v])
    }
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

/// The builder tells each shape its leaf, which only its incremental updates want back.
impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, _: usize) {}

    fn bh_node_index(&self) -> usize {
        0
    }
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Stores shapes in the order of the leaves; returns the former number of each.
fn into_leaf_order(tree: &mut Bvh<f32, 3>, shapes: &mut Vec<Shape>) -> Vec<u32> {
    let mut stored = Vec::with_capacity(shapes.len());
    for node in &mut tree.nodes {
        if let BvhNode::Leaf { shape_index, .. } = node {
            stored.push(shapes[*shape_index].clone());
            *shape_index = stored.len() - 1;
        }
    }
    let order = stored.iter().map(|shape| shape.slot).collect();
    stored.iter_mut().zip(0..).for_each(|(shape, slot)| shape.slot = slot);
    *shapes = stored;
    order
}

/// Most entries that the crate's depth-first iterator stacks: an inner node stays while its left subtree is walked and is
/// gone when its right one is.
fn stack_need(tree: &Bvh<f32, 3>) -> usize {
    let mut needs = vec![1; tree.nodes.len()];
    // Children come after their parents.
    for i in (0..tree.nodes.len()).rev() {
        if let BvhNode::Node { child_l_index, child_r_index, .. } = tree.nodes[i] {
            needs[i] = usize::max(1 + needs[child_l_index], needs[child_r_index]);
        }
    }
    needs.first().copied().unwrap_or(0)
}

/// A ray and what is left of its segment.
struct Segment {
    ray: Ray<f32, 3>,
    dir: [f32; 3],
    t_min: f32,
    end: Cell<f32>,
}

impl Segment {
    fn new(org: [f32; 3], dir: [f32; 3], t_min: f32, t_max: f32) -> Self {
        // Its constructor would make the direction a unit vector, and t another number than ours.
        let ray = Ray { origin: org.into(), direction: dir.into(), inv_direction: dir.map(|x| 1.0 / x).into() };
        Self { ray, dir, t_min, end: Cell::new(t_max) }
    }

    /// A copy to be shortened by hits.
    fn fresh(&self) -> Self {
        Self { end: self.end.clone(), ..*self }
    }
}

/// The crate's own box test, which gives the part of the ray inside, within the segment.
impl IntersectsAabb<f32, 3> for Segment {
    fn intersects_aabb(&self, aabb: &Aabb<f32, 3>) -> bool {
        let inside = self.ray.intersection_slice_for_aabb(aabb);
        inside.is_some_and(|(enter, leave)| enter <= self.end.get() && leave >= self.t_min)
    }
}

struct Scene {
    tree: Bvh<f32, 3>,
    shapes: Vec<Shape>,
}

/// Tests the triangles of `leaves`, all or up to the first hit.
#[inline]
fn search<'a>(leaves: impl Iterator<Item = &'a Shape>, segment: &Segment, any: bool) -> Option<Found> {
    let mut best = None;
    for shape in leaves {
        if let Some(hit) = shape.hit(segment) {
            segment.end.set(hit[0]);
            best = Some((shape.slot, hit));
            if any {
                break;
            }
        }
    }
    best
}

/// Mode `segment`.
struct Segments(Arc<Scene>);

impl Segments {
    fn first(&self, segment: &Segment, any: bool) -> Option<Found> {
        let (segment, Scene { tree, shapes }) = (segment.fresh(), &*self.0);
        search(tree.traverse_iterator(&segment, shapes), &segment, any)
    }
}

/// Mode `nearest`.
struct Nearest(Arc<Scene>);

impl Nearest {
    fn first(&self, segment: &Segment, any: bool) -> Option<Found> {
        let (segment, Scene { tree, shapes }) = (segment.fresh(), &*self.0);
        let leaves = tree.nearest_traverse_iterator(&segment.ray, shapes);
        let begins = |shape: &Shape| segment.ray.intersection_slice_for_aabb(&shape.bounds).map(|(enter, _)| enter);
        let near = leaves.take_while(|shape| begins(shape).is_none_or(|enter| enter <= segment.end.get()));
        search(near, &segment, any)
    }
}

macro_rules! single {
    ($mode:ty) => {
        impl Single for $mode {
            type Ray = Segment;

            fn ray(org: [f32; 3], dir: [f32; 3], t_min: f32, t_max: f32) -> Segment {
                Segment::new(org, dir, t_min, t_max)
            }

            fn closest(&self, ray: &Segment) -> Option<Found> {
                self.first(ray, false)
            }

            fn occluded(&self, ray: &Segment) -> bool {
                self.first(ray, true).is_some()
            }
        }
    };
}

single!(Segments);
single!(Nearest);

#[cfg(test)]
mod tests {
    use super::*;

    fn small(x: f32) -> [[f32; 4]; 3] {
        [[x, 0.0, 0.0, 0.0], [x + 0.5, 0.0, 0.0, 0.0], [x, 0.5, 0.0, 0.0]]
    }

    /// Right chains need no stack beyond two entries, left chains one entry a level.
    #[test]
    fn the_stack_is_counted() {
        let chain = |left: bool| {
            let nodes = (0..41).map(|i| match i % 2 {
                0 if i < 40 => BvhNode::Node {
                    parent_index: 0,
                    child_l_index: if left { i + 2 } else { i + 1 },
                    child_l_aabb: Aabb::empty(),
                    child_r_index: if left { i + 1 } else { i + 2 },
                    child_r_aabb: Aabb::empty(),
                },
                _ => BvhNode::Leaf { parent_index: 0, shape_index: 0 },
            });
            stack_need(&Bvh { nodes: nodes.collect() })
        };
        assert_eq!((chain(true), chain(false)), (21, 2));
    }

    /// Distances that double make a chain deeper than the stack: the mode that would panic is not offered, the other works.
    #[test]
    fn a_tree_too_deep_for_the_stack_is_not_given_to_it() {
        let mut scene = Triangles::default();
        for i in 0..100u32 {
            let x = 1e-10 * 1.9f32.powi(i as i32);
            scene.vertices.extend(small(0.0).map(|[u, v, ..]| [x * (1.0 + 0.2 * u), x * v, 0.0, 0.0]));
            scene.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
            scene.ids.push([i, 0]);
        }
        let peers = build(&scene).unwrap();
        let modes: Vec<&str> = peers.iter().map(|peer| peer.facts().mode).collect();
        assert_eq!(modes, ["nearest"]);
    }

    /// (0.125, 0.25) lies in a triangle with legs of 0.5: u = 0.25, v = 0.5; both sides count, and the ends of the segment.
    #[test]
    fn a_triangle_by_hand() {
        let shape = Shape::new(small(0.0), 0);
        for z in [-2.0, 2.0] {
            let segment = |t_min, t_max| Segment::new([0.125, 0.25, z], [0.0, 0.0, -0.5 * z], t_min, t_max);
            assert_eq!(shape.hit(&segment(0.0, 9.0)), Some([2.0, 0.25, 0.5]));
            assert_eq!(shape.hit(&segment(2.0, 2.0)), Some([2.0, 0.25, 0.5]));
            assert_eq!(shape.hit(&segment(2.1, 9.0)), None);
            assert_eq!(shape.hit(&segment(0.0, 1.9)), None);
        }
        assert_eq!(shape.hit(&Segment::new([-1.0, 0.1, 0.0], [1.0, 0.0, 0.0], 0.0, 9.0)), None, "in its plane");
    }
}
