//! The rays of one level of paths, what they carry, and what they have found, as structures of arrays.

use glam::DVec3;

use super::{Carry, Path, TOLERANCE};
use crate::lanes::chosen::{Chosen, at, lanes_of, spill};
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each, map3, space};
use crate::ray::{Hits, Rays};
use crate::scene::world::World;
use crate::shade::sample::Samples;

/// Roundings of a point on a surface that a ray from there may still meet the surface within.
const ROUNDINGS: f64 = 64.0;

/// Paths that one sends on, at most: through glass, and mirrored.
const MOST_SENT: usize = 2;

/// Where a ray from a point `org` on a surface begins to count: at the tolerance, which the digits of `f32` do not reach
/// far from the origin.
#[inline(always)]
pub(super) fn start<V: Lanes>(org: Lanes3<V>) -> V {
    let [x, y, z] = map3(org, V::abs);
    let largest = x.fast_max(y).fast_max(z);
    V::constant(TOLERANCE).fast_max(largest * V::constant(ROUNDINGS * V::Scalar::EPSILON.to_f64()))
}

/// Numbers `first..first + N` of three lists.
#[inline(always)]
pub(super) fn vector<S: Real>(from: &[Column<S>; 3], first: usize) -> Lanes3<S::Wide> {
    [S::Wide::load(&from[0][first..]), S::Wide::load(&from[1][first..]), S::Wide::load(&from[2][first..])]
}

/// The direction that rays along `dir` have here.
pub(super) fn unit<S: Real>(dir: DVec3) -> [S; 3] {
    let dir = map3(dir.to_array(), |x| S::Wide::splat(S::from_f64(x)));
    map3(space::normalize(dir), |x| x.lane(0))
}

/// Rays of paths.
#[derive(Clone, Debug, Default)]
pub(super) struct Level<S> {
    /// Unit directions; the segments begin where surfaces count.
    pub rays: Rays<S>,
    /// Parallel to the rays; none for primary rays, which all carry the same.
    carry: Vec<Carry>,
    /// Of each vector of lanes: those inside glass; none for primary rays.
    within: Vec<u32>,
    /// The direction of all rays, if they have one.
    parallel: Option<[S; 3]>,
    /// Whether all rays of all vectors are live.
    is_full: bool,
}

impl<S: Real> Level<S> {
    /// The primary rays `rays`, which are lent, `live` of them live; dead ones stay dead. All look in the direction `parallel`, if
    /// there is one.
    pub fn start(&mut self, rays: &mut Rays<S>, live: u64, parallel: Option<DVec3>) {
        std::mem::swap(&mut self.rays, rays);
        let rays = &mut self.rays;
        self.carry.clear();
        self.within.clear();
        let padded = rays.padded_len();
        self.is_full = live == padded as u64;
        let given = parallel.map(|dir| map3(dir.to_array(), S::from_f64));
        self.parallel = parallel.map(unit);
        match self.parallel {
            // Dead ones may have that direction, too.
            Some(unit) if self.parallel != given => (0..3).for_each(|axis| rays.dir[axis][..padded].fill(unit[axis])),
            Some(_) => {}
            None => {
                for first in (0..padded).step_by(S::Wide::N) {
                    let unit = space::normalize(vector(&rays.dir, first));
                    (0..3).for_each(|axis| unit[axis].store(&mut rays.dir[axis][first..]));
                }
            }
        }
        let tolerance = S::from_f64(TOLERANCE);
        if self.is_full {
            return rays.t_min[..padded].fill(tolerance);
        }
        // Those of dead rays are later than their ends.
        rays.t_min[..padded].iter_mut().for_each(|t_min| *t_min = if *t_min < tolerance { tolerance } else { *t_min });
    }

    /// Ends what [`Self::start`] began: the batch goes back.
    pub fn give_back(&mut self, rays: &mut Rays<S>) {
        std::mem::swap(&mut self.rays, rays);
    }

    /// No paths yet, with room for those that `parents` paths send on; [`Self::close`] ends the additions.
    pub fn open(&mut self, parents: usize) {
        (self.parallel, self.is_full) = (None, false);
        self.rays.open(MOST_SENT * parents + MAX_LANES);
        self.carry.clear();
        self.within.clear();
        self.within.resize(self.rays.padded_len() / S::Wide::N, 0);
    }

    /// Adds a path.
    pub fn push(&mut self, path: &Path) {
        let i = self.carry.len();
        let [org, dir] = [path.org, path.dir].map(|v| map3(v.to_array(), S::from_f64));
        self.rays.set(i, org, dir, start(org), S::INFINITY);
        self.within[i / S::Wide::N] |= u32::from(path.carry.within.is_some()) << (i % S::Wide::N);
        self.carry.push(path.carry);
    }

    /// Adds paths of the lanes `lanes` of a vector, outside of glass; `carry` is what that of a lane carries.
    #[inline]
    pub fn put(&mut self, lanes: u32, [org, dir]: [Lanes3<S::Wide>; 2], carry: impl Fn(usize) -> Carry) {
        let segment = [start(org), S::Wide::splat(S::INFINITY)];
        self.rays.put(self.carry.len(), &Chosen::of(lanes), [org, dir], segment);
        self.carry.extend(lanes_of(lanes).map(carry));
    }

    /// Ends the additions.
    pub fn close(&mut self) {
        self.rays.close(self.carry.len());
    }

