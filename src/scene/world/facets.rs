//! Normals of shapes and solids in lanes: on each face of nearly all of them the gradient is an affine function of the
//! point, kept here in the object's space, so that one kernel does for all.

use glam::{DAffine3, DMat3, DVec3};

use super::runs::{Run, Runs};
use super::surface::{leaf_magnitude, shape_magnitude};
use super::{World, solids};
use crate::lanes::chosen::{lanes_of, merge, positions_in};
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each, f32x16, space};
use crate::math::NormalMap;
use crate::ray::{Hits, INVALID_ID, Rays};
use crate::scene::assembly::{AssemblyObject, PartKind};
use crate::scene::description::Shape;
use crate::scene::solids::Solid;

/// Most facets that an object keeps.
const MAX_FACETS: usize = 1 << 20;
/// Numbers of a facet.
const FIELDS: usize = 18;

/// Outward normal of a face: `rows * (p - centre) + constant`, not unit; of a flat one the constant, unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet<S> {
    /// Three rows, the centre, the constant, and the magnitude (see [`super::Surface::magnitude`]).
    fields: [S; FIELDS],
    is_flat: bool,
}

impl<S: Real> Facet<S> {
    /// Face `face` of a solid that `map` takes to the object; `None` where the gradient is not affine.
    fn new(solid: &Solid, face: u32, map: &DAffine3, magnitude: DVec3) -> Option<Self> {
        // The side of a taper is a quartic.
        if matches!(solid, Solid::Taper { .. }) && face == 0 {
            return None;
        }
        let gradient = |p: DVec3| solids::solid_normal(solid, p, face);
        let at_zero = gradient(DVec3::ZERO);
        let local = DMat3::from_cols_array_2d(&DVec3::AXES.map(|axis| (gradient(axis) - at_zero).to_array()));
        let normals = NormalMap::new(map).matrix();
        // Numbers of about one, whatever the map's scale.
        let normals = normals * (1.0 / normals.to_cols_array().iter().fold(0.0f64, |most, x| most.max(x.abs())));
        let rows = (normals * local * map.matrix3.inverse()).transpose();
        let constant = normals * at_zero;
        let mut fields = [S::ZERO; FIELDS];
        let all = [rows.x_axis, rows.y_axis, rows.z_axis, map.translation, constant, magnitude];
        for (field, x) in fields.iter_mut().zip(all.iter().flat_map(DVec3::to_array)) {
            *field = S::from_f64(x);
        }
        let is_flat = rows == DMat3::ZERO;
        if is_flat {
            let unit = space::normalize([fields[12], fields[13], fields[14]]);
            fields[12..15].copy_from_slice(&unit);
        }
        fields.iter().all(|x| x.is_finite()).then_some(Self { fields, is_flat })
    }

    /// Three of the numbers, from `3 row` on, the same in all lanes.
    #[inline(always)]
    fn row<V: Lanes<Scalar = S>>(&self, row: usize) -> Lanes3<V> {
        each(|k| V::splat(self.fields[3 * row + k]))
    }

    /// Outward normals at the points `position`, not unit, of one that is not flat.
    #[inline(always)]
    fn outward<V: Lanes<Scalar = S>>(&self, position: Lanes3<V>) -> Lanes3<V> {
        let from = space::sub(position, self.row(3));
        space::add(each(|k| dot(self.row(k), from)), self.row(4))
    }
}

/// The facets of one object's shapes and leaves.
#[derive(Clone, Debug, Default)]
pub(super) struct Facets<S> {
    /// `None` where the gradient is not affine.
    list: Vec<Option<Facet<S>>>,
    /// By run of the object: its first facet; then the one after its last.
    first: Vec<u32>,
}

impl<S: Real> Facets<S> {
    /// Of `object`, whose runs are `runs`.
    pub fn new(object: &AssemblyObject, runs: &Runs) -> Self {
        let mut facets = Self { list: Vec::new(), first: vec![0] };
        for run in runs.list() {
            let part = &object.parts[run.part as usize];
            let before = facets.list.len();
            let placed = match &part.kind {
                PartKind::Shape(shape) => Some((Solid::Shape(*shape), part.to_object, shape_magnitude(part))),
                PartKind::Solids(tree) => {
                    let leaf = tree.leaves.get((run.first - part.first_prim) as usize);
                    leaf.map(|leaf| (leaf.solid.clone(), part.to_object * leaf.to_tree, leaf_magnitude(part, leaf)))
                }
                PartKind::Mesh(_) => None,
            };
            if let Some((solid, map, magnitude)) = placed {
                let count = faces(&solid).min((MAX_FACETS - before) as u32);
                facets.list.extend((0..count).map(|face| Facet::new(&solid, face, &map, magnitude)));
            }
            facets.first.push(facets.list.len() as u32);
        }
        facets
    }

