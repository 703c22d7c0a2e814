//! Points on surfaces that the rays of a wave met: where they are, in the order of the rays, and lists of them for each model
//! of scattering, so that a packet has one model.

use glam::DVec3;

use crate::lanes::chosen::Picked;
use crate::lanes::{Column, Lanes, Lanes3, Real};
use crate::shade::place::Place;

/// Points of one model.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// The ray of the wave that met each, and its look, by number.
    pub list: Vec<[u32; 2]>,
}

impl Points {
    /// None, keeping the memory.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Adds the point that ray `ray` met.
    #[inline(always)]
    pub fn push(&mut self, ray: usize, look: u32) {
        self.list.push([ray as u32, look]);
    }
}

/// First row of the position, world space.
const POSITION: usize = 0;
/// Unit geometric normal, on the side the light is seen from.
const NORMAL: usize = 3;
/// Unit shading normal, on that side.
const SHADING: usize = 6;
/// How far a ray must start from the position along the geometric normal.
const OFFSET: usize = 9;
/// Number of rows.
const ROWS: usize = 10;

/// Where the rays of a wave met surfaces, parallel to them; rays that met nothing have unspecified places.
#[derive(Clone, Debug, Default)]
pub struct Places<S> {
    rows: [Column<S>; ROWS],
}

/// Where the points of a packet are.
#[derive(Clone, Copy, Debug)]
pub struct PlaceLanes<V> {
    /// World space.
    pub position: Lanes3<V>,
    /// Unit geometric normal, on the side the light is seen from.
    pub normal: Lanes3<V>,
    /// Unit shading normal, on that side.
    pub shading: Lanes3<V>,
    /// How far a ray must start from the position along the geometric normal.
    pub offset: V,
}

impl<S: Real> Places<S> {
    /// Makes room for those of `padded` rays with their padding.
    pub fn open(&mut self, padded: usize) {
        self.rows.iter_mut().for_each(|row| row.at_least(padded));
    }

    /// Sets those of rays `first..first + N`.
    #[inline(always)]
    pub fn put_lanes(&mut self, first: usize, place: &Place<S::Wide>) {
        // Written out: a chain of iterators over vectors goes through memory one by one.
        for axis in 0..3 {
            place.position[axis].store(&mut self.rows[POSITION + axis][first..]);
            place.normal[axis].store(&mut self.rows[NORMAL + axis][first..]);
            place.normal[axis].store(&mut self.rows[SHADING + axis][first..]);
        }
        place.offset.store(&mut self.rows[OFFSET][first..]);
    }

    /// Sets that of ray `i`.
    pub fn put(&mut self, i: usize, [position, normal, shading]: [DVec3; 3], offset: f64) {
        let rows = [position, normal, shading].into_iter().flat_map(|v| v.to_array()).chain([offset]);
        self.rows.iter_mut().zip(rows).for_each(|(row, x)| row[i] = S::from_f64(x));
    }

    /// Those of some rays.
    #[inline(always)]
    pub fn of(&self, rays: &Picked) -> PlaceLanes<S::Wide> {
        let [px, py, pz, nx, ny, nz, sx, sy, sz, offset] = &self.rows;
        PlaceLanes {
            position: rays.take3([px, py, pz]),
            normal: rays.take3([nx, ny, nz]),
            shading: rays.take3([sx, sy, sz]),
            offset: rays.take(offset),
        }
    }
}
