//! Trees of solids before the judge.
//!
//! A tree's answer on a line can change at once where surfaces touch, so it is compared with the answers of *variants* of
//! the ray: displaced by up to delta (the reach of rounding, as everywhere in this floor), for all leaves alike or for
//! each by itself, with boundaries closer than up to [`GROUPING`] delta taken as one, as engines do.

use super::super::judge::{EngineHit, Why};
use super::super::margin::{Id, Margin};
use super::super::object::Prim;
use super::super::{Oracle, OracleHit, OracleRay, Placed, magnitude};
use super::{Boundary, Tree, ends};

/// Engines take boundaries closer than 16 roundings of |origin| + size as one: at most four times delta.
const GROUPING: f64 = 4.5;
/// Directions of displacement, by delta and by half of it.
const DIRECTIONS: u32 = 16;
/// Variants in which every leaf sees a displaced ray of its own.
const SCATTERED: u32 = 512;
/// Sine of the angle between ray and surface above which t is as certain as the surface.
const GRAZING: f64 = 1e-3;

/// The trees of a scene and the ray they are judged on.
#[derive(Clone, Copy)]
pub(in super::super) struct Trees<'a> {
    pub oracle: &'a Oracle,
    pub ray: &'a OracleRay,
    pub margin: Margin,
}

/// A tree with its placement.
#[derive(Clone, Copy)]
pub(in super::super) struct PlacedTree<'a> {
    placed: &'a Placed,
    tree: &'a Tree,
    /// The leaf asked for.
    leaf: u32,
}

/// A tree's boundaries on one variant of the ray.
struct Variant {
    boundaries: Vec<Boundary>,
    displaced: bool,
    grouped: bool,
}

type Finding<T> = Result<T, String>;

