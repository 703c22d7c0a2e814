//! The geometry of one object as the oracle keeps it: every primitive under its number, and a tree over them.

use glam::{DAffine3, DVec3};

use super::shapes::{self, Crossing};
use super::tree::{Bounds, Tree};
use super::{OracleRay, Search, magnitude, solids};
use crate::scene::assembly::{AssemblyObject, PartKind};
use crate::scene::description::Shape;

/// Pad of the oracle's own boxes relative to coordinates: more than its rounding, far less than any margin.
const BOX_PAD: f64 = 1.0 / (1u64 << 46) as f64;

/// What a primitive number stands for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Prim {
    /// Indices of three positions.
    Triangle([u32; 3]),
    /// Index into [`Object::solids`].
    Solid(u32),
    /// A leaf of a tree of solids: index into [`Object::trees`]. Hit as part of its tree, not by itself.
    Leaf(u32),
    /// Degenerate: never hit.
    Dropped,
}

/// An analytic shape with its place in the object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    pub shape: Shape,
    pub to_object: DAffine3,
    pub to_local: DAffine3,
}

/// A crossing of the oracle's ray with a primitive, object space.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalHit {
    pub t: f64,
    pub u: f64,
    pub v: f64,
    pub face: u32,
    pub ng: DVec3,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Object {
    /// Mesh positions of all parts, object space.
    positions: Vec<DVec3>,
    /// Indexed by primitive number.
    prims: Vec<Prim>,
    solids: Vec<Solid>,
    /// Trees of solids.
    pub trees: Vec<solids::Tree>,
    tree: Tree,
    /// Largest growth of rounding through a solid's own transform, 1 without solids.
    pub solid_growth: f64,
}

impl Object {
    pub fn new(source: &AssemblyObject, search: Search) -> Self {
        let mut object = Self { solid_growth: 1.0, ..Self::default() };
        for part in &source.parts {
            match &part.kind {
                PartKind::Mesh(mesh) => {
                    let base = object.positions.len() as u32;
                    object.positions.extend(mesh.positions.iter().map(|&p| part.to_object.transform_point3(p)));
                    for (number, triangle) in mesh.triangles.iter().enumerate() {
                        let corners = triangle.map(|i| base + i);
                        // Corners that lie on a line where they are described may leave it by the rounding of their placing.
                        let proper = shapes::is_proper(mesh.corners(number))
                            && shapes::is_proper(corners.map(|i| object.positions[i as usize]));
                        object.prims.push(if proper { Prim::Triangle(corners) } else { Prim::Dropped });
                    }
                }
                PartKind::Shape(shape) => object.push_solid(*shape, part.to_object),
                PartKind::Solids(flat) => {
                    let tree = solids::Tree::new(part.first_prim, flat, &part.to_object);
                    let leaf = Prim::Leaf(object.trees.len() as u32);
                    object.prims.extend((0..tree.leaf_count()).map(|_| leaf));
                    object.trees.push(tree);
                }
            }
        }
        let count = object.prims.len() as u32;
        let items = (0..count).filter(|&i| object.is_alone(i)).collect();
        object.tree = match search {
            Search::Brute => Tree::flat(items),
            Search::Tree => Tree::build(items, |i| object.prim_bounds(i)),
        };
        object
    }

    fn push_solid(&mut self, shape: Shape, to_object: DAffine3) {
        let to_local = to_object.inverse();
        if to_object.matrix3.determinant() == 0.0 || !to_object.is_finite() || !to_local.is_finite() {
            self.prims.push(Prim::Dropped);
            return;
        }
        // |P| |P^-1| bounds how much larger than its ends a coordinate gets on the way there and back.
        let there = magnitude::vector(&to_local, DVec3::ONE);
        let growth = magnitude::vector(&to_object, there).max_element();
        self.solid_growth = self.solid_growth.max(2.0 * growth + 1.0);
        self.prims.push(Prim::Solid(self.solids.len() as u32));
        self.solids.push(Solid { shape, to_object, to_local });
    }

    /// Whether primitive `prim` is hit by itself.
    fn is_alone(&self, prim: u32) -> bool {
        matches!(self.prim(prim), Prim::Triangle(_) | Prim::Solid(_))
    }

    /// The primitive numbered `prim`; [`Prim::Dropped`] also beyond the last.
    pub fn prim(&self, prim: u32) -> Prim {
        self.prims.get(prim as usize).copied().unwrap_or(Prim::Dropped)
    }

    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    pub fn solid(&self, index: u32) -> &Solid {
        &self.solids[index as usize]
    }

