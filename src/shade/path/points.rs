//! Points on surfaces as structures of arrays, one list per model of scattering, so that a packet has one model.

use crate::lanes::MAX_LANES;
use crate::lanes::{Lanes, Lanes3, Real};

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

/// Points of one model.
#[derive(Clone, Debug, Default)]
pub struct Points<S> {
    fields: Vec<[S; FIELDS]>,
    columns: Vec<Vec<S>>,
    /// Path of each point.
    pub path: Vec<u32>,
}

/// One point's fields.
pub type Fields<S> = [S; FIELDS];

impl<S: Real> Points<S> {
    /// No points, keeping the memory.
    pub fn clear(&mut self) {
        self.fields.clear();
        self.path.clear();
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.path.len()
    }

    /// Adds a point of path `path`.
    pub fn push(&mut self, path: u32, fields: &Fields<S>) {
        self.path.push(path);
        self.fields.push(*fields);
    }

    /// Makes the columns that packets load from; the last point fills the last packet.
    pub fn seal(&mut self) {
        let padded = self.len().next_multiple_of(MAX_LANES);
        self.columns.resize_with(FIELDS, Vec::new);
        for (field, column) in self.columns.iter_mut().enumerate() {
            column.clear();
            column.extend(self.fields.iter().map(|point| point[field]));
            if let Some(&last) = column.last() {
                column.resize(padded, last);
            }
        }
    }

    /// Field `field` of points `first..first + N`.
    #[inline(always)]
    pub fn scalar<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> V {
        V::load(&self.columns[field][first..])
    }

    /// Fields `field..field + 3` of the same.
    #[inline(always)]
    pub fn vector<V: Lanes<Scalar = S>>(&self, field: usize, first: usize) -> Lanes3<V> {
        [0, 1, 2].map(|i| self.scalar(field + i, first))
    }
}
