//! Points on surfaces that a level of rays has met, as structures of arrays parallel to the rays: where they are and what
//! recursive ray tracing makes of their materials.

use glam::DVec3;

use super::classic::{Classic, Terms};
use super::look::Model;
use super::look_lanes::LookLanes;
use super::meeting::{Met, met_lanes};
use super::offset::position_error;
use super::shader::Shader;
use crate::lanes::chosen::{self, groups, lanes_of, merge};
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each, f32x16};
use crate::ray::{Hits, Rays};
use crate::scene::world::Surface;

/// First field of the position, world space.
pub(super) const POSITION: usize = 0;
/// Unit geometric normal, on the side that the ray came from.
pub(super) const NORMAL: usize = 3;
/// Unit shading normal, on that side.
const SHADING: usize = 6;
/// How far along the normal a ray must start.
pub(super) const OFFSET: usize = 9;
/// The terms of [`Classic`].
pub(super) const DIFFUSE: usize = 10;
pub(super) const MIRROR: usize = 13;
pub(super) const THROUGH: usize = 16;
pub(super) const ETA: usize = 19;
/// Share of ambient light that arrives.
const AMBIENT: usize = 20;
/// Only of those that shine.
pub(super) const EMISSION: usize = 21;
/// Number of fields.
const FIELDS: usize = 24;

/// The points of a level. Lanes of rays that met nothing mean nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices<S> {
    /// Of each vector of lanes: the rays that met something.
    pub lanes: Vec<u32>,
    /// Those that met something that shines by itself.
    pub shining: Vec<u32>,
    /// Those that met something that may mirror or let pass: only theirs are the fields of mirrors and of what lies behind.
    sending: Vec<u32>,
    /// Those that were worked out one by one: only vectors with such have shading normals of their own, and shares of ambient
    /// light.
    single: Vec<u32>,
    fields: [Column<S>; FIELDS],
}

impl<S: Real> Vertices<S> {
    /// None yet, of `padded` rays with their padding.
    fn open(&mut self, padded: usize) {
        self.lanes.clear();
        self.shining.clear();
        self.sending.clear();
        self.single.clear();
        self.fields.iter_mut().for_each(|field| field.at_least(padded));
    }

    /// Vectors of lanes in which something was met: the first ray and the lanes.
    pub fn packets(&self) -> impl Iterator<Item = (usize, u32)> {
        chosen::packets::<S::Wide>(&self.lanes)
    }

    /// The same of those that may mirror or let pass.
    pub fn sending(&self) -> impl Iterator<Item = (usize, u32)> {
        chosen::packets::<S::Wide>(&self.sending)
    }

    /// Field `field` of rays `first..first + N`.
    #[inline(always)]
    pub fn scalar<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> V {
        V::load(&self.fields[field][first..])
    }

    /// Fields `field..field + 3` of the same.
    #[inline(always)]
    pub fn vector<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> Lanes3<V> {
        [self.scalar(field, first), self.scalar(field + 1, first), self.scalar(field + 2, first)]
    }

    /// Shading normals of the same.
    #[inline(always)]
    pub fn shading(&self, first: usize) -> Lanes3<S::Wide> {
        self.vector(if self.has_single(first) { SHADING } else { NORMAL }, first)
    }

    /// The share of ambient light that arrives at the same.
    #[inline(always)]
    pub fn ambient(&self, first: usize) -> S::Wide {
        if self.has_single(first) { self.scalar(AMBIENT, first) } else { S::Wide::constant(1.0) }
    }

    fn has_single(&self, first: usize) -> bool {
        self.single[first / S::Wide::N] != 0
    }

    /// Origins of rays that leave the points of rays `first..first + N` to the side of the normal.
    #[inline(always)]
    pub fn leave<V: Lanes<Scalar = S>>(&self, first: usize) -> Lanes3<V> {
        let (position, normal) = (self.vector(POSITION, first), self.vector::<V>(NORMAL, first));
        let offset = self.scalar(OFFSET, first);
        each(|i| normal[i].mul_add(offset, position[i]))
    }

    /// Origins of rays that enter the surface.
    #[inline(always)]
    pub fn enter<V: Lanes<Scalar = S>>(&self, first: usize) -> Lanes3<V> {
        let (position, normal) = (self.vector(POSITION, first), self.vector::<V>(NORMAL, first));
        let offset = -self.scalar::<V>(OFFSET, first);
        each(|i| normal[i].mul_add(offset, position[i]))
    }

