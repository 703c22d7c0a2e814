//! What a database holds, before anything is placed: objects by name, the region colour table, title and units.

use std::collections::HashMap;

use glam::DAffine3;

use super::boolean::Expression;
use super::solid::Solid;
use crate::error::Place;

/// Most warnings kept.
const MAX_WARNINGS: usize = 100;

/// A database. All lengths are millimetres, whatever its units.
#[derive(Clone, Debug, Default)]
pub struct Database {
    /// Title, one line.
    pub title: String,
    /// Units for display (`mm`, `in`, ...).
    pub units: String,
    /// All objects in the order of the file. Names are unique.
    pub objects: Vec<Object>,
    /// Colours of regions that have none, by region number, in the order of the file: a later entry wins.
    pub colors: Vec<ColorRange>,
    /// Attributes of the database itself.
    pub attributes: Attributes,
    /// What was passed over, for the user.
    pub warnings: Vec<String>,
    /// Object numbers by name.
    index: HashMap<String, u32>,
}

/// Names and values in the order of the file.
pub type Attributes = Vec<(String, String)>;

/// A named object.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name.
    pub name: String,
    /// Where it is defined.
    pub place: Place,
    /// What it is.
    pub kind: ObjectKind,
    /// Attributes that have no field of their own.
    pub attributes: Attributes,
}

/// What an object is.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectKind {
    /// A solid that this program knows.
    Solid(Solid),
    /// A boolean combination of others.
    Combination(Box<Combination>),
    /// Something this program cannot show, by BRL-CAD's name for the kind.
    Unsupported(String),
}

/// A combination: a boolean expression over other objects, with what belongs to its look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Combination {
    /// The expression; its leaves are numbers of `members`.
    pub expression: Expression,
    /// The members.
    pub members: Vec<Member>,
    /// Set if the combination is a region: one piece of material.
    pub region: Option<Region>,
    /// Its colour.
    pub rgb: Option<[u8; 3]>,
    /// Its shader as written: a name and parameters, in the old form or as a Tcl list.
    pub shader: Option<String>,
    /// Whether colour and shader given here overrule those below.
    pub inherit: bool,
}

/// Use of an object in a combination.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Name of the object.
    pub name: String,
    /// Member space to the combination's space; `None` is the identity.
    pub transform: Option<Box<DAffine3>>,
}

/// What makes a combination a region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// Region number.
    pub id: i32,
    /// Not 0 for regions of air.
    pub air: i32,
    /// Line-of-sight percentage.
    pub los: i32,
    /// Material number.
    pub material: i32,
}

/// One entry of the region colour table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorRange {
    /// First region number.
    pub low: i32,
    /// Last region number.
    pub high: i32,
    /// The colour.
    pub rgb: [u8; 3],
}

impl Database {
    /// Adds an object; one of the same name is replaced and stays where it was.
    pub(super) fn add(&mut self, object: Object) {
        if let Some(&old) = self.index.get(&object.name) {
            self.warn(format!("`{}` is defined twice: the later one counts", short(&object.name)));
            self.objects[old as usize] = object;
        } else {
            self.index.insert(object.name.clone(), self.objects.len() as u32);
            self.objects.push(object);
        }
    }

    /// Keeps a warning; beyond a hundred of them only the first hundred.
    pub(super) fn warn(&mut self, what: String) {
        if self.warnings_left() > 0 {
            self.warnings.push(what);
        }
    }

    /// How many more warnings are kept.
    pub(super) fn warnings_left(&self) -> usize {
        MAX_WARNINGS.saturating_sub(self.warnings.len())
    }

    /// Number of the object called `name`.
    pub fn find(&self, name: &str) -> Option<u32> {
        self.index.get(name).copied()
    }

    /// Colour that the table gives to region number `id`: looks through all of it.
    pub fn color_of(&self, id: i32) -> Option<[u8; 3]> {
        self.colors.iter().rev().find(|range| (range.low..=range.high).contains(&id)).map(|range| range.rgb)
    }

    /// Number of objects of each sort: solids, combinations, regions among them, unsupported ones.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for object in &self.objects {
            match &object.kind {
                ObjectKind::Solid(_) => counts.solids += 1,
                ObjectKind::Combination(c) => {
                    counts.combinations += 1;
                    counts.regions += usize::from(c.region.is_some());
                }
                ObjectKind::Unsupported(_) => counts.unsupported += 1,
            }
        }
        counts
    }
}

/// See [`Database::counts`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Solids this program knows.
    pub solids: usize,
    /// Combinations.
    pub combinations: usize,
    /// Regions among the combinations.
    pub regions: usize,
    /// Objects of other kinds.
    pub unsupported: usize,
}

/// A name for messages: cut to 60 characters.
pub(super) fn short(name: &str) -> String {
    const CHARS: usize = 60;
    let mut text: String = name.chars().take(CHARS).flat_map(char::escape_debug).collect();
    if name.chars().nth(CHARS).is_some() {
        text.push('…');
    }
    text
}
