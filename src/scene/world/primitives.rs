//! Primitives of an object: their boxes, the tree over them, their numbers in blocks in the order of its leaves.

use std::ops::Range;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::{Class, Counts, Object, PlacedSolid, SolidBlock, solids};
use crate::bvh::{self, BuildSettings, LEAF_PRIMS, Leaf, Preset};
use crate::lanes::{Real, with_large_pages};
use crate::math::Aabb;
use crate::scene::assembly::{AssemblyObject, Part, PartKind};
use crate::scene::description::Shape;
use crate::scene::mesh::Mesh;
use crate::scene::solids::flat::FlatTree;
use crate::shape::{
    BLOCK, Block, Cone, Cuboid, Cylinder, Degenerate, Disc, HalfSpace, Placed, PlacedRecord, Sphere, SphereRecord,
    Triangle, WorldSphere,
};

// One leaf of a tree is one block.
const _: () = assert!(BLOCK == LEAF_PRIMS);

/// One object, and what was dropped of it.
pub fn build<S: Real>(object: &AssemblyObject, settings: BuildSettings) -> (Object<S>, Counts) {
    let triangles = object.parts.iter().map(|part| match &part.kind {
        PartKind::Mesh(mesh) => mesh.triangles.len(),
        _ => 0,
    });
    let (mut primitives, mut counts) = (Primitives::with_room(triangles.sum()), Counts::default());
    for part in &object.parts {
        primitives.add(part, settings.preset, &mut counts);
    }
    (primitives.build(settings), counts)
}

/// Triangles of a mesh below which threads take longer to begin than to do the work.
const FEW: usize = 1024;

/// Adds what `item` makes of `numbers`, on all threads if they are many.
fn extend<T: Send>(list: &mut Vec<T>, numbers: Range<usize>, item: impl Fn(usize) -> T + Send + Sync) {
    match numbers.len() < FEW {
        true => list.extend(numbers.map(item)),
        false => list.par_extend(numbers.into_par_iter().map(item)),
    }
}

/// Primitives of one object with bounds, and those without.
struct Primitives<S> {
    sources: Vec<Source>,
    boxes: Vec<Aabb<S>>,
    classes: Vec<u8>,
    triangles: Vec<[S; Triangle::FIELDS]>,
    spheres: Vec<SphereRecord<S>>,
    /// Of all other classes.
    placed: Vec<PlacedRecord<S>>,
    unbounded: Vec<(PlacedRecord<S>, u32)>,
    solids: Vec<PlacedSolid<S>>,
    unbounded_solids: Vec<u32>,
}

/// Where a primitive's numbers are before it has a place in a block.
#[derive(Clone, Copy, Debug)]
struct Source {
    /// Index into the list of its class.
    at: u32,
    /// Primitive number.
    id: u32,
}

impl<S: Real> Primitives<S> {
    fn with_room(triangles: usize) -> Self {
        Self {
            sources: with_large_pages(triangles),
            boxes: with_large_pages(triangles),
            classes: with_large_pages(triangles),
            triangles: with_large_pages(triangles),
            spheres: Vec::new(),
            placed: Vec::new(),
            unbounded: Vec::new(),
            solids: Vec::new(),
            unbounded_solids: Vec::new(),
        }
    }

    fn add(&mut self, part: &Part, preset: Preset, counts: &mut Counts) {
        match &part.kind {
            PartKind::Mesh(mesh) => self.add_mesh(part, mesh, counts),
            PartKind::Shape(shape) => self.add_shape(part, shape, counts),
            PartKind::Solids(tree) => self.add_solids(part, tree, preset, counts),
        }
    }

    fn add_solids(&mut self, part: &Part, tree: &FlatTree, preset: Preset, counts: &mut Counts) {
        let built = solids::compile::<S>(tree, &part.to_object, preset);
        counts.singular += built.dropped as u64;
        for solid in built.solids {
            let (at, bounds) = (self.solids.len() as u32, solid.bounds);
            self.solids.push(PlacedSolid { solid, first_prim: part.first_prim });
            match bounds.is_bounded() {
                true => self.push(Source { at, id: part.first_prim }, bounds, Class::Solids),
                false => self.unbounded_solids.push(at),
            }
        }
    }

