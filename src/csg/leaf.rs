//! Leaves: a kernel of the floor of shapes, the way into its local space, its box.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::events::Events;
use super::mesh::{Crossings, Mesh};
use crate::lanes::{Lanes, Lanes3, Real};
use crate::math::{Aabb, Affine, transformed_bounds};
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::{self, Cone, Cuboid, Cylinder, HalfSpace, Solid as Canonical, Span, Sphere, WorldSphere};

/// A canonical solid by its numbers.
#[derive(Clone, Copy)]
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
    /// Major radius 1, reach and lean of the tube's ellipse.
    EllipticTorus([f64; 2]),
    /// Semi-axes at z = 1.
    Taper([f64; 2]),
    /// Corners of the triangles of a closed mesh, counter-clockwise seen from outside.
    Mesh(&'a dyn Triangles),
}

/// Triangles one by one.
pub trait Triangles: Sync {
    /// How many.
    fn count(&self) -> usize;
    /// Corners of one.
    fn corners(&self, i: usize) -> [DVec3; 3];
}

/// A leaf to be compiled.
#[derive(Clone, Copy)]
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
    /// A sphere in the tree's space: centre and radius.
    Ball,
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
    EllipticTorus,
    Taper,
    /// Index into the solid's meshes.
    Mesh(u32),
}

impl Kind {
    /// Whether lines pass through it at most once; [`Leaf::span`] knows where.
    #[inline(always)]
    pub(super) fn is_span(self) -> bool {
        match self {
            Self::Sphere | Self::Ball | Self::HalfSpace | Self::Cuboid | Self::Cylinder | Self::Cone => true,
            Self::Planes { .. } => true,
            Self::Round | Self::Trough | Self::Torus | Self::EllipticTorus | Self::Taper | Self::Mesh(_) => false,
        }
    }
}

/// A compiled leaf.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Leaf<S> {
    /// Where it can make a difference: its box, cut by those of the operations above it.
    pub clip: Aabb<S>,
    pub(super) params: [S; 4],
    pub(super) kind: Kind,
    pub(super) to_local: Affine<S>,
}

/// What leaves of unequal size keep outside of their records.
#[derive(Clone, Debug, Default)]
pub(super) struct Stores<S> {
    /// Planes of polyhedra, in the tree's space: normal and offset.
    pub planes: Vec<[S; 4]>,
    /// Meshes.
    pub meshes: Vec<Arc<Mesh<S>>>,
}

impl<S: Real> Leaf<S> {
    /// Compiles `input`; `None` if its map overflows `S`.
    pub fn new(input: &LeafInput, stores: &mut Stores<S>) -> Option<Self> {
        let inverse = input.to_tree.inverse();
        let to_local = Affine::<S>::from_f64(&inverse);
        let finite = to_local.rows.as_flattened().iter().all(|x| x.is_finite());
        let clip = bounds(&input.to_tree, input.lo, input.hi);
        let three = |[x, y, z]: [f64; 3]| [x, y, z, 0.0].map(S::from_f64);
        let none = [S::ZERO; 4];
        let (kind, params) = match input.form {
            Form::Sphere => match ball(&input.to_tree).map(|ball| ball.map(S::from_f64)) {
                Some(ball) if ball.iter().all(|x| x.is_finite()) => (Kind::Ball, ball),
                _ => (Kind::Sphere, none),
            },
            Form::HalfSpace => (Kind::HalfSpace, none),
            Form::Cuboid => (Kind::Cuboid, none),
            Form::Cylinder => (Kind::Cylinder, none),
            Form::Cone(top) if top >= 1.0 => (Kind::Cylinder, none),
            Form::Cone(top) => (Kind::Cone, three([top, 0.0, 0.0])),
            Form::Planes(list) => {
                let first = stores.planes.len() as u32;
                stores.planes.extend(list.iter().map(|plane| placed_plane(plane, &inverse)));
                (Kind::Planes { first, count: list.len() as u32 }, none)
            }
            Form::Round(profile) => (Kind::Round, three(profile)),
            Form::Trough(profile) => (Kind::Trough, three(profile)),
            Form::Torus(minor) => (Kind::Torus, three([minor, 0.0, 0.0])),
            Form::EllipticTorus([reach, lean]) => (Kind::EllipticTorus, three([reach, lean, 0.0])),
            Form::Taper([x, y]) => (Kind::Taper, three([x, y, 0.0])),
            Form::Mesh(triangles) => {
                stores.meshes.push(Arc::new(placed_mesh(triangles, &input.to_tree)));
                (Kind::Mesh(stores.meshes.len() as u32 - 1), none)
            }
        };
        let bounded = clip.is_bounded() || !(input.lo.is_finite() && input.hi.is_finite());
        (finite && bounded).then_some(Self { kind, to_local, params, clip })
    }

