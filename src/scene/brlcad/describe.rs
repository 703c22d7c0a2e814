//! A database's regions as a scene: one tree of solids for each, in BRL-CAD's order, with colour and shader.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::boolean::Step;
use super::boxes;
use super::lower::{self, TOLERANCE};
use super::model::{Database, ObjectKind};
use super::regions::{PlacedRegion, Problem, walk};
use super::shader::Shader;
use super::solid::Solid;
use super::tops::choose_tops;
use super::view::View;
use crate::error::{Error, Place, Result};
use crate::scene::description::{CameraDescription, Description, Item, ItemKind, Material, MaterialId, Precision};
use crate::scene::solids::flat::FlatTree;
use crate::scene::solids::{NodeId, NodeKind, SolidTree};

/// Azimuth and elevation of `rt`'s default view, degrees.
pub const DEFAULT_VIEW: (f64, f64) = (35.0, 25.0);
/// Most problems listed in an error.
const LISTED: usize = 10;

/// What a description keeps of a database: the looks of its regions, which are parts of object 0 in the same order.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    /// One for each part.
    pub regions: Vec<Look>,
    /// Box around all bounded regions: what `rt` frames.
    pub bounds: Option<(DVec3, DVec3)>,
    /// Shaders of regions that fill all space behind the others (`envmap`); their solids are not there.
    pub surroundings: Option<Shader>,
}

/// How a region looks.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// Its path, names after slashes.
    pub path: String,
    /// Region number.
    pub id: i32,
    /// Colour, 0 to 1; `None` if the database gives none.
    pub color: Option<DVec3>,
    /// Its shader; `None` if the database gives none.
    pub shader: Option<Shader>,
    /// For a region of one solid: where it stands, which is where a light of it shines from.
    pub centre: Option<DVec3>,
    /// Its box, if it is bounded.
    pub bounds: Option<(DVec3, DVec3)>,
    /// For a region of one arb: its corners in place.
    pub arb: Option<Box<[DVec3; 8]>>,
    /// Rotation and scale of its only solid's place: the direction a light of it aims in turns with it.
    pub place: DAffine3,
}

/// How to show a database.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Names of the objects to show; empty chooses as [`choose_tops`] says.
    pub tops: Vec<String>,
    /// Whether what cannot be shown is left out with a warning instead of being an error.
    pub lenient: bool,
}

/// The regions below the chosen objects of `database` as a scene called `name`.
///
/// # Errors
/// Unknown objects, cycles, models too large; without `lenient`, whatever cannot be shown, by kind, name and place.
pub fn describe(file: &Path, name: &str, database: &Database, options: &Options) -> Result<Description> {
    let tops = choose_tops(database, &options.tops)?;
    let mut found = walk(file, database, &tops)?;
    let mut description = Description::new(name);
    description.precision = Some(Precision::F64);
    description.warnings.clone_from(&database.warnings);
    let (mut looks, mut materials) = (Looks::default(), Materials::new());
    for region in &found.regions {
        let shader = region.shader.and_then(|object| shader_of(database, object));
        if let Some(surroundings) = shader.as_ref().filter(|shader| shader.name == "envmap") {
            looks.surroundings = Some(surroundings.clone());
            continue;
        }
        let tree = region_tree(database, region, &mut found.problems);
        let kind = ItemKind::Solids(description.solids.len() as u32);
        description.solids.push(Arc::new(tree));
        let material = material(&mut description, &mut materials, region.color);
        description.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material, kind });
        let look = look(database, region, shader);
        let all = [looks.bounds, look.bounds].into_iter().flatten();
        looks.bounds = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        looks.regions.push(look);
    }
    if found.air > 0 {
        description.warnings.push(format!("{} regions of air are left out", found.air));
    }
    report(file, &found.problems, options.lenient, &mut description)?;
    description.cameras.push(default_camera(looks.bounds));
    description.looks = Some(Arc::new(looks));
    Ok(description)
}

fn shader_of(database: &Database, object: u32) -> Option<Shader> {
    match &database.objects[object as usize].kind {
        ObjectKind::Combination(combination) => combination.shader.as_deref().map(Shader::parse),
        _ => None,
    }
}

