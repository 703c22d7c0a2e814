//! Leaves: a kernel of the floor of shapes, the way into its local space, its box.

use glam::{DAffine3, DVec3};

use super::sweep::Events;
use crate::lanes::{Lanes, Real};
use crate::math::{Aabb, Affine, transformed_bounds};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::{self, Cone, Cuboid, Cylinder, HalfSpace, Solid as Canonical, Sphere};

/// A canonical solid by its numbers.
#[derive(Clone, Copy, Debug)]
pub enum Form<'a> {
    /// Unit sphere.
    Sphere,
    /// z <= 0.
    HalfSpace,
    /// [-1, 1]^3.
    Cuboid,
    /// Radius 1, 0 <= z <= 1.
    Cylinder,
    /// Radius 1 at z = 0, this one at z = 1.
    Cone(f64),
    /// Half-spaces `normal . p <= offset`.
    Planes(&'a [(DVec3, f64)]),
    /// See [`shape::quadric`].
    Round([f64; 3]),
    /// See [`shape::quadric`].
    Trough([f64; 3]),
    /// Major radius 1, the tube's radius.
    Torus(f64),
    /// Semi-axes at z = 1.
    Taper([f64; 2]),
}

/// A leaf to be compiled.
#[derive(Clone, Copy, Debug)]
pub struct LeafInput<'a> {
    /// Its canonical solid.
    pub form: Form<'a>,
    /// Box of the canonical solid, lower corner; infinite if it has none.
    pub lo: DVec3,
    /// Upper corner.
    pub hi: DVec3,
    /// Its space to the tree's.
    pub to_tree: DAffine3,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Sphere,
    HalfSpace,
    Cuboid,
    Cylinder,
    Cone,
    /// Planes of the solid's list.
    Planes {
        first: u32,
        count: u32,
    },
    Round,
    Trough,
    Torus,
    Taper,
}

/// A compiled leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf<S> {
    pub(super) kind: Kind,
    pub(super) to_local: Affine<S>,
    pub(super) params: [S; 3],
    /// Where it can make a difference: its box, cut by those of the operations above it.
    pub clip: Aabb<S>,
}

/// Planes of polyhedra, in the tree's space: normal and offset.
pub(super) type PlaneList<S> = Vec<[S; 4]>;

impl<S: Real> Leaf<S> {
    /// Compiles `input`; `None` if its map overflows `S`.
    pub fn new(input: &LeafInput, planes: &mut PlaneList<S>) -> Option<Self> {
        let inverse = input.to_tree.inverse();
        let to_local = Affine::<S>::from_f64(&inverse);
        let finite = to_local.rows.as_flattened().iter().all(|x| x.is_finite());
        let clip = bounds(&input.to_tree, input.lo, input.hi);
        let three = |p: [f64; 3]| p.map(S::from_f64);
        let (kind, params) = match input.form {
            Form::Sphere => (Kind::Sphere, [S::ZERO; 3]),
            Form::HalfSpace => (Kind::HalfSpace, [S::ZERO; 3]),
            Form::Cuboid => (Kind::Cuboid, [S::ZERO; 3]),
            Form::Cylinder => (Kind::Cylinder, [S::ZERO; 3]),
            Form::Cone(top) if top >= 1.0 => (Kind::Cylinder, [S::ZERO; 3]),
            Form::Cone(top) => (Kind::Cone, three([top, 0.0, 0.0])),
            Form::Planes(list) => {
                let first = planes.len() as u32;
                planes.extend(list.iter().map(|plane| placed_plane(plane, &inverse)));
                (Kind::Planes { first, count: list.len() as u32 }, [S::ZERO; 3])
            }
            Form::Round(profile) => (Kind::Round, three(profile)),
            Form::Trough(profile) => (Kind::Trough, three(profile)),
            Form::Torus(minor) => (Kind::Torus, three([minor, 0.0, 0.0])),
            Form::Taper([x, y]) => (Kind::Taper, three([x, y, 0.0])),
        };
        let bounded = clip.is_bounded() || !(input.lo.is_finite() && input.hi.is_finite());
        (finite && bounded).then_some(Self { kind, to_local, params, clip })
    }

    /// The same leaf with its planes in another list.
    pub fn moved(&self, from: &PlaneList<S>, to: &mut PlaneList<S>) -> Self {
        let Kind::Planes { first, count } = self.kind else { return *self };
        let planes = &from[first as usize..][..count as usize];
        let first = to.len() as u32;
        to.extend_from_slice(planes);
        Self { kind: Kind::Planes { first, count }, ..*self }
    }

    /// Adds the boundaries of this leaf in `lanes` to `events`, moved into the interval of its box.
    #[inline(always)]
    pub fn boundaries<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        within: &Interval<V>,
        planes: &PlaneList<S>,
        (slot, lanes): (u32, u32),
        events: &mut Events<S>,
    ) {
        let mut push = |span| events.push_span(slot, lanes, &span, within);
        if let Kind::Planes { first, count } = self.kind {
            let planes = &planes[first as usize..][..count as usize];
            push(shape::planes_span(packet.org, packet.dir, planes));
            return;
        }
        let (o, d) = (self.to_local.points(packet.org), self.to_local.vectors(packet.dir));
        let p = self.params;
        match self.kind {
            Kind::Sphere => push(Sphere::span(o, d, p[0])),
            Kind::HalfSpace => push(HalfSpace::span(o, d, p[0])),
            Kind::Cuboid => push(Cuboid::span(o, d, p[0])),
            Kind::Cylinder => push(Cylinder::span(o, d, p[0])),
            Kind::Cone => push(Cone::span(o, d, p[0])),
            Kind::Round => shape::quadric::round(o, d, p, push),
            Kind::Trough => shape::quadric::trough(o, d, p, push),
            Kind::Torus => shape::torus(o, d, p[0], push),
            Kind::Taper => shape::taper(o, d, [p[0], p[1]], push),
            Kind::Planes { .. } => {}
        }
    }
}

/// A plane of the canonical space in the tree's: it is the same set of points.
fn placed_plane<S: Real>((normal, offset): &(DVec3, f64), to_local: &DAffine3) -> [S; 4] {
    let turned = to_local.matrix3.transpose() * *normal;
    let offset = offset - normal.dot(to_local.translation);
    // Unit normals keep the numbers of a plane in range, whatever the map's scale.
    let length = turned.length();
    let [x, y, z] = (turned / length).to_array().map(S::from_f64);
    [x, y, z, S::from_f64(offset / length)]
}

/// Box in the tree's space, widened by the rounding of the map.
fn bounds<S: Real>(to_tree: &DAffine3, lo: DVec3, hi: DVec3) -> Aabb<S> {
    let (lo, hi) = transformed_bounds(to_tree, lo, hi);
    let finite = |p: DVec3| DVec3::from_array(p.to_array().map(|x| if x.is_finite() { x } else { 0.0 }));
    let size = finite(lo).abs().max(finite(hi).abs()).max(to_tree.translation.abs()).max_element();
    let slack = DVec3::splat(size * 16.0 * S::EPSILON.to_f64());
    let wide = Aabb::enclosing(lo - slack, hi + slack);
    let whole = Aabb::<S>::EVERYTHING;
    // A half-space turned about an axis has sides of infinity on some axes only: it goes without a box.
    if wide.is_bounded() { wide } else { whole }
}
