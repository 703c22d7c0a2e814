//! What points scatter with, as numbers in lanes.

use glam::DVec3;

use super::look::Looks;
use crate::lanes::chosen::records;
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real};

/// Numbers of a look: base colour, seven parameters.
pub const NUMBERS: usize = 10;

/// What a point scatters with, but for the model.
pub type LookNumbers<S> = [S; NUMBERS];

/// `base` and `param` in one list.
#[inline]
pub fn look_numbers<S: Real>(base: DVec3, param: &[f64; 7]) -> LookNumbers<S> {
    let mut numbers = [S::ZERO; NUMBERS];
    let all = base.to_array().into_iter().chain(*param);
    numbers.iter_mut().zip(all).for_each(|(to, from)| *to = S::from_f64(from));
    numbers
}

/// Those of the sides of materials, as [`Looks::sides`] lists them.
pub fn numbers_of_sides<S: Real>(looks: &Looks<'_>) -> Vec<LookNumbers<S>> {
    looks.sides().map(|look| look_numbers(look.base, &look.param)).collect()
}

/// What the points of a packet scatter with, but for the model.
#[derive(Clone, Copy, Debug)]
pub struct LookLanes<V> {
    /// Base colour.
    pub base: Lanes3<V>,
    /// Parameters of the model.
    pub param: [V; 7],
}

impl<V: Lanes> LookLanes<V> {
    /// Of points in the lanes `lanes` that look like the entries `which` of two lists as one; unspecified elsewhere.
    #[inline(always)]
    pub fn of([list, more]: [&[LookNumbers<V::Scalar>]; 2], lanes: u32, which: &[u32; MAX_LANES]) -> Self {
        let entry = |k: u32| list.get(k as usize).unwrap_or_else(|| &more[k as usize - list.len()]);
        let [r, g, b, p0, p1, p2, p3, p4, p5, p6] = records(lanes, which, entry);
        Self { base: [r, g, b], param: [p0, p1, p2, p3, p4, p5, p6] }
    }

    /// Three parameters from number `k` on.
    #[inline(always)]
    pub fn three(&self, k: usize) -> Lanes3<V> {
        [self.param[k], self.param[k + 1], self.param[k + 2]]
    }
}
