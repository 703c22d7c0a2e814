//! Compiling: records and boxes per primitive, one tree per object, blocks in leaf order, the upper tree.

use std::time::Instant;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::facets::Facets;
use super::rounding::Rounding;
use super::runs::Runs;
use super::{Class, Counts, Kinds, Object, PlacedSolid, SolidBlock, World, instances, solids, successor};
use crate::bvh::{self, BuildSettings, LEAF_PRIMS, Leaf, Preset};
use crate::error::Result;
use crate::lanes::{Real, with_large_pages};
use crate::math::Aabb;
use crate::scene::assembly::{Assembly, AssemblyObject, Part, PartKind};
use crate::scene::description::{Description, Shape};
use crate::scene::mesh::Mesh;
use crate::scene::solids::flat::FlatTree;
use crate::shape::{
    BLOCK, Block, Cone, Cuboid, Cylinder, Degenerate, Disc, HalfSpace, Placed, PlacedRecord, Sphere, SphereRecord,
    Triangle, WorldSphere,
};

// One leaf of a tree is one block.
const _: () = assert!(BLOCK == LEAF_PRIMS);

impl<S: Real> World<S> {
    /// Compiles `description` with trees as `settings` (or a [`Preset`]) say, on the current rayon pool.
    ///
    /// # Errors
    /// Those of [`Assembly::new`].
    pub fn compile(description: &Description, settings: impl Into<BuildSettings>) -> Result<Self> {
        Self::compile_after(description, settings, None)
    }

    /// As [`Self::compile`], but objects whose geometry `before`, compiled with the same settings, has too are copied from
    /// it. The world is the same, to the last bit.
    ///
    /// # Errors
    /// Those of [`Assembly::new`].
    pub fn compile_after(
        description: &Description,
        settings: impl Into<BuildSettings>,
        before: Option<&Self>,
    ) -> Result<Self> {
        let (start, settings) = (Instant::now(), settings.into());
        let assembly = Assembly::new(description)?;
        let mut counts = Vec::with_capacity(assembly.objects.len());
        let mut objects = Vec::with_capacity(assembly.objects.len());
        for object in &assembly.objects {
            let known = before.and_then(|world| Some((world, successor::find(object, &world.assembly.objects)?)));
            let (built, count) = match known {
                Some((world, same)) => (world.objects[same].clone(), world.counts[same]),
                None => build(object, settings),
            };
            objects.push(built);
            counts.push(count);
        }
        let instances = instances::all(&assembly.placements, &objects);
        let (top, top_leaves, unbounded_instances) = instances::upper_tree(&instances, settings.preset);
        let runs: Vec<Runs> = assembly.objects.iter().map(|o| Runs::new(o, description)).collect();
        let facets = assembly.objects.iter().zip(&runs).map(|(o, runs)| Facets::new(o, runs)).collect();
        let rounding = Rounding::of(&assembly.placements, &objects);
        let kinds = objects.iter().map(Object::kinds).fold(Kinds::default(), |a, b| Kinds {
            triangles: a.triangles || b.triangles,
            shapes: a.shapes || b.shapes,
            others: a.others || b.others,
            sorting: a.sorting || b.sorting,
        });
        let build_seconds = start.elapsed().as_secs_f64();
        Ok(Self {
            assembly,
            objects,
            instances,
            top,
            top_leaves,
            unbounded_instances,
            rounding,
            kinds,
            runs,
            facets,
            counts,
            build_seconds,
        })
    }
}

/// One object, and what was dropped of it.
fn build<S: Real>(object: &AssemblyObject, settings: BuildSettings) -> (Object<S>, Counts) {
    let (mut primitives, mut counts) = (Primitives::default(), Counts::default());
    for part in &object.parts {
        primitives.add(part, settings.preset, &mut counts);
    }
    (primitives.build(settings), counts)
}

/// A primitive's numbers before it has a place in a block.
#[derive(Clone, Copy, Debug)]
enum Record<S> {
    Triangle([S; 9]),
    Sphere(SphereRecord<S>),
    Placed(Class, PlacedRecord<S>),
    /// Index into the object's solids.
    Solids(u32),
}

/// Primitives of one object with bounds, and those without.
#[derive(Debug)]
struct Primitives<S> {
    records: Vec<Record<S>>,
    ids: Vec<u32>,
    boxes: Vec<Aabb<S>>,
    classes: Vec<u8>,
    unbounded: Vec<(PlacedRecord<S>, u32)>,
    solids: Vec<PlacedSolid<S>>,
    unbounded_solids: Vec<u32>,
}