    #[inline(always)]
    fn get(&self, run: usize, face: usize) -> Option<&Facet<S>> {
        let (first, end) = (self.first[run] as usize, self.first[run + 1] as usize);
        let at = first + face;
        if at < end { self.list[at].as_ref() } else { None }
    }
}

/// Number of faces with facets, and before such.
fn faces(solid: &Solid) -> u32 {
    match solid {
        Solid::Shape(Shape::Sphere | Shape::HalfSpace | Shape::Disc) => 1,
        Solid::Shape(Shape::Cuboid) => 6,
        Solid::Shape(Shape::Cylinder | Shape::Cone { .. }) | Solid::Round { .. } | Solid::Taper { .. } => 3,
        Solid::Trough { .. } => 5,
        Solid::Polyhedron(polyhedron) => polyhedron.planes().len() as u32,
        Solid::Torus { .. } | Solid::EllipticTorus { .. } | Solid::Mesh(_) => 0,
    }
}

/// Hits of consecutive rays on shapes and solids.
#[derive(Clone, Copy, Debug)]
pub struct Met<V> {
    /// Lanes that hit something; of [`World::met_facets`] those whose numbers are here.
    pub hit: u32,
    /// Hit points, world space.
    pub position: Lanes3<V>,
    /// Unit normals: of a shape outward, of a tree of solids out of the whole.
    pub normal: Lanes3<V>,
    /// See [`super::Surface::magnitude`]; only of [`World::met_facets`].
    pub magnitude: Lanes3<V>,
    /// Part of each hit, see [`World::part`].
    pub part: [u32; MAX_LANES],
    /// Material of each hit.
    pub material: [u32; MAX_LANES],
}

impl<S: Real> World<S> {
    /// Whether [`Self::met_facets`] can find any.
    pub fn has_facets(&self) -> bool {
        self.facets.iter().any(|facets| !facets.list.is_empty())
    }

    /// Positions and geometric normals of hits `first..first + N` of `rays` on shapes and solids, as [`Self::surface`]
    /// gives them up to rounding in `S`, but for degenerate ones, whose normals are not unit.
    #[inline(always)]
    pub fn met(&self, rays: &Rays<S>, hits: &Hits<S>, first: usize) -> Met<S::Wide> {
        self.look_up::<true>(rays, hits, first, u32::MAX)
    }

    /// The same of those hits of `lanes` on shapes and solids of instances that stay where their objects are whose normals
    /// are affine functions of the point, and not degenerate.
    #[inline]
    pub fn met_facets(&self, rays: &Rays<S>, hits: &Hits<S>, first: usize, lanes: u32) -> Met<S::Wide> {
        let mut met = self.look_up::<false>(rays, hits, first, lanes);
        let square = dot(met.normal, met.normal);
        met.hit &= square.cmp_lt(S::Wide::constant(1.5)).bits();
        met
    }

    /// Lanes of hits `first..first + N` that hit something, and the part of each, see [`World::part`].
    #[inline]
    pub fn met_parts(&self, hits: &Hits<S>, first: usize) -> (u32, [u32; MAX_LANES]) {
        let (prims, insts) = (&hits.prim[first..], &hits.inst[first..]);
        let hit = !positions_in::<S::Wide>(prims, INVALID_ID) & S::Wide::ALL;
        let (mut parts, mut left) = ([INVALID_ID; MAX_LANES], hit);
        while left != 0 {
            let lead = left.trailing_zeros() as usize % MAX_LANES;
            let same = positions_in::<S::Wide>(prims, prims[lead]) & positions_in::<S::Wide>(insts, insts[lead]) & left;
            left &= !same;
            let run = self.runs[self.assembly.placements[insts[lead] as usize].object as usize].of(prims[lead]);
            parts = merge(<f32x16 as Lanes>::Mask::from_bits(same), run.part, parts);
        }
        (hit, parts)
    }