    fn push(&mut self, source: Source, bounds: Aabb<S>, class: Class) {
        self.sources.push(source);
        self.boxes.push(bounds);
        self.classes.push(class as u8);
    }

    fn add_mesh(&mut self, part: &Part, mesh: &Mesh, counts: &mut Counts) {
        // An identity must not cost the file's last bits.
        let is_identity = part.to_object == DAffine3::IDENTITY;
        let place = |p: DVec3| if is_identity { p } else { part.to_object.transform_point3(p) };
        let (first, of_mesh) = (self.triangles.len(), 0..mesh.triangles.len());
        extend(&mut self.triangles, of_mesh, |i| Triangle::rounded(mesh.corners(i).map(place)));
        let Self { sources, boxes, classes, triangles, .. } = self;
        let new = &triangles[first..];
        let source = |i: usize| Source { at: (first + i) as u32, id: part.first_prim + i as u32 };
        // Corners on a line are dropped where they are described, too: placing and rounding them would make slivers of some.
        let fault = |i: usize| {
            let corners = mesh.corners(i);
            let placed = Triangle::record::<S>(corners.map(place)).err();
            placed.or(Triangle::is_flat(corners).then_some(Degenerate::ZeroArea))
        };
        // As a rule all are good, and each has its place in the lists beforehand.
        let is_good = |i| fault(i).is_none();
        let are_good =
            if new.len() < FEW { (0..new.len()).all(is_good) } else { (0..new.len()).into_par_iter().all(is_good) };
        if are_good {
            extend(sources, 0..new.len(), source);
            extend(boxes, 0..new.len(), |i| Triangle::bounds(&new[i]));
        } else {
            for (i, corners) in new.iter().enumerate() {
                match fault(i) {
                    None => {
                        sources.push(source(i));
                        boxes.push(Triangle::bounds(corners));
                    }
                    Some(Degenerate::NonFinite) => counts.nonfinite += 1,
                    Some(Degenerate::ZeroArea) => counts.degenerate += 1,
                }
            }
        }
        classes.resize(sources.len(), Class::Triangle as u8);
    }

    fn add_shape(&mut self, part: &Part, shape: &Shape, counts: &mut Counts) {
        let (id, m) = (part.first_prim, &part.to_object);
        if let (Shape::Sphere, Some(sphere)) = (shape, world_sphere::<S>(m)) {
            let source = Source { at: self.spheres.len() as u32, id };
            self.push(source, WorldSphere::bounds(&sphere), Class::WorldSphere);
            self.spheres.push(sphere);
            return;
        }
        let class = Class::of(shape);
        let record = match (class, shape) {
            (Class::Cone, Shape::Cone { top, .. }) => Placed::record::<S, Cone>(m, *top),
            (Class::HalfSpace, _) => Placed::record::<S, HalfSpace>(m, 0.0),
            (Class::Disc, _) => Placed::record::<S, Disc>(m, 0.0),
            (Class::Cuboid, _) => Placed::record::<S, Cuboid>(m, 0.0),
            (Class::Cylinder, _) => Placed::record::<S, Cylinder>(m, 0.0),
            _ => Placed::record::<S, Sphere>(m, 0.0),
        };
        match record {
            None => counts.singular += 1,
            Some(numbers) if class == Class::HalfSpace => self.unbounded.push((numbers, id)),
            Some(numbers) => {
                let bounds = Placed::bounds(&numbers);
                if bounds.is_bounded() {
                    self.push(Source { at: self.placed.len() as u32, id }, bounds, class);
                    self.placed.push(numbers);
                } else {
                    counts.singular += 1;
                }
            }
        }
    }