    /// Directions of rays `first..first + N`.
    #[inline(always)]
    pub fn dir(&self, first: usize) -> Lanes3<S::Wide> {
        self.parallel.map_or_else(|| vector(&self.rays.dir, first), |dir| map3(dir, S::Wide::splat))
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// What ray `i` carries.
    #[inline]
    pub fn carry(&self, i: usize) -> Carry {
        self.carry.get(i).copied().unwrap_or_else(|| Carry::new(i as u32))
    }

    /// Of vector `k` of lanes those that are rays at all, and those of them that are inside glass.
    #[inline]
    pub fn lanes(&self, k: usize) -> [u32; 2] {
        if self.is_full {
            return [S::Wide::ALL, 0];
        }
        let load = |from: &[S]| S::Wide::load(&from[k * S::Wide::N..]);
        let live = load(&self.rays.t_min).cmp_le(load(&self.rays.t_max)).bits();
        [live, live & self.within.get(k).copied().unwrap_or(0)]
    }

    /// Whether the rays are the primary ones.
    pub fn is_primary(&self) -> bool {
        self.carry.is_empty()
    }

    /// Adds what rays `first + lane` of `lanes` show, each its own of `color`, to their pixels. Primary rays, which show
    /// something once at most, make theirs opaque.
    #[inline]
    pub fn show(&self, first: usize, lanes: u32, color: Lanes3<S::Wide>, out: &mut Samples) {
        if lanes == 0 {
            return;
        }
        if self.is_primary() {
            out.colors.make_lanes_opaque::<S::Wide>(first, lanes);
            return out.colors.add_lanes(first, lanes, color);
        }
        let color = spill(color);
        for lane in lanes_of(lanes) {
            let carry = &self.carry[first + lane];
            let color = DVec3::from(map3(at(&color, lane % MAX_LANES), S::to_f64));
            out.colors.add(carry.pixel as usize, carry.throughput * color);
        }
    }

    /// Ray `i` with what it carries.
    pub fn path(&self, i: usize) -> Path {
        let vector = |v: [S; 3]| DVec3::from(v.map(S::to_f64));
        Path { org: vector(self.rays.org(i)), dir: vector(self.rays.dir(i)), carry: self.carry(i) }
    }
}

/// What the rays of a batch have met. Entries of rays that met nothing mean nothing; arrays by ray may be longer than the batch.
#[derive(Clone, Debug, Default)]
pub(super) struct Found<S> {
    /// Distance along the ray.
    pub t: Column<S>,
    /// World space.
    pub position: [Column<S>; 3],
    /// Unit, outward.
    pub normal: [Column<S>; 3],
    /// Number of the region.
    pub region: Column<u32>,
    /// Of each vector of lanes: those that met something.
    pub hit: Vec<u32>,
    /// Those that met it from inside.
    pub leaving: Vec<u32>,
}

impl<S: Real> Found<S> {
    /// Of the rays of `level`, whose hits are `hits`. A call of its own, with all of it inside: one call for each vector takes longer.
    #[inline(never)]
    pub fn set(&mut self, world: &World<S>, level: &Level<S>, hits: &Hits<S>) {
        self.open(level.rays.padded_len());
        (0..self.hit.len()).for_each(|k| self.set_vector(k, world, &level.rays, level.dir(k * S::Wide::N), hits));
    }

    /// Nothing yet, of `padded` rays; [`Self::set_vector`] sets some.
    pub fn open(&mut self, padded: usize) {
        let arrays = self.position.iter_mut().chain(&mut self.normal).chain([&mut self.t]);
        arrays.for_each(|array| array.at_least(padded));
        self.region.at_least(padded);
        self.hit.resize(padded / S::Wide::N, 0);
        self.leaving.resize(padded / S::Wide::N, 0);
    }

    /// Sets what vector `k` of lanes of `rays`, whose directions are `dir`, has met.
    #[inline(always)]
    pub fn set_vector(&mut self, k: usize, world: &World<S>, rays: &Rays<S>, dir: Lanes3<S::Wide>, hits: &Hits<S>) {
        let first = k * S::Wide::N;
        let met = world.met(rays, hits, first);
        (self.hit[k], self.leaving[k]) = (met.hit, 0);
        if met.hit == 0 {
            return;
        }
        self.leaving[k] = S::Wide::constant(0.0).cmp_lt(dot(met.normal, dir)).bits() & met.hit;
        for axis in 0..3 {
            met.position[axis].store(&mut self.position[axis][first..]);
            met.normal[axis].store(&mut self.normal[axis][first..]);
        }
        S::Wide::load(&hits.t[first..]).store(&mut self.t[first..]);
        self.region[first..][..S::Wide::N].copy_from_slice(&met.part[..S::Wide::N]);
    }

    /// Whether ray `i` met something.
    pub fn is_hit(&self, i: usize) -> bool {
        self.hit[i / S::Wide::N] >> (i % S::Wide::N) & 1 != 0
    }

    /// Whether it met it from inside.
    pub fn is_leaving(&self, i: usize) -> bool {
        self.leaving[i / S::Wide::N] >> (i % S::Wide::N) & 1 != 0
    }

    /// Where ray `i` met something.
    pub fn position(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.position[axis][i].to_f64()))
    }

    /// The outward normal there.
    pub fn normal(&self, i: usize) -> DVec3 {
        DVec3::from(each(|axis| self.normal[axis][i].to_f64()))
    }
}