    /// `ALL`: of all hits, else those with facets.
    #[inline(always)]
    fn look_up<const ALL: bool>(&self, rays: &Rays<S>, hits: &Hits<S>, first: usize, lanes: u32) -> Met<S::Wide> {
        let zero = [S::Wide::constant(0.0); 3];
        let none = [INVALID_ID; MAX_LANES];
        let mut met = Met { hit: 0, position: zero, normal: zero, magnitude: zero, part: none, material: none };
        let (prims, insts) = (&hits.prim[first..], &hits.inst[first..]);
        met.hit = !positions_in::<S::Wide>(prims, INVALID_ID) & S::Wide::ALL & lanes;
        if met.hit == 0 {
            return met;
        }
        let vector = |from: &[Column<S>; 3]| each(|axis| S::Wide::load(&from[axis][first..]));
        let (org, dir, t) = (vector(&rays.org), vector(&rays.dir), S::Wide::load(&hits.t[first..]));
        met.position = each(|axis| dir[axis].mul_add(t, org[axis]));
        let faces = S::Wide::load(&hits.u[first..]);
        let mut outward = zero;
        // Lanes whose normals are not unit yet.
        let mut curved = 0;
        let mut left = met.hit;
        while left != 0 {
            // Lanes that share a facet.
            let lead = left.trailing_zeros() as usize % MAX_LANES;
            let face = hits.u[first + lead];
            let same = positions_in::<S::Wide>(prims, prims[lead]) & positions_in::<S::Wide>(insts, insts[lead]);
            let same = same & faces.cmp_eq(S::Wide::splat(face)).bits() & left | 1 << lead;
            left &= !same;
            let (run, facet) = self.facet(hits, first + lead);
            let words = <f32x16 as Lanes>::Mask::from_bits(same);
            met.part = merge(words, run.part, met.part);
            met.material = merge(words, run.material, met.material);
            let mask = <S::Wide as Lanes>::Mask::from_bits(same);
            let normal = match facet {
                Some(facet) => {
                    if !ALL {
                        met.magnitude = space::choose(mask, facet.row(5), met.magnitude);
                    }
                    curved |= if facet.is_flat { 0 } else { same };
                    if facet.is_flat { facet.row(4) } else { facet.outward(met.position) }
                }
                None if ALL => {
                    curved |= same;
                    self.not_affine(rays, hits, first, same, met.position)
                }
                None => {
                    met.hit &= !same;
                    continue;
                }
            };
            outward = space::choose(mask, normal, outward);
        }
        let turned = S::Wide::constant(0.5).cmp_lt(S::Wide::load(&hits.v[first..]));
        let one = S::Wide::constant(1.0);
        let mut scale = one;
        if curved != 0 {
            let curved = <S::Wide as Lanes>::Mask::from_bits(curved);
            scale = S::Wide::select(curved, one / dot(outward, outward).sqrt(), one);
        }
        met.normal = space::scale(outward, S::Wide::select(turned, -scale, scale));
        met
    }

    /// Outward normals, not unit, of the hits of `lanes` at `position`, which are on one face of one primitive without facet.
    #[inline(never)]
    fn not_affine(
        &self,
        rays: &Rays<S>,
        hits: &Hits<S>,
        first: usize,
        lanes: u32,
        position: Lanes3<S::Wide>,
    ) -> Lanes3<S::Wide> {
        let lead = first + lanes.trailing_zeros() as usize;
        let (prim, inst, face) = (hits.prim[lead], hits.inst[lead], hits.u[lead].to_f64() as u32);
        if let Some(normals) = self.curved(prim, inst, face, position) {
            return normals;
        }
        let mut columns = [[S::ZERO; MAX_LANES]; 3];
        for lane in lanes_of(lanes) {
            let normal = self.plain(rays, hits, first + lane);
            (0..3).for_each(|axis| columns[axis][lane] = S::from_f64(normal[axis]));
        }
        each(|axis| S::Wide::load(&columns[axis]))
    }

    /// The same of a leaf of solids that stays where its object is and has a kernel for it.
    #[inline(always)]
    fn curved(&self, prim: u32, inst: u32, face: u32, position: Lanes3<S::Wide>) -> Option<Lanes3<S::Wide>> {
        let placement = &self.assembly.placements[inst as usize];
        let (run, place) = self.runs[placement.object as usize].placed(prim);
        let part = &self.assembly.objects[placement.object as usize].parts[run.part as usize];
        let (PartKind::Solids(tree), Some(place), true) = (&part.kind, place, placement.stands()) else { return None };
        let solid = &tree.leaves[(prim - part.first_prim) as usize].solid;
        Some(place.normal_lanes(solids::curved_normal(solid, place.local_lanes(position), face)?))
    }

    /// Run and facet of hit `i`.
    #[inline(always)]
    fn facet(&self, hits: &Hits<S>, i: usize) -> (Run, Option<&Facet<S>>) {
        let (prim, inst) = (hits.prim[i], hits.inst[i]);
        let placement = &self.assembly.placements[inst as usize];
        let (at, run) = self.runs[placement.object as usize].find(prim);
        let kept = self.facets[placement.object as usize].get(at, hits.u[i].to_f64() as usize);
        (run, kept.filter(|_| placement.stands()))
    }

    /// Outward normal of hit `i`.
    #[inline(never)]
    fn plain(&self, rays: &Rays<S>, hits: &Hits<S>, i: usize) -> DVec3 {
        let (org, dir) = (DVec3::from(rays.org(i).map(S::to_f64)), DVec3::from(rays.dir(i).map(S::to_f64)));
        let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
        let (prim, inst) = (hits.prim[i], hits.inst[i]);
        if let Some(outward) = self.outward(org + dir * t, u as u32, prim, inst) {
            return outward;
        }
        let normal = self.surface(org, dir, t, u, v, prim, inst).ng;
        if v > 0.5 { -normal } else { normal }
    }
}