    fn build(mut self, settings: BuildSettings) -> Object<S> {
        // Blocks of triangles are tested at once, spheres one by one: each is as dear as a node.
        let mut each = [bvh::PRIMITIVE; Class::ALL.len()];
        each[Class::WorldSphere as usize] = 1.0;
        // Solids ask their own boxes, so a leaf of several asks one more; and what surrounds a scene makes all else in it look as
        // if few rays came there.
        let only_solids = self.classes.iter().all(|&class| class == Class::Solids as u8);
        let settings = if only_solids { BuildSettings { leaf: 1, ..settings } } else { settings };
        let (tree, leaves) = bvh::build_by_cost(&self.boxes, &self.classes, &each, settings);
        // Leaves of a class come in the order of their blocks.
        let of = |class: Class| leaves.iter().filter(|leaf| leaf.class == class as u8).collect::<Vec<_>>();
        let mut object = Object {
            tree,
            triangles: blocks(&of(Class::Triangle), &self.sources, &self.triangles),
            spheres: blocks(&of(Class::WorldSphere), &self.sources, &self.spheres),
            placed: Class::ALL.map(|class| match class {
                Class::Triangle | Class::WorldSphere | Class::Solids => Vec::new(),
                class => blocks(&of(class), &self.sources, &self.placed),
            }),
            unbounded: Vec::new(),
            solids: std::mem::take(&mut self.solids),
            solid_blocks: Vec::new(),
            unbounded_solids: SolidBlock::default(),
            soles: Vec::new(),
            swept: Vec::new(),
        };
        object.unbounded_solids = object.list_solids(self.unbounded_solids.drain(..));
        for leaf in of(Class::Solids) {
            let block = object.list_solids(leaf.prims().iter().map(|&p| self.sources[p as usize].at));
            object.solid_blocks.push(block);
        }
        for chunk in self.unbounded.chunks(BLOCK) {
            let mut block = Block::empty();
            for (i, (numbers, id)) in chunk.iter().enumerate() {
                block.set(i, *numbers, *id);
            }
            object.unbounded.push(block);
        }
        object
    }
}

/// The blocks of `leaves` over primitives that are `sources` and have their numbers in `list`.
fn blocks<S: Real, const F: usize>(leaves: &[&Leaf], sources: &[Source], list: &[[S; F]]) -> Vec<Block<S, F>> {
    let mut blocks = with_large_pages(leaves.len());
    blocks.par_extend(leaves.par_iter().map(|leaf| {
        let mut block = Block::empty();
        for (i, &p) in leaf.prims().iter().enumerate() {
            let Source { at, id } = sources[p as usize];
            block.set(i, list[at as usize], id);
        }
        block
    }));
    blocks
}

impl<S: Real> Object<S> {
    /// Lists some of its solids as a block.
    fn list_solids(&mut self, solids: impl Iterator<Item = u32>) -> SolidBlock {
        let (soles, swept) = (self.soles.len() as u32, self.swept.len() as u32);
        for number in solids {
            let PlacedSolid { solid, first_prim } = &self.solids[number as usize];
            match solid.sole(number, *first_prim) {
                Some(sole) => self.soles.push(sole),
                None => self.swept.push(number),
            }
        }
        SolidBlock { soles: soles..self.soles.len() as u32, swept: swept..self.swept.len() as u32 }
    }
}

/// Centre and radius of a unit sphere's image, if the map keeps it a sphere (a rotation with one scale).
fn world_sphere<S: Real>(m: &DAffine3) -> Option<SphereRecord<S>> {
    let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
    let square = x.length_squared();
    let alike = |a: f64| (a - square).abs() <= 1e-14 * square;
    let right = |a: f64| a.abs() <= 1e-14 * square;
    let round =
        alike(y.length_squared()) && alike(z.length_squared()) && right(x.dot(y)) && right(y.dot(z)) && right(z.dot(x));
    let numbers = [m.translation.x, m.translation.y, m.translation.z, square.sqrt()].map(S::from_f64);
    (round && numbers.iter().all(|n| n.is_finite()) && numbers[3] > S::ZERO).then_some(numbers)
}
