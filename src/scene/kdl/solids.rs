//! Solids made of solids: `union`, `intersection`, `difference`, `xor`, `complement`, and the solids that only they take.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::fields::{Fields, NO_REST, numbers_of};
use super::lower::{Lowering, PLACING, Place};
use super::scope::Scope;
use super::source::quote;
use super::syntax::Node;
use super::{shapes, transform};
use crate::error::Result;
use crate::scene::description::ItemKind;
use crate::scene::solids::flat::FlatTree;
use crate::scene::solids::{NodeId, NodeKind, Placed, Polyhedron, Solid, SolidNode, SolidTree};
use crate::scene::solids::{
    ellipsoid, elliptic_hyperboloid, elliptic_paraboloid, elliptic_torus, hyperboloid, torus, truncated_cone,
};

/// Statements that combine solids.
pub const OPERATIONS: [&str; 5] = ["union", "intersection", "difference", "xor", "complement"];
/// Solids that are not shapes of their own; each may also stand alone.
pub const SOLIDS: [&str; 8] =
    ["ellipsoid", "torus", "elliptic-torus", "truncated-cone", "polyhedron", "paraboloid", "hyperboloid", "capsule"];

/// A tree on its way, with the definitions that were built into it.
struct Building<'n> {
    tree: SolidTree,
    known: HashMap<&'n str, NodeId>,
    /// Stored meshes that are operands.
    meshes: HashSet<u32>,
    /// Definitions we are inside of.
    open: Vec<&'n str>,
    /// Operations we are inside of.
    nested: usize,
}

impl<'a, 'n> Lowering<'a, 'n> {
    /// Lowers a statement of [`OPERATIONS`] or [`SOLIDS`] to a tree, and places it.
    ///
    /// # Errors
    /// The first thing that is wrong in it.
    pub fn solid(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let mut building = Building {
            tree: SolidTree::default(),
            known: HashMap::new(),
            meshes: HashSet::new(),
            open: Vec::new(),
            nested: 0,
        };
        let root = self.operand(node, &mut building)?;
        let mut tree = building.tree;
        tree.root = root;
        if OPERATIONS.contains(&node.name.as_ref()) {
            let fields = self.operation_fields(node)?;
            if let Some((name, _)) = fields.title()? {
                tree.name = name.to_string();
            }
            let tolerance = fields.number("tolerance")?.unwrap_or(0.0);
            if tolerance < 0.0 {
                let what = format!("`tolerance` must not be negative, found {tolerance}");
                return Err(fields.error_at("tolerance", what));
            }
            tree.tolerance = tolerance;
        }
        // It is lowered again when the scene is put together, where nobody knows any more where it was written.
        FlatTree::new(&tree).map_err(|what| {
            let name: &str = if tree.name.is_empty() { &node.name } else { &tree.name };
            self.scope.source.error(node.span, format!("{}: {what}", quote(name)))
        })?;
        self.description.solids.push(Arc::new(tree));
        let index = self.description.solids.len() as u32 - 1;
        self.add(ItemKind::Solids(index), DAffine3::IDENTITY, place, node.span)
    }

