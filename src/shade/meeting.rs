//! Where rays met surfaces, in lanes as far as that can be: on shapes and on triangles without shading normals.

use super::bare::BareTriangles;
use super::look::Looks;
use super::place::Place;
use crate::lanes::chosen::{lanes_of, positions_in};
use crate::lanes::{Column, LaneMask, Lanes, MAX_LANES, Real, dot, each};
use crate::ray::{Hits, INVALID_ID, Rays};
use crate::scene::world::World;

/// Finds these places in one world.
#[derive(Debug)]
pub(super) struct Meeting<S> {
    /// Whether some hits come out of the world in lanes.
    has_facets: bool,
    bare: BareTriangles<S>,
}

/// Where a vector of rays met surfaces, and whose.
pub(super) struct Met<V> {
    /// The points.
    pub place: Place<V>,
    /// Their materials.
    pub material: [u32; MAX_LANES],
    /// Lanes whose numbers are here.
    pub known: u32,
}

/// The lanes of rays `first..first + N` that hit something.
#[inline(always)]
pub(super) fn met_lanes<S: Real>(hits: &Hits<S>, first: usize) -> u32 {
    !positions_in::<S::Wide>(&hits.prim[first..], INVALID_ID) & S::Wide::ALL
}

impl<S: Real> Meeting<S> {
    /// For `world`, through which `rays` primary rays are to be traced.
    pub fn new(world: &World<S>, looks: &Looks<'_>, rays: u64) -> Self {
        Self { has_facets: world.has_facets(), bare: BareTriangles::new(world, looks, rays) }
    }

    /// Of no use: for who does not ask.
    pub fn none() -> Self {
        Self { has_facets: false, bare: BareTriangles::default() }
    }

    /// The places of rays `first..first + N`, of which those in `hit` hit something. Lanes that are not known mean nothing.
    #[inline(always)]
    pub fn places(
        &self,
        world: &World<S>,
        looks: &Looks<'_>,
        rays: &Rays<S>,
        hits: &Hits<S>,
        first: usize,
        hit: u32,
    ) -> Met<S::Wide> {
        let vector = |from: &[Column<S>; 3]| each(|axis| S::Wide::load(&from[axis][first..]));
        let (dir, t) = (vector(&rays.dir), S::Wide::load(&hits.t[first..]));
        let zero = S::Wide::constant(0.0);
        let nowhere = Place { position: [zero; 3], normal: [zero; 3], offset: zero, front: 0 };
        let mut met = Met { place: nowhere, material: [INVALID_ID; MAX_LANES], known: 0 };
        let (bare, triangle) = self.bare.gather((world, looks), hits, first, hit, &mut met.material);
        if bare != 0 {
            let [u, v] = [&hits.u, &hits.v].map(|from| S::Wide::load(&from[first..]));
            met.place = Place::on_triangle(&triangle, [u, v, t], dir);
            // Triangles without area are looked at one by one.
            let square = dot(met.place.normal, met.place.normal);
            met.known = bare & square.cmp_lt(S::Wide::constant(1.5)).bits();
        }
        if self.has_facets && hit & !bare != 0 {
            let facets = world.met_facets(rays, hits, first, hit & !bare);
            if facets.hit != 0 {
                met.place = Place::on_facet(&facets, vector(&rays.org), dir, t).or(facets.hit, met.place);
                lanes_of(facets.hit).for_each(|lane| met.material[lane] = facets.material[lane]);
                met.known |= facets.hit;
            }
        }
        met
    }
}
