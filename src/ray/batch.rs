//! Batches of rays and hits as structures of arrays.
//!
//! A batch is what an engine gets in one call: usually the rays of one 32x32 or 16x16 pixel tile in Morton order.
//! The arrays are padded with dead rays to a multiple of [`PAD`], so every packet width loads whole vectors. They may be
//! longer: what is behind the padding means nothing.

use crate::lanes::chosen::Chosen;
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, Real, each};

/// "No primitive", "no instance".
pub const INVALID_ID: u32 = u32::MAX;

/// Batches are padded to a multiple of this many rays (the widest packet).
pub const PAD: usize = 16;

/// A batch of rays, world space. `org` and `dir` hold the x, y and z arrays; directions need not be unit, but squares of their
/// lengths, also in the space of instances and shapes, must neither vanish nor overflow: in f32 lengths of 1e-18 to 1e18 are traced.
/// A ray with `t_max < t_min`, a NaN or infinity in origin or direction, or a zero direction is dead: it misses.
#[derive(Clone, Debug, Default)]
pub struct Rays<S> {
    len: usize,
    /// Origins: x, y, z arrays of `padded_len` values at least.
    pub org: [Column<S>; 3],
    /// Directions.
    pub dir: [Column<S>; 3],
    /// Start of the closed segment.
    pub t_min: Column<S>,
    /// End of the closed segment; may be infinite.
    pub t_max: Column<S>,
}

impl<S: Real> Rays<S> {
    /// `len` dead rays.
    pub fn new(len: usize) -> Self {
        let mut rays = Self::default();
        rays.reset(len);
        rays
    }

    /// Makes this a batch of `len` dead rays, keeping the memory.
    pub fn reset(&mut self, len: usize) {
        self.open(len);
        let padded = self.padded_len();
        for array in self.org.iter_mut().chain(&mut self.dir).chain([&mut self.t_max]) {
            array[..padded].fill(S::ZERO);
        }
        self.t_min[..padded].fill(S::ONE);
    }

    /// Makes this a batch of `len` rays with unspecified contents, for who sets all of them; padding is dead.
    pub fn prepare(&mut self, len: usize) {
        self.open(len);
        self.close(len);
    }

    /// Makes room for `len` rays with unspecified contents, for who sets some; [`Self::close`] ends that.
    pub fn open(&mut self, len: usize) {
        self.len = len;
        let padded = self.padded_len();
        let arrays = self.org.iter_mut().chain(&mut self.dir).chain([&mut self.t_min, &mut self.t_max]);
        arrays.for_each(|array| array.at_least(padded));
    }

    /// Keeps the first `len` rays, which have been set.
    pub fn close(&mut self, len: usize) {
        self.len = len.min(self.len);
        (self.len..self.padded_len()).for_each(|i| self.kill(i));
    }

    /// Number of rays, without padding.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Length of the arrays.
    pub fn padded_len(&self) -> usize {
        self.len.next_multiple_of(PAD)
    }

    /// Sets ray `i`.
    pub fn set(&mut self, i: usize, org: [S; 3], dir: [S; 3], t_min: S, t_max: S) {
        for axis in 0..3 {
            self.org[axis][i] = org[axis];
            self.dir[axis][i] = dir[axis];
        }
        self.t_min[i] = t_min;
        self.t_max[i] = t_max;
    }

    /// Sets rays from `first` on to those of the lanes `chosen` of origins, directions, beginnings and ends. What follows them
    /// is unspecified, as far as a vector reaches.
    #[inline(always)]
    pub fn put(
        &mut self,
        first: usize,
        chosen: &Chosen,
        [org, dir]: [Lanes3<S::Wide>; 2],
        [t_min, t_max]: [S::Wide; 2],
    ) {
        for axis in 0..3 {
            chosen.pack(org[axis], &mut self.org[axis][first..]);
            chosen.pack(dir[axis], &mut self.dir[axis][first..]);
        }
        chosen.pack(t_min, &mut self.t_min[first..]);
        chosen.pack(t_max, &mut self.t_max[first..]);
    }

    /// Makes ray `i` dead.
    pub fn kill(&mut self, i: usize) {
        let (zero, one) = (S::from_f64(0.0), S::from_f64(1.0));
        self.set(i, [zero; 3], [zero; 3], one, zero);
    }

    /// Origin of ray `i`.
    pub fn org(&self, i: usize) -> [S; 3] {
        [self.org[0][i], self.org[1][i], self.org[2][i]]
    }

    /// Direction of ray `i`.
    pub fn dir(&self, i: usize) -> [S; 3] {
        [self.dir[0][i], self.dir[1][i], self.dir[2][i]]
    }