    fn operation_fields<'s>(&'s self, node: &'n Node<'a>) -> Result<Fields<'s, 'n, 'a>> {
        Fields::collect(&self.scope, node, &["material", "tolerance"], &PLACING)
    }

    /// Adds the solid of one statement.
    fn operand(&mut self, node: &'n Node<'a>, building: &mut Building<'n>) -> Result<NodeId> {
        match node.name.as_ref() {
            "instance" => self.solid_instance(node, building),
            "group" => self.operation(node, building),
            "mesh" => {
                let (mesh, scale, place) = self.mesh_of(node, Place::root_of(0), false)?;
                self.count_item(node.span)?;
                self.store.check_closed(mesh).map_err(|what| {
                    let file = node.title().map_or("", |(name, _)| name);
                    self.scope.source.error(node.span, format!("{}: {what}", quote(file)))
                })?;
                let (transform, material) = place.parts();
                let stored = self.store.meshes[mesh as usize].clone();
                if building.meshes.insert(mesh) {
                    building.tree.closed.push(stored.clone());
                }
                let kind = NodeKind::Solid(Solid::Mesh(stored));
                Ok(building.tree.add(SolidNode { transform: transform * scale, material, kind }))
            }
            name if OPERATIONS.contains(&name) => self.operation(node, building),
            name if SOLIDS.contains(&name) || shapes::NAMES.contains(&name) => self.leaf(node, building),
            _ => {
                let known = OPERATIONS.iter().chain(&SOLIDS).chain(&shapes::NAMES).copied();
                let known = known.chain(["mesh", "group", "instance", "repeat", "choose"]);
                let what = format!("{} is no solid that can be combined", quote(&node.name));
                Err(self.scope.source.error_near(node.span, what, &node.name, known))
            }
        }
    }

    /// Adds the solids of some statements to `list`; repeats and choices give several or one.
    fn operands(&mut self, items: &[&'n Node<'a>], building: &mut Building<'n>, list: &mut Vec<NodeId>) -> Result<()> {
        for &item in items {
            match item.name.as_ref() {
                "repeat" => self.rounds(item, |lowering, items| lowering.operands(items, building, list))?,
                "choose" => {
                    let chosen = self.chosen(item)?;
                    self.operands(&[chosen], building, list)?;
                }
                _ => list.push(self.operand(item, building)?),
            }
        }
        Ok(())
    }

    /// An operation, or a group, which is a union.
    fn operation(&mut self, node: &'n Node<'a>, building: &mut Building<'n>) -> Result<NodeId> {
        let fields = self.operation_fields(node)?;
        fields.title()?;
        if fields.has("tolerance") && (node.name == "group" || building.nested > 0) {
            return Err(fields.error_at("tolerance", "`tolerance` belongs to the outermost operation"));
        }
        let is_transform = |n: &&Node<'_>| transform::NAMES.contains(&n.name.as_ref());
        let count = fields.rest.iter().take_while(|n| is_transform(n)).count();
        let (transforms, items) = fields.rest.split_at(count);
        let place = self.place(&fields, transforms, &["material"], Place::root_of(0))?;
        let items = items.to_vec();
        drop(fields);
        let mut list = Vec::new();
        building.nested += 1;
        self.operands(&items, building, &mut list)?;
        building.nested -= 1;
        let kind = match (node.name.as_ref(), list.as_slice()) {
            ("intersection", _) => NodeKind::Intersection(list),
            ("difference", _) => NodeKind::Difference(list),
            ("xor", _) => NodeKind::Xor(list),
            ("complement", &[only]) => NodeKind::Complement(only),
            ("complement", _) => {
                let what = format!("`complement` takes one solid, found {}", list.len());
                return Err(self.scope.source.error(node.span, what));
            }
            _ => NodeKind::Union(list),
        };
        self.count_item(node.span)?;
        let (transform, material) = place.parts();
        Ok(building.tree.add(SolidNode { transform, material, kind }))
    }

    /// `instance "name"`: the union of what is defined there.
    fn solid_instance(&mut self, node: &'n Node<'a>, building: &mut Building<'n>) -> Result<NodeId> {
        let fields = Fields::collect(&self.scope, node, &[], &transform::NAMES)?;
        let (name, span) = fields.title()?.ok_or_else(|| fields.error("expected `instance \"name\"`"))?;
        let place = self.place(&fields, &fields.rest, &[], Place::root_of(0))?;
        drop(fields);
        let Some(&definition) = self.definitions.get(name) else {
            let known = self.definitions.keys().copied();
            let what = format!("no `define` is called {}", quote(name));
            return Err(self.scope.source.error_near(span, what, name, known));
        };
        if building.open.contains(&name) {
            return Err(self.scope.source.error(span, format!("{} contains an instance of itself", quote(name))));
        }
        let child = match building.known.get(name) {
            Some(&child) => child,
            None => {
                building.open.push(name);
                // A definition is the same wherever it is placed: it does not see the indices of repeats.
                let indices = std::mem::take(&mut self.scope.indices);
                let child = self.operation(definition, building);
                self.scope.indices = indices;
                building.open.pop();
                *building.known.entry(name).or_insert(child?)
            }
        };
        self.count_item(node.span)?;
        let (transform, material) = place.parts();
        Ok(building.tree.add(SolidNode { transform, material, kind: NodeKind::Union(vec![child]) }))
    }

    fn leaf(&mut self, node: &'n Node<'a>, building: &mut Building<'n>) -> Result<NodeId> {
        let name = node.name.as_ref();
        let is_shape = shapes::NAMES.contains(&name);
        let allowed = if is_shape { shapes::fields_of(name) } else { fields_of(name) };
        let fields = Fields::collect(&self.scope, node, allowed, &transform::NAMES)?;
        if name == "disc" {
            let error = fields.error("a `disc` has no inside: it cannot be combined with solids");
            return Err(error.with_help("a flat cylinder has one"));
        }
        let mut rest = fields.rest.clone();
        let local = if is_shape {
            let (shape, transform) = shapes::canonical(&fields)?;
            Local::Placed(Placed { solid: Solid::Shape(shape), transform })
        } else {
            let (planes, others): (Vec<_>, Vec<_>) = rest.into_iter().partition(|n| n.name == "plane");
            rest = others;
            canonical(&self.scope, &fields, &planes)?
        };
        let place = self.place(&fields, &rest, allowed, Place::root_of(0))?;
        drop(fields);
        self.count_item(node.span)?;
        let (transform, material) = place.parts();
        match local {
            Local::Placed(placed) => {
                let transform = transform * placed.transform;
                transform::check_invertible(&self.scope, transform, node.span)?;
                let kind = NodeKind::Solid(placed.solid);
                Ok(building.tree.add(SolidNode { transform, material, kind }))
            }
            Local::Capsule(ends, radii) => {
                let wrong = |what: String| self.scope.source.error(node.span, format!("`capsule`: {what}"));
                let [from, to] = ends;
                let child = building.tree.particle(from, to - from, radii[0], radii[1]).map_err(wrong)?;
                Ok(building.tree.add(SolidNode { transform, material, kind: NodeKind::Union(vec![child]) }))
            }
        }
    }
}