/// How a region looks.
fn look(database: &Database, region: &PlacedRegion, shader: Option<Shader>) -> Look {
    let object = |i: usize| Some(&database.objects[region.solids.get(i)?.object as usize].kind);
    let solid = |i: usize| match object(i)? {
        ObjectKind::Solid(solid) => Some(solid),
        _ => None,
    };
    let bounds = boxes::of_region(region, |i| solid(i).map(|s| lower::bounds(s, &region.solids[i].transform)));
    let centre = match region.solids.as_slice() {
        [only] => solid(0).and_then(|solid| solid.centre()).map(|centre| only.transform.transform_point3(centre)),
        _ => None,
    };
    let arb = match (region.solids.as_slice(), solid(0)) {
        ([only], Some(Solid::Arb { points })) => Some(Box::new(points.map(|p| only.transform.transform_point3(p)))),
        _ => None,
    };
    Look {
        path: region.path.clone(),
        id: region.region.id,
        color: region.color,
        shader,
        centre,
        bounds,
        arb,
        place: region.solids.first().map_or(DAffine3::IDENTITY, |solid| solid.transform),
    }
}

/// Materials by the bits of their colours: each region of a large database may have one of its own.
type Materials = HashMap<[u64; 3], MaterialId>;

/// The material of a colour; `known` are those of this database.
fn material(description: &mut Description, known: &mut Materials, color: Option<DVec3>) -> Option<MaterialId> {
    let diffuse = color?;
    let id = *known.entry(diffuse.to_array().map(f64::to_bits)).or_insert_with(|| {
        let name = format!("color {:.0}/{:.0}/{:.0}", diffuse.x * 255.0, diffuse.y * 255.0, diffuse.z * 255.0);
        description.materials.push(Material { name, diffuse, ..Material::default() });
        description.materials.len() as MaterialId - 1
    });
    Some(id)
}

/// The region's expression over its solids; what cannot be built counts as empty and is a problem.
fn region_tree(database: &Database, region: &PlacedRegion, problems: &mut Vec<Problem>) -> SolidTree {
    let mut tree = SolidTree::new(region.path.clone());
    tree.id = region.region.id.into();
    tree.tolerance = TOLERANCE;
    let mut stack: Vec<Operand> = Vec::new();
    for &step in region.expression.steps() {
        let operand = match step {
            Step::Member(i) => {
                let placed = region.solids[i as usize];
                let object = &database.objects[placed.object as usize];
                let built = match &object.kind {
                    ObjectKind::Solid(solid) => lower::add(&mut tree, solid, &placed.transform),
                    _ => Err("not a solid".into()),
                };
                let node = built.unwrap_or_else(|what| {
                    if !problems.iter().rev().take(1000).any(|problem| problem.object == object.name) {
                        problems.push(Problem { object: object.name.clone(), place: object.place, what });
                    }
                    tree.op(NodeKind::Union(Vec::new()))
                });
                Operand { node, is_chain: false }
            }
            Step::Empty => Operand { node: tree.op(NodeKind::Union(Vec::new())), is_chain: false },
            operator => {
                let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                apply(&mut tree, operator, a, b)
            }
        };
        stack.push(operand);
    }
    tree.root = stack.pop().map_or(0, |operand| operand.node);
    if let Err(what) = FlatTree::new(&tree) {
        let place = region.solids.first().map_or(Place::Whole, |s| database.objects[s.object as usize].place);
        problems.push(Problem { object: region.path.clone(), place, what });
        tree.nodes.clear();
        tree.root = tree.op(NodeKind::Union(Vec::new()));
    }
    tree
}

/// A value of the expression.
#[derive(Clone, Copy)]
struct Operand {
    node: NodeId,
    /// Whether [`apply`] made the node. A member may be an operation too, but one with a place of its own, which must not move
    /// what stands beside the member.
    is_chain: bool,
}

/// An operator on two values; a chain of one operator becomes one node with many operands.
fn apply(tree: &mut SolidTree, operator: Step, a: Operand, b: Operand) -> Operand {
    if a.is_chain {
        match (operator, &mut tree.nodes[a.node as usize].kind) {
            (Step::Union, NodeKind::Union(list))
            | (Step::Intersection, NodeKind::Intersection(list))
            | (Step::Difference, NodeKind::Difference(list)) => {
                list.push(b.node);
                return a;
            }
            _ => {}
        }
    }
    let operands = vec![a.node, b.node];
    let kind = match operator {
        Step::Union => NodeKind::Union(operands),
        Step::Intersection => NodeKind::Intersection(operands),
        Step::Difference => NodeKind::Difference(operands),
        _ => NodeKind::Xor(operands),
    };
    Operand { node: tree.op(kind), is_chain: true }
}

