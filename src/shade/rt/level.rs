//! The rays of one level of paths, what they carry, and what they have found, as structures of arrays.

use glam::DVec3;

use super::{Carry, Path, TOLERANCE};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, dot, each, space};
use crate::ray::{Hits, Rays};
use crate::scene::world::World;

/// Roundings of a point on a surface that a ray from there may still meet the surface within.
const ROUNDINGS: f64 = 64.0;

/// Where a ray from a point `org` on a surface begins to count: at the tolerance, which the digits of `f32` do not reach
/// far from the origin.
pub(super) fn start<S: Real>(org: [S; 3]) -> S {
    let largest = org.iter().fold(S::ZERO, |most, x| most.fast_max(x.abs()));
    S::from_f64(TOLERANCE).fast_max(largest * S::from_f64(ROUNDINGS * S::EPSILON.to_f64()))
}

/// Rays of paths.
#[derive(Clone, Debug, Default)]
pub(super) struct Level<S> {
    /// Unit directions; the segments begin where surfaces count.
    pub rays: Rays<S>,
    /// Parallel to the rays; none for primary rays, which all carry the same.
    carry: Vec<Carry>,
}

impl<S: Real> Level<S> {
    /// The primary rays `rays`; dead ones stay dead.
    pub fn start(&mut self, rays: &Rays<S>) {
        self.rays.reset(rays.len());
        self.carry.clear();
        let tolerance = S::Wide::constant(TOLERANCE);
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let vector = |from: &[Vec<S>; 3]| each(|axis| S::Wide::load(&from[axis][first..]));
            let dir: Lanes3<S::Wide> = space::normalize(vector(&rays.dir));
            for (axis, (org, dir)) in vector(&rays.org).into_iter().zip(dir).enumerate() {
                org.store(&mut self.rays.org[axis][first..]);
                dir.store(&mut self.rays.dir[axis][first..]);
            }
            tolerance.fast_max(S::Wide::load(&rays.t_min[first..])).store(&mut self.rays.t_min[first..]);
            S::Wide::load(&rays.t_max[first..]).store(&mut self.rays.t_max[first..]);
        }
    }

    /// The paths `paths`.
    pub fn open(&mut self, paths: &[Path]) {
        self.rays.reset(paths.len());
        self.carry.clear();
        for (i, path) in paths.iter().enumerate() {
            let (org, dir) = (path.org.to_array().map(S::from_f64), path.dir.to_array().map(S::from_f64));
            self.rays.set(i, org, dir, start(org), S::INFINITY);
            self.carry.push(path.carry);
        }
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

    /// Whether ray `i` is one at all.
    pub fn is_live(&self, i: usize) -> bool {
        self.rays.t_min[i] <= self.rays.t_max[i]
    }

    /// Ray `i` with what it carries.
    pub fn path(&self, i: usize) -> Path {
        let vector = |v: [S; 3]| DVec3::from(v.map(S::to_f64));
        Path { org: vector(self.rays.org(i)), dir: vector(self.rays.dir(i)), carry: self.carry(i) }
    }
}

/// What the rays of a batch have met. Entries of rays that met nothing mean nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Found<S> {
    /// Distance along the ray.
    pub t: Vec<S>,
    /// World space.
    pub position: [Vec<S>; 3],
    /// Unit, outward.
    pub normal: [Vec<S>; 3],
    /// Number of the region.
    pub region: Vec<u32>,
    /// Of each vector of lanes: those that met something.
    pub hit: Vec<u32>,
    /// Those that met it from inside.
    leaving: Vec<u32>,
}

impl<S: Real> Found<S> {
    /// Of `rays`, whose hits are `hits`.
    pub fn set(&mut self, world: &World<S>, rays: &Rays<S>, hits: &Hits<S>) {
        let padded = rays.padded_len();
        for array in self.position.iter_mut().chain(&mut self.normal).chain([&mut self.t]) {
            array.resize(padded, S::ZERO);
        }
        self.region.resize(padded, 0);
        self.hit.clear();
        self.leaving.clear();
        for first in (0..padded).step_by(S::Wide::N) {
            let met = world.met(rays, hits, first);
            self.hit.push(met.hit);
            let dir: Lanes3<S::Wide> = each(|axis| S::Wide::load(&rays.dir[axis][first..]));
            let leaving = S::Wide::constant(0.0).cmp_lt(dot(met.normal, dir)).bits();
            self.leaving.push(leaving & met.hit);
            if met.hit == 0 {
                continue;
            }
            for axis in 0..3 {
                met.position[axis].store(&mut self.position[axis][first..]);
                met.normal[axis].store(&mut self.normal[axis][first..]);
            }
            S::Wide::load(&hits.t[first..]).store(&mut self.t[first..]);
            self.region[first..][..S::Wide::N].copy_from_slice(&met.part[..S::Wide::N]);
        }
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
