//! Trees of solids as the oracle sees them: every leaf's intervals on the line, the operations evaluated between
//! neighbouring ends (Roth, "Ray casting for modeling solids", 1982).

mod leaf;
mod meshes;
mod tori;
pub(super) mod verdict;

use std::sync::Arc;

use glam::DAffine3;

use super::spans::{Crossing, Span};
use super::tree::Bounds;
use super::{OracleRay, magnitude};
use crate::scene::solids::Solid;
use crate::scene::solids::flat::{FlatTree, Operator, Step};

/// Boundaries closer than this, relative to coordinates, are one: the rounding of this floor.
const OWN: f64 = 1.0 / (1u64 << 44) as f64;

/// A leaf with its place in the object.
#[derive(Clone, Debug)]
struct Leaf {
    solid: Solid,
    to_object: DAffine3,
    to_local: DAffine3,
    bounds: Bounds,
}

/// A tree of solids in an object.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Primitive number of leaf 0.
    pub first_prim: u32,
    leaves: Vec<Leaf>,
    program: Arc<FlatTree>,
    /// Least distance of two boundaries in object space.
    tolerance: f64,
    /// Box of all leaves.
    pub bounds: Bounds,
}

/// A boundary of the whole tree on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Boundary {
    pub t: f64,
    /// Leaf whose surface it is.
    pub leaf: u32,
    pub face: u32,
    /// Whether the line enters the whole.
    pub enters: bool,
    /// Whether the leaf's normal points into the whole.
    pub turned: bool,
}

/// An end of a leaf's interval.
#[derive(Clone, Copy, Debug)]
struct End {
    t: f64,
    leaf: u32,
    face: u32,
}

impl Tree {
    pub fn new(first_prim: u32, flat: &Arc<FlatTree>, to_object: &DAffine3) -> Self {
        let leaves: Vec<Leaf> = flat
            .leaves
            .iter()
            .map(|leaf| {
                let to_object = *to_object * leaf.to_tree;
                let (lo, hi) = leaf.solid.bounds();
                let local = Bounds { lo, hi };
                let bounds = match local.is_finite() {
                    true => Bounds::of(local.corners().map(|p| to_object.transform_point3(p))),
                    false => Bounds::ALL,
                };
                Leaf { solid: leaf.solid.clone(), to_object, to_local: to_object.inverse(), bounds }
            })
            .collect();
        let bounds = leaves.iter().map(|l| l.bounds).reduce(Bounds::union).unwrap_or(Bounds::EMPTY);
        let outside = Self::evaluate(flat, |_| false);
        let bounds = if outside { Bounds::ALL } else { bounds };
        let tolerance = flat.tolerance * to_object.matrix3.determinant().abs().cbrt();
        Self { first_prim, leaves, program: flat.clone(), tolerance, bounds }
    }