/// Problems as warnings, or as one error at the place of the first.
fn report(file: &Path, problems: &[Problem], lenient: bool, description: &mut Description) -> Result<()> {
    let line = |problem: &Problem| match problem.place {
        Place::LineColumn { line, .. } => format!("`{}` (line {line}): {}", problem.object, problem.what),
        Place::Byte(at) => format!("`{}` (byte {at}): {}", problem.object, problem.what),
        Place::Whole => format!("`{}`: {}", problem.object, problem.what),
    };
    let Some(first) = problems.first() else { return Ok(()) };
    if lenient {
        description.warnings.extend(problems.iter().take(100).map(|p| format!("left out: {}", line(p))));
        return Ok(());
    }
    let mut what = format!("`{}`: {}", first.object, first.what);
    for other in problems.iter().skip(1).take(LISTED) {
        what = format!("{what}\n  also {}", line(other));
    }
    if problems.len() > LISTED + 1 {
        what = format!("{what}\n  and {} more", problems.len() - LISTED - 1);
    }
    Err(Error::input(file, first.place, what).with_help("--lenient shows the rest"))
}

/// `rt`'s default view as a camera. It samples the centres of pixels; only views as such sample as `rt` does.
fn default_camera(bounds: Option<(DVec3, DVec3)>) -> CameraDescription {
    let (az, el) = DEFAULT_VIEW;
    let bounds = bounds.unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    View::around(bounds, az.to_radians(), el.to_radians()).camera("default", 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::transformed_bounds;
    use crate::scene::brlcad::parse;

    /// Box of the solids of the only region, whose tree is `tree`.
    fn bounds(tree: &str) -> (DVec3, DVec3) {
        let text = format!(
            "title {{t}}\nunits mm\nput part part V {{0 0 0}} H {{10 0 0}} r_V 3 r_H 2\n\
             put pipe pipe V0 {{0 0 0}} O0 6 I0 0 R0 5 V1 {{10 0 0}} O1 6 I1 0 R1 5\n\
             put box arb8 V1 {{-5 -5 -5}} V2 {{-5 5 -5}} V3 {{-5 5 5}} V4 {{-5 -5 5}} V5 {{5 -5 -5}} V6 {{5 5 -5}} \
             V7 {{5 5 5}} V8 {{5 -5 5}}\nput r comb region yes tree {tree}\n"
        );
        let database = parse(Path::new("d.asc"), text.as_bytes()).unwrap();
        let description = describe(Path::new("d.asc"), "d", &database, &Options::default()).unwrap();
        let flat = FlatTree::new(&description.solids[0]).unwrap();
        let boxes = flat.leaves.iter().map(|leaf| {
            let (lo, hi) = leaf.solid.bounds();
            transformed_bounds(&leaf.to_tree, lo, hi)
        });
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap()
    }

    #[test]
    fn the_place_of_a_member_moves_no_other_one() {
        let moved = |name: &str, x: f64| format!("{{l {name} {{1 0 0 {x} 0 1 0 0 0 0 1 0 0 0 0 1}}}}");
        for (name, end) in [("part", 112.0), ("pipe", 110.0)] {
            let there = moved(name, 100.0);
            // The box as it is, moved, and both twice.
            for (other, low, twice) in
                [("{l box}", -5.0, false), (&moved("box", -20.0), -25.0, false), ("{l box}", -5.0, true)]
            {
                let orders = [[&there, other], [other, &there]].map(|[a, b]| match twice {
                    true => format!("{{u {{u {a} {b}}} {{u {a} {b}}}}}"),
                    false => format!("{{u {a} {b}}}"),
                });
                for tree in orders {
                    let (lo, hi) = bounds(&tree);
                    let (low, high) = (DVec3::new(low, -5.0, -5.0), DVec3::new(end, 5.0, 5.0));
                    assert!(
                        (lo - low).abs().max_element() < 1e-9 && (hi - high).abs().max_element() < 1e-9,
                        "{tree}: {lo} {hi}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_chain_of_one_operator_is_one_operation() {
        let text = "title {t}\nunits mm\nput b ell V {0 0 0} A {1 0 0} B {0 1 0} C {0 0 1}\n\
                    put r comb region yes tree {u {u {u {l b} {l b}} {l b}} {l b}}\n";
        let database = parse(Path::new("d.asc"), text.as_bytes()).unwrap();
        let description = describe(Path::new("d.asc"), "d", &database, &Options::default()).unwrap();
        let tree = &description.solids[0];
        assert!(matches!(&tree.nodes[tree.root as usize].kind, NodeKind::Union(list) if list.len() == 4));
    }
}
