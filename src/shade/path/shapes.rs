//! Where the rays of a wave meet shapes and solids, in lanes.

use super::points::{BASE, FIELDS, Fields, NORMAL, OFFSET, OUT, PARAM, POSITION, SHADING, SQUEEZE, THROUGHPUT};
use super::wave::Wave;
use crate::lanes::space::normalize;
use crate::lanes::{Lanes, Lanes3, Real, map3};
use crate::ray::{Hits, Rays};
use crate::scene::world::World;
use crate::shade::look::Look;
use crate::shade::place::Place;

/// Rows of [`ShapePoints`]: position, normal, direction out, offset.
const ROWS: usize = 10;

/// Points of a wave's hits on shapes.
#[derive(Clone, Debug, Default)]
pub struct ShapePoints<S> {
    rows: [Vec<S>; ROWS],
    material: Vec<u32>,
    /// Of each vector of lanes: the rays whose points are here.
    known: Vec<u32>,
    /// Those that came from the side of the normal.
    front: Vec<u32>,
}

impl<S: Real> ShapePoints<S> {
    /// Takes the hits `hits` of `rays`; without `world` there are none.
    pub fn set(&mut self, world: Option<&World<S>>, rays: &Rays<S>, hits: &Hits<S>) {
        self.known.clear();
        self.front.clear();
        let Some(world) = world else { return };
        let padded = rays.padded_len();
        self.rows.iter_mut().for_each(|row| row.resize(padded, S::ZERO));
        self.material.resize(padded, 0);
        for first in (0..padded).step_by(S::Wide::N) {
            let met = world.met_facets(rays, hits, first);
            self.known.push(met.hit);
            if met.hit == 0 {
                self.front.push(0);
                continue;
            }
            let vector = |from: &[Vec<S>; 3]| [&from[0], &from[1], &from[2]].map(|a| S::Wide::load(&a[first..]));
            let (org, dir): (Lanes3<S::Wide>, Lanes3<S::Wide>) = (vector(&rays.org), vector(&rays.dir));
            let t = S::Wide::load(&hits.t[first..]);
            let Place { position, normal, offset, front } = Place::on_facet(&met, org, dir, t);
            self.front.push(front);
            let out = normalize(map3(dir, |x| -x));
            let rows = position.into_iter().chain(normal).chain(out).chain([offset]);
            self.rows.iter_mut().zip(rows).for_each(|(row, x)| x.store(&mut row[first..]));
            self.material[first..][..S::Wide::N].copy_from_slice(&met.material[..S::Wide::N]);
        }
    }

    /// Material of ray `i`'s point, and whether the ray came from the side of the normal; `None` if it is not here.
    #[inline]
    pub fn get(&self, i: usize) -> Option<(u32, bool)> {
        let (vector, lane) = (i / S::Wide::N, i % S::Wide::N);
        let is_known = self.known.get(vector).is_some_and(|known| known >> lane & 1 != 0);
        is_known.then(|| (self.material[i], self.front[vector] >> lane & 1 != 0))
    }

    /// The fields of the point of ray `i` of `wave`, which scatters as `look` says.
    #[inline]
    pub fn fields(&self, i: usize, wave: &Wave<S>, look: &Look) -> Fields<S> {
        let mut fields = [S::ZERO; FIELDS];
        for axis in 0..3 {
            fields[POSITION + axis] = self.rows[axis][i];
            fields[SHADING + axis] = self.rows[3 + axis][i];
            fields[NORMAL + axis] = self.rows[3 + axis][i];
            fields[OUT + axis] = self.rows[6 + axis][i];
        }
        fields[OFFSET] = self.rows[9][i];
        (0..3).for_each(|axis| fields[BASE + axis] = S::from_f64(look.base[axis]));
        (0..7).for_each(|k| fields[PARAM + k] = S::from_f64(look.param[k]));
        fields[THROUGHPUT..THROUGHPUT + 3].copy_from_slice(&wave.throughput[i]);
        fields[SQUEEZE] = wave.squeeze[i];
        fields
    }
}