    /// Whether a point is inside, given which leaves it is in.
    fn evaluate(program: &FlatTree, inside: impl Fn(u32) -> bool) -> bool {
        let mut stack: Vec<bool> = Vec::new();
        for step in &program.steps {
            let value = match *step {
                Step::Leaf(leaf) => inside(leaf),
                Step::Op(operator, count) => {
                    let operands = stack.split_off(stack.len().saturating_sub(count as usize));
                    match operator {
                        Operator::Union => operands.contains(&true),
                        Operator::Intersection => !operands.is_empty() && !operands.contains(&false),
                        Operator::Difference => operands.first() == Some(&true) && !operands[1..].contains(&true),
                        Operator::Xor => operands.iter().filter(|v| **v).count() % 2 == 1,
                        Operator::Complement => operands.first() == Some(&false),
                    }
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(false)
    }

    /// Intervals of leaf `leaf` on the line of `ray` (object space).
    fn intervals(&self, leaf: u32, ray: &OracleRay) -> Vec<Span> {
        let Leaf { solid, to_local, .. } = &self.leaves[leaf as usize];
        let local = ray.transformed(to_local);
        leaf::intervals(solid, local.org, local.dir)
    }

    /// Leaves whose boxes, widened by `pad`, the line meets.
    fn met<'a>(&'a self, ray: &OracleRay, pad: f64) -> impl Iterator<Item = u32> + use<'a> {
        let line = OracleRay { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, ..*ray };
        let meets = move |leaf: &Leaf| {
            let own = pad + OWN * (leaf.bounds.magnitude().max_element() + line.org.abs().max_element());
            !leaf.bounds.is_finite() || leaf.bounds.entry(&line, f64::INFINITY, own).is_some()
        };
        (0..self.leaves.len() as u32).filter(move |&i| meets(&self.leaves[i as usize]))
    }

    /// Boundaries of the whole on the line of `ray` (object space), in order; those closer than the tree's tolerance
    /// plus `more` (distances in object space) are one. Below zero `more` also takes this floor's own rounding away: engines in
    /// f64 tell apart what lies closer than that.
    pub fn boundaries(&self, ray: &OracleRay, more: f64) -> Vec<Boundary> {
        self.boundaries_each(ray, more, |_| *ray)
    }

    /// The same with a ray for each leaf, all of them near `ray` and with its direction.
    pub fn boundaries_each(&self, ray: &OracleRay, more: f64, own: impl Fn(u32) -> OracleRay) -> Vec<Boundary> {
        let mut inside_of: Vec<(u32, Vec<Span>)> = Vec::new();
        let mut ends: Vec<End> = Vec::new();
        let mut size = ray.org.abs().max_element();
        for leaf in self.met(ray, 0.0) {
            let spans = self.intervals(leaf, &own(leaf));
            let bounds = &self.leaves[leaf as usize].bounds;
            if bounds.is_finite() && !spans.is_empty() {
                size = size.max(bounds.magnitude().max_element());
            }
            let both = spans.iter().flat_map(|s| [s.enter, s.leave]).filter(|c| c.t.is_finite());
            ends.extend(both.map(|c| End { t: c.t, leaf, face: c.face }));
            if !spans.is_empty() {
                inside_of.push((leaf, spans));
            }
        }
        ends.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.leaf.cmp(&b.leaf)));
        let least = if more < 0.0 { 0.0 } else { OWN * size };
        let apart = (self.tolerance + more).max(least) / ray.dir.abs().max_element();
        let mut groups: Vec<&[End]> = Vec::new();
        let mut rest = ends.as_slice();
        while let Some(first) = rest.first() {
            let (group, after) = rest.split_at(rest.partition_point(|e| e.t <= first.t + apart));
            groups.push(group);
            rest = after;
        }
        self.between(&groups, &inside_of)
    }

    /// Evaluates the operations between groups of ends.
    fn between(&self, groups: &[&[End]], inside_of: &[(u32, Vec<Span>)]) -> Vec<Boundary> {
        let at = |t: f64| {
            let holds = |spans: &[Span]| spans.iter().any(|s| s.enter.t <= t && t <= s.leave.t);
            inside_of.iter().filter(|(_, spans)| holds(spans)).map(|(leaf, _)| *leaf).collect::<Vec<u32>>()
        };
        let whole = |inside: &[u32]| Self::evaluate(&self.program, |leaf| inside.binary_search(&leaf).is_ok());
        let before_first = groups.first().map_or(0.0, |g| g[0].t - 1.0 - g[0].t.abs());
        let mut inside = at(before_first);
        let mut state = whole(&inside);
        let mut found = Vec::new();
        for (i, group) in groups.iter().enumerate() {
            let last = group[group.len() - 1].t;
            let next = groups.get(i + 1).map_or(last + 1.0 + last.abs(), |g| g[0].t);
            let after = at(0.5 * last + 0.5 * next);
            let now = whole(&after);
            if now != state {
                found.extend(self.seen(group, &inside, &after, now, &whole));
            }
            (inside, state) = (after, now);
        }
        found
    }

    /// Whose surface is seen where several leaves have ends: the first leaf that alone makes a difference, on either side.
    fn seen(
        &self,
        group: &[End],
        before: &[u32],
        after: &[u32],
        enters: bool,
        whole: &impl Fn(&[u32]) -> bool,
    ) -> Option<Boundary> {
        let has = |list: &[u32], leaf: u32| list.binary_search(&leaf).is_ok();
        let without = |list: &[u32], leaf: u32| {
            let mut other = list.to_vec();
            match other.binary_search(&leaf) {
                Ok(i) => drop(other.remove(i)),
                Err(i) => other.insert(i, leaf),
            }
            other
        };
        let alone = |leaf: u32| whole(&without(after, leaf)) != enters || whole(&without(before, leaf)) == enters;
        let changed = group.iter().filter(|e| has(before, e.leaf) != has(after, e.leaf));
        let end = changed.min_by_key(|e| (!alone(e.leaf), e.leaf))?;
        let turned = has(after, end.leaf) != enters;
        Some(Boundary { t: end.t, leaf: end.leaf, face: end.face, enters, turned })
    }

    /// Normal of a leaf's face at the ray's point (object space, unnormalised), out of the whole.
    pub fn normal(&self, ray: &OracleRay, boundary: &Boundary) -> glam::DVec3 {
        let Leaf { solid, to_local, .. } = &self.leaves[boundary.leaf as usize];
        let local = leaf::normal(solid, boundary.face, to_local.transform_point3(ray.at(boundary.t)));
        let ng = to_local.matrix3.transpose() * local;
        if boundary.turned { -ng } else { ng }
    }

    /// Whether the point of the ray at `t` (object space), on a leaf's surface, is within `reach` of its face `face`, which
    /// is flat: one may be as small as a point or seen in so narrow a wedge that no displaced ray meets it.
    pub fn in_face(&self, leaf: u32, face: f64, ray: &OracleRay, t: f64, reach: f64) -> bool {
        let Leaf { solid, to_local, .. } = &self.leaves[leaf as usize];
        let Some(face) = Some(face as u32).filter(|&number| f64::from(number) == face) else { return false };
        let distance = leaf::to_face(solid, face, to_local.transform_point3(ray.at(t)));
        distance.is_some_and(|d| d <= reach * magnitude::norm(to_local))
    }

    /// What a leaf's mesh is fatter by where the line of `ray` (object space) crosses it; 0 for all other leaves.
    pub fn blur(&self, leaf: u32, ray: &OracleRay) -> f64 {
        let Leaf { solid, to_object, to_local, .. } = &self.leaves[leaf as usize];
        let Solid::Mesh(mesh) = solid else { return 0.0 };
        let local = ray.transformed(to_local);
        leaf::blur(mesh, local.org, local.dir) * magnitude::norm(to_object)
    }

    /// Number of leaves, each a primitive number.
    pub fn leaf_count(&self) -> u32 {
        self.leaves.len() as u32
    }
}

impl Leaf {
    /// Largest coordinate that enters the computation of a ray against this leaf, object space, for points up to `raw`,
    /// times what its own formula loses.
    fn scale(&self, raw: glam::DVec3) -> f64 {
        let local = magnitude::point_back(&self.to_object, &self.to_local, raw);
        let object = raw.max(magnitude::point(&self.to_object, local));
        let loss = match &self.solid {
            // The quartic knows the tube only to the digits of the ring; the taper only to those of its wide end.
            Solid::Torus { minor } => 4.0 / minor,
            Solid::EllipticTorus { reach, lean } => 8.0 / (reach * (1.0 - lean.abs())),
            Solid::Taper { .. } => 16.0,
            Solid::Round { .. } | Solid::Trough { .. } => 4.0,
            Solid::Shape(_) | Solid::Polyhedron(_) | Solid::Mesh(_) => 1.0,
        };
        object.max_element() * loss
    }
}

/// Ends of intervals, in order: the even ones enter.
fn ends(spans: &[Span]) -> Vec<Crossing> {
    spans.iter().flat_map(|s| [s.enter, s.leave]).collect()
}
