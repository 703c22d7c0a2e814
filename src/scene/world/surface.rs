//! What shading needs of a hit, in f64, from the description's own numbers.

use glam::DVec3;

use super::{World, solids};
use crate::lanes::Real;
use crate::math::normal_to_world;
use crate::scene::assembly::PartKind;

/// A hit point with what shading needs, f64, world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Hit point.
    pub position: DVec3,
    /// Geometric normal, unit, as wound or outward (of a tree of solids, out of the whole); not turned towards the ray. Zero for degenerate geometry.
    pub ng: DVec3,
    /// Index into the description's materials.
    pub material: u32,
}

impl<S: Real> World<S> {
    /// Position, geometric normal and material of a hit (all f64).
    ///
    /// `org`, `dir`: the ray in world space; `t`, `u`, `v`, `prim`, `inst`: a hit of an engine of this world.
    pub fn surface(&self, org: DVec3, dir: DVec3, t: f64, u: f64, v: f64, prim: u32, inst: u32) -> Surface {
        let placement = &self.assembly.placements[inst as usize];
        let part = self.assembly.part_of(placement.object, prim);
        let to_world = placement.to_world * part.to_object;
        let (position, ng) = match &part.kind {
            PartKind::Mesh(mesh) => {
                let [a, b, c] = mesh.corners((prim - part.first_prim) as usize);
                let local = a * (1.0 - u - v) + b * u + c * v;
                (to_world.transform_point3(local), normal_to_world(&to_world, (b - a).cross(c - a)))
            }
            PartKind::Shape(shape) => {
                let position = org + dir * t;
                let local = to_world.inverse().transform_point3(position);
                (position, normal_to_world(&to_world, solids::shape_normal(shape, local, u as u32)))
            }
            PartKind::Solids(tree) => {
                let leaf = &tree.leaves[(prim - part.first_prim) as usize];
                let position = org + dir * t;
                let to_world = to_world * leaf.to_tree;
                let local = to_world.inverse().transform_point3(position);
                let outward = normal_to_world(&to_world, solids::solid_normal(&leaf.solid, local, u as u32));
                (position, if v > 0.5 { -outward } else { outward })
            }
        };
        Surface { position, ng, material: self.material(placement.object, prim) }
    }

    fn material(&self, object: u32, prim: u32) -> u32 {
        let runs = &self.materials[object as usize];
        let after = runs.partition_point(|(first, _)| *first <= prim);
        runs[after - 1].1
    }
}
