//! Where a quartic is not positive on an interval, by lanes: the roots of each derivative part the interval into pieces
//! on which the next one is monotone (Collins, Loos, "Polynomial real root isolation by differentiation", 1976).
//! What is inside is told by signs alone at common points, so the number of boundaries is always even; closed forms
//! lose their digits just where a line grazes.

use crate::lanes::{LaneMask, Lanes, Real};

/// Most steps of one root: bisection alone needs one per bit.
const STEPS: u32 = 64;

/// A quartic: coefficients of 1, s, s^2, s^3, s^4.
pub type Quartic<V> = [V; 5];

/// Calls `emit(lanes, in, out)` for every span of -1..1 where `p` <= 0, in order. `ends_outside`: the ends of the
/// interval count as positive whatever rounding says.
#[inline(always)]
pub fn spans<V: Lanes>(p: &Quartic<V>, ends_outside: bool, mut emit: impl FnMut(V::Mask, V, V)) {
    let lanes = !is_positive(p) & V::Mask::from_bits(V::ALL);
    if !lanes.any() {
        return;
    }
    let (low, high) = (V::constant(-1.0), V::constant(1.0));
    let slope = [p[1], twice(p[2]), V::constant(3.0) * p[3], twice(twice(p[4]))];
    let [e1, e2] = bends(p);
    // Extrema only need to be known to the root of the precision: the quartic is flat there.
    let epsilon = V::Scalar::EPSILON.to_f64();
    let (coarse, fine) = (epsilon.sqrt(), 4.0 * epsilon);
    let ends = [low, e1, e2, high];
    let slopes = [value(&slope, low), value(&slope, e1), value(&slope, e2), value(&slope, high)];
    let turn = |i: usize| {
        let piece = Piece { ends: [ends[i], ends[i + 1]], values: [slopes[i], slopes[i + 1]], flat: FLAT[i] };
        monotone_root(&slope, lanes, &piece, coarse)
    };
    let points = [low, turn(0), turn(1), turn(2), high];
    let values = [low, points[1], points[2], points[3], high].map(|s| value(p, s));
    let zero = V::constant(0.0);
    let mut inside = values.map(|value| value.cmp_le(zero) & lanes);
    if ends_outside {
        (inside[0], inside[4]) = (V::Mask::from_bits(0), V::Mask::from_bits(0));
    }
    let mut opened = low;
    for i in 0..4 {
        let (enters, leaves) = (!inside[i] & inside[i + 1], inside[i] & !inside[i + 1]);
        if (enters | leaves).any() {
            let flat = [i > 0, i < 3];
            let piece = Piece { ends: [points[i], points[i + 1]], values: [values[i], values[i + 1]], flat };
            let root = monotone_root(p, enters | leaves, &piece, fine);
            opened = V::select(enters, root, opened);
            if leaves.any() {
                emit(leaves, opened, root);
            }
        }
    }
    if inside[4].any() {
        emit(inside[4], opened, high);
    }
}

/// Which ends of the pieces of a slope are its own extrema.
const FLAT: [[bool; 2]; 3] = [[false, true], [true, true], [true, false]];

/// Lanes where `p` is positive on all of -1..1, beyond any rounding, as its Bernstein coefficients there tell; not all such
/// lanes are found.
#[inline(always)]
fn is_positive<V: Lanes>(p: &Quartic<V>) -> V::Mask {
    let (even, odd) = (p[0] + p[4], p[1] + p[3]);
    let (outer, half) = (even + p[2], V::constant(0.5) * (p[1] - p[3]));
    let middle = p[2].mul_add(V::constant(-1.0 / 3.0), even);
    let inner = p[0] - p[4];
    let least = (outer - odd.abs()).fast_min(inner - half.abs()).fast_min(middle);
    let size = p[0].abs() + p[1].abs() + p[2].abs() + p[3].abs() + p[4].abs();
    (size * V::constant(32.0 * V::Scalar::EPSILON.to_f64())).cmp_lt(least)
}

#[inline(always)]
fn twice<V: Lanes>(x: V) -> V {
    x + x
}

/// Value of a polynomial (Horner's rule).
#[inline(always)]
fn value<V: Lanes, const N: usize>(p: &[V; N], s: V) -> V {
    let mut sum = p[N - 1];
    for i in (0..N - 1).rev() {
        sum = sum.mul_add(s, p[i]);
    }
    sum
}

