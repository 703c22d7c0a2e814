//! What the tree of the largest object is worth, in numbers.

use glam::DVec3;

use crate::bvh::{LEAF_PRIMS, Node};
use crate::camera::sampling::pcg4d;
use crate::lanes::Real;
use crate::scene::assembly::PartKind;
use crate::scene::world::{Class, Object, World};

/// Points on the surface that estimate the end-point overlap.
const POINTS: u32 = 20_000;

/// How far outside a box, relative to the object's size, a point counts as inside: boxes are rounded to the engine's precision.
const SLACK: f64 = 1e-6;

/// Figures of one tree.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Quality {
    /// The object's name; empty for the scene itself.
    pub object: String,
    /// Primitives in it.
    pub prims: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// See [`crate::bvh::Quality::sah_cost`].
    pub sah_cost: f64,
    /// End-point overlap: what a ray that ends on the surface pays for boxes it is in though its surface is not in them
    /// (1 per node and leaf, as in the SAH). `None` without triangles. T. Aila, T. Karras, S. Laine, "On Quality Metrics of
    /// Bounding Volume Hierarchies", 2013; estimated here from points spread evenly over the surface.
    pub end_point_overlap: Option<f64>,
    /// Leaves with 1, 2, ... 8 primitives.
    pub leaf_sizes: [u64; LEAF_PRIMS],
    /// Leaves by the number of inner nodes above them, from 1.
    pub leaf_depths: Vec<u64>,
    /// Children in use per node, on average (of 8).
    pub children_per_node: f64,
}

/// The figures of the object with most primitives; `None` if no object has a tree.
pub fn quality<S: Real>(world: &World<S>) -> Option<Quality> {
    let prims = |object: &Object<S>| object.tree.quality().prims;
    let index = (0..world.objects.len()).max_by_key(|&i| prims(&world.objects[i]))?;
    let object = &world.objects[index];
    if object.tree.nodes.is_empty() {
        return None;
    }
    let basic = object.tree.quality();
    let mut found = Quality {
        object: world.traced.objects[index].name.clone(),
        prims: basic.prims,
        nodes: basic.nodes,
        leaves: basic.leaves,
        sah_cost: basic.sah_cost,
        end_point_overlap: overlap(world, index),
        leaf_depths: vec![0; object.tree.depth as usize],
        ..Default::default()
    };
    let (mut stack, mut children) = (vec![(0u32, 0usize)], 0u64);
    while let Some((node, depth)) = stack.pop() {
        let node = &object.tree.nodes[node as usize];
        children += u64::from(node.used);
        for slot in 0..node.used as usize {
            let child = node.child(slot);
            if child.is_leaf() {
                found.leaf_sizes[usize::from(child.count) - 1] += 1;
                found.leaf_depths[depth] += 1;
            } else {
                stack.push((child.index, depth + 1));
            }
        }
    }
    found.children_per_node = children as f64 / basic.nodes as f64;
    Some(found)
}

/// Triangles of an object with the running sum of their areas.
struct Surface {
    corners: Vec<([DVec3; 3], u32)>,
    areas: Vec<f64>,
}

impl Surface {
    fn of<S: Real>(world: &World<S>, index: usize) -> Self {
        let (mut corners, mut areas, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for part in &world.traced.objects[index].parts {
            let PartKind::Mesh(mesh) = &part.kind else { continue };
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i).map(|p| part.to_object.transform_point3(p));
                let area = 0.5 * (b - a).cross(c - a).length();
                if area > 0.0 && area.is_finite() {
                    sum += area;
                    corners.push(([a, b, c], part.first_prim + i as u32));
                    areas.push(sum);
                }
            }
        }
        Self { corners, areas }
    }

    /// A point of an even spread over the surface and whose primitive it is on.
    fn point(&self, number: u32) -> Option<(DVec3, u32)> {
        let unit = |bits: u32| f64::from(bits) / 4_294_967_296.0;
        let [x, y, z, _] = pcg4d([number, 0x0e90, 1, 2]);
        let wanted = (f64::from(number) + unit(x)) / f64::from(POINTS) * self.areas.last()?;
        let ([a, b, c], prim) = *self.corners.get(self.areas.partition_point(|sum| *sum <= wanted))?;
        let root = unit(y).sqrt();
        let (u, v) = (root * (1.0 - unit(z)), root * unit(z));
        Some((a + u * (b - a) + v * (c - a), prim))
    }
}

