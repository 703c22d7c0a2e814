//! From the top objects down: one boolean expression over placed solids for each region.
//!
//! Source: BRL-CAD's rules as its manual "Volume III, Principles of Effective Modeling" (2003) and its databases show
//! them. The first region flag on a path starts a region; flags, colours and shaders inside it mean nothing. A solid
//! that is in no region is one of its own. Operators above regions act on regions as wholes: `(A u B) - C` is
//! `(A - C) u (B - C)`, two regions, named after `A` and `B`.

use std::collections::VecDeque;
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::boolean::{Expression, Step};
use super::colors::ColorTable;
use super::model::{Combination, Database, ObjectKind, Region, short};
use crate::error::{Error, Place, Result};

/// Most solids that all regions of a model may have together, and most steps that finding them may take, in units of
/// 16: a file of a few lines can describe more than any machine holds.
pub const MAX_LEAVES: u32 = 1 << 20;
/// Most names shown of a path.
pub(super) const SHOWN_NAMES: usize = 64;

/// A solid in place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSolid {
    /// Number of its object.
    pub object: u32,
    /// Solid space to the model's.
    pub transform: DAffine3,
}

/// One piece of material.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedRegion {
    /// Names from the top object down, each after a `/`.
    pub path: String,
    /// Its numbers.
    pub region: Region,
    /// Its colour, 0 to 1: its own or inherited, else the colour table's, else `None`.
    pub color: Option<DVec3>,
    /// Number of the object whose shader counts.
    pub shader: Option<u32>,
    /// Solids; some may be the same.
    pub solids: Vec<PlacedSolid>,
    /// Expression over numbers of `solids`.
    pub expression: Expression,
}

/// What cannot be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Name of the object.
    pub object: String,
    /// Where it is defined.
    pub place: Place,
    /// What is wrong with it.
    pub what: String,
}

/// The regions below the top objects, in BRL-CAD's order.
#[derive(Clone, Debug, Default)]
pub struct Regions {
    /// The regions; none is of air.
    pub regions: Vec<PlacedRegion>,
    /// Regions of air, which are left out.
    pub air: u64,
    /// What was left out because it cannot be shown, each object once.
    pub problems: Vec<Problem>,
}

/// What is inherited on the way down.
#[derive(Clone, Copy, Default)]
pub(super) struct State {
    pub color: Option<[u8; 3]>,
    color_is_fixed: bool,
    pub shader: Option<u32>,
    shader_is_fixed: bool,
}

impl State {
    /// A combination's own values overrule what came from above, unless one above said otherwise.
    fn below(mut self, object: u32, combination: &Combination) -> Self {
        if let (Some(rgb), false) = (combination.rgb, self.color_is_fixed) {
            (self.color, self.color_is_fixed) = (Some(rgb), combination.inherit);
        }
        if combination.shader.is_some() && !self.shader_is_fixed {
            (self.shader, self.shader_is_fixed) = (Some(object), combination.inherit);
        }
        self
    }
}

/// A region, or a solid outside of all, where it hangs in the tree.
pub(super) struct Leaf {
    pub object: u32,
    pub transform: DAffine3,
    pub state: State,
    pub region: Region,
    pub path: u32,
}

/// Expression over leaves.
#[derive(Clone, Copy)]
pub(super) enum Node {
    Leaf(u32),
    Both(Step, u32, u32),
}

/// A combination whose steps are being taken.
struct Frame {
    object: u32,
    step: usize,
    transform: DAffine3,
    state: State,
    path: u32,
}

pub(super) struct Walk<'a> {
    pub file: &'a Path,
    pub database: &'a Database,
    /// Its region colour table.
    pub colors: ColorTable,
    /// Whether each object is on the path from the top.
    pub on_path: Vec<bool>,
    /// Whether each object is among the problems already.
    is_problem: Vec<bool>,
    /// Parent and object of each name on a path.
    pub paths: Vec<(u32, u32)>,
    pub leaves: Vec<Leaf>,
    pub nodes: Vec<Node>,
    /// Steps still allowed.
    pub budget: u32,
    /// Solids placed.
    pub placed: u32,
    out: Regions,
}

/// Walks down from the objects `tops`; `file` is only for errors.
///
/// # Errors
/// A combination that contains itself, with its path; a model of more than [`MAX_LEAVES`] solids.
pub fn walk(file: &Path, database: &Database, tops: &[u32]) -> Result<Regions> {
    let objects = database.objects.len();
    let mut walk = Walk {
        file,
        database,
        colors: ColorTable::new(&database.colors),
        on_path: vec![false; objects],
        is_problem: vec![false; objects],
        paths: Vec::new(),
        leaves: Vec::new(),
        nodes: Vec::new(),
        budget: 16 * MAX_LEAVES,
        placed: 0,
        out: Regions::default(),
    };
    for &top in tops {
        for term in walk.terms(top)? {
            let region = walk.region(term)?;
            walk.out.regions.extend(region);
        }
    }
    Ok(walk.out)
}