/// Value, first derivative and half the second one of a polynomial.
#[inline(always)]
fn expansion<V: Lanes, const N: usize>(p: &[V; N], s: V) -> [V; 3] {
    let zero = V::constant(0.0);
    let (mut value, mut first, mut second) = (p[N - 1], zero, zero);
    for i in (0..N - 1).rev() {
        // The leading terms, whose factors are zero, are not for the compiler to find.
        if i + 3 < N {
            second = second.mul_add(s, first);
        } else if i + 3 == N {
            second = first;
        }
        first = if i + 2 < N { first.mul_add(s, value) } else { value };
        value = value.mul_add(s, p[i]);
    }
    [value, first, second]
}

/// Ascending points of -1..1 between which the second derivative keeps its sign.
#[inline(always)]
fn bends<V: Lanes>(p: &Quartic<V>) -> [V; 2] {
    // Half of it: a s^2 + 2 b s + c.
    let (a, b, c) = (V::constant(6.0) * p[4], V::constant(1.5) * p[3], p[2]);
    let zero = V::constant(0.0);
    let root = b.mul_add(b, -(a * c)).fast_max(zero).sqrt();
    let q = V::select(b.cmp_lt(zero), root - b, -(b + root));
    // A root that is not a number is none: any point will do.
    let inner = |s: V| s.fast_min(V::constant(1.0)).fast_max(V::constant(-1.0));
    let (r0, r1) = (inner(q / a), inner(c / q));
    [r0.fast_min(r1), r0.fast_max(r1)]
}

/// Part of the line on which a polynomial is monotone.
struct Piece<V> {
    ends: [V; 2],
    /// Its values there.
    values: [V; 2],
    /// Whether its slope is zero there.
    flat: [bool; 2],
}

impl<V: Lanes> Piece<V> {
    /// About where the polynomial is zero, as if it were a parabola around its flat end or, between two of them, a cubic.
    #[inline(always)]
    fn guess(&self) -> V {
        let ([from, to], [a, b]) = (self.ends, self.values.map(V::abs));
        let (part, width) = (a / (a + b), to - from);
        let rest = V::constant(1.0) - part;
        match self.flat {
            [false, true] => to - width * rest.sqrt(),
            [true, false] => width.mul_add(part.sqrt(), from),
            _ => {
                // 3 x^2 - 2 x^3 is `part` at about this x, up to the middle.
                let root = part.fast_min(rest).sqrt();
                let x = root * root.mul_add(V::constant(0.1835), V::constant(0.57735));
                V::select(part.cmp_lt(rest), width.mul_add(x, from), to - width * x)
            }
        }
    }
}

