//! The oracle: closest hits in plain scalar f64, written apart from the engines it judges, and the judge that says
//! whether an engine's different answer is rounding or a fault.
//!
//! # The oracle
//! [`Oracle::closest`] intersects every primitive of every placement one after the other; from [`BRUTE_LIMIT`]
//! primitives on it walks median-split trees of its own. Triangles are found by their plane and Cramer's rule, solids
//! as intersections of spans ([`shapes`](self)); no formula is shared with an engine.
//!
//! # The judge
//! An engine computes in eps = 2^-24 (f32) or 2^-53 (f64), so it cannot tell geometry apart that differs by less than
//!
//! ```text
//! delta = K eps scale        K = 8 (MARGIN_FACTOR)
//! ```
//!
//! where `scale` is the largest coordinate that enters the computation for one primitive: of the ray's origin, of
//! the primitive's corners (of the hit, for a half-space), in world space, and of whatever they become on the way
//! through the placement's and the shape's transforms and back (`|M| |M^-1| |p|`, with absolute values of all matrix
//! elements). Where products of lengths underflow (below the square root of the smallest normal number), delta is
//! that length.
//!
//! An answer is *agreed* if it is the oracle's primitive and instance with t, u and v within rounding. Any other
//! answer is *explained* if rays displaced sideways by at most delta justify it, *unexplained* if not:
//!
//! 1. **What was reported is there.** The point of the ray at the engine's t lies within delta of the reported
//!    triangle; or the line passes the triangle within delta and its plane within delta of that point; or, for an
//!    analytic shape, the engine's t (give or take delta) is between the crossings of displaced
//!    rays with it. t is inside the segment, u and v fit.
//! 2. **What was skipped can be missed.** Every crossing of the true ray before the engine's t (or in the whole
//!    segment, if the engine reports a miss) is one of these: its surface also passes the engine's point within delta
//!    (*coincident*); it is within delta of an end of the segment (*segment end*); or there is a displaced ray that
//!    misses it. Displacing must miss the whole *sheet*: the primitive and all triangles near the ray that are joined
//!    to it over common edges. So a leak through the edge between two triangles is never explained, for no displaced
//!    ray leaks, while rays past a silhouette, an open border or a T-junction are.
//!
//! Any-hit answers are judged by the same two rules with the segment's end for t.
//!
//! Trees of solids are judged as wholes: an answer is explained if rays displaced by at most delta, with boundaries that
//! are up to the engine's own grouping distance apart taken as one or not, give it (`solids::verdict`).

mod judge;
mod magnitude;
mod margin;
mod nearest;
mod object;
mod shapes;
mod solids;
mod spans;
mod tally;
mod tree;

use glam::{DAffine3, DVec3};

pub use judge::{EngineHit, Verdict, Why};
pub use margin::MARGIN_FACTOR;
use object::{LocalHit, Object};
pub use tally::Tally;
use tree::{Bounds, Tree};

use crate::scene::assembly::Assembly;

/// Number of primitives, over all placements, from which the oracle uses its trees.
pub const BRUTE_LIMIT: u64 = 100_000;

/// A ray as the oracle takes it: world space, f64, widened exactly from what the engine got.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleRay {
    /// Origin.
    pub org: DVec3,
    /// Direction, need not be unit.
    pub dir: DVec3,
    /// Start of the closed segment, in multiples of `dir`.
    pub t_min: f64,
    /// End of the closed segment; may be infinite.
    pub t_max: f64,
}

impl OracleRay {
    /// Whether the ray can hit anything: finite, a direction, a segment that is not empty.
    pub fn is_live(&self) -> bool {
        self.org.is_finite() && self.dir.is_finite() && self.dir != DVec3::ZERO && self.t_min <= self.t_max
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.org + t * self.dir
    }

    /// The ray in another space, with the same t.
    fn transformed(&self, map: &DAffine3) -> Self {
        Self { org: map.transform_point3(self.org), dir: map.transform_vector3(self.dir), ..*self }
    }
}

/// The true closest hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleHit {
    /// Ray parameter.
    pub t: f64,
    /// Primitive number in the instance's object.
    pub prim: u32,
    /// Placement number.
    pub inst: u32,
    /// Triangles: weight of the second corner. Analytic shapes: number of the face.
    pub u: f64,
    /// Triangles: weight of the third corner. Analytic shapes: 0; leaves of solids: 1 where the surface was subtracted.
    pub v: f64,
    /// Geometric normal in world space, as wound or outward, unnormalised.
    pub ng: DVec3,
    /// Analytic shapes: number of the face. Sphere, half-space and disc 0; cuboid 0..5 = -x, +x, -y, +y, -z, +z;
    /// cylinder and cone 0 the side, 1 the cap z = 0, 2 the cap z = 1. Triangles: 0.
    pub face: u32,
}