impl<'a> Trees<'a> {
    /// The tree that a primitive number belongs to.
    pub fn find(&self, id: Id) -> Option<PlacedTree<'a>> {
        let placed = self.oracle.placements.get(id.inst as usize)?;
        let object = &self.oracle.objects[placed.object as usize];
        let Prim::Leaf(tree) = object.prim(id.prim) else { return None };
        let tree = &object.trees[tree as usize];
        Some(PlacedTree { placed, tree, leaf: id.prim - tree.first_prim })
    }

    /// All trees whose boxes the segment comes near.
    fn near(&self) -> impl Iterator<Item = PlacedTree<'a>> {
        let trees = |placed: &'a Placed| {
            let object = &self.oracle.objects[placed.object as usize];
            object.trees.iter().map(move |tree| PlacedTree { placed, tree, leaf: 0 })
        };
        self.oracle.placements.iter().flat_map(trees).filter(|t| {
            let local = self.ray.transformed(&t.placed.to_object);
            let pad = 8.0 * self.delta(t, f64::INFINITY) * magnitude::norm(&t.placed.to_object);
            !t.tree.bounds.is_finite() || t.tree.bounds.entry(&local, local.t_max, pad).is_some()
        })
    }

    /// Reach of rounding for a tree on this ray, world distance: that of the leaf it is largest for. What has no bounds is
    /// as large as the place `at` which is looked at.
    fn delta(&self, t: &PlacedTree, at: f64) -> f64 {
        let local = self.ray.transformed(&t.placed.to_object);
        let size = t.tree.bounds.magnitude().max_element();
        let pad = if size.is_finite() { 1e-3 * size } else { 0.0 };
        let met: Vec<u32> = t.tree.met(&local, pad).collect();
        let mut raw = self.ray.org.abs();
        for &leaf in &met {
            let size = t.placed.bounds(t.tree.leaves[leaf as usize].bounds).magnitude();
            let place = if at.is_finite() { self.ray.at(at).abs() } else { raw };
            raw = raw.max(if size.is_finite() { size } else { place });
        }
        let object = magnitude::point_back(&t.placed.to_world, &t.placed.to_object, raw);
        let own = |&leaf: &u32| t.tree.leaves[leaf as usize].scale(object);
        let scale = met.iter().map(own).fold(object.max_element(), f64::max);
        let world = magnitude::point(&t.placed.to_world, glam::DVec3::splat(scale)).max(raw);
        self.margin.delta(world.max_element())
    }

    /// How far the oracle itself may be off beside the edges of meshes, world distance: a ray has to be displaced by that
    /// much more to be seen beside them.
    fn blur(&self, t: &PlacedTree) -> f64 {
        let local = self.ray.transformed(&t.placed.to_object);
        t.tree.met(&local, 0.0).map(|leaf| t.tree.blur(leaf, &local)).fold(0.0, f64::max)
            * magnitude::norm(&t.placed.to_world)
    }

    /// The ray and its displaced copies in the tree's space.
    fn displaced(&self, t: &PlacedTree, delta: f64) -> Vec<OracleRay> {
        let (a, b) = self.ray.dir.normalize().any_orthonormal_pair();
        let circle = |count: u32, radius: f64| {
            (0..count).map(move |i| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(count)).sin_cos();
                radius * (cos * a + sin * b)
            })
        };
        let offsets = circle(1, 0.0).chain(circle(DIRECTIONS, delta)).chain(circle(DIRECTIONS / 2, 0.5 * delta));
        offsets.map(|w| OracleRay { org: self.ray.org + w, ..*self.ray }.transformed(&t.placed.to_object)).collect()
    }

    fn variants(&self, t: &PlacedTree, delta: f64) -> impl Iterator<Item = Variant> {
        let shrink = magnitude::norm(&t.placed.to_object);
        let groupings = [0.0, 0.25, 0.5, 1.0, -0.25, -1.0].map(|f| f * GROUPING * delta * shrink);
        let tree = t.tree;
        let rays = self.displaced(t, delta);
        let apart = rays.clone();
        let together = groupings.into_iter().flat_map(move |more| {
            let rays = rays.clone();
            rays.into_iter().enumerate().map(move |(i, ray)| Variant {
                boundaries: tree.boundaries(&ray, more),
                displaced: i > 0,
                grouped: more != 0.0,
            })
        });
        // Every leaf is rounded by itself: between two that touch, a ray along their common face may miss both.
        let each = (0..SCATTERED).map(move |pattern| {
            let own = |leaf: u32| apart[mixed(leaf, pattern) as usize % apart.len()];
            let more = groupings[pattern as usize % groupings.len()];
            Variant { boundaries: tree.boundaries_each(&apart[0], more, own), displaced: false, grouped: true }
        });
        together.chain(each)
    }

    fn along(&self, delta: f64) -> f64 {
        delta / self.ray.dir.length()
    }

    /// How far grouping may move a boundary along the ray.
    fn window(&self, t: &PlacedTree, delta: f64) -> f64 {
        let tolerance = t.tree.tolerance * magnitude::norm(&t.placed.to_world);
        // Groups are as long as their distance along the direction's largest component.
        2.0 * (GROUPING * delta + tolerance) / self.ray.dir.abs().max_element()
    }

    /// The quick check: the same leaf, face and side, not edge-on, t within delta of the tangent plane's.
    pub fn agrees(&self, t: &PlacedTree, truth: &OracleHit, answer: &EngineHit) -> bool {
        let cosine = truth.ng.dot(self.ray.dir).abs() / (truth.ng.length() * self.ray.dir.length());
        let off = (answer.t - truth.t).abs() * self.ray.dir.length();
        let delta = self.delta(t, answer.t);
        let near = off <= delta || (cosine >= GRAZING && off * cosine <= delta);
        near && (answer.u, answer.v) == (truth.u, truth.v)
    }

    /// Rule 1: what was reported is there: the leaf's own surface with that face, and a boundary of the whole on it.
    pub fn real(&self, t: &PlacedTree, answer: &EngineHit) -> Finding<Option<Why>> {
        if !(self.ray.t_min <= answer.t && answer.t <= self.ray.t_max) {
            return Err("reported t is outside the segment".into());
        }
        let delta = self.delta(t, answer.t) + self.blur(t);
        let (along, window) = (self.along(delta), self.window(t, delta));
        let (local, reach) = (self.ray.transformed(&t.placed.to_object), delta * magnitude::norm(&t.placed.to_object));
        let crossings: Vec<_> =
            self.displaced(t, delta).iter().map(|ray| ends(&t.tree.intervals(t.leaf, ray))).collect();
        let most = crossings.iter().map(Vec::len).max().unwrap_or(0);
        for k in 0..most {
            let (mut lo, mut hi, mut faces) = (f64::INFINITY, f64::NEG_INFINITY, Vec::new());
            let mut shortest = f64::INFINITY;
            for list in &crossings {
                if let Some(end) = list.get(k) {
                    (lo, hi) = (lo.min(end.t), hi.max(end.t));
                    faces.push(f64::from(end.face));
                    // Where a neighbour has no such pair the two ends meet on the way to it, anywhere between them.
                    let other = list[k ^ 1].t;
                    if (other - end.t).abs() < shortest && crossings.iter().any(|l| l.len() <= k) {
                        shortest = (other - end.t).abs();
                        (lo, hi) = (lo.min(other), hi.max(other));
                    }
                }
            }
            let face = faces.contains(&answer.u) || t.tree.in_face(t.leaf, answer.u, &local, answer.t, 2.0 * reach);
            let fits = lo - along <= answer.t && answer.t <= hi + along && face;
            if !fits {
                continue;
            }
            let on = |b: &&Boundary| lo - along - window <= b.t && b.t <= hi + along + window;
            let side = |b: &Boundary| f64::from(b.enters != (k % 2 == 0)) == answer.v;
            for variant in self.variants(t, delta) {
                if variant.boundaries.iter().filter(on).any(side) {
                    return Ok(variant.why());
                }
            }
        }
        Err(format!("reported leaf shows no boundary of its solid within {delta:e} of the reported point"))
    }

    /// Rule 2: every tree has a variant without a boundary before `until`.
    pub fn skipped(&self, until: f64) -> Finding<Option<Why>> {
        let mut reason = None;
        for t in self.near() {
            let local = self.ray.transformed(&t.placed.to_object);
            let own = Variant { boundaries: t.tree.boundaries(&local, 0.0), displaced: false, grouped: false };
            let first = own.boundaries.iter().find(|b| self.ray.t_min <= b.t).map_or(until, |b| b.t.min(until));
            let delta = self.delta(&t, first) + self.blur(&t);
            let slack = self.along(delta) + self.window(&t, delta);
            let clear = |variant: &Variant, slack: f64| {
                let (from, to) = (self.ray.t_min + slack, self.ray.t_max.min(until) - slack);
                !variant.boundaries.iter().any(|b| from <= b.t && b.t < to)
            };
            if clear(&own, 0.0) {
                continue;
            }
            if clear(&own, slack) {
                let at_end = own
                    .boundaries
                    .iter()
                    .any(|b| [self.ray.t_min, self.ray.t_max].iter().any(|end| (b.t - end).abs() <= slack));
                reason = reason.or(Some(if at_end { Why::SegmentEnd } else { Why::Coincident }));
                continue;
            }
            match self.variants(&t, delta).find(|variant| clear(variant, slack)) {
                Some(variant) => reason = variant.why().or(reason),
                None => {
                    let at = own.boundaries.first().map_or(f64::NAN, |b| b.t);
                    let prim = t.tree.first_prim;
                    return Err(format!(
                        "skipped the solid of primitive {prim} at t = {at}: no ray within {delta:e} misses it"
                    ));
                }
            }
        }
        Ok(reason)
    }

    /// Whether some tree has a variant with a boundary in the segment, and why.
    pub fn grazed(&self) -> Option<Why> {
        self.near().find_map(|t| {
            let delta = self.delta(&t, self.ray.t_max) + self.blur(&t);
            let slack = self.along(delta) + self.window(&t, delta);
            let (from, to) = (self.ray.t_min - slack, self.ray.t_max + slack);
            let touches = |v: &Variant| v.boundaries.iter().any(|b| from <= b.t && b.t <= to);
            self.variants(&t, delta).find(touches).map(|v| v.why().unwrap_or(Why::SegmentEnd))
        })
    }
}

/// A number that looks random (the finaliser of splitmix64: Steele, Lea, Flood, 2014).
fn mixed(a: u32, b: u32) -> u64 {
    let mut z = (u64::from(a) << 32 | u64::from(b)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Variant {
    /// Why an engine may answer as on this variant.
    fn why(&self) -> Option<Why> {
        match (self.displaced, self.grouped) {
            (true, _) => Some(Why::Tangent),
            (false, true) => Some(Why::Coincident),
            (false, false) => None,
        }
    }
}
