//! From statements to a description: groups, instances, repeats, shapes, meshes.

use std::collections::{HashMap, HashSet};

use glam::DAffine3;

use super::cycles::Link;
use super::fields::{Fields, NO_REST, numbers_of};
use super::meshes::{Key, MAX_GENERATED, MeshFiles, Store, polygon};
use super::scope::Scope;
use super::source::{Span, quote};
use super::syntax::Node;
use super::{expression, flake, hints, settings, shapes, solids, terrain, transform, twig};
use crate::error::{Error, Result};
use crate::scene::description::{Description, GroupId, Item, ItemKind, MaterialId, Shape};

/// Most items that a document may expand to.
pub const MAX_ITEMS: usize = 1 << 21;

/// Statements that place something, shapes apart.
pub const PLACING: [&str; 9] =
    ["group", "instance", "repeat", "choose", "mesh", "polygon", "sphere-flake", "terrain", "twig"];

/// Where items go: the group, the way into its space, the material they inherit.
#[derive(Clone, Copy)]
pub struct Place {
    group: GroupId,
    to_group: DAffine3,
    material: Option<MaterialId>,
}

impl Place {
    /// In `group`'s own space, nothing inherited.
    pub fn root_of(group: GroupId) -> Self {
        Self { group, to_group: DAffine3::IDENTITY, material: None }
    }

    /// The way into the group's space and the material.
    pub fn parts(&self) -> (DAffine3, Option<MaterialId>) {
        (self.to_group, self.material)
    }
}

/// Builds the groups of a description.
pub struct Lowering<'a, 'n> {
    /// Names and values.
    pub scope: Scope<'a>,
    /// What is being built.
    pub description: Description,
    /// Materials by name.
    pub materials: HashMap<&'n str, MaterialId>,
    /// Defined groups by name.
    pub groups: HashMap<&'n str, GroupId>,
    /// Their `define` statements.
    pub definitions: HashMap<&'n str, &'n Node<'a>>,
    /// Instances met so far.
    pub links: Vec<Link>,
    /// Meshes met so far.
    pub store: Store,
    /// Where mesh files come from.
    pub files: &'a MeshFiles<'a>,
    /// Metres per scene unit, if the document says.
    pub metres: Option<f64>,
    /// Items placed so far.
    pub item_count: usize,
    /// Names of the cameras met so far.
    pub camera_names: HashSet<String>,
}

impl<'a, 'n> Lowering<'a, 'n> {
    /// Lowers a `define` statement into `group`, or the whole document's items into group 0.
    ///
    /// # Errors
    /// The first statement that is wrong.
    pub fn define(&mut self, node: &'n Node<'a>, group: GroupId) -> Result<()> {
        self.block(node, Place::root_of(group))
    }

    /// Lowers one statement that places something.
    ///
    /// # Errors
    /// The first thing that is wrong in it.
    pub fn item(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        match node.name.as_ref() {
            "group" => self.block(node, place),
            "instance" => self.instance(node, place),
            "repeat" => self.repeat(node, place),
            "choose" => self.choose(node, place),
            "mesh" => self.mesh_file(node, place),
            "polygon" => self.polygon(node, place),
            "sphere-flake" => self.flake(node, place),
            "terrain" | "twig" => self.generated(node, place),
            name if shapes::NAMES.contains(&name) => {
                let fields = self.fields(node, shapes::fields_of(name), &transform::NAMES)?;
                let (shape, local) = shapes::canonical(&fields)?;
                let place = self.place(&fields, &fields.rest, shapes::fields_of(name), place)?;
                self.add(ItemKind::Shape(shape), local, place, node.span)
            }
            name if solids::OPERATIONS.contains(&name) || solids::SOLIDS.contains(&name) => self.solid(node, place),
            _ => Err(self.misplaced(node)),
        }
    }

