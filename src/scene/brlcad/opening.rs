//! Opens a region: one expression over placed solids, with all combinations below it followed.

use glam::{DAffine3, DVec3};

use super::boolean::{Expression, Step};
use super::model::ObjectKind;
use super::regions::{Leaf, MAX_LEAVES, Node, PlacedRegion, PlacedSolid, SHOWN_NAMES, Walk, spend, too_large};
use crate::error::Result;

/// What is left to do, the last first.
enum Task {
    Node(u32),
    Step(Step),
}

impl Walk<'_> {
    /// The region that the expression `term` over leaves is: named and coloured after its first leaf.
    pub fn region(&mut self, term: u32) -> Result<Option<PlacedRegion>> {
        let (mut steps, mut solids, mut first) = (Vec::new(), Vec::new(), None);
        let mut tasks = vec![Task::Node(term)];
        while let Some(task) = tasks.pop() {
            spend(&mut self.budget, self.file)?;
            match task {
                Task::Step(step) => steps.push(step),
                Task::Node(node) => match self.nodes[node as usize] {
                    Node::Leaf(leaf) => {
                        first.get_or_insert(leaf);
                        let Leaf { object, transform, .. } = self.leaves[leaf as usize];
                        self.solids(object, transform, &mut steps, &mut solids)?;
                    }
                    Node::Both(step, a, b) => tasks.extend([Task::Step(step), Task::Node(b), Task::Node(a)]),
                },
            }
        }
        let Some(leaf) = first.map(|leaf| &self.leaves[leaf as usize]) else { return Ok(None) };
        let channel = |c: u8| f64::from(c);
        let own = leaf.state.color.map(|rgb| DVec3::from(rgb.map(channel)) / 255.0);
        // BRL-CAD rounds the table's bytes, and only those, to the middle of their step.
        let listed = || self.colors.color_of(leaf.region.id).map(|rgb| (DVec3::from(rgb.map(channel)) + 0.5) / 255.0);
        Ok(Some(PlacedRegion {
            path: self.path(leaf.path),
            region: leaf.region,
            color: own.or_else(listed),
            shader: leaf.state.shader,
            solids,
            expression: Expression::new(steps).unwrap_or_default(),
        }))
    }

    /// The steps of a region's (or solid's) own expression with all combinations below it opened.
    fn solids(
        &mut self,
        object: u32,
        transform: DAffine3,
        steps: &mut Vec<Step>,
        solids: &mut Vec<PlacedSolid>,
    ) -> Result<()> {
        let mut frames: Vec<(u32, usize, DAffine3)> = Vec::new();
        let database = self.database;
        let mut next = Some((Some(object), transform));
        loop {
            if let Some((object, transform)) = next.take() {
                match object.map(|i| (i, &database.objects[i as usize].kind)) {
                    None => steps.push(Step::Empty),
                    Some((object, ObjectKind::Solid(_))) => {
                        self.placed += 1;
                        if self.placed > MAX_LEAVES {
                            return Err(too_large(self.file));
                        }
                        steps.push(Step::Member(solids.len() as u32));
                        solids.push(PlacedSolid { object, transform });
                    }
                    Some((object, ObjectKind::Unsupported(_))) => {
                        self.unsupported(object);
                        steps.push(Step::Empty);
                    }
                    Some((object, ObjectKind::Combination(_))) => {
                        self.enter(object, frames.iter().map(|frame| frame.0))?;
                        frames.push((object, 0, transform));
                    }
                }
            }
            let Some((object, step, transform)) = frames.last_mut() else { return Ok(()) };
            spend(&mut self.budget, self.file)?;
            let ObjectKind::Combination(combination) = &database.objects[*object as usize].kind else { return Ok(()) };
            match combination.expression.steps().get(*step) {
                Some(&Step::Member(i)) => {
                    *step += 1;
                    let member = &combination.members[i as usize];
                    let target = database.find(&member.name);
                    if target.is_none() {
                        let object = *object;
                        let place = *transform;
                        self.missing(object, &member.name);
                        next = Some((None, place));
                    } else {
                        let place = member.transform.as_deref().map_or(*transform, |m| *transform * *m);
                        next = Some((target, place));
                    }
                }
                Some(&operator) => {
                    *step += 1;
                    steps.push(operator);
                }
                None => {
                    self.on_path[*object as usize] = false;
                    frames.pop();
                }
            }
        }
    }

    fn path(&self, mut at: u32) -> String {
        let mut names = Vec::new();
        while let Some(&(above, object)) = self.paths.get(at as usize) {
            if names.len() == SHOWN_NAMES {
                names.push("...".into());
                break;
            }
            names.push(self.database.objects[object as usize].name.clone());
            at = above;
        }
        names.reverse();
        names.iter().map(|name| format!("/{name}")).collect()
    }
}