impl Walk<'_> {
    /// What is united in `top`: regions, and what operators above regions make of them.
    fn terms(&mut self, top: u32) -> Result<VecDeque<u32>> {
        let mut values: Vec<VecDeque<u32>> = Vec::new();
        let mut frames: Vec<Frame> = Vec::new();
        self.meet(Some(top), DAffine3::IDENTITY, State::default(), u32::MAX, &mut values, &mut frames)?;
        let database = self.database;
        while let Some(frame) = frames.last_mut() {
            spend(&mut self.budget, self.file)?;
            let ObjectKind::Combination(combination) = &database.objects[frame.object as usize].kind else {
                frames.pop();
                continue;
            };
            let Some(&step) = combination.expression.steps().get(frame.step) else {
                self.on_path[frame.object as usize] = false;
                frames.pop();
                continue;
            };
            frame.step += 1;
            match step {
                Step::Member(i) => {
                    let member = &combination.members[i as usize];
                    let place = member.transform.as_deref().map_or(frame.transform, |m| frame.transform * *m);
                    let (state, path, object) = (frame.state, frame.path, frame.object);
                    let target = database.find(&member.name);
                    if target.is_none() {
                        self.missing(object, &member.name);
                    }
                    self.meet(target, place, state, path, &mut values, &mut frames)?;
                }
                Step::Empty => values.push(VecDeque::new()),
                operator => self.operate(operator, &mut values)?,
            }
        }
        Ok(values.pop().unwrap_or_default())
    }

    /// An object on the way down: leaves become values, combinations above regions are entered.
    fn meet(
        &mut self,
        object: Option<u32>,
        transform: DAffine3,
        state: State,
        above: u32,
        values: &mut Vec<VecDeque<u32>>,
        frames: &mut Vec<Frame>,
    ) -> Result<()> {
        let Some(object) = object else {
            values.push(VecDeque::new());
            return Ok(());
        };
        let path = self.paths.len() as u32;
        self.paths.push((above, object));
        let leaf = match &self.database.objects[object as usize].kind {
            ObjectKind::Solid(_) => Leaf { object, transform, state, region: Region::default(), path },
            ObjectKind::Unsupported(_) => {
                self.unsupported(object);
                values.push(VecDeque::new());
                return Ok(());
            }
            ObjectKind::Combination(combination) => {
                let state = state.below(object, combination);
                match combination.region {
                    None => {
                        self.enter(object, frames.iter().map(|frame| frame.object))?;
                        frames.push(Frame { object, step: 0, transform, state, path });
                        return Ok(());
                    }
                    Some(region) if region.air != 0 => {
                        self.out.air += 1;
                        values.push(VecDeque::new());
                        return Ok(());
                    }
                    Some(region) => Leaf { object, transform, state, region, path },
                }
            }
        };
        self.leaves.push(leaf);
        let node = self.node(Node::Leaf(self.leaves.len() as u32 - 1));
        values.push(VecDeque::from([node]));
        Ok(())
    }

    fn node(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// Applies an operator above regions to the two topmost values.
    fn operate(&mut self, operator: Step, values: &mut Vec<VecDeque<u32>>) -> Result<()> {
        let (Some(mut b), Some(mut a)) = (values.pop(), values.pop()) else { return Ok(()) };
        if operator == Step::Union {
            // The shorter list moves.
            if a.len() < b.len() {
                while let Some(term) = a.pop_back() {
                    b.push_front(term);
                }
                std::mem::swap(&mut a, &mut b);
            }
            a.append(&mut b);
            values.push(a);
            return Ok(());
        }
        let mut right = None;
        for term in b {
            right = Some(match right {
                None => term,
                Some(sum) => self.node(Node::Both(Step::Union, sum, term)),
            });
        }
        let Some(right) = right else {
            let empty = operator == Step::Intersection;
            values.push(if empty { VecDeque::new() } else { a });
            return Ok(());
        };
        if operator == Step::ExclusiveOr {
            // What is in exactly one of two unions cannot be split by terms: one region.
            let sum = a.into_iter().reduce(|sum, term| self.node(Node::Both(Step::Union, sum, term)));
            let both = sum.map_or(right, |left| self.node(Node::Both(Step::ExclusiveOr, left, right)));
            values.push(VecDeque::from([both]));
            return Ok(());
        }
        for term in &mut a {
            spend(&mut self.budget, self.file)?;
            *term = self.node(Node::Both(operator, *term, right));
        }
        values.push(a);
        Ok(())
    }

    /// Marks a combination as being on the path.
    pub fn enter(&mut self, object: u32, above: impl Iterator<Item = u32>) -> Result<()> {
        if !std::mem::replace(&mut self.on_path[object as usize], true) {
            return Ok(());
        }
        let name = |i: u32| short(&self.database.objects[i as usize].name);
        let cycle: Vec<String> = above.skip_while(|&i| i != object).take(SHOWN_NAMES).map(name).collect();
        let place = self.database.objects[object as usize].place;
        let what = format!("`{}` contains itself: {}/{}", name(object), cycle.join("/"), name(object));
        Err(Error::input(self.file, place, what))
    }

    pub fn missing(&mut self, object: u32, member: &str) {
        let what = format!("its member `{}` is defined nowhere", short(member));
        self.problem(object, what);
    }

    pub fn unsupported(&mut self, object: u32) {
        if let ObjectKind::Unsupported(kind) = &self.database.objects[object as usize].kind {
            let what = format!("the kind `{}` is not supported", short(kind));
            self.problem(object, what);
        }
    }

    fn problem(&mut self, object: u32, what: String) {
        if !std::mem::replace(&mut self.is_problem[object as usize], true) {
            let object = &self.database.objects[object as usize];
            self.out.problems.push(Problem { object: object.name.clone(), place: object.place, what });
        }
    }
}

pub(super) fn spend(budget: &mut u32, file: &Path) -> Result<()> {
    *budget = budget.checked_sub(1).ok_or_else(|| too_large(file))?;
    Ok(())
}

pub(super) fn too_large(file: &Path) -> Error {
    Error::whole(file, format!("the model has more than {MAX_LEAVES} solids when all its members are counted"))
        .with_help("choose a part of it with --top")
}