/// A solid's own size and place.
enum Local {
    Placed(Placed),
    Capsule([DVec3; 2], [f64; 2]),
}

/// The fields of statement `name` of [`SOLIDS`].
pub fn fields_of(name: &str) -> &'static [&'static str] {
    match name {
        "ellipsoid" => &["center", "radii", "material"],
        "torus" => &["center", "normal", "radius", "tube", "material"],
        "elliptic-torus" => &["center", "normal", "radius", "a", "b", "angle", "material"],
        "truncated-cone" => &["base", "height", "a", "b", "c", "d", "material"],
        "polyhedron" => &["material"],
        "paraboloid" => &["base", "height", "a", "b", "material"],
        "hyperboloid" => &["base", "height", "a", "b", "waist", "apex", "material"],
        _ => &["from", "to", "radius", "top", "material"],
    }
}

/// Size and place of a solid of [`SOLIDS`]; `planes`: the planes of a polyhedron.
fn canonical(scope: &Scope<'_>, fields: &Fields<'_, '_, '_>, planes: &[&Node<'_>]) -> Result<Local> {
    fields.no_arguments()?;
    let vector = |name: &str, default: DVec3| Ok::<_, crate::error::Error>(fields.vector(name)?.unwrap_or(default));
    let name = fields.node.name.as_ref();
    let wrong = |what: String| fields.error(format!("`{name}`: {what}"));
    if name != "polyhedron"
        && let Some(odd) = planes.first()
    {
        return Err(fields.unknown_child(odd, fields_of(name)));
    }
    let placed = match name {
        "ellipsoid" => {
            let r = vector("radii", DVec3::ONE)?;
            if r.min_element() <= 0.0 {
                return Err(fields.error_at("radii", "the radii of an ellipsoid must be above zero"));
            }
            ellipsoid(vector("center", DVec3::ZERO)?, DVec3::X * r.x, DVec3::Y * r.y, DVec3::Z * r.z)
        }
        "torus" => {
            let (radius, tube) = (fields.positive("radius", 1.0)?, fields.positive("tube", 0.25)?);
            if tube > radius {
                return Err(fields.error_at("tube", "the tube of a torus must not be wider than its ring"));
            }
            let normal = fields.direction("normal")?.unwrap_or(DVec3::Z);
            torus(vector("center", DVec3::ZERO)?, normal, radius, tube)
        }
        "elliptic-torus" => {
            let (radius, a) = (fields.positive("radius", 1.0)?, fields.positive("a", 0.25)?);
            let (b, angle) = (fields.positive("b", 0.5 * a)?, fields.number("angle")?.unwrap_or(0.0).to_radians());
            let normal = fields.direction("normal")?.unwrap_or(DVec3::Z);
            let (up, out) = angle.sin_cos();
            if (a * out).hypot(b * up) > radius {
                return Err(fields.error("the tube of an elliptic torus must not be wider than its ring"));
            }
            elliptic_torus(vector("center", DVec3::ZERO)?, normal, radius, [a * out, a * up], b)
        }
        "truncated-cone" => {
            let (a, b) = (vector("a", DVec3::X)?, vector("b", DVec3::Y)?);
            let (c, d) = (vector("c", a)?, vector("d", b)?);
            truncated_cone(vector("base", DVec3::ZERO)?, vector("height", DVec3::Z)?, a, b, c, d)
        }
        "polyhedron" => {
            let mut list = Vec::with_capacity(planes.len());
            for plane in planes {
                let own = Fields::collect(scope, plane, &[], NO_REST)?;
                match *numbers_of(scope, &plane.entries)?.as_slice() {
                    [x, y, z, d] => list.push((DVec3::new(x, y, z), d)),
                    _ => return Err(own.error("`plane` takes four numbers: the normal and the distance")),
                }
            }
            Polyhedron::from_planes(&list)
                .map(|p| Placed { solid: Solid::Polyhedron(Arc::new(p)), transform: DAffine3::IDENTITY })
        }
        "paraboloid" | "hyperboloid" => {
            let (base, height) = (vector("base", DVec3::ZERO)?, vector("height", DVec3::Z)?);
            let a = vector("a", DVec3::X)?;
            let b = fields.positive("b", a.length())?;
            match (name, fields.has("apex")) {
                ("paraboloid", _) => elliptic_paraboloid(base, height, a, a.length(), b),
                (_, true) if fields.has("waist") => {
                    return Err(fields.error_at("apex", "a hyperboloid has a waist or an apex, not both"));
                }
                (_, true) => elliptic_hyperboloid(base, height, a, a.length(), b, fields.positive("apex", 1.0)?),
                _ => hyperboloid(base, height, a, b, fields.positive("waist", 0.5)?),
            }
        }
        _ => {
            let (from, to) = (vector("from", DVec3::ZERO)?, vector("to", DVec3::Z)?);
            let radius = fields.positive("radius", 1.0)?;
            return Ok(Local::Capsule([from, to], [radius, fields.positive("top", radius)?]));
        }
    };
    placed.map(Local::Placed).map_err(wrong)
}
