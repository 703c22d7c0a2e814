//! From calls to solids, those inside braces first: what OpenSCAD's operators make of what is in their braces.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::fields::Fields;
use super::flat::{self, Flat};
use super::hull::{flat_hull, hull};
use super::looks::{Looks, Palette};
use super::minkowski;
use super::solids::{Solids, Trouble};
use super::syntax::{Node, Source};
use super::work::Work;
use crate::error::{Error, Result, nearest_name};
use crate::scene::description::MaterialId;
use crate::scene::mesh::Mesh;
use crate::scene::solids::{NodeId, NodeKind, SolidTree};

/// Most warnings that are kept.
const MAX_WARNINGS: usize = 100;

/// What a call makes.
#[derive(Default)]
pub(super) enum Made {
    /// Nothing, not even an empty solid.
    #[default]
    Nothing,
    /// A plane figure, perhaps empty.
    Flat(Flat),
    /// A solid; none if it is empty.
    Solid(Option<NodeId>),
}

/// What is in the braces of a call, all of one kind. What is left out counts as empty.
enum Operands {
    Nothing,
    Flat(Vec<Flat>),
    Solid(Vec<Option<NodeId>>),
}

/// A mesh that is not closed, outside of all operations.
pub(super) struct Loose {
    pub mesh: Arc<Mesh>,
    pub transform: DAffine3,
    pub material: Option<MaterialId>,
}

/// Reads the mesh in a file.
pub(super) type ReadMesh<'r> = dyn FnMut(&str) -> std::result::Result<Mesh, String> + 'r;

/// The solids of a file on their way.
pub(super) struct Builder<'s, 'a, 'r> {
    pub source: &'s Source<'a>,
    pub nodes: &'s [Node<'a>],
    pub looks: &'s Looks,
    pub solids: Solids,
    pub work: Work,
    pub palette: Palette,
    pub loose: Vec<Loose>,
    pub warnings: Vec<String>,
    /// Balls and cylinders by their numbers.
    pub known: HashMap<[u64; 6], Arc<Mesh>>,
    pub read: &'r mut ReadMesh<'r>,
}

