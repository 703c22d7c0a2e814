//! SIMD lanes: the only door to the `wide` crate.
//!
//! A kernel is written once, generic over [`Lanes`], and instantiated for `f32` x 4, 8, 16, `f64` x 2, 4, 8, two
//! vectors side by side ([`Pair`]), and the plain scalars (width 1: the scalar engines). Every operation here is
//! exactly rounded or a pure selection, so lane `i` of any width computes the same bits as the scalar:
//!
//! * `+ - * /` and `sqrt` are IEEE; there is no approximate reciprocal (`wide`'s `recip` differs between widths).
//! * [`Lanes::mul_add`] is fused exactly when the build has the `fma` target feature, at every width.
//! * [`Lanes::fast_min`] and [`Lanes::fast_max`] return the *second* operand when either is NaN (x86 `minps`);
//!   `a.fast_min(b)` is `if a < b { a } else { b }`. Put the accumulator second where a NaN must not win.
//!
//! In registers a mask is whatever the machine likes ([`Lanes::Mask`]); everywhere else (memory, calls, counters)
//! masks are bit masks in a `u32`, bit `i` for lane `i`.

pub mod ahead;
pub mod chosen;
mod column;
mod ftz;
pub mod functions;
mod isa;
pub mod marks;
mod masked;
pub mod minima;
mod moved;
mod pages;
mod pair;
pub mod past;
pub mod rows;
mod scalar;
pub mod space;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod startup;
mod vector;
pub mod words;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub use column::Column;
pub use ftz::FlushDenormals;
pub use isa::{compiled_features, compiled_isa};
pub use pages::{ask_for_large_pages, on_large_pages, with_large_pages};
pub use pair::Pair;

/// Single-precision vectors by width.
pub use wide::{f32x4, f32x8, f32x16};
/// Double-precision vectors by width.
pub use wide::{f64x2, f64x4, f64x8};

/// Widest vector any kernel is instantiated for; per-lane arrays in memory have this length.
pub const MAX_LANES: usize = 16;

/// A mask in registers: one truth value per lane.
pub trait LaneMask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit `i` is lane `i`.
    fn bits(self) -> u32;
    /// Lane `i` is bit `i`; higher bits are ignored.
    fn from_bits(bits: u32) -> Self;
    /// Whether any lane is set.
    fn any(self) -> bool;
}