    /// The fields of `node`, see [`Fields::collect`].
    ///
    /// # Errors
    /// Those of [`Fields::collect`].
    pub fn fields<'s>(&'s self, node: &'n Node<'a>, allowed: &[&str], others: &[&str]) -> Result<Fields<'s, 'n, 'a>> {
        Fields::collect(&self.scope, node, allowed, others)
    }

    /// A block of transforms, then items.
    fn block(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let fields = self.fields(node, &["material"], &PLACING)?;
        fields.title()?;
        let is_transform = |n: &&Node<'_>| transform::NAMES.contains(&n.name.as_ref());
        let count = fields.rest.iter().take_while(|n| is_transform(n)).count();
        let (transforms, items) = fields.rest.split_at(count);
        let place = self.place(&fields, transforms, &["material"], place)?;
        let items = items.to_vec();
        for item in items {
            self.item(item, place)?;
        }
        Ok(())
    }

    /// `place` moved by `transforms` and with the statement's own material.
    pub fn place(
        &self,
        fields: &Fields<'_, 'n, 'a>,
        transforms: &[&'n Node<'a>],
        allowed: &[&str],
        place: Place,
    ) -> Result<Place> {
        if let Some(odd) = transforms.iter().find(|n| !transform::NAMES.contains(&n.name.as_ref())) {
            let known: Vec<&str> = allowed.iter().chain(&transform::NAMES).copied().collect();
            return Err(fields.unknown_child(odd, &known));
        }
        let own = transform::product(&self.scope, transforms)?;
        let material = match fields.name("material")? {
            None => place.material,
            Some((name, span)) => Some(*self.materials.get(name).ok_or_else(|| {
                let known = self.materials.keys().copied();
                self.scope.source.error_near(span, format!("no material is called {}", quote(name)), name, known)
            })?),
        };
        Ok(Place { to_group: place.to_group * own, material, ..place })
    }

    /// Counts something placed.
    ///
    /// # Errors
    /// More than [`MAX_ITEMS`].
    pub fn count_item(&mut self, span: Span) -> Result<()> {
        self.item_count += 1;
        match self.item_count > MAX_ITEMS {
            true => Err(self.scope.source.error(span, format!("the scene expands to more than {MAX_ITEMS} items"))),
            false => Ok(()),
        }
    }

    /// Puts an item into the group of `place`.
    ///
    /// # Errors
    /// Too many items, transforms that cannot be inverted.
    pub fn add(&mut self, kind: ItemKind, local: DAffine3, place: Place, span: Span) -> Result<()> {
        self.count_item(span)?;
        let transform = place.to_group * local;
        transform::check_invertible(&self.scope, transform, span)?;
        let items = &mut self.description.groups[place.group as usize].items;
        items.push(Item { transform, material: place.material, kind });
        Ok(())
    }

    fn instance(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let fields = self.fields(node, &[], &transform::NAMES)?;
        let (name, span) = fields.title()?.ok_or_else(|| fields.error("expected `instance \"name\"`"))?;
        let Some(&child) = self.groups.get(name) else {
            let known = self.groups.keys().copied();
            let what = format!("no `define` is called {}", quote(name));
            return Err(self.scope.source.error_near(span, what, name, known));
        };
        let place = Place { material: None, ..self.place(&fields, &fields.rest, &[], place)? };
        self.links.push(Link { parent: place.group, child, span });
        self.add(ItemKind::Instance(child), DAffine3::IDENTITY, place, span)
    }

    /// `repeat 100 index="i" { ... }`: the block once for each i = 0, 1, ... 99.
    fn repeat(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        self.rounds(node, |lowering, items| items.iter().try_for_each(|item| lowering.item(item, place)))
    }

    /// Calls `round` with the block's items for each value of the index.
    ///
    /// # Errors
    /// A count or an index that does not fit, and those of `round`.
    pub fn rounds(
        &mut self,
        node: &'n Node<'a>,
        mut round: impl FnMut(&mut Self, &[&'n Node<'a>]) -> Result<()>,
    ) -> Result<()> {
        let fields = self.fields(node, &["index"], &PLACING)?;
        let mut count = Vec::new();
        for argument in fields.arguments() {
            self.scope.numbers(argument, &mut count)?;
        }
        let count = match *count.as_slice() {
            [n] if n >= 0.0 && n == n.floor() && n <= MAX_ITEMS as f64 => n as usize,
            [n] => return Err(fields.error(format!("expected a whole number from 0 to {MAX_ITEMS}, found {n}"))),
            _ => return Err(fields.error("expected `repeat` and how often")),
        };
        let (index, span) = fields.name("index")?.unwrap_or(("i", node.span));
        let taken = self.scope.parameters.contains_key(index) || self.scope.indices.iter().any(|(n, _)| n == index);
        if taken || !expression::is_free_name(index) {
            let reason = if taken { "is already in use" } else { "is not a name for an index" };
            let error = self.scope.source.error(span, format!("{} {reason}", quote(index)));
            return Err(error.with_help("name the index: repeat 10 index=\"k\""));
        }
        let items = fields.rest.clone();
        let level = self.scope.indices.len();
        self.scope.indices.push((index.into(), 0.0));
        for i in 0..count {
            self.scope.spend(1, node.span)?;
            self.scope.indices[level].1 = i as f64;
            round(self, &items)?;
        }
        self.scope.indices.pop();
        Ok(())
    }

    /// `choose "3 * random(i)" { ... }`: the item whose number, from 0, is the value rounded down.
    fn choose(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let chosen = self.chosen(node)?;
        self.item(chosen, place)
    }

    /// The item that a `choose` statement takes.
    ///
    /// # Errors
    /// A number that names none.
    pub fn chosen(&self, node: &'n Node<'a>) -> Result<&'n Node<'a>> {
        let fields = self.fields(node, &[], &PLACING)?;
        let choice = match *numbers_of(&self.scope, &node.entries)?.as_slice() {
            [x] => x.floor(),
            _ => return Err(fields.error("expected `choose` and which of the items")),
        };
        let items = fields.rest.clone();
        if !(choice >= 0.0 && choice < items.len() as f64) {
            let last = items.len() as f64 - 1.0;
            return Err(fields.error(format!("expected an item from 0 to {last}, found {choice}")));
        }
        Ok(items[choice as usize])
    }

    /// `polygon { point 0 0 0; point 1 0 0; point 0 1 0 }`.
    fn polygon(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let fields = self.fields(node, &["material"], &transform::NAMES)?;
        fields.no_arguments()?;
        let (points, transforms): (Vec<_>, Vec<_>) = fields.rest.iter().copied().partition(|n| n.name == "point");
        let place = self.place(&fields, &transforms, &["point", "material"], place)?;
        let mut corners = Vec::with_capacity(points.len());
        let mut uvs = Vec::new();
        for point in points {
            let fields = Fields::collect(&self.scope, point, &[], NO_REST)?;
            match *numbers_of(&self.scope, &point.entries)?.as_slice() {
                [x, y, z] => corners.push(glam::DVec3::new(x, y, z)),
                [x, y, z, u, v] => {
                    corners.push(glam::DVec3::new(x, y, z));
                    // A picture's v points down in a mesh, a scene file's up.
                    uvs.push([u as f32, 1.0 - v as f32]);
                }
                _ => return Err(fields.error("`point` takes three numbers, or five with texture coordinates")),
            }
        }
        if !uvs.is_empty() && uvs.len() < corners.len() {
            return Err(fields.error("expected texture coordinates at all points of the polygon, or at none"));
        }
        if corners.len() < 3 {
            return Err(fields.error(format!("a polygon has at least three points, found {}", corners.len())));
        }
        self.allow_triangles(corners.len() as u64 - 2, node)?;
        let mesh = self.store.add(None, polygon(corners, uvs));
        self.add(ItemKind::Mesh(mesh), DAffine3::IDENTITY, place, node.span)
    }

    /// `sphere-flake depth=4`.
    fn flake(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        const ALLOWED: [&str; 2] = ["depth", "material"];
        let fields = self.fields(node, &ALLOWED, &transform::NAMES)?;
        fields.no_arguments()?;
        let depth = fields.whole("depth", 3, 0..=flake::MAX_DEPTH)?;
        let place = self.place(&fields, &fields.rest, &ALLOWED, place)?;
        self.scope.spend(flake::count(depth), node.span)?;
        let mut result = Ok(());
        flake::spheres(depth, &mut |local| {
            if result.is_ok() {
                result = self.add(ItemKind::Shape(Shape::Sphere), local, place, node.span);
            }
        });
        result
    }

    /// `terrain size=224 seed=1` and `twig leaves=60 seed=1`: meshes made by code.
    fn generated(&mut self, node: &'n Node<'a>, place: Place) -> Result<()> {
        let is_terrain = node.name == "terrain";
        let allowed = if is_terrain { ["size", "seed", "material"] } else { ["leaves", "seed", "material"] };
        let fields = self.fields(node, &allowed, &transform::NAMES)?;
        fields.no_arguments()?;
        let amount = if is_terrain {
            fields.whole("size", 224, 1..=terrain::MAX_SIZE)?
        } else {
            fields.whole("leaves", 60, 1..=100_000)?
        };
        let seed = fields.whole("seed", 1, 0..=u32::MAX)?;
        let place = self.place(&fields, &fields.rest, &allowed, place)?;
        let key = if is_terrain { Key::Terrain(amount, seed) } else { Key::Twig(amount, seed) };
        let mesh = match self.store.find(&key) {
            Some(mesh) => mesh,
            None if is_terrain => {
                self.allow_triangles(2 * u64::from(amount) * u64::from(amount), node)?;
                self.store.add(Some(key), terrain::terrain(amount, seed))
            }
            None => {
                self.allow_triangles(twig::triangle_count(amount), node)?;
                self.store.add(Some(key), twig::twig(amount, seed))
            }
        };
        self.add(ItemKind::Mesh(mesh), DAffine3::IDENTITY, place, node.span)
    }

    fn allow_triangles(&mut self, triangles: u64, node: &Node<'_>) -> Result<()> {
        match self.store.allow(triangles) {
            true => Ok(()),
            false => {
                let what = format!("the scene makes more than {MAX_GENERATED} triangles of its own");
                Err(self.scope.source.error(node.span, what))
            }
        }
    }

    /// The error that `node` cannot stand here.
    fn misplaced(&self, node: &Node<'_>) -> Error {
        let source = self.scope.source;
        let name = node.name.as_ref();
        if transform::NAMES.contains(&name) {
            let what = format!("`{name}` must come before the items of a block, which it transforms together");
            return source.error(node.span, what).with_help("put what it should act on into a `group`");
        }
        if settings::NAMES.contains(&name) || name == "define" {
            return source.error(node.span, format!("`{name}` belongs to the top level of the file"));
        }
        if name.starts_with("--") {
            return source.error(node.span, format!("unknown statement {}", quote(name))).with_help(hints::COMMENT);
        }
        let known = shapes::NAMES.iter().chain(&PLACING).chain(&settings::NAMES).chain(&transform::NAMES);
        let known = known.chain(&solids::OPERATIONS).chain(&solids::SOLIDS).chain(&["define"]).copied();
        source.error_near(node.span, format!("unknown statement {}", quote(name)), name, known)
    }
}