    /// The same leaf with what it keeps outside in another place.
    pub fn moved(&self, from: &Stores<S>, to: &mut Stores<S>) -> Self {
        let kind = match self.kind {
            Kind::Planes { first, count } => {
                let planes = &from.planes[first as usize..][..count as usize];
                let first = to.planes.len() as u32;
                to.planes.extend_from_slice(planes);
                Kind::Planes { first, count }
            }
            Kind::Mesh(index) => {
                to.meshes.push(from.meshes[index as usize].clone());
                Kind::Mesh(to.meshes.len() as u32 - 1)
            }
            other => other,
        };
        Self { kind, ..*self }
    }

    /// Adds the boundaries of this leaf in `lanes` to `events`; `within`: where the lines meet its box, give or take.
    #[inline(always)]
    pub fn boundaries<V: Lanes<Scalar = S>>(
        &self,
        packet: &Packet<V>,
        within: &Interval<V>,
        (stores, eps): (&Stores<S>, V),
        (slot, lanes): (u32, u32),
        (events, crossings): (&mut Events<S>, &mut Crossings),
    ) {
        if let Kind::Mesh(index) = self.kind {
            let mesh = &stores.meshes[index as usize];
            mesh.boundaries(packet, within, eps, (slot, lanes), crossings, events);
            return;
        }
        // One call for all with a single span, apart from the others': it is large, and the compiler left it out of line.
        match self.span(packet, stores) {
            Some(span) => events.push_span(slot, lanes, &span, within),
            None => self.spans(packet, |span| events.push_span(slot, lanes, &span, within)),
        }
    }

    /// Calls `push` with where lines are inside, first to last, if this leaf is of a kind that lines pass through more than once
    /// and no mesh.
    #[inline(always)]
    pub fn spans<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, push: impl FnMut(Span<V>)) {
        let (o, d) = self.local(packet);
        let [p0, p1, p2, _] = self.params;
        match self.kind {
            Kind::Round => shape::quadric::round(o, d, [p0, p1, p2], push),
            Kind::Trough => shape::quadric::trough(o, d, [p0, p1, p2], push),
            Kind::Torus => shape::torus(o, d, p0, push),
            Kind::EllipticTorus => shape::elliptic_torus(o, d, [p0, p1], push),
            _ => shape::taper(o, d, [p0, p1], push),
        }
    }

    /// Where lines are inside, if this leaf is of a kind that lines pass through at most once.
    #[inline(always)]
    pub fn span<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>, stores: &Stores<S>) -> Option<Span<V>> {
        let p @ [p0, ..] = self.params;
        Some(match self.kind {
            Kind::Planes { first, count } => {
                let planes = &stores.planes[first as usize..][..count as usize];
                shape::planes_span(packet.org, packet.dir, planes)
            }
            Kind::Ball => WorldSphere::span(packet.org, packet.dir, &p),
            Kind::Sphere => of::<Sphere, V>(self.local(packet), p0),
            Kind::HalfSpace => of::<HalfSpace, V>(self.local(packet), p0),
            Kind::Cuboid => of::<Cuboid, V>(self.local(packet), p0),
            Kind::Cylinder => of::<Cylinder, V>(self.local(packet), p0),
            Kind::Cone => of::<Cone, V>(self.local(packet), p0),
            _ => return None,
        })
    }

    /// Origins and directions in its local space.
    #[inline(always)]
    fn local<V: Lanes<Scalar = S>>(&self, packet: &Packet<V>) -> (Lanes3<V>, Lanes3<V>) {
        (self.to_local.points(packet.org), self.to_local.vectors(packet.dir))
    }
}

/// Centre and radius of the unit sphere's image, if that is a sphere but for rounding in `f64`.
fn ball(to_tree: &DAffine3) -> Option<[f64; 4]> {
    let axes = to_tree.matrix3;
    let square = axes.x_axis.length_squared();
    let is_nothing = |x: f64| x.abs() <= 8.0 * f64::EPSILON * square;
    let even = [axes.y_axis, axes.z_axis].iter().all(|axis| is_nothing(axis.length_squared() - square));
    let [xy, yz, zx] = [axes.x_axis.dot(axes.y_axis), axes.y_axis.dot(axes.z_axis), axes.z_axis.dot(axes.x_axis)];
    let [x, y, z] = to_tree.translation.to_array();
    let is_ball = square.is_normal() && even && [xy, yz, zx].into_iter().all(is_nothing);
    is_ball.then_some([x, y, z, square.sqrt()])
}

/// The span of a canonical solid.
#[inline(always)]
fn of<C: Canonical, V: Lanes>((o, d): (Lanes3<V>, Lanes3<V>), param: V::Scalar) -> Span<V> {
    C::span(o, d, param)
}

/// A mesh in the tree's space; a mirroring map turns its triangles round.
fn placed_mesh<S: Real>(triangles: &dyn Triangles, to_tree: &DAffine3) -> Mesh<S> {
    let mirrored = to_tree.matrix3.determinant() < 0.0;
    Mesh::new((0..triangles.count()).map(|i| {
        let [a, b, c] = triangles.corners(i).map(|p| to_tree.transform_point3(p));
        if mirrored { [a, c, b] } else { [a, b, c] }
    }))
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