fn overlap<S: Real>(world: &World<S>, index: usize) -> Option<f64> {
    let (object, surface) = (&world.objects[index], Surface::of(world, index));
    let (low, high) = object.tree.bounds.to_f64();
    let walk = Walk { object, slack: SLACK * (high - low).max_element() };
    let mut sum = 0.0;
    for number in 0..POINTS {
        let (point, prim) = surface.point(number)?;
        sum += walk.node(0, point, prim).0;
    }
    Some(sum / f64::from(POINTS))
}

struct Walk<'a, S> {
    object: &'a Object<S>,
    slack: f64,
}

impl<S: Real> Walk<'_, S> {
    /// Cost of the boxes below node `index` that hold `point` and not its primitive, and whether the node holds that.
    fn node(&self, index: u32, point: DVec3, prim: u32) -> (f64, bool) {
        let node = &self.object.tree.nodes[index as usize];
        let (mut cost, mut holds) = (0.0, false);
        for slot in (0..node.used as usize).filter(|&slot| self.inside(node, slot, point)) {
            let child = node.child(slot);
            let (below, held) = if child.is_leaf() {
                (0.0, self.leaf_holds(child.class, child.index, prim))
            } else {
                self.node(child.index, point, prim)
            };
            cost += below + if held { 0.0 } else { 1.0 };
            holds |= held;
        }
        (cost, holds)
    }

    fn inside(&self, node: &Node<S>, slot: usize, point: DVec3) -> bool {
        let (low, high) = node.child_bounds(slot).to_f64();
        (low - self.slack).cmple(point).all() && point.cmple(high + self.slack).all()
    }

    fn leaf_holds(&self, class: u8, block: u32, prim: u32) -> bool {
        class == Class::Triangle as u8 && self.object.triangles[block as usize].prim.contains(&prim)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::description::{Description, Item, ItemKind};
    use crate::scene::mesh::Mesh;
    use crate::scene::world::Preset;

    /// Triangles in the plane z = 0, each in a cell of its own, `rows` in a row; with `blanket`, one great triangle over all.
    fn world(count: u32, rows: u32, blanket: bool) -> World<f64> {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let corner = DVec3::new(f64::from(i % rows), f64::from(i / rows), 0.0);
            mesh.positions.extend([corner, corner + 0.5 * DVec3::X, corner + 0.5 * DVec3::Y]);
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        if blanket {
            let size = 4.0 * f64::from(rows);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([DVec3::ZERO, size * DVec3::X, size * DVec3::Y]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let mut scene = Description::new("grid");
        scene.meshes = vec![Arc::new(mesh)];
        let item = Item { transform: glam::DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) };
        scene.groups[0].items.push(item);
        World::compile(&scene, Preset::Best).unwrap()
    }

    #[test]
    fn histograms_count_every_leaf_and_primitive() {
        let q = quality(&world(400, 20, false)).unwrap();
        assert_eq!(q.prims, 400);
        let counted: u64 = (1u64..).zip(q.leaf_sizes).map(|(size, count)| size * count).sum();
        assert_eq!((counted, q.leaf_sizes.iter().sum::<u64>()), (400, q.leaves as u64));
        assert_eq!(q.leaf_depths.iter().sum::<u64>(), q.leaves as u64);
        assert!(q.children_per_node > 1.0 && q.children_per_node <= 8.0);
    }

    /// Cells in one row can be parted without overlap: only a point's own boxes hold it. A blanket over them is in many boxes that are not its
    /// own, and brings the points below it into its own box.
    #[test]
    fn overlap_is_zero_for_separate_cells_and_grows_with_a_blanket() {
        let separate = quality(&world(400, 400, false)).unwrap().end_point_overlap.unwrap();
        assert_eq!(separate, 0.0);
        assert!(quality(&world(400, 20, true)).unwrap().end_point_overlap.unwrap() > 0.05);
    }
}