/// In `lanes` the root of `p` on a piece of the line; the piece's end where `p` has one sign there. Newton's iteration kept
/// within a shrinking bracket, until what a step leaves is below `tolerance`; lanes that are done stay as they are.
#[inline(always)]
fn monotone_root<V: Lanes, const N: usize>(p: &[V; N], lanes: V::Mask, piece: &Piece<V>, tolerance: f64) -> V {
    let (zero, half, one) = (V::constant(0.0), V::constant(0.5), V::constant(1.0));
    let [from, to] = piece.ends;
    let [rises, ends_below] = [piece.values[0].cmp_le(zero), piece.values[1].cmp_le(zero)];
    let mut todo = lanes & ((rises & !ends_below) | (!rises & ends_below));
    if !todo.any() {
        return to;
    }
    // Rising in all lanes.
    let sign = V::select(rises, one, -one);
    let mut rising = *p;
    rising.iter_mut().for_each(|x| *x = *x * sign);
    let (near, tolerance) = (V::constant(4.0 * tolerance.sqrt()), V::constant(tolerance));
    let (mut lo, mut hi) = (from, to);
    let mut s = V::select(todo, piece.guess(), to);
    for _ in 0..STEPS {
        let [here, slope, bend] = expansion(&rising, s);
        let before = here.cmp_le(zero);
        lo = V::select(before, s, lo);
        hi = V::select(before, hi, s);
        let newton = s - here / slope;
        let kept = lo.cmp_lt(newton) & newton.cmp_lt(hi);
        let next = V::select(kept, newton, half * (lo + hi));
        let step = (next - s).abs();
        // What Newton's step leaves is about step^2 bend / slope.
        let settled = kept & step.cmp_le(near) & (step * step * bend.abs()).cmp_le(slope * tolerance);
        s = V::select(todo, next, s);
        todo = todo & !(settled | step.cmp_le(tolerance));
        if !todo.any() {
            break;
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{f32x8, f64x4};

    /// (s - a) (s - b) (s - c) (s - d).
    fn with_roots(r: [f64; 4]) -> [f64; 5] {
        let [a, b, c, d] = r;
        let pairs = |i: usize| (0..4).filter(|&j| j != i).map(|j| r[i] * r[j]).sum::<f64>();
        let (e2, e3) = ((0..4).map(pairs).sum::<f64>() / 2.0, a * b * c + a * b * d + a * c * d + b * c * d);
        [a * b * c * d, -e3, e2, -(a + b + c + d), 1.0]
    }

    fn spans_of<V: Lanes>(p: [f64; 5], ends_outside: bool) -> Vec<[f64; 2]> {
        let mut found = Vec::new();
        spans(&p.map(V::constant), ends_outside, |lanes, a: V, b: V| {
            assert!(lanes.bits() == V::ALL, "all lanes hold the same quartic");
            found.push([a.lane(0).to_f64(), b.lane(0).to_f64()]);
        });
        found
    }

    fn close(got: &[[f64; 2]], want: &[[f64; 2]], tolerance: f64) {
        let near = |g: &[f64; 2], w: &[f64; 2]| (0..2).all(|i| (g[i] - w[i]).abs() <= tolerance);
        assert!(got.len() == want.len() && got.iter().zip(want).all(|(g, w)| near(g, w)), "{got:?} {want:?}");
    }

    #[test]
    fn roots_by_hand() {
        for (roots, want) in [
            ([-0.5, -0.25, 0.25, 0.75], vec![[-0.5, -0.25], [0.25, 0.75]]),
            ([-2.0, -0.5, 0.5, 2.0], vec![[-1.0, -0.5], [0.5, 1.0]]),
            ([-2.0, 2.0, 3.0, 4.0], vec![[-1.0, 1.0]]),
            ([-0.9, 0.9, 5.0, 6.0], vec![[-0.9, 0.9]]),
            ([3.0, 4.0, 5.0, 6.0], vec![]),
        ] {
            close(&spans_of::<f64x4>(with_roots(roots), false), &want, 1e-13);
            close(&spans_of::<f64>(with_roots(roots), false), &want, 1e-13);
            close(&spans_of::<f32x8>(with_roots(roots), false), &want, 2e-5);
        }
        close(&spans_of::<f64>(with_roots([-0.9, 0.9, 5.0, 6.0]), true), &[[-0.9, 0.9]], 1e-13);
    }

    #[test]
    fn lower_degrees_and_constants() {
        // s^2 - 1/4, s - 1/2, -1, 1.
        close(&spans_of::<f64>([-0.25, 0.0, 1.0, 0.0, 0.0], false), &[[-0.5, 0.5]], 1e-14);
        close(&spans_of::<f64>([-0.5, 1.0, 0.0, 0.0, 0.0], false), &[[-1.0, 0.5]], 1e-14);
        close(&spans_of::<f64>([-1.0, 0.0, 0.0, 0.0, 0.0], false), &[[-1.0, 1.0]], 0.0);
        close(&spans_of::<f64>([1.0, 0.0, 0.0, 0.0, 0.0], false), &[], 0.0);
        close(&spans_of::<f64>([f64::NAN; 5], false), &[], 0.0);
    }

    #[test]
    fn a_lane_does_not_depend_on_its_neighbours() {
        let all = [[-0.5, -0.25, 0.25, 0.75], [-0.7, -0.7, 0.1, 0.1001], [-2.0, 0.3, 3.0, 4.0], [3.0, 4.0, 5.0, 6.0]];
        let p: [f64x4; 5] = std::array::from_fn(|k| f64x4::new(all.map(|r| with_roots(r)[k])));
        let mut lanes = [const { Vec::new() }; 4];
        spans(&p, false, |mask, a, b| {
            for (i, list) in lanes.iter_mut().enumerate().filter(|(i, _)| mask.bits() >> i & 1 != 0) {
                list.push([a.lane(i).to_bits(), b.lane(i).to_bits()]);
            }
        });
        for (roots, got) in all.into_iter().zip(lanes) {
            let want: Vec<_> = spans_of::<f64>(with_roots(roots), false).iter().map(|s| s.map(f64::to_bits)).collect();
            assert_eq!(got, want, "{roots:?}");
        }
    }
}
