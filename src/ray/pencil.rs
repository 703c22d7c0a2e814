//! Rays through one point, as a camera makes them: what an engine can make itself, in coordinates of its own.

use super::Rays;
use crate::lanes::{Real, each, f64x8};

/// Pixels along the edge of the largest square of rays.
pub const EDGE: usize = 32;

/// Column and row of the rays of a block of 4 x 4, in Morton order.
const BLOCK: [[usize; 16]; 2] =
    [[0, 1, 0, 1, 2, 3, 2, 3, 0, 1, 0, 1, 2, 3, 2, 3], [0, 0, 1, 1, 0, 0, 1, 1, 2, 2, 3, 3, 2, 2, 3, 3]];

/// Rays of a square of pixels in Morton order that start in one point. Segments are [0, infinity].
///
/// The direction of a ray whose places are (a, b) is `a right + b up + forward`, in f64, rounded to the precision of
/// who traces it.
#[derive(Clone, Debug, Default)]
pub struct Pencil {
    /// The common point, world space.
    pub origin: [f64; 3],
    /// Unit vectors to the right, up and forward, perpendicular to each other.
    pub axes: [[f64; 3]; 3],
    /// Where the rays go.
    pub places: Places,
    /// Live rays, bit by ray, sixteen at a time; as many blocks as there are.
    pub live: Vec<u16>,
}

/// Where rays cross the plane at distance one, to the right (`[0]`) and up (`[1]`).
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one per thread, made anew for each tile: a box would be, too")]
pub enum Places {
    /// The same for all rays of a column of pixels, and for all of a row.
    Grid([[f64; EDGE]; 2]),
    /// Of each ray.
    Each([Vec<f64>; 2]),
}

impl Default for Places {
    fn default() -> Self {
        Self::Each(Default::default())
    }
}

/// Column and row of block `block` of 4 x 4 pixels.
#[inline(always)]
fn corner(block: usize) -> [usize; 2] {
    let even = |i: usize| i & 1 | i >> 1 & 2 | i >> 2 & 4;
    [4 * (even(block) & 7), 4 * (even(block >> 1) & 7)]
}

impl Places {
    /// Places of the rays of block `block`.
    #[inline(always)]
    pub fn of_block(&self, block: usize) -> [[f64; 16]; 2] {
        match self {
            Self::Grid([columns, rows]) => {
                let [x, y] = corner(block);
                [spread(columns, x, 0), spread(rows, y, 1)]
            }
            Self::Each([a, b]) => {
                let part = |list: &[f64]| list[block * 16..].first_chunk().copied().unwrap_or([0.0; 16]);
                [part(a), part(b)]
            }
        }
    }

    /// The same in the precision of an engine, counted from `middle`.
    #[inline(always)]
    pub fn around(&self, block: usize, middle: [f64; 2]) -> [[f32; 16]; 2] {
        let places = self.of_block(block);
        let mut around = [[0.0; 16]; 2];
        for axis in 0..2 {
            for i in 0..16 {
                around[axis][i] = (places[axis][i] - middle[axis]) as f32;
            }
        }
        around
    }
}

/// What sixteen rays of a block have of the four lines that start with line `first`.
#[inline(always)]
fn spread<T: Copy + Default>(lines: &[T; EDGE], first: usize, axis: usize) -> [T; 16] {
    let four: [T; 4] = lines[first..].first_chunk().copied().unwrap_or_default();
    // Not `map`: what it makes of long arrays is a call.
    let mut all = [T::default(); 16];
    for (to, &i) in all.iter_mut().zip(&BLOCK[axis]) {
        *to = four[i];
    }
    all
}

impl Pencil {
    /// Number of rays.
    pub fn len(&self) -> usize {
        self.live.len() * 16
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.live.is_empty()
    }

    /// Number of live rays.
    pub fn live_count(&self) -> u64 {
        self.live.iter().map(|live| u64::from(live.count_ones())).sum()
    }

    /// Makes `rays` these rays.
    pub fn fill<S: Real>(&self, rays: &mut Rays<S>) {
        let count = self.len();
        rays.prepare(count);
        for axis in 0..3 {
            let [right, up, forward] = each(|k| f64x8::splat(self.axes[k][axis]));
            rays.org[axis][..count].fill(S::from_f64(self.origin[axis]));
            self.places.combine(&mut rays.dir[axis][..count], |a| a * right, |b| b * up, |a, b| a + b + forward);
        }
        rays.t_min[..count].fill(S::ZERO);
        rays.t_max[..count].fill(S::INFINITY);
        self.kill(rays);
    }

    /// Makes the rays dead that are not live.
    pub fn kill<S: Real>(&self, rays: &mut Rays<S>) {
        for (block, live) in self.live.iter().enumerate().filter(|(_, live)| **live != u16::MAX) {
            (0..16).filter(|i| live >> i & 1 == 0).for_each(|i| rays.kill(block * 16 + i));
        }
    }

    /// Directions of the rays of block `block`.
    #[cold]
    pub fn directions<S: Real>(&self, block: usize) -> [[S; 16]; 3] {
        let [a, b] = self.places.of_block(block);
        let [right, up, forward] = self.axes;
        std::array::from_fn(|axis| {
            std::array::from_fn(|i| S::from_f64(a[i] * right[axis] + b[i] * up[axis] + forward[axis]))
        })
    }
}

impl Places {
    /// Writes a number for each ray: `value` of what `first` and `second` make of its places.
    #[inline(always)]
    pub fn combine<S: Real>(
        &self,
        to: &mut [S],
        first: impl Fn(f64x8) -> f64x8,
        second: impl Fn(f64x8) -> f64x8,
        value: impl Fn(f64x8, f64x8) -> f64x8,
    ) {
        let (blocks, _) = to.as_chunks_mut::<16>();
        match self {
            Self::Grid([columns, rows]) => {
                // Once for all blocks of the same four columns, or rows. Both halves of a block have all four columns.
                let mut across = [f64x8::ZERO; EDGE / 4];
                let mut down = [[f64x8::ZERO; 2]; EDGE / 4];
                for four in 0..EDGE / 4 {
                    let [left, _] = halves(&spread(columns, 4 * four, 0));
                    across[four] = first(left);
                    let [upper, lower] = halves(&spread(rows, 4 * four, 1));
                    down[four] = [second(upper), second(lower)];
                }
                for (block, to) in blocks.iter_mut().enumerate() {
                    let [x, y] = corner(block);
                    let (a, [upper, lower]) = (across[x / 4], down[y / 4]);
                    round([value(a, upper), value(a, lower)], to);
                }
            }
            Self::Each(_) => {
                for (block, to) in blocks.iter_mut().enumerate() {
                    let [[a, c], [b, d]] = self.of_block(block).each_ref().map(halves);
                    round([value(first(a), second(b)), value(first(c), second(d))], to);
                }
            }
        }
    }
}

/// The numbers of a block in two vectors.
#[inline(always)]
fn halves(of_block: &[f64; 16]) -> [f64x8; 2] {
    let half = |at: usize| f64x8::new(of_block[at..].first_chunk().copied().unwrap_or([0.0; 8]));
    [half(0), half(8)]
}

/// Rounds the numbers of a block to the precision of `to`.
#[inline(always)]
fn round<S: Real>(halves: [f64x8; 2], to: &mut [S; 16]) {
    for (half, to) in halves.iter().zip(to.as_chunks_mut::<8>().0) {
        let half = half.to_array();
        for i in 0..8 {
            to[i] = S::from_f64(half[i]);
        }
    }
}