impl<'s, 'a, 'r> Builder<'s, 'a, 'r> {
    /// A builder of `nodes`, which will put what is solid into `tree`.
    pub fn new(
        source: &'s Source<'a>,
        nodes: &'s [Node<'a>],
        looks: &'s Looks,
        tree: SolidTree,
        read: &'r mut ReadMesh<'r>,
    ) -> Self {
        let (solids, work, palette) = (Solids::new(tree), Work::new(), Palette::default());
        let (loose, warnings, known) = (Vec::new(), Vec::new(), HashMap::new());
        Self { source, nodes, looks, solids, work, palette, loose, warnings, known, read }
    }

    /// What the file makes.
    ///
    /// # Errors
    /// The first thing that is wrong, from the end of the file.
    pub fn all(&mut self) -> Result<Made> {
        let root = self.looks.root as usize;
        let mut made: Vec<Made> = Vec::new();
        made.resize_with(self.nodes.len(), Made::default);
        for i in (root..self.nodes.len()).rev().filter(|&i| self.looks.is_there[i]) {
            let there = self.nodes[i].children.iter().filter(|&&child| self.looks.is_there[child as usize]);
            let parts = there.map(|&child| (child, std::mem::take(&mut made[child as usize]))).collect();
            made[i] = self.call(i, parts)?;
        }
        Ok(std::mem::take(&mut made[root]))
    }

    /// Keeps a warning about the call `i`.
    pub fn warn(&mut self, i: usize, what: &str) {
        if self.warnings.len() < MAX_WARNINGS {
            let node = &self.nodes[i];
            let (file, line) = (self.source.file.display(), self.source.line(node.at));
            self.warnings.push(format!("{file}:{line}: `{}`: {what}", node.name));
        }
    }

    /// The error `what` at the call `i`.
    pub fn error(&self, i: usize, what: impl std::fmt::Display) -> Error {
        Fields::new(self.source, &self.nodes[i], &[]).error(what)
    }

    /// The arguments of the call `i`; a name that is not `known` is a warning.
    pub fn fields(&mut self, i: usize, known: &'static [&'static str]) -> Fields<'s, 'a> {
        let fields = Fields::new(self.source, &self.nodes[i], known);
        if let Some(name) = fields.unknown() {
            let near = nearest_name(name, fields.known.iter().copied());
            let near = near.map_or(String::new(), |near| format!(" (did you mean `{near}`?)"));
            let name = crate::scene::text::shown(name.as_bytes());
            self.warn(i, &format!("the argument {name} is not known and means nothing{near}"));
        }
        fields
    }

    fn call(&mut self, i: usize, parts: Vec<(u32, Made)>) -> Result<Made> {
        match self.nodes[i].name {
            "" | "group" | "union" | "color" | "render" => {
                let operands = self.operands(parts);
                self.boolean(i, operands, NodeKind::Union)
            }
            "difference" => {
                let operands = self.operands(parts);
                self.boolean(i, operands, NodeKind::Difference)
            }
            "intersection" => {
                let operands = self.operands(parts);
                self.boolean(i, operands, NodeKind::Intersection)
            }
            "multmatrix" => self.multmatrix(i, parts),
            "hull" => self.hull(i, parts),
            "minkowski" => self.minkowski(i, parts),
            "resize" => self.resize(i, parts),
            "offset" | "fill" | "linear_extrude" | "rotate_extrude" => {
                let figures = self.figures(parts);
                let figure = flat::union(figures, &mut self.work).map_err(|what| self.error(i, what))?;
                self.of_figure(i, figure)
            }
            _ => self.leaf(i),
        }
    }

    /// What is in braces as operands of one kind: that of the first.
    fn operands(&mut self, parts: Vec<(u32, Made)>) -> Operands {
        let mut kinds = parts.iter().filter(|(_, part)| !matches!(part, Made::Nothing));
        match kinds.next() {
            None => Operands::Nothing,
            Some((_, Made::Flat(_))) => Operands::Flat(self.figures(parts)),
            Some(_) => {
                let mut list = Vec::with_capacity(parts.len());
                for (child, part) in parts {
                    if let Made::Flat(_) = part {
                        self.warn(child as usize, "a plane figure among solids is left out");
                    }
                    list.push(if let Made::Solid(solid) = part { solid } else { None });
                }
                Operands::Solid(list)
            }
        }
    }

    /// What is in braces as figures.
    fn figures(&mut self, parts: Vec<(u32, Made)>) -> Vec<Flat> {
        let mut list = Vec::with_capacity(parts.len());
        for (child, part) in parts {
            if let Made::Solid(_) = part {
                self.warn(child as usize, "a solid among plane figures is left out");
            }
            list.push(if let Made::Flat(flat) = part { flat } else { Flat::default() });
        }
        list
    }

    fn boolean(&mut self, i: usize, operands: Operands, kind: fn(Vec<NodeId>) -> NodeKind) -> Result<Made> {
        let kind = kind(Vec::new());
        match operands {
            Operands::Nothing => Ok(Made::Nothing),
            Operands::Flat(figures) => {
                let combined = match kind {
                    NodeKind::Difference(_) => flat::difference(figures, &mut self.work),
                    NodeKind::Intersection(_) => flat::intersection(figures, &mut self.work),
                    _ => flat::union(figures, &mut self.work),
                };
                combined.map(Made::Flat).map_err(|what| self.error(i, what))
            }
            Operands::Solid(solids) => {
                let there: Vec<NodeId> = solids.iter().copied().flatten().collect();
                let is_empty = match kind {
                    NodeKind::Difference(_) => solids.first().is_none_or(Option::is_none),
                    NodeKind::Intersection(_) => there.len() < solids.len(),
                    _ => there.is_empty(),
                };
                let kind = match kind {
                    NodeKind::Difference(_) => NodeKind::Difference(there),
                    NodeKind::Intersection(_) => NodeKind::Intersection(there),
                    _ => NodeKind::Union(there),
                };
                Ok(Made::Solid((!is_empty).then(|| self.solids.op(self.nodes[i].at, kind))))
            }
        }
    }

    fn multmatrix(&mut self, i: usize, parts: Vec<(u32, Made)>) -> Result<Made> {
        let map = self.matrix(i)?;
        let operands = self.operands(parts);
        let all = self.boolean(i, operands, NodeKind::Union)?;
        let Some(map) = map else { return Ok(Made::Nothing) };
        Ok(match all {
            Made::Flat(figure) => {
                self.work.steps(figure.points().count() as u64).map_err(|what| self.error(i, what))?;
                let [x, y, to] = [map.x_axis, map.y_axis, map.translation];
                let column = |v: DVec3, last: f64| DVec3::new(v.x, v.y, last);
                let flat = DMat3::from_cols(column(x, 0.0), column(y, 0.0), column(to, 1.0));
                Made::Flat(figure.mapped(&flat))
            }
            Made::Solid(Some(solid)) => {
                let determinant = map.matrix3.determinant();
                if determinant == 0.0 || !map.inverse().is_finite() {
                    self.warn(i, "it makes what is in its braces flat: that is left out");
                    return Ok(Made::Solid(None));
                }
                self.solids.place(solid, &map);
                Made::Solid(Some(solid))
            }
            other => other,
        })
    }

    /// The map of a `multmatrix`; none if it is not finite, which OpenSCAD leaves out, too.
    pub fn matrix(&mut self, i: usize) -> Result<Option<DAffine3>> {
        let fields = self.fields(i, &["m"]);
        let rows = fields.list("m")?.unwrap_or_default();
        let mut matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        for (own, row) in matrix.iter_mut().zip(rows) {
            let row = fields.list_of(row, "m")?;
            for (number, value) in own.iter_mut().zip(row) {
                let super::syntax::ValueKind::Number(given) = value.kind else {
                    return Err(self.source.error(value.at, "`multmatrix`: expected a number"));
                };
                *number = given;
            }
        }
        let whole = matrix[3][3];
        let [x, y, z, to] = [0, 1, 2, 3].map(|k| DVec3::new(matrix[0][k], matrix[1][k], matrix[2][k]) / whole);
        let map = DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: to };
        if !map.is_finite() {
            self.warn(i, "its matrix is not finite: what is in its braces is left out");
            return Ok(None);
        }
        Ok(Some(map))
    }

    /// An error for `trouble` with something in the braces of `i`.
    fn troubled(&self, i: usize, (at, what): Trouble) -> Error {
        let node = &self.nodes[i];
        let line = self.source.line(node.at);
        let what = format!("`{}` in line {line} cannot be made: {what}", node.name);
        let error = self.source.error(at, what);
        error.with_help("write that part as a mesh (`openscad -o part.stl part.scad`) and import it")
    }

    fn hull(&mut self, i: usize, parts: Vec<(u32, Made)>) -> Result<Made> {
        self.fields(i, &[]);
        match self.operands(parts) {
            Operands::Nothing => Ok(Made::Nothing),
            Operands::Flat(figures) => {
                let outline = flat_hull(figures.iter().flat_map(Flat::points));
                let is_empty = outline.is_empty();
                Ok(Made::Flat(if is_empty { Flat::default() } else { Flat::simple(outline.into_iter()) }))
            }
            Operands::Solid(solids) => {
                let mut points = Vec::new();
                for solid in solids.into_iter().flatten() {
                    self.walk(i, solid)?;
                    points.extend(self.solids.points(solid).map_err(|trouble| self.troubled(i, trouble))?);
                }
                let mesh = hull(&points, &mut self.work).map_err(|what| self.error(i, what))?;
                self.solid_of(i, mesh)
            }
        }
    }

    /// A mesh as what the call `i` makes.
    pub fn solid_of(&mut self, i: usize, mesh: Option<Mesh>) -> Result<Made> {
        let Some(mesh) = mesh else { return Ok(Made::Solid(None)) };
        self.work.triangles(mesh.triangles.len()).map_err(|what| self.error(i, what))?;
        let mesh = Arc::new(mesh);
        self.solids.tree.closed.push(mesh.clone());
        let solid = self.solids.mesh(self.nodes[i].at, mesh, None, self.palette.material(self.looks, i));
        Ok(Made::Solid(Some(solid)))
    }

    /// Pays for a walk over `solid`.
    fn walk(&mut self, i: usize, solid: NodeId) -> Result<()> {
        self.work.steps(2 * self.solids.weight(solid)).map_err(|what| self.error(i, what))
    }

    fn minkowski(&mut self, i: usize, parts: Vec<(u32, Made)>) -> Result<Made> {
        self.fields(i, &[]);
        match self.operands(parts) {
            Operands::Nothing => Ok(Made::Nothing),
            Operands::Flat(figures) => {
                let mut figures = figures.into_iter();
                let first = figures.next().unwrap_or_default();
                let sum = figures.filter(|figure| !figure.is_empty()).try_fold(first, |sum, figure| {
                    minkowski::flat_sum(&sum, &figure, &mut self.work).map_err(|what| self.error(i, what))
                })?;
                Ok(Made::Flat(sum))
            }
            Operands::Solid(solids) => {
                let solids: Vec<NodeId> = solids.into_iter().flatten().collect();
                if solids.len() < 2 {
                    return Ok(Made::Solid(solids.first().copied()));
                }
                let mut sum: Option<Vec<Vec<DVec3>>> = None;
                let mut meshes = Vec::new();
                for solid in solids {
                    self.walk(i, solid)?;
                    let parts = self.solids.parts(solid).map_err(|trouble| self.troubled(i, trouble))?;
                    sum = Some(match sum {
                        None => parts,
                        Some(sum) => {
                            meshes =
                                minkowski::sum(&sum, &parts, &mut self.work).map_err(|what| self.error(i, what))?;
                            meshes.iter().map(|mesh| mesh.positions.clone()).collect()
                        }
                    });
                }
                let mut list = Vec::new();
                for mesh in meshes {
                    if let Made::Solid(Some(part)) = self.solid_of(i, Some(mesh))? {
                        list.push(part);
                    }
                }
                let is_empty = list.is_empty();
                Ok(Made::Solid((!is_empty).then(|| self.solids.op(self.nodes[i].at, NodeKind::Union(list)))))
            }
        }
    }

    fn resize(&mut self, i: usize, parts: Vec<(u32, Made)>) -> Result<Made> {
        let fields = self.fields(i, &["newsize", "auto"]);
        let (size, auto) = (fields.vector::<3>("newsize")?.unwrap_or_default(), fields.flags::<3>("auto")?);
        let operands = self.operands(parts);
        let all = self.boolean(i, operands, NodeKind::Union)?;
        match all {
            Made::Flat(figure) => {
                let Some((lo, hi)) = figure.bounds() else { return Ok(Made::Flat(figure)) };
                let scale = resized((hi - lo).extend(0.0), DVec3::new(size[0], size[1], 0.0), auto);
                Ok(Made::Flat(figure.mapped(&DMat3::from_scale(DVec2::new(scale.x, scale.y)))))
            }
            Made::Solid(Some(solid)) => {
                self.walk(i, solid)?;
                let bounds = self.solids.bounds(solid).map_err(|trouble| self.troubled(i, trouble))?;
                let Some((lo, hi)) = bounds else { return Ok(Made::Solid(None)) };
                self.solids.place(solid, &DAffine3::from_scale(resized(hi - lo, DVec3::from(size), auto)));
                Ok(Made::Solid(Some(solid)))
            }
            other => Ok(other),
        }
    }
}

/// Factors that make `old` as large as `new`: where that is not above 0 nothing changes, or, with `auto`, as much as
/// along the axis of the largest new size.
fn resized(old: DVec3, new: DVec3, auto: [bool; 3]) -> DVec3 {
    let factor = |axis: usize| if new[axis] > 0.0 && old[axis] > 0.0 { new[axis] / old[axis] } else { 1.0 };
    let largest = factor(new.max_position());
    DVec3::from([0, 1, 2].map(|axis| if auto[axis] && new[axis] <= 0.0 { largest } else { factor(axis) }))
}