    /// Fields `field..field + 3` of ray `i`.
    pub fn at(&self, field: usize, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.fields[field + axis][i].to_f64()))
    }

    #[inline(always)]
    fn put_lanes<const N: usize>(&mut self, field: usize, first: usize, values: [S::Wide; N]) {
        values.iter().enumerate().for_each(|(k, value)| value.store(&mut self.fields[field + k][first..]));
    }

    /// The same in the lanes `lanes`, and, where others that met something lie beside them, in these only.
    #[inline(always)]
    fn put_some<const N: usize>(&mut self, lanes: u32, field: usize, first: usize, values: [S::Wide; N]) {
        if lanes == self.lanes[first / S::Wide::N] {
            return self.put_lanes(field, first, values);
        }
        let mask = <S::Wide as Lanes>::Mask::from_bits(lanes);
        for (k, value) in values.into_iter().enumerate() {
            let column = &mut self.fields[field + k][first..];
            S::Wide::select(mask, value, S::Wide::load(column)).store(column);
        }
    }

    fn put(&mut self, field: usize, i: usize, value: DVec3) {
        (0..3).for_each(|axis| self.fields[field + axis][i] = S::from_f64(value[axis]));
    }
}

impl<S: Real> Shader<'_, S> {
    /// The points that `rays` met in `hits`, into `vertices`.
    pub(super) fn meet(&self, rays: &Rays<S>, hits: &Hits<S>, vertices: &mut Vertices<S>) {
        vertices.open(rays.padded_len());
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let hit = met_lanes(hits, first);
            vertices.lanes.push(hit);
            vertices.shining.push(0);
            vertices.sending.push(0);
            if hit == 0 {
                vertices.single.push(0);
                continue;
            }
            let Met { place, mut material, known } =
                self.meeting.places(self.world, &self.looks, rays, hits, first, hit);
            vertices.put_lanes(POSITION, first, place.position);
            vertices.put_lanes(NORMAL, first, place.normal);
            vertices.put_lanes(OFFSET, first, [place.offset]);
            let mut front = place.front;
            let mut even = 0;
            for (id, same) in groups(&material, known) {
                even |= if self.looks.is_even(id) { same } else { 0 };
            }
            let single = hit & !even;
            vertices.single.push(single);
            if single != 0 {
                vertices.put_lanes(SHADING, first, place.normal);
                vertices.put_lanes(AMBIENT, first, [S::Wide::constant(1.0)]);
            }
            // Others are worked out one by one: their materials too, where those are not the same everywhere.
            let mut settled = 0;
            for lane in lanes_of(single) {
                let surface = self.one(rays, hits, first + lane, vertices);
                let dir = DVec3::from(rays.dir(first + lane).map(S::to_f64));
                let is_front = surface.ng.dot(dir) <= 0.0;
                material[lane] = surface.material;
                front = front & !(1 << lane) | u32::from(is_front) << lane;
                if !self.looks.is_even(surface.material) {
                    settled |= 1 << lane;
                    self.settle(&surface, dir, first + lane, vertices);
                }
            }
            self.look_at(rays, first, hit & !settled, &material, front, vertices);
        }
    }

    /// The place of ray `i`'s hit, in f64.
    fn one(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize, vertices: &mut Vertices<S>) -> Surface<'_> {
        let org = DVec3::from(rays.org(i).map(S::to_f64));
        let dir = DVec3::from(rays.dir(i).map(S::to_f64));
        let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
        let surface = self.world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
        let [normal, shading] = self.turned(&surface, dir);
        // Two more roundings: of the position, and where the ray starts.
        let error = position_error::<S>(org, dir, t, surface.position, surface.magnitude)
            + surface.position.abs() * (2.0 * S::EPSILON.to_f64());
        vertices.put(POSITION, i, surface.position);
        vertices.put(NORMAL, i, normal);
        vertices.put(SHADING, i, shading);
        vertices.fields[OFFSET][i] = S::from_f64(normal.abs().dot(error));
        surface
    }

    /// Unit geometric and shading normal of `surface` on the side that a ray along `dir` comes from.
    pub(super) fn turned(&self, surface: &Surface<'_>, dir: DVec3) -> [DVec3; 2] {
        let is_behind = surface.ng.dot(dir) > 0.0;
        let facing = |n: DVec3| if is_behind { -n } else { n };
        let normal = facing(surface.ng);
        if normal.is_finite() && normal != DVec3::ZERO {
            return [normal, facing(self.looks.bumped(surface.material, surface))];
        }
        // A triangle too thin for a normal is seen face on.
        [-dir.normalize_or_zero(); 2]
    }

    /// The material of ray `i`'s hit, which textures or the place may change.
    fn settle(&self, surface: &Surface<'_>, dir: DVec3, i: usize, vertices: &mut Vertices<S>) {
        let classic = Classic::of(&self.looks, surface, dir);
        for (field, value) in [(DIFFUSE, classic.diffuse), (MIRROR, classic.mirror), (THROUGH, classic.through)] {
            vertices.put(field, i, value);
        }
        vertices.fields[ETA][i] = S::from_f64(classic.eta);
        vertices.sending[i / S::Wide::N] |= 1 << (i % S::Wide::N);
        vertices.fields[AMBIENT][i] = S::from_f64(self.looks.ambient(surface.material, surface));
        if classic.emission != DVec3::ZERO {
            vertices.put(EMISSION, i, classic.emission);
            vertices.shining[i / S::Wide::N] |= 1 << (i % S::Wide::N);
        }
    }

    /// The materials of the lanes `lanes`, which are the same everywhere on each side.
    #[inline(always)]
    fn look_at(
        &self,
        rays: &Rays<S>,
        first: usize,
        lanes: u32,
        material: &[u32; MAX_LANES],
        front: u32,
        vertices: &mut Vertices<S>,
    ) {
        if lanes == 0 {
            return;
        }
        let (mut sides, mut of_model) = ([0; MAX_LANES], [0u32; Model::COUNT]);
        for (id, same) in groups(material, lanes) {
            for (from_front, lanes) in [(true, same & front), (false, same & !front)] {
                let Some((side, model)) = self.looks.even_side(id, from_front).filter(|_| lanes != 0) else { continue };
                sides = merge(<f32x16 as Lanes>::Mask::from_bits(lanes), side, sides);
                of_model[model as usize] |= lanes;
            }
        }
        let LookLanes { base, param } = LookLanes::<S::Wide>::of([&self.sides, &[]], lanes, &sides);
        let mut cos = S::Wide::constant(1.0);
        // Only a matte surface scatters alike whatever the angle.
        if of_model[Model::Matte as usize] != lanes {
            let dir: Lanes3<S::Wide> = each(|axis| S::Wide::load(&rays.dir[axis][first..]));
            let own = dot(vertices.vector::<S::Wide>(NORMAL, first), dir).abs();
            let shading = -dot(vertices.shading(first), dir);
            // As in [`Classic::of`].
            let along = S::Wide::select(S::Wide::constant(0.0).cmp_lt(shading), shading, own);
            cos = (along / dot(dir, dir).sqrt()).fast_min(cos);
        }
        for (model, lanes) in Model::ALL.into_iter().zip(of_model).filter(|(_, lanes)| *lanes != 0) {
            self.put_terms(model, base, &param, cos, (first, lanes), vertices);
        }
    }

    #[inline(always)]
    fn put_terms(
        &self,
        model: Model,
        base: Lanes3<S::Wide>,
        param: &[S::Wide; 7],
        cos: S::Wide,
        (first, lanes): (usize, u32),
        vertices: &mut Vertices<S>,
    ) {
        let Terms { diffuse, mirror, through, eta } = Terms::of(model, base, param, cos);
        vertices.put_some(lanes, DIFFUSE, first, diffuse);
        let zero = S::Wide::constant(0.0);
        let mirrors = !(mirror[0].cmp_eq(zero) & mirror[1].cmp_eq(zero) & mirror[2].cmp_eq(zero));
        let sending = lanes & if matches!(model, Model::Matte) { mirrors.bits() } else { S::Wide::ALL };
        if sending != 0 {
            vertices.sending[first / S::Wide::N] |= sending;
            vertices.put_some(lanes, MIRROR, first, mirror);
            vertices.put_some(lanes, THROUGH, first, through);
            vertices.put_some(lanes, ETA, first, [eta]);
        }
    }
}