    /// Whether ray `i` can hit anything: finite, a direction, a segment that is not empty.
    #[inline]
    pub fn is_live(&self, i: usize) -> bool {
        let zero = S::from_f64(0.0);
        // Nothing of a finite number is zero, of others it is no number: one comparison instead of six.
        let nothing = |v: [S; 3]| v[0] * zero + v[1] * zero + v[2] * zero;
        let finite = nothing(self.org(i)) + nothing(self.dir(i)) == zero;
        finite && self.dir(i).iter().any(|&d| d != zero) && self.t_min[i] <= self.t_max[i]
    }

    /// The live ones of rays `first..first + N`, lane by lane.
    #[inline]
    pub fn live_lanes(&self, first: usize) -> u32 {
        let load = |from: &[S]| S::Wide::load(&from[first..]);
        let zero = S::Wide::constant(0.0);
        let nothing = |v: &[Column<S>; 3]| load(&v[0]) * zero + load(&v[1]) * zero + load(&v[2]) * zero;
        let finite = (nothing(&self.org) + nothing(&self.dir)).cmp_eq(zero);
        let [x, y, z] = each(|axis| load(&self.dir[axis]).cmp_eq(zero));
        let live = finite & !(x & y & z) & load(&self.t_min).cmp_le(load(&self.t_max));
        live.bits() & S::Wide::ALL
    }

    /// The same of a vector of any width.
    #[inline(always)]
    pub fn live_vector<V: Lanes<Scalar = S>>(&self, first: usize) -> u32 {
        let parts = (0..V::N).step_by(S::Wide::N);
        parts.fold(0, |live, lane| live | self.live_lanes(first + lane) << lane) & V::ALL
    }

    /// Number of live rays.
    pub fn live_count(&self) -> usize {
        // The padding is dead.
        self.live_among(self.padded_len())
    }

    /// Number of live rays among the first `count`.
    pub fn live_among(&self, count: usize) -> usize {
        let among = |first: usize| u32::MAX.checked_shl((count - first) as u32).map_or(u32::MAX, |beyond| !beyond);
        let starts = (0..count).step_by(S::Wide::N);
        starts.map(|first| (self.live_lanes(first) & among(first)).count_ones() as usize).sum()
    }
}

/// Hits of a batch. A miss has `t` = infinity and both ids [`INVALID_ID`]; the padding, up to a multiple of [`PAD`], is misses.
#[derive(Clone, Debug, Default)]
pub struct Hits<S> {
    len: usize,
    /// Ray parameter.
    pub t: Column<S>,
    /// Triangles: weight of the second corner. Analytic shapes and leaves of trees of solids: number of the face that was hit (see
    /// [`crate::shape`]).
    pub u: Column<S>,
    /// Triangles: weight of the third corner. Analytic shapes: 0. Leaves of trees of solids: 1 where the leaf's outside is
    /// inside the whole, as where it was subtracted, else 0.
    pub v: Column<S>,
    /// Primitive number inside the instance's object; of a tree of solids, that of the leaf whose surface was hit.
    pub prim: Column<u32>,
    /// Instance number.
    pub inst: Column<u32>,
}

impl<S: Real> Hits<S> {
    /// `len` misses.
    pub fn new(len: usize) -> Self {
        let mut hits = Self::default();
        hits.reset(len);
        hits
    }

    /// Makes this `len` misses, keeping the memory.
    pub fn reset(&mut self, len: usize) {
        self.prepare(len);
        for (array, fill) in [(&mut self.t, f64::INFINITY), (&mut self.u, 0.0), (&mut self.v, 0.0)] {
            array.fill(S::from_f64(fill));
        }
        [&mut self.prim, &mut self.inst].into_iter().for_each(|array| array.fill(INVALID_ID));
    }

    /// Makes this `len` hits and misses, with unspecified contents: for who writes all of them, and misses to the padding.
    pub fn prepare(&mut self, len: usize) {
        let padded = len.next_multiple_of(PAD);
        self.len = len;
        [&mut self.t, &mut self.u, &mut self.v].into_iter().for_each(|array| array.resize(padded));
        [&mut self.prim, &mut self.inst].into_iter().for_each(|array| array.resize(padded));
    }

    /// Number of hits and misses, without padding.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether ray `i` hit something.
    pub fn is_hit(&self, i: usize) -> bool {
        self.prim[i] != INVALID_ID
    }

    /// Number of rays that hit something.
    pub fn hit_count(&self) -> usize {
        self.prim[..self.len].iter().filter(|&&p| p != INVALID_ID).count()
    }
}