/// A vector of [`Lanes::N`] scalars.
pub trait Lanes:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The scalar in each lane.
    type Scalar: Real;
    /// Result of comparisons.
    type Mask: LaneMask;
    /// Number of lanes.
    const N: usize;
    /// Mask bits of all lanes.
    const ALL: u32 = if Self::N == 32 { u32::MAX } else { (1 << Self::N) - 1 };

    /// The same value in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// The first `N` values of `from`; panics if there are fewer.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes the lanes to the first `N` values of `to`; panics if there are fewer.
    fn store(self, to: &mut [Self::Scalar]);
    /// One lane (slow: for rare paths and tests).
    fn lane(self, i: usize) -> Self::Scalar;
    /// `if_true` where the mask is set.
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;
    /// `self` where the mask is set, zero elsewhere.
    fn kept(self, mask: Self::Mask) -> Self;
    /// `if self < other { self } else { other }`.
    fn fast_min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`.
    fn fast_max(self, other: Self) -> Self;
    /// `self * b + c`, fused iff the build has FMA.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Negated where the sign bit of `sign` is set.
    fn turned_as(self, sign: Self) -> Self;
    /// Square root; NaN for negative numbers.
    fn sqrt(self) -> Self;
    /// With the bits of `bits` set, too, where the mask is set.
    fn with_bits(self, mask: Self::Mask, bits: Self) -> Self;
    /// `self < other`, false for NaN.
    fn cmp_lt(self, other: Self) -> Self::Mask;
    /// `self <= other`, false for NaN.
    fn cmp_le(self, other: Self) -> Self::Mask;
    /// `self == other`, false for NaN.
    fn cmp_eq(self, other: Self) -> Self::Mask;

    /// The lanes whose bits are set, moved to the front in order; zeros behind them.
    #[inline(always)]
    fn packed(self, bits: u32) -> Self {
        let (mut from, mut to) = ([Self::Scalar::ZERO; MAX_LANES], [Self::Scalar::ZERO; MAX_LANES]);
        self.store(&mut from);
        let lanes = chosen::lanes_of(bits & Self::ALL);
        to.iter_mut().zip(lanes).for_each(|(to, lane)| *to = from[lane % MAX_LANES]);
        Self::load(&to)
    }

    /// The values of `from` at the places `at`, one per lane, all below `2 N`; `from` has `2 N` values.
    #[inline(always)]
    fn near(from: &[Self::Scalar], at: &[u32; MAX_LANES]) -> Self {
        let (from, mut to) = (&from[..2 * Self::N], [Self::Scalar::ZERO; MAX_LANES]);
        to.iter_mut().zip(at).take(Self::N).for_each(|(to, &at)| *to = from[at as usize % (2 * Self::N)]);
        Self::load(&to)
    }

    /// Smallest and largest value of the lanes in `mask` (not empty, no NaN).
    #[inline(always)]
    fn range(self, mask: u32) -> (Self::Scalar, Self::Scalar) {
        let set = Self::Mask::from_bits(mask);
        let mut low = [Self::Scalar::INFINITY; MAX_LANES];
        let mut high = [Self::Scalar::LOWEST; MAX_LANES];
        Self::select(set, self, Self::splat(Self::Scalar::INFINITY)).store(&mut low);
        Self::select(set, self, Self::splat(Self::Scalar::LOWEST)).store(&mut high);
        let mut half = Self::N / 2;
        while half > 0 {
            for i in 0..half {
                low[i] = low[i].fast_min(low[i + half]);
                high[i] = high[i].fast_max(high[i + half]);
            }
            half /= 2;
        }
        (low[0], high[0])
    }

    /// `self < other` in the lanes of `mask`.
    #[inline(always)]
    fn cmp_lt_in(self, other: Self, mask: Self::Mask) -> Self::Mask {
        mask & self.cmp_lt(other)
    }
    /// `self <= other` in the lanes of `mask`.
    #[inline(always)]
    fn cmp_le_in(self, other: Self, mask: Self::Mask) -> Self::Mask {
        mask & self.cmp_le(other)
    }
    /// `self > other`, false for NaN.
    #[inline(always)]
    fn cmp_gt(self, other: Self) -> Self::Mask {
        other.cmp_lt(self)
    }
    /// `self >= other`, false for NaN.
    #[inline(always)]
    fn cmp_ge(self, other: Self) -> Self::Mask {
        other.cmp_le(self)
    }
    /// The same value from an f64 constant in every lane.
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
}

/// A scalar the engines compute in: `f32` or `f64`. It is its own vector of one lane.
pub trait Real:
    Lanes<Scalar = Self, Mask = bool> + PartialOrd + Default + Send + Sync + bytemuck::Pod + 'static
{
    /// Eight lanes of this scalar: what an 8-wide node is tested with.
    type Octo: Lanes<Scalar = Self>;
    /// The widest vector of this scalar that fills 64 bytes: what shading computes in.
    type Wide: Lanes<Scalar = Self>;
    /// What the nodes of streams and tiles are tested with: as many lanes as one register holds, but eight at least.
    type Children: Lanes<Scalar = Self>;
    /// Half the distance from 1 to the next larger number.
    const EPSILON: Self;
    /// Smallest positive normal number.
    const MIN_POSITIVE: Self;
    /// Largest finite number.
    const MAX: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Negative infinity.
    const LOWEST: Self;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// From f64, rounded to nearest.
    fn from_f64(x: f64) -> Self;
    /// To f64, exact.
    fn to_f64(self) -> f64;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// The largest number below a finite `self`.
    fn next_down(self) -> Self;
    /// The smallest number above a finite `self`.
    fn next_up(self) -> Self;
    /// Bit `bit`, below 64, in the bits of one or two scalars: the lower half of a word and the upper one where a scalar has 32.
    fn marks(bit: usize) -> [Self; 2];
    /// The word of 64 bits that is made of two scalars' bits.
    fn word(halves: [Self; 2]) -> u64;
    /// Which of 64 numbers `self` does not exceed, as bits.
    #[inline(always)]
    fn reached(self, of: &[Self; 64]) -> u64 {
        words::reached_by_vectors(self, of)
    }
    /// Rows and columns swapped.
    #[inline(always)]
    fn transposed(block: &[[Self; rows::ROW]; rows::ROW]) -> [[Self; rows::ROW]; rows::ROW] {
        rows::transposed(block)
    }
}

/// Three vectors: x, y and z of `N` points or directions.
pub type Lanes3<V> = [V; 3];

/// Dot product in a fixed operation order: `fma(a.z, b.z, fma(a.y, b.y, a.x * b.x))`.
#[inline(always)]
pub fn dot<V: Lanes>(a: Lanes3<V>, b: Lanes3<V>) -> V {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// `f` of 0, 1 and 2: axes or corners. Written out, because `[0, 1, 2].map(f)` becomes a call in large kernels.
#[inline(always)]
pub fn each<T>(mut f: impl FnMut(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

/// `f` of all three of `list`, written out as in [`each`].
#[inline(always)]
pub fn map3<A, B>(list: [A; 3], mut f: impl FnMut(A) -> B) -> [B; 3] {
    let [x, y, z] = list;
    [f(x), f(y), f(z)]
}

/// A reciprocal that is always finite: components below the smallest normal number count as that number.
/// With it `(bound - org) * rcp` can overflow to infinity but never gives NaN for finite input.
#[inline(always)]
pub fn finite_rcp<V: Lanes>(d: V) -> V {
    let least = V::splat(V::Scalar::MIN_POSITIVE);
    V::constant(1.0) / V::select(d.abs().cmp_lt(least), least, d)
}

#[cfg(test)]
mod tests;