/// How the oracle looks for primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// All of them, one after the other.
    Brute,
    /// Over median-split trees.
    Tree,
}

#[derive(Clone, Copy, Debug)]
struct Placed {
    object: u32,
    to_world: DAffine3,
    to_object: DAffine3,
}

/// The f64 oracle of one scene.
#[derive(Clone, Debug)]
pub struct Oracle {
    objects: Vec<Object>,
    placements: Vec<Placed>,
    tree: Tree,
    margin_factor: f64,
    reach: Reach,
}

/// The scale of any primitive seen from `org` is at most `per_org |org| + constant`: what the boxes of placements are
/// grown by when the judge looks for near primitives.
#[derive(Clone, Copy, Debug, Default)]
struct Reach {
    per_org: f64,
    constant: f64,
}

impl Oracle {
    /// The oracle of `assembly`: brute force below [`BRUTE_LIMIT`] primitives, trees from there on.
    pub fn new(assembly: &Assembly) -> Self {
        let brute = assembly.instanced_prims() < BRUTE_LIMIT;
        Self::with_search(assembly, if brute { Search::Brute } else { Search::Tree })
    }

    /// The oracle of `assembly` with a given way of searching; the answers are the same.
    pub fn with_search(assembly: &Assembly, search: Search) -> Self {
        let objects: Vec<_> = assembly.objects.iter().map(|object| Object::new(object, search)).collect();
        let placements: Vec<_> = assembly.placements.iter().map(Placed::new).collect();
        let bounds: Vec<_> = objects.iter().map(Object::bounds).collect();
        let solid = |i: &u32| bounds[placements[*i as usize].object as usize].is_some();
        let items = (0..placements.len() as u32).filter(solid).collect();
        let placed_bounds = |i: u32| {
            let placed: &Placed = &placements[i as usize];
            bounds[placed.object as usize].map_or(Bounds::EMPTY, |b| placed.bounds(b))
        };
        let tree = match search {
            Search::Brute => Tree::flat(items),
            Search::Tree => Tree::build(items, placed_bounds),
        };
        let mut reach = Reach::default();
        for placed in &placements {
            let growth = objects[placed.object as usize].solid_growth;
            let size = bounds[placed.object as usize].filter(Bounds::is_finite).map_or(DVec3::ZERO, |b| b.magnitude());
            reach.constant = reach.constant.max(placed.scale(size, DVec3::ZERO, growth));
            reach.per_org = reach.per_org.max(placed.growth() * growth);
        }
        Self { tree, objects, placements, margin_factor: MARGIN_FACTOR, reach }
    }

    /// The same oracle judging with another margin factor K, for experiments on how large K must be.
    #[must_use]
    pub fn with_margin_factor(self, k: f64) -> Self {
        Self { margin_factor: k, ..self }
    }

    /// The closest hit in the closed segment `t_min..=t_max` of the ray `org + t dir`, world space; ties go to the
    /// smaller t, then the smaller instance, then the smaller primitive. Rays that are not finite, have no direction
    /// or an empty segment miss.
    pub fn closest(&self, org: DVec3, dir: DVec3, t_min: f64, t_max: f64) -> Option<OracleHit> {
        self.closest_of(&OracleRay { org, dir, t_min, t_max })
    }

    /// [`Oracle::closest`] of a ray.
    pub fn closest_of(&self, ray: &OracleRay) -> Option<OracleHit> {
        if !ray.is_live() {
            return None;
        }
        let mut best: Option<OracleHit> = None;
        // Placements' boxes are as wide as their objects' corners; the pad covers the maps' rounding.
        let org = ray.org.abs().max_element();
        let pad = |b: &Bounds| margin::MAP_PAD * (b.magnitude().max_element() + org);
        self.tree.visit(ray, ray.t_max, pad, |inst, end| {
            let placed = &self.placements[inst as usize];
            let object = &self.objects[placed.object as usize];
            let Some((prim, hit)) = object.closest(&ray.transformed(&placed.to_object), end) else { return end };
            if best.is_none_or(|b| hit.t < b.t || (hit.t == b.t && inst < b.inst)) {
                best = Some(placed.hit(inst, prim, hit));
            }
            hit.t
        });
        best
    }
}

impl Placed {
    fn new(placement: &crate::scene::assembly::Placement) -> Self {
        let to_world = placement.to_world;
        Self { object: placement.object, to_world, to_object: to_world.inverse() }
    }

    fn bounds(&self, object: Bounds) -> Bounds {
        if !object.is_finite() {
            return Bounds::ALL;
        }
        Bounds::of(object.corners().map(|p| self.to_world.transform_point3(p)))
    }

    fn hit(&self, inst: u32, prim: u32, hit: LocalHit) -> OracleHit {
        let ng = self.to_object.matrix3.transpose() * hit.ng;
        OracleHit { t: hit.t, prim, inst, u: hit.u, v: hit.v, ng, face: hit.face }
    }
}