    /// Box of a primitive that is not dropped.
    pub fn prim_bounds(&self, prim: u32) -> Bounds {
        match self.prim(prim) {
            Prim::Triangle(corners) => Bounds::of(self.corners(corners)),
            Prim::Solid(i) => self.solids[i as usize].bounds(),
            Prim::Leaf(_) | Prim::Dropped => Bounds::EMPTY,
        }
    }

    /// Box of all primitives that can be hit, `None` if there is none.
    pub fn bounds(&self) -> Option<Bounds> {
        let live = (0..self.prims.len() as u32).filter(|&i| self.is_alone(i));
        let trees = self.trees.iter().map(|t| t.bounds).filter(|b| b.lo.x <= b.hi.x);
        live.map(|i| self.prim_bounds(i)).chain(trees).reduce(Bounds::union)
    }

    /// Crossings of the ray's line with one primitive, in order of t.
    pub fn crossings(&self, prim: u32, ray: &OracleRay) -> [Option<LocalHit>; 2] {
        match self.prim(prim) {
            Prim::Triangle(corners) => {
                let hit = shapes::triangle(self.corners(corners), ray.org, ray.dir);
                [hit.map(|h| LocalHit { t: h.t, u: h.u, v: h.v, face: 0, ng: h.ng }), None]
            }
            Prim::Solid(i) => {
                let solid = &self.solids[i as usize];
                let local = ray.transformed(&solid.to_local);
                shapes::crossings(solid.shape, local.org, local.dir).map(|c| c.map(|c| solid.hit(&local, c)))
            }
            Prim::Leaf(_) | Prim::Dropped => [None; 2],
        }
    }

    /// The nearest crossing in `ray.t_min..=t_max`, ties to the smaller primitive number.
    pub fn closest(&self, ray: &OracleRay, t_max: f64) -> Option<(u32, LocalHit)> {
        let mut best: Option<(u32, LocalHit)> = None;
        let org = ray.org.abs().max_element();
        let pad = |b: &Bounds| BOX_PAD * (b.magnitude().max_element() + org);
        let mut end = self.tree.visit(ray, t_max, pad, |prim, end| {
            let in_segment = |hit: &LocalHit| ray.t_min <= hit.t && hit.t <= end;
            let Some(hit) = self.crossings(prim, ray).into_iter().flatten().find(in_segment) else { return end };
            if best.is_none_or(|(p, b)| hit.t < b.t || (hit.t == b.t && prim < p)) {
                best = Some((prim, hit));
            }
            hit.t
        });
        for tree in &self.trees {
            if tree.bounds.entry(ray, end, pad(&tree.bounds)).is_none() && tree.bounds.is_finite() {
                continue;
            }
            let boundaries = tree.boundaries(ray, 0.0);
            let Some(first) = boundaries.iter().find(|b| ray.t_min <= b.t && b.t <= end) else { continue };
            let prim = tree.first_prim + first.leaf;
            if best.is_none_or(|(p, b)| first.t < b.t || prim < p) {
                let (ng, v) = (tree.normal(ray, first), f64::from(first.turned));
                best = Some((prim, LocalHit { t: first.t, u: f64::from(first.face), v, face: first.face, ng }));
                end = first.t;
            }
        }
        best
    }

    /// Calls `found` for every primitive whose box, grown by `pad`, meets the segment.
    pub fn near(&self, ray: &OracleRay, pad: impl Fn(&Bounds) -> f64, mut found: impl FnMut(u32)) {
        self.tree.visit(ray, ray.t_max, &pad, |prim, end| {
            let bounds = self.prim_bounds(prim);
            if bounds.entry(ray, end, pad(&bounds)).is_some() {
                found(prim);
            }
            end
        });
    }
}

impl Solid {
    /// Box in object space; infinite for the half-space.
    pub fn bounds(&self) -> Bounds {
        let (lo, hi) = shapes::canonical_bounds(self.shape);
        let local = Bounds { lo, hi };
        if !local.is_finite() {
            return Bounds::ALL;
        }
        Bounds::of(local.corners().map(|p| self.to_object.transform_point3(p)))
    }

    fn hit(&self, local: &OracleRay, crossing: Crossing) -> LocalHit {
        let ng = shapes::normal(self.shape, crossing.face, local.at(crossing.t));
        let ng = self.to_local.matrix3.transpose() * ng;
        LocalHit { t: crossing.t, u: f64::from(crossing.face), v: 0.0, face: crossing.face, ng }
    }
}
