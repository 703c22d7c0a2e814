//! Points on surfaces in packets, one list per model of scattering, so that a packet has one model.

use crate::lanes::space::normalize;
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, map3};
use crate::shade::place::Place;

/// First field of the position, world space.
pub const POSITION: usize = 0;
/// Unit shading normal, on the side the light is seen from.
pub const SHADING: usize = 3;
/// Unit geometric normal, on that side.
pub const NORMAL: usize = 6;
/// Unit direction to where the light goes.
pub const OUT: usize = 9;
/// Base colour.
pub const BASE: usize = 12;
/// Further parameters of the model, seven.
pub const PARAM: usize = 15;
/// How far a ray must start from the position along the geometric normal.
pub const OFFSET: usize = 22;
/// What of the point's radiance reaches the eye.
pub const THROUGHPUT: usize = 23;
/// Product of the squared relative indices of refraction that the throughput was divided by.
pub const SQUEEZE: usize = 26;
/// Number of fields.
pub const FIELDS: usize = 27;

// What a raw point has instead, until it is settled.

/// First corner of the triangle, world space, and the edges from it to the second and the third.
pub const RAW_TRIANGLE: usize = POSITION;
/// Direction of the ray.
pub const RAW_DIR: usize = OUT;
/// Weights of the second and third corner, parameter of the hit.
pub const RAW_PLACE: usize = PARAM + 4;

/// One point's fields.
pub type Fields<S> = [S; FIELDS];

/// Sixteen points.
#[derive(Clone, Debug)]
struct Block<S> {
    fields: [[S; MAX_LANES]; FIELDS],
    /// Bit `i`: point `i` is raw.
    raw: u32,
}

/// Points of one model.
#[derive(Clone, Debug, Default)]
pub struct Points<S> {
    blocks: Vec<Block<S>>,
    /// Path of each point.
    pub path: Vec<u32>,
}

impl<S: Real> Points<S> {
    /// No points, keeping the memory.
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.path.clear();
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.path.len()
    }

    /// Adds a point of path `path`. A raw one, on a triangle without shading normals, has [`RAW_TRIANGLE`] and so on
    /// instead of position, normals, direction and offset; its model has at most four parameters.
    #[inline]
    pub fn push(&mut self, path: u32, fields: &Fields<S>, is_raw: bool) {
        let lane = self.path.len() % MAX_LANES;
        if lane == 0 {
            self.blocks.push(Block { fields: [[S::ZERO; MAX_LANES]; FIELDS], raw: 0 });
        }
        self.path.push(path);
        if let Some(block) = self.blocks.last_mut() {
            for (column, &value) in block.fields.iter_mut().zip(fields) {
                column[lane] = value;
            }
            block.raw |= u32::from(is_raw) << lane;
        }
    }

    /// Computes position, normals, direction and offset of the raw points.
    pub fn settle(&mut self) {
        for block in self.blocks.iter_mut().filter(|block| block.raw != 0) {
            for first in (0..MAX_LANES).step_by(S::Wide::N) {
                settle(block, first);
            }
        }
    }

    /// Field `field` of points `first..first + N`.
    #[inline(always)]
    pub fn scalar<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> V {
        V::load(&self.blocks[first / MAX_LANES].fields[field][first % MAX_LANES..])
    }

    /// Fields `field..field + 3` of the same.
    #[inline(always)]
    pub fn vector<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> Lanes3<V> {
        [0, 1, 2].map(|i| self.scalar(field + i, first))
    }
}

#[inline(always)]
fn settle<S: Real>(block: &mut Block<S>, first: usize) {
    let scalar = |field: usize| S::Wide::load(&block.fields[field][first..]);
    let vector = |field: usize| [0, 1, 2].map(|i| scalar(field + i));
    let raw = <S::Wide as Lanes>::Mask::from_bits(block.raw >> first);
    let (corner, e1, e2) = (vector(RAW_TRIANGLE), vector(RAW_TRIANGLE + 3), vector(RAW_TRIANGLE + 6));
    let ([u, v, t], dir) = (vector(RAW_PLACE), vector(RAW_DIR));
    let out = normalize(map3(dir, |x| -x));
    let Place { position, normal, offset, .. } = Place::on_triangle([corner, e1, e2], [u, v, t], dir);
    let mut put = |field: usize, value: S::Wide| {
        let column = &mut block.fields[field][first..];
        S::Wide::select(raw, value, S::Wide::load(column)).store(column);
    };
    for axis in 0..3 {
        put(POSITION + axis, position[axis]);
        put(SHADING + axis, normal[axis]);
        put(NORMAL + axis, normal[axis]);
        put(OUT + axis, out[axis]);
    }
    put(OFFSET, offset);
}