impl<S> Default for Primitives<S> {
    fn default() -> Self {
        Self {
            records: Vec::new(),
            ids: Vec::new(),
            boxes: Vec::new(),
            classes: Vec::new(),
            unbounded: Vec::new(),
            solids: Vec::new(),
            unbounded_solids: Vec::new(),
        }
    }
}

impl<S: Real> Primitives<S> {
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
                true => self.push(Record::Solids(at), part.first_prim, bounds, Class::Solids),
                false => self.unbounded_solids.push(at),
            }
        }
    }

    fn push(&mut self, record: Record<S>, id: u32, bounds: Aabb<S>, class: Class) {
        self.records.push(record);
        self.ids.push(id);
        self.boxes.push(bounds);
        self.classes.push(class as u8);
    }

    fn add_mesh(&mut self, part: &Part, mesh: &Mesh, counts: &mut Counts) {
        // An identity must not cost the file's last bits.
        let place = |p: DVec3| match part.to_object == DAffine3::IDENTITY {
            true => p,
            false => part.to_object.transform_point3(p),
        };
        let records: Vec<_> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|i| Triangle::record::<S>(mesh.corners(i).map(place)).map(|n| (n, Triangle::bounds(&n))))
            .collect();
        for (i, record) in records.into_iter().enumerate() {
            match record {
                Ok((numbers, bounds)) => {
                    self.push(Record::Triangle(numbers), part.first_prim + i as u32, bounds, Class::Triangle);
                }
                Err(Degenerate::NonFinite) => counts.nonfinite += 1,
                Err(Degenerate::ZeroArea) => counts.degenerate += 1,
            }
        }
    }

    fn add_shape(&mut self, part: &Part, shape: &Shape, counts: &mut Counts) {
        let (id, m) = (part.first_prim, &part.to_object);
        if let (Shape::Sphere, Some(sphere)) = (shape, world_sphere::<S>(m)) {
            self.push(Record::Sphere(sphere), id, WorldSphere::bounds(&sphere), Class::WorldSphere);
            return;
        }
        let class = Class::of(shape);
        let record = match (class, shape) {
            (Class::Cone, Shape::Cone { top }) => Placed::record::<S, Cone>(m, *top),
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
                    self.push(Record::Placed(class, numbers), id, bounds, class);
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
        let blocks = |class: Class| leaves.iter().filter(|leaf| leaf.class == class as u8).count();
        let mut object = Object {
            tree,
            triangles: with_large_pages(blocks(Class::Triangle)),
            spheres: Vec::with_capacity(blocks(Class::WorldSphere)),
            placed: Default::default(),
            unbounded: Vec::new(),
            solids: std::mem::take(&mut self.solids),
            solid_blocks: Vec::new(),
            unbounded_solids: SolidBlock::default(),
            soles: Vec::new(),
            swept: Vec::new(),
        };
        object.unbounded_solids = object.list_solids(self.unbounded_solids.drain(..));
        for leaf in &leaves {
            self.fill(&mut object, leaf);
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

    fn fill(&self, object: &mut Object<S>, leaf: &Leaf) {
        // Leaves of a class come in the order of their blocks.
        match Class::ALL[usize::from(leaf.class)] {
            Class::Triangle => object.triangles.push(Block::empty()),
            Class::WorldSphere => object.spheres.push(Block::empty()),
            Class::Solids => {
                let solids = leaf.prims.iter().filter_map(|&p| match self.records[p as usize] {
                    Record::Solids(solid) => Some(solid),
                    _ => None,
                });
                let block = object.list_solids(solids);
                return object.solid_blocks.push(block);
            }
            class => object.placed[class as usize].push(Block::empty()),
        }
        let at = leaf.block as usize;
        for (i, &p) in leaf.prims.iter().enumerate() {
            let id = self.ids[p as usize];
            match self.records[p as usize] {
                Record::Triangle(n) => object.triangles[at].set(i, n, id),
                Record::Sphere(n) => object.spheres[at].set(i, n, id),
                Record::Placed(class, n) => object.placed[class as usize][at].set(i, n, id),
                Record::Solids(_) => unreachable!("leaves are of one class"),
            }
        }
    }
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
