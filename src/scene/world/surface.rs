//! What shading needs of a hit, in f64, from the description's own numbers.

use glam::DVec3;

use super::World;
use crate::lanes::Real;
use crate::math::normal_to_world;
use crate::scene::assembly::PartKind;
use crate::scene::description::Shape;
use crate::shape::{Cone, Cuboid, Cylinder, Disc, HalfSpace, Solid, Sphere};

/// A hit point with what shading needs, f64, world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Hit point.
    pub position: DVec3,
    /// Geometric normal, unit, as wound or outward; not turned towards the ray. Zero for degenerate geometry.
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
                (position, normal_to_world(&to_world, local_normal(shape, local, u as u32)))
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

fn local_normal(shape: &Shape, point: DVec3, face: u32) -> DVec3 {
    match *shape {
        Shape::Sphere => Sphere::normal(point, face, 0.0),
        Shape::HalfSpace => HalfSpace::normal(point, face, 0.0),
        Shape::Disc => Disc::normal(point, face, 0.0),
        Shape::Cuboid => Cuboid::normal(point, face, 0.0),
        Shape::Cylinder => Cylinder::normal(point, face, 0.0),
        Shape::Cone { top } => Cone::normal(point, face, top),
    }
}
