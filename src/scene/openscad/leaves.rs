//! Calls that make something of numbers: solids, plane figures, and solids that figures sweep.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use super::build::{Builder, Loose, Made};
use super::extrude::{Rise, rise, turn};
use super::flat::{self, Contour, Flat};
use super::fragments::{MAX_PIECES, circle};
use super::offset::{Corner, arcs, offset};
use super::primitives;
use crate::error::{Result, nearest_name};
use crate::scene::mesh::Mesh;
use crate::scene::solids::flat::closed;

/// All modules that are read.
const MODULES: [&str; 21] = [
    "circle",
    "color",
    "cube",
    "cylinder",
    "difference",
    "fill",
    "group",
    "hull",
    "import",
    "intersection",
    "linear_extrude",
    "minkowski",
    "multmatrix",
    "offset",
    "polygon",
    "polyhedron",
    "render",
    "resize",
    "rotate_extrude",
    "sphere",
    "square",
];
/// Modules that OpenSCAD has and that are not read.
const OTHERS: [&str; 4] = ["projection", "roof", "surface", "text"];
/// Operations that show all that is in their braces, closed or not.
const TRANSPARENT: [&str; 6] = ["", "color", "group", "multmatrix", "render", "union"];

impl Builder<'_, '_, '_> {
    /// What a call without braces makes.
    ///
    /// # Errors
    /// Wrong arguments, modules that are not known, files that cannot be read.
    pub fn leaf(&mut self, i: usize) -> Result<Made> {
        match self.nodes[i].name {
            "cube" => self.cube(i),
            "sphere" => self.sphere(i),
            "cylinder" => self.cylinder(i),
            "polyhedron" => self.polyhedron(i),
            "square" => self.square(i),
            "circle" => self.circle(i),
            "polygon" => self.polygon(i),
            "import" => self.import(i),
            name if OTHERS.contains(&name) => {
                let (what, help) = match name {
                    "text" | "projection" => {
                        ("polygons", "export what it makes as a mesh (.stl) together with what it is extruded to")
                    }
                    _ => ("a polyhedron", "export what it makes as a mesh (.stl)"),
                };
                let error = self.error(i, format!("it is not read: what {what} it makes, only OpenSCAD knows"));
                Err(error.with_help(format!("{help} and import that")))
            }
            name => {
                let error = self.error(i, "no such module: a .csg file holds what `openscad -o model.csg` writes");
                Err(match nearest_name(name, MODULES) {
                    Some(near) => error.with_help(format!("did you mean `{near}`?")),
                    None => error,
                })
            }
        }
    }

    /// Keeps the warning that numbers leave nothing of a call.
    fn nothing(&mut self, i: usize) {
        self.warn(i, "its size is not above 0: it is empty");
    }

    fn cube(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["size", "center"]);
        let size = fields.vector::<3>("size")?.map_or(DVec3::ONE, DVec3::from);
        let is_centred = fields.flag("center")?;
        if size.min_element() <= 0.0 {
            self.nothing(i);
            return Ok(Made::Solid(None));
        }
        let lo = if is_centred { size * -0.5 } else { DVec3::ZERO };
        let cube = self.solids.cuboid(self.nodes[i].at, (lo, lo + size), self.palette.material(self.looks, i));
        Ok(Made::Solid(Some(cube)))
    }

    /// A mesh with these numbers, made if there is none yet.
    fn known(&mut self, i: usize, numbers: [f64; 6], triangles: usize, make: impl FnOnce() -> Mesh) -> Result<Made> {
        // Each place of it is traced by itself.
        self.work.triangles(triangles).map_err(|what| self.error(i, what))?;
        let key = numbers.map(f64::to_bits);
        let mesh = match self.known.get(&key) {
            Some(mesh) => mesh.clone(),
            None => {
                let mesh = Arc::new(make());
                self.solids.tree.closed.push(mesh.clone());
                self.known.insert(key, mesh.clone());
                mesh
            }
        };
        Ok(Made::Solid(Some(self.solids.mesh(self.nodes[i].at, mesh, None, self.palette.material(self.looks, i)))))
    }

    fn sphere(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["r", "d", "$fn", "$fa", "$fs"]);
        let radius = fields.number("d")?.map(|d| 0.5 * d).or(fields.number("r")?).unwrap_or(1.0);
        let resolution = fields.resolution()?;
        if radius <= 0.0 {
            self.nothing(i);
            return Ok(Made::Solid(None));
        }
        let pieces = resolution.circle(radius).map_err(|what| self.error(i, what))?;
        // All of as many pieces are one mesh.
        let numbers = [0.0, 1.0, pieces as f64, 0.0, 0.0, 0.0];
        let ball = self.known(i, numbers, pieces * pieces, || primitives::sphere(1.0, pieces))?;
        if let Made::Solid(Some(solid)) = ball {
            self.solids.place(solid, &DAffine3::from_scale(DVec3::splat(radius)));
        }
        Ok(ball)
    }

    fn cylinder(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["h", "r1", "r2", "center", "r", "d", "d1", "d2", "$fn", "$fa", "$fs"]);
        let half = |name: &str| fields.number(name).map(|d| d.map(|d| 0.5 * d));
        let both = half("d")?.or(fields.number("r")?);
        let first = half("d1")?.or(fields.number("r1")?).or(both).unwrap_or(1.0);
        let second = half("d2")?.or(fields.number("r2")?).or(both).unwrap_or(1.0);
        let (height, is_centred) = (fields.number_or("h", 1.0)?, fields.flag("center")?);
        let resolution = fields.resolution()?;
        if height <= 0.0 || first < 0.0 || second < 0.0 || first.max(second) == 0.0 {
            self.nothing(i);
            return Ok(Made::Solid(None));
        }
        let pieces = resolution.circle(first.max(second)).map_err(|what| self.error(i, what))?;
        let low = if is_centred { -0.5 * height } else { 0.0 };
        let numbers = [1.0, first, pieces as f64, second, low, height];
        self.known(i, numbers, 4 * pieces, || primitives::cylinder([low, low + height], [first, second], pieces))
    }

    fn polyhedron(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["points", "faces", "convexity", "triangles"]);
        let (mesh, large) = primitives::polyhedron(&fields)?;
        self.warnings.extend(crate::scene::polygon::warning(large));
        if mesh.triangles.is_empty() {
            return Ok(Made::Solid(None));
        }
        self.mesh(i, mesh)
    }

    fn import(&mut self, i: usize) -> Result<Made> {
        const KNOWN: [&str; 10] =
            ["file", "layer", "convexity", "origin", "scale", "center", "dpi", "$fn", "$fa", "$fs"];
        let fields = self.fields(i, &KNOWN);
        let Some(file) = fields.text("file")? else {
            return Err(self.error(i, "expected the name of a file: `file = \"part.stl\"`"));
        };
        let is_centred = fields.flag("center")?;
        let mut mesh = (self.read)(file).map_err(|what| self.error(i, what))?;
        if is_centred && let Some((lo, hi)) = mesh.bounds() {
            mesh.positions.iter_mut().for_each(|p| *p -= (lo + hi) * 0.5);
        }
        // Neither materials nor shading normals: OpenSCAD knows none.
        let mesh = Mesh { positions: mesh.positions, triangles: mesh.triangles, ..Mesh::default() };
        self.mesh(i, mesh)
    }

    /// A mesh that somebody wrote: closed, or outside of all operations.
    fn mesh(&mut self, i: usize, mut mesh: Mesh) -> Result<Made> {
        let Err(what) = closed(&mesh) else {
            if mesh.volume() < 0.0 {
                self.warn(i, "it is inside out: turned");
                mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            }
            return self.solid_of(i, Some(mesh));
        };
        let mut transform = DAffine3::IDENTITY;
        let mut at = i;
        while at != self.looks.root as usize {
            at = self.looks.parents[at] as usize;
            self.work.steps(1).map_err(|what| self.error(i, what))?;
            if !TRANSPARENT.contains(&self.nodes[at].name) {
                let line = self.source.line(self.nodes[at].at);
                let what = format!("it has no inside for `{}` in line {line}: {what}", self.nodes[at].name);
                return Err(self.error(i, what));
            }
            if self.nodes[at].name == "multmatrix"
                && let Some(map) = self.matrix(at)?
            {
                transform = map * transform;
            }
        }
        self.warn(i, &format!("shown as a surface, as it has no inside: {what}"));
        self.loose.push(Loose { mesh: Arc::new(mesh), transform, material: self.palette.material(self.looks, i) });
        Ok(Made::Solid(None))
    }

    fn square(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["size", "center"]);
        let size = fields.vector::<2>("size")?.map_or(DVec2::ONE, DVec2::from);
        let is_centred = fields.flag("center")?;
        if size.min_element() <= 0.0 {
            self.nothing(i);
            return Ok(Made::Flat(Flat::default()));
        }
        let lo = if is_centred { size * -0.5 } else { DVec2::ZERO };
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| lo + size * DVec2::new(x, y));
        Ok(Made::Flat(Flat::simple(corners.into_iter())))
    }

    fn circle(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["r", "d", "$fn", "$fa", "$fs"]);
        let radius = fields.number("d")?.map(|d| 0.5 * d).or(fields.number("r")?).unwrap_or(1.0);
        let resolution = fields.resolution()?;
        if radius <= 0.0 {
            self.nothing(i);
            return Ok(Made::Flat(Flat::default()));
        }
        let pieces = resolution.circle(radius).map_err(|what| self.error(i, what))?;
        Ok(Made::Flat(Flat::simple(circle(radius, pieces))))
    }

    fn polygon(&mut self, i: usize) -> Result<Made> {
        let fields = self.fields(i, &["points", "paths", "convexity"]);
        let mut points = Vec::new();
        for point in fields.list("points")?.unwrap_or_default() {
            points.push(fields.vector_of::<2>(point, "points", 2)?);
        }
        let mut contours: Vec<Contour> = Vec::new();
        for path in fields.list("paths")?.unwrap_or_default() {
            let corners = fields.list_of(path, "paths")?.iter();
            let corners = corners.map(|corner| fields.index_of(corner, "paths", points.len()));
            contours.push(corners.map(|corner| Ok(points[corner? as usize])).collect::<Result<_>>()?);
        }
        if contours.is_empty() {
            contours.push(points);
        }
        let figure = Flat::even_odd(&contours, &mut self.work).map_err(|what| self.error(i, what))?;
        Ok(Made::Flat(figure))
    }

    /// What a call makes of the figure in its braces.
    ///
    /// # Errors
    /// Wrong arguments, figures of which it cannot be made, too much work.
    pub fn of_figure(&mut self, i: usize, figure: Flat) -> Result<Made> {
        match self.nodes[i].name {
            "offset" => self.offset(i, &figure),
            "fill" => {
                let filled = figure.shapes.into_iter().filter_map(|shape| shape.into_iter().next());
                let filled = filled.map(|outer| Flat { shapes: vec![vec![outer]] }).collect();
                let filled = flat::union(filled, &mut self.work).map_err(|what| self.error(i, what))?;
                Ok(Made::Flat(filled))
            }
            "linear_extrude" => self.linear_extrude(i, &figure),
            _ => self.rotate_extrude(i, &figure),
        }
    }

    fn offset(&mut self, i: usize, figure: &Flat) -> Result<Made> {
        let fields = self.fields(i, &["r", "delta", "chamfer", "$fn", "$fa", "$fs"]);
        let (radius, delta) = (fields.number("r")?, fields.number("delta")?);
        let distance = delta.or(radius).unwrap_or(1.0);
        let corner = match delta {
            Some(_) if fields.flag("chamfer")? => Corner::Cut,
            Some(_) => Corner::Sharp,
            None => {
                let pieces = fields.resolution()?.circle(distance.abs());
                Corner::Round(arcs(distance, pieces.map_err(|what| self.error(i, what))?))
            }
        };
        if distance == 0.0 {
            return Ok(Made::Flat(figure.clone()));
        }
        let moved = offset(figure, distance, corner, &mut self.work).map_err(|what| self.error(i, what))?;
        Ok(Made::Flat(moved))
    }

    fn linear_extrude(&mut self, i: usize, figure: &Flat) -> Result<Made> {
        const KNOWN: [&str; 12] =
            ["height", "v", "center", "twist", "slices", "scale", "segments", "file", "layer", "$fn", "$fa", "$fs"];
        let fields = self.fields(i, &KNOWN);
        if let Some(file) = fields.text("file")?.filter(|file| !file.is_empty()) {
            return Err(self.error(i, format!("drawings are not read, found `file = {file:?}`")));
        }
        if fields.number_or("segments", 0.0)? > 0.0 {
            self.warn(i, "`segments` is not known: edges stay whole");
        }
        let height = fields.number("height")?;
        let way = match fields.get("v") {
            None => DVec3::Z * height.unwrap_or(100.0),
            Some(value) => {
                let v = DVec3::from(fields.vector_of::<3>(value, "v", 3)?);
                height.map_or(v, |height| v.normalize_or_zero() * height)
            }
        };
        let scale = fields.vector::<2>("scale")?.map_or(DVec2::ONE, DVec2::from).max(DVec2::ZERO);
        let slices = fields.number("slices")?;
        if slices.is_some_and(|slices| slices > MAX_PIECES as f64) {
            return Err(self.error(i, format!("at most {MAX_PIECES} slices are read")));
        }
        let way_up = Rise {
            way,
            is_centred: fields.flag("center")?,
            twist: fields.number_or("twist", 0.0)?,
            scale,
            slices: slices.map(|slices| slices.max(1.0) as usize),
        };
        let resolution = fields.resolution()?;
        if way.z <= 0.0 || figure.is_empty() {
            return Ok(Made::Solid(None));
        }
        let made = rise(figure, &way_up, &resolution, &mut self.work);
        let (mesh, prisms) = made.map_err(|what| self.error(i, what))?;
        let mesh = Arc::new(mesh);
        self.solids.tree.closed.push(mesh.clone());
        Ok(Made::Solid(Some(self.solids.mesh(self.nodes[i].at, mesh, prisms, self.palette.material(self.looks, i)))))
    }

    fn rotate_extrude(&mut self, i: usize, figure: &Flat) -> Result<Made> {
        let fields = self.fields(i, &["angle", "start", "file", "layer", "origin", "scale", "$fn", "$fa", "$fs"]);
        let angle = fields.number_or("angle", 360.0)?;
        let angle = if angle <= -360.0 || angle > 360.0 { 360.0 } else { angle };
        // Older ones begin whole turns on the other side.
        let start = fields.number_or("start", if angle == 360.0 { 180.0 } else { 0.0 })?;
        let resolution = fields.resolution()?;
        if angle == 0.0 || figure.is_empty() {
            return Ok(Made::Solid(None));
        }
        let mesh = turn(figure, angle, start, &resolution, &mut self.work).map_err(|what| self.error(i, what))?;
        let mesh = Arc::new(mesh);
        self.solids.tree.closed.push(mesh.clone());
        Ok(Made::Solid(Some(self.solids.mesh(self.nodes[i].at, mesh, None, self.palette.material(self.looks, i)))))
    }
}
